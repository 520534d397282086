"""One case of a study: inputs -> quantities. A case that fails reports why, and the others go on."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fem_models.analytic import simulate_analytic
from fem_models.chain.extremes import extremes_of_run
from fem_models.chain.solve import ChainCase, chain_case, followed, solve_chain
from fem_models.joint import joint_row
from fem_models.joint.strain import largest_strains, peak_strain, strain_limits
from fem_models.load import LoadProgram, sine, triangle
from fem_models.rig import Rig
from fem_models.rig.rig_file import any_rig_of_tables, rig_of_tables
from hysteresis import identify
from hysteresis.arrays import Floats
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.records.metrics import LoopsOverDrive, loop_width, loops_over
from hysteresis.records.record import MAX_MAGNITUDE, Record
from studies.engines import solver_of
from studies.sweep.inputs import CaseInputs, CaseTables, ProgramTable, with_values
from studies.sweep.quantities import GROUPS, IN_SPACE, quantity_names
from studies.sweep.wrist import SLACK, groups_in_space, winds_both_ways
from validation.separation import loop_program, separate

Quantities = dict[str, float]


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
    """What the quantities are computed from.

    ``angle_deg`` has shape (m,). ``bent_deg``, shape (N,), are the angles of the notches where the manipulator bends
    most. Tensions are those anywhere along the tendons. ``work_mJ``, shape (m,), is the work of the wheel, None for the
    analytic model. ``strains`` are those of :func:`fem_models.joint.strain.largest_strains`, NaN where they are not
    known. ``record`` gives the record, which few quantities need.
    """

    angle_deg: Floats
    bent_deg: Floats
    tension_min_N: float
    tension_max_N: float
    work_mJ: Floats | None
    strains: Mapping[str, float]
    record: Callable[[], Record]


def _run_of(record: Record, segments_N: Floats, strain: Floats, work_mJ: Floats | None) -> Run:
    """Reduce a record, with tensions along the tendons of shape (m, ...) and strains of shape (m, N)."""
    assert record.notches_deg is not None
    angle = record.angle_deg
    bent, low, high = record.notches_deg[_most(angle)], float(segments_N.min()), float(segments_N.max())
    return Run(angle, bent, low, high, work_mJ, largest_strains(strain), lambda: record)


def _most(angle_deg: Floats) -> int:
    """Sample at which the manipulator bends most."""
    return int(np.abs(angle_deg).argmax())


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
    (outcome,) = evaluate_all([(key, inputs)])
    return outcome


# Exudyn and gmsh have global state: the threads of a worker must not use them at the same time.
_ONE_AT_A_TIME = threading.Lock()


def evaluate_all(batch: Sequence[tuple[str, CaseInputs]]) -> list[Outcome]:
    """Run a batch of cases; this is the task of a worker.

    All make their first step, then all their next one: a processor that does the same again is twice as fast as one
    that comes back from a kernel. No number of a case depends on the others.
    """
    with _ONE_AT_A_TIME if any(inputs.engine in ("multibody", "solid") for _, inputs in batch) else nullcontext():
        running = [_Running(key, inputs) for key, inputs in batch]
        left = running
        while left:
            left = [one for one in left if one.goes_on()]
        return [one.outcome() for one in running]


class _Running:
    """A case on its way."""

    def __init__(self, key: str, inputs: CaseInputs) -> None:
        self.key, self.names = key, quantity_names(inputs.engine, inputs.groups)
        self.message, self.wall_s, self.found = "", 0.0, dict[str, float]()
        self.steps = _steps(inputs, self.found)

    def goes_on(self) -> bool:
        """Make the next step; False after the last one, and where it fails."""
        start = time.perf_counter()
        try:
            next(self.steps)
        except StopIteration:
            return False
        except Exception as error:  # a case that fails must not stop the study
            self.message = " ".join((str(error) or type(error).__name__).split())
            return False
        finally:
            self.wall_s += time.perf_counter() - start
        return True

    def outcome(self) -> Outcome:
        quantities = {name: float(self.found.get(name, math.nan)) for name in self.names}
        return Outcome(self.key, "failed" if self.message else "ok", self.message, self.wall_s, quantities)


def _steps(inputs: CaseInputs, found: Quantities) -> Iterator[None]:
    """Fill ``found`` group by group, so that the groups computed before a failure are kept; step by step."""
    # with_values raises here, as it did when the case was made: its error becomes the message of the case
    tables: CaseTables = inputs if inputs.values is None else with_values(inputs, inputs.values)
    where = f"rig {tables.rig.get('name', '')}"
    if inputs.engine == IN_SPACE:
        wrist = any_rig_of_tables(tables.rig, where, in_space=True)
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
    if engine == "chain":
        yield
        case = chain_case(rig, program)
        yield
        run = _run_chain(rig, program, case)
    else:
        run = (_run_multibody if engine == "multibody" else _run_analytic)(rig, program)
    yield
    if "loop" in groups:
        loops = None if engine == "analytic" else _loops(tables.program, one_way)
        found |= _loop(rig, program, run, loops)
    if "strain" in groups:
        found |= _strain(rig, run.strains)
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


def _run_chain(rig: Rig, program: LoadProgram, case: ChainCase) -> Run:
    """Run the chain without its record, whose checks would cost a third of the simulation.

    Numbers that a record does not take are refused as it refuses them.
    """
    done, _ = followed(rig, case)
    ends = extremes_of_run(case.joints, done, len(rig.tendons))
    angle, strains = np.degrees(ends.tip_rad), {"peak": ends.peak_strain, "alternating": ends.alternating_strain}
    run = Run(
        angle, np.degrees(done.angles[_most(angle)]), ends.tension_min_N, ends.tension_max_N, done.energies[:, 0],
        strains, lambda: solve_chain(rig, program).record,
    )  # fmt: skip
    largest = (float(np.abs(angle).max()), math.degrees(ends.steepest_rad), -ends.tension_min_N, ends.tension_max_N)
    if not all(one <= MAX_MAGNITUDE for one in largest):
        run.record()
    return run


def _run_multibody(rig: Rig, program: LoadProgram) -> Run:
    solution = solver_of("multibody")(rig, program)
    segments = solution.segment_tensions_N[:, : len(rig.tendons)]
    return _run_of(solution.record, segments, solution.peak_strain, solution.wheel_work_mJ)


def _run_analytic(rig: Rig, program: LoadProgram) -> Run:
    record = simulate_analytic(rig, program)
    tensions = [record.tension_a_N] + ([] if rig.tendon_b is None else [record.tension_b_N])
    wheel = np.stack([np.asarray(tension) for tension in tensions], axis=1)
    assert record.notches_deg is not None
    strain = peak_strain(joint_row(rig), np.radians(record.notches_deg), thrust_N=wheel.sum(axis=1)[:, None])
    return _run_of(record, wheel, strain, None)


def _loop(rig: Rig, program: LoadProgram, run: Run, loops: LoopsOverDrive | None) -> Quantities:
    """Compute the group ``loop``; the analytic model has no loop, so that its widths and energy are NaN."""
    found = {
        "full_scale_angle_deg": float(np.abs(run.angle_deg).max()),
        "tension_max_N": run.tension_max_N,
        "tension_min_N": run.tension_min_N,
        "slack_reached": float(run.tension_min_N <= SLACK * rig.preload_N),
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
    angles = run.bent_deg * np.sign(run.angle_deg[_most(run.angle_deg)])
    return {
        "notch_angle_max_deg": float(angles.max()),
        "notch_angle_spread_deg": float(np.ptp(angles)),
        "notch_angle_gradient_deg": float(angles[-1] - angles[0]),
    }


def _strain(rig: Rig, largest: Mapping[str, float]) -> Quantities:
    """Compute the group ``strain``; empty for measured joints, whose section is not known."""
    if not all(map(math.isfinite, largest.values())):
        return {}
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
    return found | _strain(rig, largest_strains(per_rad * bending_rad))
