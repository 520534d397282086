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
Style = Literal["solid", "dash", "dot", "points", "dots", "crosses", "star"]
TONES: tuple[Tone, ...] = ("blue", "orange", "green", "purple", "grey")
"""Colours that a colour-blind reader can distinguish, and by lightness on paper; ``style.css`` has them for screens."""


@dataclass(frozen=True)
class Line:
    """A curve, or points; ``x``, ``y`` of shape (m,), and ``spread`` above and below each point.

    Dots, crosses and stars have an edge in the colour of the paper, so that they stand out from a field.
    """

    x: Floats
    y: Floats
    name: str
    tone: Tone = "blue"
    style: Style = "solid"
    spread: Floats | None = None


@dataclass(frozen=True)
class Bars:
    """Horizontal bars, one for each category; ``low`` and ``high`` are ends of intervals, NaN without one.

    ``tones`` are the colours of the bars where they differ.
    """

    categories: tuple[str, ...]
    values: Floats
    name: str
    tone: Tone = "blue"
    low: Floats | None = None
    high: Floats | None = None
    tones: tuple[Tone, ...] = ()


@dataclass(frozen=True)
class Span:
    """A band across the chart from ``low`` to ``high`` on one of its axes; a line where both are the same."""

    along: Literal["x", "y"]
    low: float
    high: float


@dataclass(frozen=True)
class Heat:
    """A field over two axes: ``z`` of shape (y, x), NaN without a result; ``scale`` has the ends of its colours."""

    x: Floats
    y: Floats
    z: Floats
    label: str
    scale: tuple[float, float] | None = None


@dataclass(frozen=True)
class Dots:
    """Points with a third value as colour; ``notes`` are shown for the point under the cursor."""

    x: Floats
    y: Floats
    value: Floats
    label: str
    notes: tuple[str, ...] = ()


Mark = Line | Bars | Heat | Dots | Span


@dataclass(frozen=True)
class Chart:
    """One pair of axes. ``alt`` is the text in place of the picture; axis labels include the unit.

    ``x_range`` and ``y_range`` have the ends of an axis where these are given; ``legend`` is False where another
    chart of the plate has it; ``equal`` is one scale for both axes.
    """

    title: str
    x_label: str
    y_label: str
    marks: tuple[Mark, ...]
    alt: str
    y_range: tuple[float, float] | None = None
    x_range: tuple[float, float] | None = None
    legend: bool = True
    equal: bool = False


@dataclass(frozen=True)
class Plate:
    """Charts side by side under one caption, with a heading where they have one thing in common."""

    charts: tuple[Chart, ...]
    caption: str
    columns: int = 2
    heading: str = ""


def finite(values: Sequence[float | None]) -> Floats:
    """Give values as floats, None as NaN."""
    return np.array([np.nan if v is None else v for v in values], dtype=float)
