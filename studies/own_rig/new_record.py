"""A record out of a table from the bench, and what is understood of it: the work of ``notchbend record new``."""

from __future__ import annotations

import math
import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_models.analytic.of_record import angle_range_of_rig, unit_words
from fem_models.rig import Rig, RigError
from fem_models.rig.of_record import require_the_rigs_sense, rig_of
from hysteresis.arrays import Floats
from hysteresis.files import RecordError, present, require_place, write_files
from hysteresis.messages import listed, quoted
from hysteresis.plain import optional
from hysteresis.records.metrics import loop_width, noise_floor
from hysteresis.records.path import cycle_index, cycle_slices, moved_while_held, require_reversal
from hysteresis.records.record import Record
from hysteresis.records.record_file import check_target, read_record, write_record
from hysteresis.records.sidecar import toml
from hysteresis.sensors.readings import cleaned
from studies.own_rig.columns import BenchColumns, Reading, unused
from studies.own_rig.samples import Samples, samples_of, with_stamps
from studies.own_rig.tables import BenchTable, read_table
from studies.own_rig.usual import unusual

_WHOLE = 0.9  # of the drive's range: a cycle that covers less is not counted
_MOST_HELD = 0.5  # of the angle's travel: above it, it moves while the drive stands still
_LONG_MM = 200.0  # a drive beyond this and without a unit is most likely in another one
_SMALL_DEG = 7.0  # an angle within this and without a unit may be in rad
_ALIKE = 1.6  # factor between the measured range of the angle and that of the rig, above which it is said


@dataclass(frozen=True)
class RecordRig:
    """The rig of a record: the ``[rig]`` table of its sidecar, and the planar rig at the preload of the record."""

    table: Mapping[str, Any]
    rig: Rig | None


@dataclass(frozen=True, kw_only=True)
class NewRecord:
    """What is understood of a table. ``columns`` has its columns by key of the sidecar; angles and noise are in deg.

    ``understood`` are sentences on what was converted, put in order or left out; ``copied`` tells whether a clean copy
    was written with the sidecar. ``rig_angle_range_deg`` is the range of the angle that the analytic model of the rig
    has over the same drives.
    """

    schema: int = 1
    record: str
    sidecar: str
    kind: str = "CSV"
    encoding: str = ""
    sheet: str = ""
    copied: bool = False
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
    time_range_s: tuple[float, float] | None = optional()
    loop_width_deg: float | None
    noise_deg: float
    rig: Mapping[str, Any]
    rig_angle_range_deg: tuple[float, float] | None = optional()
    understood: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


def new_record(
    path: Path,
    rig: RecordRig,
    reading: Reading | None = None,
    *,
    title: str | None = None,
    out: Path | None = None,
) -> NewRecord:
    """Write the sidecar of a CSV that the reader of records takes as it is; of any other table a clean copy with it.

    Parameters
    ----------
    reading
        What is not found by names: columns, units, encoding, sheet. All other channels are found by their names
        (:func:`studies.own_rig.columns.further_channels`).
    out
        The copy; by default ``<stem>-record.csv`` next to the table, and none where it can be read as it is.

    Raises
    ------
    RecordError, RigError, MissingError
        One line: a table that cannot be understood, a record without a loop, a sidecar or a copy that exists.
    """
    _require_free(path.with_suffix(".toml") if out is None and path.suffix.lower() == ".csv" else None, out, path)
    reading = Reading() if reading is None else reading
    table = with_stamps(read_table(path, encoding=reading.encoding, sheet=reading.sheet))
    samples = samples_of(table, reading)
    record = _record_of(path, samples, rig, title or (path if out is None else out).stem)
    found = _understood(record, table, samples, rig)
    plain = table.plain and samples.as_they_are and path.suffix.lower() == ".csv"
    target = path
    if out is not None or not (plain and _write_sidecar(record, samples.columns, path)):
        target = path.with_name(f"{path.stem}-record.csv") if out is None else out
        _require_free(None, target, path)
        _write_copy(record, target)
    return replace(found, record=str(target), sidecar=str(target.with_suffix(".toml")), copied=target != path)


