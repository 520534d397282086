"""The model of a record: number of knots of f, number of elements of h, and the best of several optima."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from hysteresis.fitting.form import Form, Point, rmse, without_hysteresis
from hysteresis.fitting.forward import is_forward
from hysteresis.fitting.samples import Samples, join
from hysteresis.fitting.search import (
    COARSE,
    FINE,
    POLISH_SAMPLES,
    Effort,
    Found,
    explore,
    extended,
    polish,
    split_element,
    with_curve_of,
)
from hysteresis.laws.backbone import Backbone, Kinematics, fitted_backbone, given_backbone
from hysteresis.laws.elements import BOUC_WEN
from hysteresis.records.holdout import Split, validate_within
from hysteresis.records.record import Record

_KNOTS = (1, 2, 3, 5, 9, 17)  # numbers of slopes that are tried for a fitted f
_SEARCH_KNOTS = 9  # number of slopes during the global search
_SEARCH_SAMPLES = 400  # of a record
_AS_GOOD = 1.05  # a simpler form is chosen if its validation error is within this factor of the best
_NEAR = 1.5  # results of least squares within this factor of the best error are followed up
_SHARES = (0.05, 0.2, 0.5)  # of the path to saturation: where the first of two elements may end
_SAME_END = 1.01  # in errors: two searches ended at the same fit
_ASIDE = 0.3  # further constants of a wider law, from where least squares also start
_ROUNDING = 1e-9  # of the angle's range; smaller errors are rounding

Curves = Mapping[int, tuple[Backbone, ...]]
"""Number of knots -> f of each record; 0 for given kinematics."""


class _Optima(NamedTuple):
    """Optima about as good as the best, which comes first."""

    points: list[Point]
    evaluations: int
    seeds_agreeing: int


class _Candidate(NamedTuple):
    """A model with its error on the validation fold."""

    rmse_deg: float
    form: Form
    point: Point


def find_model(
    records: Sequence[Record],
    splits: Sequence[Split],
    bases: Sequence[Kinematics] | None,
    form: Form,
    efforts: Sequence[Effort],
    elements: int | None,
    contained: Found | None = None,
    near: Form | None = None,
) -> Found:
    """Find the form of the model and its parameters.

    A validation fold within the training samples chooses the form (knots of a fitted f, elements of h) and the
    optimum. If only one form is possible, there is no validation.

    Parameters
    ----------
    records, splits
        The data.
    bases
        Given kinematics of each record, or None for a fitted f.
    form
        Groups and longest delay; backbones and elements are replaced.
    efforts
        One for each search.
    elements
        Of h; None to choose.
    contained
        Optimum of a law of one element that the law of ``form`` contains: the search then starts from there, and the
        result fits the training samples at least as well.
    near
        Form of another model of the same data: only its number of knots, the next lower and the next higher are tried.
    """
    fitness, timed = efforts[0].fitness, form.longest_delay_s > 0
    samples = join(records, [split.train for split in splits], timed=timed)
    curves = _curves(records, samples, bases)
    if near is not None and bases is None:
        at = _KNOTS.index(len(near.backbones[0].names) - 1)
        curves = {knots: curves[knots] for knots in _KNOTS[max(0, at - 1) : at + 2]}
    wanted = (1, 2) if elements is None else (elements,)
    if fitness != "rmse" or (bases is not None and wanted == (1,)):
        form = replace(form, backbones=curves[min(_SEARCH_KNOTS, max(curves))])
        optima = _search(samples.thinned(_SEARCH_SAMPLES * len(records)), form, efforts, contained)
        found = Found(form, optima.points[0], optima.evaluations, optima.seeds_agreeing)
    else:
        found = _choose(records, splits, curves, form, efforts, wanted, contained)
    if fitness != "rmse":
        return found
    baseline = without_hysteresis(found.form, samples)
    if found.point.sign == 0:
        return replace(found, point=baseline)
    fine = samples.thinned(POLISH_SAMPLES)
    point, calls = polish(fine, found.form, found.point)
    if contained is not None and rmse(fine, found.form, point) > rmse(fine, contained.form, contained.point):
        wider, start = extended(contained.form, contained.point, form.base_law, (0.0,) * _more(form, contained))
        point, calls = polish(fine, wider, start)
        found, baseline = replace(found, form=wider), without_hysteresis(wider, samples)
    point = point if _is_significant(fine, found.form, point, baseline) else baseline
    return replace(found, point=point, evaluations=found.evaluations + calls)


def _curves(records: Sequence[Record], samples: Samples, bases: Sequence[Kinematics] | None) -> Curves:
    drive, angle = np.concatenate(samples.train_drives()), samples.angle_deg[samples.train]
    if bases is not None:
        return {0: tuple(given_backbone(base, drive, angle, records[0].drive_unit) for base in bases)}
    return {knots: (fitted_backbone(drive, angle, knots),) * len(records) for knots in _KNOTS}


def _is_significant(samples: Samples, form: Form, point: Point, baseline: Point) -> bool:
    """Tell whether h lowers the training error by more than the same number of parameters would by fitting noise.

    The criterion is m log(sum of squares) + size log m (Schwarz 1978, doi 10.1214/aos/1176344136), together with a
    minimum gain.
    """
    m = int(samples.train.sum())
    without = rmse(samples, form, baseline)
    gain = min(1 / _AS_GOOD, m ** (-0.5 * form.size / m))
    return without > _rounding(samples) and rmse(samples, form, point) < gain * without


def _rounding(samples: Samples) -> float:
    return _ROUNDING * samples.span_deg()


def _more(form: Form, contained: Found) -> int:
    return form.base_law.size - contained.form.base_law.size


def _search(samples: Samples, form: Form, efforts: Sequence[Effort], contained: Found | None = None) -> _Optima:
    """Search globally on few samples, and refine the points that are found."""
    if contained is not None:
        aside = _ASIDE * np.eye(_more(form, contained))
        wider = [
            extended(contained.form, contained.point, form.base_law, more)
            for more in np.concatenate([0 * aside[:1], aside, -aside]).tolist()
        ]
        ends, calls = _polish_all(samples, form, [with_curve_of(form, samples, *one) for one in wider])
        return _Optima(ends[:1], calls, len(efforts))
    points: list[Point] = []
    errors: list[float] = []
    evaluations = 0
    for effort in efforts:
        found, calls = explore(samples, form, effort)
        evaluations += calls
        if effort.fitness != "rmse":
            return _Optima(found[:1], evaluations, 1)
        ends, calls = _polish_all(samples, form, found)
        evaluations += calls
        points += ends
        errors.append(rmse(samples, form, ends[0]))
    agreeing = sum(error <= max(_SAME_END * min(errors), _rounding(samples)) for error in errors)
    return _Optima(_nearest(samples, form, points), evaluations, agreeing)


def _polish_all(samples: Samples, form: Form, points: Sequence[Point]) -> tuple[list[Point], int]:
    tolerance = FINE if form.base_law is BOUC_WEN and form.elements == 1 else COARSE
    polished = [polish(samples, form, point, tolerance=tolerance) for point in points]
    return _nearest(samples, form, [point for point, _ in polished]), sum(calls for _, calls in polished)


def _nearest(samples: Samples, form: Form, points: Sequence[Point]) -> list[Point]:
    """Keep the points about as good as the best, the best first."""
    ends = sorted(((rmse(samples, form, point), point) for point in points), key=lambda end: end[0])
    return [point for error, point in ends if error <= _NEAR * ends[0][0]]


def _choose(
    records: Sequence[Record],
    splits: Sequence[Split],
    curves: Curves,
    form: Form,
    efforts: Sequence[Effort],
    elements: Sequence[int],
    contained: Found | None,
) -> Found:
    """Choose knots, elements and optimum by their error on a validation fold within the training samples.

    The simplest model about as good as the best is chosen. The order is: without hysteresis, one element, two.
    """
    timed = form.longest_delay_s > 0
    if tuple(elements) == (1,) and is_forward(replace(form, backbones=curves[min(curves)])):
        return _choose_by_information(join(records, [split.train for split in splits]), curves, form, efforts)
    inner = [validate_within(record, split) for record, split in zip(records, splits, strict=True)]
    few = join(records, [split.train for split in inner], timed=timed).thinned(_SEARCH_SAMPLES * len(records))
    fold = join(records, [split.heldout for split in inner], timed=timed).thinned(POLISH_SAMPLES)
    affordable = [knots for knots in curves if 3 * (knots + 6) <= few.train.sum()] or [min(curves)]
    forms = {knots: replace(form, backbones=curves[knots]) for knots in affordable}
    first = forms[min(affordable[-1], _SEARCH_KNOTS)]
    optima = _search(few, first, efforts, contained)
    evaluations = optima.evaluations
    baselines = [(one, without_hysteresis(one, few)) for one in forms.values()]
    tried = [_Candidate(rmse(fold, one, baseline), one, baseline) for one, baseline in baselines]
    ends: dict[int, list[Point]] = {}
    for number, (knots, one) in product(range(1, max(elements) + 1), forms.items()):
        if number == 1:
            moved = [with_curve_of(one, few, first, point) for point in optima.points]
        else:
            pairs = [split_element(one, point, share) for point in ends[knots][:1] for share in _SHARES]
            one, moved = pairs[0][0], [point for _, point in pairs]
        ends[knots], calls = _polish_all(few, one, moved)
        evaluations += calls
        if number in elements:
            tried.append(_best(fold, one, ends[knots]))
    limit = max(_AS_GOOD * min(candidate.rmse_deg for candidate in tried), _rounding(few))
    chosen = next(candidate for candidate in tried if candidate.rmse_deg <= limit)
    return Found(chosen.form, chosen.point, evaluations, optima.seeds_agreeing)


def _choose_by_information(samples: Samples, curves: Curves, form: Form, efforts: Sequence[Effort]) -> Found:
    """Choose the knots of f by Akaike's criterion, m log(sum of squares) + 2 size (1974, doi 10.1109/TAC.1974.1100705).

    A fold takes the simplest of the models that predict nearly as well. What a curve that is too simple leaves is small
    beside the noise, but alike in all cycles: it moves the parameters of h by more than their intervals. Least squares
    by forward derivatives are quick enough for all numbers of knots on all samples.
    """
    few, fine = samples.thinned(_SEARCH_SAMPLES), samples.thinned(POLISH_SAMPLES)
    affordable = [knots for knots in curves if 3 * (knots + 6) <= few.train.sum()] or [min(curves)]
    first = replace(form, backbones=curves[min(affordable[-1], _SEARCH_KNOTS)])
    optima = _search(few, first, efforts)
    evaluations, tried = optima.evaluations, list[tuple[float, Form, Point]]()
    for knots in affordable:
        one = replace(form, backbones=curves[knots])
        ends, calls = _polish_all(fine, one, [with_curve_of(one, few, first, point) for point in optima.points])
        evaluations += calls
        error = max(rmse(fine, one, ends[0]), _rounding(fine))
        criterion = 2 * (fine.train.sum() * math.log(error) + one.size + len(ends[0].c))
        tried.append((float(criterion), one, ends[0]))
    _, best, point = min(tried, key=lambda one: one[0])
    return Found(best, point, evaluations, optima.seeds_agreeing)


def _best(fold: Samples, form: Form, points: Sequence[Point]) -> _Candidate:
    return min((_Candidate(rmse(fold, form, point), form, point) for point in points), key=lambda c: c.rmse_deg)
