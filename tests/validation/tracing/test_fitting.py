"""Fits and what they are compared by: derivatives, noise floor, BIC, smooth functions, dependence, held-out records."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import LoadProgram, sine, triangle
from fem_models.rig import preset
from fem_models.rig.effects import Superelastic
from hysteresis.records.record import Record
from validation.tracing.baseline.known_rig import RigProblem, known_rig_problem
from validation.tracing.effect import FreeParameter
from validation.tracing.fitting import Fitted, Holdout, Model, fit
from validation.tracing.fitting.criterion import bic, independent_samples, lag_one_correlation
from validation.tracing.fitting.dependence import dependences
from validation.tracing.fitting.evidence import ranked_models
from validation.tracing.fitting.holdout import Protocol, _most_covered
from validation.tracing.fitting.least_squares import differentiate
from validation.tracing.fitting.noise import estimate_noise_floor
from validation.tracing.fitting.smooth import bases_of, smooth_functions
from validation.tracing.prepared import prepared
from validation.tracing.settings import CURVE, EQUIVALENT_RIG, KNOWN_RIG, POLICIES

NOISE_DEG = 0.05


def problem_of(program: LoadProgram) -> RigProblem:
    """Records of the default rig at two preloads from the chain model, with noise."""
    records = []
    for seed, preload in enumerate((20.0, 10.0)):
        run = simulate_chain(preset("du2018", preload_N=preload), program)
        angle = run.angle_deg + np.random.default_rng(seed).normal(0, NOISE_DEG, run.angle_deg.size)
        known = {"preset": "du2018", "preload_N": preload}
        records.append(Record(drive=run.drive, angle_deg=angle, time_s=run.time_s, cycle=run.cycle, rig=known))
    return known_rig_problem(records)


@cache
def fitted() -> Fitted:
    """The baseline after a few steps, fitted to all samples."""
    problem = problem_of(triangle(2.2, cycles=2))
    model, holdout = Model(problem), all_samples(problem)
    return fit(model, holdout, model.coordinates(problem.start, []), threads=1, most_steps=3)


def all_samples(problem: RigProblem) -> Holdout:
    return Holdout(tuple(np.ones(s.drive.size, bool) for s in problem.inputs), "all")


def test_the_record_whose_protocol_the_others_cover_is_held_out():
    slow, fast = 0.1, 1.0
    protocols = [Protocol(20, 2.2, slow), Protocol(10, 2.2, slow), Protocol(20, 2.2, fast), Protocol(20, 1.1, slow)]
    assert _most_covered(protocols) == 3


def test_offsets_are_means_of_training_samples_and_of_all_samples_of_a_held_out_record():
    train = np.arange(10) < 6
    holdout = Holdout((train, np.arange(10) < 1), "by hand", whole=frozenset({1}))
    errors = [np.where(train, 1.0, 5.0), np.arange(10.0)]
    assert [holdout.is_held_out(i) for i in (0, 1)] == [False, True]
    assert [holdout.offset_deg(i, e) for i, e in enumerate(errors)] == [1.0, 4.5]
    assert holdout.stacked(errors)[:10][~train].tolist() == [4.0] * 4
    assert holdout.train_mask.sum() == 7
    assert holdout.everything().train_mask.all()


def test_derivatives_and_repeated_cycles():
    """Derivatives against central differences of the model; repeated cycles against the whole run."""
    problem = problem_of(sine(2.2, 0.1, cycles=3, samples_per_cycle=40))
    (run,) = problem.runs[0]
    assert run.short is not None
    whole = run.solve(run.rig).record.angle_deg[run.skip :]
    assert np.abs(run.angle_deg(run.rig) - whole).max() < 1e-9
    heats = replace(run.rig, superelastic=Superelastic(heating_time_s=1.0))  # a memory for time
    assert run.load(heats) is run.program
    assert run.load(replace(run.rig, superelastic=Superelastic())) is run.short
    model, holdout = Model(problem), all_samples(problem)
    x = model.coordinates(problem.start, [])
    J = differentiate(model, holdout, x, holdout.stacked(model.errors(x)), 1)
    ahead, behind = (holdout.stacked(model.errors(x + s * np.eye(x.size)[0])) for s in (1e-3, -1e-3))
    central = (ahead - behind) / 2e-3
    assert np.linalg.norm(J[:, 0] - central) < 0.02 * np.linalg.norm(central)


def test_noise_floor_and_smooth_functions_of_a_known_residual():
    problem = fitted().model.problem
    rng = np.random.default_rng(3)
    white = [rng.normal(0, 0.04, o.size) for o in problem.observed]
    assert estimate_noise_floor(problem.records, white).deg == pytest.approx(0.04, rel=0.12)
    even = tuple(e - (0.3 * (s.drive / 2.2) ** 2 - 0.1) for e, s in zip(white, problem.inputs, strict=True))
    smooth = smooth_functions(replace(fitted(), errors=even), 400.0)
    assert smooth.names[0] == "an even function of the drive"
    columns = {name: basis.shape[1] for name, basis in bases_of(problem).items()}
    assert smooth.parameters == fitted().x.size + sum(columns[name] for name in smooth.names)


def test_noise_is_at_least_the_rounding_of_the_record():
    """Rounding to 0.1 deg has an error of 0.1/sqrt(12) deg; a residual without noise shows less."""
    run = simulate_chain(preset("du2018"), triangle(2.2, cycles=1))
    record = Record(drive=run.drive, angle_deg=np.round(run.angle_deg, 1), cycle=run.cycle)
    one = prepared(record, np.arange(run.drive.size))
    assert one.rounding_deg == pytest.approx(0.1 / np.sqrt(12))
    assert estimate_noise_floor([one], [np.zeros(run.drive.size)]).deg == pytest.approx(one.rounding_deg)


def test_branches_are_counted_in_each_trial():
    """Three trials that only load: the way back between them is no branch."""
    force, trial = np.tile(np.linspace(0.0, 3.0, 20), 3), np.repeat([1, 2, 3], 20)
    record = Record(drive=force, angle_deg=force, drive_unit="N", cycle=trial)
    assert prepared(record, np.arange(60)).branch_count == 3


def test_a_fit_computes_what_it_is_compared_by_once(monkeypatch):
    one = replace(fitted())
    calls = []

    def count(records, residuals):
        calls.append(records)
        return estimate_noise_floor(records, residuals)

    monkeypatch.setattr("validation.tracing.fitting.fitted.estimate_noise_floor", count)
    assert one.noise is one.noise
    assert len(calls) == 1
    assert one.noise == estimate_noise_floor(one.model.problem.records, one.residuals)
    branches = sum(record.branch_count for record in one.model.problem.records)
    assert one.samples == independent_samples(one.error_deg.size, lag_one_correlation(one.errors), branches)
    assert one.train_samples == one.samples  # all samples are fitted
    assert one.bic(100.0) == bic(one.mean_square, one.x.size, 100.0)
    assert one.train_rmse_deg == pytest.approx(one.rmse_deg)
    np.testing.assert_array_equal(one.residuals[1], -one.errors[1])  # measured less predicted


def test_models_are_ranked_by_the_criterion_with_the_best_form_of_each_effect():
    good = fitted()
    worse = replace(good, errors=tuple(2 * e for e in good.errors))
    assert ranked_models([worse, good]) == [good]
    assert ranked_models([]) == []


def test_dependence_of_white_noise_and_of_a_known_residual():
    """White noise depends on nothing (p is uniform); a square of the drive depends on the drive and is not white."""
    rng, chances = np.random.default_rng(5), []
    for _ in range(200):
        white = tuple(rng.normal(0.0, 0.1, e.size) for e in fitted().errors)
        errors = tuple(e - e.mean() for e in white)
        chances.append([one.p for one in dependences(replace(fitted(), errors=errors))])
    assert np.all(np.mean(np.array(chances) < 0.05, axis=0) < 0.12)
    assert np.all(np.mean(np.array(chances) < 0.5, axis=0) > 0.35)
    square = [s.drive**2 + 0.01 * rng.normal(size=s.drive.size) for s in fitted().model.problem.inputs]
    errors = tuple(e - e.mean() for e in square)
    found = {one.on: one for one in dependences(replace(fitted(), errors=errors))}
    assert found["drive"].part > 0.95
    assert found["drive"].p < 1e-6
    assert found["neighbours"].p < 1e-6
    assert found["direction"].part < 0.05


def test_criterion_and_coordinates():
    assert bic(1.0, 2, np.e) == pytest.approx(2.0)  # m log 1 + p log m
    assert independent_samples(1000, 0.0, 10) == 1000
    assert independent_samples(1000, 0.99, 10) == 80  # eight a branch
    for parameter in (FreeParameter("a", "-", 0, 1, 0.1), FreeParameter("b", "-", 1e-3, 10, 0.3, log=True)):
        assert parameter.from_unit(parameter.to_unit(0.25)) == pytest.approx(0.25)


def test_every_kind_of_baseline_has_its_search_policy():
    assert {name: policy.name for name, policy in POLICIES.items()} == {name: name for name in POLICIES}
    assert list(POLICIES.values()) == [KNOWN_RIG, EQUIVALENT_RIG, CURVE]
    assert KNOWN_RIG.finished >= EQUIVALENT_RIG.finished > CURVE.finished == 0  # a curve fits all candidates
    assert not CURVE.screened
