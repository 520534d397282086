"""Which samples are readings where the drive or the tube rests: a play, stick, pulses, slow and coarse sensors."""

import re

import numpy as np
import pytest

from hysteresis import Record
from hysteresis.records.held import held_updates
from hysteresis.records.path import turning_points
from hysteresis.records.thinning import thinned
from hysteresis.sensors.readings import cleaned, lost_readings, readings_of

RNG = np.random.default_rng(4)


def play(drive, radius):
    out, at = np.empty(drive.size), 0.0
    for i, x in enumerate(drive):
        at = max(x - radius, min(x + radius, at))
        out[i] = at
    return out


def sine(cycles, samples, amplitude=5.0):
    return amplitude * np.sin(2 * np.pi * np.arange(cycles * samples + 1) / samples)


@pytest.mark.parametrize("radius", [2.0, 2.5, 3.0, 4.0])
@pytest.mark.parametrize("samples", [40, 100])
def test_a_play_is_no_slow_sensor_and_loses_no_reading(radius, samples):
    drive = sine(5, samples)
    angle = 4.0 * play(drive, radius)
    record = Record(drive, angle)
    assert readings_of(record).read.all()
    assert cleaned(record).words == ()
    assert held_updates(drive, np.round(angle / 0.05) * 0.05) is None


def test_a_sensor_with_a_clock_is_slow():
    drive = sine(5, 200)
    held = (4.0 * drive)[np.arange(drive.size) // 5 * 5]
    updates = held_updates(drive, held)
    assert np.flatnonzero(updates)[:3].tolist() == [5, 10, 15]


@pytest.mark.parametrize("visit", [1, 2, 3, 4])
def test_a_stroke_that_the_drive_made_is_no_spike(visit):
    drive = np.tile(np.concatenate([np.zeros(36), np.full(visit, 5.0)]), 12)
    angle = 4.0 * drive + 0.02 * RNG.standard_normal(drive.size)
    assert readings_of(Record(drive, angle)).spikes == ()
    lost = angle.copy()
    lost[100] = 999.0
    assert readings_of(Record(drive, lost)).spikes == (100,)


def test_a_tube_that_moves_on_behind_a_rest_at_the_end_is_not_lost():
    drive = sine(5, 100)[: 5 * 100 - 20]
    assert not lost_readings(drive, 4.0 * play(drive, 2.0)).any()


@pytest.mark.parametrize("step", [0.1, 0.5])
def test_thinning_takes_no_side_of_the_steps_of_a_coarse_sensor(step):
    drive = sine(5, 15_000)
    short = thinned(Record(drive, np.round(4.0 * drive / step) * step))
    assert short.drive.size < 0.2 * drive.size
    rising = np.append(np.diff(short.drive) > 0, False)
    off = short.angle_deg - 4.0 * short.drive
    assert abs(off[rising].mean() - off[~rising].mean()) < 0.05 * step  # one step if each is taken where it changes


def test_small_strokes_stay_in_a_long_record():
    drive = sine(5, 15_000) + 0.09 * np.sin(2 * np.pi * np.arange(75_001) / 25)
    short = thinned(Record(drive, 4.0 * drive))
    assert np.abs(np.diff(short.drive)).sum() == pytest.approx(np.abs(np.diff(drive)).sum(), rel=0.02)
    noisy = sine(5, 15_000) + 0.01 * RNG.standard_normal(75_001)
    assert turning_points(noisy).size < 20  # noise of the drive is no stroke


def test_lost_readings_use_up_no_cycles_of_a_long_record():
    drive = sine(60, 1000)
    angle = 4.0 * drive + 0.02 * RNG.standard_normal(drive.size)
    places = RNG.choice(drive.size, 45, replace=False)
    spoiled = angle.copy()
    spoiled[places] = 999.0
    words = thinned(Record(drive, spoiled)).left_out
    assert float(re.search(r"the others are within ([\d.]+) deg", words)[1]) < 0.1  # 12 deg where they count


def test_readings_held_in_a_row_amid_a_passage_are_lost_where_no_others_repeat():
    """Held at -1 while the angle passes from -0.8 to -6.9 deg: near enough to its neighbours to look like a rest."""
    drive = sine(2, 60, 1.5)
    angle = 20.0 * play(drive, 0.05) + RNG.normal(0.0, 0.05, drive.size)
    held = angle.copy()
    at = int(np.argmax((angle < -0.5) & (np.gradient(drive) < 0)))
    held[at : at + 4] = -1.0
    assert np.flatnonzero(lost_readings(drive, held)).tolist() == list(range(at, at + 4))
    assert not lost_readings(drive, angle).any()
