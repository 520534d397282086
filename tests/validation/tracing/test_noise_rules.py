"""Noise, dependence, channels and ranks of the tracer, by definition."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_fits import made

from hysteresis.records.record import Record
from validation.tracing.effect import SampleInputs
from validation.tracing.fitting import dependence, noise, ranking, smooth
from validation.tracing.fitting.channel_errors import (
    ChannelFit,
    _errors,
    channel_table,
    channel_words,
    with_channel_fits,
)
from validation.tracing.fitting.criterion import bic
from validation.tracing.fitting.fitted import ChannelErrors
from validation.tracing.fitting.noise import NoiseFloor, estimate_noise_floor
from validation.tracing.fitting.regressors import direction
from validation.tracing.prepared import prepared

NOISE = NoiseFloor(local_deg=0.1, repeats_deg=None)


# --- noise ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("branch", "count", "known"), [(3, 9, False), (4, 4, False), (4, 5, True), (5, 3, True)])
def test_noise_is_known_from_five_third_differences_in_branches_of_four_samples(branch, count, known):
    """So many branches of so many samples: a branch of four has one third difference, one of five has two."""
    step = branch - 1
    k = np.arange(step * count + 1)
    drive = np.abs((k / step + 1) % 2 - 1)
    one = prepared(Record(drive=drive, angle_deg=np.sin(3.7 * k) * 10, cycle=np.ones(k.size, dtype=int)), k)
    residual = 2.0 * (-1.0) ** k
    floor = estimate_noise_floor([one], [residual])
    assert floor.local_known is known
    row = residual - residual.mean()
    expected = 1.4826 * 16 / 20**0.5 if known else (row @ row / row.size) ** 0.5
    assert floor.local_deg == pytest.approx(expected, rel=1e-9)


def test_what_the_floor_is_and_where_it_is_from():
    known = NoiseFloor(0.2, 0.1)
    assert (known.deg, known.sensor_deg) == (0.1, 0.2)
    assert known.how == "cycles or trials that repeat each other"
    assert replace(known, by_repeats=True, repeats_deg=0.3).deg == 0.3
    assert replace(known, reference_deg=0.15).deg == 0.15
    assert replace(known, reference_deg=0.15).how == "the residual that the reference leaves"
    assert replace(known, reference_deg=0.05).deg == 0.1
    unknown = replace(known, local_known=False)
    assert (unknown.known, unknown.sensor_deg) == (False, None)
    assert unknown.how == "cycles or trials that repeat each other, by noise or by a drift"
    assert replace(unknown, by_repeats=True).known
    assert replace(unknown, reference_deg=0.1).known
    assert not replace(unknown, reference_deg=0.09).known
    assert not replace(unknown, by_repeats=True, repeats_deg=None).known
    assert replace(unknown, repeats_deg=None).how == "the whole residual: the noise is not known"
    assert NOISE.how == "neighbouring samples"


@pytest.mark.parametrize(
    ("found", "repeats", "local", "known", "expected"),
    [
        (None, 0.7, 0.34, True, 0.7),  # the residual, 1 deg, is within 3 times the noise of neighbours
        (None, 0.7, 0.33, True, None),
        (None, 0.7, 0.34, False, None),
        (0.9, 0.7, 0.1, True, 0.7),
        (1.29, None, 0.1, True, 1.29),
        (1.31, None, 0.1, True, None),  # more than 1.3 times the residual is structure
        (1.31, 0.7, 0.1, True, None),
        (None, None, 0.9, True, None),
    ],
)
def test_noise_of_a_sensor_is_what_cycles_differ_by_where_it_wanders_or_is_correlated(
    monkeypatch, found, repeats, local, known, expected
):
    monkeypatch.setattr(noise, "estimate_noise_floor", lambda *given: NoiseFloor(local, None, local_known=known))
    monkeypatch.setattr(noise, "correlated_noise_deg", lambda *given: found)
    monkeypatch.setattr(noise, "repeatability_deg", lambda *given: repeats)
    assert noise.sensor_noise_deg([], [np.array([3.0, 1.0]), np.array([-4.0, -6.0])]) == expected


@pytest.mark.parametrize(
    ("sizes", "found"), [((1.0, 1.21, 1.3, 1.4), True), ((1.0, 1.19, 1.3, 1.4), False), ((1, 1.3, 2.48, 2.5), False),
                         ((1, 1.3, 2.46, 2.5), True), ((1, 1.89, 2, 2.1), True), ((1, 1.91, 2, 2.1), False),
                         ((1, 1.3, math.nan, 1.4), False)],
)  # fmt: skip
def test_noise_is_correlated_between_white_and_smooth(monkeypatch, sizes, found):
    """By samples twice as far apart, the third differences grow by 1.2 at first, and by 1.9 at most."""
    of = dict(zip((1, 2, 4, 8), sizes, strict=True))
    monkeypatch.setattr(noise, "_third_difference_deg", lambda records, residuals, apart: of[apart])
    assert (noise.correlated_noise_deg([], []) is not None) is found


# --- dependence and smooth functions -------------------------------------------------------------------------------


def test_whiteness_counts_records_of_forty_samples():
    """Of errors that alternate, r_k^2 is (1 - k/m)^2 for each of ten lags."""
    for m, counted in ((40, True), (39, False)):
        row = np.resize([1.0, -1.0], m)
        k = np.arange(1, 11)
        total = m * (m + 2) * np.sum((1 - k / m) ** 2 / (m - k))
        expected = 1.0
        if counted:  # the chi square law of ten degrees: exp(-x/2) sum of (x/2)^j / j!
            half = total / 2
            expected = math.exp(-half) * sum(half**j / math.factorial(j) for j in range(5))
        assert dependence._portmanteau([row]) == pytest.approx(expected, rel=1e-6)
    assert dependence._portmanteau([np.zeros(50)]) == 1.0


def inputs_of(drive, *, timed=True, cycle=None, step=1.0):
    number = np.ones(drive.size, dtype=int) if cycle is None else cycle
    return SampleInputs(drive, step * np.arange(float(drive.size)), number, timed)


def test_quantities_that_a_residual_may_depend_on():
    drive = np.r_[np.linspace(-1, 2, 7), np.linspace(2, -1, 7)[1:]]
    tension = np.arange(13.0)
    records = [SimpleNamespace(record=SimpleNamespace(tension_a_N=tension), kept=np.arange(13))] * 2
    problem = SimpleNamespace(
        observed=[drive, 2 * drive], inputs=[inputs_of(drive), inputs_of(drive, step=0.5)], preloads_N=[1.0, 3.0],
        records=records,
    )  # fmt: skip
    fit_ = SimpleNamespace(model=SimpleNamespace(problem=problem), errors=[np.ones(13), np.zeros(13)])
    found = dependence._quantities(fit_)
    assert list(found) == ["drive", "angle", "direction", "distance since reversal", "cycle", "time", "rate", "tension",
                           "drive by preload"]  # fmt: skip
    assert found["angle"][0].tolist() == (drive + 1).tolist()
    assert found["distance since reversal"][0][[0, 6, 7, 12]].tolist() == [0, 3, -0.5, -3]
    assert (found["rate"][0][1], found["rate"][1][1]) == (0.5, 1.0)
    assert found["drive by preload"][0].tolist() == (-drive / 2).tolist()
    assert found["drive by preload"][1].tolist() == (drive / 2).tolist()
    problem.inputs[1] = inputs_of(drive, timed=False)
    problem.preloads_N = [2.0, 2.0]
    problem.records = [records[0], SimpleNamespace(record=SimpleNamespace(tension_a_N=None), kept=np.arange(13))]
    assert set(dependence._quantities(fit_)) == {
        "drive",
        "angle",
        "direction",
        "distance since reversal",
        "cycle",
        "time",
    }


def test_bases_of_smooth_functions_and_when_they_are_there():
    up = np.linspace(-2, 2, 41)
    drive = np.r_[up, up[::-1][1:]]
    three = np.repeat([0, 1, 2], 27)

    def names(*inputs, preloads=()):
        return set(smooth.bases_of(SimpleNamespace(inputs=inputs, preloads_N=list(preloads))))

    always = {"an odd function of the drive", "an even function of the drive", "the drive",
              "the drive and its direction", "the distance since the last reversal", "time"}  # fmt: skip
    assert names(inputs_of(drive, timed=False)) == always
    assert names(inputs_of(drive)) - always == {"the rate"}
    cycles = names(inputs_of(drive, timed=False, cycle=three)) - always
    assert cycles == {"the cycle", "the cycle and the direction of the drive"}
    for second, there in ((1.06, True), (1.04, False)):  # 5 % of the mean
        found = names(*[inputs_of(drive, timed=False)] * 2, preloads=(1.0, second))
        assert bool(found - always) is there
    both = smooth.bases_of(SimpleNamespace(inputs=[inputs_of(drive), inputs_of(0.5 * drive)], preloads_N=[1.0, 3.0]))
    sizes = {name: basis.shape[1] for name, basis in both.items()}
    assert list(sizes.values()) == [3, 2, 10, 8, 8, 6, 5, 8, 6]
    x = drive / 2  # over the largest drive of all records
    expected = np.column_stack([x, x**3, x**5])
    np.testing.assert_allclose(both["an odd function of the drive"][:81], expected - expected.mean(axis=0), atol=1e-12)
    half = np.column_stack([x**2 / 4, x**4 / 16])
    np.testing.assert_allclose(both["an even function of the drive"][81:], half - half.mean(axis=0), atol=1e-12)
    for rows, preload in ((slice(0, 81), -0.5), (slice(81, 162), 0.5)):
        by = both["the direction of the drive, by preload"][rows].sum(axis=1)  # splines add up to 1
        sign = direction(drive) * preload
        np.testing.assert_allclose(by, sign - sign.mean(), atol=1e-12)
    for basis in both.values():
        np.testing.assert_allclose(basis[:81].mean(axis=0), 0, atol=1e-12)


def test_smooth_functions_are_added_while_the_criterion_falls():
    """Orthogonal columns a, b, c take 0.5, 0.3 and 0.001 of the square. The first counts 1 parameter of the model."""
    m = 64
    walsh = np.array([[(-1.0) ** bin(i & j).count("1") for i in range(m)] for j in range(5)])
    error = 0.5**0.5 * walsh[1] + 0.3**0.5 * walsh[2] + 0.001**0.5 * walsh[3] + 0.199**0.5 * walsh[4]
    one = SimpleNamespace(
        holdout=SimpleNamespace(train_mask=np.ones(m, dtype=bool)), jacobian=np.ones((m, 1)), mean_square=1.0,
        error_deg=error,
    )  # fmt: skip
    bases = {name: walsh[j][:, None] for name, j in (("b", 2), ("a", 1), ("c", 3))}
    found = smooth._selected(one, 64.0, bases)
    assert (found.names, found.parameters) == (("a", "b"), 3)
    assert found.square == pytest.approx(0.2)
    assert found.gains == pytest.approx((0.5, 0.6))
    assert found.bic(64.0) == pytest.approx(bic(0.2, 3, 64.0))
    # a falls by n log 2 less log n, which must be more than 6: 6.4 of 13 samples, 5.8 of 12
    for n, names in ((13.0, ("a",)), (12.0, ())):
        assert smooth._selected(one, n, {"a": bases["a"]}).names == names


# --- channels and ranks --------------------------------------------------------------------------------------------


def test_errors_of_channels_are_in_their_units_and_of_their_records():
    """Weights of 2 deg/N: errors of 1 deg are 0.5 N. The angle's held-out sample is the last one."""
    measured = (np.array([0.0, 1.0, 2.0, 5.0]),)
    channel = SimpleNamespace(name="tension_a", unit="N", weight=2.0, measured=(np.array([10.0, 20.0, 30.0, 30.0]),))
    train = (np.array([True, True, False, False]),)
    one = made([[1.0, -1.0, 0.5, 1.5]], channels=[[1.0, -1.0, 2.0, 3.0]], train=train)
    one.model.problem.observed, one.model.problem.channels = measured, (channel,)
    other = replace(one, channels=ChannelErrors((np.array([2.0, 2.0, 2.0, 2.0]),), np.zeros((4, 2))))
    table = channel_table(one, other)
    assert table["angle"]["rmse_deg"] == pytest.approx((2.5 / 2) ** 0.5)
    assert (table["angle"]["max_abs_deg"], table["angle"]["max_rel_percent"]) == (1.5, 50.0)
    assert table["angle"]["normalised"] == pytest.approx((2.5 / 2) ** 0.5 / 3)
    no_range = {"max_rel_percent": None, "normalised": None}  # the tension does not change there
    assert table["tension_a"] == {
        "rmse_N": 1.0, "max_abs_N": 1.0, **no_range,
        "before": {"train": {"rmse_N": 0.5, "max_abs_N": 0.5, "max_rel_percent": 5.0, "normalised": 0.05},
                   "heldout": {"rmse_N": pytest.approx((13 / 8) ** 0.5), "max_abs_N": 1.5, **no_range}},
        "after": {"train": {"rmse_N": 1.0, "max_abs_N": 1.0, "max_rel_percent": 10.0, "normalised": 0.1},
                  "heldout": {"rmse_N": 1.0, "max_abs_N": 1.0, **no_range}},
    }  # fmt: skip
    assert channel_words(table) == ["Beside the angle, rms on held-out data: tension a 1.27 -> 1 N."]
    folded = replace(one, fold_errors=(np.array([np.nan, np.nan, np.nan, 0.25]),))
    assert channel_table(folded, folded)["angle"]["rmse_deg"] == 0.25
    alone = with_channel_fits({}, [ChannelFit("angle_2", "deg", one)])
    assert alone["angle_2"]["before"] == alone["angle_2"]["after"]
    assert channel_words(alone) == [f"Beside the angle, rms on held-out data: angle 2 {(2.5 / 2) ** 0.5:.3g} deg."]
    assert _errors("deg", measured, [np.ones(4)], [slice(None)])["normalised"] == 0.2


