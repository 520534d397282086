"""``wrist.json`` for the page: geometry, loops, tensions, path and compliance of a rig that bends in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hysteresis.files import present
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_record
from studies.report.parts.pictures import PictureSection, read_picture
from studies.report.parts.reach import compliance_verdict
from studies.report.plots import Drawn, draw
from studies.report.summary import Verdict, energy_verdict, preload_label, strain_verdict
from studies.report.templates import significant
from studies.report.wrist_plots import path_plate, tensions_plate, titled, wheel_plate
from studies.results.run import record_of_run
from studies.results.wrist import FILE, TipPath, WheelLoop, WristSummary, read_wrist

_SLACK = 0.01
_CIRCLE = (
    "All wheels move to a circle of the drives, and once round. Without friction and loop the tip closes its way; with "
    "them it lags behind."
)
_ONE_WHEEL = "The only wheel moves through its loop."
_COLUMNS = {"drive": "drive", "angle_2": "angle_2_deg", "tip_x": "tip_mm", "tension_a": "tension_a_N"}


@dataclass(frozen=True)
class WristSection:
    """A rig in space with its charts; ``simulate`` are the commands that make its loops and its path."""

    result: WristSummary
    command: str
    picture: PictureSection
    loops: tuple[Drawn, ...]
    tensions: tuple[Drawn, ...]
    path: Drawn | None
    simulate: tuple[str, ...]


def read_wrist_section(folder: Path) -> WristSection | None:
    """Read ``wrist.json`` with its records; None if there is no such file.

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    if not present(folder / FILE):
        return None
    found = read_wrist(folder)
    preloads = list(dict.fromkeys(loop.preload_N or 0.0 for loop in found.loops))
    loops = {loop.record: _of_motion(_record(folder, loop.record), loop, folder) for loop in found.loops}
    smooth = {loop.theory: _of_motion(_record(folder, loop.theory), loop, folder) for loop in found.loops}
    paths = [(_record(folder, path.record), _record(folder, path.smooth)) for path in found.paths]
    tensions = []
    for preload in preloads:
        here = {titled(loop.moves): loops[loop.record] for loop in found.loops if loop.preload_N == preload}
        for path, (record, _) in zip(found.paths, paths, strict=True):
            if path.circle and path.preload_N == preload:
                here["Path"] = record
        tensions.append(draw(tensions_plate(here, f"{preload:g} N")))
    motions = dict.fromkeys(loop.moves for loop in found.loops)
    return WristSection(
        result=found,
        command=found.made.command if found.made else f"notchbend run {found.option} --out DIR",
        picture=read_picture(folder, FILE, found.picture),
        loops=tuple(_motion(moves, found.loops, loops, smooth) for moves in motions),
        tensions=tuple(tensions),
        path=_path(found, paths),
        simulate=tuple(_commands(found)),
    )


def _record(folder: Path, name: str) -> Record:
    """Read a record of a rig in space."""
    path = record_of_run(folder, name, FILE)
    record = read_record(path)
    for column, given in _COLUMNS.items():
        if getattr(record, given) is None:
            raise RecordError(f"{path}: columns.{column}: missing: expected a record of a rig in space")
    return record


def _of_motion(record: Record, loop: WheelLoop, folder: Path) -> Record:
    """Give a record with the drive of a loop as its drive, from the wheel that moves most."""
    drives = [record.drive, record.drive_2, record.drive_3, record.drive_4][: len(loop.unit)]
    largest = int(np.abs(loop.unit).argmax()) if loop.unit and np.isfinite(loop.unit).all() else 0
    drive = drives[largest] if drives else None
    if drive is None or not loop.unit[largest] or not np.ptp(drive) > 0:
        raise RecordError(f"{folder / FILE}: loops: unit = {loop.unit}: no such wheels move in {loop.record}")
    return replace(record, drive=drive / loop.unit[largest])


def _motion(moves: str, loops: Sequence[WheelLoop], records: dict[str, Record], smooth: dict[str, Record]) -> Drawn:
    own = [loop for loop in loops if loop.moves == moves]
    plate = wheel_plate(
        moves,
        [records[loop.record] for loop in own],
        [smooth[loop.theory] for loop in own],
        [preload_label(loop) for loop in own],
        [loop.direction_deg for loop in own],
    )
    return draw(plate)


def _path(found: WristSummary, paths: Sequence[tuple[Record, Record]]) -> Drawn | None:
    if not paths:
        return None
    labels = [f"{path.preload_N:g} N" for path in found.paths]
    return draw(path_plate(paths, labels, _CIRCLE if found.paths[0].circle else _ONE_WHEEL))


def _commands(found: WristSummary) -> list[str]:
    """Give the commands for the loop of the first wheel, where it moves alone, and for the circle, at each preload."""
    out, alone = [], not any(found.loops[0].unit[1:])
    for circle in (False, True):
        for path in found.paths:
            if not (path.circle if circle else alone):
                continue
            ends = "--circle --out circle.csv" if circle else "--cycles 3 --out loop.csv"
            options = f"{found.option} --preload {path.preload_N:g} --amplitude {found.amplitude_mm:g}"
            out.append(f"notchbend simulate {options} {ends}")
    return out


def wrist_verdicts(section: WristSection) -> list[Verdict]:
    """Give the verdicts of a rig in space: bending, loops, strain, tensions, energy, path and compliance."""
    found, command = section.result, section.command
    at = f"one motion after the other, at {found.amplitude_mm:g} mm"
    lost = _each(found.loops, "lost_motion_mm")
    out = [
        Verdict(
            "note",
            "Bending",
            f"{_each(found.loops, 'full_scale_deg')} deg",
            f"{at}; {_names(found.loops)}",
            "loops",
            command,
        ),
        Verdict("note", "Loop width", f"{_each(found.loops, 'loop_width_deg')} deg", at, "loops", command),
        Verdict(
            "note",
            "Lost motion",
            f"{lost} mm",
            f"width along the drive, {at}",
            "loops",
            command,
        ),
        strain_verdict(found.loops, command),
        _tensions(found, command),
        energy_verdict(found.loops, command),
    ]
    if found.paths:
        path = found.paths[-1]
        words = (
            f"largest distance of the tip with friction from that without it, {path.mean_apart_mm:.2g} mm in the mean, "
        )
        words += f"at {path.preload_N:g} N"
        out.append(
            Verdict("note", "Path of the tip", f"{significant(path.largest_apart_mm)} mm", words, "path", command)
        )
    if found.compliance:
        out.append(compliance_verdict(found.compliance, command))
    return out


def _each(loops: Sequence[WheelLoop], name: str) -> str:
    values = [getattr(loop, name) for loop in loops]
    return " / ".join("none" if value is None else significant(value) for value in values)


def _names(loops: Sequence[WheelLoop]) -> str:
    return ", ".join(f"{loop.moves} at {preload_label(loop)}" for loop in loops)


def _tensions(found: WristSummary, command: str) -> Verdict:
    runs: Sequence[WheelLoop | TipPath] = (*found.loops, *found.paths)
    low, high = min(one.least_tension_N for one in runs), max(one.largest_tension_N for one in runs)
    slack = any(one.least_tension_N <= _SLACK * (one.preload_N or 0.0) for one in runs)
    words = "at the wheels, in the loops and on the path" + ("; a tendon goes slack" if slack else "")
    return Verdict(
        "look" if slack else "note",
        "Tensions",
        f"{significant(low)} to {significant(high)} N",
        words,
        "tensions",
        command,
    )
