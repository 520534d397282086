"""Loops, folds, held-out samples, noise and leaps by their definitions."""

from itertools import pairwise

import numpy as np
import pytest

from hysteresis.records import leaps, metrics
from hysteresis.records.backbone import backbone_of, is_thin
from hysteresis.records.folds import _block_masks, _excess, inner_folds, without_first_stroke
from hysteresis.records.holdout import Split, complete_cycles, hold_out, validate_within
from hysteresis.records.path import branches
from hysteresis.records.record import Record


def way(*turns, step=1.0):
    """Drives from turn to turn in equal steps."""
    parts = [np.linspace(a, b, round(abs(b - a) / step) + 1)[1:] for a, b in pairwise(turns)]
    return np.concatenate([[turns[0]], *parts])


def loops(*ranges, step=1.0):
    """A cycle from 0 to each of some drives and back, and their numbers; the first sample is of cycle 1."""
    ways = [way(0.0, top, 0.0, step=step)[1:] for top in ranges]
    return np.concatenate([[0.0], *ways]), np.r_[1, np.repeat(np.arange(len(ranges)) + 1, [w.size for w in ways])]


def all_of(size, by=""):
    return Split(np.ones(size, dtype=bool), np.zeros(size, dtype=bool), by)


# --- the curve that a loop lies around -----------------------------------------------------------------------------


@pytest.mark.parametrize(("ranges", "inner"), [((20.0, 14.0), 2), ((14.0, 20.0), 1), ((20.0, 18.0), 2)])
def test_inner_loops_give_no_part_of_the_curve_wherever_they_come(ranges, inner):
    drive, cycle = loops(*ranges)
    middle = backbone_of(Record(drive, 3 * drive + 5.0 * (cycle == inner), cycle=cycle))
    full = (cycle != inner) & (drive > 0)
    np.testing.assert_allclose(middle[full], 3 * drive[full], atol=1e-9)


def test_a_cycle_over_nineteen_twentieths_of_the_range_gives_its_part_of_the_curve():
    """Both cycles count at 10: 30 deg and 34 deg."""
    drive, cycle = loops(20.0, 19.0)
    middle = backbone_of(Record(drive, 3 * drive + 4.0 * (cycle == 2), cycle=cycle))
    np.testing.assert_allclose(middle[drive == 10], 32.0)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize(("turn", "angle"), [(99.4, 5.0), (98.6, 2.5)])
def test_a_turning_point_within_a_hundredth_of_an_end_is_of_both_directions(mirrored, turn, angle):
    """All angles are 0 but that of the second turning point, 5 deg: further inside it is of the rising branch alone."""
    to = np.arange(0.0, 100.0, 4.0)
    drive = np.r_[to, 100.0, to[::-1], to[1:], turn, to[::-1]]
    angle_deg = np.where(drive == turn, 5.0, 0.0)
    cycle = np.repeat([1, 2], [2 * to.size + 1, 2 * to.size])
    record = Record(40.0 - drive if mirrored else drive - 60.0, angle_deg, cycle=cycle)
    np.testing.assert_allclose(backbone_of(record)[angle_deg > 0], angle, atol=1e-9)


def test_three_samples_have_a_curve():
    """0 and 4 deg at the drive 0, one angle at the turn."""
    record = Record(np.array([0.0, 10.0, 0.0]), np.array([0.0, 10.0, 4.0]), cycle=np.ones(3, dtype=int))
    assert backbone_of(record).tolist() == pytest.approx([2.0, 10.0, 2.0])
    assert backbone_of(Record(np.arange(9.0), np.arange(9.0))) is None
    assert backbone_of(Record(-np.arange(9.0), np.arange(9.0))) is None


def test_a_curve_goes_on_as_the_branch_that_has_samples():
    """Up to 10 and back to 4, 3 deg apart: the middle at 4 is 9.5 deg, and the curve rises by 2 deg a unit."""
    drive = way(0.0, 10.0, 4.0)
    angle = 2 * drive + 3.0 * (np.arange(drive.size) > 10)
    middle = backbone_of(Record(drive, angle, cycle=np.ones(drive.size, dtype=int)))
    assert middle[:5].tolist() == pytest.approx([1.5, 3.5, 5.5, 7.5, 9.5])
    assert middle[10] == pytest.approx(20.0)


