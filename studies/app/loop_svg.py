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

Kind = Literal["before", "measured", "smooth", "now"]
Curves = tuple[Floats, Floats]
"""Places of a curve along both axes, each of shape (m,)."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve to draw: ``x`` and ``y`` of shape (m,), and which of the page's colours it has."""

    kind: Kind
    x: Floats
    y: Floats


@dataclass(frozen=True, eq=False)
class Plot:
    """One chart of the page: ``now`` is the curve of the sliders' values, None where there is none.

    ``kind`` is its class in the style of the page; ``smooth`` is the curve without friction, ``equal`` one scale for
    both axes.
    """

    kind: str
    label: str
    now: Curves | None
    smooth: Curves | None = None
    x_label: str = "drive, mm"
    equal: bool = False


def plot_svg(plot: Plot, before: Plot, measured: Curves | None) -> str:
    """Draw a plot: the curve of the rig's own numbers, a measured one, and that of the sliders in front."""
    given: list[tuple[Kind, Curves | None]] = [("before", before.now), ("measured", measured)]
    given += [("smooth", plot.smooth), ("now", plot.now)]
    curves = [Curve(kind, *curve) for kind, curve in given if curve is not None]
    return loop_svg(curves, plot.label, plot.x_label, equal=plot.equal) if curves else ""


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


def loop_svg(curves: Sequence[Curve], label: str, x_label: str = "drive, mm", *, equal: bool = False) -> str:
    """Draw curves, the last one in front; ``label`` and ``x_label`` stand at the scales."""
    places = [np.concatenate([getattr(curve, name) for curve in curves]) for name in "xy"]
    if equal:
        places = _one_scale(*places)
    x, y = _Axis(places[0], LEFT, WIDTH - RIGHT), _Axis(places[1], HEIGHT - BOTTOM, TOP)
    angle = curves[-1].y
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
        every = -(-curve.x.size // MOST_POINTS)
        at_x, at_y = x.place(curve.x[::every]), y.place(curve.y[::every])
        points = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(at_x, at_y, strict=True))
        parts.append(f'<path class="{curve.kind}" d="M{points}"/>')
    middle = (TOP + HEIGHT - BOTTOM) / 2
    parts.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 6}" text-anchor="middle">{x_label}</text>')
    parts.append(f'<text x="14" y="{middle}" text-anchor="middle" transform="rotate(-90 14 {middle})">{label}</text>')
    return "".join([*parts, "</svg>"])


def _one_scale(x: Floats, y: Floats) -> list[Floats]:
    """Give ends of both axes that have as much room for a millimetre along the one as along the other."""
    room = np.array([WIDTH - RIGHT - LEFT, HEIGHT - BOTTOM - TOP], dtype=float)
    scale = max(float(np.ptp(one)) / size for one, size in zip((x, y), room, strict=True)) or 1.0 / room[0]
    halves = 0.5 * scale * room
    middles = (0.5 * (one.min() + one.max()) for one in (x, y))
    return [np.array([middle - half, middle + half]) for middle, half in zip(middles, halves, strict=True)]


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
