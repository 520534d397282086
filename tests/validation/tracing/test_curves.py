"""The curve model: operators against limits worked out by hand, and fits that recover the parameters put in."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.rig import preset
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.records.path import branches
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_record
from validation.tracing.baseline.curve import curve_problem
from validation.tracing.baseline.curve_kernels import (
    bouc_wen_element,
    lagged,
    play,
    tendon_tension,
    transformed,
    two_tendons,
)
from validation.tracing.baseline.samples import kept_samples
from validation.tracing.effect import catalogue

PLAN = ((20.0, 2.0, 0.1), (10.0, 2.0, 1.0), (20.0, 1.0, 1.0), (10.0, 1.0, 0.1))  # preload, amplitude, rate
TRUE = {
    "slope": 20.0,
    "even": 0.01,
    "odd": -0.02,
    "A": -0.6,
    "reach": 2.0,
    "n": 1.5,
    "gamma_beta": 0.5,
    "far_A": -0.02,
    "far_reach": 8.0,
    "bend_loop": 0.05,
    "slope_1": 0.98,
    "loop_1": 1.5,
    "reach_1": 0.9,
}
EXACT_DEG = 1e-4
FORMS = [(effect, i) for effect in catalogue() for i in range(len(effect.curve_forms))]


def bare_records(unit="mm", scale=1.0):
    """Four records for their protocol alone: the angle is in proportion to the drive."""
    out = []
    for preload, amplitude, rate in PLAN:
        program = sine(amplitude, rate, cycles=3, samples_per_cycle=60)
        out.append(
            Record(
                drive=scale * program.drive_mm,
                angle_deg=20.0 * program.drive_mm,
                drive_unit=unit,
                time_s=program.time_s,
                cycle=program.cycle,
                rig={"preload_N": preload},
            )
        )
    return out


@pytest.fixture(scope="module")
def problem():
    return curve_problem(bare_records())


def baseline(problem):
    return {**problem.start, **TRUE, **{f"state_{i}": 0.0 for i in range(len(problem.observed))}}


# --- kernels -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("A", "n", "rho"), [(-0.6, 1.5, 0.5), (1.895, 1.176, 0.827)])
def test_a_loop_is_the_bouc_wen_law(A, n, rho):
    """Eq. 7 of the paper by hysteresis.laws.bouc_wen: |A| / (beta + gamma) = saturation^n, reach = saturation / |A|."""
    f = 20 * np.sin(np.linspace(0, 14, 400))
    saturation = 1.3
    beta = abs(A) / saturation**n / (1 + rho)
    got = math.copysign(saturation, A) * bouc_wen_element(f, saturation / abs(A), n, rho, 0.0, np.ones_like(f))
    assert np.allclose(got, hysteresis(f, BoucWen(A, beta, rho * beta, n)), atol=1e-12)


def test_play_stands_still_for_its_width_and_lags_by_half():
    x = np.concatenate([np.linspace(0, 1, 101), np.linspace(1, -1, 201)[1:]])
    y = play(x, 0.2, 0.0)
    assert y[100] == pytest.approx(0.9)  # half a width behind
    assert np.all(y[101:121] == y[100])  # back by 0.2 at 0.01 a sample
    assert y[-1] == pytest.approx(-0.9)


def test_lag_of_a_ramp():
    """c' = (x - c) / tau with x = v t: c = v (t - tau (1 - exp(-t / tau))), whatever the sampling."""
    t = np.sort(np.random.default_rng(0).uniform(0, 3, 40))
    t[0] = 0.0
    expected = 2.0 * (t - 0.7 * -np.expm1(-t / 0.7))
    assert np.allclose(lagged(2.0 * t, t, 0.7), expected, atol=1e-12)


def test_the_flag_transforms_back_later():
    f = np.array([0.0, 5.0, 8.0, 7.0, 6.0, 5.0, 3.0, -6.0, 0.0])
    assert transformed(f, 4.0, 2.0).tolist() == [0.0, 1.0, 4.0, 4.0, 4.0, 3.0, 1.0, -2.0, 0.0]


@given(st.floats(0.0, 20.0), st.floats(0.01, 50.0))
def test_tendon_tension_solves_its_equation(toe, tension):
    """From k(T) = k_inf T / (T + T_toe): stretch = t - 1 + toe ln t."""
    assert tendon_tension(tension - 1 + toe * math.log(tension), toe) == pytest.approx(tension, rel=1e-8)


def test_two_taut_tendons_are_two_springs():
    """Without toe: r theta = c (T_a - T_b) / k = 2 c (x - r theta), as long as neither is slack."""
    x = np.linspace(-1, 1, 21)
    angle, soft = two_tendons(x, 1.0, 3.0, 0.0, 0.0, 0.0)
    assert np.allclose(angle, x * 6 / 7)
    assert np.allclose(soft, 1.0)


