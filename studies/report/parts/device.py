"""``follow.json`` for the page: one device over its records, what changed, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hysteresis.files import present
from hysteresis.records.record import RecordError
from studies.report.plots import Drawn
from studies.report.summary import Verdict
from studies.results import read_result

if TYPE_CHECKING:
    from studies.follow import FollowReport
    from validation.tracing.effect import Effect

FILE = "follow.json"


@dataclass(frozen=True)
class DeviceSection:
    """What was found of a device, with its charts and the effects that are named."""

    result: FollowReport
    effects: tuple[Effect, ...]
    plates: tuple[Drawn, ...]
    command: str


def read_device(folder: Path) -> DeviceSection | None:
    """Read ``follow.json``; None if there is no such file.

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    path = folder / FILE
    if not present(path):
        return None
    from studies.follow.page import effects_of, plates_of  # the tracer, which other pages do not need
    from studies.follow.result import WHAT, FollowReport

    found = read_result(FollowReport, path, WHAT)
    _require_rows(path, found)
    command = "notchbend follow RECORD... --out DIR" if found.made is None else found.made.command
    return DeviceSection(found, effects_of(found), plates_of(found), command)


def _require_rows(path: Path, found: FollowReport) -> None:
    count = len(found.records)
    if not found.words or not found.parameters:
        raise RecordError(f"{path}: words, parameters: empty: expected those of a device")
    rows: list[tuple[str, Sequence[float | None]]] = [("axis.values", found.axis.values)]
    rows += [(f"parameters.{one.name}", row) for one in found.parameters for row in (one.values, one.low, one.high)]
    rows += [(f"parameters.{one.name}.average", one.average) for one in found.parameters]
    for name, row in rows:
        if len(row) != count:
            raise RecordError(f"{path}: {name}: {len(row)} values: expected {count}, one for each record")
    for place in [one.alarm for one in found.parameters if one.alarm is not None] + [c.first for c in found.changes]:
        if not 1 <= place <= count:
            raise RecordError(f"{path}: a record with the number {place}: expected 1 to {count}")


def device_verdict(section: DeviceSection) -> Verdict:
    """Give the verdict, with what explains the change."""
    r = section.result
    cause = " + ".join(r.cause.effects) if r.cause is not None and r.cause.effects else ""
    words = r.words[0] + (f" Cause: {cause}." if cause else "")
    return Verdict("holds" if r.verdict == "steady" else "look", "Device", r.verdict, words, "device", section.command)
