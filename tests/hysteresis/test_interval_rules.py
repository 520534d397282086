"""What the data fix, intervals, the choice of models and their judgement, by definition."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_loops import LOOP, line, of_records

from hysteresis.fitting import (
    identification,
    judgement,
    model_choice,
    response,
)
from hysteresis.fitting.form import Form, Point
from hysteresis.fitting.samples import Samples
from hysteresis.fitting.serial import _covariances
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.fitting.uncertainty import (
    Linearised,
    Parameter,
    Reader,
    Uncertainty,
    _bounded,
    linearise,
    parameters_of,
    student_quantile,
    uncertainty,
)
from hysteresis.laws.backbone import given_backbone
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.laws.elements import LAWS
from hysteresis.records.metrics import Errors
from hysteresis.records.record import Record, RecordError

# --- what the data fix ---------------------------------------------------------------------------------------------


def spread_of(form, size, sigmas, quantile=2.0):
    covariance = np.zeros((size, size))
    for i, sigma in sigmas.items():
        covariance[i, i] = sigma**2
    return Uncertainty(covariance, quantile, 1.0, np.zeros(size, dtype=bool), 50.0)


@pytest.mark.parametrize(("rho", "way_to_zero"), [(1.0, 1.0), (0.0, math.log(2.0))])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_response_of_a_law_with_n_of_one(sign, rho, way_to_zero):
    """In units of S/|A|: y' = 1 + kappa |y| up to zero, kappa = (1 - rho)/(1 + rho); then 1 - y up to 0.8: ln 5."""
    form, samples = Form((line(),)), of_records(10 * LOOP)
    point = Point(sign, np.array([math.log(0.5), math.log(2.0), 0.0, rho, 0.0]), np.zeros(1))
    found = response.response(samples, form, point, None)
    assert found["saturation_deg"].value == pytest.approx(2.0)
    assert found["reach_deg"].value == pytest.approx(4.0 * (way_to_zero + math.log(5.0)))
    assert found["slope_after_reversal"].value == pytest.approx(sign * 0.5 / way_to_zero)
    assert (found["n"].value, set(found)) == (1.0, {"saturation_deg", "slope_after_reversal", "reach_deg", "n"})


@pytest.mark.parametrize(("part", "known"), [(0.99, True), (1.01, False)])
def test_a_slope_is_known_up_to_a_factor_of_a_hundred(monkeypatch, part, known):
    """Half an interval of log |A| is two sigma: its ends are exp(4 sigma) apart."""
    monkeypatch.setattr(response, "_asymmetry", lambda *given: None)
    form, samples = Form((line(),)), of_records(10 * LOOP)
    point = Point(-1.0, np.array([math.log(0.5), math.log(2.0), math.log(2.0), 0.5, 0.0]), np.zeros(1))
    sigma = part * math.log(100.0) / 4
    slope = response.response(samples, form, point, spread_of(form, 6, {0: sigma}))["slope_after_reversal"]
    assert (slope.low is not None) is known
    if known:
        assert slope.low == pytest.approx(slope.value * math.exp(2 * sigma))
        assert slope.high == pytest.approx(slope.value * math.exp(-2 * sigma))


@pytest.mark.parametrize(("sigma", "low", "high"), [(0.1, 2 * math.exp(-0.2), 2 * math.exp(0.2)), (0.9, 1.0, None)])
def test_n_is_open_above_where_its_interval_meets_the_bound(monkeypatch, sigma, low, high):
    monkeypatch.setattr(response, "_asymmetry", lambda *given: None)
    form, samples = Form((line(),)), of_records(10 * LOOP)
    point = Point(-1.0, np.array([math.log(0.5), math.log(2.0), math.log(2.0), 0.5, 0.0]), np.zeros(1))
    n = response.response(samples, form, point, spread_of(form, 6, {2: sigma}))["n"]
    assert (n.low, n.high) == (pytest.approx(low), high if high is None else pytest.approx(high))


