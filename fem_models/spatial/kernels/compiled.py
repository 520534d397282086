"""How the kernels of the chain in space are compiled: see :mod:`fem_models.compiled`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fem_models.compiled import Kernel, njit_of
from fem_models.load import stepping

_HERE = Path(__file__).parent
SOURCES = [*sorted(_HERE.glob("*.py")), *sorted(_HERE.parent.glob("*.py")), Path(stepping.__file__)]
"""All files that the kernels and their types come from: those of this room, and the step control."""

_kernel = njit_of(*SOURCES)


def spatial_njit(*, from_python: bool = False, **options: Any) -> Callable[[Kernel], Any]:
    """Give the decorator of the kernels, which make no arrays (see :func:`fem_models.compiled.njit_of`).

    Most are called by other kernels only: without an entry from Python they compile in half the time.
    """
    return _kernel(allocates=False, no_cpython_wrapper=not from_python, no_cfunc_wrapper=True, **options)
