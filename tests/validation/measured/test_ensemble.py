"""The ensemble of du2018: constants that follow from facts, weights of draws, members, and rigs with a known answer."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import simulate_chain
from fem_models.load import triangle
from fem_models.rig import ensemble, preset
from fem_models.rig.ensemble import ensemble_file, with_constants
from hysteresis.records.metrics import loop_width
from validation.measured.ensemble.draws import Density, draw, weighted_quantiles
from validation.measured.ensemble.facts import PAPER, Facts, facts_as, facts_of, loop_numbers
from validation.measured.ensemble.make import Settings, apportioned, make_ensemble
from validation.measured.ensemble.members import extend
from validation.measured.ensemble.priors import MODELS, Model, Prior
from validation.measured.ensemble.solve import solve_constants
from validation.measured.preset_du2018 import READING
from validation.measured.readings.paper_table import FACTORS

RIG = preset("du2018")
MODEL = MODELS["Jenkins loop, toe"]
OF_RIG = {"tendon.EA_N": 17_000.0, "tendon.toe_N": 37.2, "friction.sheath_N": 3.49}


def around(factor: float, **drawn: Prior) -> Model:
    """Solved constants within a factor of the preset's, and others as given."""
    solved = {name: Prior(value / factor, value * factor, True, "a test") for name, value in OF_RIG.items()}
    return Model({**drawn, **solved}, {}, tuple(OF_RIG))


SMALL = around(
    3.0,
    **{
        "material.loop_share": Prior(0.1, 0.7, False, "a test"),
        "tendon.moment_arm_mm": Prior(2.5, 2.7, False, "a test"),
    },
)


def test_every_shipped_member_meets_the_facts_of_the_paper():
    made = tomllib.loads(ensemble_file("du2018").with_suffix(".toml").read_text(encoding="utf-8"))
    reading = made["reading"].removesuffix(" widths")
    paper = facts_as(reading)
    assert all(paper.met_by(facts_of(rig), 0.005 * FACTORS[reading]) for rig in ensemble("du2018"))


def test_preset_meets_the_facts_of_the_paper_with_half_widths():
    assert READING == "half"
    assert facts_as("half") == PAPER
    assert PAPER.met_by(facts_of(RIG))
    assert facts_as("full").widths_deg == (3.52, 2.21)


@pytest.mark.parametrize("amplitude", [1.1, 2.2])
def test_loop_numbers_are_those_of_the_metrics(amplitude):
    record = simulate_chain(RIG, triangle(amplitude))
    width = loop_width(record.drive, record.angle_deg, record.cycle)
    found = loop_numbers(RIG, amplitude)
    assert found.width_deg == pytest.approx(width.max_deg, rel=1e-12)
    assert abs(found.widest_at_mm) == pytest.approx(abs(width.at_drive))
    assert found.full_scale_deg == np.abs(record.angle_deg).max()


def test_solved_constants_are_those_of_the_rig_that_the_facts_are_of():
    chosen = {
        "tendon.moment_arm_mm": 2.58,
        "material.loop_share": 0.4,
    }
    found = solve_constants(RIG, chosen, SMALL, facts_of(RIG))
    assert found is not None
    assert found.constants == pytest.approx(OF_RIG, rel=2e-3)


def test_no_rig_shows_numbers_that_cannot_be():
    assert solve_constants(RIG, {}, around(3.0), Facts(60.0, PAPER.widths_deg, (0.0, 0.0))) is None


