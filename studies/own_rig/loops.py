"""What a simulated loop says of a design: its strain against the limits of Nitinol, and its energy balance."""

from __future__ import annotations

import io
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_models.analytic import simulate_analytic
from fem_models.joint.strain import FATIGUE
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.view import SceneError, render
from hysteresis.arrays import Floats, Ints
from hysteresis.attempts import attempt
from hysteresis.extras import MissingError
from hysteresis.files import write_files
from hysteresis.own import marked_png
from hysteresis.records.path import branches
from hysteresis.records.record import Record
from hysteresis.records.record_file import write_record
from studies.notebook.solid import wrist_figure
from studies.own_rig.strain import Strain, strain_of
from studies.report.tube import wrist_tube, write_stored, write_tube
from studies.results.run import Picture, RunLoop, loop_summary

if TYPE_CHECKING:
    from fem_models.multibody.quasi_static import MultibodySolution

_SLACK = 0.01
_AMPLITUDES = 401
_DPI = 150


@dataclass(frozen=True)
class Energy:
    """Work of the wheel and losses over the last cycle, and the error of the energy balance."""

    wheel_work_mJ: float
    friction_loss_mJ: float
    material_loss_mJ: float
    viscous_loss_mJ: float
    energy_gap_percent: float


def write_loop(
    rig: Rig, program: LoadProgram, theory: LoadProgram, out: Path, name: str, ideal: Rig | None = None
) -> tuple[MultibodySolution, RunLoop]:
    """Simulate a loop with the multibody model, and write it and the analytic curve of the rig as records.

    Parameters
    ----------
    program, theory
        Drives of the loop, which ends with a closed cycle, and of the analytic curve.
    out, name
        The records are ``OUT/records/NAME.csv`` and ``OUT/records/NAME-analytic.csv``.
    ideal
        Rig of the analytic curve, without effects; by default the rig itself.

    Raises
    ------
    SolverError, RigError, RecordError
        A rig that cannot follow the drive, or a folder that cannot be written to.
    """
    from fem_models.multibody.quasi_static import solve_multibody  # Exudyn, which rigs in space do without

    solution = solve_multibody(rig, program)
    write_record(solution.record, out / "records" / f"{name}.csv")
    curve = f"{name}-analytic"
    write_record(simulate_analytic(ideal or rig, theory), out / "records" / f"{curve}.csv")
    parts = (loop_summary(solution.record), energy_summary(solution), strain_summary(rig, solution))
    numbers = {key: value for part in parts for key, value in vars(part).items()}
    drive, both_ways = solution.record.drive, rig.tendon_b is not None
    loop = RunLoop(
        record=name,
        theory=curve,
        preload_N=rig.preload_N,
        slack_from_mm=slack_from_mm(rig.preload_N, drive, solution.segment_tensions_N) if both_ways else None,
        fatigue_amplitude_mm=fatigue_amplitude_mm(drive, solution.peak_strain, both_ways=both_ways),
        **numbers,
    )
    return solution, loop


def fatigue_amplitude_mm(drive: Floats, strain: Floats, *, both_ways: bool) -> float | None:
    """Find the amplitude of a cycle beyond which a fibre alternates by more than the limit of fatigue.

    Parameters
    ----------
    drive, strain
        Shapes (m,) and (m, N): a run whose last branch rises from one end of a closed cycle to the other. The cycle is
        from -x to x, and not ``both_ways``, of a single tendon, from 0 to x; a fibre's strain amplitude is half its
        range on that branch.

    Returns
    -------
    float or None
        None if the whole branch keeps the limit, or the strain is not known.
    """
    part = branches(drive)[-1]
    x, e = drive[part], strain[part]
    if not np.isfinite(e).all() or x[-1] <= x[0]:
        return None
    amplitude = np.linspace(0.0, float(min(x[-1], -x[0]) if both_ways else x[-1]), _AMPLITUDES)
    back = -amplitude if both_ways else np.zeros_like(amplitude)
    half = [0.5 * np.abs(np.interp(amplitude, x, one) - np.interp(back, x, one)) for one in e.T]
    worst = np.maximum.accumulate(np.max(half, axis=0))
    if worst[-1] <= FATIGUE.strain:
        return None
    return float(np.interp(FATIGUE.strain, worst, amplitude))


