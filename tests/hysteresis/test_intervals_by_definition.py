"""Intervals and what the data fix, by their definitions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from made_loops import LOOP, line, of_records, values_of

from hysteresis.fitting import model_choice, response
from hysteresis.fitting.form import Form, Point
from hysteresis.fitting.samples import Samples, join
from hysteresis.fitting.uncertainty import (
    Linearised,
    Parameter,
    Reader,
    Uncertainty,
    _Blocks,
    _bounded,
    bootstrap,
    linearise,
    parameters_of,
    student_quantile,
    uncertainty,
)
from hysteresis.laws.backbone import fitted_backbone, given_backbone
from hysteresis.laws.elements import LAWS, Place
from hysteresis.laws.stops import thresholds
from hysteresis.records.record import Record

# --- intervals -----------------------------------------------------------------------------------------------------


def one_constant(error, train=None, blocks=None):
    """Samples about a line of one unknown, its zero: residuals -error, derivative 1."""
    drive = np.linspace(-1, 1, len(error))
    train = np.ones(len(error), dtype=bool) if train is None else train
    form = Form((given_backbone(lambda x: 10 * x, drive, drive, "mm"),))
    return Samples(drive, 10 * drive + error, train, blocks=blocks), form, Point(0.0, np.zeros(5), np.zeros(1))


def test_neighbours_that_differ_count_as_independent_and_all_alike_as_one():
    """r = -19/20 counts as 0; of 20 samples all alike r = 19/20: 20 (1/20)/(39/20) = 20/39, but one at least."""
    by_turns = uncertainty(*one_constant(np.tile([1.0, -1.0], 10)))
    assert by_turns.effective == pytest.approx(20.0)
    assert by_turns.covariance[5, 5] == pytest.approx(1 / 19, rel=1e-6)
    alike = uncertainty(*one_constant(np.ones(20)))
    assert alike.effective == pytest.approx(20 / 39)
    assert alike.covariance[5, 5] == pytest.approx(20 / 19, rel=1e-6)
    assert alike.quantile == pytest.approx(student_quantile(19))
    exact = uncertainty(*one_constant(np.zeros(20)))
    assert (exact.effective, exact.covariance[5, 5]) == (20.0, 0.0)


def test_only_training_samples_count_in_an_interval():
    error = np.r_[np.tile([1.0, -1.0], 4), np.full(12, 50.0)]
    found = uncertainty(*one_constant(error, np.arange(20) < 8))
    assert found.effective == pytest.approx(8.0)
    assert found.covariance[5, 5] == pytest.approx(1 / 7, rel=1e-6)


@pytest.mark.parametrize(("low", "high"), [(None, 3.0), (1.0, None), (None, None)])
def test_a_value_without_both_ends_of_its_interval_is_shown_alone(low, high):
    assert str(Parameter(2.0, low, high, "mm")) == "2 mm"
    assert str(Parameter(2.0, 1.0, 3.0, "-")) == "2 (1 to 3)"


def test_an_interval_by_blocks_is_that_of_the_mean_of_their_means():
    """k blocks of four, means that add up to 0: variance of a mean of k draws, k/(k - 1) for what the fit took."""
    k = 30
    means = np.random.default_rng(8).normal(0, 0.6, k)
    means -= means.mean()
    train = np.tile([True, True, True, True, False], k)
    samples, form, point = one_constant(
        np.repeat(means, 5) + np.where(train, 0.0, 9.0), train, np.repeat(np.arange(k) * 3, 5)
    )
    found = bootstrap(samples, form, point, 5)
    expected = means.var() / k * k / (k - 1)
    assert found.covariance[5, 5] == pytest.approx(expected, rel=4 * math.sqrt(2 / 400))
    assert (found.effective, found.quantile) == (k, pytest.approx(student_quantile(k - 1)))
    assert found.freedom is not None
    one = np.eye(6)[5]
    assert found.freedom(one) == pytest.approx(k - 1, rel=1e-6)
    assert found.half_width(one) == pytest.approx(student_quantile(k - 1) * math.sqrt(found.covariance[5, 5]))
    assert found.half_width(np.ones(6)) == math.inf  # of what has no influence
    assert found.condition == pytest.approx(1.0)


def test_degrees_of_freedom_do_not_depend_on_units():
    rng = np.random.default_rng(3)
    jacobians = list(rng.normal(size=(6, 8, 2)))
    residuals = list(rng.normal(size=(6, 8)))
    units = np.array([100.0, 0.2])
    plain, other = _Blocks.of(jacobians, residuals), _Blocks.of([j * units for j in jacobians], residuals)
    for gradient in (np.array([1.0, 0.0]), np.array([1.0, 2.0])):
        assert other.freedom(gradient * units) == pytest.approx(plain.freedom(gradient), rel=1e-9)
        steps, moved = (
            b.steps(np.random.default_rng(1)) @ g for b, g in ((plain, gradient), (other, gradient * units))
        )
        np.testing.assert_allclose(moved, steps, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(np.diag(plain.normals.sum(axis=0)), 1.0, rtol=1e-12)
    np.testing.assert_allclose(other.size, units * plain.size, rtol=1e-12)


def test_a_flat_piece_of_a_curve_counts_as_known():
    """Slopes 8, 0 and 4e-7 per range: the last two are at their bound, to a millionth of the largest coefficient."""
    backbone = fitted_backbone(LOOP, 10 * LOOP, 3)
    samples = of_records(10 * LOOP)
    c = np.array([1.0, 8.0, 0.0, 7.9e-6])
    found = linearise(samples, Form((backbone,)), Point(0.0, np.zeros(5), c))
    assert found.free.tolist() == [False] * 5 + [True, True, False, False]
    assert found.unidentifiable.tolist() == [True] * 5 + [False] * 4
    assert not found.columns[:, 7:].any()
    c[3] = 8.1e-6
    assert linearise(samples, Form((backbone,)), Point(0.0, np.zeros(5), c)).free.tolist()[5:] == [
        True,
        True,
        False,
        True,
    ]
    c[1], c[0] = 0.0, -8.0  # a coefficient without a bound is free, and its size counts
    assert linearise(samples, Form((backbone,)), Point(0.0, np.zeros(5), c)).free.tolist()[5:] == [
        True,
        False,
        False,
        True,
    ]


def test_a_condition_without_unknowns_is_one_and_that_of_equal_columns_is_huge():
    none = Linearised(np.zeros(3), np.ones((3, 2)), np.zeros(2, dtype=bool), np.zeros(2, dtype=bool))
    within, condition = none.inverse()
    assert (within.shape, condition) == ((0, 0), 1.0)
    twice = Linearised(np.zeros(3), np.ones((3, 2)), np.ones(2, dtype=bool), np.zeros(2, dtype=bool))
    assert twice.inverse()[1] == pytest.approx(1e12, rel=1e-3)


def spread(size, sigmas, quantile=2.0):
    covariance = np.zeros((size, size))
    for i, sigma in sigmas.items():
        covariance[i, i] = sigma**2
    return Uncertainty(covariance, quantile, 1.0, np.zeros(size, dtype=bool), 50.0)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_intervals_of_a_second_element_end_at_the_bounds_of_the_search(sign):
    """|A| up to 20, n from 1 to 10, S up to the range of the angle, 20 deg."""
    form, samples = Form((line(),), elements=2), of_records(10 * LOOP)
    first = [math.log(0.5), math.log(2.0), math.log(1.5), 0.25]
    second = [math.log(4.0), math.log(1.0), math.log(5.0), -0.5]
    point = Point(sign, np.array([*first, *second, 0.5, -0.25]), np.zeros(1))
    wide = parameters_of(samples, form, point, spread(11, {4: 9.0, 5: 30.0, 6: 9.0, 7: 0.1}))
    assert [wide[name].value for name in ("A_2", "n_2", "saturation_deg_2")] == pytest.approx([sign * 4.0, 5.0, 1.0])
    assert (wide["n_2"].low, wide["n_2"].high) == pytest.approx((1.0, 10.0))
    assert sorted((abs(wide["A_2"].low), abs(wide["A_2"].high))) == pytest.approx([0.02, 20.0])
    assert wide["A_2"].low < wide["A_2"].high
    assert (wide["saturation_deg_2"].low, wide["saturation_deg_2"].high) == pytest.approx((2e-4, 20.0))
    assert wide["beta_2"].value == pytest.approx(4.0 / 0.5)
    assert wide["gamma_2"].value == pytest.approx(-2.0 / 0.5)
    # of log beta by rho: -1/(1 + rho) = -2, sigma 0.1; its other columns are too wide to be reported
    assert wide["beta_2"].low is None
    some = parameters_of(samples, form, point, spread(11, {7: 0.1}))
    assert some["beta_2"].high == pytest.approx(8.0 * math.exp(2 * 0.2))
    half = 2 * 0.1 * abs(8.0 * (-0.5 * -2 + 1))
    assert (some["gamma_2"].low, some["gamma_2"].high) == pytest.approx((-4.0 - half, -4.0 + half), rel=1e-6)
    assert some["beta"].low == pytest.approx(some["beta"].value)
    assert (some["h0_deg"].value, some["h0_deg_2"].value) == pytest.approx((1.0, -0.25))
    assert list(some)[:12] == ["A", "beta", "gamma", "n", "saturation_deg", "A_2", "beta_2", "gamma_2", "n_2",
                               "saturation_deg_2", "h0_deg", "h0_deg_2"]  # fmt: skip


def test_constants_of_another_law_have_intervals_of_their_own():
    """A by its logarithm; chi = exp(q) - 1 by itself: 2 sigma exp(q) either way; the share is within 0 and 1."""
    law = LAWS["prandtl-ishlinskii"]
    form, samples = Form((line(),), base_law=law), of_records(10 * LOOP)
    point = Point(-1.0, np.array([math.log(0.5), math.log(2.0), math.log(0.6), 0.9, 0.0]), np.array([0.5]))
    found = parameters_of(samples, form, point, spread(6, {0: 0.1, 2: 0.1, 3: 0.2, 1: 0.3}))
    assert (found["A"].value, found["A"].low, found["A"].high) == pytest.approx(
        (-0.5, -0.5 * math.exp(0.2), -0.5 * math.exp(-0.2)), rel=1e-6
    )
    assert (found["chi"].value, found["chi"].low, found["chi"].high) == pytest.approx((-0.4, -0.52, -0.28), rel=1e-6)
    assert (found["share_at_largest"].low, found["share_at_largest"].high) == pytest.approx((0.5, 1.0))
    s = found["saturation_deg"]
    assert (s.value, s.low, s.high) == pytest.approx((2.0, 2 * math.exp(-0.6), 2 * math.exp(0.6)))
    assert found["largest_threshold_deg"].value == pytest.approx(thresholds(4.0, 0.6, 0.9)[-1])
    plain = parameters_of(samples, form, replace(point, sign=0.0), spread(6, {5: 0.1}))
    assert (plain["A"].value, plain["saturation_deg"].value, plain["saturation_deg"].low) == (0.0, 0.0, None)
    assert plain["h0_deg"].value == 0.0
    assert plain["offset_deg"].high == pytest.approx(0.7)


def test_without_a_spread_there_are_values_only():
    form, samples = Form((line(), line(), line()), groups=(0, 1, 0)), of_records(*[10 * LOOP] * 3)
    q = np.array([math.log(0.5), math.log(2.0), 0.0, 0.25, 0.5, 0.1, -0.5, math.log(1.5), 0.75, -2.0])
    found = parameters_of(samples, form, Point(1.0, q, np.array([0.5])), None)
    assert all(p.low is None and p.high is None for p in found.values())
    assert list(found)[5:] == ["h0_deg", "h0_deg_record_2", "h0_deg_record_3", "amplitude_2", "zero_deg_record_2",
                               "zero_deg_record_3", "offset_deg"]  # fmt: skip
    assert [found[name].value for name in list(found)[5:]] == pytest.approx([1.0, 0.3, -1.0, 1.5, 0.75, -2.0, 0.5])
    bounded = _bounded(Reader(spread(2, {0: 1e9}), 2, (np.zeros(2), np.ones(2))), "A", -2.0, "1", np.array([1.0, 0.0]))
    assert bounded == Parameter(-2.0, None, None, "1")


# --- what the data fix ---------------------------------------------------------------------------------------------


def test_the_response_of_two_elements_is_that_of_their_sum():
    """n = 1, gamma = beta: h falls by A per deg to 0 of an element, then tends to -S; S 2 and 1, A 0.5 and 1."""
    form, samples = Form((line(),), elements=2), of_records(10 * LOOP)
    q = np.array([math.log(0.5), math.log(2.0), 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    found = response.response(samples, form, Point(-1.0, q, np.zeros(1)), None)
    assert set(found) == {"saturation_deg", "slope_after_reversal", "reach_deg"}
    assert found["saturation_deg"].value == pytest.approx(3.0)

    def h(way):
        first = 2.0 - 0.5 * way if way < 4.0 else -2.0 * -math.expm1(-0.25 * (way - 4.0))
        return first + (1.0 - way if way < 1.0 else math.expm1(-(way - 1.0)))

    ways = np.linspace(0, 40, 400_001)
    values = np.array([h(way) for way in ways[::100]])
    to_zero, reach = (np.interp(-end, -values, ways[::100]) for end in (0.0, -0.8 * 3.0))
    assert found["slope_after_reversal"].value == pytest.approx(-3.0 / to_zero, rel=1e-4)
    assert found["reach_deg"].value == pytest.approx(reach, rel=1e-4)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("wide", "inner", "constants", "more"),
    [
        ("asymmetric-bouc-wen", "bouc-wen", (0.4, 0.5), (0.6, -0.7)),
        ("generalised-prandtl-ishlinskii", "prandtl-ishlinskii", (-0.3, 0.2), (0.6, -0.7)),
    ],
)
def test_the_response_is_that_at_the_centre_without_asymmetry(sign, wide, inner, constants, more):
    samples, place = of_records(10 * LOOP), Place(3.0, 5.0)
    found = []
    for name, own in ((wide, (*constants, *more)), (inner, constants)):
        form = Form((line(),), base_law=LAWS[name], place=place)
        found.append(response.response(samples, form, Point(sign, values_of(name, *own, state=0.3), np.zeros(1)), None))
    for name in ("slope_after_reversal", "reach_deg"):
        assert found[0][name].value == pytest.approx(found[1][name].value, rel=1e-9)
    # half the width at the centre: limits S exp(+-0.6 +-0.7), their mean
    wider = math.cosh(0.6) * math.cosh(0.7) if wide == "asymmetric-bouc-wen" else 1.0
    assert found[0]["saturation_deg"].value == pytest.approx(2.0 * wider, rel=1e-9)
    assert ("n" in found[0]) is (wide == "asymmetric-bouc-wen")
    assert found[1]["saturation_deg"].value == pytest.approx(2.0)


def test_the_slope_and_reach_of_stops_are_those_of_their_first_loading():
    """After a reversal each stop moves over 2 r: h = S - 2 g(way/2), g the first loading from rest."""
    r = thresholds(4.0, 0.7, 0.2)
    weights = np.append(np.full(20, 0.04), 0.2)
    ways = np.linspace(0, 2 * r[-1], 20001)
    h = 2.0 - 2 * 0.5 * (np.minimum(ways[:, None] / 2, r) @ weights)
    to_zero, reach = (float(np.interp(-end, -h, ways)) for end in (0.0, -0.8 * 2.0))
    form = Form((line(),), base_law=LAWS["prandtl-ishlinskii"])
    point = Point(-1.0, values_of("prandtl-ishlinskii", math.log(0.7), 0.2), np.zeros(1))
    found = response.response(of_records(10 * LOOP), form, point, None)
    assert found["slope_after_reversal"].value == pytest.approx(-2.0 / to_zero, rel=1e-6)
    assert found["reach_deg"].value == pytest.approx(reach, rel=1e-6)


@pytest.mark.parametrize(("low", "high", "fixed"), [(1.0, 2.99, True), (1.0, 3.01, False), (-1.0, 1.0, False),
                                                    (-3.01, -1.0, False), (-2.99, -1.0, True), (0.0, 1.0, False),
                                                    (None, 1.0, False), (1.0, None, False)])  # fmt: skip
def test_a_parameter_is_fixed_within_a_factor_of_three(low, high, fixed):
    assert response.is_fixed("n", {"n": Parameter(1.0, low, high, "1")}) is fixed


def test_parameters_are_open_only_for_one_bouc_wen_element_with_intervals():
    form, samples = Form((line(),)), of_records(10 * LOOP)
    wide = {name: Parameter(1.0, None, None, "1") for name in ("A", "beta", "gamma", "n")}
    point = Point(-1.0, np.array([0.0, 0.0, 0.5, 0.5, 0.0]), np.zeros(1))
    assert response.open_parameters(samples, form, point, None, wide) is None
    for other, of in (
        (form, replace(point, sign=0.0)), (replace(form, elements=2), point),
        (replace(form, base_law=LAWS["prandtl-ishlinskii"]), point),
    ):  # fmt: skip
        assert response.open_parameters(samples, other, of, spread(6, {}), wide) is None
    samples = of_records(form.angle(samples, point))
    found = response.open_parameters(samples, form, point, spread(6, {}), wide)
    assert found.names == ("A", "beta", "gamma", "n")
    assert found.to_dict() == {
        "names": ["A", "beta", "gamma", "n"],
        "change_deg": found.change_deg,
        "words": found.words,
    }
    assert found.change_deg == pytest.approx(0.0, abs=1e-3)


def test_curves_that_are_tried_are_those_of_the_training_samples():
    """Given kinematics: one curve a record, of the drive's unit; fitted: of 1, 2, 3, 5, 9, 17 slopes, shared."""
    train = np.arange(LOOP.size) < 11
    steps = [Record(LOOP, 10 * LOOP, drive_unit="step"), Record(LOOP, 10 * LOOP, drive_unit="step")]
    samples = join(steps, [train, train])
    given = model_choice._curves(steps, samples, [lambda x: 10 * x] * 2)
    assert list(given) == [0]
    assert [curve.names for curve in given[0]] == [("gain_mm_per_step", "zero_step")] * 2
    (of_one,) = model_choice._curves(steps[:1], join(steps[:1], [train]), [lambda x: 10 * x])[0]
    assert of_one.names == ("gain_mm_per_step", "zero_step")
    fitted = model_choice._curves(steps, samples, None)
    assert {knots: (len(of), len(of[0].names)) for knots, of in fitted.items()} == {
        knots: (2, knots + 1) for knots in (1, 2, 3, 5, 9, 17)
    }
    assert fitted[1][0].start.tolist() == pytest.approx([-5.0, 10.0])  # of -1 to 0