def test_density_of_the_numbers_is_that_of_rigs_drawn_from_the_prior():
    """The density by the determinant against a count of draws of all constants within a small box of the numbers."""
    model, half = around(1.5), np.array([0.25, 0.4, 0.26])
    goal = facts_of(RIG)
    rng, names = np.random.default_rng(3), list(OF_RIG)
    draws = np.exp(rng.uniform(-1, 1, (1500, 3)) * np.log(1.5)) * list(OF_RIG.values())
    rigs = [with_constants(RIG, dict(zip(names, row, strict=True))) for row in draws]
    with ThreadPoolExecutor(2) as pool:
        numbers = np.array([one.numbers for one in pool.map(lambda rig: facts_of(rig, 0.2), rigs)])
    inside = int((np.abs(numbers - goal.numbers) <= half).all(axis=1).sum())
    found = solve_constants(RIG, {}, model, goal)
    density = np.exp(sum(model.priors[n].log_density_per_log(v) for n, v in found.constants.items()))
    expected = density / found.determinant * np.prod(2 * half)
    assert inside > 50
    assert inside / 1500 == pytest.approx(expected, rel=3 / np.sqrt(inside) + 0.05)


def test_draws_repeat_for_a_seed_whatever_the_workers():
    alone = draw(RIG, SMALL, 16, 5)
    with ThreadPoolExecutor(2) as pool:
        together = draw(RIG, SMALL, 16, 5, mapper=pool.map)
    np.testing.assert_array_equal(alone.rows, together.rows)
    assert not np.array_equal(draw(RIG, SMALL, 16, 6).quantiles, alone.quantiles)


@pytest.mark.slow
def test_hidden_rigs_lie_within_their_ranges():
    """Five hidden rigs, drawn from the priors: 25 constants, each within its 90 % range as often as that says."""
    rng, inside = np.random.default_rng(8), []
    for _ in range(5):
        hidden = {name: float(prior.at(rng.random())) for name, prior in SMALL.priors.items()}
        goal = facts_of(with_constants(RIG, hidden))
        goal = replace(goal, full_scale_deg=goal.full_scale_deg + rng.uniform(-0.5, 0.5))
        found = draw(RIG, SMALL, 64, 1, goal=goal)
        for name, value in hidden.items():
            low, high = weighted_quantiles(found.column(name), found.weight, (0.05, 0.95))
            inside.append(low <= value <= high)
    assert np.mean(inside) >= 0.72  # 25 values of which 90 % should be: fewer than 18 have a chance of 0.2 %


def test_members_repeat_for_a_seed_and_meet_the_facts(monkeypatch):
    pytest.importorskip("emcee")
    monkeypatch.setattr("validation.measured.ensemble.members.STEPS", 6)
    draws = draw(RIG, SMALL, 16, 5)
    members, moved = extend(RIG, SMALL, draws, 10, 7)
    assert 0.1 < moved < 0.9
    assert all(PAPER.met_by(facts_of(with_constants(RIG, one.constants))) for one in members)
    with ThreadPoolExecutor(2) as pool:
        assert extend(RIG, SMALL, draws, 10, 7, pool=pool) == (members, moved)


def test_a_model_of_too_few_effective_draws_has_no_members():
    with pytest.raises(ValueError, match="no model has 5 effective draws"):
        make_ensemble(RIG, {"small": SMALL}, Settings(seed=5, draws=4, members=10))


def test_density_beyond_the_priors_is_none():
    density = Density(RIG, SMALL)
    assert density(np.array([0.5, 1.01, 0.5]))[0] == -np.inf
    assert len(density(np.full(3, 0.5))) == len(density.columns)


def test_members_are_apportioned_by_odds():
    assert apportioned([0.5, 0.3, 0.2], 10) == [5, 3, 2]
    assert apportioned([0.55, 0.449, 0.001], 10) == [6, 4, 0]


@pytest.mark.parametrize("k", [5, 100, 160, 199])
def test_members_of_all_models_agree_between_the_engines(k):
    """Toe region, toe and play, and play twice, at 10 N, where the play is widest: 0.1 deg, as twins."""
    pytest.importorskip("exudyn", reason="Exudyn cannot be imported here: its library libGL.so.1 is missing?")
    from fem_models.multibody import simulate_multibody

    rig = ensemble("du2018", preload_N=10.0)[k]
    chain, bodies = (engine(rig, triangle(2.2)).angle_deg for engine in (simulate_chain, simulate_multibody))
    assert np.abs(chain - bodies).max() < 0.1
