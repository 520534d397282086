"""Stops, named laws, inverses and curves by their definitions."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_loops import line, values_of

from hysteresis.laws.backbone import _defined_to, fit_curves, fitted_backbone, given_backbone
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.laws.elements import EVERYWHERE, LAWS, AsymmetricElement, Place, bouc_wen_rows, elements_of
from hysteresis.laws.inverse import UnreachableError, compensating_drive, inverse_curve, inverse_hysteresis
from hysteresis.laws.stops import advanced, follow_stops, largest_factor, start_of, thresholds, width_factor

# --- stops ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("power", "share", "largest"), [(1.0, 0.25, 3.2), (1.0, 1.0, 2.0), (1.0, 0.0, 4.0)])
def test_thresholds_are_the_middles_of_twenty_quantiles(power, share, largest):
    """A uniform density: R/40, 3 R/40 ... 39 R/40 with the mean R/2, and R; all together have the mean 2."""
    r = thresholds(2.0, power, share)
    np.testing.assert_allclose(r, largest * np.append((2 * np.arange(20) + 1) / 40, 1.0), rtol=1e-12)


def test_a_power_of_thresholds_is_that_of_their_share():
    """(r / R)^power is the share below r: 1/40, 3/40 ..."""
    for power in (0.4, 3.0):
        r = thresholds(2.0, power, 0.3)
        np.testing.assert_allclose((r[:-1] / r[-1]) ** power, (2 * np.arange(20) + 1) / 40, rtol=1e-12)


def test_the_width_is_constant_beyond_a_fifth_outside_the_range():
    for skew, bow in ((0.3, -0.2), (-0.5, 0.4)):
        for x, seen in ((0.5, 0.5), (-1.1, -1.1), (1.19, 1.19), (1.21, 1.2), (9.0, 1.2), (-1.21, -1.2), (-9.0, -1.2)):
            expected = math.exp(skew * seen + bow * seen**2)
            assert width_factor(2.0 + 5.0 * x, skew, bow, 2.0, 5.0) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("skew", [-1.0, -0.3, 0.0, 0.3, 1.0])
@pytest.mark.parametrize("bow", [-1.0, -0.4, -0.1, 0.0, 0.6])
def test_the_largest_width_is_at_an_end_or_at_the_top_of_the_parabola(skew, bow):
    x = np.linspace(-1.2, 1.2, 24001)
    assert largest_factor(skew, bow) == pytest.approx(np.exp(skew * x + bow * x**2).max(), rel=1e-7)


def test_stops_after_a_stroke_from_rest_are_held_at_their_radii():
    r = np.array([0.5, 1.0, 4.0])
    assert start_of(0.2, r).tolist() == [0.5, 0.8, 0.8]
    assert start_of(-0.2, r).tolist() == [-0.5, -0.8, -0.8]
    assert start_of(1.0, r).tolist() == [0.5, 1.0, 4.0]
    assert start_of(0.0, r).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("A", [-0.5, 0.5])
def test_a_stop_operator_slips_at_its_radius(A):
    """All weight at R = 2/0.5 = 4: h = A e, and e is within 4 of f's last turn."""
    path = np.array([0.0, 3.0, 6.0, 5.0, -1.0, -3.0])
    row = np.array([[A, 2.0, 0.7, 1.0, 0.0, 0.0, 0.0]])
    np.testing.assert_allclose(follow_stops(path, row, 0.0, 1.0)[0], A * np.array([0, 3, 4, 3, -3, -4.0]), atol=1e-12)
    started = np.array([[A, 2.0, 0.7, 1.0, 0.0, 0.0, 0.75]])  # three quarters of R: h has the sign of the state
    np.testing.assert_allclose(follow_stops(path[:1], started, 0.0, 1.0)[0], [1.5], rtol=1e-12)
    h, stops = advanced(path, row[0, :6], (0.0, 1.0), np.zeros(21))
    np.testing.assert_allclose(h, A * np.array([0, 3, 4, 3, -3, -4.0]), atol=1e-12)
    assert stops[-1] == -4.0