def test_the_asymmetry_of_directions_is_that_of_their_limits():
    """Limits S exp(+-d): (e^d - e^-d)/(e^d + e^-d) = tanh d."""
    form = Form((line(),), base_law=LAWS["asymmetric-bouc-wen"])
    point = Point(-1.0, np.array([math.log(0.5), math.log(2.0), 0.5, 0.5, 0.3, 0.0, 0.0]), np.zeros(1))
    found = response._asymmetry(of_records(10 * LOOP), form, point, spread_of(form, 8, {4: 0.05}))
    assert (found.value, found.low, found.high) == pytest.approx((math.tanh(0.3), math.tanh(0.2), math.tanh(0.4)))
    two = Form((line(),), elements=2)
    assert response._asymmetry(of_records(10 * LOOP), two, point, spread_of(two, 8, {})) is None


def test_what_is_left_open_is_moved_to_both_ends_of_its_interval(monkeypatch):
    """Within the bounds of n, 1 to 10, and of gamma / beta, -0.95 to 1; the limit is that of the profile."""
    asked = []

    def move(few, form, point, aim, limit):
        asked.append((aim, limit))
        return response._Moved(aim[1], 0.01 * len(asked))

    monkeypatch.setattr(response, "_move", move)
    form, samples = Form((line(),)), of_records(10 * LOOP)
    fixed = Parameter(1.0, 0.9, 1.1, "1")
    names = {"A": fixed, "beta": fixed, "gamma": Parameter(0.1, 0.05, 0.15, "1"), "n": Parameter(2.0, 0.5, 9.0, "1")}
    point = Point(-1.0, np.array([0.0, 0.0, math.log(2.0), 0.5, 0.0]), np.zeros(1))
    found = response.open_parameters(samples, form, point, spread_of(form, 6, {2: 0.2, 3: 0.5}), names)
    ends = [(2, math.log(2.0) - 0.4), (2, math.log(2.0) + 0.4), (3, -0.5), (3, 1.0)]
    assert [aim for aim, _ in asked] == [(i, pytest.approx(end)) for i, end in ends]
    assert [limit for _, limit in asked] == pytest.approx([math.sqrt(1 + 4 / 50)] * 4)
    assert (found.names, found.change_deg) == (("n",), 0.04)
    assert f"n from {2 * math.exp(-0.4):.3g} to {2 * math.exp(0.4):.3g} or gamma / beta from -0.5 to 1" in found.words
    names["n"] = fixed
    assert response.open_parameters(samples, form, point, spread_of(form, 6, {}), names) is None
    for part, name in ((0.9, ("gamma",)), (1.1, None)):  # a thousandth of the range from a bound
        near = Point(-1.0, np.array([0.0, 0.0, math.log(2.0), 1 - 1.95e-3 * part, 0.0]), np.zeros(1))
        opened = response.open_parameters(samples, form, near, spread_of(form, 6, {}), names)
        assert (None if opened is None else opened.names) == name
    assert "n or gamma / beta elsewhere" in response.open_parameters(samples, form, Point(
        -1.0, np.array([0.0, 0.0, 1e-3 * math.log(10.0) * 0.9, 0.5, 0.0]), np.zeros(1)),
        spread_of(form, 6, {}), names).words  # fmt: skip


@pytest.mark.parametrize(("good", "value", "change"), [(1.0, 3.0, 0.5), (0.25, 1.5, 0.125), (0.01, 1.0, 0.0)])
def test_an_entry_is_moved_as_far_as_the_others_make_up_for_it(monkeypatch, good, value, change):
    """From 1 towards 3, in parts of the way; the error is within the limit up to ``good`` of it."""
    monkeypatch.setattr(response, "polish", lambda samples, form, point, held, tolerance: (held[0], 1))
    error = lambda samples, form, at: 1.0 if isinstance(at, Point) else 1.0 + 0.2 * (at > 1 + 2 * good)  # noqa: E731
    monkeypatch.setattr(response, "rmse", error)
    angle = lambda samples, at: np.zeros(4) if isinstance(at, Point) else np.full(4, 0.25 * (at - 1))  # noqa: E731
    samples, form = SimpleNamespace(train=np.ones(4, dtype=bool)), SimpleNamespace(angle=angle)
    found = response._move(samples, form, Point(1.0, np.array([1.0]), np.zeros(0)), (0, 3.0), 1.1)
    assert found == pytest.approx((value, change))


