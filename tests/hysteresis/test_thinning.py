"""Long records: cycles that repeat are left out, others are kept."""

from dataclasses import replace

import numpy as np
import pytest

from hysteresis import Record
from hysteresis.fitting.identification import identify
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.records.path import branches
from hysteresis.records.thinning import KEPT, LEAST_RUN, WHOLE, thinned

NOISE_DEG = 0.05


def long_record(cycles, samples=400, amplitudes=1.0, seed=0):
    """Triangles from rest with white noise; ``amplitudes`` of each cycle."""
    phase = np.arange(samples) / samples
    wave = np.where(phase < 0.25, 4 * phase, np.where(phase < 0.75, 2 - 4 * phase, 4 * phase - 4))
    drive = (np.broadcast_to(amplitudes, cycles)[:, None] * wave).ravel() * 2.0
    f = 18.0 * drive
    angle = f + hysteresis(f, BoucWen(-0.9, 0.3, 0.1, 1.5))
    angle += NOISE_DEG * np.random.default_rng(seed).standard_normal(drive.size)
    return Record(drive, angle, time_s=0.01 * np.arange(drive.size))


def places(record, of):
    """Samples of a record among those of another, by their times."""
    found = np.searchsorted(of.time_s, record.time_s)
    assert np.array_equal(of.time_s[found], record.time_s)
    return found


def test_a_record_that_is_not_long_is_the_same_record():
    record = long_record(WHOLE // 400)
    assert record.drive.size == WHOLE
    assert thinned(record) is record
    assert record.left_out == ""


def test_cycles_that_repeat_are_left_out_and_what_is_used_is_unchanged():
    record = long_record(200)
    short = thinned(record)
    kept = places(short, record)
    assert short.drive.size < KEPT * 1.5
    assert np.array_equal(short.drive, record.drive[kept])
    assert np.array_equal(short.angle_deg, record.angle_deg[kept])
    assert short.cycle[0] == 0
    assert short.cycle[-1] == 200  # the numbers are those of the whole record
    assert {1, 2, 199} <= set(short.cycle.tolist())
    assert "of 80,000 samples are used" in short.left_out
    assert "of 201 cycles" in short.left_out
    assert thinned(short) is short


def test_the_path_still_turns_where_it_turned():
    record = long_record(WHOLE // 4000 + 5, samples=4000)  # few cycles: samples are left out, no cycle
    short = thinned(record)
    turns = [record.drive[one.stop - 1] for one in branches(record.drive)]
    assert [short.drive[one.stop - 1] for one in branches(short.drive)] == turns
    assert "all turning points" in short.left_out


@pytest.mark.parametrize("cycles", [LEAST_RUN * 5])
def test_a_cycle_that_differs_is_used(cycles):
    record = long_record(cycles)
    odd = 57 * 400
    angle = record.angle_deg.copy()
    angle[odd : odd + 400] += 0.5
    used = set(thinned(replace(record, angle_deg=angle)).cycle.tolist())
    assert {57, 58} & used
    assert not {57, 58} & set(thinned(record).cycle.tolist())


def test_a_leap_stands_between_neighbours_that_are_both_used():
    record = long_record(200)
    angle = record.angle_deg + 0.5 * (np.arange(record.drive.size) >= 120 * 400 + 100)
    used = sorted(set(thinned(replace(record, angle_deg=angle)).cycle.tolist()))
    assert {120, 121} <= set(used)


def test_words_say_how_far_the_record_drifts():
    record = long_record(200)
    drift = 2.0 * np.arange(record.drive.size) / record.drive.size
    assert "differ by up to 2 deg" in thinned(replace(record, angle_deg=record.angle_deg + drift)).left_out


def test_cycles_of_other_amplitudes_are_all_used():
    amplitudes = np.random.default_rng(1).uniform(0.3, 1.0, 200)
    record = long_record(200, amplitudes=amplitudes)
    short = thinned(record)
    assert set(short.cycle.tolist()) == set(range(201))
    assert "cycles" not in short.left_out


def test_a_slow_sensor_is_read_where_its_value_changes():
    record = long_record(4, samples=20_000)
    held = np.repeat(record.angle_deg[::37], 37)[: record.drive.size]
    short = thinned(replace(record, angle_deg=held))
    kept = places(short, record)
    changes = np.flatnonzero(np.diff(held) != 0) + 1
    turns = [one.stop - 1 for one in branches(record.drive)]
    others = np.setdiff1d(kept, [0, record.drive.size - 1, *turns, *(np.array(turns) + 1)])
    assert np.isin(others, changes).mean() > 0.999


def test_a_jump_of_a_sample_left_out_is_at_the_next_one():
    record = long_record(10, samples=4000)
    jump = np.zeros(record.drive.size)
    jump[1501] = 1
    short = thinned(replace(record, jump=jump))
    at = places(short, record)[np.flatnonzero(short.jump)]
    assert len(at) == 1
    assert 1501 <= at[0] < 1501 + 10


def test_identify_of_a_long_record_finds_the_law_and_says_what_it_used():
    fit = identify(long_record(200))
    assert "of 80,000 samples are used" in fit.notes[0]
    assert fit.saturation_deg.low < (0.9 / 0.4) ** (1 / 1.5) < fit.saturation_deg.high
    assert fit.noise_floor_deg == pytest.approx(NOISE_DEG, rel=0.1)
