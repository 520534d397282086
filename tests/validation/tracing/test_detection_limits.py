"""Detection limits against traces of records with an effect of that size."""

from __future__ import annotations

from dataclasses import replace

import pytest

from studies.commands.tracing import limits_of
from validation.practice import draw_case
from validation.tracing import catalogue, trace_records

DRIFT = [effect for effect in catalogue() if effect.name == "thermal_drift"]


@pytest.mark.slow
@pytest.mark.parametrize(("number", "rig"), [(8, "measured joints"), (0, "du2018")])
def test_a_third_above_the_limit_is_named_and_as_much_below_is_not(number, rig):
    """Beside measured joints up to 1.4 times the noise counts as theirs; 1.6 times the limit was `none` there."""
    case = draw_case("work", "known", "clean", number)
    assert case.truth.rig == rig
    clean = trace_records(case.records, threads=1, effects=DRIFT)
    assert clean.verdict == "none"
    (limit,) = (one for one in limits_of(clean) if one.name == "thermal_drift")

    def drifting(rate):
        return [replace(r, angle_deg=r.angle_deg + rate * (r.time_s - r.time_s[0])) for r in case.records]

    above, below = (trace_records(drifting(k * limit.size), threads=1, effects=DRIFT).names for k in (4 / 3, 2 / 3))
    assert (above, below) == (("thermal_drift",), ())
