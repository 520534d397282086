"""The records of a trace and what its models predict, sample by sample: a CSV next to ``trace.json``."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hysteresis.arrays import Floats, Ints
from hysteresis.messages import listed
from hysteresis.records.record import DRIVE_UNITS, RecordError
from hysteresis.records.record_file import column_names, read_columns

if TYPE_CHECKING:
    from validation.tracing.outcome import Trace

SAMPLES = "trace-samples.csv"
_CLOCKS = ("time_s", "sample")
_ANGLE, _BASELINE, _AUGMENTED = "angle_deg", "baseline_deg", "augmented_deg"


@dataclass(frozen=True, eq=False)
class TraceSamples:
    """All samples of all records; arrays of shape (m,).

    ``record`` counts from 1, through the records and then the references; ``cycle`` is 0 on the approach. ``clock`` is
    time_s, or sample where a record has no times. Predicted angles have the offset of their record.
    ``augmented_deg`` is None where no effect is named.
    """

    drive_unit: str
    clock: str
    record: Ints
    cycle: Ints
    drive: Floats
    time: Floats
    angle_deg: Floats
    baseline_deg: Floats
    augmented_deg: Floats | None

    def columns(self) -> dict[str, Floats | Ints]:
        """Give the columns of the file by name."""
        out: dict[str, Floats | Ints] = {
            "record": self.record,
            "cycle": self.cycle,
            f"drive_{self.drive_unit}": self.drive,
            self.clock: self.time,
            _ANGLE: self.angle_deg,
            _BASELINE: self.baseline_deg,
        }
        return out if self.augmented_deg is None else out | {_AUGMENTED: self.augmented_deg}


def samples_of(trace: Trace) -> TraceSamples:
    """Take the samples of a trace, with the predictions of the baseline and of the model with the named effects."""
    problem = trace.baseline.model.problem
    angle = np.concatenate(problem.observed)
    named = trace.augmented is not trace.baseline and bool(trace.names)
    return TraceSamples(
        drive_unit=trace.records[0].drive_unit,
        clock=_CLOCKS[0] if all(one.timed for one in problem.inputs) else _CLOCKS[1],
        record=np.repeat(np.arange(len(problem.inputs)) + 1, [one.drive.size for one in problem.inputs]),
        cycle=np.concatenate([one.cycle for one in problem.inputs]),
        drive=np.concatenate([one.drive for one in problem.inputs]),
        time=np.concatenate([one.time_s for one in problem.inputs]),
        angle_deg=angle,
        baseline_deg=angle - np.concatenate(trace.baseline.residuals),
        augmented_deg=angle - np.concatenate(trace.augmented.residuals) if named else None,
    )


def samples_csv(samples: TraceSamples) -> str:
    """Give the CSV: seven digits, which is finer than any sensor."""
    columns, stream = samples.columns(), io.StringIO()
    np.savetxt(stream, np.column_stack(list(columns.values())), fmt="%.7g", delimiter=",")
    return f"{','.join(columns)}\n{stream.getvalue()}"


def read_samples(path: Path, records: int) -> TraceSamples:
    """Read the samples of a trace of a number of records.

    Raises
    ------
    RecordError
        One line with the file, and the column or the value that is not that of a trace.
    """
    names = column_names(path)
    unit = next((unit for unit in DRIVE_UNITS if f"drive_{unit}" in names), "mm")
    clock = next((name for name in _CLOCKS if name in names), _CLOCKS[0])
    wanted = ["record", "cycle", f"drive_{unit}", clock, _ANGLE, _BASELINE]
    found = read_columns(path, wanted, [_AUGMENTED])
    if not found["record"].size:
        raise RecordError(f"{path}: no samples: expected those of {records} records")
    for name, low, high in (("record", 1, records), ("cycle", 0, np.inf)):
        bad = (found[name] != np.round(found[name])) | (found[name] < low) | (found[name] > high)
        for i in np.flatnonzero(bad)[:1]:
            expected = f"a whole number from {low}" + (f" to {high:g}" if np.isfinite(high) else "")
            raise RecordError(f"{path}:{i + 2}: column {name} = {found[name][i]:g}: expected {expected}")
    number = found["record"].astype(int)
    if missing := sorted(set(range(1, records + 1)) - set(number.tolist())):
        raise RecordError(f"{path}: column record: none of {listed(map(str, missing))}: expected 1 to {records}")
    return TraceSamples(
        drive_unit=unit,
        clock=clock,
        record=number,
        cycle=found["cycle"].astype(int),
        drive=found[f"drive_{unit}"],
        time=found[clock],
        angle_deg=found[_ANGLE],
        baseline_deg=found[_BASELINE],
        augmented_deg=found.get(_AUGMENTED),
    )
