"""The record to take next: where the models that remain after a trace differ most.

The fitted candidates are simulated over a small set of programs: the measured one at other preloads, amplitudes and
rates, with a dwell, and with more cycles. The difference of two models is the root mean square of the difference of
their angles, less a free offset. It is an upper estimate: fitted again to the new record, they may be nearer.

Programs that would strain the metal or pull the tendons of a known rig too far, by any of the candidates, are left out
(:class:`Limits`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_models.chain.solve import ChainSolution
from fem_models.joint.strain import SUPERELASTIC
from fem_models.load.program import LoadProgram
from fem_models.rig.checks import RigError, SolverError
from hysteresis.arrays import Floats, Ints
from hysteresis.records.path import branches
from validation.tracing.baseline.curve import CurveProblem
from validation.tracing.baseline.in_space import SpaceProblem
from validation.tracing.baseline.play_operators import PlayProblem
from validation.tracing.baseline.rig_problem import Added, RigProblem, observed_angle_deg
from validation.tracing.baseline.runs import Run
from validation.tracing.effect import SampleInputs, Values
from validation.tracing.fitting import holdout
from validation.tracing.fitting.fitted import Fitted, rms
from validation.tracing.fitting.holdout import Protocol
from validation.tracing.outcome import Trace, competitors_of, turns_are_alike
from validation.tracing.prepared import PreparedRecord
from validation.tracing.problem import Problem
from validation.tracing.search.still_zone import SAME_STILL
from validation.tracing.sensors.protocol import NOT_AS_RECORDED, OTHER_AMPLITUDE, OTHER_RATE
from validation.tracing.settings import (
    AMPLITUDE_FACTORS,
    CYCLE_SAMPLES,
    DWELL_PERIODS,
    DWELL_SAMPLES,
    FEW_CYCLES,
    MANY_CYCLES,
    NEARLY_MOST,
    ONE_SIDED,
    PRELOAD_FACTORS,
    RATE_FACTORS,
    SAME_PROTOCOL,
    TENSION_FACTOR,
)

_ROUNDING = 1e-6  # relative: a program that goes as far as the limit is within


@dataclass(frozen=True, eq=False)
class Trial:
    """A program that could be run, with words for its protocol; lists are in order from gentle to demanding."""

    words: str
    drive: Floats
    time_s: Floats | None
    cycle: Ints
    preload_N: float  # NaN: unknown

    @property
    def inputs(self) -> SampleInputs:
        """Drive, time and cycle, for effects that act on the reading."""
        time = np.arange(self.drive.size, dtype=float) if self.time_s is None else self.time_s
        return SampleInputs(self.drive, time, self.cycle, timed=self.time_s is not None)


@dataclass(frozen=True, eq=False)
class Experiment:
    """What to measure next: in words and, where it is a record, the drive of it in the records' own ``unit``."""

    words: str
    trial: Trial | None = None
    unit: str = "mm"

    @property
    def program(self) -> LoadProgram | None:
        """The drive as a load program, where it is in mm."""
        trial = self.trial if self.unit == "mm" else None
        return None if trial is None else LoadProgram(trial.drive, trial.time_s, trial.cycle)

    @property
    def preload_N(self) -> float | None:
        """Preload to measure at; None where the records do not state theirs."""
        return None if self.trial is None or math.isnan(self.trial.preload_N) else self.trial.preload_N

    def csv(self) -> str | None:
        """Text of a file with ``drive_UNIT`` and ``time_s``; in mm, ``notchbend simulate --program`` reads it."""
        if self.trial is None:
            return None
        columns = {f"drive_{self.unit}": self.trial.drive, "time_s": self.trial.time_s}
        there = {name: values.tolist() for name, values in columns.items() if values is not None}
        rows = (",".join(f"{value:.9g}" for value in row) for row in zip(*there.values(), strict=True))
        return "\n".join([",".join(there), *rows]) + "\n"