@pytest.mark.parametrize(("skew", "bow"), [(0.4, 0.0), (0.0, -0.3), (0.0, 0.3)])
def test_one_constant_of_position_alone_changes_the_width(skew, bow):
    """Where all stops slip, |h| is S b(f); in steps of 0.1 deg the limits move less than f does."""
    path = np.linspace(-12, 12, 241)
    h = follow_stops(path, np.array([[-0.9, 2.0, 0.6, 0.2, skew, bow, -1.0]]), 1.0, 8.0)[0]
    x = (path - 1.0) / 8.0
    slipping = (path > 0) & (np.abs(x) < 1.2)
    np.testing.assert_allclose(h[slipping], -2.0 * np.exp((skew + bow * x) * x)[slipping], rtol=1e-9)


def test_a_law_of_stops_without_a_slope_or_a_path_is_nothing():
    rows = np.array([[0.0, 2.0, 0.6, 0.2, 0.0, 0.0, 0.5], [-0.5, 2.0, 0.6, 0.2, 0.0, 0.0, 0.5]])
    assert follow_stops(np.empty(0), rows, 0.0, 1.0).shape == (2, 0)
    stops = np.linspace(-1, 1, 21)
    for path, constants in ((np.empty(0), rows[1, :6]), (np.array([0.0, 3.0]), rows[0, :6])):
        h, end = advanced(path, constants, (0.0, 1.0), stops)
        assert h.tolist() == [0.0] * len(path)
        assert end.tolist() == stops.tolist()
    assert follow_stops(np.array([0.0]), rows[::-1], 0.0, 1.0)[0, 0] == pytest.approx(
        -0.5 * -(0.2 * start_of(0.5, thresholds(4.0, 0.6, 0.2))[-1]
                 + 0.04 * start_of(0.5, thresholds(4.0, 0.6, 0.2))[:-1].sum())
    )  # fmt: skip


# --- laws by their numbers -----------------------------------------------------------------------------------------


def test_numbers_of_a_play_and_bounds_of_constants():
    """n from 1 to 10, gamma / beta up to 1, chi + 1 from a tenth to ten; position and direction do not matter to it."""
    bounds = {
        name: [(c.name, round(math.exp(c.low), 9), round(math.exp(c.high), 9)) for c in law.constants]
        for name, law in LAWS.items()
    }
    e = math.exp
    n, rho = ("n", 1.0, 10.0), ("gamma / beta", round(e(-0.95), 9), round(e(1.0), 9))
    chi, share = ("chi + 1", 0.1, 10.0), ("share at R", 1.0, round(e(0.95), 9))
    wide, one = (round(e(-1.5), 9), round(e(1.5), 9)), (round(e(-1.0), 9), round(e(1.0), 9))
    assert bounds == {
        "bouc-wen": [n, rho],
        "prandtl-ishlinskii": [chi, share],
        "asymmetric-bouc-wen": [n, rho, ("direction", *wide), ("side", *wide)],
        "generalised-prandtl-ishlinskii": [chi, share, ("a", *one), ("c", *one)],
    }
    assert LAWS["prandtl-ishlinskii"].play(0.25) == [0.0, 0.25, math.log(10.0), 0.5]
    assert LAWS["generalised-prandtl-ishlinskii"].play(0.25) == [0.0, 0.25, math.log(10.0), 0.5, 0.0, 0.0]
    assert LAWS["asymmetric-bouc-wen"].play(0.25) == [0.0, 0.25, math.log(5.0), 0.9, 0.0, 0.0]
    assert [law.size for law in LAWS.values()] == [4, 4, 6, 6]
    assert EVERYWHERE == (0.0, 1.0)


def test_a_law_of_sign_zero_is_no_hysteresis():
    path = np.array([0.0, 3.0, -2.0])
    for name, law in LAWS.items():
        values = values_of(name, *(c.play for c in law.constants), state=0.5)
        assert law.follow(path, np.zeros(1), values[np.newaxis], Place(0.0, 2.0)).tolist() == [[0.0] * 3]
        element = law.element(0.0, values, Place(0.0, 2.0))
        assert element.along(path).tolist() == [0.0] * 3
        assert element.saturation_deg == 0.0
        assert element.after(path).along(path).tolist() == [0.0] * 3
        assert law.named(0.0, values)["A"] == (0.0, "1")