def test_a_loop_is_thin_below_fifteen_hundredths_of_the_angle():
    drive = np.array([0.0, 1.0, 2.0, 1.0])
    record = Record(drive, np.array([0.0, 10.0, 20.0, 13.0]))
    assert not is_thin(record, np.array([0.0, 10.0, 20.0, 10.0]))  # 3 deg of 20
    assert is_thin(record, np.array([0.0, 10.0, 20.0, 10.001]))


# --- folds ---------------------------------------------------------------------------------------------------------


def test_folds_of_one_cycle_are_tenths_that_differ_up_and_down():
    """Four folds: two tenths, five apart, on the way up and two others on the way down."""
    up = (np.arange(10) + 0.5) / 10
    drive = -3.0 + 4.0 * np.r_[0.0, up, 1.0, up[::-1], 0.0]
    rising, falling = slice(1, 11), slice(12, 22)
    tenths = [(np.flatnonzero(m[rising]), np.flatnonzero(m[falling][::-1])) for m in _block_masks(drive)]
    expected = [([4, 9], [0, 5]), ([0, 5], [2, 7]), ([2, 7], [4, 9]), ([3, 8], [1, 6])]
    assert [(a.tolist(), b.tolist()) for a, b in tenths] == expected


@pytest.mark.parametrize("hidden", [1, 3])
def test_a_cycle_without_training_samples_is_no_fold(hidden):
    """Of three cycles one is held out; each of the other two is predicted from the other."""
    drive, cycle = loops(10.0, 10.0, 10.0)
    found = inner_folds(Record(drive, drive, cycle=cycle), Split(cycle != hidden, cycle == hidden, ""))
    left = [n for n in (1, 2, 3) if n != hidden]
    assert [one.by for one in found] == ["2 folds, each a cycle predicted from the other"] * 2
    assert [np.unique(cycle[one.heldout]).tolist() for one in found] == [[n] for n in left]
    assert [np.unique(cycle[one.train]).tolist() for one in found] == [[n] for n in left[::-1]]


def test_a_first_stroke_that_itself_reverses_stays():
    drive = np.concatenate([way(0.0, 8.0, 4.0), way(4.0, 10.0, 0.0, 10.0)[1:]])
    cycle = np.repeat([0, 1], [13, drive.size - 13])
    record = Record(drive, drive + 9.0 * (cycle == 0), cycle=cycle)
    assert without_first_stroke(record, all_of(drive.size))[1] is None
    single = Record(drive[8:], (drive + 9.0 * (cycle == 0))[8:], cycle=cycle[8:])
    split, word = without_first_stroke(single, all_of(drive.size - 8))
    assert "up to 9 deg outside" in word
    assert split.train.tolist() == (cycle[8:] > 0).tolist()


@pytest.mark.parametrize(("off", "left_out"), [(1.0, False), (1.0 + 1e-9, True)])
def test_a_first_stroke_just_five_percent_outside_stays(off, left_out):
    """A twentieth of 20 deg is 1 deg."""
    drive = np.r_[np.linspace(-1, 1, 101), np.linspace(1, -1, 101)[1:]]
    cycle = np.repeat([0, 1], [101, 100])
    angle = np.where(np.abs(drive) > 0.5, 10.0 * np.sign(drive), 0.0)
    angle[:101][np.abs(drive[:101]) < 0.1] = off
    _, word = without_first_stroke(Record(drive, angle, cycle=cycle), all_of(201))
    assert (word is not None) is left_out