# --- intervals -----------------------------------------------------------------------------------------------------


def test_intervals_of_an_uncertainty():
    """Student's t of one degree of freedom is Cauchy's: tan(0.475 pi); of many, 1.96."""
    assert student_quantile(1.0) == pytest.approx(math.tan(0.475 * math.pi))
    assert student_quantile(0.2) == student_quantile(1.0)
    assert student_quantile(1e9) == pytest.approx(1.959964, abs=1e-6)
    blind = np.array([False, False, True])
    one = Uncertainty(np.array([[4.0, 3.0, 0], [3.0, 9.0, 0], [0, 0, 0]]), 2.0, 1.0, blind, 9.0)
    assert one.half_width(np.array([1.0, 0, 0])) == 4.0
    assert one.half_width(np.array([1.0, -1.0, 0])) == pytest.approx(2 * math.sqrt(4 + 9 - 6))
    assert one.half_width(np.array([1.0, 0, 0.1])) == math.inf
    assert (one.correlation(0, 1), one.correlation(0, 2)) == (0.5, 0.0)
    with_freedom = Uncertainty(one.covariance, 2.0, 1.0, blind, 9.0, lambda gradient: 1.0)
    assert with_freedom.half_width(np.array([1.0, 0, 0])) == pytest.approx(2 * math.tan(0.475 * math.pi))


def test_a_covariance_is_that_of_the_normal_equations_for_correlated_samples():
    """A line of one coefficient, its derivative 1: s^2/m times m/m_eff; neighbours of +-1 in pairs."""
    error = np.tile([1.0, 1.0, -1.0, -1.0], 10)
    drive = np.linspace(-1, 1, 40)
    form = Form((given_backbone(lambda x: 10 * x, drive, drive, "mm"),))
    samples = Samples(drive, 10 * drive - error, np.ones(40, dtype=bool))
    found = uncertainty(samples, form, Point(0.0, np.zeros(5), np.zeros(1)))
    r = (error[1:] @ error[:-1]) / 40
    assert r == pytest.approx(1 / 40)  # 20 pairs alike, 19 that differ
    assert found.effective == pytest.approx(40 * (1 - r) / (1 + r))
    assert found.unidentifiable.tolist() == [True] * 5 + [False]
    assert found.covariance[5, 5] == pytest.approx(40 / 39 * 40 / found.effective / 40, rel=1e-6)
    assert (found.condition, found.quantile) == (pytest.approx(1.0), pytest.approx(student_quantile(39)))


def test_the_inverse_of_normal_equations_and_its_condition():
    """Columns of 3 and 4, 60 deg apart: J^T J = [[9, 6], [6, 16]]; unit columns: sqrt((1 + 1/2) / (1 - 1/2))."""
    columns = np.array([[3.0, 7.0, 4 * 0.5], [0.0, 7.0, 4 * 0.75**0.5]])
    one = Linearised(np.zeros(2), columns, np.array([True, False, True]), np.zeros(3, dtype=bool))
    within, condition = one.inverse()
    np.testing.assert_allclose(within, np.linalg.inv([[9, 6], [6, 16]]), rtol=1e-12)
    assert condition == pytest.approx(3**0.5)


def test_steps_of_derivatives_go_back_at_an_upper_bound():
    """A state at 1 has no slope upwards, where it is cut off, but one downwards."""
    form, samples = Form((line(),)), of_records(10 * LOOP)
    at = lambda state: Point(-1.0, np.array([0.0, math.log(2.0), 0.0, 0.5, state]), np.zeros(1))  # noqa: E731
    found = linearise(samples, form, at(1.0))
    start = (form.angle(samples, at(1.0))[0] - form.angle(samples, at(1.0 - 1e-6))[0]) / 1e-6
    assert found.columns[0, 4] == pytest.approx(start, rel=1e-4)
    assert found.columns[0, 4] == pytest.approx(2.0, rel=1e-4)  # h0 is the state times the saturation
    assert found.free.all()


