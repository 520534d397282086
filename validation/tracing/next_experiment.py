"""The record to take next: where the models that survived a trace differ most.

The fitted candidates are simulated over a small set of programs: the measured one at other preloads, amplitudes and
rates, with a dwell, and with more cycles. How far apart they are is the root mean square of the difference of their
angles, less a free zero. It is an upper estimate: constants fitted again to the new record may bring them nearer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_models.load.program import LoadProgram
from fem_models.rig.checks import RigError, SolverError
from hysteresis.arrays import Floats
from hysteresis.path import branches
from validation.tracing.baseline.rig_problem import RigProblem, observed_angle_deg
from validation.tracing.baseline.runs import Run
from validation.tracing.effect import SampleInputs, Values
from validation.tracing.fitting import holdout
from validation.tracing.fitting.fitted import Fitted, rms
from validation.tracing.fitting.holdout import Protocol
from validation.tracing.outcome import Trace, competitors_of
from validation.tracing.prepared import PreparedRecord

PRELOADS, AMPLITUDES, RATES = (1.0, 0.5, 2.0), (1.0, 0.5, 1.25), (1.0, 0.1, 10.0)
"""Factors on the protocol of the record with the widest drive; the gentlest first."""
MORE_CYCLES, DWELL = 10, 10.0
"""Cycles of a long record; periods that a dwell at full drive lasts."""
_CYCLES, _OF_CYCLE = 2, 88
_SAME = 0.1  # relative difference below which a protocol is one that was measured
_NEARLY = 0.9  # of the largest difference: the gentlest program that reaches it is proposed
_ONE_SIDED = 0.25  # of half the range: a drive whose middle is further off than this is not about zero
_DWELL_SAMPLES = 40


@dataclass(frozen=True, eq=False)
class Trial:
    """A program that could be run: how it differs, from gentle to demanding in the order of a list."""

    words: str
    drive: Floats
    time_s: Floats | None
    cycle: NDArray[np.int64]
    preload_N: float  # NaN: unknown

    @property
    def inputs(self) -> SampleInputs:
        """What the observation forms take."""
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
        """Preload to measure at; None where the records do not tell theirs."""
        return None if self.trial is None or math.isnan(self.trial.preload_N) else self.trial.preload_N

    def csv(self) -> str | None:
        """Text of a file with ``drive_UNIT`` and ``time_s``; in mm, ``notchbend simulate --program`` reads it."""
        if self.trial is None:
            return None
        columns = {f"drive_{self.unit}": self.trial.drive, "time_s": self.trial.time_s}
        there = {name: values.tolist() for name, values in columns.items() if values is not None}
        rows = (",".join(f"{value:.9g}" for value in row) for row in zip(*there.values(), strict=True))
        return "\n".join([",".join(there), *rows]) + "\n"


def next_experiment(trace: Trace) -> Experiment:
    """Propose the record that would tell most.

    Of an effect that is named: where it and the runner-up, or all that explain the records alike, differ most. Of
    ``none`` and ``unexplained``: the protocol that the records lack.
    """
    if trace.verdict in ("none", "unexplained"):
        return Experiment(_lacking(trace))
    competitors = competitors_of(trace)
    if len(competitors) < 2:
        return Experiment(f"no other effect came near; {_lacking(trace)}")
    found = _most_different(trace, competitors)
    if found is None:
        names = " and ".join(_name(fitted) for fitted in competitors)
        return Experiment(f"{names} were not told apart by simulation; {_lacking(trace)}")
    trial, apart = found
    floor = trace.floor.deg
    noise = f", {apart[0] / floor:.2g} times the noise" if floor > 0 else ""
    pairs = [f"{_name(competitors[0])} and {_name(competitors[1])} differ by {apart[0]:.2g} deg rms there{noise}"]
    pairs += [
        f"{_name(competitors[0])} and {_name(other)} by {d:.2g} deg"
        for other, d in zip(competitors[2:], apart[1:], strict=True)
    ]
    words = f"a record {trial.words}: {'; '.join(pairs)}"
    return Experiment(words, trial, trace.records[0].drive_unit)


def _name(fitted: Fitted) -> str:
    return " + ".join(fitted.names)


# --- simulation ----------------------------------------------------------------------------------------------------


def _most_different(trace: Trace, competitors: Sequence[Fitted]) -> tuple[Trial, list[float]] | None:
    """Find the program at which the first rival is furthest from the nearest other, and by how much; None if none."""
    problem = trace.baseline.model.problem
    results = []
    for trial, angles in _simulated(trace, problem, competitors):
        first = angles[0]
        results.append((trial, [rms((a - first) - (a - first).mean()) for a in angles[1:]]))
    if not results:
        return None
    most = max(min(apart) for _, apart in results)
    return next(r for r in results if min(r[1]) >= _NEARLY * most) if most > 0 else None


def _simulated(trace: Trace, problem: Any, competitors: Sequence[Fitted]) -> Iterator[tuple[Trial, list[Floats]]]:
    """Angles of all rivals at each program that all of them can follow."""
    widest = max(range(len(trace.records)), key=lambda i: float(np.ptp(trace.records[i].drive)))
    known = isinstance(problem, RigProblem)
    for trial in _trials(trace, widest) if known else _altered(trace, problem, widest):
        try:
            yield trial, [_angle(rival.model.problem, widest, trial, rival) for rival in competitors]
        except (SolverError, RigError, ValueError):  # ValueError: a preload that a rig cannot have with an effect
            continue


def _angle(problem: Any, widest: int, trial: Trial, rival: Fitted) -> Floats:
    baseline, more = rival.model.values(rival.x)
    added = [(a.form, values) for a, values in zip(rival.model.added, more, strict=True)]
    if isinstance(problem, RigProblem):
        return _angle_of_rig(problem, problem.runs[widest][0], trial, baseline, added)
    records = list(problem.records)
    records[widest] = replace(records[widest], inputs=trial.inputs)
    return np.asarray(replace(problem, records=tuple(records)).predict(baseline, added)[widest])


def _angle_of_rig(
    problem: RigProblem, run: Run, trial: Trial, baseline: Values, added: Sequence[tuple[Any, Values]]
) -> Floats:
    rig = run.rig if math.isnan(trial.preload_N) else replace(run.rig, preload_N=trial.preload_N)
    pulled = not isinstance(run.program, LoadProgram)
    program = np.maximum(trial.drive, 0.0) if pulled else problem.program(trial.drive, trial.time_s, trial.cycle)
    moved = problem.driven(Run(rig, program, 0), baseline)
    angle = moved.angle_deg(problem.rig(moved, baseline, added))
    return observed_angle_deg(angle, trial.inputs, added)


# --- programs ------------------------------------------------------------------------------------------------------


def _trials(trace: Trace, widest: int) -> list[Trial]:
    """Programs about the protocol of one record: those measured already are left out."""
    record = trace.records[widest]
    base = protocol(trace.baseline.model.problem.records[widest])
    pulled = record.drive_unit == "N"
    if pulled:
        base = Protocol(math.nan, base.amplitude, math.nan)
    low, high = float(record.drive.min()), float(record.drive.max())
    preloads = (1.0,) if math.isnan(base.preload_N) or base.preload_N == 0 else PRELOADS
    rates = (1.0,) if math.isnan(base.rate_Hz) else RATES
    seen = [protocol(one) for one in trace.baseline.model.problem.records]
    plans = [(p, a, 1.0) for p in preloads for a in AMPLITUDES] + [(1.0, 1.0, r) for r in rates[1:]]
    out = []
    for p, a, r in plans:
        at = Protocol(base.preload_N * p, base.amplitude * a, base.rate_Hz * r)
        if not any(_same(at, other) for other in seen):
            out.append(_trial(at, low * a, high * a, record.drive_unit))
    most = max(float(s.cycle.max()) for s in trace.baseline.model.problem.inputs)
    if not pulled and most < MORE_CYCLES:
        out.append(_trial(base, low, high, record.drive_unit, cycles=MORE_CYCLES))
    if len(rates) > 1:
        out.append(_dwell(_trial(base, low, high, record.drive_unit), base))
    return out


def protocol(one: PreparedRecord) -> Protocol:
    """Read the protocol off a record; the rate by the drive's way, parts of a cycle counted."""
    whole, record_inputs, drive = holdout.protocol(one), one.inputs, one.inputs.drive
    way = sum(abs(float(drive[b.stop - 1] - drive[b.start])) for b in branches(drive))
    seconds = float(record_inputs.time_s[-1] - record_inputs.time_s[0])
    return replace(whole, rate_Hz=way / (2 * float(np.ptp(drive))) / seconds if record_inputs.timed else math.nan)


