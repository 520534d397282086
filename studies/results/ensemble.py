"""Ranges over an ensemble of rigs, in addition to the numbers of one rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class NumberRange:
    """Median of a number over the members of an ensemble, and the ends of its range."""

    low: float
    median: float
    high: float


@dataclass(frozen=True)
class EnsembleRanges:
    """Ranges by the name of the number; ``level`` is the share of the ``members`` within a range."""

    members: int
    level: float
    ranges: Mapping[str, NumberRange]
