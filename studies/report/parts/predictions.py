"""Records beside the loops that their rig predicts before anything is fitted, for the page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hysteresis.records.backbone import backbone_of
from hysteresis.records.record_file import read_record
from studies.report.charts import Chart, Line, Plate
from studies.report.plots import ANGLE, LESS, Drawn, draw
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
    pairs = (("record", record, "grey", "points"), ("rig file", predicted, "orange", "solid"))
    alt = f"{one.record} and the loop that the rig file predicts, {one.rmse_deg:.3g} deg rms apart"
    whole = tuple(Line(r.drive, r.angle_deg, name, tone, style) for name, r, tone, style in pairs)  # type: ignore[arg-type]
    charts = [Chart("Record and rig file", drive, ANGLE, whole, f"{alt}.")]
    backbone = backbone_of(predicted)
    if backbone is not None:
        less = tuple(Line(r.drive, r.angle_deg - backbone, name, tone, style) for name, r, tone, style in pairs)  # type: ignore[arg-type]
        charts.append(Chart("Less the backbone", drive, LESS, less, f"{alt}, less one curve."))
    off = Line(record.drive, record.angle_deg - predicted.angle_deg, "record - rig file", "blue", "points")
    largest = f"Difference, {one.max_abs_deg:.3g} deg at most."
    charts.append(Chart("Difference", drive, "record - rig file, deg", (off,), largest))
    caption = (
        f"{one.record}: the rig as its file says, along the drive of the record; only the record's zero is "
        f"fitted. {one.rmse_deg:.3g} deg rms apart, noise {one.noise_floor_deg:.2g} deg. The backbone is "
        "that of the rig file's loop."
    )
    return PredictedRecord(one, draw(Plate(tuple(charts), caption, columns=3)))