@pytest.mark.parametrize(("later", "left_out"), [(60, True), (59, False)])
def test_three_tenths_of_the_samples_are_enough_behind_a_first_stroke(later, left_out):
    drive = np.r_[np.linspace(-1, 1, 140), np.linspace(1, -1, later)]
    cycle = np.repeat([0, 1], [140, later])
    record = Record(drive, 10 * drive + 10.0 * (cycle == 0), cycle=cycle)
    split = Split(np.arange(drive.size) < 200, np.arange(drive.size) >= 200, "")
    assert (without_first_stroke(record, split)[1] is not None) is left_out


def test_the_band_of_later_angles_is_of_a_fiftieth_and_its_neighbours():
    """The first stroke is 4 deg at one fiftieth, later ones 1 deg beside it and 4 deg two further on."""
    centre = lambda i: -2.0 + 8.0 * (i + 0.5) / 50  # noqa: E731
    drive = np.array([-2.0, centre(20), centre(21), centre(22), 6.0])
    first = np.arange(5) == 1
    for angles, excess in (([0, 4, 1, 4, 0], 3.0), ([0, 4, 5, 4, 0], 1.0), ([0, 4, 4, 1, 0], 0.0)):
        record = Record(drive, np.array(angles, dtype=float))
        assert _excess(record, first, ~first) == excess
        mirrored = Record((4.0 - drive)[::-1], np.array(angles[::-1], dtype=float))
        assert _excess(mirrored, first[::-1], ~first[::-1]) == excess


def test_the_end_of_the_drive_is_of_the_last_fiftieth():
    """3 deg at the very end; beside the last fiftieth later angles are 0, two below it 2.5 deg."""
    drive = np.array([0.0, 0.95, 0.97, 1.0])
    first = np.arange(4) == 3
    assert _excess(Record(drive, np.array([0.0, 2.5, 0.0, 3.0])), first, ~first) == 3.0


# --- training and held-out samples ---------------------------------------------------------------------------------


def test_the_last_of_two_training_cycles_validates():
    drive, cycle = loops(20.0, 20.0, 20.0)
    record = Record(drive, drive, cycle=cycle)
    inner = validate_within(record, hold_out(record))
    assert (inner.heldout.tolist(), inner.train.tolist()) == ((cycle == 2).tolist(), (cycle == 1).tolist())


def test_one_training_cycle_is_validated_by_blocks_of_its_own_range():
    """Of -10 to 30, the fifth and tenth tenth up, the sixth and first down; a turn is of the branch behind it."""
    drive, cycle = loops(40.0, 40.0)
    drive = drive - 10.0
    record = Record(drive, drive, cycle=cycle)
    inner = validate_within(record, hold_out(record))
    up, down = drive[:40][inner.heldout[:40]], drive[40:81][inner.heldout[40:81]]
    assert up.tolist() == [6, 7, 8, 9, 26, 27, 28, 29]
    assert down.tolist() == [13, 12, 11, 10, -7, -8, -9]
    assert not inner.heldout[cycle == 2].any()


def test_a_cycle_of_which_a_sample_is_hidden_does_not_validate():
    drive, cycle = loops(20.0, 20.0, 20.0)
    record = Record(drive, drive, cycle=cycle)
    train = np.arange(drive.size) != drive.size - 1
    inner = validate_within(record, Split(train, ~train, ""))
    assert np.unique(cycle[inner.heldout]).tolist() == [2, 3]
    assert np.unique(cycle[inner.train]).tolist() == [1]


def test_a_cycle_that_returns_just_half_way_is_complete():
    drive = way(0.0, 10.0, 5.0)
    assert complete_cycles(Record(drive, drive, cycle=np.ones(drive.size, dtype=int))) == [1]
    assert complete_cycles(Record(np.arange(9.0), np.arange(9.0), cycle=np.ones(9, dtype=int))) == []
    still = Record(np.array([0.0, 4, 0, 0, 0]), np.zeros(5), cycle=np.array([1, 1, 1, 2, 2]))
    assert complete_cycles(still) == [1]


