"""Verdicts: margins of either bound, and what confidence makes of a nominal margin."""

import math

import pytest

from studies.design import Requirement, Requirements, verdicts
from studies.design.quantities import Measured
from studies.results.design import Probability
from studies.sweep.errors import StudyError


def decision(one, value, p=None):
    given = None if p is None else [Probability(p, 0.0, 1.0, 100, "draws")]
    (row,) = verdicts(Requirements((one,)), Measured(reach_mm=value), given)
    return row


@pytest.mark.parametrize(
    ("low", "high", "value", "margin", "percent"),
    [
        (2.0, None, 3.0, 1.0, 50.0),
        (None, 4.0, 3.0, 1.0, 25.0),
        (2.0, 4.0, 3.5, 0.5, 12.5),
        (2.0, 4.0, 1.0, -1.0, -50.0),
    ],
)
def test_margin_is_that_of_the_nearer_bound(low, high, value, margin, percent):
    row = decision(Requirement("reach_mm", low, high), value)
    assert (row.margin, row.margin_percent) == pytest.approx((margin, percent))


@pytest.mark.parametrize(
    ("value", "p", "expected"),
    [
        (3.0, None, "met"),
        (3.0, 0.99, "met"),
        (3.0, 0.97, "at risk"),
        (1.0, 0.97, "not met"),
        (math.nan, None, "not known"),
    ],
)
def test_decision(value, p, expected):
    assert decision(Requirement("reach_mm", 2.0, None, 0.98), value, p).decision == expected


def test_bound_of_zero_has_a_share():
    assert Requirement("loop_width_deg", None, 0.0).share(-1.0) == 1.0


@pytest.mark.parametrize(("name", "low"), [("bent_deg", 1.0), ("bend_deg", None)])
def test_impossible_requirements_are_refused(name, low):
    with pytest.raises(StudyError, match="expected"):
        Requirement(name, low, None)
