"""State of a rig at the first sample of a record, which the record does not tell: where its drive came from.

Friction and material remember the last reversals. A log that starts in motion, or after one, does not begin at rest.
Where the residual is large in the first stroke alone, the drive may have come to its first sample from a stroke beyond
it, on either side. The one is taken with which the residual of the training samples is smallest.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from typing import TypeVar

import numpy as np

from fem_models.load import LoadProgram
from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats, Mask
from hysteresis.records.path import branches
from validation.tracing.baseline.rig_problem import RigProblem
from validation.tracing.baseline.runs import Run
from validation.tracing.effect import Values
from validation.tracing.settings import APPROACH_SAMPLES

STROKES = (1 / 32, 1 / 8, 1 / 2)
"""Lengths of the stroke before the first sample, over the drive's range."""
FAR_OFF = 5.0
"""Rms residual in the first stroke over that behind it from which the state at its begin is in doubt, and by how much
another state lowers it at least. An effect that is missing is missing in all strokes."""

SomeRig = TypeVar("SomeRig", bound=RigProblem)


def with_first_states(problem: SomeRig, values: Values, train: tuple[Mask, ...]) -> SomeRig:
    """Give each run the way to its first sample that a rig of the baseline's ``values`` follows best.

    Parameters
    ----------
    train
        Training masks of all records, shapes (m_i,): other samples take no part in the choice.
    """
    runs = list(problem.setup.runs)
    for i, of_record in enumerate(runs):
        if len(of_record) == 1 and isinstance(of_record[0].program, LoadProgram) and train[i].any():
            way = _best_way(problem, values, of_record[0], problem.observed[i], train[i])
            runs[i] = of_record if way is of_record[0] else (way,)
    if all(one is other for one, other in zip(runs, problem.setup.runs, strict=True)):
        return problem
    return replace(problem, setup=replace(problem.setup, runs=tuple(runs)))


def _best_way(problem: RigProblem, values: Values, run: Run, angle_deg: Floats, train: Mask) -> Run:
    """Give the run itself, or one that comes from elsewhere, where only the residual of the first stroke is large."""
    assert isinstance(run.program, LoadProgram)
    drive = run.program.drive_mm
    first_stroke = branches(drive[run.skip :])[0]
    early = np.zeros(train.size, dtype=bool)
    early[first_stroke] = True

    def left(way: Run) -> tuple[float, float, float]:
        """Squares of all training samples, and their rms in the first stroke and behind it; the zero is free."""
        error = problem.driven(way, values).angle_deg(problem.rig(way, values, [])) - angle_deg
        error = error - error[train].mean()
        first, rest = (float(np.sqrt(np.mean(error[train & part] ** 2))) for part in (early, ~early))
        return float(np.sum(error[train] ** 2)), first, rest

    if not (train & early).any() or not (train & ~early).any():
        return run
    least, first, rest = left(run)
    best, most = run, first / FAR_OFF
    if first < FAR_OFF * rest:
        return run
    span, begin = float(np.ptp(drive)), float(drive[run.skip])
    for away in (sign * part * span for part in STROKES for sign in (1.0, -1.0)):
        if not drive.min() <= begin + away <= drive.max():
            continue
        other = coming_from(run, away)
        with suppress(SolverError, RigError):
            square, there, _ = left(other)
            if square < least and there < most:
                best, least = other, square
    return best


def as_started(run: Run, other: Run) -> Run:
    """Let the drive of a run come to its first sample as that of another one."""
    return coming_from(run, other.away_mm) if other.away_mm else run


def coming_from(run: Run, away_mm: float) -> Run:
    """Let the drive of a run come to the first sample of its record from so far beyond it."""
    program, at = run.program, run.skip
    assert isinstance(program, LoadProgram)
    drive = program.drive_mm
    steps = max(2, math.ceil(abs(away_mm) / float(np.ptp(drive)) * APPROACH_SAMPLES))
    out = np.linspace(0.0, away_mm, steps + 1)
    stroke = drive[at] + np.concatenate([out, out[::-1]])[1:-1]
    more = stroke.size

    def longer(values: Floats) -> Floats:
        return np.concatenate([values[:at], stroke, values[at:]])

    time_s, cycle = program.time_s, program.cycle
    if time_s is not None:
        step = float(np.diff(time_s).mean())
        before = time_s[at] - step * np.arange(more, 0, -1)
        time_s = np.concatenate([time_s[:at] - step * more, before, time_s[at:]])
    if cycle is not None:
        cycle = np.concatenate([cycle[:at], np.zeros(more, dtype=np.int64), cycle[at:]])
    where = run.where
    return replace(
        run,
        program=LoadProgram(longer(drive), time_s=time_s, cycle=cycle),
        skip=at + more,
        away_mm=away_mm,
        short=None if run.short is None else LoadProgram(longer(run.short.drive_mm)),
        where=None if where is None else np.concatenate([np.arange(at + more), where[at:] + more]),
    )
