"""A lumped rig with more friction than the one that was identified, without and with re-identification."""

import numpy as np
import pytest

from validation.practice.lumped.cases import drawn_rig
from validation.practice.lumped.reidentified import CHANGES, identified, outcome, reference_cycle


def test_references_begin_and_end_at_zero():
    for number in range(6):
        cycle = reference_cycle(10.0, number)
        assert cycle[-1] == pytest.approx(0.0, abs=1e-9)
        assert np.abs(cycle).max() == pytest.approx(5.0 if number % 3 == 2 else 10.0, abs=1e-9)


@pytest.mark.slow
def test_more_friction_is_learnt():
    (change,) = (one for one in CHANGES if "friction" in one.name)
    rig = drawn_rig(np.random.default_rng((5, 0)))
    found = outcome(rig, identified(rig, change.noise_deg, 5), change, 5)
    assert found.recursion.drift.width > 1.1
    assert found.factors[1] > 2 * found.factors[0] > 10
    assert found.recursion.flags == 0 or found.recursion.flags == 1
