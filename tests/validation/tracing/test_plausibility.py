"""Ranges of sense: what is outside is shown, not named. Angles are changed by known numbers, or parameters by hand."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.rig import preset
from fem_models.rig.effects import Fatigue
from hysteresis.records.record import Record
from validation.tracing import plausibility
from validation.tracing.baseline.curve import curve_problem
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Model, fit
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.fitting.uncertainty import covariance, rise_without
from validation.tracing.plausibility import implausible, remarks
from validation.tracing.problem import AddedEffect
from validation.tracing.trace import trace_records

NOISE_DEG = 0.04


def effect(name):
    return next(effect for effect in catalogue() if effect.name == name)


def records(gain=1.0, told=True):
    """Two preloads of a clean rig whose angle is read with a gain."""
    rng, out = np.random.default_rng(2), []
    for preload, amplitude in ((20.0, 2.0), (10.0, 1.0)):
        run = simulate_chain(preset("du2018", preload_N=preload), sine(amplitude, 0.1, cycles=2, samples_per_cycle=60))
        angle = gain * run.angle_deg + rng.normal(0, NOISE_DEG, run.angle_deg.size)
        rig = {"preload_N": preload} | ({"preset": "du2018"} if told else {})
        out.append(Record(drive=run.drive, angle_deg=angle, time_s=run.time_s, cycle=run.cycle, rig=rig))
    return out


def fitted_with(problem, name, form, values):
    """A model with one effect, fitted from given values."""
    model = Model(problem, (AddedEffect(effect(name), form),))
    x = model.coordinates(problem.start, [values])
    return fit(model, divide_records(problem.records), x, threads=1, most_steps=15)


@pytest.fixture(scope="module")
def clean():
    return known_rig_problem(records())


def with_values(fitted, **values):
    """The same fit with some parameters of the effect set by hand."""
    x, at = fitted.x.copy(), fitted.model.baseline_size
    for place, parameter in enumerate(fitted.model.added[-1].form.parameters):
        if parameter.name in values:
            x[at + place] = parameter.to_unit(values[parameter.name])
    return replace(fitted, x=x)


@pytest.mark.parametrize("gain", [1.05, 1.22])
def test_a_camera_gain_is_named_within_its_range_and_shown_outside(gain):
    trace = trace_records(records(gain), effects=[effect("camera_misalignment")])
    words = "; ".join(trace.words)
    if gain == 1.05:
        assert trace.augmented.names == ("camera_misalignment",)
        assert "sensible" not in words
        return
    assert trace.verdict == "unexplained"
    assert trace.effects == ()
    assert "only with a camera gain of 1.22 (sensible: 0.9 to 1.1;" in words
    assert trace.candidates[0].names == ("camera_misalignment",)  # shown


def test_an_effect_whose_interval_contains_no_action_is_not_named(clean):
    form = effect("camera_misalignment").rig_forms[0]
    none = fitted_with(clean, "camera_misalignment", form, {"gain": 0.02})  # the records are clean
    assert abs(none.model.values(none.x)[1][0]["gain"]) < 0.002
    assert implausible(none) == ["the 95 % interval of camera_misalignment contains zero"]
    assert implausible(with_values(none, gain=0.05)) == []


def test_the_covariance_is_that_of_linear_regression(clean):
    """s^2 (J^T J)^-1 over the training samples, s^2 by the independent ones."""
    form = effect("camera_misalignment").rig_forms[0]
    fitted = fitted_with(clean, "camera_misalignment", form, {"gain": 0.02})
    found = covariance(fitted)
    train = fitted.holdout.train_mask
    J, error = fitted.jacobian[train], fitted.error_deg[train]
    alone = np.linalg.inv(J.T @ J) * (error @ error) / (error.size - J.shape[1])
    count = fitted.samples * error.size / train.size
    np.testing.assert_allclose(found.matrix, alone * error.size / count, rtol=1e-6)
    assert found.freedom == pytest.approx(count - J.shape[1])


def linear(J, x, low=-1e9, high=1e9):
    """A fit of a linear model that has converged, within bounds."""
    error = np.random.default_rng(5).standard_normal(len(J))
    error -= J @ np.linalg.lstsq(J, error, rcond=None)[0]
    rows = SimpleNamespace(train=np.arange(len(J)), jacobian=J, errors=error)
    bounds = tuple(np.broadcast_to(np.asarray(b, dtype=float), x.shape) for b in (low, high))
    return SimpleNamespace(rows=rows, x=x, model=SimpleNamespace(bounds=lambda: bounds))


def test_an_amount_is_tested_given_what_acts_only_beside_it():
    """Without bounds that is Wald's statistic, with the covariance of a regression without the shape."""
    rng = np.random.default_rng(4)
    J, x = rng.standard_normal((30, 5)), np.array([0.7, -0.4, 3.0, 1.0, 2.0])
    J[:, 2] = J[:, 0] + 1e-3 * rng.standard_normal(30)  # shape, nearly collinear with the first amount
    for shape in ([2], []):
        kept = [k for k in range(5) if k not in shape]
        inverse = np.linalg.inv(J[:, kept].T @ J[:, kept])[:2, :2]
        wald = x[:2] @ np.linalg.inv(inverse) @ x[:2]
        assert rise_without(linear(J, x), [0, 1], shape) == pytest.approx(wald, rel=1e-6)


