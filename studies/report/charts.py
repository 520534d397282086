"""What a chart shows, independent of how it is drawn.

:mod:`studies.report.still` draws charts as SVG for paper, :mod:`studies.report.live` as JSON for the screen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hysteresis.arrays import Floats

Tone = Literal["blue", "orange", "green", "purple", "grey"]
Style = Literal["solid", "dash", "dot", "points"]
TONES: tuple[Tone, ...] = ("blue", "orange", "green", "purple", "grey")
"""Colours that a colour-blind reader can distinguish, and by lightness on paper; ``style.css`` has them for screens."""


@dataclass(frozen=True)
class Line:
    """A curve, or points; ``x``, ``y`` of shape (m,)."""

    x: Floats
    y: Floats
    name: str
    tone: Tone = "blue"
    style: Style = "solid"


@dataclass(frozen=True)
class Bars:
    """Horizontal bars, one for each category; ``low`` and ``high`` are ends of intervals, NaN without one."""

    categories: tuple[str, ...]
    values: Floats
    name: str
    tone: Tone = "blue"
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True)
class Heat:
    """A field over two axes: ``z`` of shape (y, x), NaN without a result."""

    x: Floats
    y: Floats
    z: Floats
    label: str


@dataclass(frozen=True)
class Dots:
    """Points with a third value as colour; ``notes`` are shown for the point under the cursor."""

    x: Floats
    y: Floats
    value: Floats
    label: str
    notes: tuple[str, ...] = ()


Mark = Line | Bars | Heat | Dots


@dataclass(frozen=True)
class Chart:
    """One pair of axes. ``alt`` is the text in place of the picture; axis labels include the unit."""

    title: str
    x_label: str
    y_label: str
    marks: tuple[Mark, ...]
    alt: str


@dataclass(frozen=True)
class Plate:
    """Charts side by side under one caption."""

    charts: tuple[Chart, ...]
    caption: str
    columns: int = 2


def finite(values: Sequence[float | None]) -> Floats:
    """Give values as floats, None as NaN."""
    return np.array([np.nan if v is None else v for v in values], dtype=float)
