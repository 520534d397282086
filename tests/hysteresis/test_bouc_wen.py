"""The improved Bouc-Wen law against closed forms, another integrator and its own invariances."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from closed_branch import branch_closed_form
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from hysteresis.laws.bouc_wen import BoucWen, hysteresis, hysteresis_batch

PAPER = BoucWen(A=1.895, beta=0.315, gamma=0.2606, n=1.176)  # eq. 10
MIRRORED = replace(PAPER, A=-1.895)
LOOP = np.concatenate([np.arange(0, 46, 2.0), np.arange(43, -46, -2.0), np.arange(-43, 46, 2.0)])


@st.composite
def admissible(draw):
    """Models of any size within Ismail et al.'s bounds, their state within saturation."""
    beta = 10 ** draw(st.floats(-6, 3))
    gamma = beta * draw(st.floats(-0.999, 1))
    model = BoucWen(
        A=draw(st.sampled_from([-1, 1])) * 10 ** draw(st.floats(-4, 3)),
        beta=beta,
        gamma=gamma,
        n=draw(st.one_of(st.sampled_from([1.0, 2.0, 3.0]), st.floats(1, 30))),
    )
    return replace(model, h0_deg=draw(st.floats(-1, 1)) * model.saturation_deg)


PATHS = st.lists(st.floats(-90, 90), min_size=2, max_size=40).map(np.array)


def by_runge_kutta(path, model):
    """Eq. 7 as printed, one adaptive DOP853 run per step of the path; the state z of |A|, mirrored afterwards."""
    sign = math.copysign(1.0, model.A)
    z = sign * model.h0_deg
    out = [z]
    for df in np.diff(path):

        def slope(_, z, df=df):
            return abs(model.A) * df - (
                model.beta * abs(df) * np.abs(z) ** (model.n - 1) * z + model.gamma * df * np.abs(z) ** model.n
            )

        z = solve_ivp(slope, (0, 1), [z], method="DOP853", rtol=1e-12, atol=1e-13).y[0, -1]
        out.append(z)
    return sign * np.array(out)


# --- independent references --------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", [PAPER, MIRRORED])
def test_saturation_of_the_paper(model):
    # (A / (beta + gamma))^(1/n) of eq. 10, worked out by hand: (1.895 / 0.5756)^(1/1.176) = 2.7545 deg
    assert model.saturation_deg == pytest.approx(2.754, abs=1e-3)
    h = hysteresis(LOOP, model)
    assert np.abs(h).max() == pytest.approx(2.754, abs=1e-3)
    assert h[22] == pytest.approx(math.copysign(2.754, model.A), abs=1e-3)  # end of the rising branch


@pytest.mark.parametrize("n", [1.0, 1.176, 1.5, 2.0, 2.3, 3.0])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("start", [-0.999, -0.4, 0.0, 0.3, 0.9])
def test_monotonic_branch_is_the_hypergeometric_one(n, sign, start):
    model = replace(PAPER, A=sign * 1.895, n=n)
    h0 = start * model.saturation_deg
    for f1 in (-6.0, -1.0, -1e-3, 1e-3, 0.5, 2.0, 8.0):
        exact = branch_closed_form(h0, 1.0, 1.0 + f1, model)
        h = hysteresis([1.0, 1.0 + f1], replace(model, h0_deg=h0))[-1]
        assert h == pytest.approx(exact, rel=1e-8, abs=1e-10)


@settings(max_examples=150)
@given(admissible(), st.floats(1, 3), st.floats(-1, 1), st.floats(-5, 5))
def test_branch_of_any_model_is_the_hypergeometric_one(model, n, start, distance):
    """Relative error of 1e-8 for n in 1..3, near h = 0 of the saturation; ``distance`` is in paths to saturation."""
    beta, gamma = (value / (model.beta + model.gamma) for value in (model.beta, model.gamma))
    assume(gamma > -0.99 * beta)
    saturation = 10 ** (10 * start % 1)
    slope = abs(model.A)
    scale = slope / saturation**n
    unit = BoucWen(math.copysign(slope, model.A), scale * beta, scale * gamma, n)
    h0, f1 = start * unit.saturation_deg, distance * unit.saturation_deg / slope
    exact = branch_closed_form(h0, 0.0, f1, unit)
    h = hysteresis([0.0, f1], replace(unit, h0_deg=h0))[-1]
    assert h == pytest.approx(exact, rel=1e-8, abs=1e-11 * unit.saturation_deg)