def test_intervals_of_positive_and_bounded_numbers():
    def reader(half):
        return Reader(spread_of(None, 2, {0: half / 2}), 2, (np.full(2, -1.0), np.full(2, 1.0)))

    one = np.array([1.0, 0.0])
    found = reader(0.5).positive(2.0, one, "deg")
    assert (found.low, found.high) == pytest.approx((2 * math.exp(-0.5), 2 * math.exp(0.5)))
    ended = reader(0.5).positive(2.0, one, "deg", (math.log(2.0) - 0.1, math.log(2.0) + 0.2))
    assert (ended.low, ended.high) == pytest.approx((2 * math.exp(-0.1), 2 * math.exp(0.2)))
    for half, known in ((29.9, True), (30.1, False)):
        assert (reader(half).positive(2.0, one, "deg").low is not None) is known
        assert reader(half).positive(2.0, one, "deg", (-1.0, 1.0)).low == pytest.approx(math.exp(-1.0))
    assert reader(0.5).positive(0.0, one, "deg").low is None
    plain = reader(0.5).plain(2.0, one, "deg")
    assert (plain.low, plain.high) == (1.5, 2.5)
    for name, ends in (("chi", (-1.0, 2.2)), ("share_at_largest", (0.0, 1.0)), ("gamma_over_beta", (-1.0, 1.0))):
        bounded = _bounded(reader(2.0), name, 0.2, "1", one)
        assert (bounded.low, bounded.high) == pytest.approx(ends)
    assert _bounded(reader(2.0), "other", 0.0, "1", one) == Parameter(0.0, None, None, "1")
    within = _bounded(reader(0.1), "share_at_largest", 0.5, "1", one)
    assert (within.low, within.high) == pytest.approx((0.4, 0.6))
    blind = Uncertainty(np.eye(2), 2.0, 1.0, np.array([True, False]), 9.0)
    assert _bounded(Reader(blind, 2, reader(1).bounds), "chi", 0.2, "1", one) == Parameter(0.2, None, None, "1")


