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
from hysteresis.files import RecordError, present, require_place, write_files
from hysteresis.plain import optional
from hysteresis.records.metrics import loop_width, noise_floor
from hysteresis.records.path import cycle_index, cycle_slices, require_reversal
from hysteresis.records.record import DriveUnit, Record
from hysteresis.records.record_file import check_target, read_record, write_record
from hysteresis.records.sidecar import toml
from studies.own_rig.bench_csv import DELIMITERS, BenchTable, drive_unit_of, read_bench_csv
from studies.own_rig.columns import BenchColumns, columns_of, unused, values_of

_WHOLE = 0.9  # of the drive's range: a cycle that covers less is not counted
_ALIKE = 1.6  # factor between the measured range of the angle and that of the rig, above which it is said


@dataclass(frozen=True)
class RecordRig:
    """The rig of a record: the ``[rig]`` table of its sidecar, and the planar rig at the preload of the record."""

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
    columns: Mapping[str, str | list[str]]
    unused_columns: tuple[str, ...] = ()
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
    drive_unit: DriveUnit | None = None,
    title: str | None = None,
    out: Path | None = None,
) -> NewRecord:
    """Write the sidecar of a CSV, or a copy of the CSV that the reader of records takes with its sidecar.

    Parameters
    ----------
    columns
        Column of the CSV of drive, angle, time and cycle; None is found by its name. All other channels are found by
        their names (:func:`studies.own_rig.columns.columns_of`).
    drive_unit
        mm, deg, step, or N of a tendon force; by default what the name of the column says.
    out
        The copy; needed where the CSV has other delimiters than commas, comment lines or decimal commas.

    Raises
    ------
    RecordError, RigError
        One line: a CSV that cannot be understood, a record without a loop, a sidecar or a copy that exists.
    """
    target = path if out is None else out
    for file in (target.with_suffix(".toml"), *([out] if out is not None else [])):
        require_place(file)
        if present(file):
            raise RecordError(f"{file}: exists: expected no file, or --out with another name; it is left as it is")
    check_target(target, [path] if out is not None else [])
    table = read_bench_csv(path)
    if out is None and not table.plain:
        raise RecordError(f"{path}: {_way_of_writing(table)}: {_way_out(path)}")
    known = columns_of(table, columns, drive_unit)
    drive = known["force" if "force" in known else "drive"]
    assert isinstance(drive, str)
    unit = drive_unit or drive_unit_of(drive)
    values: dict[str, Any] = _once(values_of(table, known))
    record = Record(**values, drive_unit=unit, title=title or target.stem, rig=rig.table, source=str(path))
    if record.drive.size < 3:  # as where a record is read
        raise RecordError(f"{path}: {record.drive.size} samples: expected at least 3")
    if unit != "N":  # trials that only load are a record, too
        require_reversal(record)
    found = _understood(record, table, known, rig)
    _write(record, known, target, copied=out is not None)
    return replace(found, record=str(target), sidecar=str(target.with_suffix(".toml")))


def _once(values: dict[str, Floats]) -> dict[str, Floats]:
    """Drop samples that were logged twice, as where a record with times is read."""
    if "time_s" not in values:
        return values
    rows = np.column_stack(list(values.values()))
    once = np.r_[True, (np.diff(rows, axis=0) != 0).any(axis=1)]
    return {name: column[once] for name, column in values.items()}


def _way_of_writing(table: BenchTable) -> str:
    """Say in which way a CSV is written otherwise than the reader of records expects."""
    words = [f"{DELIMITERS[table.delimiter]}s between the fields"] * (table.delimiter != ",")
    words += [f"{table.comments} comment lines"] * (table.comments > 0)
    words += ["decimal commas"] * table.decimal_comma
    return ", ".join(words) or "quotes or empty lines"


def _way_out(path: Path) -> str:
    name = shlex.quote(f"{path.stem}-record.csv")
    return f"expected --out {name}, which writes a copy with commas and its sidecar; {path.name} is left as it is"


def _write(record: Record, known: BenchColumns, target: Path, *, copied: bool) -> None:
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


def _understood(record: Record, table: BenchTable, known: BenchColumns, rig: RecordRig) -> NewRecord:
    cycle = cycle_index(record)
    whole = np.ptp(record.drive)
    parts = [part for number, part in cycle_slices(record.drive, cycle) if number > 0]
    steps = np.abs(np.diff(record.drive))
    model = _range_of_rig(rig.rig, record)
    found = NewRecord(
        record="",
        sidecar="",
        columns=known,
        unused_columns=tuple(unused(table, known)),
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
        whole = f"{found.cycles} whole cycle{'s' * (found.cycles != 1)}"
        words.append(f"{whole}: two or more give the noise, and data that no fit has seen")
    if np.polyfit(record.drive, record.angle_deg, 1)[0] < 0 and found.drive_unit in ("mm", "N"):
        words.append("the angle falls as the drive rises: `notchbend trace` expects that pulling tendon a raises it")
    if found.drive_unit == "N" and _only_loads(record):
        words.append("the force only rises in every trial: `trace` takes that; `identify` and `compensate` need a loop")
    if found.drive_unit not in ("mm", "N"):
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


def _only_loads(record: Record) -> bool:
    try:
        require_reversal(record)
    except RecordError:
        return True
    return False


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
        f"columns: {', '.join(f'{key} = {_named(name)}' for key, name in found.columns.items())} ({', '.join(marks)})",
        *([f"not used: {', '.join(map(repr, found.unused_columns))}"] if found.unused_columns else []),
        f"samples: {found.samples}, {whole}",
        f"drive: {low:.4g} to {high:.4g} {unit} (amplitude {0.5 * (high - low):.4g}), {steps}",
        angle,
        f"{loop}noise: {found.noise_deg:.2g} deg",
        *(f"rig: {key} = {value}" for key, value in found.rig.items()),
        *(f"note: {words}" for words in found.remarks),
        f"sidecar: {found.sidecar}",
    ]


def _named(columns: str | list[str]) -> str:
    return repr(columns) if isinstance(columns, str) else f"{columns[0]!r} to {columns[-1]!r}"


def without_geometry(records: Sequence[Record], *, beside_rig: bool = False) -> list[str]:
    """Say of which records the geometry is unknown because they have no sidecar, and how they get one.

    ``beside_rig``: also of those whose sidecar names no rig, which is odd beside a rig that was given.
    """
    words = []
    for record in records:
        side = Path(record.source).with_suffix(".toml")
        if beside_rig and record.tube and not set(record.rig) - {"preload_N"}:
            words.append(
                f"{record.source}: its sidecar {side.name} has tube and notches and names no rig: metal, friction and "
                'tendons are fitted to the data; [rig] file = "RIG.toml" in place of [tube] and [notch] takes this rig'
            )
            continue
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