def test_slack_tendons_leave_a_dead_zone():
    """Hardly any preload: no motion within the slack, one spring beyond it, c / (1 + c) of the rest."""
    x = np.linspace(-1, 1, 201)
    angle, _ = two_tendons(x, 1e-9, 3.0, 0.0, 0.25, 0.25)
    assert np.allclose(angle, 0.75 * (x - np.clip(x, -0.25, 0.25)), atol=1e-7)


def test_toe_softens_by_tension():
    """At zero drive either tendon has k_inf / (1 + toe): r theta / x = c' / (1 + c') with c' = 2 c / (1 + toe)."""
    x = np.linspace(0, 1e-4, 5)
    angle, _ = two_tendons(x, 1.0, 3.0, 2.0, 0.0, 0.0)
    assert np.allclose(angle, x * 2 / 3, rtol=1e-4)


# --- forms -------------------------------------------------------------------------------------------------------

NOTHING = {
    "width": 0.0,
    "slack": 0.0,
    "skew": 0.0,
    "kink": 0.0,
    "even_deg": 0.0,
    "toe": 0.0,
    "fraction": 0.0,
    "widening": 0.0,
    "slope_loss": 0.0,
    "capstan": 0.0,
    "lag_s": 1e-12,
    "part": 0.0,
    "loop_loss": 0.0,
    "residual_deg": 0.0,
    "along_deg": 0.0,
    "across_deg": 0.0,
    "sine": 0.0,
    "cosine": 0.0,
    "perspective_per_deg": 0.0,
    "deg_per_s": 0.0,
    "size_deg": 0.0,
    "delay_s": 0.0,
    "growth": 0.0,
    "rise": 0.0,
    "excess": 0.0,
    "free_width": 0.0,
    "preloaded_width": 0.0,
    "engages_above": -1e3,
    "engages_below": 1e3,
    "lag": 0.0,
    "gain": 0.0,
    "error": 0.0,
    "give": 1e3,  # tendons that the preload has stretched far never go slack
}


def placed(problem, effect, i):
    return problem.scale.placed(effect.curve_forms[i])


@pytest.mark.parametrize(("effect", "i"), FORMS, ids=lambda v: getattr(v, "name", v))
def test_an_effect_without_size_does_nothing(problem, effect, i):
    form = placed(problem, effect, i)
    names = [
        (relative.name, constant.name) for relative, constant in zip(form.form.parameters, form.parameters, strict=True)
    ]
    values = {name: NOTHING.get(bare, form.starts[0][name]) for bare, name in names}
    without = problem.predict(baseline(problem), ())
    for a, b in zip(problem.predict(baseline(problem), [(form, values)]), without, strict=True):
        assert np.allclose(a, b, atol=1e-9)


@pytest.mark.parametrize(("effect", "i"), FORMS, ids=lambda v: getattr(v, "name", v))
def test_starts_lie_within_bounds_and_act(problem, effect, i):
    form = placed(problem, effect, i)
    without = problem.predict(baseline(problem), ())
    for start in form.starts:
        assert all(c.low <= start[c.name] <= c.high for c in form.parameters)
        with_it = problem.predict(baseline(problem), [(form, start)])
        assert max(float(np.abs(a - b).max()) for a, b in zip(with_it, without, strict=True)) > 1e-3


def recovered(problem, form):
    """Parameters of a form, and the rms residual, deg, from fits of all parameters together; the best of all starts.

    Records without noise: a fit that leaves as good as nothing is the best one.
    """
    cs = (*problem.parameters, *form.parameters)
    low, high = np.array([[c.to_unit(c.low) for c in cs], [c.to_unit(c.high) for c in cs]])

    def errors(x):
        values = {c.name: min(max(c.from_unit(v), c.low), c.high) for c, v in zip(cs, x, strict=True)}
        angles = problem.predict(values, [(form, values)])
        pairs = zip(angles, problem.observed, strict=True)
        return np.concatenate([(a - b) - (a - b).mean() for a, b in pairs])

    fits = []
    for start in problem.starts(form):
        x0 = np.clip([c.to_unit(start[c.name]) for c in cs], low + 1e-9, high - 1e-9)
        fits.append(least_squares(errors, x0, bounds=(low, high), x_scale="jac", max_nfev=80))
        if np.sqrt(np.mean(fits[-1].fun ** 2)) < EXACT_DEG:
            break
    fit = min(fits, key=lambda one: one.cost)
    return {c.name: c.from_unit(v) for c, v in zip(cs, fit.x, strict=True)}, float(np.sqrt(np.mean(fit.fun**2)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "i", "truth"),
    [
        ("backlash", 0, {"width_mm": 0.11}),
        ("tendon_creep", 0, {"fraction": 0.04, "time_s": 0.6}),
        ("preload_loss", 0, {"fraction": 0.25, "cycles": 2.0}),
        ("viscous_drag", 1, {"lag_s": 0.012}),
        ("time_delay", 0, {"delay_s": 0.012}),
        ("functional_fatigue", 0, {"loop_loss": 0.3, "residual_deg": -0.5, "cycles": 1.5}),
        ("notch_closure", 0, {"angle_deg": 31.0, "slope_loss": 0.3}),
        ("thermal_drift", 0, {"deg_per_s": 0.05}),
        ("unequal_tendons", 2, {"skew": 0.1, "even_deg": 0.4}),
    ],
)
def test_a_fit_recovers_the_parameters(problem, name, i, truth):
    effect = next(effect for effect in catalogue() if effect.name == name)
    form = placed(problem, effect, i)
    observed = problem.predict(baseline(problem), [(form, truth)])
    records = [replace(record, angle_deg=angle) for record, angle in zip(bare_records(), observed, strict=True)]
    found, residual = recovered(curve_problem(records), form)
    assert residual < 0.02  # half of the noise of records such as the paper's
    for key, value in truth.items():
        assert found[key] == pytest.approx(value, rel=0.1), key


