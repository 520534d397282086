"""Known rigs behind a motor whose gain is not known: the same verdicts as for a drive in mm."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.rig import preset
from fem_models.rig.effects import Slack
from fem_models.rig.of_record import rig_of
from hysteresis.records.record import Record, RecordError
from validation.tracing import trace_records
from validation.tracing.baseline.motor_drive import motor_drive_problem
from validation.tracing.effect import catalogue
from validation.tracing.next_experiment import next_experiment
from validation.tracing.result import trace_report
from validation.tracing.second_opinion import second_opinion

MM_PER_DEG = 0.035  # a wheel of 2 mm radius
NOISE_DEG = 0.05


def measured(rig, seed, unit="deg", mm=MM_PER_DEG):
    run = simulate_chain(rig, sine(2.2, 0.1 * (1 + seed), cycles=2, samples_per_cycle=60))
    noise = np.random.default_rng(seed).normal(0, NOISE_DEG, run.angle_deg.size)
    return Record(
        drive=run.drive / mm, angle_deg=run.angle_deg + noise, time_s=run.time_s, cycle=run.cycle, drive_unit=unit,
        rig={"preset": "du2018", "preload_N": rig.preload_N}, source=f"motor-{seed}.csv",
    )  # fmt: skip


@pytest.fixture(scope="module")
def slack_behind_a_motor():
    """Records of slack tendons behind a motor that turns in the other direction."""
    rigs = [preset("du2018", preload_N=T) for T in (20.0, 10.0)]
    near = {"tendon_slack", "backlash", "unequal_tendons", "tendon_stiffening", "guide_friction", "wheel_eccentricity"}
    return trace_records(
        [measured(replace(rig, slack=Slack(0.2, 0.2)), i, mm=-MM_PER_DEG) for i, rig in enumerate(rigs)],
        effects=[effect for effect in catalogue() if effect.name in near],
    )


@pytest.mark.slow
def test_gain_and_effect_are_found_together(slack_behind_a_motor):
    trace = slack_behind_a_motor
    assert trace.known
    assert trace.augmented.names == ("tendon_slack",)
    baseline, (slack,) = trace.augmented.model.values(trace.augmented.x)
    assert baseline["drive_mm_per_deg"] == pytest.approx(-MM_PER_DEG, rel=0.02)
    assert slack["slack_mm"] == pytest.approx(0.2, rel=0.1)
    assert trace.augmented.heldout_rmse_deg < 1.3 * NOISE_DEG
    result = trace_report(trace, experiment=next_experiment(trace), opinion=(confirmed := second_opinion(trace)))
    assert result.rig_known
    assert confirmed.after.rmse_deg < min(1.3 * NOISE_DEG, 0.7 * confirmed.before.rmse_deg)


@pytest.mark.slow
def test_the_next_record_is_in_turns_of_the_motor(slack_behind_a_motor):
    experiment = next_experiment(slack_behind_a_motor)
    assert experiment.csv().startswith("drive_deg,time_s\n")
    assert experiment.program is None  # which is in mm
    assert 0.2 < np.abs(experiment.trial.drive).max() * MM_PER_DEG / 2.2 < 1.5  # in mm it would be 0.035


def test_records_without_an_effect_have_the_verdict_none():
    trace = trace_records([measured(preset("du2018", preload_N=T), i) for i, T in enumerate((20.0, 10.0))])
    assert trace.verdict == "none"
    assert trace.augmented.model.values(trace.augmented.x)[0]["drive_mm_per_deg"] == pytest.approx(MM_PER_DEG, rel=0.01)


@pytest.mark.parametrize(("arm_mm", "EA_N"), [(1.0, 3000.0), (0.6, 9000.0), (2.6, 1000.0)])
def test_the_gain_starts_from_the_stretch_of_the_declared_tendons(arm_mm, EA_N):
    """Most of what the wheel winds in is stretch: the moment arm alone would give a third of the gain."""
    measured_rig = {"joints": 5, "moment_arm_mm": arm_mm, "flexure_stiffness_Nmm_per_rad": 600.0, "tendon_EA_N": EA_N}
    measured_rig |= {"tendon_free_length_mm": 200.0, "pitch_mm": 2.6, "preload_N": 20.0}
    steps = sine(1.0, 0.1, cycles=2, samples_per_cycle=60)
    empty = Record(drive=steps.drive_mm, angle_deg=np.zeros(steps.drive_mm.size), rig=measured_rig)
    run = simulate_chain(rig_of(empty), steps)
    noise = np.random.default_rng(3).normal(0, NOISE_DEG, run.angle_deg.size)
    record = replace(
        empty, drive=steps.drive_mm / MM_PER_DEG, angle_deg=run.angle_deg + noise, time_s=steps.time_s, drive_unit="deg"
    )
    problem = motor_drive_problem([record])
    assert problem.start["drive_mm_per_deg"] == pytest.approx(MM_PER_DEG, rel=0.05)
    trace = trace_records([record])
    assert trace.verdict == "none"
    baseline = trace.baseline.model.values(trace.baseline.x)[0]
    assert baseline["drive_mm_per_deg"] == pytest.approx(MM_PER_DEG, rel=0.05)
    assert baseline["EA_N"] == pytest.approx(EA_N, rel=0.1)


def test_units_must_agree_and_a_rig_must_be_known():
    record = measured(preset("du2018"), 0)
    with pytest.raises(RecordError, match=r"drive\.unit = step: expected deg"):
        motor_drive_problem([record, replace(record, drive_unit="step")])
    assert motor_drive_problem([record, replace(record, rig={"preload_N": 20.0})]) is None
    with pytest.raises(RecordError, match="the other sign than in the first"):
        motor_drive_problem([record, replace(record, angle_deg=-record.angle_deg)])