# --- loops and noise -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("low", "at_zero"), [(0.0, 0.0), (-4.0, 0.0), (-2.0, 1.0), (0.5, None), (-4.5, None)])
def test_the_width_at_zero_drive_is_given_up_to_the_ends_of_the_loop(low, at_zero):
    """A slit over a drive range of 4 that is 1 deg wide but at its two ends."""
    drive = low + way(0.0, 4.0, 0.0)
    angle = np.array([0.0, 1, 2, 3, 4, 4, 3, 2, 0])
    found = metrics.loop_width(drive, angle, np.ones(9, dtype=int))
    assert found.drive.tolist() == (low + np.arange(5.0)).tolist()
    assert found.width_deg.tolist() == pytest.approx([0, 1, 1, 1, 0])
    assert (found.max_deg, found.at_drive, found.at_zero_deg) == (1.0, low + 1.0, at_zero)


def test_the_width_at_a_drive_is_the_mean_of_the_cycles_that_reach_it():
    """Loops to 4 with a width of 1 deg and to 6 with one of 3 deg: 2 deg up to 4, beyond it 3 deg."""
    drive = np.concatenate([way(0.0, 4.0, 0.0), way(0.0, 6.0, 0.0)[1:]])
    cycle = np.repeat([1, 2], [9, 12])
    falling = np.r_[np.zeros(5), np.ones(3), np.zeros(7), 3 * np.ones(5), 0]
    found = metrics.loop_width(drive, 2 * drive + falling, cycle)
    assert found.width_deg.tolist() == pytest.approx([0, 2, 2, 2, 1.5, 3, 0])
    assert (found.max_deg, found.at_drive) == (pytest.approx(3.0), 5.0)


def test_a_cycle_may_end_one_step_before_its_start():
    """0 to 3 and back to 1, in steps of 1: closed by the step back to 0. In steps of 1 to 1.5 it is not."""
    up = np.array([0.0, 1, 2, 3])
    assert metrics.dissipated_area(np.r_[up, 2, 1], np.r_[up, 3, 2], np.ones(6, dtype=int)) == pytest.approx(2.0)
    with pytest.raises(ValueError, match="no complete cycle"):
        metrics.dissipated_area(np.r_[up, 2, 1.5], np.r_[up, 3, 2.5], np.ones(6, dtype=int))


def test_a_trial_that_ends_on_its_way_back_is_no_cycle_where_the_drive_is_reset():
    """Up to 10 and back to 8, twice: the next trial starts at 0. A way on from 8 makes the first one a cycle."""
    trial = way(0.0, 10.0, 8.0)
    cycle = np.repeat([1, 2], trial.size)
    with pytest.raises(ValueError, match="no complete cycle"):
        metrics.loop_width(np.r_[trial, trial], np.r_[trial, trial], cycle)
    onwards = np.r_[trial, 8.0 + np.arange(1.0, trial.size + 1)]
    assert metrics.loop_width(onwards, onwards, cycle).drive.tolist() == [8, 9, 10]


@pytest.mark.parametrize("offset", [0.0, 100.0, -100.0])
def test_the_zero_of_the_angle_does_not_turn_the_lag_about(offset):
    """A circle with a slope of -0.15: its correlation is beyond -0.1."""
    t = np.linspace(0, 2 * np.pi, 401)
    drive, angle = np.cos(t) + offset, np.sin(t) - 0.15 * np.cos(t) + offset
    assert metrics.dissipated_area(drive, angle) == pytest.approx(-np.pi, rel=1e-3)


@pytest.mark.parametrize(
    ("phase", "sudden"), [(6, False), (7, True), (100, True), (195, True), (196, False), (0, False)]
)
def test_a_leap_is_sudden_from_three_hundredths_of_a_cycle_on(phase, sudden):
    """Cycles of 202 phases, 101 up and 101 down: 3 % are 6.06 of them. The third cycle starts with sample 400."""
    drive, cycle = loops(100.0, 100.0, 100.0, 100.0)
    sample = 400 + phase - (phase > 100)
    record = Record(drive, 0.2 * drive + 0.5 * (np.arange(drive.size) >= sample), cycle=cycle)
    found = metrics.leap_between_cycles(record)
    assert (found.sample, found.sudden, found.size_deg) == (sample, sudden, pytest.approx(0.5))


