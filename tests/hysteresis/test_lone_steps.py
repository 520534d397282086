"""Steps between two samples: counts that were lost, a clamp that moved, and what is neither."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from hysteresis.sensors.lone_steps import (
    LoneStep,
    leap_of_angle,
    lone_step,
    lost_counts,
    without_lost_counts,
)
from validation.tracing import trace_records

AT, COUNTS_MM, LEAP_DEG = 701, 0.4, -3.0


def behind_play(drive: Floats, width: float = 0.5) -> Floats:
    out, p = np.empty(drive.size), drive[0]
    for i, x in enumerate(drive):
        p = max(x - width / 2, min(x + width / 2, p))
        out[i] = p
    return out


def record(drive: Floats, seed: int = 0, noise_deg: float = 0.02) -> Record:
    """Record of a softening curve behind a play, with noise."""
    moved = behind_play(drive)
    angle = 9.0 * moved - 0.3 * moved**3 + noise_deg * np.random.default_rng(seed).normal(size=drive.size)
    time = np.arange(drive.size) / 20.0
    return Record(drive=drive, angle_deg=angle, drive_unit="mm", time_s=time, source="bench.csv")


TIME = np.linspace(0.0, 5.0, 1001)
SOUND = record(2.0 * np.exp(-0.1 * TIME) * np.sin(2 * np.pi * TIME))
AFTER = np.arange(TIME.size) >= AT
LOST = replace(SOUND, drive=SOUND.drive + COUNTS_MM * AFTER)
LEAPT = replace(SOUND, angle_deg=SOUND.angle_deg + LEAP_DEG * AFTER)


def test_counts_that_were_lost_are_put_back() -> None:
    step = lost_counts(LOST)
    assert step is not None
    assert (step.sample, step.size) == (AT, pytest.approx(COUNTS_MM, rel=0.02))
    mended, words = without_lost_counts(LOST)
    assert mended.drive == pytest.approx(SOUND.drive, abs=0.02 * COUNTS_MM)
    assert words.startswith("bench.csv: the drive leaps by 0.4")
    assert f"mm at {SOUND.time_s[AT]:.3g} s" in words
    assert leap_of_angle(LOST) is None


def test_a_leap_of_the_angle_is_found_with_its_size() -> None:
    step = leap_of_angle(LEAPT)
    assert step is not None
    assert (step.sample, step.size) == (AT, pytest.approx(LEAP_DEG, rel=0.05))
    assert lost_counts(LEAPT) is None


def test_a_sound_record_stays_as_it_is() -> None:
    assert without_lost_counts(SOUND) == (SOUND, "")
    assert leap_of_angle(SOUND) is None


def test_a_motor_that_jumps_takes_the_angle_with_it() -> None:
    """The drive's step is as lone; the rig has made it."""
    jumped = record(SOUND.drive + COUNTS_MM * AFTER)
    assert lone_step(jumped.drive) is not None
    assert lost_counts(jumped) is None
    assert leap_of_angle(jumped) is None


def test_a_snap_that_comes_back_is_no_leap() -> None:
    """A tube that snaps is off for a while: the record is as far from a curve without the step as with it."""
    away = (np.arange(TIME.size) >= AT) & (np.arange(TIME.size) < AT + 60)
    back = np.clip(1.0 - (np.arange(TIME.size) - AT) / 60.0, 0.0, 1.0)  # it creeps back
    assert leap_of_angle(replace(SOUND, angle_deg=SOUND.angle_deg + LEAP_DEG * back * away)) is None


def test_steps_among_others_are_motion() -> None:
    """A staircase has many, and a program of points none that stands alone."""
    assert lone_step(np.repeat(np.arange(20.0), 25)) is None
    assert lone_step(np.cumsum(np.random.default_rng(1).exponential(size=500))) is None


@pytest.mark.parametrize(("factor", "is_lone"), [(2.9, False), (3.2, True)])
def test_a_step_stands_alone_from_three_times_the_largest_other_one(factor: float, is_lone: bool) -> None:
    """The motion is 1 a sample and one step of 2: 1 more than the motion, as the lone one is ``factor`` more."""
    steps = np.ones(200)
    steps[50], steps[120] = 2.0, 1.0 + factor
    values = np.concatenate([[0.0], np.cumsum(steps)])
    found = lone_step(values)
    assert (found is not None) is is_lone
    if found is not None:
        assert (found.sample, found.size) == (121, pytest.approx(factor))


@pytest.mark.parametrize("count", [2, 17, 18])
def test_few_samples_have_no_lone_step(count: int) -> None:
    """Of 18 values the step between the middle ones has no other beyond its neighbours."""
    assert lone_step(np.where(np.arange(count) >= count // 2, 9.0, 0.0)) is None


def test_nineteen_samples_may_have_one() -> None:
    assert lone_step(np.where(np.arange(19) >= 9, 9.0, 0.0)) == LoneStep(sample=9, size=9.0)


def test_a_motor_that_takes_hold_hides_no_lost_counts() -> None:
    """Its own steps at the start are as large; a drive that leaps by more than all strokes is found as before."""
    start = np.r_[0.0, 0.3, 0.1, np.zeros(TIME.size - 3)]
    lost = replace(LOST, drive=LOST.drive + start)
    assert lone_step(lost.drive) is None
    step = lost_counts(lost)
    assert step is not None
    assert (step.sample, step.size) == (AT, pytest.approx(COUNTS_MM, rel=0.02))
    assert lost_counts(replace(SOUND, drive=SOUND.drive + start)) is None
    far = lost_counts(replace(SOUND, drive=SOUND.drive + 75 * COUNTS_MM * AFTER))
    assert far is not None
    assert far.size == pytest.approx(75 * COUNTS_MM, rel=0.02)


def test_the_first_stroke_and_a_tendon_force_are_left_alone() -> None:
    early = replace(SOUND, drive=SOUND.drive + COUNTS_MM * (np.arange(TIME.size) >= 20))
    assert lone_step(early.drive) is not None
    assert lost_counts(early) is None
    assert lost_counts(replace(LOST, drive_unit="N")) is None


@pytest.mark.slow
def test_records_with_lost_counts_are_not_given_an_effect() -> None:
    """They are mended, and the verdict says that something is wrong; the sound ones lack nothing."""
    sound = [record(a * SOUND.drive, i, 0.1) for i, a in enumerate((1.0, 0.75))]
    off = replace(sound[0], drive=sound[0].drive + COUNTS_MM * AFTER)
    good, lost = trace_records(sound, effects=[]), trace_records([off, sound[1]], effects=[])
    assert (good.verdict, lost.verdict) == ("none", "unexplained")
    assert lost.names == ()
    assert lost.baseline.heldout_rmse_deg == pytest.approx(good.baseline.heldout_rmse_deg, rel=0.05)
    assert any("counts that an encoder lost" in words for words in lost.words)
