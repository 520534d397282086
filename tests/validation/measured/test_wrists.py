"""The model against measured wrists: figures of docs/validation/wrists.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fem_models.load_control import run_load_control
from fem_models.rig.presets import preset
from validation.measured.wrists import (
    FULL,
    STAGES,
    TARGET_DEG,
    TRAINING,
    TUBES,
    Fit,
    Trials,
    error,
    figure,
    fit,
    fit_constants,
    predict,
    read_trials,
    repeatability,
    rest_deg,
    wrist,
)


@pytest.fixture(scope="module")
def trials(measured: Path) -> dict[str, Trials]:
    return {tube: read_trials(measured, tube) for tube in TUBES}


@pytest.fixture(scope="module")
def fits(trials: dict[str, Trials]) -> dict[str, list[Fit]]:
    return {
        own: [fit(stage, trials[own], trials[other]) for stage in STAGES]
        for own, other in zip(TUBES, TUBES[::-1], strict=True)
    }


def made(tube: str, values: dict[str, float]) -> Trials:
    """Trials that the model itself would give."""
    force = np.linspace(0.0, 1.7, 15)
    notches = predict(wrist(tube, FULL, values, 1.5), force)
    return Trials(tube, force, notches, notches.sum(axis=1), np.ones(15, dtype=np.int64))


def test_constants_of_a_made_wrist_are_found_again():
    values = {"E_GPa": 18.0, "plateau_MPa": 300.0, "plateau_modulus_GPa": 2.5, "mu": 0.15}
    found = fit_constants(FULL, made("90", values), 1.5)
    assert found == pytest.approx(values, rel=0.02)


def test_each_tube_keeps_trials_out_of_its_fit(trials):
    for tube in TUBES:
        assert set(TRAINING[tube]) < set(trials[tube].numbers)
    assert [len(trials[t].numbers) for t in TUBES] == [5, 3]


def test_the_tip_is_within_the_target_on_trials_and_tubes_not_seen(fits):
    for tube in TUBES:
        full = fits[tube][-1]
        assert full.heldout.tip_deg <= TARGET_DEG
        assert full.other_tube.tip_deg <= TARGET_DEG
        assert full.heldout.notches_deg <= 1.0
        assert full.other_tube.notches_deg <= 1.5


def test_the_steps_gain_what_the_page_says(fits):
    for tube in TUBES:
        linear, superelastic, friction, closure = fits[tube]
        assert superelastic.heldout.tip_deg < 0.7 * linear.heldout.tip_deg
        assert friction.heldout.notches_deg < 0.8 * superelastic.heldout.notches_deg
        assert closure.heldout.notches_deg < 0.85 * friction.heldout.notches_deg
        assert closure.heldout.tip_deg < friction.heldout.tip_deg
        assert closure.other_tube.tip_deg < 0.5 * linear.other_tube.tip_deg
    # where the notches of the other tube go far past their closure; the other way round the last step gains nothing
    assert fits["90"][-1].other_tube.tip_deg < 0.7 * fits["90"][-2].other_tube.tip_deg


def test_constants_of_the_two_tubes_are_those_of_one_metal(fits):
    ninety, other = (fits[tube][-1].values for tube in TUBES)
    assert ninety["E_GPa"] == pytest.approx(other["E_GPa"], rel=0.05)
    assert ninety["plateau_MPa"] == pytest.approx(other["plateau_MPa"], rel=0.05)
    assert 0.1 <= ninety["mu"] <= 0.3  # the authors' range of the friction
    assert 0.1 <= other["mu"] <= 0.3


def test_presets_carry_the_constants_of_the_other_tube(fits, trials):
    for own, other in zip(TUBES, TUBES[::-1], strict=True):
        rig, values = preset(f"notched-wrist-{own}"), fits[other][-1].values
        assert rig.material.youngs_modulus_GPa == pytest.approx(values["E_GPa"], rel=0.02)
        assert rig.superelastic.plateau_MPa == pytest.approx(values["plateau_MPa"], rel=0.02)
        assert rig.superelastic.plateau_modulus_GPa == pytest.approx(values["plateau_modulus_GPa"], rel=0.02)
        assert rig.friction.capstan_coefficient == pytest.approx(values["mu"], rel=0.02)
        assert rig.precurvature_deg == pytest.approx(rest_deg(trials[own].only(TRAINING[own])), abs=0.01)
        assert error(rig, trials[own]).tip_deg <= TARGET_DEG


def test_no_model_can_go_far_below_the_spread_of_the_trials(trials, fits):
    for tube in TUBES:
        assert repeatability(trials[tube]).tip_deg > 0.5 * fits[tube][-1].heldout.tip_deg


def test_both_engines_say_the_same_of_a_measured_wrist(trials):
    for tube in TUBES:
        rig, force = preset(f"notched-wrist-{tube}"), np.unique(trials[tube].force_N)[::6]
        chain, multibody = run_load_control(rig, force), run_load_control(rig, force, "multibody")
        assert np.abs(chain.notches_deg - multibody.notches_deg).max() <= 0.1


def test_the_figure_is_drawn(trials, fits, tmp_path: Path):
    path = tmp_path / "images" / "wrists.png"
    figure(trials, [f for tube in TUBES for f in fits[tube]], path)
    assert path.stat().st_size > 10_000
    assert [p.name for p in path.parent.iterdir()] == ["wrists.png"]