def _record_of(path: Path, samples: Samples, rig: RecordRig, title: str) -> Record:
    """Make the record of samples.

    Raises
    ------
    RecordError
        Fewer than three samples, a drive or an angle that stands still, a drive that never reverses and is no force.
    """
    values: dict[str, Any] = dict(samples.values)
    if values["drive"].size < 3:  # as where a record is read
        raise RecordError(f"{path}: {values['drive'].size} samples: expected at least 3")
    drive = str(samples.columns["force" if samples.drive_unit == "N" else "drive"])
    for name, field in ((drive, "drive"), (str(samples.columns["angle"]), "angle_deg")):
        if np.ptp(values[field]) == 0:
            found = f"column {quoted(name)} = {values[field][0]:g} in all {values[field].size} samples"
            raise RecordError(f"{path}: {found}: expected one that changes")
    record = Record(
        **values,
        drive_unit=samples.drive_unit,
        drive_column=drive,
        title=title,
        rig=rig.table,
        source=str(path),
    )
    if samples.drive_unit != "N":  # trials that only load are a record, too
        require_reversal(record)
    return record


def _require_free(sidecar: Path | None, out: Path | None, path: Path) -> None:
    """Refuse to write over a file, or into a folder that cannot be written to."""
    files = [sidecar] if sidecar is not None else []
    files += [out.with_suffix(".toml"), out] if out is not None else []
    for file in files:
        require_place(file)
        if present(file):
            raise RecordError(f"{file}: exists: expected no file, or --out with another name; it is left as it is")
    if out is not None:
        check_target(out, [path])


def _write_sidecar(record: Record, known: BenchColumns, path: Path) -> bool:
    """Write the sidecar of a CSV; remove it and return False where the reader of records does not find the record."""
    sidecar = path.with_suffix(".toml")
    head = {"schema": 1, "title": record.title, "kind": "measured", "columns": dict(known)}
    rig = dict(record.rig)
    if "file" in rig:
        rig["file"] = Path(os.path.relpath(Path(rig["file"]).resolve(), path.parent.resolve())).as_posix()
    good = False
    try:
        write_files({sidecar: toml({**head, "drive": {"unit": record.drive_unit}, "rig": rig})})
        good = replace(read_record(path), rig=record.rig) == record
    except RecordError:
        pass
    finally:
        if not good:
            sidecar.unlink(missing_ok=True)
    return good


def _write_copy(record: Record, target: Path) -> None:
    """Write a copy with its sidecar; nothing stays that the reader of records refuses."""
    try:
        write_record(record, target)
        read_record(target)
    except (RecordError, OSError):
        for file in (target.with_suffix(".toml"), target):
            file.unlink(missing_ok=True)
        raise


def _understood(as_read: Record, table: BenchTable, samples: Samples, rig: RecordRig) -> NewRecord:
    """Say what a table was taken as; numbers of the angle without what its sensor added."""
    sensed = cleaned(as_read)
    record, cycle = sensed.record, cycle_index(as_read)
    whole = np.ptp(record.drive)
    parts = [part for number, part in cycle_slices(record.drive, cycle) if number > 0]
    steps = np.abs(np.diff(record.drive))
    model = angle_range_of_rig(rig.rig, record)
    found = NewRecord(
        record="",
        sidecar="",
        kind=table.kind,
        encoding=table.encoding,
        sheet=table.sheet,
        columns=samples.columns,
        unused_columns=tuple(unused(table, samples.columns)),
        delimiter=table.delimiter,
        comment_lines=table.comments,
        decimal_comma=table.decimal_comma,
        drive_unit=record.drive_unit,
        samples=record.drive.size,
        drive_range=_ends(record.drive),
        step=float(np.median(steps[steps > 0])),
        cycles=sum(bool(np.ptp(record.drive[part]) >= _WHOLE * whole) for part in parts),
        approach=bool((cycle == 0).any()),
        angle_range_deg=_ends(record.angle_deg),
        time_range_s=None if record.time_s is None else _ends(record.time_s),
        loop_width_deg=_width(record) if _in_jumps(record) is None else None,
        noise_deg=noise_floor(record),
        rig=dict(rig.table),
        rig_angle_range_deg=model,
        understood=samples.notes,
    )
    about_rig = () if rig.rig is None else tuple(unusual(rig.rig))
    return replace(found, remarks=(*sensed.words, *_remarks(found, record), *about_rig))


