"""Random rigs with everything on: both engines converge, and agree."""

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.multibody.quasi_static import simulate_multibody
from validation.engines.checks.random_rigs import angles, random_rigs, random_wrists


def test_chain_follows_random_rigs_with_everything_on():
    runs = [angles(rig, steps, simulate_chain) for rig, steps in random_rigs(150, 24)]
    assert [out for out in runs if isinstance(out, str)] == []


@pytest.mark.slow
@pytest.mark.parametrize("number", range(25, 125, 25))
def test_multibody_follows_some_of_them_alike(number):
    """Four; `python -m validation.engines.checks.random_rigs` tries as many as it is told to."""
    rig, steps = list(random_rigs(number + 1, 24))[-1]
    chain, multibody = simulate_chain(rig, steps).angle_deg, simulate_multibody(rig, steps).angle_deg
    assert np.abs(chain - multibody).max() <= 0.01 * np.abs(multibody).max() + 0.1


@pytest.mark.slow
def test_multibody_follows_wrists_that_a_single_tendon_bends_at_rest():
    """By up to 100 deg and more: Newton's method may leave the tendon slack, with the slip far off."""
    for rig, steps in random_wrists(20, 7):
        chain, multibody = simulate_chain(rig, steps).angle_deg, simulate_multibody(rig, steps).angle_deg
        assert np.abs(chain - multibody).max() <= 2e-3 * np.abs(multibody).max() + 0.1, rig
