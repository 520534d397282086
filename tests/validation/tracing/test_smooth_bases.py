"""Columns of the smooth functions, tests of dependence and folds against their definitions, on problems by hand."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.stats import f as f_law

from hysteresis.records.record import Record
from validation.tracing.effect import SampleInputs
from validation.tracing.fitting.dependence import dependences
from validation.tracing.fitting.folds import folds_of
from validation.tracing.fitting.holdout import protocol
from validation.tracing.fitting.noise import estimate_noise_floor
from validation.tracing.fitting.ranking import best_candidates
from validation.tracing.fitting.smooth import bases_of, smooth_functions
from validation.tracing.prepared import prepared

STEPS = 12


def inputs(cycles: int = 3, *, size: float = 2.0, timed: bool = True) -> SampleInputs:
    """Triangles from the middle: an approach of a quarter, then whole cycles. The times are not even."""
    k = np.arange(STEPS + 4 * STEPS * cycles + 1)
    drive = size * (np.abs(((k + STEPS) / STEPS) % 4 - 2) - 1)  # 0 at first, then down to -1
    cycle = np.where(k <= STEPS, 0, 1 + (k - STEPS - 1) // (4 * STEPS))
    return SampleInputs(drive, 0.1 * k + 0.001 * k**1.5, cycle, timed)


def problem(*rows: SampleInputs, preloads=(20.0, 10.0)) -> SimpleNamespace:
    return SimpleNamespace(inputs=rows, preloads_N=preloads)


def columns(x: np.ndarray, low: float, high: float, count: int) -> np.ndarray:
    """Cubic B-splines one by one, with even knots, the ends fourfold."""
    knots = np.r_[[low] * 3, np.linspace(low, high, count - 2), [high] * 3]
    one = [BSpline(knots, np.eye(count)[i], 3, extrapolate=False) for i in range(count)]
    return np.stack([np.nan_to_num(spline(x)) for spline in one], axis=1)


def rising(drive: np.ndarray) -> np.ndarray:
    """+1 or -1 by the way that led to a sample; the first sample counts to the branch that it begins."""
    way = np.sign(np.diff(drive))
    return np.r_[way[0], way]


def since(drive: np.ndarray) -> np.ndarray:
    """Way since the last turning point, sample by sample."""
    out, turn = np.zeros(drive.size), 0
    for i in range(1, drive.size):
        if i >= 2 and (drive[i] - drive[i - 1]) * (drive[i - 1] - drive[i - 2]) < 0:
            turn = i - 1
        out[i] = abs(drive[i] - drive[turn])
    return out


def stacked(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([part - part.mean(axis=0) for part in parts])


def test_columns_of_every_smooth_function():
    """Two records at preloads of 20 and 10 N, whose mean is 15 N, one with half the stroke of the other."""
    rows, weights = (inputs(3), inputs(3, size=1.0)), (20 / 15 - 1, 10 / 15 - 1)
    found = bases_of(problem(*rows))
    x = [one.drive / 2.0 for one in rows]
    signs = [rising(one.drive)[:, None] for one in rows]
    way = [np.minimum(since(one.drive) / 2.0, 2.0) for one in rows]
    rates = [np.gradient(one.drive, one.time_s) for one in rows]
    fastest = max(np.abs(row).max() for row in rates)
    number = [one.cycle / 3 for one in rows]
    time = [one.time_s / one.time_s[-1] for one in rows]
    cubic = [np.polynomial.polynomial.polyvander(v, 3) for v in number]  # four splines: all cubics
    expected = {
        "an odd function of the drive": [np.stack([v, v**3, v**5], axis=1) for v in x],
        "an even function of the drive": [np.stack([v**2, v**4], axis=1) for v in x],
        "the drive": [columns(v, -1, 1, 10) for v in x],
        "the drive and its direction": [columns(v, -1, 1, 8) * s for v, s in zip(x, signs, strict=True)],
        "the distance since the last reversal": [columns(v, 0, 2, 8) * s for v, s in zip(way, signs, strict=True)],
        "time": [columns(v, 0, 1, 6) for v in time],
        "the rate": [columns(v / fastest, -1, 1, 5) for v in rates],
        "the drive, by preload": [columns(v, -1, 1, 8) * w for v, w in zip(x, weights, strict=True)],
        "the direction of the drive, by preload": [
            columns(v, -1, 1, 6) * s * w for v, s, w in zip(x, signs, weights, strict=True)
        ],
    }
    spans = {
        "the cycle": cubic,
        "the cycle and the direction of the drive": [c * s for c, s in zip(cubic, signs, strict=True)],
    }
    assert set(found) == set(expected) | set(spans)
    for name, parts in expected.items():
        np.testing.assert_allclose(found[name], stacked(parts), atol=1e-9, err_msg=name)
    for name, parts in spans.items():  # the same span: each is a combination of the other's columns
        wanted = stacked(parts)
        assert found[name].shape == (wanted.shape[0], 4), name
        for a, b in ((found[name], wanted), (wanted, found[name])):
            np.testing.assert_allclose(a @ np.linalg.lstsq(a, b, rcond=None)[0], b, atol=1e-8, err_msg=name)


@pytest.mark.parametrize(("cycles", "count"), [(1, None), (2, 3), (3, 4), (4, 5), (7, 5)])
def test_functions_of_the_cycle_need_two_cycles_and_have_five_columns_at_most(cycles: int, count: int | None):
    found = bases_of(problem(inputs(cycles), preloads=()))
    names = ("the cycle", "the cycle and the direction of the drive")
    assert [found[name].shape[1] if name in found else None for name in names] == [count, count]
    assert not any("preload" in name for name in found)


@pytest.mark.parametrize(("low", "there"), [(19.0, False), (18.5, True)])
def test_functions_by_preload_need_preloads_that_differ_by_a_twentieth(low: float, there: bool):
    found = bases_of(problem(inputs(), inputs(), preloads=(19.5, low)))
    assert ("the drive, by preload" in found) is there
    assert "the rate" not in bases_of(problem(inputs(timed=False), preloads=()))


def residual_of(rows, errors) -> SimpleNamespace:
    """A fit without parameters that has these errors."""
    records = [SimpleNamespace(record=SimpleNamespace(tension_a_N=None), kept=None) for _ in rows]
    given = SimpleNamespace(
        inputs=rows, observed=[-error for error in errors], preloads_N=(), records=records, angle_names=()
    )  # fmt: skip
    return SimpleNamespace(errors=errors, error_deg=np.concatenate(errors), model=SimpleNamespace(problem=given))


def test_dependence_is_the_f_test_of_a_regression_with_independent_samples():
    """Three records; the errors of each follow an autoregression of their own, and rise with the drive."""
    rng, rows, errors = np.random.default_rng(5), [inputs(2) for _ in range(3)], []
    for one in rows:
        noise = rng.normal(0, 1, one.drive.size)
        for i in range(1, noise.size):
            noise[i] += 0.4 * noise[i - 1]
        errors.append(noise + 0.3 * one.drive)
    errors = [error - error.mean() for error in errors]
    found = {one.on: one for one in dependences(residual_of(rows, errors))}
    X = stacked([columns(one.drive, -2, 2, 6) for one in rows])
    whole = np.concatenate(errors)
    rest = whole - X @ np.linalg.lstsq(X, whole, rcond=None)[0]
    part = 1 - rest @ rest / (whole @ whole)
    each = np.split(rest, np.cumsum([error.size for error in errors])[:-1])
    r = sum(e[1:] @ e[:-1] for e in each) / sum(e @ e for e in each)
    rank = np.linalg.matrix_rank(X)
    spare = rest.size * (1 - r) / (1 + r) - rank - 1
    assert found["drive"].part == pytest.approx(part, rel=1e-9)
    assert found["drive"].p == pytest.approx(f_law.sf(part / rank / ((1 - part) / spare), rank, spare), rel=1e-6)
    assert 0.01 < found["drive"].p < 0.5  # a number with digits


@pytest.mark.parametrize(
    "drive", [np.linspace(-2, 2, 200), np.random.default_rng(0).permutation(np.linspace(-2, 2, 200))]
)
def test_what_is_a_function_of_the_drive_alone_is_not_by_chance(drive):
    one = SampleInputs(drive, np.arange(200.0), np.ones(200, dtype=int), timed=False)
    for error in (drive - drive.mean(), 1e-9 * (drive - drive.mean())):
        found = {each.on: each for each in dependences(residual_of([one], [error]))}
        assert (found["drive"].part, found["drive"].p) == (pytest.approx(1.0), 0.0)


def test_a_quantity_that_is_constant_in_each_record_is_left_out_and_the_next_ones_are_not():
    rows = [SampleInputs(one.drive, one.time_s, np.full(one.cycle.size, n), one.timed) for n, one in
            enumerate((inputs(1), inputs(1)), 1)]  # fmt: skip
    errors = [np.random.default_rng(n).normal(0, 1, one.drive.size) for n, one in enumerate(rows)]
    found = [one.on for one in dependences(residual_of(rows, errors))]
    assert "cycle" not in found
    assert {"drive", "direction", "time", "rate"} <= set(found)


def test_two_records_are_halved_between_the_two_cycles_next_to_the_middle():
    """Cycles end at samples 49, 89 and 129 of 200: the second end is nearest to the middle."""
    k = np.arange(200)
    drive = np.abs((k / 10) % 2 - 1)
    cycle = np.repeat([1, 2, 3, 4], [50, 40, 40, 70])
    one = prepared(Record(drive=drive, angle_deg=np.sin(k), cycle=cycle), k)
    folds = folds_of([one, one])
    assert [fold.name for fold in folds] == [
        f"{half} half of record {i}" for i in (1, 2) for half in ("first", "second")
    ]
    sizes = [[int(test.sum()) for test in fold.test] for fold in folds]
    assert sizes == [[90, 0], [110, 0], [0, 90], [0, 110]]


def test_a_protocol_has_half_the_range_of_the_drive_and_cycles_per_second():
    k = np.arange(121)
    record = Record(drive=3 * np.abs((k / 20) % 2 - 1), angle_deg=np.sin(k), time_s=0.5 * k, rig={"preload_N": 7.0})
    found = protocol(prepared(record, k))
    assert (found.preload_N, found.amplitude) == (7.0, pytest.approx(1.5))
    assert found.rate_Hz == pytest.approx(np.unique(prepared(record, k).inputs.cycle).size / 60.0, rel=0.5)


def test_branches_of_four_samples_tell_the_noise_and_shorter_ones_do_not():
    """A zigzag of three steps: branches of four samples, with their turning points, have one third difference each."""
    for steps, known in ((3, True), (2, False)):
        k = np.arange(20 * steps + 1)
        drive = np.abs((k / steps) % 2 - 1)
        one = prepared(Record(drive=drive, angle_deg=np.sin(3.7 * k) * 10), k)
        longest = max(b.stop - b.start for b in one.branches)
        assert longest == steps + 1
        assert estimate_noise_floor([one], [(-1.0) ** k]).local_known is known


def test_ten_candidates_are_ranked():
    def candidate(gain: float) -> SimpleNamespace:
        return SimpleNamespace(fitted=SimpleNamespace(heldout_rmse_deg=1.0), delta_bic=gain)

    trace = SimpleNamespace(candidates=[candidate(i) for i in range(13)], baseline=SimpleNamespace(fold_errors=None))
    assert [one.delta_bic for one in best_candidates(trace)] == list(range(12, 2, -1))


def test_gains_are_parts_of_the_mean_square_that_each_function_takes_away():
    """An error that is even in the drive, with a part by its direction, and noise: two functions."""
    one, rng = inputs(3), np.random.default_rng(8)
    x = one.drive / 2.0
    error = 3.0 * x**2 + 0.6 * x * rising(one.drive) + rng.normal(0, 0.05, x.size)
    error -= error.mean()
    record = SimpleNamespace(only_loads=False)
    given = SimpleNamespace(inputs=[one], preloads_N=(), records=[record])
    fit = SimpleNamespace(
        error_deg=error, mean_square=float(error @ error) / error.size, jacobian=np.zeros((x.size, 0)),
        holdout=SimpleNamespace(train_mask=np.ones(x.size, dtype=bool)), model=SimpleNamespace(problem=given),
        angle_samples=200.0,
    )  # fmt: skip
    found = smooth_functions(fit)
    squares, columns_of = [fit.mean_square], np.zeros((x.size, 0))
    bases = bases_of(given)
    for name in found.names:
        columns_of = np.column_stack([columns_of, bases[name]])
        rest = error - columns_of @ np.linalg.lstsq(columns_of, error, rcond=None)[0]
        squares.append(float(rest @ rest) / rest.size)
    assert found.names == ("an even function of the drive", "the drive and its direction")
    assert found.gains == pytest.approx([1 - b / a for a, b in pairwise(squares)], rel=1e-6)
    assert found.square == pytest.approx(squares[-1], rel=1e-6)
    assert found.parameters == columns_of.shape[1]