@dataclass(frozen=True)
class Limits:
    """How far a program may go on a known rig: largest strain of a notch, and largest tension of a tendon, N.

    The strain is that to which Nitinol is tested (:data:`fem_models.joint.strain.SUPERELASTIC`), or what the records
    reached already. A rig declares no largest tension: it is a quarter more than in the records.
    """

    strain: float
    tension_N: float

    def allow(self, solution: ChainSolution) -> bool:
        """Whether a run stays within; strains of measured joints are not known and not limited."""
        strain, tension = _reached(solution)
        return not (strain > (1 + _ROUNDING) * self.strain or tension > (1 + _ROUNDING) * self.tension_N)


SLACK_WITH_WEIGHT = (
    "both angles with slack tendons, before and after a weight is hung on the tip to the side, in the plane of one "
    "angle: a turned sensor shows a part of the change in the other angle, turned tendons show none; the place of "
    "the tip, recorded beside the angles, often shows it, too"
)

PLAY_OR_FRICTION = (
    "the same program at half the preload and at twice it: the still zone of a play keeps its width, that of friction "
    "between wheel and base grows with the tension; or the tension at the base, which rises within the zone if it is "
    "friction, and hardly if it is play"
)


def next_experiment(trace: Trace) -> Experiment:
    """Propose the record that distinguishes most.

    Where an effect is named: the program at which the model with it differs most from those that explain the records as
    well, or else from the runner-up. For ``none`` and ``unexplained``, and where a reference lacks the rate of the new
    records: the protocol that is lacking.
    """
    if isinstance(trace.baseline.model.problem, SpaceProblem):
        return Experiment(_lacking_in_space(trace))
    if NOT_AS_RECORDED in trace.words:
        return Experiment("the same records, once what is said of them is mended")
    if trace.verdict in ("none", "unexplained") or OTHER_RATE in trace.words:
        return Experiment(_lacking(trace))
    if _is_still_zone(trace):
        return Experiment(PLAY_OR_FRICTION)
    competitors = competitors_of(trace)
    if len(competitors) < 2:
        return Experiment(f"{_lacking(trace)} (no other effect explains these records nearly as well)")
    found = _most_different(trace, competitors)
    if found is None or found[1][0] < trace.floor.deg:
        names = " and ".join(_name(fitted) for fitted in competitors)
        limits = " within the strain and tension of the rig" if trace.known else ""
        return Experiment(f"{_lacking(trace)} (no program that was simulated{limits} distinguishes {names})")
    trial, differences = found
    floor = trace.floor.deg
    noise = f", {differences[0] / floor:.2g} times the noise" if floor > 0 else ""
    pairs = [f"{_name(competitors[0])} and {_name(competitors[1])} differ by {differences[0]:.2g} deg rms there{noise}"]
    pairs += [
        f"{_name(competitors[0])} and {_name(other)} by {d:.2g} deg"
        for other, d in zip(competitors[2:], differences[1:], strict=True)
    ]
    words = f"a record {trial.words}: {'; '.join(pairs)}"
    return Experiment(words, trial, trace.records[0].drive_unit)


def _is_still_zone(trace: Trace) -> bool:
    """Whether what was named last is a still zone: no model that was fitted has the friction that does the same."""
    if not isinstance(trace.baseline.model.problem, PlayProblem) or not trace.effects:
        return False
    return trace.confusable[-1] == SAME_STILL and bool(trace.effects[-1].form.form.still_over)


def _name(fitted: Fitted) -> str:
    return " + ".join(fitted.names)


# --- simulation ----------------------------------------------------------------------------------------------------


def _most_different(trace: Trace, competitors: Sequence[Fitted]) -> tuple[Trial, list[float]] | None:
    """Find the program at which the first competitor differs most from the nearest other one, and the differences."""
    problem = trace.baseline.model.problem
    results = []
    for trial, angles in _simulated(trace, problem, competitors):
        first = angles[0]
        results.append((trial, [rms((a - first) - (a - first).mean()) for a in angles[1:]]))
    if not results:
        return None
    most = max(min(differences) for _, differences in results)
    return next(r for r in results if min(r[1]) >= NEARLY_MOST * most) if most > 0 else None


