"""Whether the parameters of a named effect make sense: within their ranges, and different from no action.

A model outside is shown, not named. The ranges, with their reasons, stand in the files of the effects
(:class:`validation.tracing.effect.Sensible`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from scipy.stats import f as fisher
from scipy.stats import t as student

from hysteresis.arrays import Floats
from validation.tracing.baseline.equivalent_rig import EquivalentRigProblem
from validation.tracing.baseline.in_space import SpaceProblem
from validation.tracing.baseline.known_rig import KnownRigProblem
from validation.tracing.baseline.rig_problem import RigProblem
from validation.tracing.effect import FreeParameter, Quantity, Sensible
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.uncertainty import Covariance, covariance, rise_without
from validation.tracing.problem import Problem

LEVEL = 0.95
"""Level of the intervals."""
NEAR_BOUND = 1e-3
"""Distance from a bound, in changes that matter, at which a parameter counts as at it."""
_OF_A_KNOWN_RIG = frozenset({"N", "g", "N s/mm", "Nmm s/rad", "N/mm"})
"""Units in which an equivalent rig has no scale: its forces are all in proportion to a preload that is assumed."""

_TENSIONS = frozenset({"toe_N", "takes_up_N", "guide_N"})
"""Parameters to which a stated preload gives a scale, whatever the lengths of the rig are."""


class EstimatedParameter(NamedTuple):
    """A parameter of an added effect: its value, the interval of its coordinate, and its place among all parameters."""

    effect: str
    parameter: FreeParameter
    value: float
    low: float
    high: float
    place: int


def implausible(fitted: Fitted) -> list[str]:
    """Reasons not to name the effects of a model, one sentence's end each; none where all make sense.

    A parameter counts as outside its range where its whole interval is outside. An effect without action is one of
    which no amount differs from 0, all tested together, given its other parameters. What is there under the alternative
    alone must not widen the interval of an amount (Davies 1987, doi 10.1093/biomet/74.1.33): the width of a play and
    the tension that takes it up are known by their ratio. Beside an equivalent
    rig or a curve this is not tested: their parameters are nearly collinear with an effect, and the linear interval
    contains 0 where the fit without the effect is far worse.
    """
    known = covariance(fitted)
    sizes = _sizes(fitted)
    estimates = list(_estimates(fitted, known.matrix, known.freedom))
    out = [words for one in estimates if (words := _outside(fitted, one, sizes))]
    for name in fitted.names if isinstance(fitted.model.problem, KnownRigProblem | SpaceProblem) else ():
        own = [one for one in estimates if one.effect == name]
        amounts = [one.place for one in own if one.parameter.acts_from_zero]
        shape = [one.place for one in own if not one.parameter.acts_from_zero]
        if amounts and _is_no_action(rise_without(fitted, amounts, shape), len(amounts), known):
            out.append(f"the 95 % interval of {name} contains zero")
    return out


def has_no_scale(problem: Problem, parameter: FreeParameter) -> bool:
    """Whether a parameter is in proportion to what an equivalent rig assumes: the preload, or the lengths."""
    if not isinstance(problem, EquivalentRigProblem):
        return False
    stated = problem.preload_stated and parameter.name in _TENSIONS
    return not stated and _is_of_a_known_rig(parameter)


def _is_of_a_known_rig(parameter: FreeParameter) -> bool:
    """Whether a unit is one of a force, a mass or a damper; that of a damper may be by the drive's own unit."""
    return parameter.unit in _OF_A_KNOWN_RIG or parameter.unit.startswith("N s/")


def remarks(fitted: Fitted) -> list[str]:
    """Words on parameters of a named model that a reader should look at: at a bound of the fit, or against the rig."""
    out = []
    for one in _estimates(fitted, np.zeros((fitted.x.size, fitted.x.size)), 1.0):
        p, x = one.parameter, one.parameter.to_unit(one.value)
        bound = next(
            (b for b in (p.low, p.high) if _finite_in_units(p, b) and abs(p.to_unit(b) - x) < NEAR_BOUND), None
        )
        if bound is not None:
            out.append(f"{_called(one)} is at its bound of {_shown(p, bound)}: its size is not determined")
    problem = fitted.model.problem
    out += _remarks_on_baseline(fitted)
    for added in fitted.model.added:
        units = dict.fromkeys(p.unit for p in added.form.parameters if has_no_scale(problem, p))
        if units:
            out.append(
                f"the size of {added.effect.name} in {' and '.join(units)} is in proportion to the preload and lengths "
                "of the equivalent rig, which are assumed where the records do not state them"
            )
    for added, values in zip(fitted.model.added, fitted.model.values(fitted.x)[1], strict=True):
        if isinstance(problem, KnownRigProblem) and "radius_mm" in values:
            declared = problem.runs[0][0].rig.wheel.radius_mm
            if not 0.5 < values["radius_mm"] / declared < 2.0:
                told = f"a wheel radius of {values['radius_mm']:.3g} mm, {declared:.3g} mm is declared"
                out.append(f"{added.effect.name} needs {told}: look for another wheel in the drive")
    return out


def _remarks_on_baseline(fitted: Fitted) -> list[str]:
    """Words on what a known rig's own parameters end at, and on a delay that is none."""
    out, model = [], fitted.model
    if isinstance(model.problem, KnownRigProblem):
        for p, x in zip(model.problem.parameters, fitted.x.tolist(), strict=False):
            ends = [bound for bound in (p.low, p.high) if _finite_in_units(p, bound)]
            if any(abs(p.to_unit(bound) - x) < NEAR_BOUND for bound in ends):
                out.append(f"{p.name} of the rig is at its bound of {_shown(p, p.from_unit(x))}")
    late = [values["delay_s"] for values in model.values(fitted.x)[1] if "delay_s" in values]
    if late and late[0] < 0.0:
        out.append("the delay is negative: the drive follows the angle in these records, as of clocks that differ")
    return out


