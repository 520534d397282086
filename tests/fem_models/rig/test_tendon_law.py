"""Tension of a tendon over its elongation."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem_models.rig.rig import Tendon
from fem_models.rig.tendon_law import tendon_stretch_mm, tendon_tension_N

TENDON = Tendon(EA_N=9000.0, moment_arm_mm=2.62, free_length_mm=150.0)
LENGTH = 14 * 2.6


@given(st.floats(0, 100), st.floats(0, 100), st.floats(1, 50))
def test_tension_inverts_stretch(tension, toe, preload):
    tendon = replace(TENDON, toe_N=toe)
    if toe > 1e-9 and tension == 0:
        assert tendon_stretch_mm(tendon, 0.0, preload, LENGTH) == -np.inf
        return
    stretch = tendon_stretch_mm(tendon, tension, preload, LENGTH)
    assert tendon_tension_N(tendon, stretch, preload, LENGTH) == pytest.approx(tension, rel=1e-9, abs=1e-9)


def test_toe_region_has_the_stiffness_of_its_definition():
    # dT/ds of the free tendon is k T/(T + toe), in series with the linear tendon in the tube; central difference
    tendon, t, h = replace(TENDON, toe_N=30.0), np.array([0.5, 5.0, 20.0, 80.0]), 1e-4
    above, below = (tendon_stretch_mm(tendon, t + d, 20.0, LENGTH) for d in (h, -h))
    compliance = 150.0 / 9000 * (t + 30) / t + LENGTH / 9000
    np.testing.assert_allclose((above - below) / (2 * h), compliance, rtol=1e-6)
    assert tendon_stretch_mm(tendon, 20.0, 20.0, LENGTH) == 0


def test_tendon_cannot_push():
    with pytest.raises(ValueError, match="tension_N = -1: expected at least 0"):
        tendon_stretch_mm(TENDON, [1.0, -1.0], 20.0, LENGTH)
    assert tendon_tension_N(TENDON, -10.0, 20.0, LENGTH) == 0
