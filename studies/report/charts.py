"""What a chart shows, said once.

:mod:`studies.report.still` draws it as SVG for paper, :mod:`studies.report.live` as JSON for the screen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from hysteresis.arrays import Floats

Tone = Literal["blue", "orange", "green", "purple", "grey"]
Style = Literal["solid", "dash", "dot", "points"]
TONES: tuple[Tone, ...] = ("blue", "orange", "green", "purple", "grey")
"""Told apart by the colour blind, and by lightness on grey paper; ``style.css`` has them for screens."""


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
    """Bars lying on their side, one a category; ``low``, ``high`` are ends of intervals, NaN where there is none."""

    categories: tuple[str, ...]
    values: Floats
    name: str
    tone: Tone = "blue"
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True)
class Heat:
    """A field over two axes: ``z`` of shape (y, x), NaN where there is no result."""

    x: Floats
    y: Floats
    z: Floats
    label: str


@dataclass(frozen=True)
class Dots:
    """Points with a third value as colour; ``notes`` are what is said of each where a reader points at it."""

    x: Floats
    y: Floats
    value: Floats
    label: str
    notes: tuple[str, ...] = ()


Mark = Line | Bars | Heat | Dots


@dataclass(frozen=True)
class Chart:
    """One pair of axes. ``alt`` says in words what it shows; axis labels carry the unit."""

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


def finite(values: Sequence[Any] | Floats) -> Floats:
    """Values as floats, None as NaN."""
    return np.array([np.nan if v is None else v for v in values], dtype=float)
