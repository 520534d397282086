"""The loop of the app as SVG text, small enough to be sent at each move of a slider."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hysteresis.arrays import Floats

WIDTH, HEIGHT = 620, 460
LEFT, RIGHT, TOP, BOTTOM = 66, 14, 14, 54


def loop_svg(curves: Sequence[tuple[Floats, Floats]]) -> str:
    """Draw loops of drive (mm) and angle (deg), the last one in front; the others are grey."""
    x = _Axis(np.concatenate([curve[0] for curve in curves]), LEFT, WIDTH - RIGHT)
    y = _Axis(np.concatenate([curve[1] for curve in curves]), HEIGHT - BOTTOM, TOP)
    angle = curves[-1][1]
    description = f"Loop of the bending angle, {angle.min():.1f} to {angle.max():.1f} deg"
    parts = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{description}">']
    for tick in x.ticks:
        at = x.place(tick)
        parts.append(f'<path class="grid" d="M{at:.1f} {TOP}V{HEIGHT - BOTTOM}"/>')
        parts.append(f'<text x="{at:.1f}" y="{HEIGHT - BOTTOM + 20}" text-anchor="middle">{tick:g}</text>')
    for tick in y.ticks:
        at = y.place(tick)
        parts.append(f'<path class="grid" d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{at + 5:.1f}" text-anchor="end">{tick:g}</text>')
    for i, (drive, height) in enumerate(curves):
        points = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x.place(drive), y.place(height), strict=True))
        parts.append(f'<path class="{"now" if i == len(curves) - 1 else "before"}" d="M{points}"/>')
    middle = (TOP + HEIGHT - BOTTOM) / 2
    parts.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 6}" text-anchor="middle">drive, mm</text>')
    parts.append(
        f'<text x="14" y="{middle}" text-anchor="middle" transform="rotate(-90 14 {middle})">bending angle, deg</text>'
    )
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
