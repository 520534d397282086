"""``study.json``, ``sensitivity.json`` and ``pareto.json``: what a parametric study has computed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from hysteresis.plain import named, optional
from studies.results.made import Made

Goal = Literal["min", "max"]


@dataclass(frozen=True, kw_only=True)
class AxisRange:
    """Range of an axis; ``values`` is how many values it has in a grid, None where it is sampled."""

    low: float = named("from")
    high: float = named("to")
    values: int | None


@dataclass(frozen=True)
class Sample:
    """Points spread over the ranges of all axes, in place of a grid."""

    method: str
    count: int
    seed: int


@dataclass(frozen=True)
class Failures:
    """How many cases failed, and how many for each reason."""

    count: int
    messages: Mapping[str, int]


@dataclass(frozen=True)
class Extreme:
    """The minimum or maximum of a quantity, and the point of the study where it is."""

    value: float
    at: Mapping[str, float]


@dataclass(frozen=True)
class Extremes:
    """Unit, minimum and maximum of a quantity over the cases that are done."""

    units: str
    min: Extreme
    max: Extreme


@dataclass(frozen=True, kw_only=True)
class StudySummary:
    """What ``study.json`` holds.

    ``status`` counts the cases that are ok, failed and pending; ``computed`` and ``from_store`` count those of this
    run. ``sensitivity`` and ``pareto`` are the files of these results, if the study has them.
    """

    schema: int = 1
    title: str
    engine: str
    cases: int
    status: Mapping[str, int]
    computed: int
    from_store: int
    axes: Mapping[str, AxisRange]
    sample: Sample | None
    seed: int
    versions: Mapping[str, str]
    code_sha256: str
    inputs_sha256: Mapping[str, str]
    dataset: str
    failures: Failures
    quantities: Mapping[str, Extremes]
    sensitivity: str | None = optional()
    pareto: str | None = optional()
    state: str
    seconds: float
    made: Made | None = optional()


@dataclass(frozen=True)
class Index:
    """A Sobol index with its interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class AxisIndices:
    """First-order and total Sobol index of one axis."""

    first: Index
    total: Index


@dataclass(frozen=True)
class QuantityIndices:
    """Sobol indices of a quantity by axis, from ``blocks`` complete blocks of the sample; ``variance`` of all."""

    units: str
    indices: Mapping[str, AxisIndices]
    blocks: int
    variance: float


@dataclass(frozen=True, kw_only=True)
class Sensitivities:
    """What ``sensitivity.json`` holds; ``without_indices`` are quantities that are constant or too often unknown."""

    schema: int = 1
    engine: str
    count: int
    cases: int
    seed: int
    confidence: float
    resamples: int
    ranges: Mapping[str, tuple[float, float]]
    quantities: Mapping[str, QuantityIndices]
    without_indices: tuple[str, ...]
    computed: int
    from_store: int


@dataclass(frozen=True)
class Objective:
    """An objective of the Pareto search."""

    goal: Goal
    units: str


@dataclass(frozen=True)
class Bounds:
    """Limits of a quantity that a design must keep; None is no limit."""

    min: float | None
    max: float | None


@dataclass(frozen=True, kw_only=True)
class ParetoFront:
    """What ``pareto.json`` holds: ``front`` has the designs, each with its variables and its quantities by name."""

    schema: int = 1
    engine: str
    objectives: Mapping[str, Objective]
    limits: Mapping[str, Bounds]
    variables: Mapping[str, tuple[float, float]]
    fixed: Mapping[str, float]
    population: int
    generations: int
    seed: int
    designs_tried: int
    designs_feasible: int
    front: tuple[Mapping[str, float | None], ...]