def test_a_gradient_is_central_and_one_sided_at_a_bound():
    reader = Reader(None, 4, (np.full(3, -1.0), np.full(3, 1.0)))
    found = reader.gradient(lambda q: q[0] ** 2 + 3 * q[1] + 7 * q[2], np.array([0.5, 1.0, -1.0]), (0, 1))
    assert found.tolist() == pytest.approx([1.0, 3.0, 0.0, 0.0], rel=1e-9)
    assert reader.gradient(lambda q: 7 * q[2], np.array([0.5, 1.0, -1.0]), (2,))[2] == pytest.approx(7.0)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_parameters_of_the_paper_follow_from_those_of_the_search(sign):
    """beta = |A| / (S^n (1 + rho)): log beta has the gradient (1, -n, -n log S, -1/(1 + rho)) by q."""
    form, samples = Form((line(), line()), groups=(0, 1), longest_delay_s=0.4), of_records(10 * LOOP, 10 * LOOP)
    q = np.array([math.log(0.5), math.log(2.0), math.log(1.5), 0.25, 0.5, 0.1, math.log(1.2), 0.75, 0.02])
    sigma = np.array([0.1, 0.2, 0.05, 0.04, 0.0, 0.0, 0.03, 0.02, 0.001, 0.3])
    found = parameters_of(samples, form, Point(sign, q, np.array([0.5])), spread_of(form, 10, dict(enumerate(sigma))))
    beta = 0.5 / (2.0**1.5 * 1.25)
    log_beta = np.array([1.0, -1.5, -1.5 * math.log(2.0), -1 / 1.25])
    gamma = 0.25 * beta * log_beta + np.array([0, 0, 0, beta])
    half = 2 * float(np.linalg.norm(log_beta * sigma[:4]))
    b, g, a = found["beta"], found["gamma"], found["A"]
    assert (b.value, b.low, b.high) == pytest.approx((beta, beta * math.exp(-half), beta * math.exp(half)))
    assert (g.value, g.high - g.value) == pytest.approx(
        (0.25 * beta, 2 * float(np.linalg.norm(gamma * sigma[:4]))), rel=1e-6
    )
    ends = sorted((sign * 0.5 * math.exp(-0.2), sign * 0.5 * math.exp(0.2)))
    assert (a.value, a.low, a.high) == pytest.approx((sign * 0.5, *ends))
    assert (found["n"].low, found["n"].high) == pytest.approx((1.5 * math.exp(-0.1), 1.5 * math.exp(0.1)))
    assert found["saturation_deg"].high == pytest.approx(2.0 * math.exp(0.4))
    assert found["h0_deg"].value == pytest.approx(1.0)
    assert found["h0_deg"].high - 1.0 == pytest.approx(2 * 0.2 * 1.0, rel=1e-4)  # h0 = state S: only S is unsure
    assert found["h0_deg_record_2"].value == pytest.approx(0.1 * 2.0 * 1.2)
    assert (found["amplitude_2"].value, found["amplitude_2"].high) == pytest.approx((1.2, 1.2 * math.exp(0.06)))
    assert (found["delay_s"].value, found["delay_s"].high) == pytest.approx((0.02, 0.022))
    assert (found["zero_deg_record_2"].value, found["zero_deg_record_2"].high) == pytest.approx((0.75, 0.79))
    assert (found["offset_deg"].value, found["offset_deg"].low) == pytest.approx((0.5, -0.1))
    assert [p.unit for p in found.values()].count("deg") == 5


@pytest.mark.parametrize(("part", "known"), [(0.99, True), (1.01, False)])
def test_an_initial_state_is_known_within_four_saturations(part, known):
    form, samples = Form((line(),)), of_records(10 * LOOP)
    q = np.array([math.log(0.5), math.log(2.0), math.log(1.5), 0.25, 0.0])
    sigma = {4: part * 4.0 / 4}  # an interval of 4 sigma S
    found = parameters_of(samples, form, Point(-1.0, q, np.zeros(1)), spread_of(form, 6, sigma))["h0_deg"]
    assert (found.low is not None) is known
    plain = parameters_of(samples, form, Point(0.0, np.zeros(5), np.zeros(1)), spread_of(form, 6, {5: 0.1}))
    assert plain["h0_deg"] == Parameter(0.0, None, None, "deg")
    assert (plain["A"].value, plain["A"].low, plain["saturation_deg"].value) == (0.0, None, 0.0)
    assert plain["offset_deg"].high == pytest.approx(0.2)


# --- models and their choice ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("m", "size", "gain"), [(1000, 5, 1 / 1.05), (100, 6, 100 ** (-0.03))])
def test_hysteresis_must_lower_the_error_by_more_than_noise_does(monkeypatch, m, size, gain):
    """By a twentieth at least; m log(square) + size log m of Schwarz is m^(-size / (2 m)) in errors."""
    samples = SimpleNamespace(train=np.ones(m, dtype=bool), span_deg=lambda: 10.0)
    monkeypatch.setattr(model_choice, "rmse", lambda samples, form, error: error)
    for scale, significant in ((0.999, True), (1.001, False)):
        found = model_choice._is_significant(samples, SimpleNamespace(size=size), scale * gain * 0.3, 0.3)
        assert found is significant
    for without, significant in ((0.9e-8, False), (1.1e-8, True)):  # rounding: 1e-9 of the range
        assert model_choice._is_significant(samples, SimpleNamespace(size=size), 0.0, without) is significant


def test_points_within_half_as_much_again_of_the_best_are_followed(monkeypatch):
    monkeypatch.setattr(model_choice, "rmse", lambda samples, form, error: error)
    assert model_choice._nearest(None, None, [2.9, 3.1, 2.0, 3.0]) == [2.0, 2.9, 3.0]
    best = model_choice._best(None, None, [2.9, 2.0, 3.0])
    assert (best.rmse_deg, best.point) == (2.0, 2.0)


