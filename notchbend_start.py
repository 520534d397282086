"""Start of the command ``notchbend``, and the check that its packages are its own.

The packages have names that others use, too: ``hysteresis``, ``studies``, ``validation``. Python takes the one that it
finds first, and what follows is an error that names neither.
"""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("hysteresis", "fem_models", "validation", "studies")


def require_own_packages() -> None:
    """Check that Python finds the packages beside this file.

    Raises
    ------
    ImportError
        One line: the package, where another one was found, and what to do.
    """
    home = Path(__file__).resolve().parent
    for name in PACKAGES:
        spec = find_spec(name)
        if spec is None:
            raise ImportError(f"package {name} is not beside {home}: expected a complete installation of notchbend")
        found = Path(spec.origin or next(iter(spec.submodule_search_locations or [name]))).resolve()
        if found != home / name / "__init__.py":
            raise ImportError(
                f"package {name} is found in {found}, not in {home}: expected no other package of that name before "
                "notchbend: run in another folder, rename it, or give notchbend an environment of its own"
            )


def use_one_blas_thread() -> None:
    """Let numpy and scipy factorise matrices in one thread, unless the user says otherwise; before they are imported.

    Matrices are small here: threads wait for each other longer than they compute, on busy cores hundreds of times as
    long. And sums do not depend on the number of cores then.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main() -> None:
    """Run the command line, or print one line where other packages stand before those of notchbend."""
    try:
        require_own_packages()
    except ImportError as error:
        print(f"notchbend: {error}", file=sys.stderr)  # noqa: T201
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
    use_one_blas_thread()
    from studies.stops import StoppedError, end, leave, stoppable, watch

    try:
        with stoppable():  # imports take a second
            watch()
            from studies.commands.cli import main as run

            run()
    except StoppedError as stop:
        leave(end(stop))