def test_rows_of_bouc_wen_are_those_of_its_slope_and_saturation():
    """S^n = |A|/(beta + gamma) with gamma = rho beta: |A| = 0.5, S = 2, n = 3, rho = -1/4."""
    rows = bouc_wen_rows(np.array([-1.0, 1.0]), np.array([values_of("bouc-wen", math.log(3.0), -0.25, state=-0.5)] * 2))
    beta = 0.5 / 8 / 0.75
    np.testing.assert_allclose(rows, [[s * 0.5, beta, -0.25 * beta, 3.0, -1.0] for s in (-1.0, 1.0)], rtol=1e-12)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_limits_of_an_asymmetric_law_differ_by_side_and_direction(sign):
    """S exp(+-d +-s), d with f rising, s above the centre; the state is in parts of S."""
    law = LAWS["asymmetric-bouc-wen"]
    values = values_of("asymmetric-bouc-wen", 0.0, 0.5, 0.3, 0.1, state=0.25)
    named = law.named(sign, values)
    limits = [2.0 * math.exp(power) for power in (-0.3 - 0.1, 0.3 - 0.1, -0.3 + 0.1, 0.3 + 0.1)]
    names = [f"limit_{side}_{way}_deg" for side in ("below", "above") for way in ("falling", "rising")]
    assert [named[name][0] for name in names] == pytest.approx(limits)
    assert (named["A"][0], named["n"][0], named["gamma_over_beta"][0]) == pytest.approx((sign * 0.5, 1.0, 0.5))
    element = law.element(sign, values, Place(1.0, 3.0))
    assert element.saturation_deg == pytest.approx(limits[3])
    assert (element.A, element.kappa, element.centre_deg, element.h0_deg) == pytest.approx((sign * 0.5, 1 / 3, 1, 0.5))
    path = np.array([-400.0, -800.0, 0.9, 400.0, 1.1])
    ends = [0.5, -sign * limits[0], sign * limits[1], sign * limits[3], -sign * limits[2]]
    np.testing.assert_allclose(element.along(path), ends, rtol=1e-9)
    np.testing.assert_allclose(law.follow(path, np.array([sign]), values[np.newaxis], Place(1.0, 3.0))[0], ends)
    with pytest.raises(ValueError, match="asymmetric Bouc-Wen"):
        replace(element, h0_deg=1.01 * limits[3]).along(path)
    with pytest.raises(ValueError, match="asymmetric Bouc-Wen"):
        law.follow(path, np.array([sign]), np.array([[*values[:2], -0.1, *values[3:]]]), Place())
    assert AsymmetricElement(0.0, 1.0, 1.0, ((1.0, 2.0), (3.0, 4.0)), 0.0).saturation_deg == 0.0


def test_stored_numbers_make_an_element_for_each_row():
    rows = [[math.log(0.5), math.log(2.0), 0.0, 0.5, 0.0], [math.log(0.25), 0.0, math.log(2.0), 1.0, 0.5]]
    first, second = elements_of("bouc-wen", -1.0, rows, (0.0, 1.0))
    assert (first.A, second.A, second.n, second.h0_deg) == pytest.approx((-0.5, -0.25, 2.0, 0.5))
    for values, place in ((rows, (0.0,)), (rows, (0.0, 1.0, 2.0)), ([rows[0], rows[1][:4]], (0.0, 1.0)),
                          ([[*rows[0], 1.0], rows[1]], (0.0, 1.0))):  # fmt: skip
        with pytest.raises(ValueError, match="rows of 5 numbers and a place of 2"):
            elements_of("bouc-wen", -1.0, values, place)