@pytest.mark.parametrize(("sample", "found"), [(99, False), (101, False), (200, False), (201, True)])
def test_a_leap_of_the_first_two_strokes_is_none(sample, found):
    """Of a practice rig with heavy rings a leap of 0.4 deg was seen amid the second stroke, 15 times the noise."""
    drive, cycle = loops(100.0, 100.0, 100.0, 100.0)
    record = Record(drive, 0.2 * drive - 0.5 * (np.arange(drive.size) >= sample), cycle=cycle)
    leap = metrics.leap_between_cycles(record)
    assert (None if leap is None else leap.sample) == (sample if found else None)


def test_repeatability_behind_a_leap_is_that_of_what_the_leap_leaves():
    """Neighbours are of one branch: the last sample up and the first one down are none of each other."""
    top = way(0.0, 40.0, 0.0)
    between = np.r_[0.0, np.arange(0.5, 40), 40.0]  # in the middle between samples, noise is halved
    drive = np.concatenate([top, between[1:], between[::-1][1:], between[1:], between[::-1][1:]])
    cycle = np.repeat([1, 2, 3], [81, 82, 82])
    rest = 0.1 * np.sin(0.5 * np.arange(drive.size))
    record = Record(drive, 0.2 * drive + rest + 4.0 * (np.arange(drive.size) >= 130), cycle=cycle)
    parts = metrics._deviations(record, metrics._repeats(record))
    assert [part.drives.size for part in parts] == [41, 41]
    left, factors = metrics._leap_of(parts).left, np.hstack([part.factors for part in parts])
    neighbours = sum(left[k, p] * left[k, p + 1] for k in range(3) for p in range(81) if p != 40)
    correlation = neighbours / np.sum(left**2)
    assert 0.1 < correlation < 0.9
    level = left.mean(axis=1)
    squares = level @ level / 2 + np.sum((left - level[:, None]) ** 2) / (2 * 82)
    averaged = np.mean(factors + (1 - factors) * correlation)
    assert metrics.repeatability_deg(record) == pytest.approx(np.sqrt(squares / averaged), rel=1e-9)


def test_one_drive_that_cycles_share_counts():
    """Up at 0 they agree, at 5 the second is 1 deg above, down at 5 it is 1 deg below: squares of 0.5 deg, four."""
    drive = np.array([0.0, 5.0, 10.0, 5.0, 0.0, 5.0, 9.8, 5.0, 0.2])
    angle = 2 * drive + np.array([0, 0, 0, 0, 0, 1, 1, -1, -1])
    record = Record(drive, angle, cycle=np.repeat([1, 2], [5, 4]))
    assert metrics.repeatability_deg(record) == pytest.approx(np.sqrt(4 * 0.25 / 3))
    assert metrics.noise_floor(record) == pytest.approx(np.sqrt(4 * 0.25 / 3))
    slopes = [part.slope.tolist() for part in metrics._deviations(record, metrics._repeats(record))]
    assert slopes == [pytest.approx([2.1, 2.1]), [0.0]]
    value, factor = metrics._interpolate(np.array([0.5]), np.array([0.0, 1.0]), np.array([0.0, 4.0]))
    assert (value.tolist(), factor.tolist()) == ([2.0], [0.5])


def test_the_area_is_the_mean_of_the_closed_cycles_alone():
    """Squares of 2 by 1 and 2 by 3, then a cycle that ends half way, and a way on from there."""
    square = [0.0, 1, 2, 2, 1, 0]
    x = np.array([*square, *square, 0, 1, 2, 1.5, 1, 2, 3])
    y = np.array([0.0, 0, 0, 1, 1, 1, 0, 0, 0, 3, 3, 3, 0, 9, 9, 9, 9, 9, 9])
    cycle = np.repeat([1, 2, 3, 4], [6, 7, 4, 2])
    assert metrics.dissipated_area(x, y, cycle) == pytest.approx((2 + 6) / 2)