@pytest.mark.parametrize(("knots", "tried"), [(1, [1, 2]), (5, [3, 5, 9]), (17, [9, 17])])
def test_near_another_model_its_knots_and_their_neighbours_are_tried(monkeypatch, knots, tried):
    seen = []
    monkeypatch.setattr(model_choice, "join", lambda *given, **more: None)
    monkeypatch.setattr(model_choice, "_curves", lambda *given: dict.fromkeys((1, 2, 3, 5, 9, 17)))

    def choose(records, splits, curves, *more):
        seen.append(list(curves))
        raise InterruptedError

    monkeypatch.setattr(model_choice, "_choose", choose)
    near = SimpleNamespace(backbones=(SimpleNamespace(names=("middle", *"k" * knots)),))
    with pytest.raises(InterruptedError):
        model_choice.find_model([], [], None, Form(()), [SimpleNamespace(fitness="rmse")], 1, near=near)
    assert seen == [tried]


@pytest.mark.parametrize(
    ("errors", "elements", "chosen"),
    [
        ((0.91, 0.91, 0.9, 0.9), (1, 2), (1, 0)),  # a curve alone, within 5 % of the best
        ((1.0, 1.0, 0.9, 0.86), (1, 2), (1, 1)),
        ((1.0, 1.0, 0.92, 0.86), (1, 2), (3, 1)),
        ((1.0, 1.0, 0.92, 0.86), (2,), (1, 2)),
    ],
)
def test_the_simplest_model_within_a_twentieth_is_chosen(monkeypatch, errors, elements, chosen):
    """Errors without hysteresis (1, 3 slopes), then of one element; two elements are at 0.875 and 0.87 throughout."""
    train = np.ones(27, dtype=bool)  # enough for three slopes: 3 (3 + 6) samples; not for five
    samples = SimpleNamespace(train=train, span_deg=lambda: 10.0)
    samples.thinned = lambda limit: samples
    monkeypatch.setattr(model_choice, "join", lambda *given, **more: samples)
    monkeypatch.setattr(model_choice, "validate_within", lambda *given: SimpleNamespace(train=None, heldout=None))
    monkeypatch.setattr(
        model_choice, "_search", lambda few, form, efforts, inner: model_choice._Optima([(0, 0)], 100, 2)
    )
    monkeypatch.setattr(model_choice, "without_hysteresis", lambda form, few: (form.backbones, 0))
    monkeypatch.setattr(model_choice, "with_curve_of", lambda new, few, old, point: (new.backbones, 1))
    shares = []

    def split(form, point, share):
        shares.append(share)
        return SimpleNamespace(backbones=form.backbones, elements=2), (form.backbones, 2)

    monkeypatch.setattr(model_choice, "split_element", split)
    monkeypatch.setattr(model_choice, "_polish_all", lambda few, form, points: (points, 10))
    table = {(1, 0): errors[0], (3, 0): errors[1], (1, 1): errors[2], (3, 1): errors[3], (1, 2): 0.875, (3, 2): 0.87}
    monkeypatch.setattr(model_choice, "rmse", lambda fold, form, point: table[point])
    curves = {knots: knots for knots in (1, 3, 5)}
    found = model_choice._choose([None], [SimpleNamespace()], curves, Form(()), [], elements, None)
    assert (found.point, found.seeds_agreeing) == (chosen, 2)
    assert found.evaluations == 100 + 10 * 2 * max(elements)
    assert shares == [0.05, 0.2, 0.5] * 2


# --- judgement -----------------------------------------------------------------------------------------------------


def of_error(rmse_deg):
    return Errors(rmse_deg, 2 * rmse_deg, 0.0, 0.0)