def _simulated(trace: Trace, problem: Problem, competitors: Sequence[Fitted]) -> Iterator[tuple[Trial, list[Floats]]]:
    """Angles of all competitors at each program that all of them can follow."""
    widest = max(range(len(_new(trace))), key=lambda i: float(np.ptp(trace.records[i].drive)))
    known = isinstance(problem, RigProblem)
    limits = [_limits(problem, fitted) for fitted in competitors] if isinstance(problem, RigProblem) else []
    for trial in _trials(trace, widest) if known else _altered(_new(trace), widest):
        try:
            if isinstance(problem, RigProblem):
                runs = [_run_of_rig(problem, problem.runs[widest][0], trial, fitted) for fitted in competitors]
                if all(limit.allow(run) for limit, run in zip(limits, runs, strict=True)):
                    yield (
                        trial,
                        [
                            observed_angle_deg(run.record.angle_deg, trial.inputs, _added(fitted)[1])
                            for run, fitted in zip(runs, competitors, strict=True)
                        ],
                    )
            else:
                yield trial, [_angle_of_curve(fitted, widest, trial) for fitted in competitors]
        except (SolverError, RigError, ValueError):  # ValueError: a preload that a rig cannot have with an effect
            continue


def _added(fitted: Fitted) -> tuple[Values, Added]:
    """Parameters of the baseline, and the forms of the effects with theirs."""
    baseline, more = fitted.model.values(fitted.x)
    return baseline, [(a.form, values) for a, values in zip(fitted.model.added, more, strict=True)]


def _angle_of_curve(fitted: Fitted, widest: int, trial: Trial) -> Floats:
    """Angle of a fitted model at a program in place of the widest record, shape (m,).

    Play operators that are compared may differ in their columns: each is a problem of its own.
    """
    problem = fitted.model.problem
    assert isinstance(problem, CurveProblem | PlayProblem)
    records = list(problem.records)
    records[widest] = replace(records[widest], inputs=trial.inputs)
    baseline, more = fitted.model.values(fitted.x)
    added = [(a.form, values) for a, values in zip(fitted.model.added, more, strict=True)]
    return np.asarray(replace(problem, records=tuple(records)).predict(baseline, added)[widest])


def _run_of_rig(problem: RigProblem, run: Run, trial: Trial, fitted: Fitted) -> ChainSolution:
    """Run a fitted rig through a program."""
    baseline, added = _added(fitted)
    rig = run.rig if math.isnan(trial.preload_N) else replace(run.rig, preload_N=trial.preload_N)
    load_control = not isinstance(run.program, LoadProgram)
    program = np.maximum(trial.drive, 0.0) if load_control else problem.program(trial.drive, trial.time_s, trial.cycle)
    driven = problem.driven(Run(rig, program, 0), baseline)
    return driven.solve(problem.rig(driven, baseline, added))


def _limits(problem: RigProblem, fitted: Fitted) -> Limits:
    """Limits of a fitted rig, by what the records reached in it."""
    baseline, added = _added(fitted)
    driven = [problem.driven(run, baseline) for runs in problem.runs for run in runs]
    reached = [_reached(run.solve(problem.rig(run, baseline, added))) for run in driven]
    strain, tension = (max(values) for values in zip(*reached, strict=True))
    return Limits(max(strain, SUPERELASTIC.strain), TENSION_FACTOR * tension)


def _reached(solution: ChainSolution) -> tuple[float, float]:
    """Largest strain and tension of a run; a strain that is not known counts as none."""
    return float(np.nan_to_num(np.abs(solution.peak_strain)).max()), float(solution.segment_tensions_N.max())


# --- programs ------------------------------------------------------------------------------------------------------


