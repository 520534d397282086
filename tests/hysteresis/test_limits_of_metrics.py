"""The constants of metrics and backbones, each just within and just beyond its limit."""

import numpy as np
import pytest

from hysteresis.records.backbone import backbone_of
from hysteresis.records.metrics import dissipated_area, loop_width, noise_floor
from hysteresis.records.record import Record


@pytest.mark.parametrize(("gap", "closed"), [(0.049, True), (0.051, False)])
def test_a_cycle_is_closed_up_to_five_percent_of_its_range(gap: float, closed: bool) -> None:
    # a slit of 2 deg about a line, range 1: its area is 2 deg wherever it is closed; steps are below the gap
    up, down = np.linspace(0, 1, 101), np.linspace(1, gap, 96)
    drive, angle = np.r_[up, down], np.r_[10 * up - 1, 10 * down + 1]
    cycle = np.ones(drive.size, dtype=int)
    if closed:
        # the slit from the gap on, less the triangle that the way back to the start cuts off; by the shoelace formula
        x, y = np.append(drive, drive[0]), np.append(angle, angle[0])
        shoelace = 0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
        assert dissipated_area(drive, angle, cycle) == pytest.approx(shoelace, rel=1e-12)
        return
    with pytest.raises(ValueError, match=r"no complete cycle"):
        dissipated_area(drive, angle, cycle)


@pytest.mark.parametrize(("deeper", "noise"), [(1.049, np.sqrt(0.5)), (1.051, 0.0)])
def test_cycles_repeat_up_to_five_percent_of_their_range(deeper: float, noise: float) -> None:
    """Two cycles that are 1 deg apart: noise of 1/sqrt(2) deg where they repeat, none where they do not."""
    way = np.abs(np.linspace(-1, 1, 201))
    drive = np.r_[way, (1 + deeper * (way - 1))[1:]]
    angle = 20 * drive + np.repeat([0.0, 1.0], [201, 200])
    record = Record(drive, angle, cycle=np.repeat([1, 2], [201, 200]))
    assert noise_floor(record) == pytest.approx(noise, abs=0.1)  # interpolation averages a part of it


@pytest.mark.parametrize(("apart", "drives"), [(0.0015, 10), (0.0025, 20)])
def test_samples_within_two_parts_in_a_thousand_of_the_range_are_averaged(apart: float, drives: int) -> None:
    # pairs of samples on a grid of a tenth of the range, beside the ends; each pair is one drive or two
    places = np.linspace(0, 1, 11)
    pairs = np.sort(np.r_[places[1:-1], places[1:-1] + apart, [0.0, 1.0]])
    found = loop_width(np.r_[pairs, pairs[::-1][1:]], np.r_[pairs, pairs[::-1][1:] + 0.5])
    assert found.drive.size == (drives if drives == 20 else 11)


@pytest.mark.parametrize(("slope", "sign"), [(-0.05, 1.0), (-0.15, -1.0)])
def test_the_lag_turns_about_where_the_angle_falls_with_the_drive(slope: float, sign: float) -> None:
    """Correlation of drive and angle -0.05 or -0.15 of a loop; the limit is -0.1, so that a round loop has none."""
    t = np.linspace(0, 2 * np.pi, 201)
    drive, angle = np.cos(t), np.sin(t) + slope * np.cos(t)  # the falling branch is above
    assert loop_width(drive, angle).at_zero_deg == pytest.approx(sign * 2.0, rel=1e-3)
    assert dissipated_area(drive, angle) == pytest.approx(sign * np.pi, rel=1e-3)


def test_a_backbone_averages_samples_within_a_hundredth_of_the_range() -> None:
    """Dither of 0.3 % of the drive and 1 deg of the angle, equal about each place, leaves the line between them."""
    places = np.arange(4.0, 100.0, 4.0)
    up = np.r_[0.0, np.repeat(places, 2) + np.tile([-0.3, 0.3], places.size), 100.0]
    bump = np.r_[0.0, np.tile([-1.0, 1.0], places.size), 0.0]
    record = Record(np.r_[up, up[::-1]], np.r_[up + bump, (up + bump)[::-1]], cycle=np.ones(2 * up.size, dtype=int))
    found = backbone_of(record)
    assert found is not None
    np.testing.assert_allclose(found, record.drive, atol=1e-9)