def test_errors_that_raise_a_warning():
    fine, point = SimpleNamespace(span_deg=lambda: 10.0), SimpleNamespace(sign=-1.0)
    words = lambda train, heldout, plain: list(  # noqa: E731
        judgement._error_warnings(fine, point, of_error(train), of_error(heldout), of_error(plain))
    )
    assert words(0.1, 0.199, 0.5) == []
    assert words(0.1, 0.201, 0.5) == ["held-out rmse is 0.201 deg, that of training 0.1 deg"]
    assert words(0.0, 0.9e-8, 0.5) == []
    assert words(0.1, 0.15, 0.15) == ["no better than a curve without hysteresis on the held-out samples"]
    point.sign = 0.0
    assert words(0.1, 0.15, 0.15) == []
    warned = lambda agreeing: list(judgement._search_warnings(SimpleNamespace(sign=1), 4, agreeing))  # noqa: E731
    assert (len(warned(1)), warned(2)) == (1, [])
    assert list(judgement._search_warnings(SimpleNamespace(sign=0), 4, 1)) == []


@pytest.mark.parametrize(("A", "warned"), [(-1.51, True), (-1.49, False), (2.0, False)])
def test_an_overshoot_is_a_slope_far_beyond_that_of_a_play(A, warned):
    point = SimpleNamespace(models=lambda form: [BoucWen(A, 0.5, 0.5, 1.0)])
    assert bool(list(judgement._overshoot_warnings(SimpleNamespace(elements=1), point))) is warned


@pytest.mark.parametrize("groups", [(0,), (0, 1)])
@pytest.mark.parametrize(("share", "warned"), [(0.94, True), (0.96, False)])
def test_a_record_shows_the_saturation_from_95_percent_on(share, warned, groups):
    """The largest group counts: its amplitude is twice that of the first one."""
    limit = 2.0 * (1 + max(groups))
    form = SimpleNamespace(
        hysteresis=lambda *given: np.array([[0.0, share * limit, -0.5]]), paths=lambda *given: [], groups=groups,
        amplitude=lambda group: 0,
    )  # fmt: skip
    halves = [SimpleNamespace(saturation_deg=1.0)] * 2
    point = SimpleNamespace(sign=1.0, q=np.array([math.log(2.0)]), elements=lambda form: halves)
    found = list(judgement._saturation_warnings(None, form, point))
    assert found == ([f"h reaches {share * limit:.3g} deg of a saturation of {limit:.3g} deg: the record does not "
                      "show the saturation"] if warned else [])  # fmt: skip


def test_errors_of_a_record_are_those_of_its_heldout_samples():
    samples = SimpleNamespace(angle_deg=np.array([9.0, 1.0, 3.0, 5.0, 5.0, 5.0]))
    heldout = np.array([False, True, True, False, True, True])
    found = judgement._errors_of(samples, samples.angle_deg + np.array([0, 0.5, -0.5, 0, 0, 0]), heldout, slice(0, 4))
    assert (found.rmse_deg, found.normalised) == pytest.approx((0.5, 0.25))
    assert judgement._errors_of(samples, samples.angle_deg, heldout, slice(3, 6)) is None  # the angle does not change
    assert judgement._errors_of(samples, samples.angle_deg, heldout, slice(0, 1)) is None


# --- the whole -----------------------------------------------------------------------------------------------------


def test_a_place_is_the_middle_and_half_the_range_of_training_angles():
    record = Record(LOOP, 10 * LOOP + 3)
    split = SimpleNamespace(train=LOOP < 0.5)
    angle = (10 * LOOP + 3)[LOOP < 0.5]
    assert identification._place([record], [split]) == pytest.approx(
        (0.5 * (angle.min() + angle.max()), 0.5 * (angle.max() - angle.min()))
    )
    flat = Record(LOOP, np.full(LOOP.size, 3.0))
    assert identification._place([flat], [split]) == (3.0, 1e-9)


