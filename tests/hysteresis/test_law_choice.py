"""The law is chosen within the training samples, and the layer is reported in a form that data can fix."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hysteresis import Fit, identify
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.laws.inverse import compensating_drive
from hysteresis.laws.stops import follow_stops
from hysteresis.records.folds import inner_folds, without_first_stroke
from hysteresis.records.holdout import hold_out
from hysteresis.records.record import Record

TURNS = (0, 2.2, -2.2, 1.8, -1.8, 1.4, -1.4, 1.0, -1.0, 0.7, -0.7, 0.5)
DRIVE = np.concatenate([*(np.linspace(a, b, 40, endpoint=False) for a, b in pairwise(TURNS)), [0.5]])
AUTO = IdentifySettings(law="auto", generations=30)


def kinematics(drive: np.ndarray) -> np.ndarray:
    return 15.0 * np.asarray(drive)


def record_of(h: np.ndarray) -> Record:
    noise = 0.02 * np.random.default_rng(5).standard_normal(len(DRIVE))
    return Record(drive=DRIVE, angle_deg=kinematics(DRIVE) + h + noise, title="bench")


@pytest.fixture(scope="module")
def plays_fit() -> Fit:
    row = np.array([[-0.9, 2.0, 0.5, 0.2, 0.0, 0.0, 0.0]])
    return identify(record_of(follow_stops(kinematics(DRIVE), row, 0.0, 1.0)[0]), kinematics, settings=AUTO)


def test_plays_are_told_from_bouc_wen(plays_fit: Fit) -> None:
    assert plays_fit.form.base_law.name == "prandtl-ishlinskii"
    assert plays_fit.heldout.rmse_deg == pytest.approx(0.02, rel=0.3)  # the noise
    assert plays_fit.bouc_wen is not None
    assert plays_fit.bouc_wen.heldout.rmse_deg > 2 * plays_fit.heldout.rmse_deg
    saturation = plays_fit.layer["saturation_deg"]
    assert saturation.low < 2.0 < saturation.high


def test_another_law_stands_beside_the_contract(plays_fit: Fit) -> None:
    data = json.loads(json.dumps(plays_fit.to_dict(), allow_nan=False))
    assert data["model"] == "bouc-wen"
    assert {"A", "beta", "gamma", "n"} <= set(data["parameters"])
    assert data["law"]["name"] == "prandtl-ishlinskii"
    assert {"A", "chi", "largest_threshold_deg", "share_at_largest"} <= set(data["law"]["parameters"])
    choice = data["law"]["choice"]
    assert choice["reason"].startswith("Prandtl-Ishlinskii: it ")
    assert len(choice["candidates"]) == 5
    assert "law: Prandtl-Ishlinskii" in str(plays_fit)


def test_a_wider_law_fits_the_training_samples_at_least_as_well(plays_fit: Fit) -> None:
    assert plays_fit.choice is not None
    errors = {c.title: c.train_rmse_deg for c in plays_fit.choice.candidates}
    for wide, inner in (
        ("asymmetric Bouc-Wen", "Bouc-Wen"),
        ("generalised Prandtl-Ishlinskii", "Prandtl-Ishlinskii"),
    ):
        assert errors[wide] <= errors[inner] * (1 + 1e-3)


def test_compensation_follows_through_the_chosen_law(plays_fit: Fit) -> None:
    wanted = 12 * np.sin(np.linspace(0, 9, 60))
    drive = compensating_drive(plays_fit, wanted, 0.0)
    path = np.append(0.0, drive)
    np.testing.assert_allclose(plays_fit.predict(path)[1:], wanted, atol=1e-9)


def test_the_heldout_angles_take_no_part_in_the_choice(plays_fit: Fit) -> None:
    record = plays_fit.observed[0]
    spoilt = replace(record, angle_deg=record.angle_deg + 20 * hold_out(record).heldout)
    other = identify(spoilt, kinematics, settings=AUTO)
    assert other.choice is not None
    assert plays_fit.choice is not None
    assert [c.inner_rmse_deg for c in other.choice.candidates] == [
        c.inner_rmse_deg for c in plays_fit.choice.candidates
    ]
    for fold in inner_folds(record, hold_out(record)):
        assert not (fold.heldout & hold_out(record).heldout).any()
        assert not (fold.train & (fold.heldout | hold_out(record).heldout)).any()


def test_bouc_wen_is_chosen_where_it_is_the_law() -> None:
    h = hysteresis(kinematics(DRIVE), BoucWen(-0.9, 0.5, 0.2, 1.3))
    fit = identify(record_of(h), kinematics, settings=AUTO)
    assert fit.form.base_law.name == "bouc-wen"
    assert fit.choice is not None
    assert fit.choice.chosen.title == "Bouc-Wen"
    true = (0.9 / 0.7) ** (1 / 1.3)
    assert fit.layer["saturation_deg"].low < true < fit.layer["saturation_deg"].high
    assert fit.layer["n"].low < 1.3 < fit.layer["n"].high
    assert fit.layer["asymmetry"].low < 0 < fit.layer["asymmetry"].high


def test_slope_and_reach_are_those_of_the_closed_form() -> None:
    """n = 1, gamma = beta: kappa = 0, so h is straight to 0 and then 1 - exp(-s); without noise."""
    law = BoucWen(-0.8, 0.25, 0.25, 1.0)
    fit = identify(Record(drive=DRIVE, angle_deg=kinematics(DRIVE) + hysteresis(kinematics(DRIVE), law)), kinematics)
    s = law.saturation_deg
    assert fit.layer["slope_after_reversal"].value == pytest.approx(-0.8, rel=1e-4)
    assert fit.layer["reach_deg"].value == pytest.approx((1 + np.log(5)) * s / 0.8, rel=1e-4)  # y = 0.8 after 90 %


def test_unequal_directions_are_found() -> None:
    fit = identify(
        record_of(0.5 * hysteresis(kinematics(DRIVE), BoucWen(-0.9, 0.5, 0.2, 1.3))),
        kinematics,
        settings=IdentifySettings(law="asymmetric-bouc-wen", generations=9),
    )
    assert fit.form.base_law.name == "asymmetric-bouc-wen"
    values = fit.form.values(fit.point.q[np.newaxis], 0)
    values[0, 0, 4] = 0.3
    lopsided = fit.form.base_law.follow(kinematics(DRIVE), np.array([-1.0]), values[0], fit.form.place)[0]
    other = identify(record_of(lopsided), kinematics, settings=IdentifySettings(generations=9))
    assert other.layer["asymmetry"].low < np.tanh(0.3) < other.layer["asymmetry"].high
    assert other.layer["asymmetry"].low > 0.1


def test_a_first_stroke_that_differs_is_left_out_with_a_word() -> None:
    h = hysteresis(kinematics(DRIVE), BoucWen(-0.9, 0.5, 0.2, 1.3))
    plain = record_of(h)
    first = np.arange(len(DRIVE)) < 40
    virgin = replace(plain, angle_deg=plain.angle_deg - 8 * first * (1 - DRIVE / 2.2))
    assert without_first_stroke(plain, hold_out(plain))[1] is None
    fit = identify(virgin, kinematics)
    assert "the first stroke is left out" in fit.notes[0]
    assert fit.heldout.rmse_deg == pytest.approx(0.02, rel=0.3)
    assert identify(plain, kinematics).notes == ()


def test_angles_that_are_held_out_do_not_choose_the_training_samples() -> None:
    """Nothing of a held-out cycle changes what is fitted, however far off its angles are."""
    h = hysteresis(kinematics(DRIVE), BoucWen(-0.9, 0.5, 0.2, 1.3))
    plain = record_of(h)
    virgin = replace(plain, angle_deg=plain.angle_deg - 8 * (np.arange(len(DRIVE)) < 40) * (1 - DRIVE / 2.2))
    split = hold_out(virgin)
    hidden = replace(virgin, angle_deg=np.where(split.train, virgin.angle_deg, virgin.angle_deg - 200.0))
    (seen, word), (same, other) = without_first_stroke(virgin, split), without_first_stroke(hidden, split)
    assert word is not None
    assert other == word
    np.testing.assert_array_equal(seen.train, same.train)


def test_laws_are_checked_where_they_are_named() -> None:
    with pytest.raises(ValueError, match="law = 'best': expected auto or one of bouc-wen"):
        IdentifySettings(law="best")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="elements = 2: expected 1"):
        IdentifySettings(law="prandtl-ishlinskii", elements=2)