def test_what_takes_the_place_of_an_amount_does_so_within_its_bounds():
    """Two columns that are nearly the same: the second one would have to be 1.7."""
    rng = np.random.default_rng(4)
    J = rng.standard_normal((40, 2))
    J[:, 1] = J[:, 0] + 1e-3 * J[:, 1]
    x = np.array([0.7, 1.0])
    assert rise_without(linear(J, x), [0], []) < 1e-4
    assert rise_without(linear(J, x, high=1.7), [0], []) < 1e-4
    missing = (J[:, 0] @ J[:, 0]) * 0.3**2
    assert rise_without(linear(J, x, high=1.4), [0], []) == pytest.approx(missing, rel=0.02)
    assert rise_without(linear(J[:, :1], x[:1]), [0], []) == pytest.approx(J[:, 0] @ J[:, 0] * 0.49)


def test_a_run_out_counts_in_radii_and_a_wheel_that_is_not_the_declared_one_is_told(clean):
    form = effect("wheel_eccentricity").rig_forms[1]
    fitted = fitted_with(clean, "wheel_eccentricity", form, {"sine_mm": 0.02, "cosine_mm": 0.02, "radius_mm": 0.75})
    small = with_values(fitted, sine_mm=0.05, cosine_mm=0.0, radius_mm=0.75)
    assert implausible(small) == []
    (words,) = implausible(with_values(fitted, sine_mm=0.3, cosine_mm=0.0, radius_mm=0.75))
    assert "only with a run-out of 0.3 mm (sensible: -0.075 to 0.075;" in words
    declared = preset("du2018").wheel.radius_mm
    assert f"a wheel radius of 0.75 mm, {declared:g} mm is declared" in "; ".join(remarks(small))
    assert remarks(with_values(small, radius_mm=declared)) == []


def test_a_parameter_at_its_bound_is_told(clean):
    form = effect("guide_friction").rig_forms[0]
    fitted = fitted_with(clean, "guide_friction", form, {"base_capstan": 0.02})
    assert remarks(with_values(fitted, base_capstan=0.3)) == []
    assert remarks(with_values(fitted, base_capstan=2.0)) == [
        "guide_friction base_capstan is at its bound of 2: its size is not determined"
    ]


