"""Re-identification in C against that in Python, and what it does on a device that drifts."""

import ctypes
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from firmware_fits import CASES, compiled, needs_compiler, stored_fit

from hysteresis.files import write_files
from hysteresis.fitting.recursive import (
    AT_BOUND,
    NOT_EXCITED,
    NOT_FINITE,
    OUTSIDE_FIT,
    Drift,
    settings_for,
    start_recursion,
    updated,
)
from studies.firmware import compensator_files, read_compensator
from studies.firmware.files import recursion_settings
from studies.firmware.vector import random_path

LAWS = [case for case in CASES if case not in ("slow", "no hysteresis")]
DOUBLE, FLOAT = (ctypes.c_double, ()), (ctypes.c_float, ("-DCMP_FLOAT",))
SAMPLES = 4000
DRIFTED = Drift(zero_deg=0.8, gain=1.06, width=1.3)


def device(layer, drive, drift, noise_deg, seed=3):
    """Angles along drives of the law that has drifted, with white noise."""
    f = layer.f(np.append(layer.first_drive, drive))
    h = sum(one.widened(drift.width).along(f) for one in layer.elements)
    noise = np.random.default_rng(seed).normal(0.0, noise_deg, f.size)
    return (drift.zero_deg + drift.gain * f + h + noise)[1:]


class Pair:
    """The same fit in C, by its library, and in Python."""

    def __init__(self, folder, case="bouc-wen", real=ctypes.c_double, options=()):
        self.compensator = read_compensator(stored_fit(folder / "identify.json", case), "cmp")
        self.layer, self.settings = self.compensator.layer, recursion_settings(self.compensator)
        write_files(compensator_files(self.compensator, folder))
        made = compiled(folder / "cmp.c", "-shared", "-fPIC", *options, out=folder / "cmp.so")
        size = int(re.search(r"memory\[(\d+)\]", (folder / "cmp.h").read_text())[1])

        class State(ctypes.Structure):
            _fields_ = (
                *((name, real) for name in ("f_deg", "h_deg", "drive", "largest_step", "zero_deg", "gain", "width")),
                ("memory", real * size),
                ("limited", ctypes.c_uint),
            )

        class Estimator(ctypes.Structure):
            _fields_ = (
                ("root", real * 9),
                ("memory", real * size),
                ("f_deg", real),
                ("sampled_deg", real),
                ("mean_square", real),
                ("flags", ctypes.c_uint),
            )

        self.calls, self.state, self.estimator = ctypes.CDLL(str(made)), State(), Estimator()
        for name in ("cmp_step", "cmp_observe"):
            call = getattr(self.calls, name)
            call.argtypes, call.restype = (ctypes.POINTER(State), real), real
        self.calls.cmp_estimate.argtypes = (ctypes.POINTER(Estimator), ctypes.POINTER(State), real)
        self.calls.cmp_estimate.restype = ctypes.c_uint
        self.calls.cmp_init(ctypes.byref(self.state))
        self.calls.cmp_estimator_init(ctypes.byref(self.estimator), ctypes.byref(self.state))
        start = float(self.layer.f(np.array([self.layer.first_drive]))[0])
        self.python = start_recursion(self.layer.elements, start, self.settings)

    def observe(self, drive, angle):
        """Move both to a drive, learn from an angle there; the flags of C."""
        self.calls.cmp_observe(ctypes.byref(self.state), drive)
        flags = self.calls.cmp_estimate(ctypes.byref(self.estimator), ctypes.byref(self.state), angle)
        self.python = updated(self.python, float(self.layer.f(np.array([drive]))[0]), angle)
        return flags

    @property
    def of_c(self):
        return np.array([self.state.zero_deg, self.state.gain, self.state.width])

    @property
    def of_python(self):
        drift = self.python.drift
        return np.array([drift.zero_deg, drift.gain, drift.width])


@needs_compiler
@pytest.mark.parametrize("case", [*LAWS, "no hysteresis"])
def test_c_learns_what_python_learns(tmp_path, case):
    pair = Pair(tmp_path, case)
    drive = random_path(SAMPLES, (-1.6, 1.6), pair.layer.first_drive, seed=8)
    angle = device(pair.layer, drive, DRIFTED, 0.05)
    angle[::17] = np.nan
    found, expected = np.empty((SAMPLES, 5)), np.empty((SAMPLES, 5))
    for k in range(SAMPLES):
        flags = pair.observe(drive[k], angle[k])
        found[k] = *pair.of_c, pair.state.h_deg, flags
        h = pair.python.angle_deg - pair.python.drift.zero_deg - pair.python.drift.gain * pair.python.f_deg
        expected[k] = *pair.of_python, h, pair.python.flags
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.reshape(pair.estimator.root, (3, 3)), pair.python.root, rtol=0, atol=1e-9)
    assert set(found[:, 4].astype(int)) >= {0, NOT_EXCITED, NOT_FINITE}


