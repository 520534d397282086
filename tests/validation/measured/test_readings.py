"""The paper's widths read twice: bounds from its own model, statements with their errors, draws."""

import math

import numpy as np
import pytest

from fem_models.rig import preset
from validation.measured.readings.fit import fit_set
from validation.measured.readings.layer_errors import loop_errors
from validation.measured.readings.loops import Loop, Loops, fast_program, loops_of
from validation.measured.readings.mechanisms import SETS, rig_of
from validation.measured.readings.paper_table import EQUATION_10, least_rms_deg, model_loop, paper_table, reference
from validation.measured.readings.statements import (
    APART,
    CENTRE_WIDEST,
    END_LEAST,
    FULL,
    PEAK,
    SAME,
    W10,
    W20,
    judge,
    residuals,
)

DRIVE = np.linspace(-2.2, 2.2, 45)
SLOPE = 45 / 2.2


def loop(width_deg):
    """A loop about a straight line, of a width at each drive."""
    return Loop(DRIVE, SLOPE * DRIVE - width_deg / 2, SLOPE * DRIVE + width_deg / 2)


def lens(widest_deg, near_end=0.6):
    """Width that falls as a parabola from the centre, closed at the ends."""
    part = 1 - (1 - near_end) * (DRIVE / (0.9 * 2.2)) ** 2
    return widest_deg * np.where(np.abs(DRIVE) > 2.19, 0.0, part)


def test_loop_of_equation_10_saturates_at_its_closed_form():
    saturation = (EQUATION_10.A / (EQUATION_10.beta + EQUATION_10.gamma)) ** (1 / EQUATION_10.n)
    f, rising, falling = model_loop()
    assert paper_table().model_width_deg == pytest.approx(2 * saturation, rel=1e-3)
    assert np.abs(rising - falling)[[0, -1]] == pytest.approx(0, abs=1e-3)  # the loop is closed
    assert f[[0, -1]].tolist() == [-45.0, 45.0]


def test_only_full_widths_at_20_N_need_a_larger_error_than_table_1():
    over = [(one.reading, one.preload_N) for one in paper_table().readings if not one.largest_error_met]
    assert over == [("full", 20.0)]


def test_percentages_of_table_1_refer_to_about_the_amplitude():
    found = reference(1.48, 3.23)
    assert 100 * 1.48 / found.high_deg == pytest.approx(3.23, abs=0.02)
    assert 45 < found.low_deg < 100 * 1.48 / 3.23 < found.high_deg < 46.1


def test_least_rms_of_a_box_is_half_of_what_is_too_wide():
    assert least_rms_deg(np.full(9, 5.5), 2.5) == pytest.approx(1.5)
    assert least_rms_deg(np.full(9, 5.5), 7.0) == 0


def test_any_f_misses_a_narrower_loop_by_half_of_the_difference():
    """The bound holds for the best f, which is the middle of what h leaves of either branch."""
    _, rising, falling = model_loop()
    measured = 2.21 / 2
    best = -(rising + falling) / 2  # the measured loop on the model's side, or the error is larger still
    errors = np.abs([best + rising - measured, best + falling + measured])
    bound = next(one for one in paper_table().readings if (one.reading, one.preload_N) == ("full", 20.0))
    assert errors.max() == pytest.approx(bound.least_error_deg, rel=1e-3)


def test_loop_of_the_stated_widths_meets_the_static_statements():
    for reading, factor in (("full", 1), ("half", 2)):
        loops = Loops(loop(lens(3.52 * factor)), loop(lens(2.21 * factor)), loop(lens(2.21 * factor)), 1.0, 0.0)
        judged = judge(loops, reading)
        assert [name for name, met in judged.met.items() if not met] == [PEAK]
        assert judged.deviance[W10] == pytest.approx(0, abs=1e-9)
        assert judged.deviance[W20] == pytest.approx(0, abs=1e-9)
        assert not judge(loops, "half" if reading == "full" else "full").met[W10]


def test_flat_loop_neither_meets_nor_contradicts_the_places():
    flat = loop(np.where(np.abs(DRIVE) > 2.19, 0.0, 3.0))
    found = residuals(Loops(flat, flat, flat, 1.0, 0.0), "full")
    for name in (CENTRE_WIDEST, END_LEAST):
        assert [r * r for r in found[name]] == pytest.approx([2 * math.log(2)] * 2)


def test_errors_count_as_two_standard_deviations():
    loops = Loops(loop(lens(3.62)), loop(lens(2.21)), loop(lens(0.9 * 2.21)), 0.9815, 3.2)
    found = judge(loops, "full")
    assert found.deviance[W10] == pytest.approx(4)
    assert found.deviance[SAME] == pytest.approx(4)
    assert found.met[PEAK]
    assert not found.met[APART]
    assert found.met[FULL]


def test_rig_without_rate_has_the_same_loop_at_1_Hz():
    loops = loops_of(preset("du2018"))
    assert (loops.peak_ratio, loops.apart_deg) == (1.0, 0.0)
    assert loops.high.width_deg.max() == pytest.approx(4.42, abs=0.01)
    assert loops.low.width_deg.max() == pytest.approx(7.04, abs=0.02)


def test_delay_of_a_camera_moves_the_loop_by_rate_times_delay():
    loops = loops_of(preset("du2018"), {"delay_ms": 5.0})
    assert loops.apart_deg == pytest.approx(45 * 2 * math.pi * 5e-3, rel=0.1)
    assert loops.peak_ratio == pytest.approx(1, abs=2e-3)
    assert fast_program().time_s[-1] == pytest.approx(2.25)


def test_unequal_tendons_are_those_of_tendon_b():
    chosen = rig_of({"tendon.EA_N": 1e4, "ratio.EA_N": 0.8, "camera.delay_ms": 3.0})
    assert pytest.approx((1e4, 8e3)) == (chosen.rig.tendon_a.EA_N, chosen.rig.tendon_b.EA_N)
    assert chosen.camera == {"delay_ms": 3.0}


def test_fit_of_the_preset_s_mechanisms_meets_the_static_statements():
    fit = fit_set(SETS["sheath, Jenkins, toe, play taken up"], "half", starts=1, seed=1)
    assert [name for name, met in fit.judged.met.items() if not met] == [PEAK]


def test_errors_of_a_loop_refer_to_its_largest_angle():
    found = loop_errors(np.array([-50.0, 0.0, 50.0]), np.array([-50.0, 1.0, 50.0]))
    assert (found.largest_deg, found.percent, found.normalised) == pytest.approx((1, 2, 1 / math.sqrt(3) / 50))
    assert found.within(0) == (True, True, True)