def test_rate_does_not_matter():
    """The same path at another rate (other samples of a sine) gives the same loop to 1e-8."""
    places = np.linspace(-40, 40, 81)
    fine = np.unique(np.concatenate([places, 40 * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 3001))]))
    for model in (PAPER, replace(MIRRORED, n=2.7)):
        slow = hysteresis(np.concatenate([[0.0], places, places[::-1]]), model)[1:]
        path = np.concatenate([[0.0], fine, fine[::-1]])
        at = np.concatenate([np.searchsorted(fine, places), 2 * len(fine) - 1 - np.searchsorted(fine, places[::-1])])
        np.testing.assert_allclose(hysteresis(path, model)[1:][at], slow, atol=1e-8 * model.saturation_deg)


def test_exponential_for_n_1():
    # dh/df = A - (beta + gamma) h from h = 0
    model = BoucWen(A=1.5, beta=0.4, gamma=0.2, n=1.0)
    f = np.linspace(0, 6, 13)
    np.testing.assert_allclose(hysteresis(f, model), 1.5 / 0.6 * (1 - np.exp(-0.6 * f)), rtol=1e-11)


def test_tanh_and_tan_for_n_2():
    # dh/df = A - (beta + gamma) h^2 above zero, A + (beta - gamma) h^2 below
    model = BoucWen(A=1.5, beta=0.4, gamma=0.2, n=2.0)
    f = np.linspace(0, 6, 13)
    up = math.sqrt(1.5 / 0.6) * np.tanh(math.sqrt(1.5 * 0.6) * f)
    np.testing.assert_allclose(hysteresis(f, model), up, rtol=1e-11)
    to_zero = math.atan(1.2 * math.sqrt(0.2 / 1.5)) / math.sqrt(1.5 * 0.2)
    f = np.linspace(0, to_zero, 9)
    below = -math.sqrt(1.5 / 0.2) * np.tan(math.sqrt(1.5 * 0.2) * (to_zero - f))
    np.testing.assert_allclose(hysteresis(f, replace(model, h0_deg=-1.2)), below, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    "model",
    [
        PAPER,
        MIRRORED,
        BoucWen(-0.99, 1e-4, 9e-5, 4.2, h0_deg=3.0),
        BoucWen(0.5, 0.2, -0.15, 1.0, h0_deg=-1.0),
        BoucWen(-2.0, 0.7, 0.7, 2.5, h0_deg=0.4),
    ],
)
def test_loops_agree_with_another_integrator(model):
    path = np.concatenate([LOOP[::3], [10.0, 14.0, 12.5, 20.0, 20.0, 19.9]])
    np.testing.assert_allclose(hysteresis(path, model), by_runge_kutta(path, model), atol=1e-8 * model.saturation_deg)


def test_play_operator_is_the_sharp_limit():
    # A = -1, gamma = beta, n large: theta = f + h stands still after a reversal until f has gone 2 S, then moves
    # by 1:1. With n = 200 the corner is rounded over about S / n.
    S = 2.0
    model = BoucWen(A=-1.0, beta=0.5 / S**200, gamma=0.5 / S**200, n=200.0, h0_deg=-S)
    f = np.concatenate([np.linspace(0, 10, 11), np.linspace(10, -2, 13)[1:]])
    theta = f + hysteresis(f, model)
    np.testing.assert_allclose(theta[:11], f[:11] - S, atol=1e-9)
    np.testing.assert_allclose(theta[11:14], 8.0, atol=1e-9)  # f = 9, 8, 7
    np.testing.assert_allclose(theta[15:], f[15:] + S, atol=1e-9)


# --- invariances -------------------------------------------------------------------------------------------------


@settings(max_examples=300)
@given(admissible(), PATHS)
def test_bounded_and_finite(model, path):
    h = hysteresis(path, model)
    assert np.isfinite(h).all()
    assert np.abs(h).max() <= model.saturation_deg * (1 + 1e-9)