# --- the inverse ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_path_goes_over_both_saturations_to_reach_an_angle(sign):
    """From saturation to the other one, f + h is the angle to rounding: f = 50 + S, then f = -50 - S."""
    law = BoucWen(-0.9, 0.3, 0.15, 1.0, h0_deg=sign * 2.0)
    found = inverse_hysteresis([sign * 50.0, sign * 50.0, -sign * 50.0], [law], 0.0)
    np.testing.assert_allclose(found, sign * np.array([52.0, 52.0, -52.0]), rtol=1e-9)
    found = inverse_hysteresis([sign * 50.0], [law, law], 0.0)
    assert found[0] == pytest.approx(sign * 54.0)
    near = inverse_hysteresis([sign * 2.0, sign * 1.0, sign * 1.5], [law], 0.0)  # it falls saturated, by 1 deg
    assert near[:2].tolist() == pytest.approx([0.0, -sign], abs=1e-12)
    assert near[2] + law.along(np.append(0.0, near))[-1] == pytest.approx(sign * 1.5)
    leads = inverse_hysteresis([sign * 50.0], [BoucWen(0.9, 0.3, 0.15, 1.0, h0_deg=-sign * 2.0)], 0.0)
    assert leads[0] == pytest.approx(sign * 48.0)


def test_angles_of_an_inverse_are_a_row_of_finite_numbers():
    law = BoucWen(-0.9, 0.3, 0.15, 1.0)
    assert inverse_hysteresis([], [law], 0.0).shape == (0,)
    assert inverse_hysteresis([3.0], [], 1.0).tolist() == [3.0]
    for angles in ([[1.0, 2.0]], [1.0, math.nan], [math.inf]):
        with pytest.raises(ValueError, match="angle_deg of shape"):
            inverse_hysteresis(angles, [law], 0.0)
    with pytest.raises(ValueError, match="parameters 0"):
        inverse_hysteresis([], [replace(law, n=0.5)], 0.0)


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_curve_is_inverted_where_it_rises_or_falls_throughout(way):
    found = inverse_curve(lambda x: way * x**3, way * np.array([0.5, 8.0, 1.0]), (0.5 ** (1 / 3), 2.0))
    np.testing.assert_allclose(found, [0.5 ** (1 / 3), 2.0, 1.0], rtol=1e-9)
    with pytest.raises(ValueError, match=r"at a drive of 1:"):
        inverse_curve(lambda x: -way * (x - 1) ** 2, [0.0], (0.0, 1.6))
    with pytest.raises(ValueError, match=r"at a drive of 0\.5:"):  # flat from 0.5 on, and it rises again
        inverse_curve(lambda x: way * (np.minimum(x, 0.5) + np.maximum(x - 1, 0.0)), [0.1], (0.0, 2.0))
    shifted = inverse_curve(lambda x: way * x + 0.5, [way * 0.5 + 0.5], (0.0, 1.5))
    assert shifted == pytest.approx([0.5])


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_an_angle_beyond_the_range_of_a_curve_by_rounding_is_its_end(way):
    """The range is 40 deg: 4e-8 deg are rounding."""
    curve = lambda x: way * 10 * x  # noqa: E731
    near = np.array([-20 - 3.6e-8, 20 + 3.6e-8, 0.0])
    assert inverse_curve(curve, near, (-2.0, 2.0)).tolist() == pytest.approx([way * -2, way * 2, 0], abs=1e-12)
    for angles, sample in (([0.0, 1.0, 20 + 4.4e-8, 30.0], 2), ([0.0, -20 - 4.4e-8], 1), ([-30.0, 0.0], 0)):
        with pytest.raises(UnreachableError, match=f"sample {sample}: f = ") as caught:
            inverse_curve(curve, angles, (-2.0, 2.0))
        assert caught.value.sample == sample


def test_a_delay_does_not_change_the_drives():
    made = lambda delay: SimpleNamespace(  # noqa: E731
        delay_s=delay, f=lambda x: 10 * x, elements=[BoucWen(-0.9, 0.3, 0.15, 1.0)], drive_range=(-9.0, 9.0)
    )
    assert compensating_drive(made(0.0), [50.0], 0.0) == pytest.approx([5.2])
    assert compensating_drive(made(0.1), [50.0], 0.0) == pytest.approx([5.2])


# --- the single-valued part ----------------------------------------------------------------------------------------