def test_ranges_follow_the_unit_of_the_drive_and_the_cycle():
    """Half a half-stroke of play; a delay of a quarter of 10 s. Steps of 1 um are a thousand times as many."""
    for scale, unit in ((1.0, "mm"), (1e3, "step")):
        swings = [replace(r, drive=scale * r.drive, drive_unit=unit) for r in records(told=False)]
        problem = curve_problem(swings, 200)
        form = problem.scale.placed(effect("backlash").curve_forms[0])
        play = fitted_with(problem, "backlash", form, {f"width_{unit}": 0.1 * scale})
        (words,) = implausible(with_values(play, **{f"width_{unit}": 1.6 * scale}))
        assert f"(sensible: 0 to {1.0 * scale:.3g};" in words
        assert implausible(with_values(play, **{f"width_{unit}": 0.9 * scale})) == []
    form = problem.scale.placed(effect("time_delay").curve_forms[0])
    late = fitted_with(problem, "time_delay", form, {"delay_s": 0.1})
    (words,) = implausible(with_values(late, delay_s=4.0))
    assert "(sensible: -2.5 to 2.5;" in words


def test_a_residual_angle_counts_for_each_joint_and_training_takes_cycles():
    """A clean rig of another make was given 5 deg at each of its joints, all of it within a fifth of a cycle."""
    values = {"loop_loss": 0.3, "residual_deg": 0.3, "cycles": 1.5}
    rig = replace(preset("du2018", preload_N=20.0), fatigue=Fatigue(**values))
    run = simulate_chain(rig, sine(2.0, 0.1, cycles=4, samples_per_cycle=60))
    angle = run.angle_deg + np.random.default_rng(3).normal(0, NOISE_DEG, run.angle_deg.size)
    told = {"preload_N": 20.0, "preset": "du2018"}
    one = Record(drive=run.drive, angle_deg=angle, time_s=run.time_s, cycle=run.cycle, rig=told)
    problem = known_rig_problem([one])
    fitted = fitted_with(problem, "functional_fatigue", effect("functional_fatigue").rig_forms[0], values)

    def outside(**changed):
        return [words for words in implausible(with_values(fitted, **values | changed)) if words.startswith("only")]

    most = 0.25 * np.ptp(one.angle_deg) / preset("du2018").joints
    assert implausible(fitted) == []
    assert outside(residual_deg=0.8 * most) == []
    (words,) = outside(residual_deg=1.8 * most)
    assert f"(sensible: {-most:.3g} to {most:.3g}; residual strains" in words
    (words,) = outside(cycles=0.21)
    assert "(sensible: 0.5 to 200; training takes cycles" in words


def test_every_effect_has_a_range_of_sense_with_a_reason():
    """Effects whose files say nothing here: closure and plateau are ranged by geometry and metal in their own files."""
    without = set()
    for one in catalogue():
        forms = [*one.rig_forms, *one.curve_forms, *one.space_forms]
        parameters = [p for form in forms for p in form.parameters]
        if not any(p.sensible for p in parameters):
            without.add(one.name)
        for p in parameters:
            if p.sensible:
                assert len(p.sensible.because) > 20
                assert p.sensible.low < p.sensible.high
                assert math.isfinite(p.sensible.low)
                assert math.isfinite(p.sensible.high)
    assert without <= {"notch_closure", "superelastic_plateau"}


def test_a_negative_delay_is_told():
    def words(delay_s):
        model = SimpleNamespace(problem=None, values=lambda x: ({}, [{"delay_s": delay_s}]))
        return plausibility._remarks_on_baseline(SimpleNamespace(model=model, x=None))

    assert words(0.01) == []
    assert words(-0.01)[0].startswith("the delay is negative: the drive follows the angle")


@pytest.mark.parametrize(("lows", "told"), [((-0.1, -0.2), True), ((-0.1, 0.2), False), ((0.1, 0.2), False)])
def test_an_effect_whose_every_amount_may_be_zero_is_told(monkeypatch, lows, told):
    amount = SimpleNamespace(acts_from_zero=True)
    given = [SimpleNamespace(effect="wheel", parameter=amount, low=low, high=1.0) for low in lows]
    monkeypatch.setattr(plausibility, "covariance", lambda fitted: SimpleNamespace(matrix=None, freedom=9.0))
    monkeypatch.setattr(plausibility, "_estimates", lambda *more: given)
    words = plausibility.zero_words(SimpleNamespace())
    assert [one.startswith("the interval of wheel holds zero") for one in words] == [True] * told
