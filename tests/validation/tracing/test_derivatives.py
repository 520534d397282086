"""Derivatives of rigs, every form of every effect, against central differences of full runs."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import solve
from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.load_control import run_load_control
from fem_models.rig import preset
from hysteresis.records.record import Record
from validation.tracing.baseline import rig_problem
from validation.tracing.baseline.equivalent_rig import equivalent_rig_problem, refined_problem
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Holdout, Model
from validation.tracing.fitting.least_squares import differentiate, fit
from validation.tracing.problem import AddedEffect

WITHIN = 0.02
KNOWN = {"preset": "du2018"}
STEP = 1e-4  # of the central differences: the narrower, the fewer contacts begin or end between them


def driven(preload_N, rate_Hz=0.1):
    """Two cycles of the default rig; the second one repeats the first."""
    run = simulate_chain(preset("du2018", preload_N=preload_N), sine(2.0, rate_Hz, cycles=2, samples_per_cycle=36))
    return replace(run, rig={**KNOWN, "preload_N": preload_N})


def wrist():
    """Two trials of a wrist under a tendon force, the notch angles among the channels."""
    force = np.linspace(0.0, 1.6, 12)
    run = run_load_control(preset("notched-wrist-90"), force)
    notches = np.tile(run.notches_deg, (2, 1))
    return Record(
        drive=np.tile(force, 2), angle_deg=notches.sum(axis=1), drive_unit="N", notches_deg=notches,
        cycle=np.repeat([1, 2], force.size), tube={"outer_diameter_mm": 1.62, "inner_diameter_mm": 1.40},
        notch={"shape": "rectangular", "count": 5, "depth_mm": 1.40, "width_mm": 0.5, "spacing_mm": 1.5},
    )  # fmt: skip


def differences(model, holdout, x):
    def errors(at):
        return holdout.stacked(model.errors(at))

    return np.column_stack([(errors(x + u) - errors(x - u)) / (2 * STEP) for u in STEP * np.eye(x.size)])


def models_of(problem):
    """The baseline, and every form of every effect beside it, at a starting point away from its bounds."""
    yield Model(problem), []
    for effect in catalogue():
        for form in problem.forms(effect):
            yield Model(problem, (AddedEffect(effect, form),)), [problem.starts(form)[-1]]


@pytest.mark.parametrize(
    "problem",
    [
        pytest.param(known_rig_problem([driven(10.0), driven(20.0, 0.5)]), marks=pytest.mark.slow),
        known_rig_problem([wrist()]),
        equivalent_rig_problem([driven(20.0)], 60),
    ],
    ids=["two preloads", "load control", "equivalent rig"],
)
def test_every_column_against_central_differences_of_full_runs(problem):
    holdout = Holdout(tuple(np.ones(one.kept.size, dtype=bool) for one in problem.records), "nothing")
    own = len(problem.parameters)
    for model, values in models_of(problem):
        low, high = model.bounds()
        x = np.clip(model.coordinates(problem.start, values), low + 0.01, high - 0.01)
        full = differences(model, holdout, x)
        found = differentiate(model, holdout, x, holdout.stacked(model.errors(x)), 2)
        for i in range(own if values else 0, x.size):
            size = max(np.linalg.norm(full[:, i]), 1e-3)
            assert np.linalg.norm(found[:, i] - full[:, i]) < WITHIN * size, (model.names, model.parameters[i].name)


def test_a_column_of_the_reading_alone_needs_no_run_and_threads_change_nothing(monkeypatch):
    problem = known_rig_problem([driven(20.0)])
    camera = next(effect for effect in catalogue() if effect.name == "camera_misalignment")
    form = problem.forms(camera)[0]
    model = Model(problem, (AddedEffect(camera, form),))
    holdout = Holdout((np.ones(problem.records[0].kept.size, dtype=bool),), "nothing")
    x = model.coordinates(problem.start, [problem.starts(form)[0]])
    errors = holdout.stacked(model.errors(x))
    one, two = (differentiate(model, holdout, x, errors, threads) for threads in (1, 2))
    assert (one == two).all()
    runs, real = [], rig_problem.moved_run
    monkeypatch.setattr(rig_problem, "moved_run", lambda *of: runs.append(of) or real(*of))
    again = differentiate(model, holdout, x, errors, 1)
    assert (again == one).all()
    assert len(runs) == len(problem.parameters)


def each_with_a_rig_of_its_own(problem):
    """The same problem, its runs' rigs equal but not one object."""
    runs = tuple(tuple(replace(run, rig=replace(run.rig)) for run in of_record) for of_record in problem.runs)
    return replace(problem, setup=replace(problem.setup, runs=runs))


@pytest.mark.parametrize(
    ("shared", "objects"),
    [
        (known_rig_problem([driven(20.0), driven(10.0), driven(20.0, 0.5)]), [2, 3]),
        (equivalent_rig_problem([driven(20.0), driven(10.0), driven(20.0, 0.5)], 60), [2, 3]),
        (refined_problem(equivalent_rig_problem([driven(20.0), driven(20.0, 0.5)], 60)), [1, 2]),
        (known_rig_problem([wrist()]), [1, 2]),
    ],
    ids=["known", "equivalent", "refined", "load control"],
)
def test_records_of_one_rig_share_what_is_derived_of_it_and_no_digit_changes(shared, objects, monkeypatch):
    apart = each_with_a_rig_of_its_own(shared)
    rigs = [{id(run.rig) for runs in problem.runs for run in runs} for problem in (shared, apart)]
    assert [len(ids) for ids in rigs] == objects
    made, real = [], solve.chain_parameters
    monkeypatch.setattr(solve, "chain_parameters", lambda *of, **how: made.append(of) or real(*of, **how))
    for names in ([], ["tendon_creep"], ["preload_loss"], ["backlash"]):
        effects = [effect for effect in catalogue() if effect.name in names and shared.forms(effect)]
        forms = [shared.forms(effect)[0] for effect in effects]
        found, counts = [], []
        for problem, threads in ((shared, 1), (apart, 1), (shared, 2)):
            added = tuple(AddedEffect(effect, form) for effect, form in zip(effects, forms, strict=True))
            model = Model(problem, added)
            x = model.coordinates(problem.start, [problem.starts(form)[-1] for form in forms])
            made.clear()
            errors, followed = model.followed(x, threads)
            moved = model.moved_errors(followed, list(x + STEP * np.eye(x.size)), threads)
            counts.append(len(made))
            found.append(np.array([np.concatenate(one) for one in [errors, *moved]]))
        np.testing.assert_array_equal(*found[:2])
        np.testing.assert_array_equal(found[0], found[2])
        assert counts[0] < counts[1] * 0.8


def test_the_records_of_a_model_run_in_the_threads_of_its_fit(monkeypatch):
    problem = known_rig_problem([driven(20.0), driven(10.0)])
    model, asked = Model(problem), []
    holdout = Holdout(tuple(np.ones(one.kept.size, dtype=bool) for one in problem.records), "nothing")

    def counting(function, items, threads):
        asked.append((len(items), threads))
        return [function(item) for item in items]

    monkeypatch.setattr(rig_problem, "in_threads", counting)
    fit(model, holdout, model.coordinates(problem.start, []), threads=3, most_steps=1)
    assert asked == [(2, 3)] * 2  # the errors, and their derivatives
    asked.clear()
    model.errors(model.coordinates(problem.start, []))
    assert asked == [(2, 1)]
