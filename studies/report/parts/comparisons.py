"""``validate.json`` and the summaries of ``notchbend compensate`` for the page."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.files import inside, present
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import column_names, read_columns
from studies.report.charts import Chart, Line, Plate
from studies.report.parts.followed import is_in_space
from studies.report.plots import ANGLE, Drawn, draw
from studies.report.summary import Verdict
from studies.report.templates import significant
from studies.results import compensation, read_result, validation
from studies.results.compensation import CompensationSummary
from studies.results.validation import StoredValidation


@dataclass(frozen=True)
class ValidationSection:
    """The models of a rig side by side; ``forces`` are the tensions at which the chain is bent."""

    result: StoredValidation
    forces: tuple[float, ...]
    command: str


@dataclass(frozen=True)
class CompensationSection:
    """A drive that was computed, with its charts."""

    name: str
    result: CompensationSummary
    plate: Drawn
    gain: float | None
    command: str


def read_validation(folder: Path) -> ValidationSection | None:
    """Read ``validate.json``; None if there is no such file.

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    path = folder / "validate.json"
    if not present(path):
        return None
    result = read_result(StoredValidation, path, validation.WHAT)
    if not result.models.models:
        raise RecordError(f"{path}: models: models: empty: expected {validation.WHAT}")
    forces = tuple(bent.tendon_N for bent in result.models.models[0].bent)
    options = result.options or f"--preset {result.models.rig}"
    command = f"notchbend validate {options} --out DIR" if result.made is None else result.made.command
    return ValidationSection(result, forces, command)


def read_compensations(folder: Path) -> tuple[CompensationSection, ...]:
    """Read the summaries of a folder with the drives beside them; those of rigs in space are another part.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    paths = sorted(folder.glob(f"*{compensation.ENDING}"))
    return tuple(_compensation(path) for path in paths if not is_in_space(path))


def _compensation(path: Path) -> CompensationSection:
    found = read_result(CompensationSummary, path, compensation.WHAT)
    name = found.drive or path.name.removesuffix(compensation.ENDING) + ".csv"
    file = inside(path, "drive", name, [".csv"])
    timed = "time_s" in column_names(file)
    column = read_columns(file, [f"drive_{found.drive_unit}", "angle_deg", *(["time_s"] if timed else [])])
    drive, angle = column[f"drive_{found.drive_unit}"], column["angle_deg"]
    label = f"drive, {found.drive_unit}"
    place, along = (column["time_s"], "time, s") if timed else (np.arange(drive.size, dtype=np.float64), "sample")
    charts = (
        Chart("Drive", along, label, (Line(place, drive, "drive"),), f"Drive over the {along}."),
        Chart("Angle to follow", label, ANGLE, (Line(drive, angle, "angle"),), "Angle over the drive: a loop."),
    )
    caption = "The drive that makes the angle follow the reference; beside it the angle over this drive."
    before, after = found.without_hysteresis_rmse_deg, found.heldout_rmse_deg
    given = f"{shlex.quote(found.record or 'RECORD')} --reference {shlex.quote(found.reference or 'REFERENCE.csv')}"
    again = f"notchbend compensate {given} --out DIR/{shlex.quote(file.name)}"
    return CompensationSection(
        name=file.name,
        result=found,
        plate=draw(Plate(charts, caption)),
        gain=before / after if after > 0 else None,
        command=found.made.command if found.made is not None else again,
    )


def validation_verdict(found: ValidationSection) -> Verdict:
    """Judge the bending stiffness of the models by that of the reference."""
    rows = [row for row in found.result.models.models if row.bending_percent is not None]
    most = max((abs(row.bending_percent or 0.0) for row in rows), default=0.0)
    words = f"largest difference in bending stiffness of a model of one joint from {found.result.models.judge}"
    return Verdict("note", "Models of a joint", f"{most:.2g} %", words, "validation", found.command)


def compensation_verdict(found: CompensationSection) -> Verdict:
    """Give the errors that are left by a curve without hysteresis, and by the layer that was inverted."""
    r = found.result
    words = f"held-out RMSE of the curve without hysteresis and of the layer that {found.name} inverts"
    value = f"{significant(r.without_hysteresis_rmse_deg)} → {significant(r.heldout_rmse_deg)} deg"
    return Verdict("note", "Compensation", value, words, "compensation", found.command)
