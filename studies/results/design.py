"""``design.json``: requirements, the tubes that meet them, and how surely under the tolerances of a workshop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from hysteresis.plain import optional
from studies.results.made import Made

Decision = Literal["met", "at risk", "not met", "not known"]
"""``at risk``: met by the nominal tube, but less surely than was asked. ``not known``: no model gives the value."""


@dataclass(frozen=True)
class Probability:
    """A probability with its 95 % interval, from so many draws (simulated tubes) by a method."""

    value: float
    low: float
    high: float
    draws: int
    method: str


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One requirement and what a tube makes of it.

    Parameters
    ----------
    quantity, words, unit
        Name of the quantity, what it is, and its unit, ``1`` for a ratio.
    low, high
        The bounds; None is no bound.
    confidence
        P(met) that was asked for.
    value
        Of the nominal tube; NaN where it is not known.
    margin
        Distance to the nearer bound in the unit, positive where the requirement is met.
    margin_percent
        The same in percent of that bound; NaN for a bound of 0.
    p_met
        Under the tolerances; None without tolerances.
    """

    quantity: str
    words: str
    unit: str
    low: float | None
    high: float | None
    confidence: float
    value: float
    margin: float
    margin_percent: float
    p_met: Probability | None
    decision: Decision


@dataclass(frozen=True, kw_only=True)
class Influence:
    """What one tolerance does to one quantity.

    ``first`` and ``total`` are Sobol indices of the quantity, ``change`` is the quantity at one standard deviation
    above the nominal number less that at one below. ``total_within`` is half the 95 % interval of ``total``, by
    resampling.
    """

    tolerance: str
    quantity: str
    unit: str
    change: float
    first: float
    total: float
    total_within: float | None = optional()


@dataclass(frozen=True)
class Tightened:
    """P(all requirements met) if one tolerance were half as wide."""

    tolerance: str
    p_met: Probability


@dataclass(frozen=True, kw_only=True)
class FoundDesign:
    """A tube that was found.

    Parameters
    ----------
    name
        ``nominal-1`` and so on along the front, or ``robust-1``.
    kind
        ``nominal``: meets the requirements with nominal numbers. ``robust``: with their confidences, too.
    values
        What is cut and bought, by dotted names of a rig file; with ``wire_mm``.
    tube_source, wire_source
        Where the stock sizes are from.
    rig
        Name of its rig file.
    quantities
        By name; NaN where not known.
    limited_by
        The requirement with the least margin for its size, or the cutting process.
    verdicts
        One a requirement.
    p_all
        P(all requirements met); None without tolerances.
    tightened, influences
        What to tighten first, the best first; empty without tolerances.
    """

    name: str
    kind: Literal["nominal", "robust"]
    values: Mapping[str, float]
    tube_source: str
    wire_source: str
    rig: str
    quantities: Mapping[str, float]
    limited_by: str
    verdicts: tuple[Verdict, ...]
    p_all: Probability | None
    tightened: tuple[Tightened, ...]
    influences: tuple[Influence, ...]


@dataclass(frozen=True, kw_only=True)
class DesignSummary:
    """What ``design.json`` holds.

    ``tried`` counts the tubes of the search, ``simulated`` those that geometry did not refuse, and ``feasible`` those
    that meet the requirements with nominal numbers. ``refused`` counts by reason those that met none. ``spans`` are the
    ranges of the numbers of all feasible tubes. ``warnings`` say what was not found, and why.
    """

    schema: int = 1
    title: str
    seed: int
    trade: Mapping[str, str]
    tolerances: Mapping[str, str]
    tried: int
    simulated: int
    feasible: int
    refused: Mapping[str, int]
    spans: Mapping[str, tuple[float, float]]
    designs: tuple[FoundDesign, ...]
    warnings: tuple[str, ...]
    inputs_sha256: Mapping[str, str]
    seconds: float
    made: Made | None = optional()

    @property
    def chosen(self) -> FoundDesign | None:
        """The design that is judged first: the first robust one, else the first; None where there is none."""
        robust = [one for one in self.designs if one.kind == "robust"]
        return next(iter(robust or self.designs), None)