def test_a_curve_of_several_slopes_by_hand():
    """Range 4, from 1 to 5. Slopes 2, 0, 4 at the knots (per range): from the middle, 0 and 4/4 per unit at the end."""
    backbone = fitted_backbone(np.array([1.0, 5.0]), np.array([3.0, 7.0]), 3)
    at = backbone.at(np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 7.0]))(np.array([10.0, 2.0, 0.0, 4.0]))
    # the slope is 0.5 at 1, 0 at 3, 1 at 5, linear between; straight beyond
    expected = [10 - 0.5 - 0.5, 10 - 0.5, 10 - 0.125, 10.0, 10 + 0.25, 10 + 1.0, 10 + 1.0 + 2.0]
    np.testing.assert_allclose(at, expected, rtol=1e-12)
    assert backbone.names == ("f_middle_deg", "f_slope_0", "f_slope_1", "f_slope_2")
    assert backbone.units == ("deg", *["deg per range"] * 3)
    assert backbone.start.tolist() == [5.0, 4.0, 4.0, 4.0]
    assert backbone.low.tolist() == [-math.inf, 0.0, 0.0, 0.0]
    assert backbone.high.tolist() == [math.inf] * 4


def test_a_curve_of_one_slope_is_a_line_about_the_middle_of_the_range():
    falling = fitted_backbone(np.array([1.0, 5.0]), np.array([3.0, 1.0]), 1)
    np.testing.assert_allclose(falling.at(np.array([1.0, 3.0, 7.0]))(np.array([2.0, 8.0])), [6.0, 2.0, -6.0])
    flat = fitted_backbone(np.array([0.0, 1.0, 2.0]), np.zeros(3), 1)  # a slope of 0 counts as rising
    np.testing.assert_allclose(flat.at(np.array([2.0]))(np.array([0.0, 2.0])), [1.0])
    assert flat.start.tolist() == [0.0, 1e-12]


def test_derivatives_of_a_curve_by_its_coefficients():
    drive = np.array([-1.0, 0.0, 2.0])
    assert line().jacobian(drive, np.array([7.0])).tolist() == [[1.0]] * 3
    steps = given_backbone(lambda x: x**3, 100 * drive, drive**3, "step")
    c = np.array([0.01, 5.0])  # f = (c0 (x - c1))^3
    mm = 0.01 * (100 * drive - 5.0)
    exact = np.column_stack([3 * mm**2 * (100 * drive - 5.0), -3 * mm**2 * 0.01])
    np.testing.assert_allclose(steps.jacobian(100 * drive, c), exact, rtol=3e-3, atol=1e-3)
    seen = []
    curve = replace(steps, at=lambda drive: lambda c: (seen.append(c), drive * c[0] + c[1] ** 2)[1])
    curve.jacobian(drive, np.array([0.0, -40.0]))
    moved = {tuple(one - np.array([0.0, -40.0])) for one in seen} - {(0.0, 0.0)}
    assert sorted(abs(number) for one in moved for number in one) == pytest.approx([0.0, 0.0, 1e-9, 4e-5], rel=1e-6)


def test_curves_of_records_share_coefficients_and_have_zeros():
    backbone = fitted_backbone(np.array([0.0, 1.0]), np.array([0.0, 1.0]), 1)
    x, y = np.linspace(0, 1, 5), np.linspace(0.2, 1, 4)
    c, zeros = fit_curves([backbone] * 3, [x, y, x], [3 * x + 1, 3 * y + 5, 3 * x - 2])
    np.testing.assert_allclose([*c, *zeros], [2.5, 3.0, 4.0, -3.0], atol=1e-12)
    c, zeros = fit_curves([backbone], [x], [-x])  # it does not fall: the best flat one
    np.testing.assert_allclose(c, [-0.5, 0.0], atol=1e-12)
    assert zeros.shape == (0,)


