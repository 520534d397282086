"""Simulation engines by name.

Exudyn is imported when it is first needed: it loads the system's libGL, which not every machine has.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from fem_models.analytic import simulate_analytic
from fem_models.chain.solve import ChainSolution, simulate_chain, solve_chain
from fem_models.joint.possible import require_reach
from fem_models.load import LoadProgram
from fem_models.load.schedule import schedule
from fem_models.rig import Rig, RigError
from hysteresis.arrays import Floats
from hysteresis.extras import MissingError as MissingError
from hysteresis.extras import require_extra
from hysteresis.records.record import Record

if TYPE_CHECKING:
    from fem_models.load_control import LoadControlRun
    from fem_models.multibody.quasi_static import MultibodySolution
    from fem_models.spatial.drives import WheelProgram


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


def simulate_wheels(
    rig: Rig, program: WheelProgram, engine: EngineName | None = None, *, dynamic: bool = False
) -> Record:
    """Run a rig that bends in space: the chain in space by default, or the multibody model.

    Raises
    ------
    RigError
        An engine, or a run in time, that planar rigs alone have.
    """
    if dynamic:
        raise RigError(f"--dynamic with rig {rig.name}, which bends in space: expected a quasi-static run")
    if engine == "analytic":
        raise RigError(f"--engine {engine} with rig {rig.name}, which bends in space: expected chain or multibody")
    from fem_models.spatial import of_rig_in_space, simulate_in_space
    from fem_models.spatial.motion.run_record import record_of

    if engine != "multibody":
        return simulate_in_space(rig, program)
    require_exudyn()
    from fem_models.multibody.spatial.solve import solve_spatial_multibody

    run = solve_spatial_multibody(of_rig_in_space(rig), program.of_tendons(rig))
    return record_of(rig, program, run, "multibody in space")


ENGINES: dict[EngineName, Callable[[Rig, LoadProgram], Record]] = {
    "multibody": _simulate_multibody,
    "chain": simulate_chain,
    "analytic": simulate_analytic,
}
QUASI_STATIC: frozenset[EngineName] = frozenset(ENGINES)
"""Engines whose curve does not depend on the times of a program, except with creep of the tendons and viscous drag."""
