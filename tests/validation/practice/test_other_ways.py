"""Other ways to trace a residual: their terms recover what was put in, and they answer in the schema."""

import json
from dataclasses import replace

import numpy as np
import pytest

from hysteresis import Record
from hysteresis.laws.prandtl_ishlinskii import plays
from hysteresis.plain import to_plain
from hysteresis.records.record import RecordError
from studies.commands.cli import call
from validation.practice.benchmark.answers import answer_of
from validation.practice.benchmark.features import NAMES, features
from validation.practice.benchmark.sparse_regression import Thresholds, group_gains, judge_terms, named_set
from validation.practice.benchmark.terms import residual_terms
from validation.practice.benchmark.training import GRID, Example, Training, best_thresholds, main, read_training
from validation.practice.catalogue import CATALOGUE

NOISE = 0.03


def record(rate_Hz=0.1, preload_N=20.0, seed=1):
    time = np.arange(1, 801) / 200 / rate_Hz
    drive = 2.0 * np.sin(2 * np.pi * rate_Hz * time) * (1 - 0.02 * rate_Hz * time)
    loop = 3.0 * plays(drive / 2.0, [0.15])[0] * preload_N / 20.0
    noise = np.random.default_rng(seed).normal(0.0, NOISE, time.size)
    angle = 10.0 * drive - 0.3 * drive**3 + loop + noise
    return Record(drive=drive, angle_deg=angle, time_s=time, rig={"preload_N": preload_N})


@pytest.fixture
def records():
    return [record(), record(0.6, seed=2), record(0.1, 10.0, seed=3)]


def late(one, delay_s):
    return replace(one, angle_deg=np.interp(one.time_s - delay_s, one.time_s, one.angle_deg))


def test_baseline_leaves_the_noise_and_terms_are_beyond_it(records):
    found = residual_terms(records)
    assert found.noise_deg == pytest.approx(NOISE, rel=0.1)
    assert found.over_noise == pytest.approx(1.0, rel=0.15)
    assert set(found.effects) <= set(CATALOGUE)
    zeros = np.repeat(np.eye(3), 800, axis=0)
    drive = np.concatenate([one.drive for one in records])
    span = np.column_stack([zeros, drive, drive**3])
    np.testing.assert_allclose(span.T @ found.residual_deg, 0.0, atol=1e-6)
    np.testing.assert_allclose(span.T @ found.terms / np.linalg.norm(found.terms, axis=0), 0.0, atol=1e-4)
    assert max(group_gains(found).values()) < 0.05
    assert found.training.sum() == pytest.approx(0.7 * 2400, abs=3)


def test_drift_and_delay_are_what_explains_them(records):
    drifting = [replace(one, angle_deg=one.angle_deg + 0.02 * one.time_s) for one in records]
    gains = group_gains(residual_terms(drifting))
    assert max(gains, key=gains.get) == "thermal_drift"
    assert gains["thermal_drift"] > 0.9
    delayed = residual_terms([late(one, 0.05) for one in records])
    gains = group_gains(delayed)
    assert gains["time_delay"] > 0.9
    column = delayed.terms[:, delayed.names.index("speed of the angle")]
    # the coefficient of the angle's speed is the delay
    assert column @ delayed.residual_deg / (column @ column) == pytest.approx(0.05, rel=0.1)


def test_records_without_times_have_no_terms_of_time(records):
    found = residual_terms([replace(one, time_s=None) for one in records])
    assert not {"thermal_drift", "time_delay", "viscous_drag", "tendon_creep"} & set(found.effects)
    values = features(records, found)
    assert values.shape == (len(NAMES),)
    assert np.isfinite(values).all()


def test_sparse_regression_names_an_effect_or_none(records):
    pytest.importorskip("pysindy")
    thresholds = Thresholds(kept=0.3, nothing=1.5, explained=0.5)
    clean = judge_terms(residual_terms(records), thresholds)
    assert clean.verdict == "none"
    assert clean.heldout_rmse_deg == pytest.approx(NOISE, rel=0.2)
    found = residual_terms([late(one, 0.05) for one in records])
    delayed = judge_terms(found, thresholds)
    assert "time_delay" in named_set(delayed)
    assert delayed.effects[0].parameters["delay_s"] == pytest.approx(0.05, rel=0.1)
    # a delay is more than the speed of the angle times itself, so that a part of the residual stays
    assert NOISE < delayed.heldout_rmse_deg < 0.3 * np.sqrt(np.mean(found.residual_deg**2))
    # held out: what is read of the last part of the records changes no weight
    last = ~found.training
    strange = replace(found, angle_deg=found.angle_deg + last * 3.0)
    shifted = judge_terms(strange, Thresholds(kept=0.3, nothing=1e9, explained=0.5)).heldout_rmse_deg
    assert shifted == pytest.approx(3.0, abs=0.5)
    leaping = [replace(one, angle_deg=one.angle_deg + 2.0 * (one.time_s > 0.43 * one.time_s[-1])) for one in records]
    assert judge_terms(residual_terms(leaping), Thresholds(explained=0.9)).verdict == "unexplained"
    assert answer_of(delayed.to_dict(), "case").named == delayed.named


