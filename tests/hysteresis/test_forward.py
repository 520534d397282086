"""Least squares by forward derivatives: derivatives by differences of the law, ends by those of scipy."""

from dataclasses import replace

import numpy as np
import pytest

from hysteresis import Record
from hysteresis.fitting.form import Form, Point, rmse
from hysteresis.fitting.forward import Problem, bounds_of, is_forward, polish_forward
from hysteresis.fitting.identification import identify
from hysteresis.fitting.samples import join
from hysteresis.fitting.search import FINE, polish
from hysteresis.fitting.serial import _applied, _covariances, _taken, serial_uncertainty
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.fitting.uncertainty import linearise
from hysteresis.laws.backbone import fitted_backbone
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.laws.bouc_wen_derivatives import follow_with_derivatives
from hysteresis.laws.elements import BOUC_WEN, EVERYWHERE
from hysteresis.records.holdout import hold_out

FORWARD = IdentifySettings(method="least-squares", forward=True)


def device(seed, correlation=0.0, samples=88):
    rng = np.random.default_rng(seed)
    phase = np.arange(3 * samples + 1) / samples % 1.0
    wave = np.where(phase < 0.25, 4 * phase, np.where(phase < 0.75, 2 - 4 * phase, 4 * phase - 4))
    f = rng.uniform(25.0, 45.0) * wave * (1 + 0.1 * wave)
    h = hysteresis(f, BoucWen(-rng.uniform(0.6, 1.1), 0.3, rng.uniform(-0.1, 0.2), rng.uniform(1.1, 3.0)))
    noise = rng.standard_normal(f.size)
    for k in range(1, f.size if correlation else 0):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
    return Record(2.2 * wave, f + h + 0.05 * noise)


def samples_and_form(record, knots=3):
    train = hold_out(record).train
    form = Form((fitted_backbone(record.drive[train], record.angle_deg[train], knots),), forward=True)
    return join([record], [train]), form


