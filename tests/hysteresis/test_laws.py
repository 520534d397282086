"""The classical and the asymmetric law, and play operators, against other integrators and closed forms."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from closed_branch import branch_closed_form
from scipy.integrate import solve_ivp

from hysteresis.laws.asymmetric import AsymmetricBoucWen, asymmetric_batch, asymmetric_hysteresis
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.laws.classical import Classical, force, force_batch
from hysteresis.laws.prandtl_ishlinskii import plays

LOOP = np.concatenate([np.arange(0, 20, 0.9), np.arange(19, -20, -1.1), np.arange(-19, 21, 0.7)])
UNLIKE = AsymmetricBoucWen(A=-1.2, betas=(0.5, 0.05, 0.08, -0.06, 0.1, 0.04), n=1.4, centre_deg=2.0, h0_deg=0.3)


def by_runge_kutta(path, model):
    """The law as printed, one adaptive DOP853 run per step of the path."""
    b1, b2, b3, b4, b5, b6 = model.betas
    sign = np.sign(model.A)
    z, out = sign * model.h0_deg, [model.h0_deg]
    for a, b in pairwise(path):

        def slope(t, z, a=a, b=b):
            f, df = a + t * (b - a) - model.centre_deg, b - a
            s = np.sign
            psi = b1 * s(df * z) + b2 * s(f * df) + b3 * s(f * z) + b4 * s(df) + b5 * s(z) + b6 * s(f)
            return df * (abs(model.A) - np.abs(z) ** model.n * psi)

        z = solve_ivp(slope, (0, 1), [z], method="DOP853", rtol=1e-12, atol=1e-13, max_step=0.05).y[0, -1]
        out.append(sign * z)
    return np.array(out)


@pytest.mark.parametrize("n", [1.0, 1.4, 2.0, 3.0])
def test_asymmetric_law_agrees_with_another_integrator(n):
    model = replace(UNLIKE, n=n)
    assert model.is_admissible()
    # The integrator steps over the kinks at the centre and at h = 0: 1e-5 is its error, not the kernel's.
    np.testing.assert_allclose(asymmetric_hysteresis(LOOP, model), by_runge_kutta(LOOP, model), atol=1e-5)


def test_asymmetric_law_with_one_beta_is_the_symmetric_one():
    model = AsymmetricBoucWen(A=-1.2, betas=(0.5, 0, 0, 0, 0, 0), n=1.7, h0_deg=0.2)
    np.testing.assert_allclose(
        asymmetric_hysteresis(LOOP, model), hysteresis(LOOP, BoucWen(-1.2, 0.5, 0.0, 1.7, 0.2)), atol=1e-12
    )


@pytest.mark.parametrize("n", [1.0, 1.4, 2.0, 3.0])
def test_asymmetric_branch_is_the_hypergeometric_one(n):
    """On one side, in one direction, psi is beta + gamma with h, gamma - beta against it, as in the symmetric law."""
    model = replace(UNLIKE, n=n, A=1.2, h0_deg=-0.8)
    b1, b2, b3, b4, b5, b6 = model.betas
    onward, against = b1 + b2 + b3 + b4 + b5 + b6, -b1 + b2 - b3 + b4 - b5 + b6  # f above the centre, rising
    twin = BoucWen(1.2, 0.5 * (onward - against), 0.5 * (onward + against), n)
    for end in (3.1, 3.5, 4.5, 9.0):
        exact = branch_closed_form(-0.8, 3.0, end, twin)
        assert asymmetric_hysteresis([3.0, end], model)[-1] == pytest.approx(exact, rel=1e-8, abs=1e-11)


def test_asymmetric_loops_have_unequal_sides_and_any_sampling():
    limits = UNLIKE.saturations_deg()
    h = asymmetric_hysteresis(np.tile([-60.0, 60.0], 3), UNLIKE)
    assert h[-1] == pytest.approx(-limits[1, 1], rel=1e-9)
    assert h[-2] == pytest.approx(limits[0, 0], rel=1e-9)
    assert limits[1, 1] != pytest.approx(limits[0, 0], rel=0.05)
    fine = np.interp(np.arange(0, len(LOOP) - 0.5, 0.25), np.arange(len(LOOP)), LOOP)
    np.testing.assert_allclose(asymmetric_hysteresis(fine, UNLIKE)[::4], asymmetric_hysteresis(LOOP, UNLIKE), atol=1e-9)


def test_inadmissible_asymmetric_law_is_refused():
    bad = replace(UNLIKE, betas=(0.1, 0.2, 0, 0, 0, 0))
    assert not bad.is_admissible()
    with pytest.raises(ValueError, match="parameters 1"):
        asymmetric_batch(LOOP, [UNLIKE.row(), bad.row()])
    assert asymmetric_batch(LOOP, [UNLIKE.row(), UNLIKE.row()]).shape == (2, LOOP.size)
    beyond = replace(UNLIKE, h0_deg=1.01 * UNLIKE.saturations_deg().max())
    with pytest.raises(ValueError, match="parameters 0"):
        asymmetric_batch(LOOP, [beyond.row()])


def test_classical_law_adds_damping_and_stiffness():
    time = np.linspace(0, 2, 801)
    x = 3 * np.sin(2 * np.pi * time)
    law = BoucWen(1.1, 0.4, 0.2, 1.5)
    model = Classical(c=0.3, k=2.0, x0=0.5, alpha=0.7, law=law)
    velocity = 6 * np.pi * np.cos(2 * np.pi * time)
    expected = 0.3 * velocity + 2 * (x - 0.5) + 0.7 * hysteresis(x, law)
    np.testing.assert_allclose(force(time, x, model)[1:-1], expected[1:-1], atol=1e-3)  # x' by differences: 2e-4 off
    assert force_batch(time, x, [model.row(), model.row()]).shape == (2, 801)
    assert Classical(c=0.3, k=2.0, x0=0.5, alpha=0.7).law == BoucWen(A=1.0, beta=0.5, gamma=0.5, n=1.0)
    with pytest.raises(ValueError, match="times increasing"):
        force(time[::-1], x, model)


def test_play_operators():
    u = np.array([0.0, 3.0, 1.0, -2.0, 0.0])
    # by hand: p = max(u - r, min(u + r, p))
    np.testing.assert_array_equal(plays(u, [0.0, 1.0, 2.0]), [u, [0, 2, 2, -1, -1], [0, 1, 1, 0, 0]])
    np.testing.assert_array_equal(plays(u, [1.0], start=[5.0])[0], [1, 2, 2, -1, -1])
    with pytest.raises(ValueError, match="at least 0"):
        plays(u, [-1.0])


def test_bouc_wen_tends_to_a_play():
    # A = -1, gamma = beta, n large: theta = f + h is a play of radius S
    S, n = 2.0, 200.0
    h = hysteresis(LOOP, BoucWen(-1.0, 0.5 / S**n, 0.5 / S**n, n))
    np.testing.assert_allclose(LOOP + h, plays(LOOP, [S])[0], atol=0.03)  # corners are rounded over S / n