def examples():
    """Examples of three kinds that their features separate, and thresholds of which one is right."""
    rng = np.random.default_rng(4)
    out = []
    for number in range(60):
        truth = ("none", "backlash", "thermal_drift")[number % 3]
        values = rng.normal(0.0, 0.3, len(NAMES))
        values[0] += 0.0 if truth == "none" else 3.0
        values[NAMES.index("gain of thermal_drift")] += 3.0 * (truth == "thermal_drift")
        sparse = [("backlash",)] * len(GRID)  # always the same name
        sparse[5] = () if truth == "none" else (truth,)
        out.append(Example(f"own {number}", truth, tuple(values.tolist()), tuple(sparse)))
    return out


def test_thresholds_with_few_false_alarms_are_chosen():
    chosen, hits, alarms = best_thresholds(examples())
    assert (chosen, hits, alarms) == (GRID[5], 1.0, 0.0)


def test_training_is_not_gone_on_with_by_another_seed(tmp_path, capsys):
    path = tmp_path / "training.json"
    path.write_text(json.dumps(to_plain(Training(1, 7, NAMES, tuple(examples())))))
    with pytest.raises(SystemExit):
        main(["--seed", "8", "--count", "1", "--out", str(path)])
    assert "seed = 7: expected 8" in capsys.readouterr().err
    assert read_training(path).seed == 7


def test_of_thresholds_with_as_many_hits_those_with_fewer_false_alarms_are_chosen():
    some = [
        Example(f"own {k}", "none" if k % 2 else "backlash", (0.0,) * len(NAMES),
                tuple(() if k % 2 and (j == 4 or k > 2) else ("backlash",) for j in range(len(GRID))))
        for k in range(60)
    ]  # fmt: skip
    assert best_thresholds(some) == (GRID[4], 1.0, 0.0)


def test_classifier_learns_and_answers(records, tmp_path):
    pytest.importorskip("sklearn")
    from validation.practice.benchmark.classifier import ClassifierAnswerer, answer_of_votes, forest_of

    path = tmp_path / "training.json"
    path.write_text(json.dumps(to_plain(Training(1, 0, NAMES, tuple(examples())))))
    assert read_training(path).examples == tuple(examples())
    forest = forest_of(path)
    assert forest.names == ("backlash", "none", "thermal_drift")
    assert 0.0 <= forest.votes_needed < 0.5
    sure = answer_of_votes(forest, np.array([0.1, 0.1, 0.8]))
    assert (sure.verdict, sure.effects[0].name, sure.effects[0].confusable_with) == ("effect", "thermal_drift", ())
    assert answer_of_votes(forest, np.array([0.4, 0.1, 0.5])).effects[0].confusable_with == ("backlash",)
    assert answer_of_votes(forest, np.array([0.3, 0.6, 0.1])).verdict == "none"
    assert ClassifierAnswerer(path)(records).verdict in (
        "none",
        "effect",
        "ambiguous",
        "unexplained",
    )


def test_training_is_resumed(tmp_path, capsys):
    pytest.importorskip("pysindy")
    path = tmp_path / "training.json"
    main(["--seed", "3", "--count", "1", "--out", str(path)])
    first = read_training(path)
    assert len(first.examples) == 4
    path.write_text(json.dumps(to_plain(replace(first, examples=first.examples[:3]))))
    main(["--seed", "3", "--count", "1", "--out", str(path)])
    assert read_training(path).examples == first.examples
    assert "4 cases" in capsys.readouterr().out
    path.write_text(json.dumps(to_plain(replace(first, names=first.names[1:]))))
    with pytest.raises(RecordError, match="features of another version"):
        read_training(path)


def test_classifier_without_examples_is_refused_in_one_line(tmp_path, capsys):
    pytest.importorskip("sklearn")
    assert call(["practice", "answer", str(tmp_path), "--by", "classifier"]) == 2
    assert "--training = missing" in capsys.readouterr().err
    missing = str(tmp_path / "no.json")
    assert call(["practice", "answer", str(tmp_path), "--by", "classifier", "--training", missing]) == 2
    assert f"{missing}: No such file" in capsys.readouterr().err
