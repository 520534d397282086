"""Rules of records by definition: loops, folds, leaps, planes, files and messages, on cases counted by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from hysteresis.files import RecordError
from hysteresis.records import leaps, metrics
from hysteresis.records.folds import _excess, inner_folds, without_first_stroke
from hysteresis.records.holdout import Split, _checked, complete_cycles, hold_out, validate_within
from hysteresis.records.path import branches, cycle_slices, find_cycles, require_reversal
from hysteresis.records.planes import coupling, not_used, require_one_wheel, second_plane
from hysteresis.records.record import Record


def cycles_of(count, samples=11, first=1):
    """Cycles from -1 to 1 and back."""
    up = np.linspace(-1, 1, samples)
    one = np.r_[up, up[::-1][1:]]
    drive = np.r_[one, *[one[1:]] * (count - 1)]
    return drive, np.r_[first, np.repeat(np.arange(count) + first, one.size - 1)]


# --- paths ---------------------------------------------------------------------------------------------------------


def test_a_reversal_is_a_way_back_beyond_two_percent_of_the_range():
    for back, count in ((0.019, 1), (0.021, 3)):
        drive = np.array([0.0, 0.5, 0.5 - back, 1.0])
        assert len(branches(drive)) == count
    assert branches(np.array([1.0, 0.5, 0.519, 0.0])) == [slice(0, 4)]
    assert branches(np.array([0.0, 1.0, 1.0, 0.0])) == [slice(0, 2), slice(1, 4)]  # of equal samples the first turns
    assert branches(np.array([0.0, 0.9e-9, 0.0])) == [slice(0, 3)]
    assert branches(np.array([0.0, 1.1e-9, 0.0])) == [slice(0, 2), slice(1, 3)]


def test_a_cycle_includes_the_sample_before_it_unless_the_drive_was_reset():
    number = np.array([0, 0, 1, 1, 2, 2])
    assert cycle_slices(np.array([0.0, 1, 1, 0, 0, 1]), number) == [
        (0, slice(0, 2)),
        (1, slice(1, 4)),
        (2, slice(3, 6)),
    ]
    for jump, start in ((0.49, 2), (0.51, 3)):  # of the range from one cycle to the next
        drive = np.array([0.0, 0.5, 1.0, 1.0 - jump, 1.0, 0.0])
        found = cycle_slices(drive, np.array([1, 1, 1, 2, 2, 2]))
        assert found == [(1, slice(0, 3)), (2, slice(start, 6))]


def test_trials_that_only_load_never_reverse():
    drive = np.tile([0.0, 0.5, 1.0], 3)
    with pytest.raises(RecordError, match="never reverses"):
        require_reversal(Record(drive, drive, cycle=np.repeat([1, 2, 3], 3)))
    require_reversal(Record(np.r_[drive, 0.5], np.r_[drive, 0.5], cycle=np.repeat([1, 2, 3], [3, 3, 4])))


@pytest.mark.parametrize(
    ("drive", "angle", "numbers"),
    [
        ([0, 1, 2], [0, 1, 2], [0, 0, 0]),
        ([0, 2, 0.11], [0, 2, 9], [0, 0, 1]),  # further off than 5 % of the range: an approach
        ([0, 2, 0.09], [0, 2, 9], [1, 1, 1]),  # one loop, at whatever angle
        ([0, 2, 0, 2, 0], [0, 2, 0.03, 2, 0], [1, 1, 1, 2, 2]),  # the angle returns, too: within 2 % of its range
        ([0, 2, 0, 2, 0], [0, 2, 0.05, 2, 0], [0, 0, 1, 1, 2]),  # a virgin branch
        ([0, 2, -2, 0], [0, 2, -2, 5], [1, 1, 1, 1]),  # one loop from the middle
    ],
)
def test_cycles_by_drive_and_angle(drive, angle, numbers):
    assert find_cycles(np.array(drive, dtype=float), np.array(angle, dtype=float)).tolist() == numbers


# --- training and held-out samples ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("back", "complete"), [(0.49, [1]), (0.51, [])])
def test_a_cycle_is_complete_if_it_returns_half_way(back, complete):
    drive = np.r_[np.linspace(0, 1, 11), np.linspace(1, back, 11)[1:]]
    assert complete_cycles(Record(drive, drive, cycle=np.ones(21, dtype=int))) == complete
    assert complete_cycles(Record(drive, drive, cycle=np.zeros(21, dtype=int))) == []


@pytest.mark.parametrize(("count", "first"), [(2, 2), (3, 3), (5, 5), (6, 5), (9, 7)])
def test_the_last_third_of_the_cycles_is_held_out(count, first):
    drive, number = cycles_of(count)
    record = Record(drive, drive, cycle=number)
    split = hold_out(record)
    assert split.heldout.tolist() == (number >= first).tolist()
    assert split.train.tolist() == (number < first).tolist()
    words = f"cycle {first}," if first == count else f"cycles {first} to {count},"
    assert split.by.startswith(words)
    if count == 9:
        inner = validate_within(record, split)
        assert (inner.heldout.tolist(), inner.train.tolist()) == ((number == 6).tolist(), (number < 6).tolist())


def test_blocks_of_one_cycle_are_tenths_of_the_range():
    """A sample in the middle of each tenth, up and down: 2 and 7 up, 4 and 9 down; inside them 5, 10, 1 and 6."""
    up = np.r_[0.0, np.arange(0.5, 10), 10.0]
    drive = np.r_[up, up[::-1][1:]]
    record = Record(drive, drive, cycle=np.ones(drive.size, dtype=int))
    with pytest.raises(RecordError, match="19 samples to fit and 4 to hold out: expected at least 20 and 3"):
        hold_out(record)
    up = np.r_[0.0, np.repeat(np.arange(0.5, 10), 2), 10.0]
    drive = np.r_[up, up[::-1][1:]]
    record = Record(drive, drive, cycle=np.ones(drive.size, dtype=int))
    split = hold_out(record)
    assert drive[split.heldout].tolist() == [1.5, 1.5, 6.5, 6.5, 8.5, 8.5, 3.5, 3.5]
    assert split.by.startswith("blocks of a tenth of the drive's range, 2 and 7 on rising and 4 and 9 on falling")
    inner = validate_within(record, split)
    assert drive[inner.heldout].tolist() == [4.5, 4.5, 9.5, 9.5, 5.5, 5.5, 0.5, 0.5, 0]
    assert not (inner.heldout & ~split.train).any()


def test_twenty_samples_to_fit_and_three_to_hold_out_are_enough():
    for train, heldout, good in ((20, 3, True), (19, 3, False), (20, 2, False)):
        split = Split(np.arange(40) < train, np.arange(40) < heldout, "")
        if good:
            assert _checked(None, split) is split
        else:
            with pytest.raises(RecordError, match=f"record: {train} samples to fit and {heldout} to hold out"):
                _checked(SimpleNamespace(source=""), split)


@pytest.mark.parametrize(("count", "folds"), [(2, [2]), (3, [2, 3]), (5, [2, 3, 4, 5]), (7, [4, 5, 6, 7])])
def test_folds_are_cycles_predicted_from_those_before(count, folds):
    drive, number = cycles_of(count)
    everything = Split(np.ones(drive.size, dtype=bool), np.zeros(drive.size, dtype=bool), "")
    found = inner_folds(Record(drive, drive, cycle=number), everything)
    if count == 2:
        assert [one.heldout.tolist() for one in found] == [(number == n).tolist() for n in (1, 2)]
        assert [one.train.tolist() for one in found] == [(number != n).tolist() for n in (1, 2)]
    else:
        assert [one.heldout.tolist() for one in found] == [(number == n).tolist() for n in folds]
        assert [one.train.tolist() for one in found] == [(number < n).tolist() for n in folds]
        assert found[0].by == f"{len(folds)} folds, each a cycle predicted from those before it"


def test_a_fold_of_fewer_than_three_samples_is_left_out():
    drive, number = cycles_of(2)
    for samples, folds in ((3, 2), (2, 1)):
        train = (number == 1) | (np.arange(drive.size) < np.flatnonzero(number == 2)[0] + samples)
        assert len(inner_folds(Record(drive, drive, cycle=number), Split(train, ~train, ""))) == folds


@pytest.mark.parametrize(("off", "left_out"), [(0.99, False), (1.01, True)])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_first_stroke_is_left_out_where_it_is_outside_the_later_loops(off, left_out, side):
    """By more than 5 % of the range of the angle, 20 deg: 1 deg beyond a band of no width."""
    up = np.linspace(-1, 1, 101)
    drive = np.r_[up, up[::-1][1:], up[1:]]
    number = np.repeat([0, 1], [101, 200])
    angle = np.where(np.abs(drive) > 0.5, 10 * np.sign(drive), 0.0)
    angle[:101][np.abs(up) < 0.1] = side * off
    record = Record(drive, angle, cycle=number)
    everything = Split(np.ones(301, dtype=bool), np.zeros(301, dtype=bool), "by")
    split, word = without_first_stroke(record, everything)
    assert (word is not None) is left_out
    assert split.train.tolist() == ((number > 0) if word else everything.train).tolist()


def test_the_excess_of_a_first_stroke_is_of_its_median_beyond_the_band():
    """Ten later samples at each of fifty places, one deg about 0; the first stroke is 3 deg above at one place."""
    drive = np.r_[np.arange(50.0), np.arange(50.0)[::-1], np.arange(50.0)]
    angle = np.r_[np.zeros(50), np.full(50, 1.0), np.full(50, -1.0)]
    first = np.arange(150) < 50
    assert _excess(Record(drive, angle), first, ~first) == 0.0
    for value, excess in ((4.0, 3.0), (-4.0, 3.0)):
        angle[20] = value
        assert _excess(Record(drive, angle), first, ~first) == excess


@pytest.mark.parametrize(("share", "left_out"), [(0.31, True), (0.29, False)])
def test_a_first_stroke_that_is_most_of_the_samples_stays(share, left_out):
    later = round(200 * share)
    drive = np.r_[np.linspace(-1, 1, 200 - later), np.linspace(1, -1, later)]
    number = np.repeat([0, 1], [200 - later, later])
    angle = np.where(number == 0, 10.0 + 10 * drive, 10 * drive)
    record = Record(drive, angle, cycle=number)
    _, word = without_first_stroke(record, Split(np.ones(200, dtype=bool), np.zeros(200, dtype=bool), ""))
    assert (word is not None) is left_out


# --- loops and noise -----------------------------------------------------------------------------------------------


def test_the_width_of_a_loop_is_over_drives_that_both_branches_cover():
    """Up from 0 to 4, down to 1: 1 to 4; 2 deg apart at 3, where it is widest; None at 0."""
    x = np.array([0.0, 1, 2, 3, 4, 3, 2, 1])
    y = np.array([0.0, 1, 2, 3, 4, 5, 3, 1])
    one = metrics._cycle_over(x, slice(0, 8))
    width = metrics.LoopsOverDrive(x, one.grid, np.ones(4, dtype=int), (one,)).width(y).width_deg
    assert (one.grid.tolist(), width.tolist()) == ([1, 2, 3, 4], [0, 1, 2, 0])
    found = metrics.loop_width(np.r_[x, 0], np.r_[y, 0], np.ones(9, dtype=int))
    assert (found.max_deg, found.at_drive, found.at_zero_deg) == (2.0, 3.0, 0.0)
    shifted = metrics.loop_width(np.r_[x, 0] + 1, np.r_[y, 0], np.ones(9, dtype=int))
    assert shifted.at_zero_deg is None
    assert metrics._cycle_over(np.array([0.0, 1.0, 0.5, 1.5]), slice(0, 4)).grid.tolist() == [0.5, 1.0]


def test_the_area_of_a_parallelogram():
    """From (0, 0) to (2, 2), (1.96, 3), (-0.04, 1) and back: cross product of (2, 2) and (-0.04, 1)."""
    x, y = np.array([0.0, 2.0, 1.96, -0.04, 0.0]), np.array([0.0, 2.0, 3.0, 1.0, 0.0])
    number = np.ones(5, dtype=int)
    assert metrics.dissipated_area(x, y, number) == pytest.approx(2.08)
    assert metrics.dissipated_area(x, -y, number) == pytest.approx(2.08)


def test_interpolated_noise_has_the_squares_of_its_weights():
    grid, x = np.array([0.0, 0.25, 1.5, 2.0]), np.array([0.0, 1.0, 2.0])
    value, factor = metrics._interpolate(grid, x, np.array([0.0, 4.0, 0.0]))
    assert value.tolist() == [0, 1, 2, 0]
    assert factor.tolist() == [1, 0.75**2 + 0.25**2, 0.5, 1]
    value, factor = metrics._interpolate(grid, np.array([1.0]), np.array([3.0]))
    assert (value.tolist(), factor.tolist()) == ([3.0] * 4, [1.0] * 4)


def test_samples_that_go_back_are_left_out_of_a_branch():
    x, y = metrics._monotone(np.array([3.0, 2.0, 2.5, 2.0, 1.0]), np.arange(5.0))
    assert (x.tolist(), y.tolist()) == ([-3, -2, -1], [0, 1, 4])
    drive = np.array([0.0, 1, 2, 3, 4])
    record = Record(drive, 2 * drive)
    grid, angles, factors = metrics._at_equal_drive(record, [slice(0, 4), slice(1, 5)])
    assert (grid.tolist(), angles.tolist(), factors.tolist()) == ([1, 2, 3], [[2, 4, 6]] * 2, [[1, 1, 1]] * 2)


def test_noise_of_one_path_is_that_of_second_differences_by_their_spacing():
    """Steps of 1 and 3: the middle is a quarter of the way, so that the variance is 1 + (3/4)^2 + (1/4)^2."""
    found = metrics._local_noise(np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0, 0.0]))
    assert found == pytest.approx(1.4826 / math.sqrt(1 + 0.75**2 + 0.25**2))
    still = metrics._local_noise(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    assert still == pytest.approx(1.4826 / math.sqrt(1.5))
    with pytest.raises(ValueError, match="2 samples: expected at least 3"):
        metrics._local_noise(np.zeros(2), np.zeros(2))


@pytest.mark.parametrize("count", [3, 4, 5])
def test_repeatability_of_levels_that_drift(count):
    """Levels 0, 2, 4, ...: their deviation with K - 1; from four cycles on a straight drift is taken out with K - 2.

    Of 22 samples of a cycle, the first one has the level of the cycle before.
    """
    drive, number = cycles_of(count)
    record = Record(drive, 10 * drive + 2.0 * (number - 1), cycle=number)
    parts = metrics._deviations(record, metrics._repeats(record))
    assert [part.drives.size for part in parts] == [11, 11]
    assert parts[1].drives.tolist() == pytest.approx(np.linspace(1, -1, 11).tolist())
    assert parts[1].slope.tolist() == pytest.approx([10.0] * 11)
    levels = 2.0 * np.arange(count)
    rows = np.repeat(levels[:, None], 22, axis=1)
    rows[1:, 0] -= 2.0
    rows -= rows.mean(axis=0)
    level = rows.mean(axis=1)
    straight = np.polyval(np.polyfit(np.arange(count), level, 1), np.arange(count))
    of_levels = np.sum((level - straight) ** 2) / (count - 2) if count >= 4 else level.var(ddof=1)
    of_shape = np.sum((rows - level[:, None]) ** 2) / ((count - 1) * 22)
    assert metrics.repeatability_deg(record) == pytest.approx((of_levels + of_shape) ** 0.5, rel=1e-9)


# --- leaps ---------------------------------------------------------------------------------------------------------


def test_a_column_of_a_leap_is_one_from_its_phase_on():
    column = leaps._column(np.ones(4), 3, 1, 2)
    raw = np.array([[0, 0, 0, 0], [0, 0, 1, 1], [1, 1, 1, 1]], dtype=float)
    np.testing.assert_allclose(column, raw - raw.mean(axis=0))
    assert leaps._gain(column, column) == pytest.approx(np.sum(column**2))
    assert leaps._gain(column, 0 * column) == 0.0


@pytest.mark.parametrize(("share", "found"), [(0.14, True), (0.16, False)])
def test_a_leap_leaves_little_of_what_a_drift_leaves(share, found):
    """A leap of 2 deg and a remainder that is orthogonal to it and to a drift: ``share`` of what the drift leaves."""
    count, phases = 2, 8
    column = leaps._column(np.ones(phases), count, 0, 4)
    rest = np.tile([1.0, -1.0], phases // 2) * np.array([[1.0], [-1.0]])
    drift = np.repeat([[-0.5], [0.5]], phases, axis=1)
    whole = 4 * np.sum(column**2)
    of_drift = 4 * np.sum(column * drift) ** 2 / np.sum(drift**2)
    # r / (whole + r - of_drift) = share
    r = share * (whole - of_drift) / (1 - share)
    deviation = 2 * column + rest * math.sqrt(r / np.sum(rest**2))
    leap = leaps.find_leap(deviation, np.linspace(-1, 1, phases) ** 3)
    assert (leap is not None) is found
    if leap is not None:
        assert (leap.cycle, leap.phase, leap.of_angle, leap.size_deg) == (0, 4, True, pytest.approx(2.0))
        np.testing.assert_allclose(leap.left, deviation - 2 * column, atol=1e-12)
    assert leaps.find_leap(np.zeros((2, 4)), np.ones(4)) is None


def test_leaps_are_tried_at_two_hundred_phases():
    deviation = 1.0 * leaps._column(np.ones(1000), 2, 0, 505)
    assert leaps.find_leap(deviation, np.zeros(1000)).phase == 505
    off = leaps.find_leap(leaps._column(np.ones(1000), 2, 0, 503), np.zeros(1000))
    assert off.phase in (500, 505)


# --- planes --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("part", "refused"), [(0.09, False), (0.11, True)])
def test_a_tendon_is_pulled_from_a_tenth_of_the_force_on(part, refused):
    force = np.array([0.0, 1, 2, 1, 0])
    record = Record(force, force, drive_unit="N", tension_d_N=5 + part * force)
    if refused:
        with pytest.raises(RecordError, match=r"record: columns\.tension_d: this tendon is pulled"):
            require_one_wheel(record)
    else:
        require_one_wheel(record)
    require_one_wheel(Record(force, force, tension_d_N=force))


def test_the_second_plane_of_a_record():
    drive = np.array([0.0, 1, 2])
    one = Record(
        np.zeros(3), np.array([0.0, 0.5, 1.0]), drive_2=drive, angle_2_deg=3 * drive, tension_c_N=drive + 1,
        tension_d_N=5 - drive, torsion_deg=np.array([0.0, -0.75, 0.5]), source="a.csv",
    )  # fmt: skip
    other = second_plane(one)
    assert (other.plane, other.drive.tolist(), other.angle_deg.tolist()) == (2, [0, 1, 2], [0, 3, 6])
    assert (other.tension_a_N.tolist(), other.tension_b_N.tolist()) == ([1, 2, 3], [5, 4, 3])
    assert (other.drive_2.tolist(), other.angle_2_deg.tolist()) == ([0, 0, 0], [0, 0.5, 1.0])
    assert (other.tension_c_N, other.tension_d_N) == (None, None)
    found = coupling(other)
    assert (found.share, found.largest_deg, found.torsion_deg) == pytest.approx((0.5 / 3, 1.0, 0.75))
    assert coupling(Record(drive, drive)) is None
    assert coupling(Record(drive, np.ones(3), angle_2_deg=drive)) is None
    assert math.isnan(coupling(Record(drive, drive, angle_2_deg=drive)).torsion_deg)
    assert not_used(one).startswith("a.csv: angle_2, torsion, tension_c, tension_d: not used")
    assert not_used(Record(drive, drive)) == ""
    for change in ({"drive": drive}, {"drive_3": drive}, {"drive_4": drive}):
        fields = {"drive": np.zeros(3), "angle_deg": drive, "drive_2": drive, "angle_2_deg": drive, **change}
        with pytest.raises(RecordError, match=f"columns.{next(iter(change))}: this wheel moves"):
            second_plane(Record(**fields))
