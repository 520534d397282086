"""The drive that makes an angle follow a reference: files in, file out, for ``notchbend compensate``."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from hysteresis.arrays import Floats
from hysteresis.bouc_wen import BoucWen
from hysteresis.files import write_files
from hysteresis.inverse import UnreachableError, compensating_drive, uncompensated_drive
from hysteresis.record import RecordError
from hysteresis.record_file import read_columns, read_record
from hysteresis.settings import IdentifySettings
from studies.commands.identification import identify_records


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


@dataclass(frozen=True, eq=False)
class Known:
    """An identified layer and what a summary says of it, from a record or from an identify.json."""

    source: str
    models: Sequence[BoucWen]
    f: Callable[[Floats], Floats]
    plain: Callable[[Floats], Floats]
    drive_range: tuple[float, float]
    drive_unit: str
    first_drive: float
    delay_s: float
    heldout_rmse_deg: float
    without_hysteresis_rmse_deg: float
    warnings: tuple[str, ...]


def known_layer(source: Path, *, elements: int | None, seed: int, progress: bool) -> Known:
    """Identify a record, with f fitted to it, or read what ``notchbend identify`` wrote (a name that ends in .json).

    Raises
    ------
    RecordError
        A record that makes no loop, or a file that is none of the two; one line.
    """
    if source.suffix.lower() == ".json":
        return read_layer(source)
    record = read_record(source)
    fit = identify_records(
        [record], settings=IdentifySettings(seed=seed, elements=elements), use_rig=False, progress=progress
    )
    return Known(
        source=f"the record {record.source}",
        models=fit.models,
        f=fit.f,
        plain=fit.plain,
        drive_range=fit.drive_range,
        drive_unit=record.drive_unit,
        first_drive=fit.first_drive,
        delay_s=fit.delay_s,
        heldout_rmse_deg=fit.heldout.rmse_deg,
        without_hysteresis_rmse_deg=fit.baseline_heldout.rmse_deg,
        warnings=fit.warnings,
    )


def read_layer(path: Path) -> Known:
    """Read an identify.json; f between its places is a monotone cubic (PCHIP).

    Raises
    ------
    RecordError
        One line with the file, the key and what was expected.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise RecordError(f"{path}: {error}: expected the identify.json of `notchbend identify`") from None
    try:
        value = {name: float(entry["value"]) for name, entry in table["parameters"].items()}
        names = ("A", "beta", "gamma", "n", "h0_deg")
        suffixes = ["", *(f"_{i}" for i in range(2, int(table["elements"]) + 1))]
        curves = table["f"]
        return Known(
            source=str(path),
            models=tuple(BoucWen(*(value[name + suffix] for name in names)) for suffix in suffixes),
            f=PchipInterpolator(curves["drive"], curves["angle_deg"]),
            plain=PchipInterpolator(curves["drive"], curves["without_hysteresis_deg"]),
            drive_range=(float(curves["drive"][0]), float(curves["drive"][-1])),
            drive_unit=str(table["drive_unit"]),
            first_drive=float(table["first_drive"]),
            delay_s=value.get("delay_s", 0.0),
            heldout_rmse_deg=float(table["heldout"]["rmse_deg"]),
            without_hysteresis_rmse_deg=float(table["baseline"]["heldout"]["rmse_deg"]),
            warnings=tuple(str(text) for text in table["warnings"]),
        )
    except KeyError as error:
        expected = "expected the identify.json of `notchbend identify`"
        raise RecordError(f"{path}: {error.args[0]}: missing: {expected}") from None
    except (TypeError, ValueError, AttributeError, IndexError) as error:
        raise RecordError(f"{path}: {error}: expected the identify.json of `notchbend identify`") from None


def compensated(layer: Known, reference: Mapping[str, Floats], where: str) -> tuple[dict[str, Floats], dict[str, Any]]:
    """Turn a layer round.

    Returns
    -------
    columns
        Of the file to write: the drive in the record's unit, the angle wanted, the times if any.
    facts
        For the summary: the layer's error on samples it has not seen, and how far the two drives are apart.

    Raises
    ------
    RecordError
        A reference beyond the layer, or a layer that has no inverse; one line.
    """
    wanted = reference["angle_deg"]
    try:
        drive = compensating_drive(layer, wanted, layer.first_drive)
        plain = uncompensated_drive(layer, np.clip(wanted, *np.sort(layer.plain(np.array(layer.drive_range)))))
    except UnreachableError as error:
        reach = sum(model.saturation_deg for model in layer.models)
        low, high = np.sort(layer.f(np.array(layer.drive_range))) + np.array([1, -1]) * reach
        found = f"column 'angle_deg' = {wanted[error.sample]:g}"
        raise RecordError(
            f"{where}:{error.sample + 2}: {found}: beyond {layer.source}: "
            f"expected within about {low:.3g} to {high:.3g} deg"
        ) from None
    except ValueError as error:
        raise RecordError(f"{where}: by {layer.source}: {error}") from None
    times = {"time_s": reference["time_s"]} if "time_s" in reference else {}
    facts = {
        "schema": 1,
        "samples": int(wanted.size),
        "heldout_rmse_deg": layer.heldout_rmse_deg,
        "without_hysteresis_rmse_deg": layer.without_hysteresis_rmse_deg,
        "largest_correction": float(np.abs(drive - plain).max()),
        "drive_unit": layer.drive_unit,
        "warnings": list(layer.warnings),
    }
    return times | {f"drive_{layer.drive_unit}": drive, "angle_deg": wanted}, facts


def write_columns(columns: Mapping[str, Floats], path: Path) -> None:
    """Write columns of numbers as a CSV, whole or not at all."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    write_files({path: "\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows)]) + "\n"})
