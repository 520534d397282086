"""Detection limits against traces of records with an effect of that size."""

from __future__ import annotations

from dataclasses import replace

import pytest

from validation.practice import draw_case
from validation.tracing import catalogue, trace_records
from validation.tracing.inference import ALPHA, learnt_prior, times_needed
from validation.tracing.search.detection import detection_limits

DRIFT = [effect for effect in catalogue() if effect.name == "thermal_drift"]


@pytest.mark.slow
@pytest.mark.parametrize(("number", "rig"), [(8, "measured joints"), (0, "du2018-full-widths")])
def test_a_third_above_the_limit_is_named_and_a_third_of_it_is_not(number, rig):
    """Nine of ten records have it named at the limit, a half at two thirds (T is normal), one of six at a third.

    The same effect is tried as the limit is of: with more of them, chance reaches more.
    """
    case = draw_case("work", "known", "clean", number)
    assert case.truth.rig == rig
    clean = trace_records(case.records, threads=1, effects=DRIFT, alpha=ALPHA)
    assert clean.verdict == "none"
    needed = times_needed(clean.augmented, DRIFT, learnt_prior(clean), ALPHA)
    (limit,) = detection_limits(clean.augmented, DRIFT, clean.floor.deg, needed)

    def drifting(rate):
        return [replace(r, angle_deg=r.angle_deg + rate * (r.time_s - r.time_s[0])) for r in case.records]

    above, below = (
        trace_records(drifting(k * limit.size), threads=1, effects=DRIFT, alpha=ALPHA).names for k in (4 / 3, 1 / 3)
    )
    assert (above, below) == (("thermal_drift",), ())