@settings(max_examples=150)
@given(admissible(), PATHS, st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_sampling_of_the_path_does_not_matter(model, path, between):
    """Additional points between two samples, and repeated samples, do not change h."""
    parts = np.concatenate([[0.0, 0.0], np.sort(between)])
    fine = np.concatenate([(a + (b - a) * parts) for a, b in pairwise(path)] + [path[-1:]])
    h = hysteresis(fine, model)[:: len(parts)]
    np.testing.assert_allclose(h, hysteresis(path, model), atol=1e-8 * model.saturation_deg)


@settings(max_examples=100)
@given(admissible(), PATHS)
def test_symmetries(model, path):
    """The negative path from the negative state, and the mirrored A, give the negative h."""
    h = hysteresis(path, model)
    np.testing.assert_array_equal(hysteresis(-path, replace(model, h0_deg=-model.h0_deg)), -h)
    np.testing.assert_array_equal(hysteresis(path, replace(model, A=-model.A, h0_deg=-model.h0_deg)), -h)


@settings(max_examples=60)
@given(admissible(), st.floats(0.1, 60))
def test_a_steady_loop_dissipates(model, amplitude):
    """The sum of h df over a closed loop has the sign of A (passive: Ismail et al. 2009, section 3)."""
    cycle = amplitude * np.concatenate([np.linspace(-1, 1, 200), np.linspace(1, -1, 200)[1:]])
    h = hysteresis(np.tile(cycle, 30), model)[-len(cycle) :]
    assume(abs(h[0] - h[-1]) < 1e-10 * model.saturation_deg)  # settled
    assert math.copysign(1.0, model.A) * np.trapezoid(h, cycle) >= -1e-9 * amplitude * model.saturation_deg


def test_negative_A_lags():
    theta = LOOP + hysteresis(LOOP, MIRRORED)
    up, down = theta[-23:], theta[23:67]
    f = LOOP[-23:]
    assert (up[:-2] < np.interp(f, LOOP[23:67][::-1], down[::-1])[:-2]).all()


def test_batch_is_the_single_one():
    rng = np.random.default_rng(3)
    models = [PAPER, MIRRORED, BoucWen(-1.0, 0.1, 0.05, 6.0, 0.5), BoucWen(0.0, 0.1, 0.0, 2.0)]
    path = rng.normal(size=500).cumsum()
    h = hysteresis_batch(path, [model.row() for model in models])
    assert h.shape == (4, 500)
    for row, model in zip(h, models, strict=True):
        np.testing.assert_array_equal(row, hysteresis(path, model))
    assert (h[3] == 0).all()  # A = 0: no hysteresis


def test_closed_form_of_a_path_of_zero_and_of_a_long_path():
    assert branch_closed_form(0.7, 3.0, 3.0, PAPER) == 0.7
    assert branch_closed_form(0.0, 0.0, -1e4, PAPER) == pytest.approx(-PAPER.saturation_deg)
    assert branch_closed_form(PAPER.saturation_deg, 0.0, 1.0, PAPER) == pytest.approx(PAPER.saturation_deg)


# --- errors ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("model", "admissible"),
    [
        (PAPER, True),
        (MIRRORED, True),
        (replace(PAPER, gamma=-0.4), False),
        (replace(PAPER, gamma=0.4), False),
        (replace(PAPER, n=0.9), False),
        (replace(PAPER, beta=0.3, gamma=-0.3), False),
        (replace(PAPER, beta=0.3, gamma=0.3), True),
    ],
)
def test_admissible(model, admissible):
    assert model.is_admissible() == admissible
    if not admissible:
        with pytest.raises(ValueError, match=r"parameters 0: .* expected beta \+ gamma > 0"):
            hysteresis([0.0, 1.0], model)


def test_bad_input_is_named():
    with pytest.raises(ValueError, match=r"BoucWen.n = nan"):
        BoucWen(1.0, 1.0, 0.0, math.nan)
    with pytest.raises(ValueError, match=r"h0_deg"):
        hysteresis([0.0, 1.0], replace(PAPER, h0_deg=3.0))
    with pytest.raises(ValueError, match=r"f_deg"):
        hysteresis([0.0, math.nan], PAPER)
    with pytest.raises(ValueError, match=r"\(2, 4\)"):
        hysteresis_batch([0.0, 1.0], np.ones((2, 4)))
    with pytest.raises(ValueError, match=r"parameters 1"):
        hysteresis_batch([0.0, 1.0], [PAPER.row(), replace(PAPER, n=0.5).row()])
    assert math.isinf(replace(PAPER, gamma=-0.4).saturation_deg)
    assert hysteresis([], PAPER).shape == (0,)
