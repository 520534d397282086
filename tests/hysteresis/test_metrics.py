"""Metrics against formulas: polygons, ellipses, planted noise."""

import json
import time
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hysteresis.records.leaps import find_leap, leap_gains
from hysteresis.records.metrics import (
    _from_one_state,
    _repeats,
    dissipated_area,
    errors,
    leap_between_cycles,
    loop_width,
    noise_floor,
    repeatability_deg,
)
from hysteresis.records.path import branches
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record


def triangle(amplitude: float, quarter: int, cycles: int) -> np.ndarray:
    """+A to -A to +A, ``cycles`` times, 4 ``quarter`` steps each."""
    k = np.arange(4 * quarter * cycles + 1)
    return amplitude * (np.abs((k / quarter) % 4 - 2) - 1)


def play(drive: np.ndarray, width: float) -> np.ndarray:
    """Play operator on the upper side of a loop: a backlash of ``width``."""
    angle = np.empty_like(drive)
    angle[0] = drive[0] - width / 2
    for i in range(1, len(drive)):
        angle[i] = min(max(angle[i - 1], drive[i] - width / 2), drive[i] + width / 2)
    return angle


# --- errors ----------------------------------------------------------------------------------------------------


def test_errors_by_hand() -> None:
    # deviations 0, 1, -2, 1 over a range of 10: rmse sqrt(6/4), largest 2.
    e = errors([0, 4, 10, 6], [0, 5, 8, 7])
    assert e.rmse_deg == pytest.approx(np.sqrt(1.5))
    assert e.max_abs_deg == 2
    assert e.max_rel_percent == 20
    assert e.normalised == pytest.approx(np.sqrt(1.5) / 10)
    assert set(json.loads(json.dumps(e.to_dict()))) == {"rmse_deg", "max_abs_deg", "max_rel_percent", "normalised"}


def test_percent_of_range_and_of_the_paper() -> None:
    # Table 1 prints 1.48 deg as 3.23 %, so it divides by 45.8 deg; over its range of -45..45 deg it is 1.64 %.
    angle = np.linspace(-45, 45, 91)
    off = np.where(np.arange(91) == 45, 1.48, 0.0)
    assert errors(angle, angle + off).max_rel_percent == pytest.approx(100 * 1.48 / 90)
    reference = 1.48 / 0.0323
    assert reference == pytest.approx(45.8, abs=0.05)


