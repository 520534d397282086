"""Assessment of a fit: errors of training and held-out samples, intervals, and warnings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from hysteresis.arrays import Floats, Mask
from hysteresis.fitting.fit import Fit, KinematicsLabel
from hysteresis.fitting.form import Form, Point, without_hysteresis
from hysteresis.fitting.forward import is_forward
from hysteresis.fitting.response import open_parameters, response
from hysteresis.fitting.samples import Samples, join
from hysteresis.fitting.search import POLISH_SAMPLES, Found
from hysteresis.fitting.serial import serial_uncertainty
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.fitting.uncertainty import Parameter, Uncertainty, bootstrap, coordinates, parameters_of, uncertainty
from hysteresis.laws.elements import BOUC_WEN
from hysteresis.records.holdout import Split
from hysteresis.records.metrics import Errors, errors, noise_floor
from hysteresis.records.record import Record

_NO_HYSTERESIS = "no hysteresis above the noise in this record"
_NOT_FOLLOWED, _FOLLOWED = 2.0, 1e-3
"""Rms of the residual over the noise, and over the range of the angle: a larger one is no sign of "no hysteresis"."""
_UNLIKE = 0.1  # of the range of the angle: f, which is given, is not that of the record
_OVERSHOOT = -1.5  # of A; -1 is a play operator; clean records reach -1.3, angles that are late by two samples -1.6
_SATURATED = 0.95  # of the saturation
_SUSPECT = 2.0  # held-out error in training errors
_ROUNDING = 1e-9  # of the angle's range; smaller errors are rounding


def judge(
    records: Sequence[Record],
    splits: Sequence[Split],
    found: Found,
    settings: IdentifySettings,
    kinematics: KinematicsLabel,
) -> Fit:
    """Assess the model that a search found, and return it as a :class:`hysteresis.fitting.fit.Fit`.

    Parameters
    ----------
    records, splits
        What was fitted, and its training and held-out samples.
    found, settings, kinematics
        The model, how it was searched (only a least-squares fit has intervals), and the origin of f.
    """
    form, point = found.form, found.point
    samples = join(records, [split.train for split in splits], timed=settings.delay)
    fine = samples.thinned(POLISH_SAMPLES)
    baseline = without_hysteresis(form, samples)
    spread, by_blocks = _spreads(fine, form, point, settings)
    predicted, without = form.angle(samples, point), form.angle(samples, baseline)
    masks = samples.train, np.concatenate([split.heldout for split in splits])
    train, heldout, baseline_train, baseline_heldout = (
        errors(samples.angle_deg[mask], angle[mask]) for angle in (predicted, without) for mask in masks
    )
    hidden = form.backbones[0].names if kinematics == "fitted" else ()  # f is tabulated
    parameters, of_blocks = (_without(parameters_of(fine, form, point, s), hidden) for s in (spread, by_blocks))
    saturation = parameters.pop("saturation_deg")
    floor = float(np.sqrt(np.mean([noise_floor(record) ** 2 for record in records])))
    of_law = _law_warnings(fine, form, point, spread) if point.sign else [_no_hysteresis(train, floor, fine.span_deg())]
    of_errors = [*_error_warnings(fine, point, train, heldout, baseline_heldout)]
    of_errors += _kinematics_warnings(samples, form, baseline, train) if kinematics != "fitted" else []
    return Fit(
        observed=tuple(records),
        kinematics=kinematics,
        settings=settings,
        parameters=parameters,
        saturation_deg=saturation,
        train=train,
        heldout=heldout,
        baseline_train=baseline_train,
        baseline_heldout=baseline_heldout,
        heldout_of_records=tuple(_errors_of(samples, predicted, masks[1], part) for part in samples.slices()),
        heldout_by="; ".join(dict.fromkeys(split.by for split in splits)),
        noise_floor_deg=floor,
        bootstrap=of_blocks if by_blocks is not None else {},
        correlations=_correlations(form, spread) if spread is not None and point.sign else {},
        warnings=(*of_law, *of_errors, *_search_warnings(point, settings.seeds, found.seeds_agreeing)),
        layer=response(fine, form, point, spread) if point.sign else {},
        not_fixed=open_parameters(fine, form, point, spread, parameters),
        form=form,
        point=point,
        baseline_point=baseline,
        heldout_masks=tuple(split.heldout for split in splits),
        evaluations=found.evaluations,
        seeds_agreeing=found.seeds_agreeing,
        seconds=0.0,
    )


def _spreads(
    fine: Samples, form: Form, point: Point, settings: IdentifySettings
) -> tuple[Uncertainty | None, Uncertainty | None]:
    """Give the uncertainty of a fit by least squares, and that by blocks."""
    if settings.fitness != "rmse":
        return None, None
    if is_forward(form):
        return serial_uncertainty(fine, form, point), None
    by_blocks = bootstrap(fine, form, point, settings.seed) if point.sign else None
    return uncertainty(fine, form, point), by_blocks


def _no_hysteresis(train: Errors, floor_deg: float, span_deg: float) -> str:
    """Say that the law finds no loop, and whether that is a finding."""
    if train.rmse_deg <= max(_NOT_FOLLOWED * floor_deg, _FOLLOWED * span_deg):
        return _NO_HYSTERESIS
    return (
        f"no loop that the law can follow: the curve alone leaves {train.rmse_deg:.3g} deg rms at a noise of "
        f"{floor_deg:.2g} deg: expected the unit, the sense and the order of the samples"
    )


def _kinematics_warnings(samples: Samples, form: Form, baseline: Point, train: Errors) -> Iterator[str]:
    """Warn of kinematics that are not those of the record: of another scale or sense, or angles in rad."""
    span, angle = samples.span_deg(), samples.angle_deg[samples.train]
    if train.rmse_deg > _UNLIKE * span:
        yield (
            f"the kinematics leave {train.rmse_deg:.3g} deg rms of an angle that covers {span:.3g} deg: expected "
            "degrees and mm, and the rig of the record"
        )
    if float(np.corrcoef(form.angle(samples, baseline)[samples.train], angle)[0, 1]) < 0:
        yield "the angle falls where that of the kinematics rises: expected the same sense of drive and angle"


def _without(parameters: dict[str, Parameter], hidden: Sequence[str]) -> dict[str, Parameter]:
    return {name: parameter for name, parameter in parameters.items() if name not in hidden}


def _search_warnings(point: Point, seeds: int, agreeing: int) -> Iterator[str]:
    if point.sign and 2 * agreeing < seeds:
        yield f"{agreeing} of {seeds} searches ended at the best: expected more than half"


def _errors_of(samples: Samples, predicted: Floats, heldout: Mask, part: slice) -> Errors | None:
    mask = heldout[part]
    angle = samples.angle_deg[part][mask]
    return errors(angle, predicted[part][mask]) if angle.size and np.ptp(angle) > 0 else None


def _correlations(form: Form, spread: Uncertainty) -> dict[str, float]:
    names = coordinates(form)
    return {f"{a} ~ {b}": spread.correlation(i, j) for (a, i), (b, j) in combinations(names, 2)}


def _law_warnings(fine: Samples, form: Form, point: Point, spread: Uncertainty | None) -> Iterator[str]:
    if spread is None:
        yield "eq. 8 is a mean in which errors cancel: it does not determine the parameters, and gives no intervals"
    if form.base_law is BOUC_WEN:
        yield from _overshoot_warnings(form, point)
    yield from _saturation_warnings(fine, form, point)
    if point.sign > 0:
        yield "A > 0: h leads f, so the loop runs in the direction opposite to a lagging one"


def _overshoot_warnings(form: Form, point: Point) -> Iterator[str]:
    for i, model in enumerate(point.models(form)):
        if model.A < _OVERSHOOT:
            of = f" of element {i + 1}" if form.elements > 1 else ""
            yield (
                f"A = {model.A:.3g}{of} is below {_OVERSHOOT}: the predicted angle overshoots after the drive "
                "reverses, as where the angle is late against the drive"
            )


def _saturation_warnings(fine: Samples, form: Form, point: Point) -> Iterator[str]:
    h = form.hysteresis(form.paths(fine, point), np.array([point.sign]), point.q[np.newaxis])[0]
    reached, limit = float(np.abs(h).max()), sum(one.saturation_deg for one in point.elements(form))
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
        yield "no better than a curve without hysteresis on the held-out samples"
