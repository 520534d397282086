"""One case of a study: inputs -> quantities. A case that fails reports why, and the others go on."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fem_models.analytic import simulate_analytic
from fem_models.chain.solve import chain_case, followed, solve_chain, strain_of_run, tip_angle_deg
from fem_models.joint import joint_row
from fem_models.joint.strain import largest_strains, peak_strain, strain_limits
from fem_models.load import LoadProgram, sine, triangle
from fem_models.rig import Rig
from fem_models.rig.in_space import rig_in_space_of_tables
from fem_models.rig.rig_file import rig_of_tables
from hysteresis import identify
from hysteresis.arrays import Floats
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.records.metrics import LoopsOverDrive, loop_width, loops_over
from hysteresis.records.record import MAX_MAGNITUDE, Record
from studies.engines import solver_of
from studies.in_space.quantities import groups_in_space, winds_both_ways
from studies.sweep.inputs import CaseInputs, CaseTables, ProgramTable, with_values
from studies.sweep.quantities import GROUPS, IN_SPACE, quantity_names
from validation.separation import loop_program, separate

Quantities = dict[str, float]

SLACK = 0.01
"""Share of the preload at which a tendon counts as slack: one with a toe region never loses all its tension."""


@dataclass(frozen=True)
class Outcome:
    """Result of a case: ``status`` is ok or failed; a failed case may have some of its quantities."""

    key: str
    status: str
    message: str
    wall_s: float
    quantities: Quantities


@dataclass(frozen=True)
class Run:
    """A simulation that the quantities are computed from.

    ``angle_deg`` has shape (m,), ``notches_deg`` (m, N); ``segments_N``, shape (m, tendons, k), are the tensions along
    the tendons; ``work_mJ``, shape (m,), is the work of the wheel, None for the analytic model; ``strain`` has the
    shape (m, N). ``record`` gives the record, which few quantities need.
    """

    angle_deg: Floats
    notches_deg: Floats
    segments_N: Floats
    work_mJ: Floats | None
    strain: Floats
    record: Callable[[], Record]


def program_of_table(table: ProgramTable, *, one_way: bool = False) -> LoadProgram:
    """Make the load program of a case; ``one_way`` goes from 0 to the amplitude and back, for rigs with one tendon.

    Raises
    ------
    RigError
        Values that make no program.
    """
    if table.drive_mm is not None:
        return LoadProgram(np.array(table.drive_mm), None if table.time_s is None else np.array(table.time_s))
    amplitude, cycles = table.amplitude_mm, table.cycles
    assert amplitude is not None
    assert cycles is not None
    if table.rate_Hz is not None:
        whole = sine(amplitude, table.rate_Hz, cycles=cycles)
    else:
        assert table.step_mm is not None
        whole = triangle(amplitude, step_mm=table.step_mm, cycles=cycles)
    return _one_way(whole, amplitude, table.rate_Hz) if one_way else whole


@lru_cache(maxsize=16)  # a study may vary the amplitude: every case then has its own
def _drive(table: ProgramTable, one_way: bool) -> LoadProgram:
    return program_of_table(table, one_way=one_way)


@lru_cache(maxsize=16)
def _loops(table: ProgramTable, one_way: bool) -> LoopsOverDrive | None:
    """Divide the drive of a program into its loops, the same for all cases; None if it does not count its cycles."""
    program = _drive(table, one_way)
    return None if program.cycle is None else loops_over(program.drive_mm, program.cycle)


def _one_way(whole: LoadProgram, amplitude: float, rate_Hz: float | None) -> LoadProgram:
    """Load to the amplitude, then unload to 0 and reload as often as ``whole`` has cycles, with its steps."""
    assert whole.cycle is not None
    cycles, branch = int(whole.cycle[-1]), int(np.argmax(whole.drive_mm))
    if rate_Hz is not None:
        branch *= 2  # from 0 to the amplitude is half a period
    k = np.arange(branch * (1 + 2 * cycles) + 1)
    cycle = np.where(k <= branch, 0, (k - branch - 1) // (2 * branch) + 1)
    if rate_Hz is None:
        return LoadProgram(amplitude * (1 - np.abs(k / branch % 2 - 1)), cycle=cycle)
    return LoadProgram(0.5 * amplitude * (1 - np.cos(np.pi * k / branch)), k / (2 * branch * rate_Hz), cycle)


def evaluate(key: str, inputs: CaseInputs) -> Outcome:
    """Run one case; an error becomes its message."""
    start, found, message = time.perf_counter(), dict[str, float](), ""
    names = quantity_names(inputs.engine, inputs.groups)
    try:
        _evaluate(inputs, found)
    except Exception as error:  # a case that fails must not stop the study
        message = " ".join((str(error) or type(error).__name__).split())
    quantities = {name: float(found.get(name, math.nan)) for name in names}
    return Outcome(key, "failed" if message else "ok", message, time.perf_counter() - start, quantities)


def _evaluate(inputs: CaseInputs, found: Quantities) -> None:
    """Fill ``found`` group by group, so that the groups computed before a failure are kept."""
    # with_values raises here, as it did when the case was made: its error becomes the message of the case
    tables: CaseTables = inputs if inputs.values is None else with_values(inputs, inputs.values)
    where = f"rig {tables.rig.get('name', '')}"
    if inputs.engine == IN_SPACE:
        wrist = rig_in_space_of_tables(tables.rig, where)
        drive = program_of_table(tables.program, one_way=not winds_both_ways(wrist))
        for part in groups_in_space(wrist, drive, inputs.groups):
            found |= part
        return
    rig = rig_of_tables(tables.rig, where)
    one_way = rig.tendon_b is None
    program = _drive(tables.program, one_way)
    engine, groups = inputs.engine, inputs.groups
    if engine == "solid":
        found |= _solid(rig, program)
        return
    run = _RUN[engine](rig, program)
    if "loop" in groups:
        loops = None if engine == "analytic" else _loops(tables.program, one_way)
        found |= _loop(rig, program, run, loops)
    if "strain" in groups:
        found |= _strain(rig, run.strain)
    if "notches" in groups:
        found |= _notches(run)
    if "contributions" in groups:
        with _named("contributions"):
            found |= _contributions(rig, program, engine)
    if "bouc-wen" in groups:
        with _named("bouc-wen"):
            found |= _bouc_wen(run.record(), inputs.seed)


@contextmanager
def _named(group: str) -> Iterator[None]:
    """Name the group that an error is from, if the other groups are known."""
    try:
        yield
    except Exception as error:
        raise RuntimeError(f"{group}: {error}") from error


def _run_chain(rig: Rig, program: LoadProgram) -> Run:
    """Run the chain without its record, whose checks would cost a third of the simulation.

    Numbers that a record does not take are refused as it refuses them.
    """
    case = chain_case(rig, program)
    done, _ = followed(rig, case)
    angle, notches, wheel_N = tip_angle_deg(done), np.degrees(done.angles), done.tensions[:, :, 0]
    strain = strain_of_run(case.joints, done)
    work = done.energies[:, 0]
    run = Run(
        angle, notches, done.tensions[:, : len(rig.tendons)], work, strain, lambda: solve_chain(rig, program).record
    )
    if not all(np.abs(part).max() <= MAX_MAGNITUDE for part in (angle, notches, wheel_N)):
        run.record()
    return run


def _run_multibody(rig: Rig, program: LoadProgram) -> Run:
    solution = solver_of("multibody")(rig, program)
    record, segments = solution.record, solution.segment_tensions_N[:, : len(rig.tendons)]
    assert record.notches_deg is not None
    strain, work = solution.peak_strain, solution.wheel_work_mJ
    return Run(record.angle_deg, record.notches_deg, segments, work, strain, lambda: record)


def _run_analytic(rig: Rig, program: LoadProgram) -> Run:
    record = simulate_analytic(rig, program)
    tensions = [record.tension_a_N] + ([] if rig.tendon_b is None else [record.tension_b_N])
    segments = np.stack([np.asarray(tension) for tension in tensions], axis=1)[:, :, None]
    assert record.notches_deg is not None
    strain = peak_strain(joint_row(rig), np.radians(record.notches_deg), thrust_N=segments.sum(axis=1))
    return Run(record.angle_deg, record.notches_deg, segments, None, strain, lambda: record)


_RUN = {"chain": _run_chain, "multibody": _run_multibody, "analytic": _run_analytic}


def _loop(rig: Rig, program: LoadProgram, run: Run, loops: LoopsOverDrive | None) -> Quantities:
    """Compute the group ``loop``; the analytic model has no loop, so that its widths and energy are NaN."""
    lowest = float(run.segments_N.min())
    found = {
        "full_scale_angle_deg": float(np.abs(run.angle_deg).max()),
        "tension_max_N": float(run.segments_N.max()),
        "tension_min_N": lowest,
        "slack_reached": float(lowest <= SLACK * rig.preload_N),
    }
    if run.work_mJ is None:
        return found
    width = loop_width(program.drive_mm, run.angle_deg) if loops is None else loops.width(run.angle_deg)
    found |= {
        "loop_width_max_deg": width.max_deg,
        "loop_width_at_zero_deg": math.nan if width.at_zero_deg is None else width.at_zero_deg,
    }
    if program.cycle is not None:  # a program from a file does not mark its last cycle
        begin = int(np.flatnonzero(program.cycle == program.cycle[-1])[0]) - 1
        found["dissipated_mJ"] = float(run.work_mJ[-1] - run.work_mJ[begin])
    return found


def _notches(run: Run) -> Quantities:
    """Compute the group ``notches``: where the manipulator bends most, angles in the direction in which it bends."""
    most = int(np.abs(run.angle_deg).argmax())
    angles = run.notches_deg[most] * np.sign(run.angle_deg[most])
    return {
        "notch_angle_max_deg": float(angles.max()),
        "notch_angle_spread_deg": float(np.ptp(angles)),
        "notch_angle_gradient_deg": float(angles[-1] - angles[0]),
    }


def _strain(rig: Rig, strain: Floats) -> Quantities:
    """Compute the group ``strain``; empty for measured joints, whose section is not known."""
    if not np.isfinite(strain).all():
        return {}
    largest = largest_strains(strain)
    names = ("fatigue_margin", "plateau_margin", "superelastic_margin")  # in the order of the limits
    return {"peak_strain_percent": 100 * largest["peak"]} | {
        name: limit.strain / largest[limit.kind] if largest[limit.kind] > 0 else math.inf
        for name, limit in zip(names, strain_limits(rig), strict=True)
    }


def _contributions(rig: Rig, program: LoadProgram, engine: str) -> Quantities:
    high = float(program.drive_mm.max())
    shares = separate(rig, loop_program(float(program.drive_mm.min()), high), solver_of(engine)).shares("dissipated_mJ")
    return {} if shares is None else {f"{part}_share": value for part, value in shares.items()}


def _bouc_wen(record: Record, seed: int) -> Quantities:
    fit = identify(record, settings=IdentifySettings(seed=seed))
    values = {f"bouc_wen_{name}": fit.parameters[name].value for name in ("A", "beta", "gamma", "n")}
    return values | {"saturation_deg": fit.saturation_deg.value}


def _solid(rig: Rig, program: LoadProgram) -> Quantities:
    """Compute stiffness and strain of one joint as a linear elastic solid, at the joint angles that the chain reaches.

    The strain is the largest principal one at the nodes (:func:`fem_models.solid.strain.peak_strain`).
    """
    from fem_models.solid.linear import as_flexure, snr_stiffness, solid_snr
    from fem_models.solid.strain import bent_chain
    from fem_models.solid.strain import peak_strain as solid_peak

    body = solid_snr(rig)
    joint = as_flexure(snr_stiffness(body).stiffness)
    per_rad = solid_peak(body, bent_chain(body)).principal_nodes
    record = solve_chain(rig, program).record
    assert record.notches_deg is not None
    bending_rad = np.radians(record.notches_deg - rig.precurvature_deg)
    found = {name: getattr(joint, name) for name in GROUPS["joint"]}
    return found | _strain(rig, per_rad * bending_rad)


# Exudyn and gmsh have global state: the threads of a worker must not use them at the same time.
_ONE_AT_A_TIME = threading.Lock()


def evaluate_all(batch: Sequence[tuple[str, CaseInputs]]) -> list[Outcome]:
    """Run a batch of cases one after the other; this is the task of a worker."""
    return [_guarded(key, inputs) for key, inputs in batch]


def _guarded(key: str, inputs: CaseInputs) -> Outcome:
    with _ONE_AT_A_TIME if inputs.engine in ("multibody", "solid") else nullcontext():
        return evaluate(key, inputs)