def _trials(trace: Trace, widest: int) -> list[Trial]:
    """Programs about the protocol of one record; those that were measured already are left out."""
    records = trace.baseline.model.problem.records
    record, unit = records[widest].record, records[widest].record.drive_unit
    base = protocol(records[widest])
    load_control = unit == "N"
    if load_control:
        base = Protocol(math.nan, base.amplitude, math.nan)
    low, high = float(record.drive.min()), float(record.drive.max())
    measured = [protocol(one) for one in records]
    preloads = (1.0,) if math.isnan(base.preload_N) or base.preload_N == 0 else _preload_factors(base, measured)
    rates = (1.0,) if math.isnan(base.rate_Hz) else RATE_FACTORS
    plans = [(p, a, 1.0) for p in preloads for a in AMPLITUDE_FACTORS] + [(1.0, 1.0, r) for r in rates[1:]]
    out = []
    for p, a, r in plans:
        at = Protocol(base.preload_N * p, base.amplitude * a, base.rate_Hz * r)
        if not any(_same(at, other) for other in measured):
            out.append(_trial(at, low * a, high * a, unit))
    most = max(float(one.inputs.cycle.max()) for one in records)
    if not load_control and most < MANY_CYCLES:
        out.append(_trial(base, low, high, unit, cycles=MANY_CYCLES))
    if len(rates) > 1:
        out.append(_with_dwell(_trial(base, low, high, unit), base))
    return out


def _preload_factors(base: Protocol, measured: Sequence[Protocol]) -> tuple[float, ...]:
    """Preloads over that of the widest record: about it, and below the lowest that was measured."""
    known = [one.preload_N for one in measured if one.preload_N > 0]
    below = min(PRELOAD_FACTORS) * min(known) / base.preload_N
    return (*PRELOAD_FACTORS, *(() if below in PRELOAD_FACTORS else (below,)))


def protocol(one: PreparedRecord) -> Protocol:
    """Protocol of a record; its rate is from the distance that the drive goes, parts of a cycle counted."""
    inputs, drive = one.inputs, one.inputs.drive
    distance = sum(abs(float(drive[b.stop - 1] - drive[b.start])) for b in branches(drive))
    seconds = float(inputs.time_s[-1] - inputs.time_s[0])
    rate = distance / (2 * float(np.ptp(drive))) / seconds if inputs.timed else math.nan
    return replace(holdout.protocol(one), rate_Hz=rate)


def _same(a: Protocol, b: Protocol) -> bool:
    pairs = ((a.preload_N, b.preload_N), (a.amplitude, b.amplitude), (a.rate_Hz, b.rate_Hz))
    return all(math.isnan(x) or math.isnan(y) or abs(x - y) <= SAME_PROTOCOL * max(abs(x), abs(y)) for x, y in pairs)