@given(
    row=st.lists(st.tuples(st.floats(-90, 90), st.floats(-90, 90)), min_size=2, max_size=30),
    shift=st.floats(-10, 10),
)
def test_rmse_is_below_the_largest_error_and_shift_does_not_matter(row: list, shift: float) -> None:
    measured, predicted = np.array(row).T
    if np.ptp(measured) < 1e-3:
        return
    e = errors(measured, predicted)
    assert e.rmse_deg <= e.max_abs_deg * (1 + 1e-12)
    moved = errors(measured + shift, predicted + shift)
    assert moved.normalised == pytest.approx(e.normalised, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("measured", "predicted", "expected"),
    [
        ([1, 1, 1], [1, 2, 3], "measured_deg = 1 throughout"),
        ([1, 2], [1, 2, 3], r"shapes \(2,\), \(3,\)"),
        ([], [], "expected two rows"),
        ([1, 2], [1, np.nan], "predicted_deg: NaN"),
    ],
)
def test_errors_refuse(measured: list, predicted: list, expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        errors(measured, predicted)


# --- width and area --------------------------------------------------------------------------------------------


def test_parallelogram_is_exact() -> None:
    # Backlash b over the drive -A..A: width b, but rising from 0 within b of either end; area b (2A - b).
    a, b = 2.2, 0.6
    drive = triangle(a, 22, 3)
    angle = play(drive, b)
    assert dissipated_area(drive, angle) == pytest.approx(b * (2 * a - b), rel=1e-12)
    width = loop_width(drive, angle)
    assert width.max_deg == pytest.approx(b, rel=1e-12)
    assert width.at_zero_deg == pytest.approx(b, rel=1e-12)
    expected = np.minimum(b, np.minimum(a - width.drive, a + width.drive))
    assert width.width_deg == pytest.approx(expected, abs=1e-12)
    assert json.loads(json.dumps(width.to_dict()))["max_deg"] == width.max_deg


def test_noise_biases_the_largest_width_only() -> None:
    # The width at one drive has the deviation sqrt(2) 0.05 / sqrt(cycles); the expected largest of the absolute
    # values of 87 such normal numbers is 2.7 deviations (87 (2 Phi(z) - 1)^86 integrated): 0.19 and 0.06 deg.
    rng = np.random.default_rng(0)
    for cycles, expected in ((1, 0.19), (10, 0.06)):
        drive = triangle(2.2, 44, cycles)
        widths = [loop_width(drive, 20 * drive + 0.05 * rng.standard_normal(len(drive))) for _ in range(60)]
        deviation = np.sqrt(2) * 0.05 / np.sqrt(cycles)
        assert np.mean([w.max_deg for w in widths]) == pytest.approx(expected, rel=0.07)
        at_zero = [w.at_zero_deg for w in widths if w.at_zero_deg is not None]
        assert abs(np.mean(at_zero)) < 4 * deviation / np.sqrt(60)


def test_sign_follows_the_lag() -> None:
    drive = triangle(2.0, 20, 2)
    lag = play(drive, 0.5)
    lead = 2 * drive - lag
    assert loop_width(drive, lag).at_zero_deg == pytest.approx(0.5)
    assert loop_width(drive, lead).at_zero_deg == pytest.approx(-0.5)
    assert loop_width(drive, lead).max_deg == pytest.approx(0.5)
    assert dissipated_area(drive, lead) == pytest.approx(-dissipated_area(drive, lag))
    # An angle that falls with the drive, or a drive counted the other way, lags all the same.
    for x, y in ((drive, -lag), (-drive, lag), (-drive, -lag)):
        assert loop_width(x, y).at_zero_deg == pytest.approx(0.5)
        assert dissipated_area(x, y) == pytest.approx(dissipated_area(drive, lag))


def test_ellipse_converges_with_second_order() -> None:
    # x = a cos t, y = b cos(t - phi): area pi a b sin phi; width at x = 0 is 2 b sin phi, the largest one.
    a, b, phi = 2.2, 45.0, 0.2
    off = []
    for n in (50, 100, 200, 400):
        t = 2 * np.pi * np.arange(2 * n + 1) / n
        x, y = a * np.cos(t), b * np.cos(t - phi)
        off.append(
            [dissipated_area(x, y) - np.pi * a * b * np.sin(phi), loop_width(x, y).at_zero_deg - 2 * b * np.sin(phi)]
        )
    orders = np.log2(np.abs(off[:-1]) / np.abs(off[1:]))
    assert orders[:, 0] == pytest.approx(2, abs=0.05)
    assert abs(off[-1][1]) < 1e-3 * 2 * b * np.sin(phi)


def test_approach_and_incomplete_cycles_do_not_count() -> None:
    a, b, quarter = 2.0, 0.5, 20
    loops = triangle(a, quarter, 2)
    approach = np.linspace(0, a, quarter, endpoint=False)
    drive = np.concatenate([approach, loops, loops[1:15]])
    angle = np.concatenate([3 * approach, play(loops, b), play(loops, b)[1:15] + 7])
    assert dissipated_area(drive, angle) == pytest.approx(b * (2 * a - b), rel=1e-12)
    assert loop_width(drive, angle).max_deg == pytest.approx(b, rel=1e-12)
    numbers = np.repeat([0, 1, 2, 3], [quarter + 1, 4 * quarter, 4 * quarter, 14])
    assert loop_width(drive, angle, numbers).max_deg == pytest.approx(b, rel=1e-12)
    assert dissipated_area(drive, angle, numbers) == pytest.approx(b * (2 * a - b), rel=1e-12)


def test_cycles_numbered_from_their_turning_point() -> None:
    a, b = 2.0, 0.5
    drive = triangle(a, 20, 3)
    numbers = np.minimum(np.arange(len(drive)) // 80, 2) + 1  # +A opens a cycle instead of closing it
    assert dissipated_area(drive, play(drive, b), numbers) == pytest.approx(b * (2 * a - b), rel=1e-3)
    assert loop_width(drive, play(drive, b), numbers).max_deg == pytest.approx(b, rel=1e-12)


def test_loop_recorded_from_the_middle() -> None:
    drive = np.roll(triangle(2.0, 20, 1)[:-1], 20)
    angle = np.roll(play(triangle(2.0, 20, 2), 0.5)[80:160], 20)
    drive, angle = np.append(drive, drive[0]), np.append(angle, angle[0])
    assert abs(drive[0]) < 1e-12
    assert dissipated_area(drive, angle) == pytest.approx(0.5 * 3.5, rel=1e-12)
    assert loop_width(drive, angle).max_deg == pytest.approx(0.5, rel=1e-12)


def test_width_with_dwell_and_jitter() -> None:
    # Every sample held 20 times with encoder jitter, and sensor noise of 0.02: the width stays 0.5.
    rng = np.random.default_rng(11)
    clean = np.repeat(triangle(2.0, 20, 4), 20)
    angle = play(clean, 0.5) + rng.normal(0, 0.02, clean.size)
    drive = clean + rng.uniform(-0.002, 0.002, clean.size)
    width = loop_width(drive, angle)
    # 20 samples by 4 cycles by 2 branches average the noise to 0.02 sqrt(2/80) = 0.003; 80 drives: 4 sigma.
    assert width.at_zero_deg == pytest.approx(0.5, abs=0.013)
    assert np.median(width.width_deg) == pytest.approx(0.5, abs=0.005)
    assert width.max_deg < 0.6


def test_decaying_cycles_have_a_width_but_no_area() -> None:
    amplitude = [2.0, 1.4, 1.0, 0.7, 0.5]
    turns = np.array([s * a for a in amplitude for s in (1, -1)])
    drive = np.concatenate([np.linspace(p, q, 40, endpoint=False) for p, q in pairwise(turns)])
    angle = play(drive, 0.3)
    assert loop_width(drive, angle).at_zero_deg == pytest.approx(0.3, rel=1e-9)
    with pytest.raises(ValueError, match=r"no closed cycle, the first goes from -2 to -1\.4"):
        dissipated_area(drive, angle)


@pytest.mark.parametrize("f", [loop_width, dissipated_area])
def test_loops_refuse(f) -> None:
    with pytest.raises(ValueError, match="no complete cycle"):
        f([0, 1, 2, 3], [0, 1, 2, 3])
    with pytest.raises(ValueError, match="no complete cycle"):  # trials that only load
        f([0, 1, 2, 0, 1, 2], [0, 5, 9, 0, 5, 9], [1, 1, 1, 2, 2, 2])
    with pytest.raises(ValueError, match=r"shapes \(3,\), \(2,\)"):
        f([0, 1, 0], [0, 1])
    with pytest.raises(ValueError, match=r"cycle: shape \(2,\)"):
        f([0, 1, 0], [0, 1, 0], [1, 1])


# --- noise -----------------------------------------------------------------------------------------------------


def test_noise_from_repeats() -> None:
    # 6 cycles of 400 samples: 2000 degrees of freedom, the estimate scatters by 1/sqrt(4000) = 1.6 %.
    rng = np.random.default_rng(5)
    drive = triangle(2.2, 100, 6)
    angle = 20 * play(drive, 0.2) + rng.normal(0, 0.05, drive.size)
    assert noise_floor(Record(drive, angle)) == pytest.approx(0.05, rel=0.1)


def test_noise_from_repeats_sampled_at_other_drives() -> None:
    # Samples of the cycles do not fall together: linear interpolation averages noise, which must be divided out
    # (uncorrected the estimate falls to about sqrt(2/3) = 0.82 of sigma).
    rng = np.random.default_rng(6)
    t = np.cumsum(rng.uniform(0.5, 1.5, 2400)) / 400
    drive = 2.2 * np.cos(2 * np.pi * t[t < 5.2])
    angle = 20 * drive + rng.normal(0, 0.05, drive.size)
    assert noise_floor(Record(drive, angle)) == pytest.approx(0.05, rel=0.1)


def test_noise_from_a_single_cycle() -> None:
    # Median of about 2000 absolute second differences: scatter about 3 %. Unevenly spaced on purpose.
    rng = np.random.default_rng(7)
    t = np.sort(rng.uniform(0, 1, 2000))
    for drive in (triangle(2.2, 500, 1), 2.2 * np.cos(2 * np.pi * np.concatenate([[0], t, [1]]))):
        angle = 20 * play(drive, 0.2) + rng.normal(0, 0.05, drive.size)
        assert noise_floor(Record(drive, angle)) == pytest.approx(0.05, rel=0.1)


def test_noise_of_trials_that_only_load() -> None:
    rng = np.random.default_rng(8)
    force = np.tile(np.linspace(0, 2, 300), 5)
    angle = 30 * force + rng.normal(0, 0.5, force.size)
    record = Record(force, angle, drive_unit="N", cycle=np.repeat(np.arange(1, 6), 300))
    assert noise_floor(record) == pytest.approx(0.5, rel=0.1)


def test_no_noise_in_clean_records() -> None:
    many, one = triangle(2.2, 22, 4), triangle(2.2, 22, 1)
    assert noise_floor(Record(many, 20 * play(many, 0.3))) == pytest.approx(0, abs=1e-9)
    assert noise_floor(Record(one, 20 * play(one, 0.3))) == pytest.approx(0, abs=1e-9)


def test_decaying_cycles_do_not_repeat() -> None:
    turns = np.array([2.0, -2.0, 1.4, -1.4, 1.0, -1.0, 0.7, -0.7])
    drive = np.concatenate([np.linspace(p, q, 200, endpoint=False) for p, q in pairwise(turns)])
    angle = 20 * play(drive, 0.3) + np.random.default_rng(9).normal(0, 0.05, drive.size)
    assert noise_floor(Record(drive, angle)) == pytest.approx(0.05, rel=0.1)


def numbered_from_rest(quarter: int, cycles: int) -> tuple[np.ndarray, np.ndarray]:
    """0 to +2 to -2 to 0, and the numbers of the cycles from 1 on: the first one starts at rest."""
    k = np.arange(4 * quarter * cycles + 1)
    return 2.0 * (1 - np.abs((k / quarter + 1) % 4 - 2)), np.maximum(k - 1, 0) // (4 * quarter) + 1


@pytest.mark.parametrize("cycles", [2, 3, 6])
@pytest.mark.parametrize("noise_deg", [0.0, 0.05])
def test_a_first_stroke_from_rest_is_no_noise(cycles: int, noise_deg: float) -> None:
    """A play starts in the middle: the first stroke is 20 deg/mm x 0.15 mm / 2 from that of later cycles."""
    drive, cycle = numbered_from_rest(50, cycles)
    wheel = np.zeros_like(drive)
    for i in range(1, len(drive)):
        wheel[i] = min(max(wheel[i - 1], drive[i] - 0.075), drive[i] + 0.075)
    angle = 20 * wheel + np.random.default_rng(11).normal(0, noise_deg, drive.size)
    record = Record(drive, angle, cycle=cycle)
    assert noise_floor(record) == pytest.approx(noise_deg, rel=0.1, abs=1e-9)
    assert repeatability_deg(record) == pytest.approx(noise_deg, rel=0.1, abs=1e-9)


def test_a_first_stroke_like_the_others_is_compared() -> None:
    """Of cycles from one state, about one in a thousand is left out; those of a drift differ in every stroke."""
    rng = np.random.default_rng(12)
    drive, cycle = numbered_from_rest(20, 2)
    whole = Record(drive, 20 * drive, cycle=cycle)
    every = _repeats(whole)
    left_out = 0
    for _ in range(500):
        record = replace(whole, angle_deg=20 * drive + rng.normal(0, 0.05, drive.size))
        left_out += _from_one_state(record, every) != every
    assert left_out <= 4
    drifting = replace(whole, angle_deg=20 * drive + 0.5 * cycle + rng.normal(0, 0.05, drive.size))
    assert _from_one_state(drifting, every) == every


# --- real records ----------------------------------------------------------------------------------------------


def test_measured_loops(measured: Path) -> None:
    """Widths against the README of the records: da Vinci tool 4-6 % of range, all loops lag."""
    for load in ("010", "050", "100"):
        record = read_record(measured / f"davinci-tool-load{load}-0.3hz.csv")
        width = loop_width(record.drive, record.angle_deg)
        share = np.median(width.width_deg) / np.ptp(record.angle_deg)
        assert 0.03 < share < 0.07
        assert dissipated_area(record.drive, record.angle_deg) > 0
    probe = read_record(measured / "tee-probe-antero-posterior.csv")
    width = loop_width(probe.drive, probe.angle_deg)
    assert 10 < width.max_deg < 20  # read off a plot of the file
    assert width.at_zero_deg is None  # the steps run from 1360 to 2801


def test_virgin_branch_is_not_part_of_the_noise(measured: Path) -> None:
    """The virgin branch of this record ends 4 deg from where the cycles run; repeats agree far better."""
    record = read_record(measured / "surgical-manipulator-0-80.csv")
    assert noise_floor(record) < 0.3


def trials(count, seed, step=0.02):
    """Trials that load to 1 at drives of their own, 25 each, and their numbers."""
    rng = np.random.default_rng(seed)
    even = np.linspace(0, 1, 25)[1:-1]
    drive = np.concatenate([np.concatenate([[0.0], even + rng.uniform(-step, step, 23), [1.0]]) for _ in range(count)])
    return drive, np.repeat(np.arange(1, count + 1), 25), rng


def test_repeatability_of_white_noise_and_of_trials_that_differ_as_a_whole():
    """White noise of 0.05 deg; trials whose slope differs by 1 deg have a deviation of sqrt(mean of drive^2), 0.58."""
    drive, trial, rng = trials(40, 1)
    white = Record(drive, 30 * drive + rng.normal(0, 0.05, drive.size), drive_unit="N", cycle=trial)
    assert repeatability_deg(white) == pytest.approx(0.05, rel=0.1)
    slope = 30 + rng.normal(0, 1.0, 40)
    whole = Record(drive, slope[trial - 1] * drive, drive_unit="N", cycle=trial)
    assert repeatability_deg(whole) == pytest.approx(np.sqrt(np.mean(np.linspace(0, 1, 25) ** 2)), rel=0.2)
    assert noise_floor(whole) > repeatability_deg(whole)


def test_repeatability_takes_a_drift_out_and_needs_two_cycles():
    drive, trial, rng = trials(8, 2)
    noise = rng.normal(0, 0.05, drive.size)
    drifting = Record(drive, 30 * drive + 0.5 * trial + noise, drive_unit="N", cycle=trial)
    assert repeatability_deg(drifting) == pytest.approx(0.05, rel=0.2)
    assert noise_floor(drifting) > 1.0
    first = trial == 1
    assert repeatability_deg(Record(drive[first], drive[first], drive_unit="N", cycle=trial[first])) is None


def cycles_with(change, rng: np.random.Generator) -> Record:
    """Four cycles of a loop with noise of 0.05 deg, and a change of the angle along the samples."""
    k = np.arange(480)
    phase = 2 * np.pi * k / 120
    angle = 10 * np.sin(phase) + 0.3 * np.cos(phase) + rng.normal(0, 0.05, k.size)
    return Record(drive=np.sin(phase), angle_deg=angle + change(k), cycle=1 + k // 120)


def test_a_leap_between_cycles_is_found_where_it_is_and_left_out_of_repeatability() -> None:
    rng = np.random.default_rng(3)
    for at, size in [(150, 0.8), (300, -0.6), (390, 1.2)]:
        record = cycles_with(lambda k, at=at, size=size: size * (k >= at), rng)
        leap = leap_between_cycles(record)
        assert abs(leap.sample - at) <= 3
        assert leap.size_deg == pytest.approx(size, rel=0.1)
        assert leap.sudden
        assert repeatability_deg(record) == pytest.approx(0.05, rel=0.25)


def test_counts_that_are_lost_are_a_leap_of_the_drive() -> None:
    record = cycles_with(lambda k: 0.0 * k, np.random.default_rng(4))
    leap = leap_between_cycles(replace(record, drive=record.drive + 0.06 * (np.arange(480) >= 260)))
    assert abs(leap.sample - 260) <= 8


def test_what_changes_between_two_cycles_is_not_sudden() -> None:
    """A joint that settles within one cycle is off by a constant from the next one on."""
    leap = leap_between_cycles(cycles_with(lambda k: 0.8 * (k >= 120), np.random.default_rng(4)))
    assert not leap.sudden


def test_a_first_stroke_from_the_middle_of_a_play_is_no_leap() -> None:
    """Over the first half of the play nothing moves, and all later strokes are off by 2.7 deg. That had counted as a
    sudden leap in sample 6; one in the second cycle that is larger still does."""
    k = np.arange(480)
    drive = np.sin(2 * np.pi * k / 120)
    width, out, at = 0.8, np.empty(480), 0.0
    for i, x in enumerate(drive):
        at = min(max(at, x - width / 2), x + width / 2)
        out[i] = at
    angle = 10 * out + np.random.default_rng(1).normal(0, 0.02, 480)
    record = Record(drive=drive, angle_deg=angle, cycle=1 + k // 120)
    assert leap_between_cycles(record) is None
    leap = leap_between_cycles(replace(record, angle_deg=angle + 3.0 * (k >= 200)))
    assert abs(leap.sample - 200) <= 3
    assert leap.sudden
    to_and_fro = np.r_[0.0, -0.04, -0.09, -0.04]  # a motor that takes hold
    late = replace(
        record,
        drive=np.r_[to_and_fro, drive],
        angle_deg=np.r_[np.full(4, angle[0]), angle],
        cycle=np.r_[np.zeros(4, dtype=int), record.cycle],
    )
    assert len(branches(late.drive)) == len(branches(drive)) + 1
    assert leap_between_cycles(late) is None


@pytest.mark.parametrize("slope", [np.ones(30), np.linspace(-1.0, 2.0, 30), np.r_[np.zeros(15), np.ones(15)]])
def test_gains_of_leaps_by_cumulative_sums_are_those_of_their_columns(slope) -> None:
    deviation = np.random.default_rng(2).normal(size=(6, 30))
    deviation -= deviation.mean(axis=0)
    gains = leap_gains(deviation, slope)
    for k, p in product(range(6), range(30)):
        column = np.where((np.arange(6)[:, None] > k) | ((np.arange(6)[:, None] == k) & (np.arange(30) >= p)), slope, 0)
        column = column - column.mean(axis=0)
        square = np.sum(column**2)
        by_column = np.sum(column * deviation) ** 2 / square if square > 1e-12 else 0.0
        assert gains[k, p] == pytest.approx(by_column, abs=1e-12)


def test_leaps_of_many_cycles_are_found_in_no_time() -> None:
    """A column for each instant took 2 s of 100 cycles of 200 phases."""
    deviation = np.random.default_rng(2).normal(0, 0.01, (100, 200))
    deviation[60:] += 0.5
    before = time.perf_counter()
    leap = find_leap(deviation - deviation.mean(axis=0), np.ones(200))
    assert time.perf_counter() - before < 0.3
    assert (leap.cycle, leap.phase) == (60, 0)
    assert leap.size_deg == pytest.approx(0.5, rel=0.01)


@pytest.mark.parametrize("seed", range(5))
def test_drift_wander_and_noise_are_no_leap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    steps = np.convolve(rng.normal(0, 1, 480 + 80), np.ones(81) / 9, "valid")
    changes = [lambda k: 0.0 * k, lambda k: 0.004 * k, lambda k: 0.3 * np.log1p(k), lambda k: 0.3 * steps]
    assert [leap_between_cycles(cycles_with(change, rng)) for change in changes] == [None] * 4