@pytest.mark.parametrize(("factor", "costs"), [(1.24, False), (1.26, True)])
def test_a_first_stroke_costs_from_a_quarter_more_error_on(monkeypatch, factor, costs):
    monkeypatch.setattr(identification, "join", lambda *given, **more: None)
    monkeypatch.setattr(identification, "rmse", lambda samples, form, error: error)
    one = lambda error: SimpleNamespace(form=SimpleNamespace(longest_delay_s=0.0), point=error)  # noqa: E731
    assert identification._costs([], [], one(0.2 * factor), one(0.2)) is costs


def test_progress_counts_the_generations_of_all_searches():
    seen = []
    settings = IdentifySettings(seeds=2, seed=5, generations=4)
    first, second = identification._efforts(settings, lambda *both: seen.append(both), 3)
    assert (first.seed, second.seed, first.population) == (5, 6, 100)
    first.tick()
    second.tick()
    assert seen == [(1, 24), (2, 24)]
    identification._efforts(settings, None, 3)[0].tick()


def test_groups_are_labels_in_order_of_appearance():
    loads = [Record(LOOP, LOOP, rig={"preload_N": n}) for n in (2.0, 1.0, 2.0)]
    assert identification._groups(loads, None) == (0, 1, 0)
    assert identification._groups([*loads, Record(LOOP, LOOP)], None) == (0, 0, 0, 0)
    assert identification._groups(loads, ["b", "c", "a"]) == (0, 1, 2)
    with pytest.raises(ValueError, match="2 labels: expected one for each of 3 records"):
        identification._groups(loads, ["a", "b"])


def test_the_longest_delay_is_a_fiftieth_of_the_shortest_record():
    times = [np.linspace(5, 5 + length, LOOP.size) for length in (30.0, 20.0)]
    assert identification._longest_delay([Record(LOOP, LOOP, time_s=t) for t in times]) == pytest.approx(0.4)


@pytest.mark.parametrize(("over", "good"), [(0.9e-6, True), (1.1e-6, False)])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_theory_covers_the_drives_up_to_rounding(side, over, good):
    theory = np.array([[-1.0, -10.0], [0.0, 0.0], [1.0, 10.0]])
    drive = np.r_[0.0, side * (1 + 2 * over), 0.0]
    record = Record(drive, np.array([0.0, 5.0, 0.0]), kinematics=theory)
    if good:
        assert identification._theory(record)(drive).tolist() == pytest.approx([0.0, side * 10.0, 0.0])
        assert identification._kinematics([record], None, "analytic")[1] == "theory"
    else:
        with pytest.raises(RecordError, match="expected within the kinematics table, -1 to 1"):
            identification._theory(record)
    steps = Record(10 * drive, np.array([0.0, 5.0, 0.0]), drive_unit="step", kinematics=theory)
    assert identification._theory(steps)(np.array([30.0])) == pytest.approx([10.0])  # constant beyond its ends
    assert identification._kinematics([record, Record(drive, drive)], None, "analytic") == (None, "fitted")


def test_variances_that_cancel_to_rounding_give_no_interval():
    """Two elements share a saturation: each alone is open, and the sum is known only above the rounding."""
    huge = 1e12 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    known = Uncertainty(huge + 4e-4 * np.eye(2), 2.0, 1.0, np.zeros(2, bool), 50.0)
    assert known.half_width(np.array([1.0, 1.0])) == math.inf
    less = Uncertainty(1e-10 * huge + 4e-4 * np.eye(2), 2.0, 1.0, np.zeros(2, bool), 50.0)
    assert less.half_width(np.array([1.0, 1.0])) == pytest.approx(2 * math.sqrt(8e-4))
    assert less.half_width(np.zeros(2)) == 0.0


def test_the_covariances_of_a_second_order_filter_are_its_own():
    """An autoregression with roots of 0.9 is stable, though its coefficients sum up to more than 1 in size."""
    first, second = 1.78, -0.80
    ratios = [1.0, first / (1.0 - second)]
    while len(ratios) < 400:
        ratios.append(first * ratios[-1] + second * ratios[-2])
    found = _covariances(np.array(ratios[:3]), 2)
    assert found[1:].sum() == pytest.approx(sum(ratios[1:]), rel=0.01)
