"""Rates, errors and confusions over many practice cases."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from scipy.stats import beta

from validation.practice.catalogue import ANGLE_ALONE, CATALOGUE
from validation.practice.draw import CLEAN, PAIR
from validation.practice.lumped.outside import LUMPED_OUTSIDE
from validation.practice.outcome import Outcome
from validation.practice.outside_catalogue import OUTSIDE_CATALOGUE
from validation.practice.series.effects import DOMINANT
from validation.tracing.result import UNNAMED

LUMPED = "lumped"
"""Engine of the cases of the other generator."""
NEAR_FLOOR = 1.3
"""Largest held-out error over the noise that counts as explained."""
OUTSIDE = frozenset({*OUTSIDE_CATALOGUE, *LUMPED_OUTSIDE})
"""Labels of what is in no catalogue."""
Z_95 = 1.959964


@dataclass(frozen=True)
class Rate:
    """Share of cases with its 95 % interval; a rate of no case is None."""

    hits: int
    of: int
    rate: float | None
    low: float
    high: float


@dataclass(frozen=True)
class Spread:
    """Median and largest of values; None if there is none."""

    median: float | None
    largest: float | None


@dataclass(frozen=True)
class Summary:
    """Everything that a score reports; the keys of the rates are those of the stored file.

    Parameters
    ----------
    cases
        Number of cases.
    rates
        By what is counted.
    by_effect
        Rates ``first`` and ``within set`` of each effect of the catalogue.
    confusion
        Counts by label, then by what was claimed first.
    after_over_noise, after_over_before
        Held-out error after over the noise and over the error before, of cases whose effect was named first.
    seconds
        Of a case.
    """

    cases: int
    rates: Mapping[str, Rate]
    by_effect: Mapping[str, Mapping[str, Rate]]
    confusion: Mapping[str, Mapping[str, int]]
    after_over_noise: Spread
    after_over_before: Spread
    seconds: Spread


def wilson_interval(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a rate by Wilson (J. Am. Stat. Assoc. 22, 1927, doi 10.1080/01621459.1927.10502953)."""
    if of == 0:
        return 0.0, 1.0
    n, p, z = of, hits / of, Z_95
    middle = p + z**2 / (2 * n)
    half = z * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    return max((middle - half) / (1 + z**2 / n), 0.0), min((middle + half) / (1 + z**2 / n), 1.0)


def exact_interval(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a rate by Clopper and Pearson (Biometrika 26, 1934, doi 10.1093/biomet/26.4.404)."""
    low = 0.0 if hits == 0 else float(beta.ppf(0.025, hits, of - hits + 1))
    high = 1.0 if hits == of else float(beta.ppf(0.975, hits + 1, of - hits))
    return low, high


def rate_of_hits(hits: Iterable[bool]) -> Rate:
    """Share of hits with its interval."""
    each = list(hits)
    count, of = sum(each), len(each)
    low, high = wilson_interval(count, of)
    return Rate(count, of, count / of if of else None, low, high)


def rate_of(outcomes: Iterable[Outcome], hit: Callable[[Outcome], bool]) -> Rate:
    """Rate of the outcomes that ``hit`` accepts."""
    return rate_of_hits(hit(one) for one in outcomes)


def confusion(outcomes: Sequence[Outcome]) -> dict[str, dict[str, int]]:
    """Count by label, then by what was claimed first."""
    matrix: dict[str, dict[str, int]] = {}
    for one in outcomes:
        row = matrix.setdefault(one.label, {})
        row[one.column] = row.get(one.column, 0) + 1
    return matrix


def spread(values: Iterable[float]) -> Spread:
    """Median and largest of values."""
    known = list(values)
    return Spread(statistics.median(known), max(known)) if known else Spread(None, None)


def summary(outcomes: Sequence[Outcome]) -> Summary:
    """Summarise the outcomes of a score."""
    single = [one for one in outcomes if one.label in CATALOGUE and one.truth]
    right = [one for one in single if one.first_right and one.after_deg is not None]
    over_noise = [one.after_deg / one.noise_deg for one in right if one.after_deg is not None]
    gains = [one.after_deg / one.before_deg for one in right if one.after_deg is not None and one.before_deg]
    return Summary(
        cases=len(outcomes),
        rates={
            **_single_rates(single),
            **_other_rates(outcomes),
            "right: held-out error within 1.3 of the noise": rate_of_hits(r <= NEAR_FLOOR for r in over_noise),
            "errors": rate_of(outcomes, lambda one: one.verdict == "error"),
        },
        by_effect={
            label: {
                "first": rate_of(rows, lambda one: one.first_right),
                "within set": rate_of(rows, lambda one: one.within_set),
            }
            for label in CATALOGUE
            if (rows := [one for one in single if one.label == label])
        },
        confusion=confusion(outcomes),
        after_over_noise=spread(over_noise),
        after_over_before=spread(gains),
        seconds=spread(one.seconds for one in outcomes),
    )


def _single_rates(single: Sequence[Outcome]) -> dict[str, Rate]:
    """Rates of the cases with one effect of the catalogue."""
    beyond_angle = [one for one in single if one.label not in ANGLE_ALONE]
    return {
        "first": rate_of(single, lambda one: one.first_right),
        "within set": rate_of(single, lambda one: one.within_set),
        "first, not of the angle alone": rate_of(beyond_angle, lambda one: one.first_right),
        "within set, not of the angle alone": rate_of(beyond_angle, lambda one: one.within_set),
        "nothing else named": rate_of(single, lambda one: one.first_right and set(one.counted) == set(one.truth)),
        "missed: none": rate_of(single, lambda one: one.verdict == "none"),
    }


def _other_rates(outcomes: Sequence[Outcome]) -> dict[str, Rate]:
    """Rates of the cases with no effect, with two, with one outside the catalogue, and of spoiled clean ones."""
    clean = [one for one in outcomes if one.label == CLEAN]
    pairs = [one for one in outcomes if one.label == PAIR]
    outside = [one for one in outcomes if one.label in OUTSIDE]
    spoiled = [one for one in outcomes if not one.truth and one.label not in {CLEAN, PAIR, *OUTSIDE}]
    own = [one for one in spoiled if one.engine != LUMPED]
    return {
        "clean: no effect claimed": rate_of(clean, lambda one: one.verdict in UNNAMED),
        "clean: none": rate_of(clean, lambda one: one.verdict == "none"),
        "clean: an effect named falsely": rate_of(clean, lambda one: one.names_falsely),
        "dominant run-out: named, partial or effect": rate_of(
            [one for one in outcomes if one.label == DOMINANT],
            lambda one: one.verdict != "ambiguous" and one.first_right,
        ),
        "pairs: both named": rate_of(pairs, lambda one: one.both_named),
        "pairs, neither of the angle alone: both named": rate_of(
            [one for one in pairs if not ANGLE_ALONE & set(one.truth)], lambda one: one.both_named
        ),
        "outside: unexplained": rate_of(outside, lambda one: one.verdict == "unexplained"),
        "outside: no effect claimed": rate_of(outside, lambda one: one.verdict in UNNAMED),
        "spoiled: an effect named falsely": rate_of(spoiled, lambda one: one.names_falsely),
        "spoiled: none": rate_of(spoiled, lambda one: one.verdict == "none"),
        "spoiled, without the lumped rigs: an effect named falsely": rate_of(own, lambda one: one.names_falsely),
        "spoiled, without the lumped rigs: none": rate_of(own, lambda one: one.verdict == "none"),
    }