@needs_compiler
@pytest.mark.parametrize("case", LAWS)
def test_a_drift_is_found_and_the_reference_followed_again(tmp_path, case):
    """By the model in Python as the device: the error of drives of C before and after, and the standard deviations."""
    pair = Pair(tmp_path, case)
    drive = random_path(SAMPLES, (-1.6, 1.6), pair.layer.first_drive, seed=8)
    angle = device(pair.layer, drive, DRIFTED, 0.05)
    for k in range(SAMPLES):
        pair.observe(drive[k], angle[k])
    truth = np.array([DRIFTED.zero_deg, DRIFTED.gain, DRIFTED.width])
    assert np.abs(pair.of_c - truth).max() < 0.05
    reference = device(pair.layer, 0.9 * drive[-300:], DRIFTED, 0.0)
    drives = [pair.calls.cmp_step(ctypes.byref(pair.state), value) for value in reference]
    reached = device(pair.layer, np.append(drive, drives), DRIFTED, 0.0)[SAMPLES:]
    assert np.sqrt(np.mean((reached - reference)[1:] ** 2)) < 0.05


@needs_compiler
def test_in_float_the_drift_is_that_of_double_within_a_thousandth_deg(tmp_path):
    pair = Pair(tmp_path, "bouc-wen", ctypes.c_float, ("-DCMP_FLOAT",))
    drive = random_path(SAMPLES, (-1.6, 1.6), pair.layer.first_drive, seed=8)
    angle = device(pair.layer, drive, DRIFTED, 0.05)
    flags = [pair.observe(drive[k], angle[k]) for k in range(SAMPLES)]
    assert 0 in flags
    assert np.abs(pair.of_c - pair.of_python).max() < 1e-3


@needs_compiler
@pytest.mark.parametrize(("real", "options", "spike"), [(*DOUBLE, 1e160), (*FLOAT, 1e20)])
def test_one_lost_reading_is_not_another_device(tmp_path, real, options, spike):
    pair = Pair(tmp_path, "bouc-wen", real, options)
    drive = random_path(1500, (-1.6, 1.6), pair.layer.first_drive, seed=8)
    angle = device(pair.layer, drive, Drift(), 0.04)
    angle[1000:1010] = np.where(np.arange(10) == 4, spike, angle[1000:1010])
    flags = [pair.observe(drive[k], angle[k]) for k in range(1500)]
    assert not any(flag & OUTSIDE_FIT for flag in flags)
    assert not pair.python.flags & OUTSIDE_FIT


@needs_compiler
@pytest.mark.parametrize(("real", "options", "most"), [(*DOUBLE, 299), (*FLOAT, 29)])
def test_a_huge_reference_stops_at_the_end_of_the_drive(tmp_path, real, options, most):
    pair = Pair(tmp_path, "bouc-wen", real, options)
    ends = set()
    for power in (3, 9, 14, 20, most):
        pair.calls.cmp_init(ctypes.byref(pair.state))
        ends.add((pair.calls.cmp_step(ctypes.byref(pair.state), 10.0**power), pair.state.limited))
    assert ends == {(2.0, 2)}  # NOTCHBEND_AT_HIGHEST


def test_without_motion_nothing_is_learnt_and_nothing_forgotten(tmp_path):
    compensator = read_compensator(stored_fit(tmp_path / "identify.json"), "cmp")
    layer = compensator.layer
    settings = recursion_settings(compensator)
    start = float(layer.f(np.array([layer.first_drive]))[0])
    one = start_recursion(layer.elements, start, settings)
    one = updated(updated(one, start + 1.0, start + 4.0), start + 2.0, start + 6.0)
    held = one
    for _ in range(50):
        held = updated(held, start + 2.0, 3.0)
        assert held.flags == NOT_EXCITED | one.flags & OUTSIDE_FIT
    assert held.drift == one.drift
    np.testing.assert_array_equal(held.root, one.root)
    assert updated(held, start + 9.0, math.nan).flags == NOT_FINITE | one.flags & OUTSIDE_FIT