@pytest.mark.parametrize(("count", "words"), [(6, "notch 1 0.1 deg, notch 2"), (7, "7 notches 0.1 to 0.7 deg")])
def test_each_of_six_notches_has_its_figure_and_of_more_the_range(count, words):
    def own(k):
        return {when: {"heldout": {"rmse_deg": 0.1 * k}} for when in ("before", "after")}

    table = {f"notch_{k}": {"rmse_deg": 0.1 * k, **own(k)} for k in range(1, count + 1)}
    assert words in channel_words(table)[0]
    assert channel_words({"angle": own(1)}) == []


def test_ten_candidates_are_ranked_and_the_best_criterion_is_that_of_the_baseline_where_none_gains():
    signs = (-1.0) ** np.arange(10)

    def one(value, *names):
        return SimpleNamespace(names=names, heldout_rmse_deg=value, heldout_errors=[value * signs, np.zeros(0)],
                               heldout_error_deg=value * signs, fold_errors=None)  # fmt: skip

    gains = [-float(k) for k in range(1, 13)]
    candidates = [SimpleNamespace(names=("known", f"e{k}"), fitted=one(1.0, "known", f"e{k}"), delta_bic=g)
                  for k, g in enumerate(gains)]  # fmt: skip
    trace = SimpleNamespace(candidates=candidates[::-1], baseline=one(2.0, "known"), augmented=candidates[3].fitted,
                            names=("e3",))  # fmt: skip
    rows = ranking.ranked_models(trace)
    assert [row.name for row in rows] == [f"e{k}" for k in range(10)] + [""]
    assert [row.bic_above_best for row in rows] == [float(k) for k in range(1, 11)] + [0.0]
    assert [row.name for row in rows if row.chosen] == ["e3"]
    value, half = ranking.with_interval(one(1.0))
    assert (value, half) == pytest.approx((1.0, 1.96 / 20**0.5))
    few = SimpleNamespace(heldout_rmse_deg=1.0, heldout_errors=[np.ones(1)], heldout_error_deg=np.ones(1))
    assert ranking.with_interval(few)[1] == pytest.approx(1.96 / 2)  # two samples at least
