"""Control charts, change points and limits of a device: against their definitions, and against chance."""

import numpy as np
import pytest

from hysteresis.drift import change_points, control_chart, when_passed
from hysteresis.drift.changes import column, usable_count
from hysteresis.drift.chart import WEIGHT, limit, run_length


def test_average_is_that_of_the_definition():
    values = np.array([1.0, 2.0, 3.0, 10.0, 0.0])
    chart = control_chart(values, 3, 0.05)
    assert chart.mean == pytest.approx(2.0)
    assert chart.deviation == pytest.approx(1.0)
    assert np.isnan(chart.average[:3]).all()
    first = WEIGHT * 10 + (1 - WEIGHT) * 2
    assert chart.average[3:] == pytest.approx([first, (1 - WEIGHT) * first])


@pytest.mark.parametrize(("reference", "count"), [(4, 12), (10, 30)])
def test_false_alarms_of_steady_devices_are_as_many_as_asked(reference, count):
    """Other draws than those of the limit: 2,000 devices, 5 %, four standard deviations of the count."""
    drawn = 7.0 + 3.0 * np.random.default_rng(11).standard_normal((2000, count))
    alarms = sum(control_chart(row, reference, 0.05).alarm is not None for row in drawn)
    assert abs(alarms - 100) < 4 * np.sqrt(95)


def test_fewer_reference_records_need_wider_limits_and_runs_are_long():
    assert limit(4, 14, 0.01) > 1.5 * limit(20, 30, 0.01)
    assert run_length(10, 30, 0.05) > 200  # more than the 20 records in which 5 % are outside


@pytest.mark.parametrize("reference", [2, 8])
def test_reference_of_a_chart_is_checked(reference):
    with pytest.raises(ValueError, match="expected 3 to 7"):
        control_chart(np.arange(8.0), reference, 0.05)


def test_false_change_points_are_as_many_as_asked():
    """300 steady devices with correlated numbers, 5 %."""
    rng = np.random.default_rng(5)
    mix = rng.normal(size=(4, 4))
    found = sum(bool(change_points(rng.normal(size=(16, 4)) @ mix, 0.05, most=1)) for _ in range(300))
    assert found <= 15 + 4 * np.sqrt(14.25)


@pytest.mark.parametrize("shape", ["step", "ramp"])
def test_a_change_is_found_where_it_is(shape):
    rng = np.random.default_rng(3)
    values = rng.normal(size=(30, 5))
    values[:, 2] += (6.0 if shape == "step" else 1.5) * column(30, 12, shape)
    (found,) = change_points(values, 0.01)
    assert found.shape == shape
    assert found.low <= 12 <= found.high
    assert abs(found.first - 12) <= 2
    assert found.p <= 0.001


def test_columns_of_changes():
    assert column(5, 2, "step").tolist() == [0, 0, 1, 1, 1]
    assert column(5, 2, "ramp").tolist() == [0, 0, 1, 2, 3]


def test_too_many_numbers_for_the_records_are_refused():
    assert usable_count(9) == 2
    with pytest.raises(ValueError, match="9 records of 3 numbers: expected at most 2"):
        change_points(np.zeros((9, 3)), 0.01)


def test_interval_of_a_limit_covers_it():
    """Drift of 0.1 a day from day 12 on, noise 0.1: 3 is passed on day 42. 60 devices, at least 90 % covered."""
    at, rng = np.arange(1.0, 31.0), np.random.default_rng(8)
    truth, covered = np.maximum(at - 12, 0) * 0.1, 0
    for _ in range(60):
        found = when_passed(at, truth + rng.normal(0, 0.1, 30), 3.0)
        assert found.low is not None
        assert found.high is not None
        covered += found.low <= 42 <= found.high
    assert covered >= 52


def test_a_limit_on_the_other_side_is_not_passed():
    at = np.arange(1.0, 31.0)
    values = np.maximum(at - 12, 0) * 0.1 + np.random.default_rng(1).normal(0, 0.05, 30)
    assert when_passed(at, values, -1.0).at is None
    assert when_passed(at, values, 0.5).passed


def test_a_clear_change_is_found_at_the_least_false_alarm():
    values = np.random.default_rng(1).normal(size=(30, 3))
    values[15:] += 20.0
    (found,) = change_points(values, 5e-5, most=1)
    assert found.first == 15
    assert found.p <= 5e-5
