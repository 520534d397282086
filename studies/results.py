"""Stored results: figures of a loop, JSON files, and checksums of the records that they were made from."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hysteresis.files import write_files
from hysteresis.metrics import dissipated_area, loop_width
from hysteresis.record import Record, RecordError


def loop_summary(record: Record) -> dict[str, Any]:
    """Full scale of a record and, where it closes a loop, widest place, width at zero drive, area."""
    full = {"title": record.title, "full_scale_deg": float(np.abs(record.angle_deg).max())}
    try:
        width = loop_width(record.drive, record.angle_deg, record.cycle)
        area = dissipated_area(record.drive, record.angle_deg, record.cycle)
    except ValueError:  # a program of its own need not close a loop
        return full
    return full | {
        "loop_width_deg": width.max_deg,
        "widest_at_drive_mm": width.at_drive,
        "loop_width_at_zero_deg": width.at_zero_deg,
        "loop_area_deg_mm": area,
    }


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write JSON whole or not at all; the folder is made."""
    write_files({path: json.dumps(data, indent=2) + "\n"})


def flat(data: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested values under dotted names, for a table on a terminal; long texts and tables of sources left out."""
    out: dict[str, Any] = {}
    for key, value in data.items():
        name = f"{prefix}{key}"
        if name in ("rig", "versions", "fits", "sha256"):
            continue
        if isinstance(value, Mapping):
            out |= flat(value, name + ".")
        elif isinstance(value, Sequence) and not isinstance(value, str) and value and isinstance(value[0], Mapping):
            for i, item in enumerate(value):
                out |= flat(item, f"{name}[{i}].")
        else:
            out[name] = value
    return out


def checksums(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Give the sha256 of records in a folder of results, by name.

    Raises
    ------
    RecordError
        A record that cannot be read.
    """
    digests = {}
    for name in names:
        path = folder / "records" / f"{name}.csv"
        try:
            digests[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        except OSError as error:
            raise RecordError(f"{path}: {error.strerror}: expected a record of `notchbend run`") from None
    return digests


def require_unchanged(folder: Path) -> None:
    """Refuse a folder whose records are not those that its results were made from.

    Raises
    ------
    RecordError
        One line with the file: a record that is gone or has changed, or no ``run.json`` of a finished run.
    """
    path = folder / "run.json"
    again = "run `notchbend run` again"
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror}: expected results of `notchbend run`") from None
    except ValueError as error:
        raise RecordError(f"{path}: not JSON: {error}") from None
    expected = stored.get("sha256") if isinstance(stored, Mapping) else None
    if not isinstance(expected, Mapping):
        raise RecordError(f"{path}: sha256: missing, expected the checksums of the records; {again}")
    for name, found in checksums(folder, expected).items():
        if found != expected[name]:
            file = folder / "records" / f"{name}.csv"
            raise RecordError(f"{file}: sha256 {found[:12]}...: expected {expected[name][:12]}... of the run; {again}")
