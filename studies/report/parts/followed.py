"""The summaries of ``notchbend compensate`` of a rig in space, for the page: drives that make the tip follow."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.files import inside, read_json
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_record
from studies.report.charts import Chart, Line, Plate, Tone
from studies.report.plots import Drawn, draw
from studies.report.summary import Verdict
from studies.report.templates import significant
from studies.report.wrist_plots import TENDON_TONES, tensions_of
from studies.results import read_result
from studies.results.compensation import ENDING, WHAT_IN_SPACE, SpaceCompensation

_OWN = "rms_without_compensation_deg"
"""A key that the summary of a planar rig does not have."""


@dataclass(frozen=True)
class FollowedSection:
    """Drives of all wheels that were computed, with their charts."""

    name: str
    result: SpaceCompensation
    plate: Drawn
    command: str


def is_in_space(path: Path) -> bool:
    """Whether a summary is that of a rig in space; one that is no object is of neither, and its reader says so.

    Raises
    ------
    RecordError
        A file that cannot be read.
    """
    values = read_json(path, WHAT_IN_SPACE)
    return isinstance(values, dict) and _OWN in values


def read_followed(folder: Path) -> tuple[FollowedSection, ...]:
    """Read the summaries of a folder with the drives beside them.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    return tuple(_followed(path) for path in sorted(folder.glob(f"*{ENDING}")) if is_in_space(path))


def _followed(path: Path) -> FollowedSection:
    found = read_result(SpaceCompensation, path, WHAT_IN_SPACE)
    file = inside(path, "drive", found.drive, [".csv"])
    record = read_record(file)
    if record.angle_2_deg is None:
        raise RecordError(f"{file}: columns.angle_2: missing: expected a record of a rig in space")
    sample = np.arange(record.drive.size, dtype=float)
    given = (record.drive, record.drive_2, record.drive_3, record.drive_4)
    drives = [(f"wheel {k + 1}", drive) for k, drive in enumerate(given) if drive is not None]
    path_line = (Line(record.angle_deg, record.angle_2_deg, "angles"),)
    angles = ("angle towards y, deg", "angle towards z, deg")
    charts = (
        Chart("Drives", "sample", "drive, mm", _lines(sample, drives), "Drives of the wheels over the samples."),
        Chart("Angles to follow", *angles, path_line, "Bending towards z over that towards y.", equal=True),
        Chart(
            "Tensions",
            "sample",
            "tension, N",
            _lines(sample, [(f"tendon {name}", one) for name, one in tensions_of(record).items()]),
            "Tensions of the tendons at their wheels over the samples.",
        ),
    )
    caption = "The drives that make the tip follow both angles, simulated from rest."
    again = (
        f"notchbend compensate RIG.toml --reference {shlex.quote(found.reference)} --out DIR/{shlex.quote(file.name)}"
    )
    command = again if found.made is None else found.made.command
    return FollowedSection(file.name, found, draw(Plate(charts, caption, columns=3)), command)


def _lines(sample: np.ndarray, curves: Sequence[tuple[str, np.ndarray]]) -> tuple[Line, ...]:
    tones: Sequence[Tone] = TENDON_TONES
    return tuple(Line(sample, y, name, tone) for (name, y), tone in zip(curves, tones, strict=False))


def followed_verdict(found: FollowedSection) -> Verdict:
    """Give the errors of drives for a wrist without friction, and of those that were found."""
    r = found.result
    words = f"root mean square distance of both angles of the model, by drives for no friction and by {found.name}"
    value = f"{significant(r.rms_without_compensation_deg)} → {significant(r.rms_deg)} deg"
    return Verdict("note", "Compensation", value, words, "compensation", found.command)
