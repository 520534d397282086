"""Simulation engines by name, and load programs from a file.

Exudyn is imported when it is first needed: it loads the system's libGL, which not every machine has.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from fem_models.analytic import simulate_analytic
from fem_models.chain.solve import ChainSolution, simulate_chain, solve_chain
from fem_models.joint.possible import require_reach
from fem_models.load import LoadProgram
from fem_models.load.schedule import schedule
from fem_models.rig import Rig, RigError
from hysteresis.arrays import Floats
from hysteresis.extras import MissingError as MissingError
from hysteresis.extras import require_extra
from hysteresis.messages import listed
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import column_names, read_columns

if TYPE_CHECKING:
    from fem_models.load_control import LoadControlRun
    from fem_models.multibody.quasi_static import MultibodySolution


EngineName = Literal["multibody", "chain", "analytic"]


def require_exudyn() -> None:
    """Import Exudyn, or report in one line what is missing.

    Raises
    ------
    MissingError
        Exudyn is missing, or a system library that it loads.
    """
    try:
        import exudyn  # noqa: F401
    except ImportError as error:
        library = re.search(r"lib[\w+-]+\.so[.\d]*", str(error))
        missing = f"the system's {library[0]} is missing" if library else " ".join(str(error).split())
        raise MissingError(f"exudyn cannot be imported: {missing}: expected for the multibody engine") from None


def require_gmsh() -> None:
    """Import gmsh, or report in one line what is missing.

    Raises
    ------
    MissingError
        A library of the extra ``solid`` is missing, or a system library that gmsh loads.
    """
    require_extra("solid", "the solid notch")
    try:
        import gmsh  # noqa: F401
    except (ImportError, OSError) as error:
        missing = " ".join(str(error).split())
        raise MissingError(f"gmsh cannot be imported: {missing}: expected for the solid notch") from None


def _simulate_multibody(rig: Rig, program: LoadProgram) -> Record:
    return simulate_counted(rig, program, "multibody", lambda done, of: None)


def simulate_counted(
    rig: Rig, program: LoadProgram, engine: EngineName, progress: Callable[[int, int], None]
) -> Record:
    """Run an engine; the multibody model reports how many samples are done, and of how many.

    A drive that no tendon bears is refused at once, where an engine would try for a minute.
    """
    if engine != "analytic":  # which knows no creep, and needs no times for it
        plan = schedule(rig, program)
        require_reach(rig, plan.drive_mm, plan.slack_mm)
    if engine != "multibody":
        return ENGINES[engine](rig, program)
    require_exudyn()
    from fem_models.multibody.quasi_static import solve_multibody

    return solve_multibody(rig, program, progress=progress).record


def solver_of(engine: str) -> Callable[[Rig, LoadProgram], ChainSolution | MultibodySolution]:
    """Give the solver of an engine, chain or multibody; its solution has tensions, strains and energies."""
    if engine == "chain":
        return solve_chain
    require_exudyn()
    from fem_models.multibody.quasi_static import solve_multibody

    return solve_multibody


def simulate_by_force(rig: Rig, force_N: Floats, engine: str) -> LoadControlRun:
    """Run an engine, chain or multibody, with a prescribed tension. See :mod:`fem_models.load_control`."""
    if engine == "multibody":
        require_exudyn()
    from fem_models.load_control import run_load_control

    return run_load_control(rig, force_N, "chain" if engine == "chain" else "multibody")


def simulate_in_time(rig: Rig, program: LoadProgram) -> Record:
    """Run the multibody model over time, with inertia. See :func:`fem_models.multibody.dynamic.solve_dynamic`."""
    require_exudyn()
    from fem_models.multibody.dynamic import simulate_dynamic

    return simulate_dynamic(rig, program)


ENGINES: dict[EngineName, Callable[[Rig, LoadProgram], Record]] = {
    "multibody": _simulate_multibody,
    "chain": simulate_chain,
    "analytic": simulate_analytic,
}
FORCE = "tendon_force_N"
"""Column of a program that prescribes the tension at the wheel, in place of ``drive_mm``."""
QUASI_STATIC: frozenset[EngineName] = frozenset(ENGINES)
"""Engines whose curve does not depend on the times of a program, except with creep of the tendons and viscous drag."""


def program_of_file(path: Path) -> LoadProgram:
    """Read a load program: a CSV with the column drive_mm and, where the rate matters, time_s.

    Raises
    ------
    RecordError, RigError
        One line with file, line, column, value and what was expected.
    """
    if "drive_mm" not in (names := column_names(path)):
        found = f"column {names[0]!r}" if len(names) == 1 else f"columns {listed(names)}"
        raise RecordError(f"{path}: {found}: expected 'drive_mm', and 'time_s' beside it, or {FORCE!r} alone")
    columns = read_columns(path, ["drive_mm"], optional=["time_s"])
    try:
        return LoadProgram(columns["drive_mm"], columns.get("time_s"))
    except RigError as error:
        raise RigError(f"{path}: {error}") from None


def forces_of_file(path: Path) -> Floats | None:
    """Read the tensions of a program, N: a CSV with the column ``tendon_force_N``, shape (rows,).

    Returns
    -------
    Floats or None
        None for a file without that column: :func:`program_of_file` reads it.

    Raises
    ------
    RecordError
        One line with file, line, column, value and what was expected.
    """
    names = column_names(path)
    if FORCE not in names:
        return None
    for other in ("drive_mm", "time_s"):
        if other in names:
            raise RecordError(
                f"{path}: column {other!r} beside {FORCE!r}: expected {FORCE!r} alone, applied step by step"
            )
    force = read_columns(path, [FORCE])[FORCE]
    if force.size < 2:
        raise RecordError(f"{path}: column {FORCE!r} has {force.size} values: expected at least 2")
    if (negative := np.flatnonzero(force < 0)).size:
        raise RecordError(f"{path}:{negative[0] + 2}: column {FORCE!r} = {force[negative[0]]:g}: expected at least 0")
    return force