def test_a_scaled_curve_starts_from_the_gain_that_fits_best():
    """Kinematics 2 mm long either way, 10 deg/mm; the drive from 100 to 300 steps has its zero in the middle."""

    def base(mm):
        if np.abs(mm).max() > 2.0:
            raise ValueError("beyond")
        return 10.0 * mm

    drive = np.linspace(100.0, 300.0, 41)
    for way in (1.0, -1.0):
        gain = way * 2e-3 * 1e3 ** (30 / 60) * 2.0 / 200.0  # the middle of the gains that are tried
        backbone = given_backbone(base, drive, 10.0 * gain * (drive - 200.0), "step")
        assert backbone.start.tolist() == pytest.approx([gain, 200.0], rel=1e-9)
        assert backbone.low.tolist() == pytest.approx([min(0.2 * gain, 5 * gain), -100.0])
        assert backbone.high.tolist() == pytest.approx([max(0.2 * gain, 5 * gain), 500.0])
    beyond = backbone.at(np.array([0.0, 100.0, 200.0]))(np.array([0.01, 50.0]))
    np.testing.assert_allclose(beyond, [-5.0, 5.0, 15.0], atol=1e-6)
    np.testing.assert_allclose(backbone.at(np.array([1e3, -1e3]))(np.array([0.01, 50.0])), [20.0, -20.0], atol=1e-6)
    for zero in (100.0, 300.0):
        gain = 2e-3 * 1e3 ** (20 / 60) * 2.0 / 200.0
        backbone = given_backbone(base, drive, 10.0 * gain * (drive - zero), "deg")
        assert backbone.start.tolist() == pytest.approx([gain, zero], rel=1e-9)
    assert (backbone.names, backbone.units) == (("gain_mm_per_deg", "zero_deg"), ("mm/deg", "deg"))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_kinematics_are_defined_up_to_the_drive_where_they_fail(side):
    """By bisection from the last of 31 drives that is good: to within a millionth of a millimetre."""

    def failing(error, end=7.3):
        def base(mm):
            if (side * mm > end).any():
                if error is None:
                    return np.full(mm.shape, math.nan)
                raise error
            return 2.0 * mm

        return base

    for error in (ValueError(), ZeroDivisionError(), RuntimeError(), None):
        assert _defined_to(failing(error), side) == pytest.approx(side * 7.3, abs=1e-6)
    assert _defined_to(failing(ValueError(), 0.45), side) == pytest.approx(side * 0.45, abs=1e-6)
    assert _defined_to(lambda mm: 2.0 * mm, side) == pytest.approx(side * 100.0)
    assert _defined_to(lambda mm: 0.0, side) == 0.0  # not an angle for each drive
    assert _defined_to(lambda mm: np.where(np.abs(mm) > 0.09, math.inf, 0.0), side) == 0.0


def test_kinematics_of_one_side_alone_are_tabulated_and_those_of_none_refused():
    drive = np.linspace(0.0, 100.0, 11)
    one = given_backbone(lambda mm: np.sqrt(np.where(mm < 0, math.nan, mm) * 4.0), drive, np.sqrt(0.02 * drive), "step")
    np.testing.assert_allclose(one.at(np.array([50.0, 100.0]))(np.array([0.02, 0.0])), [2.0, 8**0.5], rtol=1e-4)
    assert one.at(np.array([-50.0]))(np.array([0.02, 0.0])).tolist() == [0.0]
    with pytest.raises(ValueError, match=r"no finite angles within 0\.1 mm"):
        given_backbone(lambda mm: mm * math.nan, drive, drive, "step")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_angle_that_is_reached_twice_counts_the_first_time(sign):
    """A lagging h with |A| > 1 grows again where f enters the wide side; by the angles along a fine path of f."""
    (law,) = elements_of("asymmetric-bouc-wen", -1.0, [[0.3, 0.4, 0.6, 0.2, 0.5, sign * 0.7, 0.2]], [1.5, 38.0])
    assert law.corner_deg == 1.5
    at = 1.5 - sign * 1.8
    law = law.after(np.array([1.5, at + sign * 9.0, at]))
    path = np.linspace(at, 1.5 + sign * 6.0, 20_001)
    angle = path + law.along(path)
    twice = 0
    for target in np.linspace(angle[0], angle[-1], 1000)[1:-1]:
        crossings = np.flatnonzero((angle[:-1] - target) * (angle[1:] - target) < 0)
        twice += crossings.size > 1
        (found,) = inverse_hysteresis([target], [law], at)
        assert sign * path[crossings[0]] - 1e-9 <= sign * found <= sign * path[crossings[0] + 1] + 1e-9
    assert twice > 5
