"""Rules of records by definition: loops, folds, leaps, planes, files and messages, on cases counted by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from hysteresis import files, messages, own, plain
from hysteresis.display import from_to, html_table
from hysteresis.files import RecordError
from hysteresis.records import leaps, metrics
from hysteresis.records.folds import _excess, inner_folds, without_first_stroke
from hysteresis.records.holdout import Split, _checked, complete_cycles, hold_out, validate_within
from hysteresis.records.path import branches, cycle_slices, find_cycles, require_reversal
from hysteresis.records.planes import coupling, not_used, require_one_wheel, second_plane
from hysteresis.records.record import Record, bad_cycles
from hysteresis.records.record_file import _parse, _without_repeats, read_record
from hysteresis.records.rows import check_list, is_number, table_of_rows
from hysteresis.records.sidecar import check_rig_tables, toml


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
    grid, width = metrics._profile(x, y)
    assert (grid.tolist(), width.tolist()) == ([1, 2, 3, 4], [0, 1, 2, 0])
    found = metrics.loop_width(np.r_[x, 0], np.r_[y, 0], np.ones(9, dtype=int))
    assert (found.max_deg, found.at_drive, found.at_zero_deg) == (2.0, 3.0, 0.0)
    shifted = metrics.loop_width(np.r_[x, 0] + 1, np.r_[y, 0], np.ones(9, dtype=int))
    assert shifted.at_zero_deg is None
    assert metrics._profile(np.array([0.0, 1.0, 0.5, 1.5]), np.zeros(4))[0].tolist() == [0.5, 1.0]


def test_the_area_of_a_parallelogram_and_the_work_around_it():
    """From (0, 0) to (2, 2), (1.96, 3), (-0.04, 1) and back: cross product of (2, 2) and (-0.04, 1)."""
    x, y = np.array([0.0, 2.0, 1.96, -0.04, 0.0]), np.array([0.0, 2.0, 3.0, 1.0, 0.0])
    number = np.ones(5, dtype=int)
    assert metrics.dissipated_area(x, y, number) == pytest.approx(2.08)
    assert metrics.closed_work_mJ(x, y, number) == pytest.approx(-2.08)
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


# --- values of records and files -----------------------------------------------------------------------------------


def test_limits_of_values():
    for value, good in ((1e9, True), (1.001e9, False)):
        if good:
            assert Record(np.array([0.0, value]), np.zeros(2)).drive[1] == value
        else:
            with pytest.raises(RecordError, match=r"drive: magnitude 1\.001e\+09: expected at most 1e\+09"):
                Record(np.array([0.0, -value]), np.zeros(2))
    assert Record(np.zeros(2), np.zeros(2), time_s=np.array([0.0, 2.0**53])).time_s[1] == 2.0**53
    with pytest.raises(RecordError, match="time_s: magnitude"):
        Record(np.zeros(2), np.zeros(2), time_s=np.array([0.0, 2.0**53 + 2]))
    assert bad_cycles(np.array([0.0, 1, 1, 0.5, 2, 1, -1])).tolist() == [False, False, False, True, False, True, True]
    assert bad_cycles(np.array([-1.0])).tolist() == [False]
    assert bad_cycles(np.array([2.0**53])).tolist() == [True]


def test_rows_of_notches_are_repeated_and_counted():
    rows = [{"depth_mm": 1.0, "width_mm": 2.0, "count": 2}, {"depth_mm": 1.5, "width_mm": 2.0}]
    assert table_of_rows("f", "notch", rows) == {"count": 3, "depth_mm": [1.0, 1.0, 1.5], "width_mm": 2.0}
    assert table_of_rows("f", "notch", [{"a": 1.0, "count": 1000}]) == {"count": 1000, "a": 1.0}
    for bad, words in (
        ([{"a": 1.0, "count": 999}, {"a": 1.0, "count": 2}], "row 2: count = 2"),
        ([{"a": 1.0, "count": 0}], "row 1: count = 0"),
        ([{"a": 1.0}] * 1001, "1,001 rows"),
        ([], "0 rows"),
        ([{"a": 1.0}, {"a": "x"}], r"row 2: a = 'x': expected a number"),
        ([{"a": 1.0}, {}], "row 2: a: missing"),
        ([{"a": 1.0}, {"a": 1.0, "b": 1.0}], "row 2: b = 1.0: expected the keys of row 1"),
        ([{"a": True}, {"a": False}], "row 2: a = False: expected True, as of row 1"),
        ([{"a": "x"}, {"a": "y"}], "row 2: a = 'y': expected 'x', as of row 1"),
    ):
        with pytest.raises(RecordError, match=words):
            table_of_rows("f", "notch", bad)
    assert [is_number(v) for v in (1, 1.5, True, "1", math.inf, 10**400)] == [True, True, False, False, False, False]
    check_list("a", [1.0] * 1000)
    for bad, words in (([], "0 numbers"), ([1.0] * 1001, "1,001 numbers"), ([1.0, "x"], "a of notch 2 = 'x'")):
        with pytest.raises(RecordError, match=words):
            check_list("a", bad)


@pytest.mark.parametrize(
    ("rig", "good"),
    [
        ({"preload_N": 1}, True), ({"preload_N": 0}, False), ({"preload_N": "1"}, False), ({"joints": 1}, True),
        ({"joints": 0}, False), ({"joints": 1.5}, False), ({"joints": True}, False), ({"preset": "x"}, True),
        ({"preset": 1}, False), ({"other": 1}, False),
    ],
)  # fmt: skip
def test_values_of_a_rig(rig, good):
    if good:
        check_rig_tables("f", {"rig": rig})
    else:
        with pytest.raises(RecordError, match=r"f: rig\."):
            check_rig_tables("f", {"rig": rig})


def test_toml_of_plain_values():
    text = toml({"a": 1, "b c": [1.5, True], "t": {"x": "y\x7f"}, "none": {}, "f": np.float64(2)})
    assert text == 'a = 1\n"b c" = [1.5, true]\nf = 2.0\n\n[t]\nx = "y\\u007f"\n'


def test_cells_and_rows_of_a_csv(tmp_path):
    path = tmp_path / "a.csv"

    def parse(*rows, wanted=("b",), clocks=()):
        return _parse(path, ["a", "b"], list(rows), list(wanted), clocks)

    assert parse("1,2", "3,4", wanted=("b", "a", "b"))["b"].tolist() == [2, 4]
    assert parse()["b"].size == 0
    assert parse("1," + "0" * 99 + "2")["b"].tolist() == [2]
    assert parse("x" * 200 + ",2")["b"].tolist() == [2]  # columns that are not wanted may hold anything
    assert parse("1,2e9", clocks=("b",))["b"].tolist() == [2e9]
    for rows, words in (
        (["1,2", "3"], "a.csv:3: 1 fields: expected 2"),
        (["1,2", " "], "a.csv:3: 0 fields: expected 2"),
        (["1,2", "3,4,5"], "a.csv:3: 3 fields: expected 2"),
        (["1," + "0" * 100 + "2"], "a.csv:2: column 'b': 101 characters: expected at most 100"),
        (["1,2", "3,x"], "a.csv:3: column 'b' = 'x': expected a number"),
        (["1,2", "3,1_0"], "a.csv:3: column 'b' = '1_0': expected a number"),
        (["1,2", "3,nan"], "a.csv:3: column 'b' = nan: expected a finite number"),
        (["1,2e9"], r"a.csv:2: column 'b' = 2e9: expected at most 1e\+09 in magnitude"),
    ):
        with pytest.raises(RecordError, match=words):
            parse(*rows)


def test_rows_that_were_logged_twice_are_read_once(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time_s,drive_mm,angle_deg\n0,1,2\n0,1,2\n1,2,3\n2,3,4\n")
    assert read_record(path).time_s.tolist() == [0, 1, 2]
    columns = {"time": ["t"]}
    with pytest.raises(RecordError, match=r"a\.csv:4: column 't' = 0 after 0: expected increasing time"):
        _without_repeats(path, ["0", "1", "2", "3"], {"t": np.array([-1.0, 0, 0, 1])}, columns)
    with pytest.raises(RecordError, match="2 samples: expected at least 3"):
        _without_repeats(path, ["0", "0", "1"], {"t": np.array([0.0, 0, 1])}, columns)
    with pytest.raises(RecordError, match=r"a\.csv:4: column 'c' = 1: expected a whole number that never falls"):
        _without_repeats(path, ["0", "1", "2"], {"c": np.array([1.0, 2, 1])}, {"cycle": ["c"]})


# --- messages, plain values, marks ---------------------------------------------------------------------------------


def test_texts_are_cut_where_they_are_long():
    assert messages.quoted("a" * 78) == repr("a" * 78)
    assert messages.quoted("a" * 79) == repr("a" * 79)[:77] + "..."
    assert messages.as_given("a" * 80) == "a" * 80
    assert messages.as_given("a" * 81) == "a" * 77 + "..."
    assert messages.as_given("a\n") == repr("a\n")
    assert messages.quoted(2**14000) == "an integer of 14001 bits"
    assert messages.quoted([[[[[1]]]]]) == "[[[[...]]]]"
    assert messages.listed(["ab"] * 38, 150) == ", ".join(["ab"] * 38)  # 150 characters
    shown = messages.listed(["ab"] * 39, 150)
    assert shown == ", ".join(["ab"] * 32) + " and 7 more"  # 32 of 4 characters: 128 of 130
    assert messages.listed(["a" * 80, "b"], 20) == "a" * 80 + " and 1 more"
    assert messages.one_line(" a \n b\x00") == "a b\\x00"
    assert messages.one_line("x" * 280) == "x" * 280
    cut = messages.one_line("x" * 200 + "y" * 200)
    assert cut == "x" * 182 + " ... " + "y" * 93
    assert len(cut) == 280


def test_limits_of_plain_values():
    read = lambda kind, value: plain._read(kind, value, "w")  # noqa: E731
    assert read(int, 2**63) == 2**63
    assert read(float, 1e30) == 1e30
    assert read(float, math.inf) == math.inf
    assert math.isnan(read(float, None))
    for kind, value, words in (
        (int, 2**63 + 1, "at most 64 bits"),
        (int, -(2**63) - 1, "at most 64 bits"),
        (int, True, "a whole number"),
        (int, 1.0, "a whole number"),
        (float, 1.1e30, "in magnitude"),
        (bool, 1, "true or false"),
        (str, 1, "text"),
        (tuple[int, int], [1], "a list of 2"),
        (tuple[int, ...], 1, "a list"),
    ):
        with pytest.raises(RecordError, match=words):
            read(kind, value)
    assert read(bool, True) is True
    assert read(tuple[int, ...], [1, 2, 3]) == (1, 2, 3)
    assert plain._array(float, [1e30, math.nan], "w").shape == (2,)
    for value in ([1.1e30], 1.1e30):
        with pytest.raises(RecordError, match="in magnitude"):
            plain._array(float, value, "w")
    assert plain.to_plain({"a": (1, math.inf), "b": np.array([1.5])}) == {"a": [1, None], "b": [1.5]}
    assert plain.to_plain(math.inf, finite=False) == math.inf


def test_marks_of_pictures_and_pages():
    head = b"\x89PNG\r\n\x1a\n" + bytes(25)
    png = own.marked_png(head + b"rest")
    text = b"tEXtSoftware\0notchbend"
    assert png[:33] == head
    assert png[33:37] == (18).to_bytes(4, "big")
    assert png[37 : 37 + len(text)] == text
    assert png.endswith(b"rest")
    assert len(png) == 33 + 4 + len(text) + 4 + 4
    assert own.marked_png(png) == png
    assert own.marked_png(b"other") == b"other"
    assert own.marked_page("<head></head><head>").count("generator") == 1
    pdf = own.marked_pdf(b"x")
    assert own.marked_pdf(pdf) == pdf != b"x"


def test_files_carry_their_marks_in_their_first_and_last_bytes(tmp_path):
    pdf = tmp_path / "a.pdf"
    pdf.write_bytes(own.marked_pdf(b"x" * 5000))
    assert own.is_own(pdf)
    pdf.write_bytes(own.marked_pdf(b"x") + b"y")
    assert not own.is_own(pdf)
    page = tmp_path / "a.html"
    for before, mine in ((4096 - 43, True), (4096, False)):
        page.write_bytes(b" " * before + b'<meta name="generator" content="notchbend">')
        assert own.is_own(page) is mine


def test_files_are_read_within_limits(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(b"x" * 10)
    assert files.read_bytes(path, "y", most=10) == b"x" * 10
    with pytest.raises(RecordError, match=r"0\.0 MB: expected y, at most 0 MB"):
        files.read_bytes(path, "y", most=9)
    deep = lambda levels: "a = " + "[" * levels + "]" * levels  # noqa: E731
    path.write_text(deep(15))
    files.read_toml(path, "y")
    path.write_text(deep(16))
    with pytest.raises(RecordError, match="nested too deep: expected at most 16 levels"):
        files.read_toml(path, "y")
    path.write_text(".".join("a" * 16) + " = 1")
    files.read_toml(path, "y")
    path.write_text(".".join("a" * 17) + " = 1")
    with pytest.raises(RecordError, match="at most 16 parts"):
        files.read_toml(path, "y")
    path.write_text("a\rb\r\nc")
    assert files.read_text(path, "y") == "a\nb\nc"
    assert (files.MB, files.MOST_BYTES, files.MOST_TOML_BYTES) == (1024**2, 512 * 1024**2, 1024**2)


def test_all_files_come_back_where_one_cannot_be_put_in_its_place(tmp_path):
    old, new = tmp_path / "old", tmp_path / "new"
    old.write_text("before")

    def fail():
        with files._put_back([old, new]):
            old.write_text("after")
            new.write_text("after")
            raise InterruptedError

    with pytest.raises(InterruptedError):
        fail()
    assert (old.read_text(), new.exists(), len(list(tmp_path.iterdir()))) == ("before", False, 1)


def test_tables_and_ranges_for_a_notebook():
    html = html_table("<c>", [("a", "1"), ("b", "2")], ("h",), ["n"])
    assert html.count("<tr>") == 3
    assert "&lt;c&gt;" in html
    assert html.endswith("</table>\n<div>n</div>")
    assert "thead" not in html_table("c", [])
    assert from_to([2.2, -2.25], "mm") == "-2.25 to 2.2 mm"