def _ends(values: Floats) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _width(record: Record) -> float | None:
    try:
        return loop_width(record.drive, record.angle_deg, cycle_index(record)).max_deg
    except ValueError:  # no closed cycle
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
    if (jumps := _in_jumps(record)) is not None:
        words.append(f"{jumps}; no loop width is given")
    if (
        any("says no unit: taken as deg" in one for one in found.understood)
        and max(map(abs, found.angle_range_deg)) < _SMALL_DEG
    ):
        words.append(f"the angle is within {_SMALL_DEG:g} and says no unit: of radians, --angle-unit rad")
    stroke = found.drive_range[1] - found.drive_range[0]
    if any("says no unit: taken as mm" in one for one in found.understood) and stroke > _LONG_MM:
        words.append(f"the drive covers more than {_LONG_MM:g} mm and says no unit: of steps or um, --drive-unit")
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
    marks = [f"{found.delimiter}s"] if found.delimiter else [found.kind]
    marks += [f"{found.comment_lines} comment lines"] * (found.comment_lines > 0)
    marks += ["decimal commas"] * found.decimal_comma + [found.encoding] * (found.encoding not in ("", "utf-8"))
    marks += [f"sheet {found.sheet!r}"] * bool(found.sheet)
    whole = f"{found.cycles} whole cycle{'s' * (found.cycles != 1)}{' after an approach' * found.approach}"
    angle = f"angle: {found.angle_range_deg[0]:.4g} to {found.angle_range_deg[1]:.4g} deg"
    if found.rig_angle_range_deg is not None:
        angle += "; by the rig without friction {:.4g} to {:.4g} deg".format(*found.rig_angle_range_deg)
    loop = "" if found.loop_width_deg is None else f"loop width: {found.loop_width_deg:.3g} deg; "
    return [
        f"columns: {', '.join(f'{key} = {_named(name)}' for key, name in found.columns.items())} ({', '.join(marks)})",
        *([f"not used: {listed(map(repr, found.unused_columns), 300)}"] if found.unused_columns else []),
        *(f"read: {words}" for words in found.understood),
        f"samples: {found.samples}, {whole}",
        f"drive: {low:.4g} to {high:.4g} {unit} (amplitude {0.5 * (high - low):.4g}), {steps}",
        angle,
        *([] if found.time_range_s is None else [_time_line(found.time_range_s, found.samples)]),
        f"{loop}noise: {found.noise_deg:.2g} deg",
        *(f"rig: {key} = {value}" for key, value in found.rig.items()),
        *(f"note: {words}" for words in found.remarks),
        *([f"record: {found.record}"] if found.copied else []),
        f"sidecar: {found.sidecar}",
    ]


def _time_line(time_s: tuple[float, float], samples: int) -> str:
    whole = time_s[1] - time_s[0]
    return f"time: {whole:.4g} s, {(samples - 1) / whole:.3g} samples a second"


def _named(columns: str | list[str]) -> str:
    return repr(columns) if isinstance(columns, str) else f"{columns[0]!r} to {columns[-1]!r}"


def _in_jumps(record: Record) -> str | None:
    """Say how much of the angle's travel is while the drive stands still, where that is most of it."""
    held = moved_while_held(record.drive, record.angle_deg)
    if held <= _MOST_HELD:
        return None
    return (
        f"{100 * held:.0f} % of the angle's travel is while the drive stands still: a drive in jumps, whose angle "
        "follows late, is no loop: expected one that moves slowly or in small steps"
    )


def unlike_loops(records: Sequence[Record]) -> list[str]:
    """Say of which records the drive jumps, and of which the angle has another unit or sense than that of their rig.

    In another unit: it covers far more, or far less, than the rig makes of the drive.
    """
    words = []
    for record in records:
        if (jumps := _in_jumps(record)) is not None:
            words.append(f"{record.source}: {jumps}")
        try:
            of_rig, unit = angle_range_of_rig(rig_of(record), record), unit_words(record)
        except RigError:  # which is said elsewhere
            continue
        if of_rig is not None:
            try:
                require_the_rigs_sense(record)
            except RecordError as error:
                words.append(str(error))
        words += [unit] if unit else []
    return words


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
