"""Bouc-Wen laws, plays and the flow by their definitions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closed_branch import branch_closed_form
from made_loops import LOOP

from hysteresis.laws import bouc_wen, flow
from hysteresis.laws.asymmetric import AsymmetricBoucWen, asymmetric_batch, asymmetric_hysteresis
from hysteresis.laws.bouc_wen import BoucWen, hysteresis, hysteresis_batch
from hysteresis.laws.classical import force_batch
from hysteresis.laws.prandtl_ishlinskii import plays

# --- Bouc-Wen ------------------------------------------------------------------------------------------------------


def test_the_limits_of_an_admissible_law_are_admissible():
    """gamma = beta and gamma = -beta are passive, and n = 1 is unique at h = 0; beta + gamma = 0 is not bounded."""
    assert BoucWen(1.0, 0.3, 0.3, 1.0).is_admissible()
    assert BoucWen(1.0, 0.3, -0.3, 1.0).is_passive()
    assert not BoucWen(1.0, 0.3, -0.3, 1.0).is_bounded()
    assert BoucWen(1.0, 0.3, -0.3, 1.0).saturation_deg == math.inf
    assert not BoucWen(1.0, 0.3, -0.31, 1.0).is_passive()
    assert not BoucWen(1.0, 0.3, 0.31, 1.0).is_passive()


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_state_may_exceed_the_saturation_by_rounding_only(sign):
    law = BoucWen(-2.0, 0.3, 0.2, 1.0)  # saturation 4
    for excess in (0.0, 0.9e-9):
        found = hysteresis([0.0, -sign * 1e3], replace(law, h0_deg=sign * 4.0 * (1 + excess)))
        assert found[1] == pytest.approx(sign * 4.0)
    for excess in (1.1e-9, 1e-8):
        with pytest.raises(ValueError, match="parameters 0"):
            hysteresis([0.0, 1.0], replace(law, h0_deg=sign * 4.0 * (1 + excess)))


def test_a_path_begins_with_a_finite_number():
    law = BoucWen(1.0, 0.3, 0.2, 1.0)
    for first in (math.inf, -math.inf, math.nan):
        for path in ([first], [first, first], [0.0, first]):
            with pytest.raises(ValueError, match="f_deg of shape"):
                hysteresis(path, law)
    with pytest.raises(ValueError, match=r"f_deg of shape \(1, 2\)"):
        hysteresis([[0.0, 1.0]], law)
    with pytest.raises(ValueError, match=r"parameters of shape \(5,\)"):
        hysteresis_batch([0.0, 1.0], law.row())
    with pytest.raises(ValueError, match="parameters 0"):  # a saturation that is no number
        hysteresis([0.0, 1.0], BoucWen(1e300, 1e-200, 0.0, 1.0))


def test_the_bad_row_is_named_by_its_number():
    good, bad = [1.0, 0.3, 0.2, 1.0, 0.0], [1.0, 0.3, 0.4, 1.0, 0.0]
    with pytest.raises(ValueError, match="parameters 2:"):
        hysteresis_batch([0.0, 1.0], [good, good, bad, good, bad])
    with pytest.raises(ValueError, match="parameters 3:"):
        asymmetric_batch([0.0, 1.0], [[1.0, 0.5, *[0.0] * 5, n, 0.0, 0.0] for n in (1.0, 1.0, 1.0, 0.9, 1.0)])


def test_threads_start_beyond_so_many_samples(monkeypatch):
    """Both ways by one kernel here: threads that numba has launched keep their number in this process."""
    rows = np.array([[-0.8, 0.3, 0.1, 1.5, 0.2], [0.0, 0.3, 0.1, 1.0, 0.0], [1.2, 0.3, -0.1, 2.0, -0.4]])
    path = 10 * LOOP
    alone = hysteresis_batch(path, rows)
    used, follow_all = [], bouc_wen._follow_all
    for name in ("_follow_all", "_follow_parallel"):
        monkeypatch.setattr(bouc_wen, name, lambda *given, n=name: (used.append(n), follow_all(*given))[1])
    for most, kernel in (
        (rows.shape[0] * path.size, "_follow_all"),
        (rows.shape[0] * path.size - 1, "_follow_parallel"),
    ):
        monkeypatch.setattr(bouc_wen, "_PARALLEL_FROM", most)
        np.testing.assert_array_equal(hysteresis_batch(path, rows), alone)
        assert used[-1] == kernel
    with pytest.raises(ValueError, match="parameters 1:"):
        hysteresis_batch(path, [rows[0], [1.0, 0.3, 0.4, 1.0, 0.0], rows[2]])


def test_a_branch_without_a_slope_stays_where_it_is():
    assert branch_closed_form(0.0, 1.0, 5.0, BoucWen(0.0, 0.3, 0.1, 2.0)) == 0.0
    with pytest.raises(ValueError, match="parameters 0"):
        branch_closed_form(3.0, 0.0, 0.0, BoucWen(1.0, 0.3, 0.2, 1.0))


def test_a_closed_branch_passes_zero_as_the_exponential_does():
    """n = 1: from -S/2 the way to zero is S/(kappa A) log(1 + kappa/2); then 1 - exp(-s)."""
    law = BoucWen(-0.6, 0.4, 0.1, 1.0)
    s, kappa = 0.6 / 0.5, 0.3 / 0.5
    to_zero = s / 0.6 * math.log1p(0.5 * kappa) / kappa
    for f1, direction in ((1.0 + to_zero + 0.7, 1.0), (1.0 - to_zero - 0.7, -1.0)):
        expected = -direction * s * -math.expm1(-0.7 * 0.6 / s)
        assert branch_closed_form(direction * 0.5 * s, 1.0, f1, law) == pytest.approx(expected, rel=1e-12)
    half = branch_closed_form(0.5 * s, 1.0, 1.0 + 0.5 * to_zero, law)
    assert half == pytest.approx(s * ((1 + 0.5 * kappa) * math.exp(-0.3 * to_zero / s * kappa) - 1) / kappa, rel=1e-9)


# --- the flow ------------------------------------------------------------------------------------------------------


def test_series_of_the_charts_are_those_of_the_exponential_and_of_tanh():
    """n = 1: y = 1 - exp(-t) and y = 1 - u; n = 2: tanh t = t - t^3/3 + 2 t^5/15, and (1 - u/2)/(1 + u/2)."""
    one, two = flow.workspace(1.0), flow.workspace(2.0)
    signs = (-1.0) ** np.arange(flow.ORDER + 1)
    factorials = np.array([math.factorial(k + 1) for k in range(flow.ORDER + 1)], dtype=float)
    np.testing.assert_allclose(one[flow.R], signs / factorials, rtol=1e-7)
    assert one[flow.Y].tolist() == [1.0, -1.0, *[0.0] * (flow.ORDER - 1)]
    np.testing.assert_allclose(two[flow.R][:5], [1.0, -1 / 3, 2 / 15, -17 / 315, 62 / 2835], rtol=1e-12)
    np.testing.assert_allclose(two[flow.Y], [1.0, *(signs[1:] * 0.5 ** np.arange(flow.ORDER))], rtol=1e-12)


@pytest.mark.parametrize("kappa", [0.5, 2.0])
def test_limits_of_a_chart_around_zero_are_states_of_one_path(kappa):
    """n = 1: above zero 1 - exp(-t); below it the path is 1/kappa as long, and the state (exp(t) - 1)/kappa."""
    work = flow.workspace(1.0)
    flow.set_kappa(work, 1.0, kappa)
    limits = work[flow.LIMITS]
    above = limits[flow.T_ABOVE]
    assert 0.0 < above <= 0.3
    assert limits[flow.Y_ABOVE] == pytest.approx(-math.expm1(-above), rel=1e-12)
    assert limits[flow.T_BELOW] == pytest.approx(above / kappa, rel=1e-12)
    assert limits[flow.Y_BELOW] == pytest.approx(math.expm1(above) / kappa, rel=1e-12)
    assert limits[flow.Y_TOP] == pytest.approx(1.0 - limits[flow.U_TOP], rel=1e-12)
    assert limits[flow.Y_OVER] == pytest.approx(1.0 + limits[flow.U_TOP], rel=1e-12)
    flow.set_kappa(work, 1.0, 0.0)
    assert limits[flow.T_BELOW] == limits[flow.Y_BELOW] == math.inf


# --- asymmetric Bouc-Wen -------------------------------------------------------------------------------------------


def test_a_direction_without_a_limit_has_none():
    """b1 = 1/2, b4 = -1/2: psi with the motion is 0 rising, 1 falling; the law is refused."""
    law = AsymmetricBoucWen(A=-4.0, betas=(0.5, 0, 0, -0.5, 0, 0), n=2.0)
    limits = law.saturations_deg()
    assert limits[:, 0].tolist() == [2.0, 2.0]
    assert np.isnan(limits[:, 1]).all()
    assert not law.is_admissible()
    with pytest.raises(ValueError, match="parameters 0"):
        asymmetric_hysteresis([0.0, 1.0], law)
    more = replace(law, betas=(0.5, 0, 0, -0.75, 0, 0))
    assert np.isnan(more.saturations_deg()[:, 1]).all()


def test_unloading_may_be_as_steep_as_at_zero_but_not_less():
    """b4 = -b5 = 1/4: psi against the motion is 0 rising, so h rises by A per deg until it is 0."""
    law = AsymmetricBoucWen(A=2.0, betas=(0.5, 0, 0, 0.25, -0.25, 0), n=1.0, h0_deg=-3.0)
    assert law.is_admissible()
    np.testing.assert_allclose(asymmetric_hysteresis([0.0, 0.5, 1.5], law), [-3.0, -2.0, 0.0], atol=1e-12)
    less = replace(law, betas=(0.5, 0, 0, 0.3, -0.3, 0))
    assert not less.is_admissible()
    with pytest.raises(ValueError, match="psi <= 0 against it"):
        asymmetric_hysteresis([0.0, 1.0], less)
    assert not replace(law, n=0.99).is_admissible()
    with pytest.raises(ValueError, match="n >= 1"):
        asymmetric_hysteresis([0.0, 1.0], replace(law, n=0.99))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_state_of_an_asymmetric_law_is_within_its_largest_limit(sign):
    """psi = 1/2 below the centre and 1 above it: limits 4 and 2 for A = 2."""
    law = AsymmetricBoucWen(A=2.0, betas=(0.75, 0, 0.25, 0, 0, 0), n=1.0)
    np.testing.assert_allclose(np.nanmax(law.saturations_deg()), 4.0)
    for excess, good in ((0.9e-9, True), (1.1e-9, False), (-0.1, True)):
        state = replace(law, h0_deg=sign * 4.0 * (1 + excess))
        if good:
            assert asymmetric_hysteresis([-1.0], state)[0] == state.h0_deg
        else:
            with pytest.raises(ValueError, match="h0_deg"):
                asymmetric_hysteresis([-1.0], state)


def test_an_asymmetric_law_takes_rows_of_finite_numbers():
    row = [1.0, 0.5, 0, 0, 0, 0, 0, 1.0, 0.0, 0.0]
    assert asymmetric_batch([], [row]).shape == (1, 0)
    assert asymmetric_batch([0.0, 1.0], [[0.0, *row[1:]]]).tolist() == [[0.0, 0.0]]  # A = 0
    for path in ([[0.0, 1.0]], [0.0, math.nan], [0.0, math.inf]):
        with pytest.raises(ValueError, match="f_deg of shape"):
            asymmetric_batch(path, [row])
    for rows in (row, [row[:-1]], [[*row, 0.0]], [[math.nan, *row[1:]]]):
        with pytest.raises(ValueError, match="parameters of shape"):
            asymmetric_batch([0.0, 1.0], rows)


def test_a_step_across_the_centre_is_divided_there():
    """n = 1: psi is 1/2 below 3 and 1 above it; h tends to 2 and to 1 with those rates, A = 1."""
    law = AsymmetricBoucWen(A=1.0, betas=(0.75, 0, 0.25, 0, 0, 0), n=1.0, centre_deg=3.0)
    at_centre = 2.0 * -math.expm1(-0.5 * 2.0)
    beyond = 1.0 + (at_centre - 1.0) * math.exp(-1.5)
    np.testing.assert_allclose(asymmetric_hysteresis([1.0, 4.5], law), [0.0, beyond], rtol=1e-12)
    np.testing.assert_allclose(asymmetric_hysteresis([1.0, 3.0, 4.5], law), [0.0, at_centre, beyond], rtol=1e-12)


# --- plays and the classical law -----------------------------------------------------------------------------------


def test_plays_take_a_row_and_radii_of_finite_numbers():
    np.testing.assert_array_equal(plays([5.0, 5.5, 8.0], [1.0, 0.0]), [[5.0, 5.0, 7.0], [5.0, 5.5, 8.0]])
    np.testing.assert_array_equal(plays([5.0], [1.0, 2.0], [0.0, 9.0]), [[4.0], [7.0]])
    for u in ([], [[1.0, 2.0]], [1.0, math.nan]):
        with pytest.raises(ValueError, match="u of shape"):
            plays(u, [1.0])
    for radii in ([[1.0]], [math.inf], [1.0, -1e-9], [math.nan]):
        with pytest.raises(ValueError, match="radii"):
            plays([1.0], radii)
    for start, radii in (([0.0, 0.0], [1.0]), ([0.0], [1.0, 2.0])):
        with pytest.raises(ValueError, match=rf"start of shape \({len(start)},\)"):
            plays([1.0], radii, start)


def test_a_force_of_two_samples_is_by_their_one_slope():
    """c x' + k (x - x0) + alpha z with z = S (1 - exp(-x A/S)), S = A/(beta + gamma), n = 1."""
    row = [0.5, 3.0, 0.25, 2.0, 0.8, 0.3, 0.1, 1.0, 0.0]
    z = 2.0 * -math.expm1(-0.4 * 1.5)
    expected = [0.5 * 3.0 - 0.75, 0.5 * 3.0 + 3 * 1.25 + 2 * z]
    np.testing.assert_allclose(force_batch([0.0, 0.5], [0.0, 1.5], row), [expected], rtol=1e-12)
    for wrong in (row[:-1], [*row, 0.0]):
        with pytest.raises(ValueError, match="parameters of shape"):
            force_batch([0.0, 0.5], [0.0, 1.5], wrong)
    for time, x in (([0.0, 0.5, 1.0], [0.0, 1.5]), ([0.0, 0.0], [0.0, 1.5]), ([0.0, 0.5, 0.5], [0.0, 1.0, 2.0])):
        with pytest.raises(ValueError, match="times increasing"):
            force_batch(time, x, row)
