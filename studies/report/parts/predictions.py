"""Records beside the loops that their rig predicts before anything is fitted, for the page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.path import branches
from hysteresis.records.record_file import read_record
from studies.report.charts import Chart, Line, Plate
from studies.report.plots import ANGLE, Drawn, draw
from studies.results.run import Prediction, RunSummary


@dataclass(frozen=True)
class PredictedRecord:
    """A prediction with its charts."""

    result: Prediction
    plate: Drawn


def predicted_records(folder: Path, run: RunSummary) -> tuple[PredictedRecord, ...]:
    """Read the records of a user's own rig and the loops that it predicts; empty for the default rig.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    return tuple(_predicted(folder, one) for one in (run.own.predictions if run.own is not None else ()))


def _predicted(folder: Path, one: Prediction) -> PredictedRecord:
    record, predicted = (read_record(folder / "records" / f"{name}.csv") for name in (one.record, one.predicted))
    drive = f"drive, {record.drive_unit}"
    middle = _middle(predicted.drive, predicted.angle_deg)
    pairs = (("record", record, "grey", "points"), ("rig file", predicted, "orange", "solid"))
    whole = tuple(Line(r.drive, r.angle_deg, name, tone, style) for name, r, tone, style in pairs)  # type: ignore[arg-type]
    less = tuple(Line(r.drive, r.angle_deg - middle, name, tone, style) for name, r, tone, style in pairs)  # type: ignore[arg-type]
    off = Line(record.drive, record.angle_deg - predicted.angle_deg, "record - rig file", "blue", "points")
    alt = f"{one.record} and the loop that the rig file predicts, {one.rmse_deg:.3g} deg rms apart"
    charts = (
        Chart("Record and rig file", drive, ANGLE, whole, f"{alt}."),
        Chart("Less the middle of the loop", drive, "angle - middle, deg", less, f"{alt}, less one curve."),
        Chart("Difference", drive, "record - rig file, deg", (off,), f"Difference, {one.max_abs_deg:.3g} deg at most."),
    )
    caption = (
        f"{one.record}: the rig as its file says, along the drive of the record; only the record's zero is "
        f"fitted. {one.rmse_deg:.3g} deg rms apart, noise {one.noise_floor_deg:.2g} deg."
    )
    return PredictedRecord(one, draw(Plate(charts, caption, columns=3)))


def _middle(drive: Floats, angle: Floats) -> Floats:
    """Give the mean of the last two branches of a loop at every sample, shape (m,): its backbone."""
    pair = [(drive[part], angle[part]) for part in branches(drive)[-2:]]
    order = [np.argsort(x, kind="stable") for x, _ in pair]
    return np.asarray(np.mean([np.interp(drive, x[k], y[k]) for (x, y), k in zip(pair, order, strict=True)], axis=0))