def test_motion_in_one_direction_of_the_constants_forgets_no_other(tmp_path):
    """5,000 small moves about one place: the covariance stays within its start, and what was learnt stays."""
    compensator = read_compensator(stored_fit(tmp_path / "identify.json"), "cmp")
    layer, settings = compensator.layer, recursion_settings(compensator)
    f = layer.f(random_path(600, (-1.6, 1.6), layer.first_drive, seed=8))
    one = start_recursion(layer.elements, float(layer.f(np.array([layer.first_drive]))[0]), settings)
    angle = device(layer, random_path(600, (-1.6, 1.6), layer.first_drive, seed=8), DRIFTED, 0.02)
    for k in range(600):
        one = updated(one, f[k], angle[k])
    known = one
    for k in range(5000):
        place = f[-1] + (2.0 * settings.spacing_deg if k % 2 else 0.0)
        one = updated(one, place, one.angle_deg if k < 1 else updated(one, place, math.nan).angle_deg)
        assert (np.linalg.norm(one.root, axis=1) <= 1.0).all()
    assert one.drift.gain == pytest.approx(known.drift.gain, abs=0.02)
    assert one.drift.width == pytest.approx(known.drift.width, abs=0.05)


def test_a_device_that_the_model_cannot_be_is_said_to_have_left_the_fit(tmp_path):
    """An angle that bends by the square of f; one with a drift alone has not left it in the end."""
    compensator = read_compensator(stored_fit(tmp_path / "identify.json"), "cmp")
    layer, settings = compensator.layer, recursion_settings(compensator)
    drive = random_path(3000, (-1.6, 1.6), layer.first_drive, seed=8)
    f = layer.f(drive)
    for bend, zero, flag in ((0.0, 0.8, 0), (0.01, 0.8, OUTSIDE_FIT), (0.0, 30.0, AT_BOUND)):
        one = start_recursion(layer.elements, float(layer.f(np.array([layer.first_drive]))[0]), settings)
        angle = device(layer, drive, Drift(zero, 1.06, 1.3), 0.05) + bend * f**2
        seen = []
        for k in range(3000):
            one = updated(one, f[k], angle[k])
            seen.append(one.flags)
        last = [flags for flags in seen[-300:] if not flags & NOT_EXCITED]
        assert last
        assert np.mean([bool(flags & flag) if flag else not flags for flags in last]) > 0.8


@pytest.mark.parametrize("case", LAWS)
def test_h_takes_the_width_that_is_learnt_at_once(tmp_path, case):
    """Amid a stroke, where all that is learnt is width: h is that of the law with this width all along."""
    compensator = read_compensator(stored_fit(tmp_path / "identify.json", case), "cmp")
    layer, settings = compensator.layer, recursion_settings(compensator)
    settings = replace(settings, scale=(1e-9, 1e-9, 0.5), noise_deg=1e-3, alike=1.0)
    f = layer.f(np.concatenate([np.linspace(0, 1.5, 60), np.linspace(1.5, 1.42, 9)[1:]]))
    one = start_recursion(layer.elements, float(layer.f(np.array([layer.first_drive]))[0]), settings)
    for at in f:
        one = updated(one, float(at), math.nan)
    one = updated(replace(one, sampled_deg=math.inf), float(f[-1]), one.angle_deg + 0.02)
    assert abs(one.drift.width - 1) > 1e-3
    path = np.append(layer.f(np.array([layer.first_drive])), f)
    h, as_it_was = (sum(e.widened(w).along(path)[-1] for e in layer.elements) for w in (one.drift.width, 1.0))
    learnt = one.angle_deg - one.drift.zero_deg - one.drift.gain * one.f_deg
    assert abs(h - as_it_was) > 1e-3
    assert learnt - as_it_was == pytest.approx(h - as_it_was, rel=0.1)


def test_an_error_that_is_alike_along_a_stroke_counts_once(tmp_path):
    """Half a stroke with a constant error of three times that of the fit: zero takes some of it, width stays."""
    compensator = read_compensator(stored_fit(tmp_path / "identify.json"), "cmp")
    layer, settings = compensator.layer, recursion_settings(compensator)
    f = layer.f(np.linspace(0, 1.5, 300))
    angle = device(layer, np.linspace(0, 1.5, 300), Drift(), 0.0) + 3 * settings.noise_deg
    one, each = (
        start_recursion(layer.elements, float(layer.f(np.array([layer.first_drive]))[0]), of)
        for of in (settings, replace(settings, alike=1.0))
    )
    for at, seen in zip(f, angle, strict=True):
        one, each = updated(one, float(at), float(seen)), updated(each, float(at), float(seen))
    assert abs(one.drift.width - 1) <= one.standard_deviation.width
    assert one.standard_deviation.width > each.standard_deviation.width


def test_alike_below_one_is_refused():
    with pytest.raises(ValueError, match=r"alike = 0\.5: expected at least 1"):
        replace(settings_for(60.0, 0.1), alike=0.5)
