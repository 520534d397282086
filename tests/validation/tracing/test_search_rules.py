"""Small rules of the search and of its verdicts, on stand-ins whose errors are set by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hysteresis.records.record import Record
from validation.tracing import cross_validated, verdict
from validation.tracing.effect import SampleInputs
from validation.tracing.fitting import least_squares
from validation.tracing.fitting.dependence import dependences
from validation.tracing.fitting.fitted import Fitted, Rows
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.least_squares import _Evaluations
from validation.tracing.fitting.noise import NoiseFloor, estimate_noise_floor
from validation.tracing.fitting.uncertainty import covariance
from validation.tracing.prepared import prepared
from validation.tracing.search import by_folds
from validation.tracing.settings import AT_FLOOR, EXPLAINED_SHARE

NOISE = NoiseFloor(local_deg=0.1, repeats_deg=None)
SMOOTH = SimpleNamespace(names=("time",), competitor=None)


class Hashed(SimpleNamespace):
    """A stand-in that may be a key, as fits are."""

    __hash__ = object.__hash__


def fitted(rmse: float, *names: str) -> SimpleNamespace:
    signs = (-1.0) ** np.arange(100)
    return SimpleNamespace(
        names=names, rmse_deg=rmse, mean_square=rmse**2, heldout_rmse_deg=rmse, heldout_errors=[rmse * signs],
        samples=100.0, bic=lambda samples: 100.0 * rmse, fold_errors=None,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("part", "expected"), [(1.02 * EXPLAINED_SHARE, "effect"), (0.98 * EXPLAINED_SHARE, "unexplained")]
)
def test_an_effect_explains_a_share_of_the_mean_square_above_the_noise(monkeypatch, part, expected):
    """The baseline leaves 0.5 deg, the noise is 0.1 deg: 0.24 deg^2 are to be explained."""
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.2)
    monkeypatch.setattr(verdict, "beats_smooth_functions", lambda *given: True)
    monkeypatch.setattr(verdict, "curve_does_as_well", lambda *given: False)
    best = fitted((0.25 - part * 0.24) ** 0.5, "gravity")
    assert best.rmse_deg > AT_FLOOR * 0.1
    found, reasons = verdict._verdict(None, fitted(0.5), best, SMOOTH, NOISE)
    assert found == expected
    words = f"gravity explains {100 * part:.0f} % of the mean square above the noise"
    assert reasons == ([words] if expected == "unexplained" else [])


def test_folds_say_first_what_the_rest_depends_on_and_know_no_reference(monkeypatch):
    monkeypatch.setattr(cross_validated, "smooth_functions", lambda fit: SMOOTH)
    monkeypatch.setattr(cross_validated, "remarks", lambda fit: ["remark"])
    best = fitted(1.01 * AT_FLOOR * 0.1, "gravity")
    found = SimpleNamespace(baseline=fitted(1.0), best=best, candidates=(), alike=((),))
    trace = cross_validated.judge_by_folds(found, ("one", "other"), floor=NOISE)
    assert (trace.verdict, trace.reference) == ("partial", 0)
    assert trace.words == ("the remaining residual depends on time", "one", "other", "remark")


@pytest.mark.parametrize(
    ("gains", "senseless", "expected"),
    [
        ([[20.0]], (), 20.0),  # a form with one start
        ([[20.0, 50.0, 30.0]], (), 50.0),
        ([[20.0, 50.0, 30.0]], (50.0,), None),  # other starts of a form lead where its best one leads
        ([[20.0, 50.0, 30.0], [25.0, 10.0]], (50.0,), 25.0),  # the best one of another form
        ([[20.0, 50.0], [60.0]], (), 60.0),
        ([[None, 40.0]], (), 40.0),  # a start without a solution
    ],
)
def test_an_effect_is_fitted_from_the_best_start_of_each_form(monkeypatch, gains, senseless, expected):
    tried = iter([gain for form in gains for gain in form])

    def start(*_: object) -> SimpleNamespace | None:
        found = next(tried)
        return None if found is None else SimpleNamespace(gain=found, added=found, x=np.zeros(1))

    model = SimpleNamespace(coordinates=lambda *given: np.zeros(1))
    monkeypatch.setattr(by_folds, "linearised_gain", start)
    monkeypatch.setattr(by_folds, "either_sign", lambda form, starts: starts)
    monkeypatch.setattr(by_folds, "AddedEffect", lambda effect, form: None)
    monkeypatch.setattr(by_folds, "_everything", lambda problem: None)
    monkeypatch.setattr(
        by_folds, "Model", lambda problem, added=(): SimpleNamespace(**vars(model), problem=problem, added=added)
    )
    monkeypatch.setattr(by_folds, "fit", lambda one, *given, **more: SimpleNamespace(start=one.added[-1]))
    monkeypatch.setattr(by_folds, "implausible", lambda one: one.start in senseless)
    problem = SimpleNamespace(forms=lambda effect: range(len(gains)), starts=lambda form: gains[form], start=None)
    best = SimpleNamespace(model=SimpleNamespace(problem=problem, added=()), names=())
    found = by_folds._front_runner(best, SimpleNamespace(name="drag"), lambda *_: None)
    assert (None if found is None else found.start) == expected


def test_a_dependence_without_samples_to_spare_is_no_finding():
    """At two drives, neighbours are so alike that fewer than two of 24 samples are independent."""
    drive, slow = np.repeat([-1.0, 1.0], 12), np.linspace(-1.0, 1.0, 12)
    one = SampleInputs(drive, np.arange(24.0), np.ones(24, dtype=int), False)
    error = 3.0 * drive + np.r_[slow, -slow]
    rest = np.r_[slow, -slow]
    r = (rest[1:] @ rest[:-1]) / (rest @ rest)
    assert 24 * (1 - r) / (1 + r) < 2  # an offset and one column
    record = SimpleNamespace(record=SimpleNamespace(tension_a_N=None), kept=None)
    problem = SimpleNamespace(inputs=[one], observed=[-error], preloads_N=(), records=[record], angle_names=())
    fit = SimpleNamespace(errors=[error], error_deg=error, model=SimpleNamespace(problem=problem))
    found = {each.on: each for each in dependences(fit)}
    assert found["drive"].part == pytest.approx(1 - rest @ rest / (error @ error), rel=1e-9)
    assert found["drive"].p == 1.0


def test_runs_of_a_model_are_counted():
    model = SimpleNamespace(followed=lambda x, threads: ([np.zeros(3)], None), problem=SimpleNamespace(channels=()))
    runs = _Evaluations(model, Holdout((np.ones(3, dtype=bool),), "nothing"), 1, None)
    assert runs.calls == 0
    for x in (0.0, 0.0, 1.0):  # the second is known
        runs.errors(np.array([x]))
    assert runs.calls == 2


@pytest.mark.parametrize(("known", "expected"), [(None, 4), (2, 2)])
def test_a_derivative_costs_a_run_for_each_column_that_is_not_known(monkeypatch, known, expected):
    model = SimpleNamespace(followed=lambda x, threads: ([np.zeros(5)], None), problem=SimpleNamespace(channels=()))
    monkeypatch.setattr(least_squares, "differentiate", lambda *given: np.zeros((5, 3)))
    columns = None if known is None else np.zeros((5, known))
    runs = _Evaluations(model, Holdout((np.ones(5, dtype=bool),), "nothing"), 1, columns)
    runs.jacobian(np.zeros(3))
    assert runs.calls == expected  # one run at the point itself
    runs.jacobian(np.zeros(3))  # the known columns are of the first point alone
    assert runs.calls == expected + 3


@pytest.mark.parametrize(
    ("samples", "columns", "freedom"), [(8.0, 3, 5.0), (4.0, 3, 1.0), (3.0, 3, 1.0), (0.5, 3, 1.0)]
)
def test_freedom_of_a_covariance_is_at_least_one(samples, columns, freedom):
    rng = np.random.default_rng(1)
    rows = Rows(rng.normal(size=20), rng.normal(size=(20, columns)), np.ones(20, dtype=bool))
    found = covariance(SimpleNamespace(rows=rows, variance_samples=samples))
    assert found.freedom == freedom
    one = rows.errors @ rows.errors / (20 - columns) * 20 / max(2.0, samples)
    np.testing.assert_allclose(found.matrix, one * np.linalg.inv(rows.jacobian.T @ rows.jacobian), rtol=1e-9)


def test_the_square_of_a_fit_is_of_the_angle_and_of_all_channels():
    rows = SimpleNamespace(errors=np.array([1.0, 2.0, 3.0]))
    for channels, expected in ((None, 0.5), ("tension", 14 / 3)):
        fit = SimpleNamespace(channels=channels, mean_square=0.5, rows=rows)
        assert Fitted.square.func(fit) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("taken", "named"), [(1.01, ("drag",)), (0.99, ())])
def test_a_step_must_take_a_hundredth_of_what_the_baseline_leaves(monkeypatch, taken, named):
    baseline, best = Hashed(**vars(fitted(2.0))), Hashed(**vars(fitted(1.0, "drag")))
    steps = iter([SimpleNamespace(fitted=best, chosen=[best], alike=()), None])
    monkeypatch.setattr(by_folds, "front_runners", lambda *given: [best])
    monkeypatch.setattr(by_folds, "_named", lambda *given: next(steps))
    monkeypatch.setattr(by_folds, "_square", lambda fits, chosen: 4.0)
    monkeypatch.setattr(by_folds, "_taken", lambda *given: taken * by_folds.NOT_TOLD * 4.0)
    fits = SimpleNamespace(
        folds=(0,), chosen=lambda models: [baseline], best=lambda models: baseline,
        with_fold_errors=lambda one, chosen: one,
    )  # fmt: skip
    monkeypatch.setattr(by_folds, "_fits_best", lambda baselines: baseline)
    found = by_folds.find_by_folds([baseline], [SimpleNamespace(name="drag")], fits, lambda *_: None)
    assert found.best.names == named
    assert len(found.candidates) == (2 if named else 1)  # of a step that names nothing the search ends


@pytest.mark.parametrize("cycles", [1, 2])
def test_the_floor_knows_how_far_cycles_differ_where_they_repeat(cycles):
    """The residual of one cycle is 0.3 deg, that of the other -0.3: 0.3 sqrt(2) is their deviation with K - 1."""
    way = np.r_[np.linspace(-1, 1, 101), np.linspace(1, -1, 101)[1:]]
    drive = np.r_[way, *[way[1:]] * (cycles - 1)]
    cycle = np.r_[[1], np.repeat(np.arange(cycles), way.size - 1) + 1]
    record = Record(drive, 20 * drive, cycle=cycle)
    one = prepared(record, np.arange(drive.size))
    residual = np.where(cycle == 1, 0.3, -0.3)
    floor = estimate_noise_floor([one], [residual])
    if cycles == 1:
        assert floor.repeats_deg is None
    else:
        assert floor.repeats_deg == pytest.approx(np.hypot(0.3 * 2**0.5, one.drive_step_deg), rel=0.01)