def _trial(at: Protocol, low: float, high: float, unit: str, cycles: int = FEW_CYCLES) -> Trial:
    """Make cycles between two ends of the drive, from rest; a sine where the rate is known, else point by point.

    A force is applied once and not taken off: records under a force only load.
    """
    timed = not math.isnan(at.rate_Hz)
    if unit == "N":
        force = high * np.arange(CYCLE_SAMPLES + 1) / CYCLE_SAMPLES
        return Trial(f"of a force up to {high:.3g} N", force, None, np.ones(force.size, dtype=np.int64), at.preload_N)
    about_zero = abs(low + high) <= ONE_SIDED * (high - low)
    phase = np.arange((CYCLE_SAMPLES // 4 if about_zero else 0) + cycles * CYCLE_SAMPLES + 1) / CYCLE_SAMPLES
    if about_zero:
        drive = (high - low) / 2 * (np.sin(2 * np.pi * phase) if timed else 1 - np.abs((4 * phase + 1) % 4 - 2))
        cycle = np.where(phase <= 0.25, 0, np.ceil(phase - 0.25 - 1e-9)).astype(np.int64)
    else:
        rise = (1 - np.cos(2 * np.pi * phase)) / 2 if timed else 1 - np.abs(2 * (phase % 1) - 1)
        drive = low + (high - low) * rise
        cycle = np.maximum(1, np.ceil(phase - 1e-9)).astype(np.int64)
    words = _words(at, unit) + (f", {cycles} cycles" if cycles > FEW_CYCLES else "")
    return Trial(words, drive, phase / at.rate_Hz if timed else None, cycle, at.preload_N)


def _with_dwell(trial: Trial, at: Protocol) -> Trial:
    """Hold the drive where it is full for the first time."""
    assert trial.time_s is not None
    top = int(np.argmax(trial.drive))
    length = DWELL_PERIODS / at.rate_Hz
    rest = trial.time_s[top] + length * np.arange(1, DWELL_SAMPLES + 1) / DWELL_SAMPLES
    return Trial(
        f"{trial.words}, held for {length:.3g} s at the first reversal",
        np.insert(trial.drive, top + 1, np.full(DWELL_SAMPLES, trial.drive[top])),
        np.concatenate([trial.time_s[: top + 1], rest, trial.time_s[top + 1 :] + length]),
        np.insert(trial.cycle, top + 1, np.full(DWELL_SAMPLES, trial.cycle[top])),
        trial.preload_N,
    )


def _new(trace: Trace) -> Sequence[PreparedRecord]:
    """Give the records without those of a reference, on which a change does not act."""
    records = trace.baseline.model.problem.records
    return records[: len(records) - trace.reference]


def _altered(records: Sequence[PreparedRecord], widest: int) -> list[Trial]:
    """Programs where the geometry is unknown: the path of one record at other amplitudes and rates."""
    record, inputs = records[widest].record, records[widest].inputs
    base = protocol(records[widest])
    middle = float(record.drive.min() + record.drive.max()) / 2
    if abs(middle) <= ONE_SIDED * base.amplitude:
        middle = 0.0
    measured = [protocol(one) for one in records]
    rates = RATE_FACTORS[1:] if inputs.timed else ()
    out = []
    for a, r in [(0.5, 1.0), (0.25, 1.0), *((1.0, rate) for rate in rates)]:
        at = Protocol(base.preload_N, base.amplitude * a, base.rate_Hz * r)
        if not any(_same(at, other) for other in measured):
            time = inputs.time_s / r if inputs.timed else None
            drive = middle + a * (inputs.drive - middle)
            out.append(Trial(_words(at, record.drive_unit), drive, time, inputs.cycle, at.preload_N))
    return out


def _words(at: Protocol, unit: str) -> str:
    parts = [(at.preload_N, "N preload"), (at.amplitude, f"{unit} amplitude"), (at.rate_Hz, "Hz")]
    return "at " + ", ".join(f"{value:.3g} {name}" for value, name in parts if not math.isnan(value))


# --- what the records lack -----------------------------------------------------------------------------------------

_CAUSES: tuple[tuple[str, str, str], ...] = (
    ("rate", "rate", "the residual depends on the rate"),
    ("cycle", "cycles", "the residual changes from cycle to cycle"),
    ("time", "dwell", "the residual depends on time"),
    ("even", "preload", "the residual is an even function of the drive, by unequal tendons or by the camera"),
    ("last reversal", "amplitude", "the residual depends on the distance since a reversal, as loops do"),
    ("and its direction", "amplitude", "the residual differs between rising and falling drive"),
)
"""Part of a smooth function's name, the protocol that distinguishes its causes, and why."""


def _lacking(trace: Trace) -> str:
    """Say which protocol the records lack, first of all one that the residual depends on."""
    if OTHER_AMPLITUDE in trace.words:
        return "the reference at the amplitude of the new records: without it, a change and the amplitude look alike"
    if OTHER_RATE in trace.words:
        return "the reference at the rate of the new records, or on both sides of it: a change and a rate look alike"
    lacks = _absent(trace)
    if trace.verdict == "unexplained":
        for name in trace.smooth.names:
            for part, what, why in _CAUSES:
                if what in lacks and part in name:
                    return f"{lacks[what][0]}: {why}"
    for measure, why in lacks.values():
        return f"{measure}: {why}"
    if trace.verdict == "unexplained":
        return "the same records again: a residual that does not repeat is no property of the rig"
    return "nothing: the records differ in preload, amplitude and rate, and have many cycles and a dwell"


def _lacking_in_space(trace: Trace) -> str:
    """Say which wheels did not move in any record of a rig in space, or else what :func:`_lacking` says.

    Which of two turns there is no record of the wheels shows, but a look at both angles.
    """
    if turns_are_alike(trace):
        return SLACK_WITH_WEIGHT
    problem = trace.baseline.model.problem
    assert isinstance(problem, SpaceProblem)
    runs = problem.runs[: len(problem.runs) - trace.reference // len(problem.angles)]
    moved = np.any([np.ptp(run.wheels_mm, axis=0) > 0 for run in runs], axis=0)
    still = ", ".join(str(k + 1) for k, moves in enumerate(moved) if not moves)
    if still:
        words = f"a record in which wheel {still} moves: the other plane shows which turn or sensor couples them"
    else:
        words = _lacking(trace)
    alike = zip(trace.augmented.names, trace.confusable, strict=True)
    pairs = [f"{name} from {' or '.join(others)}" for name, others in alike if others]
    if trace.verdict != "ambiguous" or not pairs:
        return words
    return f"{words} (not told apart: {', '.join(pairs)}; of a rig in space no programs are compared)"


def _absent(trace: Trace) -> dict[str, tuple[str, str]]:
    """Protocols in which all records agree: what to measure, and what the records do not show."""
    records = _new(trace)
    protocols, unit = [protocol(one) for one in records], trace.records[0].drive_unit
    first, out = protocols[0], dict[str, tuple[str, str]]()
    if _all_same([p.amplitude for p in protocols]):
        half = f"a record at half the amplitude, {first.amplitude / 2:.3g} {unit}"
        out["amplitude"] = half, "at one amplitude play, loops and end stops look alike"
    if unit == "N":
        if all(one.only_loads for one in records):
            unloading = "the same trials with unloading", "trials that only load show no loop of friction or metal"
            out = {"unloading": unloading, **out}
        return out
    if any(math.isnan(p.preload_N) for p in protocols):
        unknown = "the preload of every record, written into its sidecar (preload_N in [rig])"
        out = {"preload": (unknown, "it is not known here, and without it effects of the tension do not show"), **out}
    elif _all_same([p.preload_N for p in protocols]):
        such = f", such as {first.preload_N / 2:.3g} N" if first.preload_N > 0 else ""
        preload = f"a record at another preload{such}", "at one preload effects of the tension do not show"
        out = {"preload": preload, **out}
    if _all_same([p.rate_Hz for p in protocols]):
        fast = f"a record at ten times the rate, {10 * first.rate_Hz:.3g} Hz"
        timed = "a record with times, at two rates" if math.isnan(first.rate_Hz) else fast
        out["rate"] = timed, "at one rate drag and delay do not show"
    if max(int(one.inputs.cycle.max()) for one in records) < MANY_CYCLES:
        out["cycles"] = (
            f"a record of {MANY_CYCLES} cycles or more",
            "few cycles do not show changes from cycle to cycle",
        )
    if not any(_has_dwell(one.inputs) for one in records):
        out["dwell"] = "a record with a dwell at full drive", "without a dwell creep hardly shows"
    return out


def _all_same(values: Sequence[float]) -> bool:
    known = [v for v in values if not math.isnan(v)]
    return not known or max(known) - min(known) <= SAME_PROTOCOL * max(abs(v) for v in known)


def _has_dwell(inputs: SampleInputs) -> bool:
    """Tell whether the drive stands still for a tenth of a record with times."""
    if not inputs.timed or inputs.drive.size < 3:
        return False
    still = np.abs(np.diff(inputs.drive)) <= 1e-6 * np.ptp(inputs.drive)
    return bool(np.diff(inputs.time_s)[still].sum() > 0.1 * (inputs.time_s[-1] - inputs.time_s[0]))