def zero_words(fitted: Fitted) -> tuple[str, ...]:
    """Words on effects of which every amount has an interval that holds zero, as beside parameters alike."""
    known, amounts = covariance(fitted), dict[str, list[EstimatedParameter]]()
    for one in _estimates(fitted, known.matrix, known.freedom):
        if one.parameter.acts_from_zero:
            amounts.setdefault(one.effect, []).append(one)
    return tuple(
        f"the interval of {name} holds zero: that it acts is known by the fit without it, its size is not"
        for name, own in amounts.items()
        if all(one.low <= 0.0 <= one.high for one in own)
    )


def _estimates(fitted: Fitted, matrix: Floats, freedom: float) -> Iterator[EstimatedParameter]:
    """Parameters of the added effects with their intervals."""
    half = float(student.ppf(0.5 * (1 + LEVEL), freedom)) * np.sqrt(np.diag(matrix))
    place = fitted.model.baseline_size
    for added in fitted.model.added:
        for parameter in added.form.parameters:
            x, h = float(fitted.x[place]), float(half[place])
            most = 700.0 / parameter.scale if parameter.log else math.inf  # of the exponential
            low, high = (parameter.from_unit(min(max(end, -most), most)) for end in (x - h, x + h))
            yield EstimatedParameter(added.effect.name, parameter, parameter.from_unit(x), low, high, place)
            place += 1


def _outside(fitted: Fitted, one: EstimatedParameter, sizes: Mapping[str, float]) -> str:
    """Words for a parameter whose interval lies outside its range of sense; empty where it does not."""
    parameter, sensible = one.parameter, one.parameter.sensible
    if sensible is None:
        return ""
    absolute = sensible.per == "1" and _is_of_a_known_rig(parameter)
    if absolute and not isinstance(fitted.model.problem, KnownRigProblem | SpaceProblem):
        return ""
    size = _size(fitted, one, sensible.per, sizes)
    low, high = sorted((sensible.low * size, sensible.high * size))
    if not math.isfinite(size) or (one.high >= low and one.low <= high):
        return ""
    return (
        f"only with a {_called(one)} of {_shown(parameter, one.value)} "
        f"(sensible: {_number(sensible, low)} to {_number(sensible, high)}; {sensible.because})"
    )


def _is_no_action(rise_deg2: float, amounts: int, known: Covariance) -> bool:
    """Test amounts against 0, all together, by how much the squares rise without them."""
    return rise_deg2 / known.variance / amounts < float(fisher.ppf(LEVEL, amounts, known.freedom))


def _sizes(fitted: Fitted) -> dict[str, float]:
    """Quantities of the records that ranges are counted in; see :data:`validation.tracing.effect.Quantity`."""
    records = fitted.model.problem.records
    half_range = 0.5 * max(float(np.ptp(one.angle_deg)) for one in records)
    half_stroke = 0.5 * max(float(np.ptp(one.inputs.drive)) for one in records)
    duration = min(float(one.inputs.time_s[-1] - one.inputs.time_s[0]) for one in records)
    quarters = [
        0.5 * float(np.median([one.inputs.time_s[b.stop - 1] - one.inputs.time_s[b.start] for b in one.branches]))
        for one in records
        if len(one.branches) > 1
    ]
    return {
        "1": 1.0,
        "half range": half_range,
        "1/half range": 1.0 / half_range,
        "half range/duration": half_range / duration,
        "half stroke": half_stroke,
        "1/half stroke": 1.0 / half_stroke,
        "quarter cycle": max(quarters, default=math.inf),
    }


def _size(fitted: Fitted, one: EstimatedParameter, per: Quantity, sizes: Mapping[str, float]) -> float:
    """Size of a quantity in the parameter's own unit."""
    problem = fitted.model.problem
    if per == "wheel radius":
        return _wheel_radius(fitted, one)
    if per == "half range per joint":
        return sizes["half range"] / (problem.runs[0][0].rig.joints if isinstance(problem, RigProblem) else 1)
    if "stroke" in per and isinstance(problem, KnownRigProblem) and "mm" in one.parameter.unit:
        return problem.scale.drive if per == "half stroke" else 1.0 / problem.scale.drive
    return sizes[per]


def _wheel_radius(fitted: Fitted, one: EstimatedParameter) -> float:
    """Radius of the wheel in the unit of the run-out: the fitted one, or that of the rig."""
    problem = fitted.model.problem
    for added, values in zip(fitted.model.added, fitted.model.values(fitted.x)[1], strict=True):
        if added.effect.name == one.effect:
            fitted_radius = [value for name, value in values.items() if name.startswith("radius")]
            if fitted_radius:
                return float(fitted_radius[0])
    return float(problem.runs[0][0].rig.wheel.radius_mm) if isinstance(problem, KnownRigProblem) else math.inf


def _finite_in_units(parameter: FreeParameter, bound: float) -> bool:
    """Whether a bound limits an amount: that nothing is missing is no bound to speak of."""
    return bound > 0.0 or (bound < 0.0 and not parameter.log)


def _called(one: EstimatedParameter) -> str:
    sensible = one.parameter.sensible
    return sensible.name if sensible and sensible.name else f"{one.effect} {one.parameter.name}"


def _shown(parameter: FreeParameter, value: float) -> str:
    unit = "" if parameter.unit == "-" else f" {parameter.unit}"
    about = parameter.sensible.about if parameter.sensible else 0.0
    return f"{about + value:.3g}{unit}"


def _number(sensible: Sensible, value: float) -> str:
    return f"{sensible.about + value:.3g}"