def slack_from_mm(preload_N: float, drive: Floats, tensions_N: Floats) -> float | None:
    """Give the smallest drive, shape (m,), at which a tendon is slack: at 1 % of the preload or less.

    ``tensions_N``, shape (m, ...), are those of all pieces of tendon. None where none is slack, or without a preload.
    """
    if preload_N <= 0:
        return None
    slack = tensions_N.reshape(len(drive), -1).min(axis=1) <= _SLACK * preload_N
    return float(np.abs(drive[slack]).min()) if slack.any() else None


def strain_summary(rig: Rig, solution: MultibodySolution) -> Strain:
    """Find the peak strain of a run, and the drives at which limits of Nitinol are exceeded; None where none is.

    Of measured joints, whose section is not known, the peak is NaN and there are no limits.
    """
    return strain_of(rig, solution.record.drive, solution.peak_strain)


def energy_summary(solution: MultibodySolution) -> Energy:
    """Sum the work of the wheel and the losses over the last cycle; what jumps lose is among the viscous ones."""
    s, cycle = solution, solution.record.cycle
    assert cycle is not None
    return energy_of_cycle(
        cycle, np.array([s.wheel_work_mJ, s.friction_loss_mJ, s.material_loss_mJ, s.viscous_loss_mJ + s.jump_loss_mJ])
    )


def energy_of_cycle(cycle: Ints, energies_mJ: Floats) -> Energy:
    """Sum over the last cycle: work, losses by friction, in the material, viscous ones; from the start, (4, m)."""
    last = np.flatnonzero(cycle == cycle[-1])
    work, friction, material, viscous = (energies_mJ[:, last[-1]] - energies_mJ[:, last[0] - 1]).tolist()
    # a rig that dissipates nothing has neither work nor losses; the gap is then that of rounding
    gap = 100 * (friction + material + viscous - work) / work if abs(work) > 1e-9 else 0.0
    return Energy(work, friction, material, viscous, gap)


def draw_rig(rig: Rig, record: Record, out: Path) -> Picture:
    """Draw the tube at full drive, in space where it bends most in both planes, else in one: ``tube.json``, a PNG.

    Where that cannot be done there is no picture, and the result says why.
    """
    if rig.is_planar:
        at = int(np.argmax(record.angle_deg))
        caption = f"{rig.name} at {record.drive[at]:g} mm, {record.angle_deg[at]:.1f} deg"
    else:
        y, z = record.angle_deg, record.angle_2_deg
        assert z is not None
        both = np.minimum(y, z)
        at = int((both if both.max() > 1.0 else np.hypot(y, z)).argmax())
        caption = f"{rig.name}, bent by {y[at]:.1f} deg towards y and {z[at]:.1f} deg towards z"
    joints, failed = joints_deg(record)[at], list[str]()
    draw = _draw if rig.is_planar else _draw_wrist
    picture = attempt("not drawn", lambda: draw(rig, joints, caption, out), None, failed)
    return Picture(caption=caption, missing=failed[0]) if picture is None else picture


def _draw_wrist(rig: Rig, joints: Floats, caption: str, out: Path) -> Picture:
    picture = io.BytesIO()
    wrist_figure(rig, joints).savefig(picture, format="png", dpi=_DPI)
    write_stored(wrist_tube(rig, joints), out / "tube.json")
    write_files({out / "tube.png": marked_png(picture.getvalue())})
    return Picture(tube="tube.json", caption=caption, file="tube.png")


def _draw(rig: Rig, joints: Floats, caption: str, out: Path) -> Picture:
    try:
        write_tube(rig, joints, out / "tube.json")
    except (SceneError, RigError, MissingError) as error:  # joints that were measured have no shape to draw
        return Picture(caption=caption, missing=str(error))
    try:
        with tempfile.TemporaryDirectory() as folder:  # in ``out`` it would stay there if the process is killed
            render(rig, joints, Path(folder) / "tube.png")
            write_files({out / "tube.png": marked_png((Path(folder) / "tube.png").read_bytes())})
    except SceneError as error:
        return Picture(tube="tube.json", caption=caption, missing=str(error))
    return Picture(tube="tube.json", caption=caption, file="tube.png")


def joints_deg(record: Record) -> Floats:
    """Give the angles of the notches of a simulated record, shape (m, N), deg."""
    assert record.notches_deg is not None  # every engine gives them
    return record.notches_deg
