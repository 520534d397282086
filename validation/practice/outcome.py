"""What a trace of a practice case came to, and what many of them add up to."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from validation.practice.cases import CLEAN, PAIR
from validation.practice.hidden import ANGLE_ALONE

MOST_REPORTED = 3  # names that a reported set may have
NEAR_FLOOR = 1.3  # held-out error over the noise that a right effect may leave
CLAIMS = ("effect", "ambiguous")  # verdicts that name an effect
UNNAMED = ("none", "unexplained")  # those that do not
Z_95 = 1.959964


@dataclass(frozen=True)
class Outcome:
    """A case and what the tracer said of it. Errors are of held-out data, deg, None where there were none."""

    label: str
    truth: tuple[str, ...]
    verdict: str
    named: tuple[str, ...]
    confusable: tuple[str, ...]
    noise_deg: float
    before_deg: float | None
    after_deg: float | None
    seconds: float
    beyond_curve: tuple[float, ...] = ()

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Outcome:
        """Read one from the plain values that were stored."""
        values = {field.name: table[field.name] for field in fields(cls)}
        tuples: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}
        return cls(**tuples)

    @property
    def column(self) -> str:
        """First effect that was claimed, or the verdict without one."""
        return self.named[0] if self.verdict in CLAIMS and self.named else self.verdict

    @property
    def reported(self) -> tuple[str, ...]:
        """The claimed effect and those it may be confused with, the first three of them."""
        return (self.column, *self.confusable)[:MOST_REPORTED] if self.verdict in CLAIMS else ()

    @property
    def first_right(self) -> bool:
        """Whether the effect that is there was named first."""
        return self.column in self.truth

    @property
    def within_set(self) -> bool:
        """Whether the effect that is there is in the reported set."""
        return any(effect in self.reported for effect in self.truth)

    @property
    def both_named(self) -> bool:
        """Whether all effects that are there were named."""
        return self.verdict in CLAIMS and set(self.truth) <= set(self.named)


@dataclass(frozen=True)
class Rate:
    """Part of cases, with Wilson's interval of 95 % (J. Am. Stat. Assoc. 22, 1927).

    doi 10.1080/01621459.1927.10502953.
    """

    hits: int
    of: int

    def to_dict(self) -> dict[str, float | int | None]:
        """Plain values; a rate of no case is None."""
        low, high = self.interval()
        rate = self.hits / self.of if self.of else None
        return {"hits": self.hits, "of": self.of, "rate": rate, "low": low, "high": high}

    def interval(self) -> tuple[float, float]:
        """Bounds of the true rate, 0 to 1."""
        if self.of == 0:
            return 0.0, 1.0
        n, p, z = self.of, self.hits / self.of, Z_95
        middle = p + z**2 / (2 * n)
        half = z * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
        return max((middle - half) / (1 + z**2 / n), 0.0), min((middle + half) / (1 + z**2 / n), 1.0)


def rate_of(outcomes: Iterable[Outcome], hit: Callable[[Outcome], bool]) -> dict[str, float | int | None]:
    """Rate at which outcomes hit."""
    hits = [hit(one) for one in outcomes]
    return Rate(sum(hits), len(hits)).to_dict()


def confusion(outcomes: Sequence[Outcome]) -> dict[str, dict[str, int]]:
    """Count by label, then by what was claimed first."""
    matrix: dict[str, dict[str, int]] = {}
    for one in outcomes:
        row = matrix.setdefault(one.label, {})
        row[one.column] = row.get(one.column, 0) + 1
    return matrix


def spread(values: Iterable[float]) -> dict[str, float | None]:
    """Median and largest."""
    known = list(values)
    return {"median": statistics.median(known) if known else None, "largest": max(known) if known else None}


def summary(outcomes: Sequence[Outcome], catalogue: Sequence[str], outside: Sequence[str]) -> dict[str, Any]:
    """Everything that a score says, as plain values."""
    single = [one for one in outcomes if one.label in catalogue]
    beyond_angle = [one for one in single if one.label not in ANGLE_ALONE]
    clean = [one for one in outcomes if one.label == CLEAN]
    pairs = [one for one in outcomes if one.label == PAIR]
    strange = [one for one in outcomes if one.label in outside]
    right = [one for one in single if one.first_right and one.after_deg is not None]
    over_noise = [one.after_deg / one.noise_deg for one in right if one.after_deg is not None]
    gains = [one.after_deg / one.before_deg for one in right if one.after_deg is not None and one.before_deg]
    rates = {
        "first": rate_of(single, lambda one: one.first_right),
        "within set": rate_of(single, lambda one: one.within_set),
        "first, not of the angle alone": rate_of(beyond_angle, lambda one: one.first_right),
        "within set, not of the angle alone": rate_of(beyond_angle, lambda one: one.within_set),
        "nothing else named": rate_of(single, lambda one: one.first_right and set(one.named) == set(one.truth)),
        "missed: none": rate_of(single, lambda one: one.verdict == "none"),
        "clean: no effect claimed": rate_of(clean, lambda one: one.verdict in UNNAMED),
        "clean: none": rate_of(clean, lambda one: one.verdict == "none"),
        "pairs: both named": rate_of(pairs, lambda one: one.both_named),
        "pairs, neither of the angle alone: both named": rate_of(
            [one for one in pairs if not ANGLE_ALONE & set(one.truth)], lambda one: one.both_named
        ),
        "outside: unexplained": rate_of(strange, lambda one: one.verdict == "unexplained"),
        "right: held-out error within 1.3 of the noise": Rate(
            sum(ratio <= NEAR_FLOOR for ratio in over_noise), len(over_noise)
        ).to_dict(),
        "errors": rate_of(outcomes, lambda one: one.verdict == "error"),
    }
    by_effect = {
        label: {
            "first": rate_of(rows, lambda one: one.first_right),
            "within set": rate_of(rows, lambda one: one.within_set),
        }
        for label in catalogue
        if (rows := [one for one in single if one.label == label])
    }
    return {
        "cases": len(outcomes),
        "rates": rates,
        "by_effect": by_effect,
        "confusion": confusion(outcomes),
        "after_over_noise": spread(over_noise),
        "after_over_before": spread(gains),
        "seconds": spread(one.seconds for one in outcomes),
    }