def _same(a: Protocol, b: Protocol) -> bool:
    pairs = ((a.preload_N, b.preload_N), (a.amplitude, b.amplitude), (a.rate_Hz, b.rate_Hz))
    return all(math.isnan(x) or math.isnan(y) or abs(x - y) <= _SAME * max(abs(x), abs(y)) for x, y in pairs)


def _trial(at: Protocol, low: float, high: float, unit: str, cycles: int = _CYCLES) -> Trial:
    """Make cycles between two ends of the drive, from rest; a sine where the rate is known, else point by point.

    A force is put on once: what unloading does was not seen where records only load.
    """
    timed = not math.isnan(at.rate_Hz)
    if unit == "N":
        force = high * np.arange(_OF_CYCLE + 1) / _OF_CYCLE
        return Trial(f"of a force up to {high:.3g} N", force, None, np.ones(force.size, dtype=np.int64), at.preload_N)
    about_zero = abs(low + high) <= _ONE_SIDED * (high - low)
    phase = np.arange((_OF_CYCLE // 4 if about_zero else 0) + cycles * _OF_CYCLE + 1) / _OF_CYCLE
    if about_zero:
        drive = (high - low) / 2 * (np.sin(2 * np.pi * phase) if timed else 1 - np.abs((4 * phase + 1) % 4 - 2))
        cycle = np.where(phase <= 0.25, 0, np.ceil(phase - 0.25 - 1e-9)).astype(np.int64)
    else:
        rise = (1 - np.cos(2 * np.pi * phase)) / 2 if timed else 1 - np.abs(2 * (phase % 1) - 1)
        drive = low + (high - low) * rise
        cycle = np.maximum(1, np.ceil(phase - 1e-9)).astype(np.int64)
    words = _words(at, unit) + (f", {cycles} cycles" if cycles > _CYCLES else "")
    return Trial(words, drive, phase / at.rate_Hz if timed else None, cycle, at.preload_N)


def _dwell(trial: Trial, at: Protocol) -> Trial:
    """Stop at the first full drive."""
    assert trial.time_s is not None
    top = int(np.argmax(trial.drive))
    length = DWELL / at.rate_Hz
    rest = trial.time_s[top] + length * np.arange(1, _DWELL_SAMPLES + 1) / _DWELL_SAMPLES
    return Trial(
        f"{trial.words}, held for {length:.3g} s where it first turns",
        np.insert(trial.drive, top + 1, np.full(_DWELL_SAMPLES, trial.drive[top])),
        np.concatenate([trial.time_s[: top + 1], rest, trial.time_s[top + 1 :] + length]),
        np.insert(trial.cycle, top + 1, np.full(_DWELL_SAMPLES, trial.cycle[top])),
        trial.preload_N,
    )


def _altered(trace: Trace, problem: Any, widest: int) -> list[Trial]:
    """Programs where the geometry is unknown: one record's own path, at other amplitudes and rates."""
    record, record_inputs = trace.records[widest], problem.inputs[widest]
    base = protocol(problem.records[widest])
    middle = float(record.drive.min() + record.drive.max()) / 2
    if abs(middle) <= _ONE_SIDED * base.amplitude:
        middle = 0.0
    seen = [protocol(one) for one in problem.records]
    rates = RATES[1:] if record_inputs.timed else ()
    out = []
    for a, r in [(0.5, 1.0), (0.25, 1.0), *((1.0, rate) for rate in rates)]:
        at = Protocol(base.preload_N, base.amplitude * a, base.rate_Hz * r)
        if not any(_same(at, other) for other in seen):
            time = record_inputs.time_s / r if record_inputs.timed else None
            drive = middle + a * (record_inputs.drive - middle)
            out.append(Trial(_words(at, record.drive_unit), drive, time, record_inputs.cycle, at.preload_N))
    return out


def _words(at: Protocol, unit: str) -> str:
    parts = [(at.preload_N, "N preload"), (at.amplitude, f"{unit} amplitude"), (at.rate_Hz, "Hz")]
    return "at " + ", ".join(f"{value:.3g} {name}" for value, name in parts if not math.isnan(value))


# --- what the records lack -----------------------------------------------------------------------------------------

_TELLING: tuple[tuple[str, str, str], ...] = (
    ("rate", "rate", "the residual goes with the rate"),
    ("cycle", "cycles", "the residual changes from cycle to cycle"),
    ("time", "dwell", "the residual goes with time"),
    ("even", "preload", "the residual is even in the drive, which unequal sides and a camera both make"),
    ("last reversal", "amplitude", "the residual goes with the way since a reversal, as loops do"),
    ("rising and falling", "amplitude", "the residual differs on the way up and down"),
)
"""Part of a free function's name, the protocol that tells its causes apart, and why."""


def _lacking(trace: Trace) -> str:
    """Say which protocol the records lack, by what the residual goes with."""
    lacks = _absent(trace)
    if trace.verdict == "unexplained":
        for name in trace.smooth.names:
            for part, what, why in _TELLING:
                if what in lacks and part in name:
                    return f"{lacks[what][0]}: {why}"
    for measure, why in lacks.values():
        return f"{measure}: {why}"
    if trace.verdict == "unexplained":
        return "the same records again, to see whether what is left repeats: if not, it is no property of the rig"
    return "nothing: the records differ in preload, amplitude and rate, with many cycles and a dwell among them"


def _absent(trace: Trace) -> dict[str, tuple[str, str]]:
    """Protocols that all records have alike: what to measure in their place, and what it would show."""
    inputs = trace.baseline.model.problem.inputs
    seen = [protocol(one) for one in trace.baseline.model.problem.records]
    preload, amplitude, rate = seen[0].preload_N, seen[0].amplitude, seen[0].rate_Hz
    unit, pulled = trace.records[0].drive_unit, trace.records[0].drive_unit == "N"
    out = {}
    if not pulled and _one([p.preload_N for p in seen]):
        such = f", such as {preload / 2:.3g} N" if preload > 0 else ""
        out["preload"] = f"a record at another preload{such}", "one preload does not show what acts on tension"
    if _one([p.amplitude for p in seen]):
        half = f"a record at half the amplitude, {amplitude / 2:.3g} {unit}"
        out["amplitude"] = half, "at one amplitude, play, loops and stops at an angle are much alike"
    if not pulled and _one([p.rate_Hz for p in seen]):
        fast = (
            "a record with times, at two rates"
            if math.isnan(rate)
            else f"a record at ten times the rate, {10 * rate:.3g} Hz"
        )
        out["rate"] = fast, "one rate does not show drag and delay"
    if not pulled and max(int(s.cycle.max()) for s in inputs) < MORE_CYCLES:
        out["cycles"] = f"a record of {MORE_CYCLES} cycles or more", "few cycles do not show what builds up over them"
    if not pulled and not any(_has_dwell(s) for s in inputs):
        out["dwell"] = "a record with a dwell at full drive", "without one, creep is hard to see"
    return out


def _one(values: Sequence[float]) -> bool:
    known = [v for v in values if not math.isnan(v)]
    return not known or max(known) - min(known) <= _SAME * max(abs(v) for v in known)


def _has_dwell(record_inputs: SampleInputs) -> bool:
    """Tell whether the drive stands still for the tenth part of a record with times."""
    if not record_inputs.timed or record_inputs.drive.size < 3:
        return False
    still = np.abs(np.diff(record_inputs.drive)) <= 1e-6 * np.ptp(record_inputs.drive)
    return bool(np.diff(record_inputs.time_s)[still].sum() > 0.1 * (record_inputs.time_s[-1] - record_inputs.time_s[0]))
