"""What a fit is worth: errors on both parts of the records, intervals, and warnings in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hysteresis import search
from hysteresis.arrays import Floats
from hysteresis.fit import Fit
from hysteresis.holdout import Split
from hysteresis.metrics import Errors, errors, noise_floor
from hysteresis.record import Record
from hysteresis.search import Form, Point, Samples
from hysteresis.uncertainty import Uncertainty, bootstrap, coordinates, parameters_of, uncertainty

_NO_HYSTERESIS = "no hysteresis above the noise in this record"
_STANDSTILL = -1.1  # A; -1 is a play, some more is within what steps of the drive can tell
_ILL_CONDITIONED = 1e4
_CORRELATED = 0.98
_SATURATED = 0.95  # of the saturation
_SUSPECT = 2.0  # held-out error in training errors
_ROUNDING = 1e-9  # of the angle's range; errors below it are those of the arithmetic


def judge(
    records: Sequence[Record],
    splits: Sequence[Split],
    samples: Samples,
    fine: Samples,
    form: Form,
    point: Point,
    *,
    intervals: bool,
    seeds: int,
    seeds_agreeing: int,
    **facts: Any,
) -> Fit:
    """Put together a :class:`Fit`.

    Parameters
    ----------
    records, splits
        What was fitted, and which part of it.
    samples, fine
        All samples, and those of the last polish.
    form, point
        Its end.
    intervals
        Whether the end is one of least squares, so that it has intervals.
    seeds, seeds_agreeing, facts
        Fields of the result that the search gives.
    """
    plain = search.plain(form, samples)
    spread = uncertainty(fine, form, point) if intervals else None
    by_blocks = bootstrap(fine, form, point, facts["seed"]) if intervals and point.sign else None
    predicted, without = form.angle(samples, point), form.angle(samples, plain)
    seen, held = (np.concatenate([getattr(split, part) for split in splits]) for part in ("train", "heldout"))
    train, heldout, baseline_train, baseline_heldout = (
        errors(samples.angle_deg[mask], angle[mask]) for angle in (predicted, without) for mask in (seen, held)
    )
    parameters, again = (_shown(parameters_of(fine, form, point, s), form, facts) for s in (spread, by_blocks))
    saturation = parameters.pop("saturation_deg")
    of_law = _law_warnings(fine, form, point, spread) if point.sign else [_NO_HYSTERESIS]
    warnings = [*of_law, *_error_warnings(fine, point, train, heldout, baseline_heldout)]
    if point.sign and 2 * seeds_agreeing < seeds:
        warnings.append(f"{seeds_agreeing} of {seeds} searches ended at the best: expected more than half")
    drives = np.concatenate([record.drive for record in records])
    return Fit(
        records=tuple(record.source or record.title or "record" for record in records),
        parameters=parameters,
        saturation_deg=saturation,
        train=train,
        heldout=heldout,
        baseline_train=baseline_train,
        baseline_heldout=baseline_heldout,
        heldout_of_records=tuple(_errors_of(samples, predicted, held, part) for part in samples.slices()),
        heldout_by="; ".join(dict.fromkeys(split.by for split in splits)),
        noise_floor_deg=math.sqrt(sum(noise_floor(record) ** 2 for record in records) / len(records)),
        bootstrap=again if intervals and point.sign else {},
        correlations=_correlations(form, spread) if spread is not None and point.sign else {},
        warnings=tuple(warnings),
        form=form,
        point=point,
        plain_point=plain,
        heldout_masks=tuple(split.heldout for split in splits),
        drive_range=(float(drives.min()), float(drives.max())),
        drive_unit=records[0].drive_unit,
        first_drive=float(records[0].drive[0]),
        seconds=0.0,
        seeds=seeds,
        seeds_agreeing=seeds_agreeing,
        **facts,
    )


def _shown(parameters: dict[str, Any], form: Form, facts: dict[str, Any]) -> dict[str, Any]:
    """Leave out the coefficients of a fitted f: they say nothing by themselves, f is given as a table."""
    hidden = form.backbones[0].names if facts["kinematics"] == "fitted" else ()
    return {name: value for name, value in parameters.items() if name not in hidden}


def _errors_of(samples: Samples, predicted: Floats, held: NDArray[np.bool_], part: slice) -> Errors | None:
    mask = held[part]
    angle = samples.angle_deg[part][mask]
    return errors(angle, predicted[part][mask]) if angle.size and np.ptp(angle) > 0 else None


def _correlations(form: Form, spread: Uncertainty) -> dict[str, float]:
    names = coordinates(form)
    return {f"{a} ~ {b}": spread.correlation(i, j) for (a, i), (b, j) in combinations(names, 2)}


def _law_warnings(fine: Samples, form: Form, point: Point, spread: Uncertainty | None) -> Iterator[str]:
    low, high = form.box(fine)
    for name, i in coordinates(form):
        value, a, b = point.q[i], low[i], high[i]
        end = a if value - a < 1e-3 * (b - a) else b if b - value < 1e-3 * (b - a) else None
        if end is not None:
            limit = end if name.startswith("gamma") else math.exp(end)
            yield f"{'|A|' + name[1:] if name.startswith('A') else name} is at the bound of the search, {limit:.3g}"
    for i, model in enumerate(point.models(form)):
        if model.A < _STANDSTILL:
            of = f" of element {i + 1}" if form.elements > 1 else ""
            yield f"A = {model.A:.3g}{of} is below -1: the predicted angle runs on after the drive has turned"
    yield from _spread_warnings(form, spread)
    yield from _saturation_warnings(fine, form, point)
    if point.sign > 0:
        yield "A > 0: h leads f, the loop runs the other way round than a lagging one"


def _spread_warnings(form: Form, spread: Uncertainty | None) -> Iterator[str]:
    """Say what the data cannot fix."""
    if spread is None:
        yield "eq. 8 is a mean in which errors cancel: it does not determine the parameters, and gives no intervals"
        return
    names = coordinates(form)
    unseen = [name for name, i in names if spread.blind[i]]
    if unseen:
        yield f"the record does not show {', '.join(unseen)}: no interval"
    elif spread.condition > _ILL_CONDITIONED:
        yield (
            f"parameters make good for each other (condition number {spread.condition:.1e}): "
            "judge by the errors, not by single parameters"
        )
    alike = [f"{a} and {b}" for (a, i), (b, j) in combinations(names, 2) if abs(spread.correlation(i, j)) > _CORRELATED]
    if alike:
        yield f"the record fixes only together: {'; '.join(alike)} (correlation above {_CORRELATED:g})"


def _saturation_warnings(fine: Samples, form: Form, point: Point) -> Iterator[str]:
    h = form.hysteresis(form.paths(fine, point), np.array([point.sign]), point.q[np.newaxis])[0]
    reached, limit = float(np.abs(h).max()), sum(model.saturation_deg for model in point.models(form))
    if max(form.groups) > 0:
        limit *= max(1.0, math.exp(max(point.q[form.amplitude(g)] for g in range(1, max(form.groups) + 1))))
    if reached < _SATURATED * limit:
        yield (
            f"h reaches {reached:.3g} deg of a saturation of {limit:.3g} deg: the record does not show the saturation"
        )


def _error_warnings(fine: Samples, point: Point, train: Errors, heldout: Errors, baseline: Errors) -> Iterator[str]:
    if heldout.rmse_deg > max(_SUSPECT * train.rmse_deg, _ROUNDING * fine.span_deg()):
        yield f"held-out rmse is {heldout.rmse_deg:.3g} deg, that of training {train.rmse_deg:.3g} deg"
    if point.sign and heldout.rmse_deg >= baseline.rmse_deg:
        yield "no better than a curve without hysteresis on what was held out"
