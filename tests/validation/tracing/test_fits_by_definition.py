"""Fits, noise, dependence and smooth functions by closed forms that are worked out by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_fits import made
from scipy.stats import chi2

from fem_models.rig.checks import SolverError
from validation.tracing.effect import FreeParameter, SampleInputs
from validation.tracing.fitting import dependence, least_squares, noise, smooth
from validation.tracing.fitting.fitted import Rows
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.model import Model
from validation.tracing.fitting.noise import NoiseFloor, estimate_noise_floor, repeatability_deg
from validation.tracing.fitting.uncertainty import covariance, rise_without

# --- a model and its coordinates ---------------------------------------------------------------------------------


def two_effects() -> Model:
    """A baseline of two parameters, an effect of one and an effect of two, on two records with one channel."""
    gap, rate = FreeParameter("gap", "mm", 0.0, 3.0, 0.5), FreeParameter("rate", "1", 1.0, 9.0, 0.25, log=True)
    stiff = FreeParameter("stiff", "N", 1.0, 100.0, 0.5, log=True)
    slope = FreeParameter("slope", "deg", -4.0, 8.0, 2.0)
    added = tuple(
        SimpleNamespace(effect=SimpleNamespace(name=name), form=SimpleNamespace(parameters=parameters))
        for name, parameters in (("backlash", (gap,)), ("drag", (rate, gap)))
    )
    seen = []

    def predict(baseline, effects):
        seen.append((baseline, effects))
        return [np.array([5.0, 6.0]), np.array([7.0]), np.array([9.0, 9.5]), np.array([11.0])]

    tension = SimpleNamespace(weight=4.0, measured=(np.array([8.0, 9.0]), np.array([10.5])))
    problem = SimpleNamespace(
        parameters=(stiff, slope), predict_series=predict, seen=seen, channels=(tension,),
        observed=(np.array([4.0, 4.5]), np.array([10.0])),
        records=[SimpleNamespace(filled=lambda e: e + 100.0), SimpleNamespace(filled=lambda e: e + 200.0)],
    )  # fmt: skip
    return Model(problem, added)


def test_coordinates_are_parameters_over_their_scales_the_baseline_first():
    model = two_effects()
    assert [p.name for p in model.parameters] == ["stiff", "slope", "gap", "rate", "gap"]
    assert (model.baseline_size, model.names) == (2, ("backlash", "drag"))
    baseline, own = {"slope": 6.0, "stiff": math.e}, [{"gap": 1.5}, {"gap": 2.0, "rate": math.exp(0.5)}]
    x = model.coordinates(baseline, own)
    assert x.tolist() == pytest.approx([2.0, 3.0, 3.0, 2.0, 4.0])
    back, effects = model.values(x)
    assert back == pytest.approx(baseline)
    assert [list(values) for values in effects] == [["gap"], ["rate", "gap"]]
    assert effects[0] == pytest.approx(own[0])
    assert effects[1] == pytest.approx(own[1])
    low, high = model.bounds()
    assert low.tolist() == pytest.approx([0.0, -2.0, 0.0, 0.0, 0.0])
    assert high.tolist() == pytest.approx([2 * math.log(100), 4.0, 6.0, 4 * math.log(9), 6.0])


def test_errors_of_a_model_are_predicted_less_measured_and_those_of_channels_in_their_weight():
    """Errors of the angle between readings are filled, here by 100 and 200; those of channels are not."""
    model = two_effects()
    errors = model.errors(np.array([2.0, 3.0, 3.0, 2.0, 4.0]))
    assert [e.tolist() for e in errors] == [[101.0, 101.5], [197.0], [4.0, 2.0], [2.0]]
    (baseline, effects), forms = model.problem.seen[0], [added.form for added in model.added]
    assert baseline == pytest.approx({"stiff": math.e, "slope": 6.0})
    assert [form for form, _ in effects] == forms
    assert effects[0][1] == pytest.approx({"gap": 1.5})
    same, followed = model.followed(np.array([2.0, 3.0, 3.0, 2.0, 4.0]))
    assert followed is None  # the problem is run once for each derivative
    assert [e.tolist() for e in same] == [e.tolist() for e in errors]


# --- noise -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [100, 120, 140])
def test_correlated_noise_has_the_standard_deviation_of_its_autoregression(monkeypatch, step):
    """Of correlations 1, C, C^2, C^3 the difference 1, -3, 3, -1 has the mean square 20 - 30 C + 12 C^2 - 2 C^3."""
    c = 0.99 * step / 199

    def size(records, residuals, apart):
        lag = c**apart
        return 0.7 * math.sqrt((20 - 30 * lag + 12 * lag**2 - 2 * lag**3) / 20)

    monkeypatch.setattr(noise, "_third_difference_deg", size)
    assert noise.correlated_noise_deg([], []) == pytest.approx(0.7, rel=1e-9)


def test_sizes_that_grow_by_just_the_limits_are_correlated_noise(monkeypatch):
    sizes = {1: 1.0, 2: noise.CORRELATED, 4: 1.3, 8: 1.3}
    monkeypatch.setattr(noise, "_third_difference_deg", lambda records, residuals, apart: sizes[apart])
    assert noise.correlated_noise_deg([], []) is not None
    sizes.update({2: noise.MOST_CORRELATED, 4: 2.0, 8: 2.0})
    assert noise.correlated_noise_deg([], []) is not None
    sizes.update({2: 1.5, 4: 1.5, 8: 0.0})
    assert noise.correlated_noise_deg([], []) is None


@pytest.mark.parametrize("apart", [1, 2, 4])
def test_third_differences_are_of_samples_some_apart_inside_each_branch(apart):
    rng = np.random.default_rng(2)
    ends, rows = [[(0, 9), (8, 25)], [(0, 14)]], [rng.normal(size=25), rng.normal(size=14)]
    records = [SimpleNamespace(branches=[slice(a, b) for a, b in own]) for own in ends]
    third = [
        abs(row[i + 3 * apart] - 3 * row[i + 2 * apart] + 3 * row[i + apart] - row[i])
        for row, own in zip(rows, ends, strict=True)
        for a, b in own
        for i in range(a, b - 3 * apart)
    ]
    expected = 1.4826 * float(np.median(third)) / 20**0.5
    assert noise._third_difference_deg(records, rows, apart) == pytest.approx(expected, rel=1e-12)


def test_branches_without_a_third_difference_say_nothing_of_correlated_noise():
    short = [SimpleNamespace(branches=[slice(0, 3), slice(2, 5)])]
    assert math.isnan(noise._third_difference_deg(short, [np.arange(5.0)], 1))


def raw(branches, *, angle=(0.0, 1.0), rounding=0.0, steps=0.0, repeat=False) -> SimpleNamespace:
    return SimpleNamespace(
        branches=branches, rounding_deg=rounding, drive_step_deg=steps, cycles_repeat=repeat,
        record=SimpleNamespace(angle_deg=np.array(angle)),
    )  # fmt: skip


def test_the_local_noise_of_records_is_their_mean_square_weighted_by_samples():
    """Alternating errors of a have third differences of 8 a. Branches are not joined: no difference is across them."""
    signs = (-1.0) ** np.arange(30)
    parts = [slice(0, 10), slice(9, 30)]
    found = estimate_noise_floor([raw(parts), raw([slice(0, 10)])], [0.1 * signs, 0.3 * signs[:10]])
    size = 1.4826 * 8 / 20**0.5
    assert found.local_deg == pytest.approx(size * math.sqrt((30 * 0.01 + 10 * 0.09) / 40), rel=1e-12)
    step = np.r_[np.zeros(10), np.full(10, 5.0)]
    assert estimate_noise_floor([raw([slice(0, 10), slice(10, 20)])], [step]).local_deg == 1e-5  # of a range of 1 deg


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ({"angle": (-3.0, 4.0)}, 7e-5),
        ({"rounding": 0.02}, 0.02),
        ({"steps": 0.03, "rounding": 0.02}, 0.03),
    ],
)
def test_noise_is_no_less_than_a_sensor_resolves(more, expected):
    assert estimate_noise_floor([raw([slice(0, 20)], **more)], [np.zeros(20)]).local_deg == pytest.approx(expected)


def test_repeats_are_no_less_than_rounding_and_steps_of_the_drive_add_to_them(monkeypatch):
    monkeypatch.setattr(noise, "noise_floor", lambda record: record)
    monkeypatch.setattr(noise.metrics, "repeatability_deg", lambda record: record)
    monkeypatch.setattr(noise, "_residual_record", lambda one, residual: float(residual[0]))
    rows = [raw([slice(0, 20)], steps=4.0, repeat=True), raw([slice(0, 20)], rounding=12.0, steps=5.0, repeat=True)]
    rows.append(raw([slice(0, 20)], steps=40.0))  # without cycles that repeat
    residuals = [np.full(20, 3.0), np.full(60, 1.0), np.full(20, 99.0)]
    expected = math.sqrt((20 * 5.0**2 + 60 * 13.0**2) / 80)
    assert estimate_noise_floor(rows[:2], residuals[:2]).repeats_deg == pytest.approx(expected)
    assert repeatability_deg(rows, residuals) == pytest.approx(expected)
    # the floor is of all records: one whose cycles do not repeat has noise of its own
    every = math.sqrt((20 * 5.0**2 + 60 * 13.0**2 + 20 * 40.0**2) / 100)
    assert estimate_noise_floor(rows, residuals).repeats_deg == pytest.approx(every)
    assert estimate_noise_floor(rows[2:], residuals[2:]).repeats_deg is None
    assert repeatability_deg(rows[2:], residuals[2:]) is None
    short = [replace_in(one, branches=[slice(0, 2)]) for one in rows[:2]]
    floor = estimate_noise_floor(short, residuals[:2])
    assert (floor.local_known, floor.local_deg, floor.repeats_deg) == (False, *[pytest.approx(expected)] * 2)


def replace_in(one: SimpleNamespace, **changes) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(one), **changes})


def test_without_branches_the_floor_is_the_rms_of_all_residuals_less_their_means():
    floor = estimate_noise_floor([raw([])] * 2, [np.array([1.0, 3.0]), np.array([10.0, 10.0, 13.0, 7.0])])
    assert not floor.local_known
    assert floor.local_deg == pytest.approx(math.sqrt((1 + 1 + 9 + 9) / 6))


@pytest.mark.parametrize(("rms", "said"), [(3.0, 0.5), (3.1, None)])
def test_cycles_tell_the_noise_up_to_three_times_that_of_neighbours(monkeypatch, rms, said):
    monkeypatch.setattr(noise, "estimate_noise_floor", lambda *given: NoiseFloor(1.0, None))
    monkeypatch.setattr(noise, "correlated_noise_deg", lambda *given: None)
    monkeypatch.setattr(noise, "repeatability_deg", lambda *given: 0.5)
    assert noise.sensor_noise_deg([], [np.array([5 + rms, 5 - rms])]) == said


# --- dependence --------------------------------------------------------------------------------------------------


def test_whiteness_is_the_test_of_ljung_and_box_over_all_records_that_are_long_enough():
    """Ten lags: m (m + 2) sum of r_k^2 / (m - k), with as many degrees of freedom for every record."""
    rng = np.random.default_rng(11)
    rows = [rng.normal(size=39), rng.normal(size=45), np.zeros(50), rng.normal(size=60)]
    total = 0.0
    for row in (rows[1], rows[3]):
        m = row.size
        for k in range(1, 11):
            r = sum(row[i] * row[i + k] for i in range(m - k)) / sum(v * v for v in row)
            total += m * (m + 2) * r * r / (m - k)
    expected = float(chi2.sf(total, 20))
    assert 0.01 < expected < 0.99
    assert dependence._portmanteau(rows) == pytest.approx(expected, rel=1e-9)
    assert dependence._portmanteau(rows[::-1]) == pytest.approx(expected, rel=1e-9)
    assert dependence._portmanteau(rows[:1]) == 1.0


def residual_of(rows: list[SampleInputs], errors: list[np.ndarray]) -> SimpleNamespace:
    record = SimpleNamespace(record=SimpleNamespace(tension_a_N=None), kept=None)
    problem = SimpleNamespace(inputs=rows, observed=[-e for e in errors], preloads_N=[], records=[record] * len(rows))
    return SimpleNamespace(errors=errors, error_deg=np.concatenate(errors), model=SimpleNamespace(problem=problem))


def test_a_constant_quantity_and_a_residual_of_nothing_are_not_tested():
    drive = np.r_[np.linspace(0, 1, 20), np.linspace(1, 0, 20)]
    one = SampleInputs(drive, np.arange(40.0), np.ones(40, dtype=int), False)
    names = [each.on for each in dependence.dependences(residual_of([one], [np.sin(np.arange(40.0))]))]
    assert names == ["neighbours", "drive", "direction", "distance since reversal", "time"]  # no angle, no cycle
    nothing = dependence.dependences(residual_of([one], [np.zeros(40)]))
    assert [(each.on, each.part, each.p) for each in nothing] == [("neighbours", 0.0, 1.0)]


def test_a_residual_that_a_spline_of_the_drive_makes_depends_on_it_wholly():
    """A straight line is in the span of the splines. Whether some 1e-30 is left or none: no part is above 1."""
    drive = np.linspace(-1, 1, 41)
    one = SampleInputs(drive, np.arange(41.0) ** 2, np.ones(41, dtype=int), False)
    found = {each.on: each for each in dependence.dependences(residual_of([one], [drive]))}
    assert found["drive"].part == pytest.approx(1.0)
    assert found["drive"].part <= 1.0
    assert found["neighbours"].part == pytest.approx(float(drive[1:] @ drive[:-1] / (drive @ drive)))


# --- least squares and uncertainty -------------------------------------------------------------------------------


class Plane:
    """Errors of two records and of a channel of each, linear in two coordinates; the runs are counted."""

    A = np.arange(20.0).reshape(10, 2) % 7
    sizes = (2, 3, 2, 3)

    def __init__(self, weight=0.0):
        self.problem = SimpleNamespace(channels=("tension",), prior_weight_deg=weight)
        self.baseline_size, self.points = 1, []

    def bounds(self):
        return np.array([-1.0, 0.0]), np.array([1.0, 4.0])

    def errors(self, x):
        self.points.append(x)
        return np.split(self.A @ x, np.cumsum(self.sizes)[:-1])

    def followed(self, x, threads):
        return self.errors(x), None


ALL = Holdout((np.ones(2, dtype=bool), np.ones(3, dtype=bool)), "n")


def test_derivatives_are_taken_away_from_the_nearer_bound_and_up_in_the_middle():
    for x, signs in (([0.0, 2.0], [1, 1]), ([0.1, 1.9], [-1, 1]), ([-1.0, 4.0], [1, -1])):
        model = Plane()
        start = np.array(x)
        errors = ALL.stacked(model.errors(start))
        found = least_squares.differentiate(model, ALL, start, errors, 1)
        moved = [point - start for point in model.points if not np.array_equal(point, start)]
        assert [np.flatnonzero(step).tolist() for step in moved] == [[0], [1]]
        assert [float(step.sum()) for step in moved] == pytest.approx([1e-3 * sign for sign in signs])
        parts = np.split(Plane.A, np.cumsum(Plane.sizes)[:-1])
        np.testing.assert_allclose(found, np.concatenate([a - a.mean(axis=0) for a in parts]), atol=1e-9)


def test_known_columns_come_first_and_the_others_are_differentiated():
    model, x = Plane(), np.array([0.0, 2.0])
    errors, known = ALL.stacked(model.errors(x)), np.full((10, 1), 7.0)
    found = least_squares.differentiate(model, ALL, x, errors, 1, known)
    assert found[:, 0].tolist() == [7.0] * 10
    part = Plane.A[:2, 1]
    assert found[:2, 1] == pytest.approx(part - part.mean())


def test_errors_and_derivatives_of_a_fit_are_those_of_its_records_then_those_of_its_channels():
    model, jacobian = Plane(), np.arange(20.0).reshape(10, 2)
    found = least_squares.fitted_at(model, ALL, np.zeros(2), np.arange(10.0), jacobian, 3)
    assert [e.tolist() for e in found.errors] == [[0, 1], [2, 3, 4]]
    assert [e.tolist() for e in found.channels.errors] == [[5, 6], [7, 8, 9]]
    assert (found.jacobian.tolist(), found.channels.jacobian.tolist()) == (jacobian[:5].tolist(), jacobian[5:].tolist())
    assert found.evaluations == 3
    model.problem.channels = ()
    assert least_squares.fitted_at(model, ALL, np.zeros(2), np.arange(5.0), jacobian[:5], 3).channels is None


@pytest.mark.parametrize(("last", "passed"), [(0.0, "run at 0"), (1.0, None)])
def test_derivatives_go_on_from_the_run_at_their_own_point_alone(monkeypatch, last, passed):
    given = []
    monkeypatch.setattr(least_squares, "differentiate", lambda *args: given.append(args) or np.zeros((5, 1)))
    model = SimpleNamespace(
        followed=lambda x, threads: ([np.zeros(2), np.zeros(3)], f"run at {x[0]:.0f}"),
        problem=SimpleNamespace(channels=()),
    )
    runs = least_squares._Evaluations(model, ALL, 1, None)
    runs.errors(np.zeros(1))
    runs.errors(np.array([last]))
    runs.jacobian(np.zeros(1))
    assert given[0][-1] == passed


def test_a_point_without_a_solution_is_far_off_in_every_sample():
    def none(x, threads):
        raise SolverError("no equilibrium")

    model = SimpleNamespace(followed=none, problem=SimpleNamespace(channels=("tension",)))
    errors = least_squares._Evaluations(model, ALL, 1, None).errors(np.zeros(1))
    assert errors.tolist() == [1e3] * 10  # two records, and a channel of each


def test_columns_without_slope_do_not_spoil_a_solution():
    flat = least_squares.solve(np.array([[0.0, 2.0], [0.0, 2.0]]), np.array([3.0, 5.0]))
    assert flat.tolist() == pytest.approx([0.0, 2.0])
    tiny = 1e-10 * np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1e10]])
    found = least_squares.solve(tiny, np.array([1.0, 3.0, 5.0]))
    assert found.tolist() == pytest.approx([2e10, 5.0])


def test_a_covariance_is_of_the_training_samples_and_of_parameters_of_any_size():
    """Orthogonal columns of 2 and 2e-10: s^2 = 12/(4 - 2), with 4 of 8 samples and so 3 of 6 independent ones."""
    J = np.array([[1, 1], [1, -1], [1, 1], [1, -1]]) * np.array([1.0, 1e-10])
    rows = Rows(np.r_[3.0, 1.0, -1.0, 1.0, [50.0] * 4], np.vstack([J, np.full((4, 2), 9.0)]), np.arange(8) < 4)
    found = covariance(SimpleNamespace(rows=rows, variance_samples=6.0))
    s2 = 12 / 2 * 4 / 3
    assert (found.freedom, found.variance) == (1.0, pytest.approx(s2))
    np.testing.assert_allclose(found.matrix * np.array([[1, 1e-10], [1e-10, 1e-20]]), np.eye(2) * s2 / 4, atol=1e-9)
    few = covariance(SimpleNamespace(rows=rows._replace(train=np.arange(8) < 2), variance_samples=40.0))
    assert (few.freedom, few.variance) == (pytest.approx(8.0), pytest.approx(10 * 2 / 10))  # 10/1, not 10/0


def test_a_parameter_without_slope_leaves_the_others_their_covariance():
    """The mean of four errors 3, 1, -1, 1: s^2 = 12/(4 - 2) of a slope of 2 in all."""
    J = np.array([[1.0, 0.0]] * 4)
    rows = Rows(np.array([3.0, 1.0, -1.0, 1.0]), J, np.ones(4, dtype=bool))
    found = covariance(SimpleNamespace(rows=rows, variance_samples=4.0)).matrix
    assert found[0, 0] == pytest.approx(6.0 / 4)
    assert np.isfinite(found).all()
    model = SimpleNamespace(bounds=lambda: (np.full(2, -9.0), np.full(2, 9.0)))
    fit = SimpleNamespace(rows=rows, x=np.array([1.0, 2.0]), model=model)
    assert rise_without(fit, [0], []) == 0.0  # errors of 2, 0, -2, 0 are less
    fit.x = np.array([-1.0, 2.0])
    assert rise_without(fit, [0], []) == pytest.approx(24.0 - 12.0)  # 4, 2, 0, 2


def linear(x, low, high) -> SimpleNamespace:
    """A fit with columns (1, 1, 0) and (0, 1, 1), errors (0, 0, 1), and a held-out sample."""
    J = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [7.0, 5.0]])
    rows = Rows(np.array([0.0, 0.0, 1.0, 9.0]), J, np.arange(4) < 3)
    bounds = np.array([-9.0, low]), np.array([9.0, high])
    return SimpleNamespace(rows=rows, x=np.array(x), model=SimpleNamespace(bounds=lambda: bounds))


@pytest.mark.parametrize(
    ("x", "low", "high", "shape", "rise"),
    [
        ([2.0, 3.0], -9.0, 9.0, [], 7.5),  # (-2, -2, 1) + 1/2 (0, 1, 1)
        ([2.0, 3.0], -9.0, 3.25, [], 7.625),  # a quarter only
        ([2.0, 3.0], -9.0, 3.0, [], 8.0),
        ([-2.0, 3.0], -9.0, 9.0, [], 3.5),  # (2, 2, 1) - 3/2 (0, 1, 1)
        ([-2.0, 3.0], 2.0, 9.0, [], 4.0),
        ([-2.0, 3.0], 3.0, 9.0, [], 8.0),
        ([-2.0, 3.0], -9.0, 9.0, [1], 8.0),
        ([0.1, 3.0], -9.0, 9.0, [1], 0.02),
        ([0.0, 3.0], -9.0, 9.0, [], 0.0),  # an amount of nothing
    ],
)
def test_what_the_squares_rise_by_without_an_amount_where_the_others_follow_within_their_bounds(
    x, low, high, shape, rise
):
    assert rise_without(linear(x, low, high), [0], shape) == pytest.approx(rise, abs=1e-6)


# --- smooth functions --------------------------------------------------------------------------------------------


def test_records_that_only_load_have_no_functions_of_direction_and_compete_without_those_of_the_drive(monkeypatch):
    asked = []

    def selected(fitted, samples, bases):
        asked.append((samples, set(bases)))
        return smooth.Smooth((str(len(asked)),), 1.0, 1, ())

    own, other = {"an odd function of the drive", "an even function of the drive", "the drive"}, {"time", "the cycle"}
    turned = {"the drive and its direction", "the distance since the last reversal"}
    monkeypatch.setattr(smooth, "_selected", selected)
    monkeypatch.setattr(smooth, "bases_of", lambda problem: dict.fromkeys([*own, *other, *turned]))

    def one(*loads):
        records = [SimpleNamespace(only_loads=each) for each in loads]
        return SimpleNamespace(angle_samples=50.0, model=SimpleNamespace(problem=SimpleNamespace(records=records)))

    found = smooth.smooth_functions(one(True, True))
    assert asked == [(50.0, own | other), (50.0, other)]
    assert (found.names, found.competitor.names) == (("1",), ("2",))
    assert smooth.smooth_functions(one(True, False), 7.0).competitor is None
    assert asked[2] == (7.0, own | other | turned)


def test_functions_of_five_cycles_are_splines_from_the_first_to_the_last_and_the_preload_is_taken_at_its_mean():
    """Five cubics with one knot amid: at the ends the outer one is 1, in the middle (1, 2, 1)/4."""
    drive = np.array([0.0, 1.0, 0.0, 1.0, 0.0])
    one = SampleInputs(drive, np.arange(5.0), np.arange(5), False)
    found = smooth.bases_of(SimpleNamespace(inputs=[one], preloads_N=[]))
    expected = np.array([[1, 0, 0, 0, 0], [0] * 5, [0, 0.25, 0.5, 0.25, 0], [0] * 5, [0, 0, 0, 0, 1]])
    expected[1] = [0.125, 0.59375, 0.25, 0.03125, 0]  # at 1/4, between the knots 0 and 1/2
    expected[3] = expected[1][::-1]
    np.testing.assert_allclose(found["the cycle"], expected - expected.mean(axis=0), atol=1e-12)
    signs = np.array([1, 1, -1, 1, -1])[:, None]  # each sample after the first by the way that led to it
    turned = expected * signs
    np.testing.assert_allclose(
        found["the cycle and the direction of the drive"], turned - turned.mean(axis=0), atol=1e-12
    )


def test_functions_by_preload_are_there_for_preloads_of_any_size():
    drive = np.linspace(-1.0, 1.0, 9)
    rows = [SampleInputs(drive, np.arange(9.0), np.ones(9, dtype=int), False)] * 2
    found = smooth.bases_of(SimpleNamespace(inputs=rows, preloads_N=[0.25, 0.75]))
    by_preload = found["the direction of the drive, by preload"].sum(axis=1)
    assert by_preload == pytest.approx(0.0)  # the direction is 1 in all of either record, and centred
    line = found["the drive, by preload"] @ np.ones(8)
    assert line == pytest.approx(0.0)  # splines add up to 1
    assert np.abs(found["the drive, by preload"]).max() > 0.2
    equal = smooth.bases_of(SimpleNamespace(inputs=rows, preloads_N=[0.95, 1.0]))
    assert "the drive, by preload" in equal
    assert "the drive, by preload" not in smooth.bases_of(SimpleNamespace(inputs=rows, preloads_N=[0.0, 0.0]))


@pytest.mark.parametrize(("over", "names"), [(1e-9, ()), (-1e-9, ("a",))])
def test_a_smooth_function_must_lower_the_criterion_by_six(over, names):
    """A column that takes the part 1 - exp(-g/n): the criterion falls by g less log n, 6 at g = 6 + log n."""
    m, n = 64, 100.0
    left = math.exp(-(6.0 + math.log(n) - over * n) / n)
    a, b = (-1.0) ** np.arange(m), (-1.0) ** (np.arange(m) // 2)
    fit = SimpleNamespace(
        holdout=SimpleNamespace(train_mask=np.ones(m, dtype=bool)), jacobian=np.zeros((m, 0)), mean_square=1.0,
        error_deg=math.sqrt(1 - left) * a + math.sqrt(left) * b,
    )  # fmt: skip
    found = smooth._selected(fit, n, {"a": a[:, None]})
    assert found.names == names
    assert found.square == pytest.approx(left if names else 1.0)


def test_smooth_functions_are_fitted_to_training_samples_and_scored_on_all():
    """A constant fitted to errors of 1 leaves those of 3 at 2."""
    train = np.arange(8) < 6
    error = np.where(train, 1.0, 3.0)
    assert smooth._mean_square(error, np.ones((8, 1)), train) == pytest.approx(4 * 2 / 8)


# --- rows that belong together -------------------------------------------------------------------------------------


def inputs_of_four() -> SampleInputs:
    return SampleInputs(np.arange(4.0), np.arange(4.0), np.ones(4, dtype=int), False)


def rows_of_ones(count=1):
    return [np.ones(4) for _ in range(count)]


@pytest.mark.parametrize(
    "call",
    [
        lambda: estimate_noise_floor([raw([slice(0, 4)])] * 2, rows_of_ones()),
        lambda: repeatability_deg([raw([slice(0, 4)])] * 2, rows_of_ones()),
        lambda: noise._third_difference_deg([raw([slice(0, 4)])] * 2, rows_of_ones(), 1),
        lambda: dependence._quantities(replace_in(residual_of([inputs_of_four()], rows_of_ones()), errors=[])),
        lambda: made(rows_of_ones(2), train=(np.ones(4, dtype=bool),)).heldout_errors,
        lambda: two_effects().coordinates({"stiff": 1.0, "slope": 1.0}, [{"gap": 1.0}]),
        lambda: two_effects().values(np.zeros(4)),
        lambda: two_effects().values(np.zeros(6)),
        lambda: two_effects()._errors_of([np.zeros(2), np.zeros(1), np.zeros(2)]),
    ],
)
def test_rows_of_different_records_are_refused(call):
    with pytest.raises(ValueError, match=r"zip\(\)"):
        call()
