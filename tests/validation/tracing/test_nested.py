"""No model is worse than a model that it contains."""

from itertools import permutations

import numpy as np
import pytest

from validation.practice import draw_case
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Fitted, Model, fit
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.problem import AddedEffect
from validation.tracing.search.nested import at_nothing, contains, is_worse, no_worse_than_contained
from validation.tracing.search.search import Search
from validation.tracing.settings import KNOWN_RIG, NOTHING
from validation.tracing.trace import trace_records

from .test_channels import wrist


def effect(name):
    (found,) = [one for one in catalogue() if one.name == name]
    return found


def baseline_of(problem, steps=30) -> Fitted:
    model = Model(problem)
    start = model.coordinates(problem.start, [])
    return fit(model, divide_records(problem.records), start, threads=1, most_steps=steps)


def test_a_larger_model_that_ended_in_a_worse_optimum_is_fitted_again():
    """As on the measured wrists: from a closure at a third of the real angle, plateau and closure ended 96 BIC above
    the plateau alone."""
    problem = known_rig_problem([wrist()])
    search = Search(problem, KNOWN_RIG, catalogue(), 1, lambda *_: None)
    baseline = baseline_of(problem)
    plateau, closure = effect("superelastic_plateau"), effect("notch_closure")
    (form,), (contact,) = problem.forms(plateau), problem.forms(closure)
    from_baseline = baseline.model.values(baseline.x)[0]
    starts = problem.starts(form)
    first = Model(problem, (AddedEffect(plateau, form),))
    smaller = min(
        (fit(first, baseline.holdout, first.coordinates({**from_baseline, **v}, [v]), threads=1) for v in starts[-2:]),
        key=lambda one: one.square,
    )
    both = Model(problem, (AddedEffect(plateau, form), AddedEffect(closure, contact)))
    early = both.coordinates(from_baseline, [starts[0], {"angle_deg": 6.0, "stiffness_Nmm_per_rad": 3e3}])
    missed = fit(both, baseline.holdout, early, threads=1, most_steps=3)
    assert contains(missed, smaller)
    assert is_worse(missed, smaller)
    assert missed.bic(smaller.samples) > smaller.bic(smaller.samples) + 96
    (again,) = no_worse_than_contained(search, [missed], [smaller])
    assert not is_worse(again, smaller)
    assert set(again.names) == set(missed.names)


def test_no_candidate_of_a_trace_is_worse_than_one_that_it_contains():
    tried = ("camera_misalignment", "notch_closure", "superelastic_plateau", "tip_contact")
    trace = trace_records([wrist()], threads=1, effects=[e for e in catalogue() if e.name in tried])
    models = [trace.baseline, *(c.fitted for c in trace.candidates)]
    pairs = [(a, b) for a, b in permutations(models, 2) if contains(a, b)]
    assert len(pairs) >= 4
    assert not any(is_worse(a, b) for a, b in pairs)


@pytest.fixture(scope="module")
def rig_fit() -> Fitted:
    return baseline_of(known_rig_problem(draw_case("work", "known", "backlash", 3).records), steps=2)


@pytest.mark.parametrize("name", [one.name for one in catalogue()])
def test_every_effect_of_a_rig_can_be_nothing(rig_fit, name):
    """Where it is, the larger model has the errors of the smaller one."""
    problem = rig_fit.model.problem
    for form in problem.forms(effect(name)):
        model = Model(problem, (AddedEffect(effect(name), form),))
        x = at_nothing(model, rig_fit, problem.starts(form)[0])
        assert x is not None, [p.name for p in form.parameters]
        change = rig_fit.holdout.stacked(model.errors(x)) - rig_fit.rows.errors
        assert np.linalg.norm(change) <= NOTHING * np.linalg.norm(rig_fit.rows.errors)
