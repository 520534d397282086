"""The sidecar of a record from the bench, and what is understood of its CSV: the work of ``notchbend record new``."""

from __future__ import annotations

import math
import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_models.analytic import theory_curve
from fem_models.rig import Rig, RigError
from hysteresis.arrays import Floats
from hysteresis.files import RecordError, write_files
from hysteresis.plain import optional
from hysteresis.records.metrics import loop_width, noise_floor
from hysteresis.records.path import cycle_index, cycle_slices, require_reversal
from hysteresis.records.record import FIELDS, Record
from hysteresis.records.record_file import check_target, read_record, write_record
from hysteresis.records.sidecar import toml
from studies.own_rig.bench_csv import DELIMITERS, BenchTable, drive_unit_of, guess_column, read_bench_csv

KEYS = ("drive", "angle", "time", "cycle")
_WHOLE = 0.9  # of the drive's range: a cycle that covers less is not counted
_ALIKE = 1.6  # factor between the measured range of the angle and that of the rig, above which it is said


@dataclass(frozen=True)
class RecordRig:
    """The rig of a record: the ``[rig]`` table of its sidecar, and the rig at the preload of the record."""

    table: Mapping[str, Any]
    rig: Rig | None


@dataclass(frozen=True, kw_only=True)
class NewRecord:
    """What is understood of a CSV. ``columns`` has its columns by key of the sidecar; angles and noise are in degrees.

    ``rig_angle_range_deg`` is the range of the angle that the analytic model of the rig has over the same drives.
    """

    schema: int = 1
    record: str
    sidecar: str
    columns: Mapping[str, str]
    delimiter: str
    comment_lines: int
    decimal_comma: bool
    drive_unit: str
    samples: int
    drive_range: tuple[float, float]
    step: float
    cycles: int
    approach: bool
    angle_range_deg: tuple[float, float]
    loop_width_deg: float | None
    noise_deg: float
    rig: Mapping[str, Any]
    rig_angle_range_deg: tuple[float, float] | None = optional()
    remarks: tuple[str, ...] = ()


def new_record(
    path: Path,
    rig: RecordRig,
    *,
    columns: Mapping[str, str | None],
    drive_unit: str | None = None,
    title: str | None = None,
    out: Path | None = None,
) -> NewRecord:
    """Write the sidecar of a CSV, or a copy of the CSV that the reader of records takes with its sidecar.

    Parameters
    ----------
    columns
        Column of the CSV by key of the sidecar (:data:`KEYS`); None is found by its name.
    drive_unit
        mm, deg or step; by default what the name of the column says.
    out
        The copy; needed where the CSV has other delimiters than commas, comment lines or decimal commas.

    Raises
    ------
    RecordError, RigError
        One line: a CSV that cannot be understood, a record without a loop, a sidecar or a copy that exists.
    """
    target = path if out is None else out
    for file in (target.with_suffix(".toml"), *([out] if out is not None else [])):
        if file.exists():
            raise RecordError(f"{file}: exists: expected no file, or --out with another name; it is left as it is")
    check_target(target, [path] if out is not None else [])
    table = read_bench_csv(path)
    if out is None and not table.plain:
        raise RecordError(f"{path}: {_way_of_writing(table)}: {_way_out(path)}")
    known = _columns(table, columns)
    unit = drive_unit or drive_unit_of(known["drive"])
    values: dict[str, Any] = {FIELDS[key]: table.numbers(name) for key, name in known.items()}
    record = Record(**values, drive_unit=unit, title=title or target.stem, rig=rig.table, source=str(path))  # type: ignore[arg-type]
    require_reversal(record)
    found = _understood(record, table, known, rig)
    _write(record, known, target, copied=out is not None)
    return replace(found, record=str(target), sidecar=str(target.with_suffix(".toml")))


def _columns(table: BenchTable, given: Mapping[str, str | None]) -> dict[str, str]:
    known = dict[str, str]()
    for key in KEYS:
        name = given.get(key) or guess_column(table, key)
        if name is None and key in ("drive", "angle"):
            raise RecordError(
                f"{table.path}: no column is named as the {key}: the columns are {', '.join(table.columns)}: "
                f"expected --{key}-column NAME"
            )
        if name is not None and (given.get(key) or name not in known.values()):
            known[key] = name
    return known


def _way_of_writing(table: BenchTable) -> str:
    """Say in which way a CSV is written otherwise than the reader of records expects."""
    words = [f"{DELIMITERS[table.delimiter]}s between the fields"] * (table.delimiter != ",")
    words += [f"{table.comments} comment lines"] * (table.comments > 0)
    words += ["decimal commas"] * table.decimal_comma
    return ", ".join(words) or "quotes or empty lines"


def _way_out(path: Path) -> str:
    name = shlex.quote(f"{path.stem}-record.csv")
    return f"expected --out {name}, which writes a copy with commas and its sidecar; {path.name} is left as it is"


def _write(record: Record, known: Mapping[str, str], target: Path, *, copied: bool) -> None:
    """Write the sidecar, or the copy with its sidecar; nothing stays that the reader of records refuses."""
    sidecar = target.with_suffix(".toml")
    try:
        if copied:
            write_record(record, target)
        else:
            head = {"schema": 1, "title": record.title, "kind": "measured", "columns": dict(known)}
            rig = dict(record.rig)
            if "file" in rig:
                rig["file"] = Path(os.path.relpath(Path(rig["file"]).resolve(), target.parent.resolve())).as_posix()
            write_files({sidecar: toml({**head, "drive": {"unit": record.drive_unit}, "rig": rig})})
        read_record(target)
    except (RecordError, OSError):
        sidecar.unlink(missing_ok=True)
        if copied:
            target.unlink(missing_ok=True)
        raise


