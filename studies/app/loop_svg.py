"""Loops of the app as SVG text, small enough to be sent at each move of a slider."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.backbone import backbone_of
from hysteresis.records.path import branches, cycle_index, cycle_slices
from hysteresis.records.record import Record

WIDTH, HEIGHT = 620, 400
LEFT, RIGHT, TOP, BOTTOM = 66, 14, 14, 54
MOST_POINTS = 2000
"""Samples of a measured curve that are drawn: more of them do not change the picture."""

Kind = Literal["before", "measured", "now"]


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve to draw: ``drive_mm`` and ``angle_deg`` of shape (m,), and which of the page's colours it has."""

    kind: Kind
    drive_mm: Floats
    angle_deg: Floats


def less_backbone(record: Record) -> tuple[Floats, Floats] | None:
    """Take the backbone of a record from its last closed cycle; None where there is no cycle.

    Returns
    -------
    tuple of Floats
        Drive and angle less the backbone, each of shape (m,), along the two branches of the cycle.
    """
    backbone = backbone_of(record)
    if backbone is None:
        return None
    slices = [part for number, part in cycle_slices(record.drive, cycle_index(record)) if number != 0]
    closed = (part for part in reversed(slices) if len(branches(record.drive[part])) == 2)
    last = next(closed, None)
    return None if last is None else (record.drive[last], (record.angle_deg - backbone)[last])


def loop_svg(curves: Sequence[Curve], label: str) -> str:
    """Draw curves over the drive, mm, the last one in front; ``label`` stands at the scale of the angle, deg."""
    x = _Axis(np.concatenate([curve.drive_mm for curve in curves]), LEFT, WIDTH - RIGHT)
    y = _Axis(np.concatenate([curve.angle_deg for curve in curves]), HEIGHT - BOTTOM, TOP)
    angle = curves[-1].angle_deg
    description = f"{label}, {angle.min():.2f} to {angle.max():.2f}"
    parts = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{description}">']
    for tick in x.ticks:
        at = x.place(tick)
        parts.append(f'<path class="grid" d="M{at:.1f} {TOP}V{HEIGHT - BOTTOM}"/>')
        parts.append(f'<text x="{at:.1f}" y="{HEIGHT - BOTTOM + 20}" text-anchor="middle">{tick:g}</text>')
    for tick in y.ticks:
        at = y.place(tick)
        parts.append(f'<path class="grid" d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{at + 5:.1f}" text-anchor="end">{tick:g}</text>')
    for curve in curves:
        every = -(-curve.drive_mm.size // MOST_POINTS)
        at_x, at_y = x.place(curve.drive_mm[::every]), y.place(curve.angle_deg[::every])
        points = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(at_x, at_y, strict=True))
        parts.append(f'<path class="{curve.kind}" d="M{points}"/>')
    middle = (TOP + HEIGHT - BOTTOM) / 2
    parts.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 6}" text-anchor="middle">drive, mm</text>')
    parts.append(f'<text x="14" y="{middle}" text-anchor="middle" transform="rotate(-90 14 {middle})">{label}</text>')
    return "".join([*parts, "</svg>"])


class _Axis:
    """A scale from values to pixels, with ticks at round numbers."""

    def __init__(self, values: Floats, start: float, end: float) -> None:
        low, high = float(values.min()), float(values.max())
        margin = 0.04 * (high - low) or 1.0
        self.low, self.high, self.start, self.end = low - margin, high + margin, start, end
        self.ticks = _ticks(self.low, self.high)

    def place(self, value: float | Floats) -> Floats:
        share = (np.asarray(value, dtype=float) - self.low) / (self.high - self.low)
        return self.start + share * (self.end - self.start)


def _ticks(low: float, high: float) -> Floats:
    """Give about five round numbers between two ends."""
    raw = (high - low) / 6
    decade = 10.0 ** np.floor(np.log10(raw))
    step = decade * next(m for m in (1, 2, 5, 10) if m * decade >= raw)
    ticks: Floats = np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step
    return ticks + 0.0  # turns -0.0 into 0.0
