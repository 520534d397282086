"""The charts of a rig in space: loops of each wheel, tensions, the path of the tip, and what it reaches."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import cycle

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from studies.report.charts import Chart, Line, Plate, Tone
from studies.report.plots import DRIVE, PRELOADS, less_curve, width_chart
from studies.results.workspace import WAYS

TENDON_TONES: tuple[Tone, ...] = ("blue", "green", "orange", "purple")
"""Of tendons a to d, as in the pictures."""
_WAY_TONES: tuple[Tone, ...] = ("grey", "blue", "orange")
_SMOOTH = "no friction, no loop"


def in_plane(record: Record, direction_deg: float) -> Record:
    """Give a record whose angle is the bending in a direction, from y towards z."""
    assert record.angle_2_deg is not None
    turn = math.radians(direction_deg)
    return replace(record, angle_deg=record.angle_deg * math.cos(turn) + record.angle_2_deg * math.sin(turn))


def titled(moves: str) -> str:
    """Give what moves with a capital letter."""
    return moves[:1].upper() + moves[1:]


def wheel_plate(
    moves: str, records: Sequence[Record], smooth: Sequence[Record], labels: Sequence[str], directions: Sequence[float]
) -> Plate:
    """Chart both bending angles over the drive of a motion, what friction makes of them, and the width of the loop.

    ``records`` and ``smooth``, without friction and loop, have the drive of the motion as their drive, one for each
    preload. ``directions`` are those of the planes in which they bend.
    """
    planes = [in_plane(record, direction) for record, direction in zip(records, directions, strict=True)]
    curves = [in_plane(record, direction) for record, direction in zip(smooth, directions, strict=True)]
    width, widest = width_chart(planes, labels)
    most = 1.05 * max(_largest(record) for record in records)
    charts = []
    for axis, name in (("y", "angle_deg"), ("z", "angle_2_deg")):
        lines = (Line(one.drive, getattr(one, name), *two) for one, two in zip(records, _tones(labels), strict=True))
        alt = f"Bending towards {axis} over the drive, {moves}."
        label = f"angle towards {axis}, deg"
        charts.append(Chart(f"Bending towards {axis}", DRIVE, label, tuple(lines), alt, y_range=(-most, most)))
    against = tuple(
        Line(one.drive, less_curve(one, curve), *two)
        for one, curve, two in zip(planes, curves, _tones(labels), strict=True)
    )
    alt = "The loops less the angle of the wrist without friction and loop, in the plane in which the tip bends most."
    charts.append(Chart("Difference from no friction", DRIVE, "angle, deg", against, alt))
    caption = (
        f"Angles over the drive, {moves}. Difference and width are those in the plane in which the tip "
        f"bends most; the width is at most {', '.join(widest)}."
    )
    return Plate((*charts, width), caption, heading=titled(moves))


def _largest(record: Record) -> float:
    assert record.angle_2_deg is not None
    return float(np.abs([record.angle_deg, record.angle_2_deg]).max())


def _tones(labels: Sequence[str]) -> list[tuple[str, Tone]]:
    return [(label, tone) for label, tone in zip(labels, cycle(PRELOADS), strict=False)]


def tensions_plate(records: Mapping[str, Record], heading: str) -> Plate:
    """Chart the tensions at the wheels over the drive, or over the samples of a path; one chart for each record."""
    charts = []
    for title, record in records.items():
        along = record.drive if title != "Path" else np.arange(record.drive.size, dtype=float)
        lines = tuple(
            Line(along, tension, f"tendon {name}", tone)
            for (name, tension), tone in zip(tensions_of(record).items(), TENDON_TONES, strict=False)
        )
        words = f"Tensions of the tendons at their wheels, {title[0].lower()}{title[1:]}."
        charts.append(Chart(title, DRIVE if title != "Path" else "sample", "tension, N", lines, words))
    return Plate(tuple(charts), "Tensions of the tendons at their wheels, with friction.", 3, heading)


def tensions_of(record: Record) -> dict[str, Floats]:
    """Give the tensions that a record has, by the letter of their tendon."""
    named = {name: getattr(record, f"tension_{name}_N") for name in "abcd"}
    return {name: tension for name, tension in named.items() if tension is not None}


def path_plate(paths: Sequence[tuple[Record, Record]], labels: Sequence[str], caption: str) -> Plate:
    """Chart the way of the tip with friction and without, seen along the tube and from the side."""
    views = (("seen along the tube", 1, 2), ("from the side", 0, 1))
    charts = []
    for (record, smooth), label in zip(paths, labels, strict=True):
        assert record.tip_mm is not None
        assert smooth.tip_mm is not None
        for words, first, second in views:
            lines = (
                Line(smooth.tip_mm[:, first], smooth.tip_mm[:, second], _SMOOTH, "grey", "dash"),
                Line(record.tip_mm[:, first], record.tip_mm[:, second], "with friction", "blue"),
            )
            charts.append(_of_tip(f"{label}, {words}", first, second, lines))
        apart = np.linalg.norm(record.tip_mm - smooth.tip_mm, axis=1)
        line = Line(np.arange(apart.size, dtype=float), apart, "distance")
        alt = f"Distance of the tips with friction and without, at most {apart.max():.2g} mm."
        charts.append(Chart(f"{label}, between the two", "sample", "distance, mm", (line,), alt))
    return Plate(tuple(charts), caption, columns=3)


def reach_plate(tips: Mapping[str, Floats], caption: str) -> Plate:
    """Chart what the tip reaches; ``tips`` by their way, :data:`studies.results.workspace.WAYS`, (k, d, 3) each.

    Circles are closed; a single curve is not.
    """
    charts = []
    for words, first, second in (("Seen along the tube", 1, 2), ("From the side", 0, 1)):
        lines = []
        for (way, name), tone in zip(WAYS.items(), _WAY_TONES, strict=True):
            x, y = tips[way][..., first], tips[way][..., second]
            gap = np.full((len(x), 1), np.nan)  # ends one circle before the next
            lines.append(Line(np.hstack([x, gap]).ravel(), np.hstack([y, gap]).ravel(), name, tone))
        charts.append(_of_tip(words, first, second, tuple(lines)))
    return Plate(tuple(charts), caption)


def _of_tip(title: str, first: int, second: int, lines: tuple[Line, ...]) -> Chart:
    names = "xyz"
    alt = f"Places of the tip, {names[second]} over {names[first]}: {', '.join(line.name for line in lines)}."
    return Chart(title, f"tip {names[first]}, mm", f"tip {names[second]}, mm", lines, alt, equal=True)
