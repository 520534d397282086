"""Effects that are followed until their fit has converged, on rigs whose baseline has absorbed a good part of them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.rig import preset
from fem_models.rig.effects import Gravity
from hysteresis.records.path import cycle_index
from hysteresis.records.record import Record
from validation.practice.draw import draw_case
from validation.tracing import trace_records
from validation.tracing.baseline.equivalent_rig import equivalent_rig_problem
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Model, fit
from validation.tracing.fitting.evidence import rests_early
from validation.tracing.fitting.fitted import Rows
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.search.candidates import candidates_with_one_more
from validation.tracing.search.restarts import best_of_restarts
from validation.tracing.search.search import Search
from validation.tracing.search.starts import every_start
from validation.tracing.settings import EARLY_STEPS, EQUIVALENT_RIG, KNOWN_RIG, MOST_STEPS


def some(*names):
    return [effect for effect in catalogue() if effect.name in names]


@pytest.mark.slow
def test_a_weight_that_is_near_by_its_linearised_gain_is_followed_to_the_noise():
    """It was given up after its first steps, at an error of 0.46 deg; the noise is 0.06."""
    case = draw_case("score-10", "known", "gravity", 1)
    search = Search(known_rig_problem(case.records), KNOWN_RIG, some("gravity", "tip_load"), 1, lambda *_: None)
    model = Model(search.problem)
    holdout = divide_records(search.problem.records)
    baseline = fit(model, holdout, model.coordinates(search.problem.start, []), threads=1)
    found = {one.names[-1]: one for one in candidates_with_one_more(search, baseline, None)}
    assert baseline.rmse_deg > 4 * case.truth.noise_deg
    assert found["gravity"].rmse_deg < 1.05 * case.truth.noise_deg


def hanging(preload_N, seed):
    """A record of a rig whose rings of 38 g pull at its base, along the tube."""
    rig = replace(preset("du2018-full-widths", preload_N=preload_N), gravity=Gravity(37.7, 180.0))
    run = simulate_chain(rig, sine(1.5, 0.1, cycles=2, samples_per_cycle=60))
    noise = np.random.default_rng(seed).normal(0, 0.03, run.angle_deg.size)
    known = {"preset": "du2018-full-widths", "preload_N": preload_N}
    return Record(run.drive, run.angle_deg + noise, time_s=run.time_s, cycle=run.cycle, rig=known)


@pytest.mark.slow
def test_a_weight_is_found_beside_a_baseline_whose_derivatives_predict_a_far_smaller_residual():
    """The fit of the weight ended there, too, and a load at the tip was named at 1.16 times the noise."""
    records = [hanging(preload_N, seed) for seed, preload_N in enumerate((20.0, 10.0))]
    trace = trace_records(records, threads=1, effects=some("gravity", "tip_load"))
    assert rests_early(trace.baseline)
    assert trace.names == ("gravity",)
    mass, direction = trace.augmented.model.values(trace.augmented.x)[1][0].values()
    assert (mass, direction) == (pytest.approx(-37.7, abs=0.5), pytest.approx(0.0, abs=0.5))  # along, across


def test_a_fit_rests_early_below_half_of_its_residual():
    """The rms that the derivatives leave over the one that is left: 0, then just above and below a half, then 1."""
    ones, twos = np.ones(4), np.array([1.0, -1.0, 1.0, -1.0])
    for left, early in ((0.0, True), (0.577, True), (0.578, False), (1e9, False)):
        rows = Rows(ones + left * twos, np.ones((4, 1)), np.ones(4, dtype=bool))
        assert rests_early(SimpleNamespace(rows=rows)) is early


@pytest.mark.slow
def test_the_gain_of_the_drive_is_named_with_what_does_the_same():
    """An implausible wheel led, and the verdict was `unexplained`."""
    case = draw_case("score-10", "known", "drive_gain", 2)
    trace = trace_records(case.records, threads=1, effects=some("drive_gain", "wheel_eccentricity"))
    assert "drive_gain" in {*trace.names, *(name for near in trace.confusable for name in near)}


def beside_an_early_baseline(case, *names):
    """Search of records of unknown geometry, as a trace begins it, and its baseline."""
    problem = equivalent_rig_problem(
        [r if r.cycle is not None else replace(r, cycle=cycle_index(r)) for r in case.records]
    )
    model, holdout = Model(problem), divide_records(problem.records).everything()
    early = fit(model, holdout, model.coordinates(problem.start, []), threads=1, most_steps=EARLY_STEPS)
    baseline = fit(model, holdout, early.x, threads=1, most_steps=MOST_STEPS)
    return Search(problem, EQUIVALENT_RIG, some(*names), 1, lambda *_: None, early=early), baseline


@pytest.mark.slow
@pytest.mark.parametrize(
    ("set_name", "effect", "left"),
    [
        ("score-21", "tendon_slack", 2.4),
        ("score-29", "tendon_slack", 2.8),  # from everywhere, until the toe region of its own fit was taken out
        pytest.param("score-21", "tip_load", 1.9, marks=pytest.mark.slow),
    ],
)
def test_effects_of_unknown_rigs_come_to_the_noise_from_starts_far_from_the_baseline(set_name, effect, left):
    """Slack ended beside a toe region that takes its place, a load at the tip at a fifth of its size."""
    case = draw_case(set_name, "unknown", effect, 0)
    search, baseline = beside_an_early_baseline(case, effect)
    assert baseline.rmse_deg > left * case.truth.noise_deg  # what slack and a small load left, too
    found = min(candidates_with_one_more(search, baseline, None), key=lambda one: one.square)
    assert found.rmse_deg < 1.15 * case.truth.noise_deg


@pytest.mark.slow
def test_a_play_is_fitted_again_beside_the_start_of_the_baseline():
    """It was left at 1.02 times the noise, its width at 0.14 mm, and the weight of the rings was named."""
    case = draw_case("score-29", "unknown", "preloaded_play", 0)
    search, baseline = beside_an_early_baseline(case, "preloaded_play")
    found = min(candidates_with_one_more(search, baseline, None), key=lambda one: one.square)
    again = best_of_restarts(search, found)
    assert again.square < 0.97 * found.square
    width = again.model.values(again.x)[1][0]["free_width_mm"]
    assert width == pytest.approx(case.truth.numbers["preloaded_play"]["free_width_mm"], rel=0.05)


def test_every_start_of_an_effect_may_name_parameters_of_the_baseline():
    case = draw_case("score-21", "unknown", "tendon_slack", 0)
    search, _ = beside_an_early_baseline(case, "tendon_slack")
    (effect,) = search.effects
    own = search.early.model.values(search.early.x)[0]
    toes = list[float]()
    for one in every_start(search.early, effect, search.forms(effect)):
        model = Model(search.problem, (one.added,))
        values = [model.values(x) for x in one.starts]
        toes += [baseline["toe_N"] for baseline, _ in values]
        assert all({**baseline, "toe_N": own["toe_N"]} == pytest.approx(own) for baseline, _ in values)
        assert all(added[0]["slack_mm"] > 0 for _, added in values)
    assert sorted(set(np.round(toes, 6))) == pytest.approx([0.025 * 20.0, own["toe_N"]], rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("set_name", "label"),
    [
        ("score-21", "tendon_stiffening"),  # `unexplained` at 6.8 times the noise: its gain was the ninth
        ("score-21", "tip_load"),
        ("work", "gravity"),  # ended at twice the noise beside a baseline that had absorbed it
        ("work", "preloaded_play"),
    ],
)  # fmt: skip
def test_what_unknown_rigs_have_is_in_the_set(set_name, label):
    trace = trace_records(draw_case(set_name, "unknown", label, 0).records, threads=2)
    assert label in {*trace.names[:1], *trace.confusable[0][:2]}