def _understood(record: Record, table: BenchTable, known: Mapping[str, str], rig: RecordRig) -> NewRecord:
    cycle = cycle_index(record)
    whole = np.ptp(record.drive)
    parts = [part for number, part in cycle_slices(record.drive, cycle) if number > 0]
    steps = np.abs(np.diff(record.drive))
    model = _range_of_rig(rig.rig, record)
    found = NewRecord(
        record="",
        sidecar="",
        columns=known,
        delimiter=DELIMITERS[table.delimiter],
        comment_lines=table.comments,
        decimal_comma=table.decimal_comma,
        drive_unit=record.drive_unit,
        samples=record.drive.size,
        drive_range=_ends(record.drive),
        step=float(np.median(steps[steps > 0])),
        cycles=sum(bool(np.ptp(record.drive[part]) >= _WHOLE * whole) for part in parts),
        approach=bool((cycle == 0).any()),
        angle_range_deg=_ends(record.angle_deg),
        loop_width_deg=_width(record),
        noise_deg=noise_floor(record),
        rig=dict(rig.table),
        rig_angle_range_deg=model,
    )
    return replace(found, remarks=tuple(_remarks(found, record)))


def _ends(values: Floats) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _width(record: Record) -> float | None:
    try:
        return loop_width(record.drive, record.angle_deg, cycle_index(record)).max_deg
    except ValueError:  # no closed cycle
        return None


def _range_of_rig(rig: Rig | None, record: Record) -> tuple[float, float] | None:
    if rig is None or record.drive_unit != "mm":
        return None
    try:
        return _ends(theory_curve(rig, np.linspace(*_ends(record.drive), 41)).angle_deg)
    except (RigError, ValueError):  # the rig cannot follow this drive, which is said elsewhere
        return None


def _remarks(found: NewRecord, record: Record) -> list[str]:
    """Say what a reader should know before the record is used."""
    words = []
    if found.cycles < 2:
        words.append(f"{found.cycles} whole cycles: two or more give the noise, and data that no fit has seen")
    if np.polyfit(record.drive, record.angle_deg, 1)[0] < 0 and found.drive_unit == "mm":
        words.append("the angle falls as the drive rises: `notchbend trace` expects that pulling tendon a raises it")
    if found.drive_unit != "mm":
        words.append(f"the drive is in {found.drive_unit}: its gain to mm is unknown and is identified")
    if not set(found.rig) - {"preload_N"}:
        words.append("no rig: the geometry is unknown, and f(x) is fitted to the data; --rig FILE names it")
    if found.rig_angle_range_deg is not None:
        mine, its = (math.dist([b], [a]) for a, b in (found.angle_range_deg, found.rig_angle_range_deg))
        if not its / _ALIKE <= mine <= its * _ALIKE:
            words.append(
                f"the angle covers {mine:.3g} deg, and {its:.3g} deg by the rig: expected degrees and mm, and the rig "
                "of this record"
            )
    return words


def lines(found: NewRecord) -> list[str]:
    """Say on a terminal what was understood."""
    low, high = found.drive_range
    unit, steps = found.drive_unit, f"steps of {found.step:.3g} {found.drive_unit}"
    marks = [f"{found.delimiter}s"] + [f"{found.comment_lines} comment lines"] * (found.comment_lines > 0)
    marks += ["decimal commas"] * found.decimal_comma
    whole = f"{found.cycles} whole cycle{'s' * (found.cycles != 1)}{' after an approach' * found.approach}"
    angle = f"angle: {found.angle_range_deg[0]:.4g} to {found.angle_range_deg[1]:.4g} deg"
    if found.rig_angle_range_deg is not None:
        angle += "; by the rig without friction {:.4g} to {:.4g} deg".format(*found.rig_angle_range_deg)
    loop = "" if found.loop_width_deg is None else f"loop width: {found.loop_width_deg:.3g} deg; "
    return [
        f"columns: {', '.join(f'{key} = {name!r}' for key, name in found.columns.items())} ({', '.join(marks)})",
        f"samples: {found.samples}, {whole}",
        f"drive: {low:.4g} to {high:.4g} {unit} (amplitude {0.5 * (high - low):.4g}), {steps}",
        angle,
        f"{loop}noise: {found.noise_deg:.2g} deg",
        *(f"rig: {key} = {value}" for key, value in found.rig.items()),
        *(f"note: {words}" for words in found.remarks),
        f"sidecar: {found.sidecar}",
    ]


def without_geometry(records: Sequence[Record], *, beside_rig: bool = False) -> list[str]:
    """Say of which records the geometry is unknown because they have no sidecar, and how they get one.

    ``beside_rig``: also of those whose sidecar names no rig, which is odd beside a rig that was given.
    """
    words = []
    for record in records:
        side = Path(record.source).with_suffix(".toml")
        if set(record.rig) - {"preload_N"} or record.tube or record.kinematics is not None:
            continue
        if side.exists() and not beside_rig:
            continue
        new = f"`notchbend record new {shlex.quote(record.source)} --rig RIG.toml --preload N` names its rig"
        missing = f"no sidecar {side.name}: its geometry is unknown, and f(x) is fitted to the data; {new}"
        if side.exists():
            missing = f"its sidecar {side.name} names no rig: its geometry is unknown, and f(x) is fitted to the data"
        words.append(f"{record.source}: {missing}")
    return words
