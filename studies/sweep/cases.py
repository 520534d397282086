"""One case of a study: inputs -> quantities. A case that fails says why; it never stops the others."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_models.analytic.kinematics import simulate_analytic
from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_mechanics
from fem_models.joint.strain import SUPERELASTIC, limits_passed, peak_strain, strain_limits
from fem_models.load.program import LoadProgram, sine, triangle
from fem_models.rig.rig import Rig
from fem_models.rig.rig_file import rig_of_tables
from hysteresis import identify
from hysteresis.arrays import Floats
from hysteresis.metrics import loop_width
from hysteresis.record import Record
from hysteresis.settings import IdentifySettings
from studies.engines import mechanics
from studies.sweep.inputs import code_version, with_values
from validation.separation import loop_program, separate
from validation.separation.contributions import PARTS

Quantities = dict[str, float]


class StudyError(ValueError):
    """A study that cannot be read or run; one line naming file, field, value and what was expected."""


@dataclass(frozen=True)
class Quantity:
    """What a column of the dataset is."""

    units: str
    long_name: str


SLACK = 0.01  # of the preload: a rope with a toe region is never quite without tension

GROUPS: dict[str, dict[str, Quantity]] = {
    "loop": {
        "full_scale_angle_deg": Quantity("deg", "largest bending angle, either way"),
        "loop_width_at_zero_deg": Quantity("deg", "width of the loop at zero drive, positive where the angle lags"),
        "loop_width_max_deg": Quantity("deg", "largest width of the loop"),
        "dissipated_mJ": Quantity("mJ", "work of the wheel over the last cycle"),
        "tension_max_N": Quantity("N", "largest tension anywhere along the tendons"),
        "tension_min_N": Quantity("N", "smallest tension anywhere along the tendons"),
        "slack_reached": Quantity("1", "1 where a tendon falls to 1 % of the preload or less, else 0"),
    },
    "strain": {
        "peak_strain_percent": Quantity("%", "largest strain of the outermost fibre at a notch root"),
        "superelastic_margin": Quantity("1", "strain to which superelasticity is tested (6 %) over the peak strain"),
        "plateau_margin": Quantity("1", "strain at the start of the plateau over the peak strain"),
        "fatigue_margin": Quantity("1", "alternating strain for 10^7 cycles (0.4 %) over that of the loop"),
    },
    "bouc-wen": {
        "bouc_wen_A": Quantity("1", "A of the improved Bouc-Wen law"),
        "bouc_wen_beta": Quantity("deg^-n", "beta of the improved Bouc-Wen law"),
        "bouc_wen_gamma": Quantity("deg^-n", "gamma of the improved Bouc-Wen law"),
        "bouc_wen_n": Quantity("1", "n of the improved Bouc-Wen law"),
        "saturation_deg": Quantity("deg", "largest |h| of the improved Bouc-Wen law"),
    },
    "contributions": {
        f"{part}_share": Quantity("1", f"share of the dissipated energy: {part.replace('_', ' ')}") for part in PARTS
    },
    "joint": {
        "bending_Nmm_per_rad": Quantity("N mm/rad", "bending stiffness of one joint, as a solid"),
        "axial_N_per_mm": Quantity("N/mm", "axial stiffness of one joint, as a solid"),
        "shear_N_per_mm": Quantity("N/mm", "shear stiffness of one joint, as a solid"),
    },
}
"""Quantities by group: all are numbers; NaN is what an engine cannot give, or a case that failed."""

OPTIONAL_GROUPS = ("bouc-wen", "contributions")  # each case costs many times as much
ENGINE_GROUPS: dict[str, tuple[str, ...]] = {
    "chain": ("loop", "strain", *OPTIONAL_GROUPS),
    "multibody": ("loop", "strain", *OPTIONAL_GROUPS),
    "analytic": ("loop", "strain"),
    "solid": ("joint", "strain"),
}
"""Groups that an engine has; the first two are those of a study that asks for none."""


def quantity_names(engine: str, groups: Sequence[str]) -> tuple[str, ...]:
    """Names of the quantities of a study, in the order of the dataset."""
    wanted = [group for group in ENGINE_GROUPS[engine] if group in groups]
    return tuple(name for group in wanted for name in GROUPS[group])


QUANTITIES: dict[str, Quantity] = {name: q for group in GROUPS.values() for name, q in group.items()}


@dataclass(frozen=True)
class Outcome:
    """What became of a case: ``status`` is ok or failed; a failed one may have some of its quantities."""

    key: str
    status: str
    message: str
    wall_s: float
    quantities: Quantities


@dataclass(frozen=True)
class Run:
    """What the groups are measured on. ``segments_N`` (m, tendons, k), ``work_mJ`` (m,) or None, ``strain`` (m, N)."""

    record: Record
    segments_N: Floats
    work_mJ: Floats | None
    strain: Floats


def program_of_table(table: Mapping[str, Any], *, one_way: bool = False) -> LoadProgram:
    """Make the load program of a study's table; ``one_way`` goes from 0 to the amplitude and back, for one tendon.

    Raises
    ------
    RigError
        Values that make no program.
    """
    if "drive_mm" in table:
        time_s = table.get("time_s")
        return LoadProgram(np.array(table["drive_mm"]), None if time_s is None else np.array(time_s))
    amplitude, cycles = table["amplitude_mm"], table["cycles"]
    timed = "rate_Hz" in table
    if timed:
        whole = sine(amplitude, table["rate_Hz"], cycles=cycles)
    else:
        whole = triangle(amplitude, step_mm=table["step_mm"], cycles=cycles)
    return _one_way(whole, amplitude, table["rate_Hz"] if timed else None) if one_way else whole


def _one_way(whole: LoadProgram, amplitude: float, rate_Hz: float | None) -> LoadProgram:
    """Go to the amplitude, then down to 0 and up again as often as ``whole`` has cycles, in steps like its own."""
    assert whole.cycle is not None
    cycles, way = int(whole.cycle[-1]), int(np.argmax(whole.drive_mm))
    if rate_Hz is not None:
        way *= 2  # from 0 to the amplitude is half a period
    k = np.arange(way * (1 + 2 * cycles) + 1)
    cycle = np.where(k <= way, 0, (k - way - 1) // (2 * way) + 1)
    if rate_Hz is None:
        return LoadProgram(amplitude * (1 - np.abs(k / way % 2 - 1)), cycle=cycle)
    return LoadProgram(0.5 * amplitude * (1 - np.cos(np.pi * k / way)), k / (2 * way * rate_Hz), cycle)


def evaluate(key: str, inputs: Mapping[str, Any]) -> Outcome:
    """Run one case; whatever goes wrong in it becomes its message.

    Parameters
    ----------
    inputs
        ``engine``, ``rig`` and ``program`` (plain tables), ``groups`` and ``seed``.
    """
    start, found, message = time.perf_counter(), dict[str, float](), ""
    names = quantity_names(inputs["engine"], inputs["groups"])
    try:
        _evaluate(inputs, found)
    except Exception as error:  # a case that dies must not take the study with it
        message = " ".join((str(error) or type(error).__name__).split())
    quantities = {name: float(found.get(name, math.nan)) for name in names}
    return Outcome(key, "failed" if message else "ok", message, time.perf_counter() - start, quantities)


def _evaluate(inputs: Mapping[str, Any], found: Quantities) -> None:
    """Fill ``found`` group by group, so that what was reached before a failure stays."""
    if "values" in inputs:  # that the tables could not be changed by: raises here, where it is kept as the message
        inputs = {**inputs, **with_values(inputs, inputs["values"])}
    rig = rig_of_tables(inputs["rig"], f"rig {inputs['rig'].get('name', '')}")
    program = program_of_table(inputs["program"], one_way=rig.tendon_b is None)
    engine, groups = inputs["engine"], inputs["groups"]
    if engine == "solid":
        found |= _solid(rig, program)
        return
    run = _RUN[engine](rig, program)
    if "loop" in groups:
        found |= _loop(rig, run)
    if "strain" in groups:
        found |= _strain(rig, run.record.drive, run.strain)
    if "contributions" in groups:
        with _named("contributions"):
            found |= _contributions(rig, program, engine)
    if "bouc-wen" in groups:
        with _named("bouc-wen"):
            found |= _bouc_wen(run.record, inputs["seed"])


@contextmanager
def _named(group: str) -> Iterator[None]:
    """Say which group an error is of, where the others are there."""
    try:
        yield
    except Exception as error:
        raise RuntimeError(f"{group}: {error}") from error


def _run_mechanics(engine: str) -> Callable[[Rig, LoadProgram], Run]:
    def run(rig: Rig, program: LoadProgram) -> Run:
        solution = mechanics(engine)(rig, program)
        segments = solution.segment_tensions_N[:, : len(rig.tendons)]
        return Run(solution.record, segments, solution.wheel_work_mJ, solution.peak_strain)

    return run


def _run_analytic(rig: Rig, program: LoadProgram) -> Run:
    record = simulate_analytic(rig, program)
    tensions = [record.tension_a_N] + ([] if rig.tendon_b is None else [record.tension_b_N])
    segments = np.stack([np.asarray(tension) for tension in tensions], axis=1)[:, :, None]
    assert record.notches_deg is not None
    return Run(record, segments, None, peak_strain(joint_mechanics(rig), np.radians(record.notches_deg)))


_RUN = {"chain": _run_mechanics("chain"), "multibody": _run_mechanics("multibody"), "analytic": _run_analytic}


def _loop(rig: Rig, run: Run) -> Quantities:
    """Numbers of the group ``loop``; the analytic model has no loop, so that its widths and energy are NaN."""
    record, lowest = run.record, float(run.segments_N.min())
    found = {
        "full_scale_angle_deg": float(np.abs(record.angle_deg).max()),
        "tension_max_N": float(run.segments_N.max()),
        "tension_min_N": lowest,
        "slack_reached": float(lowest <= SLACK * rig.preload_N),
    }
    if run.work_mJ is None:
        return found
    width = loop_width(record.drive, record.angle_deg, record.cycle)
    found |= {
        "loop_width_max_deg": width.max_deg,
        "loop_width_at_zero_deg": math.nan if width.at_zero_deg is None else width.at_zero_deg,
    }
    if record.cycle is not None:  # a program of a file does not say where its last cycle begins
        begin = int(np.flatnonzero(record.cycle == record.cycle[-1])[0]) - 1
        found["dissipated_mJ"] = float(run.work_mJ[-1] - run.work_mJ[begin])
    return found


def _strain(rig: Rig, drive: Floats, strain: Floats) -> Quantities:
    """Numbers of the group ``strain``; none for measured joints, whose section is not known."""
    if not np.isfinite(strain).all():
        return {}
    fatigue, plateau, superelastic = limits_passed(drive, strain, strain_limits(rig))
    margins = {"fatigue_margin": fatigue, "plateau_margin": plateau, "superelastic_margin": superelastic}
    assert superelastic.limit is SUPERELASTIC
    return {"peak_strain_percent": 100 * superelastic.largest} | {
        name: passed.limit.strain / passed.largest if passed.largest > 0 else math.inf
        for name, passed in margins.items()
    }


def _contributions(rig: Rig, program: LoadProgram, engine: str) -> Quantities:
    high = float(program.drive_mm.max())
    shares = separate(rig, loop_program(float(program.drive_mm.min()), high), mechanics(engine)).shares("dissipated_mJ")
    return {} if shares is None else {f"{part}_share": value for part, value in shares.items()}


def _bouc_wen(record: Record, seed: int) -> Quantities:
    fit = identify(record, settings=IdentifySettings(seed=seed))
    values = {f"bouc_wen_{name}": fit.parameters[name].value for name in ("A", "beta", "gamma", "n")}
    return values | {"saturation_deg": fit.saturation_deg.value}


def _solid(rig: Rig, program: LoadProgram) -> Quantities:
    """Stiffness and strain of one joint as a linear elastic solid, at the joint angles that the chain reaches.

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
    turn = np.radians(record.notches_deg - rig.precurvature_deg)
    found = {name: getattr(joint, name) for name in GROUPS["joint"]}
    return found | _strain(rig, record.drive, per_rad * turn)


# Exudyn and gmsh keep a state of the process: where a worker has several threads, they take turns.
_ONE_AT_A_TIME = threading.Lock()


def evaluate_all(batch: Sequence[tuple[str, Mapping[str, Any]]]) -> list[Outcome]:
    """Run a batch of cases, one after the other, each by itself: what a worker does."""
    return [_guarded(key, inputs) for key, inputs in batch]


def _guarded(key: str, inputs: Mapping[str, Any]) -> Outcome:
    with _ONE_AT_A_TIME if inputs["engine"] in ("multibody", "solid") else nullcontext():
        return evaluate(key, inputs)


def code_of(engine: str) -> str:
    """Give the code that a worker would run, to be compared with one's own."""
    return code_version(engine)
