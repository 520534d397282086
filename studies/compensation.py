"""The drive that makes an angle follow a reference: files in, file out, for ``notchbend compensate``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hysteresis.files import write_files
from hysteresis.inverse import UnreachableError, compensating_drive, uncompensated_drive
from hysteresis.record import Record, RecordError, read_columns
from studies.identification import identify_records

Floats = NDArray[np.float64]


def read_reference(path: Path) -> dict[str, Floats]:
    """Read the angles to follow: a CSV with angle_deg and, where there are times, time_s.

    Raises
    ------
    RecordError
        One line with file, line, column, value and what was expected.
    """
    columns = read_columns(path, ["angle_deg"], optional=["time_s"])
    times = columns.get("time_s")
    if times is not None and (steps := np.diff(times) <= 0).any():
        line = int(np.argmax(steps)) + 3
        raise RecordError(f"{path}:{line}: column 'time_s' = {times[line - 2]:g}: expected times that increase")
    return columns


def compensated(
    record: Record, reference: Mapping[str, Floats], where: str, *, elements: int | None, seed: int, progress: bool
) -> tuple[dict[str, Floats], dict[str, Any]]:
    """Identify a record, with f fitted to it, and turn it round.

    Returns
    -------
    columns
        Of the file to write: the drive in the record's unit, the angle wanted, the times if any.
    facts
        For the summary: the layer's error on samples it has not seen, and how far the two drives are apart.

    Raises
    ------
    RecordError
        A record that makes no loop, or a reference beyond it; one line.
    """
    fit = identify_records([record], seed=seed, use_rig=False, progress=progress, elements=elements)
    wanted = reference["angle_deg"]
    try:
        drive = compensating_drive(fit, wanted, float(record.drive[0]))
        plain = uncompensated_drive(fit, np.clip(wanted, *np.sort(fit.plain(np.array(fit.drive_range)))))
    except UnreachableError as error:
        low, high = np.sort(fit.f(np.array(fit.drive_range))) + np.array([1, -1]) * fit.saturation_deg.value
        found = f"column 'angle_deg' = {wanted[error.sample]:g}"
        raise RecordError(
            f"{where}:{error.sample + 2}: {found}: beyond the record {record.source}: "
            f"expected within about {low:.3g} to {high:.3g} deg"
        ) from None
    except ValueError as error:
        raise RecordError(f"{where}: by the record {record.source}: {error}") from None
    times = {"time_s": reference["time_s"]} if "time_s" in reference else {}
    facts = {
        "schema": 1,
        "samples": int(wanted.size),
        "heldout_rmse_deg": fit.heldout.rmse_deg,
        "without_hysteresis_rmse_deg": fit.baseline_heldout.rmse_deg,
        "largest_correction": float(np.abs(drive - plain).max()),
        "drive_unit": record.drive_unit,
        "warnings": list(fit.warnings),
    }
    return times | {f"drive_{record.drive_unit}": drive, "angle_deg": wanted}, facts


def write_columns(columns: Mapping[str, Floats], path: Path) -> None:
    """Write columns of numbers as a CSV, whole or not at all."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    write_files({path: "\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows)]) + "\n"})