def test_parameters_are_in_the_unit_of_the_drive():
    """A drive in steps of 1 um is a thousand times as many: bounds and starts follow."""
    effect = next(effect for effect in catalogue() if effect.name == "backlash")
    mm, step = curve_problem(bare_records()), curve_problem(bare_records("step", 1e3))
    (a,), (b,) = placed(mm, effect, 0).parameters, placed(step, effect, 0).parameters
    assert (a.name, b.name) == ("width_mm", "width_step")
    assert (b.high, b.scale) == pytest.approx((1e3 * a.high, 1e3 * a.scale))


# --- records -----------------------------------------------------------------------------------------------------


def test_records_of_the_chain_without_an_effect_are_explained():
    """A rig of weak friction and a toe, 2 preloads, rates and amplitudes: at most 1.5 times the noise is left."""
    rng, noise, records = np.random.default_rng(3), 0.04, []
    for preload, amplitude, rate in ((20, 2.2, 0.1), (10, 2.2, 1.0), (20, 1.1, 1.0), (10, 1.1, 0.1)):
        program = sine(amplitude, rate, cycles=2, samples_per_cycle=88)
        record = simulate_chain(preset("du2018-full-widths", preload_N=float(preload)), program)
        angle = record.angle_deg + rng.normal(0, noise, record.angle_deg.size)
        records.append(replace(record, angle_deg=angle, rig={"preload_N": float(preload)}))
    problem = curve_problem(records)
    pairs = zip(problem.predict(problem.start, ()), problem.observed, strict=True)
    residual = np.concatenate([(a - b) - (a - b).mean() for a, b in pairs])
    assert np.sqrt(np.mean(residual**2)) < 1.5 * noise


def test_records_without_time_or_cycles_have_no_forms_that_need_them():
    record = replace(bare_records()[0], time_s=None, cycle=None, rig={})
    few = curve_problem([replace(record, drive=record.drive[:70], angle_deg=record.angle_deg[:70])])
    having = {effect.name for effect in catalogue() if few.forms(effect)}
    assert {"time_delay", "viscous_drag", "tendon_creep", "functional_fatigue", "preload_loss"}.isdisjoint(having)
    assert {"backlash", "tendon_slack", "notch_closure"} <= having


def test_units_may_not_be_mixed():
    records = [bare_records()[0], bare_records("step", 1e3)[1]]
    with pytest.raises(RecordError, match=r"drive\.unit = step: expected mm"):
        curve_problem(records)


def test_thinning_keeps_turning_points():
    drive = np.round(np.sin(np.linspace(0, 40, 9001)), 6)
    kept = kept_samples(drive, 600)
    assert len(kept) < 620
    assert {branch.stop - 1 for branch in branches(drive)} <= set(kept.tolist())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pattern", "limit"),
    [
        ("surgical-manipulator-0-80", 0.03),
        ("surgical-manipulator-feedforward", 0.06),
        ("tee-probe-antero-posterior", 0.06),
        ("catheter-slack-*", 0.02),
        ("davinci-tool-*", 0.02),
        ("tendon-robot-*", 0.02),
    ],
)
def test_measured_records_are_represented(measured, pattern, limit):
    """The baseline follows each to a few percent of its range, before any effect is added."""
    problem = curve_problem([read_record(path) for path in sorted(measured.glob(f"{pattern}.csv"))], 300)
    pairs = zip(problem.predict(problem.start, ()), problem.observed, strict=True)
    residual = np.concatenate([(a - b) - (a - b).mean() for a, b in pairs])
    assert np.sqrt(np.mean(residual**2)) < limit * 2 * problem.scale.angle


def test_starts_have_the_parameters_of_the_baseline_with_them(problem):
    """Both are in one mapping, so their names must differ."""
    own = {p.name for p in problem.parameters}
    for effect in catalogue():
        for form in problem.forms(effect):
            names = {p.name for p in form.parameters}
            assert own.isdisjoint(names), effect.name
    form = placed(problem, next(e for e in catalogue() if e.name == "backlash"), 0)
    assert all(set(start) == own | {"width_mm"} for start in problem.starts(form))
