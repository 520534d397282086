"""Interpolation between models fitted at two loads: f at each drive and the parameters of h are linear in the load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from hysteresis import Fit
from hysteresis.arrays import Floats
from hysteresis.fitting.form import Form, Point
from hysteresis.laws.backbone import Backbone
from validation.layer.comparators import Operator


def between_fits(low: Fit, high: Fit, share: float) -> Callable[..., Floats]:
    """Interpolate between two fits: ``predict(drive, time_s, record)`` of the model at ``share`` from low to high.

    The coordinates q hold A, the saturation and n as logarithms. Elements are paired by their saturation.

    Raises
    ------
    ValueError
        The fits differ in their number of elements or records, or one leads and the other lags.
    """
    if (
        low.form.elements != high.form.elements
        or low.form.groups != high.form.groups
        or low.point.sign != high.point.sign
    ):
        raise ValueError("fits to interpolate between: expected the same elements, records and sign of A")
    a, b = _sorted_q(low.form, low.point), _sorted_q(high.form, high.point)
    curves = tuple(
        _between(one, low.point.c, other, high.point.c, share)
        for one, other in zip(low.form.backbones, high.form.backbones, strict=True)
    )
    point = Point(low.point.sign, (1 - share) * a + share * b, np.zeros(0))
    return replace(low, form=replace(low.form, backbones=curves), point=point).predict


def within_fit(fit: Fit, share: float) -> Callable[..., Floats]:
    """Interpolate within one fit of two loads: ``predict(drive, time_s, record)`` at ``share`` from one to the other.

    The first half of the records has the first load, the second half the other, in the same order. f is shared, the
    logarithm of the amplitude of h is linear in the load, and so are the zeros and initial states of the records.

    Raises
    ------
    ValueError
        The records are not two groups of one size.
    """
    form, half = fit.form, len(fit.form.groups) // 2
    if form.groups != (0,) * half + (1,) * half:
        raise ValueError(f"groups {form.groups}: expected two of one size, one after the other")
    q = fit.point.q.copy()
    q[form.amplitude(1)] *= share
    zeros = np.concatenate([[0.0], fit.point.q[form.zeros]])
    for i in range(half):
        low, high = form.state(i), form.state(half + i)
        q[high] = (1 - share) * fit.point.q[low] + share * fit.point.q[high]
        q[form.zeros.start + half + i - 1] = (1 - share) * zeros[i] + share * zeros[half + i]
    middle = replace(fit, point=replace(fit.point, q=q))

    def predict(drive: ArrayLike, time_s: ArrayLike | None = None, record: int = 0) -> Floats:
        return middle.predict(drive, time_s, half + record)

    return predict


def within_operator(operator: Operator, share: float) -> Operator:
    """Interpolate within one operator of two loads, the records of one load first: the zeros are linear."""
    half = operator.zeros_deg.size // 2
    zeros = (1 - share) * operator.zeros_deg[:half] + share * operator.zeros_deg[half:]
    return replace(operator, zeros_deg=zeros)


def between_operators(low: Operator, high: Operator, share: float) -> Operator:
    """Interpolate between two operators: radii, weights, zeros, initial state and f are linear."""
    fields = ("radii", "weights", "zeros_deg", "start", "delay_s")
    values = {name: (1 - share) * getattr(low, name) + share * getattr(high, name) for name in fields}
    curve = _between(low.backbone, low.c, high.backbone, high.c, share)
    return replace(low, backbone=curve, c=np.zeros(0), **values)


def _sorted_q(form: Form, point: Point) -> Floats:
    order = np.argsort(point.q[form.law].reshape(form.elements, 4)[:, 1])
    q = point.q.copy()
    q[form.law] = q[form.law].reshape(form.elements, 4)[order].ravel()
    for record in range(len(form.groups)):
        q[form.state(record)] = q[form.state(record)][order]
    return q


def _between(one: Backbone, c_one: Floats, other: Backbone, c_other: Floats, share: float) -> Backbone:
    def at(drive: ArrayLike) -> Callable[[Floats], Floats]:
        x = np.asarray(drive, dtype=float)
        values = (1 - share) * one.at(x)(c_one) + share * other.at(x)(c_other)
        return lambda _: values

    return replace(one, at=at)