@pytest.mark.parametrize(
    "q",
    [[-0.1, 0.4, 0.7, 0.3, -0.2], [-0.4, 0.4, 0.0, 0.9, 0.0], [0.3, -2.0, 1.9, -0.5, 0.4], [0.0, 0.4, 0.5, 1.0, 1.0]],
)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_derivatives_are_those_of_the_law(q, sign):
    x = device(0).drive
    columns = np.column_stack([np.ones_like(x), x, x**2])
    at = np.array([*q, 0.3, 15.0, 0.4])

    def law(z):
        return BOUC_WEN.follow(columns @ z[5:], np.array([sign]), z[np.newaxis, :5], EVERYWHERE)[0]

    h, found = follow_with_derivatives(columns @ at[5:], columns, sign, at[:5])
    assert h == pytest.approx(law(at), abs=1e-13)
    low, high = np.array([-9, -9, 0, -1, -1, -99, -99, -99.0]), np.array([9, 9, 3, 1, 1, 99, 99, 99.0])
    for i in range(8):
        up, down = at.copy(), at.copy()
        up[i], down[i] = min(at[i] + 1e-6, high[i]), max(at[i] - 1e-6, low[i])
        expected = (law(up) - law(down)) / (up[i] - down[i])
        assert found[:, i] == pytest.approx(expected, abs=5e-6 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("seed", range(6))
def test_it_ends_where_the_least_squares_of_scipy_end(seed):
    samples, form = samples_and_form(device(seed))
    start = Point(-1.0, np.array([0.0, 0.0, 1.0, 0.2, 0.0]), np.array([0.0, 70.0, 70.0, 70.0]))
    found, _ = polish_forward(samples, form, start, None, FINE)
    expected, _ = polish(samples, replace(form, forward=False), start)
    assert rmse(samples, form, found) <= rmse(samples, form, expected) * (1 + 1e-9)
    low, high = bounds_of(samples, form)
    x = np.concatenate([found.q, found.c])
    assert ((low <= x) & (x <= high)).all()


def test_what_is_held_stays():
    samples, form = samples_and_form(device(3))
    start = Point(-1.0, np.array([0.0, 0.0, 1.0, 0.2, 0.0]), np.array([0.0, 70.0, 70.0, 70.0]))
    found, _ = polish_forward(samples, form, start, {2: 0.5}, FINE)
    expected, _ = polish(samples, replace(form, forward=False), start, {2: 0.5})
    assert found.q[2] == 0.5
    assert rmse(samples, form, found) == pytest.approx(rmse(samples, form, expected), rel=1e-8)


def test_the_jacobian_is_that_of_differences():
    samples, form = samples_and_form(device(4))
    point = Point(-1.0, np.array([0.0, 0.0, 0.7, 0.2, 0.1]), np.array([0.0, 70.0, 70.0, 70.0]))
    residual, columns = Problem.of(samples, form).linearised(-1.0, np.concatenate([point.q, point.c]))
    line = linearise(samples, form, point)
    assert residual == pytest.approx(line.residual, abs=1e-12)
    assert columns == pytest.approx(line.columns, abs=1e-3 * np.abs(line.columns).max())


def test_a_fit_of_one_record_has_the_residual_of_the_genetic_search_or_less():
    record = device(5)
    found, expected = identify(record, settings=FORWARD), identify(record)
    assert found.train.rmse_deg <= expected.train.rmse_deg * (1 + 1e-6)
    assert found.saturation_deg.value == pytest.approx(expected.saturation_deg.value, rel=0.01)
    assert found.bootstrap == {}


def test_other_models_are_not_fitted_forward():
    _, form = samples_and_form(device(0))
    assert is_forward(form)
    assert not is_forward(replace(form, forward=False))
    assert not is_forward(replace(form, elements=2))
    assert not is_forward(replace(form, longest_delay_s=0.1))
    assert not is_forward(replace(form, groups=(0, 0)))


# --- correlated noise ----------------------------------------------------------------------------------------------


def test_what_the_fit_takes_is_that_of_dense_matrices():
    rng = np.random.default_rng(0)
    jacobian = rng.standard_normal((30, 3))
    jacobian[10:14] = 0.0  # held out
    noise = _covariances(np.array([1.0, 0.6, 0.4, 0.2, 0.1]), 1)
    assert noise[:3] == pytest.approx([1.0, 0.6, 0.36])
    lag = np.abs(np.subtract.outer(np.arange(30), np.arange(30)))
    dense = np.where(lag < noise.size, noise[np.minimum(lag, noise.size - 1)], 0.0)
    assert _applied(noise, jacobian) == pytest.approx(dense @ jacobian)
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    hat, there = jacobian @ inverse @ jacobian.T, np.diag(jacobian.any(axis=1).astype(float))
    of_train = there @ dense @ there
    taken = hat @ of_train + of_train @ hat - hat @ of_train @ hat
    expected = [np.trace(taken, offset=k) for k in range(5)]
    assert _taken(jacobian, inverse, noise) == pytest.approx(expected)


def test_white_noise_has_the_covariance_of_least_squares():
    samples, form = samples_and_form(device(7))
    point, _ = polish_forward(
        samples, form, Point(-1.0, np.array([0.0, 0.0, 1.0, 0.2, 0.0]), np.array([0.0, 70.0, 70.0, 70.0])), None, FINE
    )
    line, found = linearise(samples, form, point), serial_uncertainty(samples, form, point)
    m, p = line.columns.shape
    expected = line.residual @ line.residual / (m - p) * line.inverse()[0]
    assert found.covariance == pytest.approx(expected, rel=1e-6)
    assert found.effective == pytest.approx(m)


def test_correlated_noise_widens_what_is_averaged_over_many_samples():
    record = device(8, correlation=0.6)
    samples, form = samples_and_form(record)
    start = Point(-1.0, np.array([0.0, 0.0, 1.0, 0.2, 0.0]), np.array([0.0, 70.0, 70.0, 70.0]))
    point, _ = polish_forward(samples, form, start, None, FINE)
    line, found = linearise(samples, form, point), serial_uncertainty(samples, form, point)
    white = line.residual @ line.residual / (len(line.residual) - 9) * line.inverse()[0]
    middle = form.size  # of f: a mean over the record
    assert 2.0 < found.covariance[middle, middle] / white[middle, middle] < 8.0  # 4 for an infinite record
    assert found.effective < 0.5 * len(line.residual)
