"""Trace of the measured wrists with each trial left out in turn, of every choice.

The effects are searched for, chosen and fitted on the other trials; then the trial that was left out is predicted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hysteresis import Record, read_record
from hysteresis.arrays import Mask
from validation.tracing import trace_records
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.fitting import Fitted, Model, fit
from validation.tracing.fitting.fitted import rms


@dataclass(frozen=True)
class LeftOutTrial:
    """A trial that was left out.

    Parameters
    ----------
    trial
        Its number.
    named
        Effects that the other trials name.
    closure_deg
        Angle at which the notches close by these; None if closure is not named.
    before_deg, after_deg
        Rms error of the tip in the trial, by the baseline and with the effects.
    samples
        Of the trial.
    """

    trial: int
    named: tuple[str, ...]
    closure_deg: float | None
    before_deg: float
    after_deg: float
    samples: int


def leave_trials_out(folder: Path, tube: str) -> list[LeftOutTrial]:
    """Trace a tube's record without each of its trials in turn.

    Raises
    ------
    RecordError
        As :func:`hysteresis.records.record_file.read_record`.
    SolverError
        A model without an equilibrium in the trial that was left out.
    """
    record = read_record(folder / f"notched-wrist-{tube}.csv")
    assert record.cycle is not None
    return [without_trial(record, int(trial)) for trial in np.unique(record.cycle)]


def pooled_deg(trials: Sequence[LeftOutTrial]) -> tuple[float, float]:
    """Rms error over all samples of trials, before and after."""
    errors = np.array([[one.before_deg**2, one.after_deg**2] for one in trials])
    before, after = np.sqrt(np.average(errors, axis=0, weights=[one.samples for one in trials])).tolist()
    return before, after


def without_trial(record: Record, trial: int) -> LeftOutTrial:
    """Trace a record without one of its trials, and predict that one."""
    assert record.cycle is not None
    rest = record.cycle != trial
    trace = trace_records([_part(record, rest)], threads=1)
    before, after = (_error_deg(record, rest, fitted) for fitted in (trace.baseline, trace.augmented))
    values = dict(zip(trace.names, trace.augmented.model.values(trace.augmented.x)[1], strict=True))
    return LeftOutTrial(
        trial, trace.names, values.get("notch_closure", {}).get("angle_deg"), before, after, int((~rest).sum())
    )


def _error_deg(record: Record, rest: Mask, fitted: Fitted) -> float:
    """Error of a model in the left-out trial, fitted to all the others from where their trace ended."""
    model = fitted.model
    again = fit(model, fitted.holdout.everything(), fitted.x, threads=1)
    problem = known_rig_problem([record])
    assert problem is not None
    error = Model(problem, model.added).errors(again.x)[0]
    return rms(error[~rest] - error[rest].mean())


def _part(record: Record, kept: Mask) -> Record:
    """Record with some of its samples."""
    columns = ("drive", "angle_deg", "time_s", "cycle", "notches_deg", "tip_mm", "tension_a_N", "tension_b_N")
    there = {name: getattr(record, name) for name in columns}
    some: dict[str, Any] = {name: None if value is None else value[kept] for name, value in there.items()}
    return replace(record, **some)
