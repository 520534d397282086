"""Effects that are followed until their fit has converged, on rigs whose baseline has absorbed a good part of them."""

from validation.practice.draw import draw_case
from validation.tracing import trace_records
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Model, fit
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.search.candidates import candidates_with_one_more
from validation.tracing.search.search import Search
from validation.tracing.settings import KNOWN_RIG


def some(*names):
    return [effect for effect in catalogue() if effect.name in names]


def test_a_weight_whose_start_promised_to_be_near_is_followed_to_the_noise():
    """It was given up after its first steps, at an error of 0.46 deg; the noise is 0.06."""
    case = draw_case("score-10", "known", "gravity", 1)
    search = Search(known_rig_problem(case.records), KNOWN_RIG, some("gravity", "tip_load"), 1, lambda words: None)
    model = Model(search.problem)
    holdout = divide_records(search.problem.records)
    baseline = fit(model, holdout, model.coordinates(search.problem.start, []), threads=1)
    found = {one.names[-1]: one for one in candidates_with_one_more(search, baseline, None)}
    assert baseline.rmse_deg > 4 * case.truth.noise_deg
    assert found["gravity"].rmse_deg < 1.05 * case.truth.noise_deg


def test_the_gain_of_the_drive_is_named_with_what_does_the_same():
    """An implausible wheel led, and the verdict was `unexplained`."""
    case = draw_case("score-10", "known", "drive_gain", 2)
    trace = trace_records(case.records, threads=1, effects=some("drive_gain", "wheel_eccentricity"))
    assert "drive_gain" in {*trace.names, *(name for near in trace.confusable for name in near)}
