"""``[require]``: bounds of quantities with the confidence that is asked for, and the verdict on a tube."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hysteresis.messages import as_given, listed, quoted
from studies.design.quantities import QUANTITIES, Measured
from studies.results.design import Decision, Probability, Verdict
from studies.sweep.errors import StudyError
from studies.sweep.file_table import FileTable

CONFIDENCE = 0.95
"""P(met) that is asked for where a requirement does not say it."""


@dataclass(frozen=True)
class Requirement:
    """Bounds of a quantity; None is no bound. ``confidence`` is P(met) under the tolerances that is asked for."""

    quantity: str
    low: float | None
    high: float | None
    confidence: float = CONFIDENCE

    def __post_init__(self) -> None:
        if self.quantity not in QUANTITIES:
            raise StudyError(f"require.{as_given(self.quantity)}: expected one of {listed(list(QUANTITIES))}")
        if self.low is None and self.high is None:
            raise StudyError(f"require.{self.quantity}: expected min, max or both")

    def margin(self, value: float) -> float:
        """Distance of a value to the nearer bound, positive where both are kept; NaN of NaN."""
        above = math.inf if self.low is None else value - self.low
        below = math.inf if self.high is None else self.high - value
        return math.nan if math.isnan(value) else min(above, below)

    def share(self, value: float) -> float:
        """Give the margin over the size of its bound, over 1 for a bound of 0: what margins are compared by."""
        margin = self.margin(value)
        return margin / (abs(self._nearer(value)) or 1.0)

    def _nearer(self, value: float) -> float:
        if self.low is None or self.high is None:
            bound = self.high if self.low is None else self.low
            assert bound is not None
            return bound
        return self.low if value - self.low <= self.high - value else self.high


@dataclass(frozen=True)
class Requirements:
    """All requirements of a tube, in the order of their quantities."""

    each: tuple[Requirement, ...]

    def bound(self, quantity: str, side: str) -> float | None:
        """Give the bound ``low`` or ``high`` of a quantity; None where there is none."""
        for one in self.each:
            if one.quantity == quantity:
                found: float | None = getattr(one, side)
                return found
        return None

    @property
    def names(self) -> tuple[str, ...]:
        """Quantities that are required."""
        return tuple(one.quantity for one in self.each)

    @property
    def bend_deg(self) -> float:
        """Bend at which a tube is judged: the least one that is required."""
        bend = self.bound("bend_deg", "low")
        assert bend is not None
        return bend

    def least_share(self, measured: Measured) -> float:
        """Give the smallest margin over its bound: not negative where a tube meets all requirements; -inf of NaN."""
        shares = [one.share(measured.of(one.quantity)) for one in self.each]
        return -math.inf if any(map(math.isnan, shares)) else min(shares)


def requirements_of_table(table: FileTable) -> Requirements:
    """Read ``[require]``: ``quantity = { min = , max = , confidence = }``; a bare number is no requirement.

    Raises
    ------
    StudyError
        One line with the field, the value and what was expected.
    """
    found = dict[str, Requirement]()
    for name, given in table.data.items():
        if name not in QUANTITIES:
            raise StudyError(
                f"{table.at(name)} = {quoted(given)}: expected a quantity, one of {listed(list(QUANTITIES))}"
            )
        if not isinstance(given, Mapping):
            raise table.complain(name, "{ min = , max = , confidence = }, at least one of min and max")
        found[name] = _requirement(name, table.table(name, "min", "max", "confidence"))
    if "bend_deg" not in found or found["bend_deg"].low is None or found["bend_deg"].low <= 0:
        raise StudyError(f"{table.at('bend_deg')}.min: expected a bend above 0: the tube is judged there")
    for name, needs in (("tip_force_N", "tension_N"),):
        if name in found and (needs not in found or found[needs].high is None):
            raise StudyError(f"{table.at(name)}: expected beside {table.at(needs)}.max, the tension that holds it")
    return Requirements(tuple(found[name] for name in QUANTITIES if name in found))


def _requirement(name: str, row: FileTable) -> Requirement:
    low, high = (row.number(key) if key in row.data else None for key in ("min", "max"))
    if low is None and high is None:
        raise StudyError(f"{row.name} = {quoted(dict(row.data))}: expected min, max or both")
    if low is not None and high is not None and not low < high:
        raise row.complain("max", f"above min = {low:g}")
    confidence = row.number("confidence", CONFIDENCE)
    if not 0.5 <= confidence < 1:
        raise row.complain("confidence", "from 0.5 to below 1: the probability that the requirement is met")
    return Requirement(name, low, high, confidence)


def verdicts(
    requirements: Requirements, measured: Measured, p_met: Sequence[Probability] | None = None
) -> tuple[Verdict, ...]:
    """Judge a tube, one row a requirement.

    Parameters
    ----------
    p_met
        P(met) of each requirement, in their order; None without tolerances.
    """
    return tuple(
        _verdict(one, measured.of(one.quantity), None if p_met is None else p_met[k])
        for k, one in enumerate(requirements.each)
    )


def _verdict(one: Requirement, value: float, p_met: Probability | None) -> Verdict:
    margin, quantity = one.margin(value), QUANTITIES[one.quantity]
    decision: Decision = "not known" if math.isnan(margin) else ("met" if margin >= 0 else "not met")
    if decision == "met" and p_met is not None and p_met.value < one.confidence:
        decision = "at risk"
    return Verdict(
        quantity=one.quantity,
        words=quantity.long_name,
        unit=quantity.units,
        low=one.low,
        high=one.high,
        confidence=one.confidence,
        value=value,
        margin=margin,
        margin_percent=100 * one.share(value),
        p_met=p_met,
        decision=decision,
    )