def test_cycles_repeat_with_those_that_most_others_are_like():
    """Two cycles to 10 among one to 6 and one with an inner loop: the two alone repeat."""
    parts = [way(0.0, 6.0, 0.0), way(0.0, 10.0, 0.0), way(0.0, 10.0, 5.0, 10.0, 0.0), way(0.0, 10.0, 0.0)]
    drive = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
    cycle = np.r_[1, np.repeat(np.arange(4) + 1, [part.size - 1 for part in parts])]
    record = Record(drive, drive, cycle=cycle)
    first, second = 12, 12 + 20 + 30
    expected = [[slice(at, at + 11), slice(at + 10, at + 21)] for at in (first, second)]
    assert metrics._repeats(record) == expected


def test_cycles_repeat_up_to_just_five_percent_of_their_range():
    """Turning points at 19 and 20: a twentieth of the smaller range is 0.95. Of 20 and 21 it is 1."""
    for tops, count in (((19.0, 20.0), 1), ((20.0, 21.0), 2)):
        drive, cycle = loops(*tops)
        assert len(metrics._repeats(Record(drive, drive, cycle=cycle))) == count
    assert metrics._repeats(Record(np.arange(3.0), np.arange(3.0), cycle=np.zeros(3, dtype=int))) == []
    drive = way(4.0, 10.0, 0.0, 10.0, 0.0)  # the two cycles have all but their start in common
    assert len(metrics._repeats(Record(drive, drive, cycle=np.repeat([1, 2], [17, 20])))) == 1


def test_of_equal_lowest_samples_the_first_one_turns():
    assert branches(np.array([1.0, 0.0, 0.0, 1.0])) == [slice(0, 2), slice(1, 4)]
    assert branches(np.array([3.0, 1.0, 2.0, 0.0, 0.0, 3.0]), tolerance=1.0) == [slice(0, 4), slice(3, 6)]


# --- leaps ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("values", [np.ones(9), np.linspace(-1.0, 2.0, 9)])
def test_a_leap_lowers_the_squares_of_angles_that_have_a_mean_by_as_much(values):
    """The column of a leap has no mean over the cycles, so that the mean of the angles does not count."""
    angles = 3.0 + np.random.default_rng(5).normal(size=(4, 9))
    for k in range(4):
        for p in range(9):
            column = np.outer(np.arange(4) > k, values)
            column[k, p:] = values[p:]
            column = column - column.mean(axis=0)
            square = np.sum(column**2)
            expected = np.sum(column * angles) ** 2 / square if square > 1e-12 else 0.0
            assert leaps.leap_gains(angles, values)[k, p] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("phases", "phase", "size"), [(4, 2, 1.0), (3, 1, 2.0), (3, 1, -0.01), (399, 199, 0.5)])
def test_a_leap_of_any_size_is_found_where_it_is(phases, phase, size):
    """Two cycles: the second is off before the phase at which the first leaps, half the leap from their mean."""
    deviation = np.zeros((2, phases))
    deviation[:, :phase] = [[-size / 2], [size / 2]]
    leap = leaps.find_leap(deviation, np.zeros(phases))
    assert (leap.cycle, leap.phase, leap.of_angle) == (0, phase, True)
    assert leap.size_deg == pytest.approx(size)
    np.testing.assert_allclose(leap.left, 0.0, atol=1e-12)


def test_a_leap_of_the_drive_has_the_size_of_its_mean_change_of_the_angle():
    """Counts of 0.5 that are lost where the slope is 0 to 3 deg a count, as the first of two cycles is half way."""
    slope = np.array([0.0, 1.0, 2.0, 3.0])
    deviation = np.zeros((2, 4))
    deviation[:, :2] = np.outer([-0.25, 0.25], slope[:2])
    leap = leaps.find_leap(deviation, slope)
    assert (leap.cycle, leap.phase, leap.of_angle) == (0, 2, False)
    assert leap.size_deg == pytest.approx(0.5 * 1.5)
