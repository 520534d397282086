"""A layer in a form that data can fix, and which parameters of the paper's form it leaves open.

A, beta, gamma and n can compensate for each other. The response cannot: the saturation, the slope of h after a
reversal, the reach (the path of f after a reversal until h has gone 90 % of its way), and whether rising and falling
differ.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from hysteresis.arrays import Floats
from hysteresis.fitting.form import Form, Point, rmse
from hysteresis.fitting.forward import is_forward
from hysteresis.fitting.samples import Samples
from hysteresis.fitting.search import COARSE, extended, polish
from hysteresis.fitting.uncertainty import Parameter, Reader, Uncertainty, uncertainty
from hysteresis.laws.elements import BOUC_WEN, LAWS, Element

_WAY = 0.9  # of the way of h after a reversal, which the reach covers
_FIXED = 3.0  # largest ratio of the ends of an interval of a parameter that counts as fixed
_WIDEST = 100.0  # ratio of the ends of an interval above which a slope counts as not determined
_SAME = 1e-3  # of log n or gamma / beta
_SHARES_OF_WAY = (1.0, 0.5, 0.25, 0.12, 0.06)  # to the end of an interval, that are tried
_SAMPLES = 500  # with which the other parameters are fitted again


@dataclass(frozen=True)
class Open:
    """Parameters of the paper's form that the data leave open, and how little the angle depends on them.

    ``change_deg``: the largest rms change of the angle when n or gamma / beta is moved in its interval as far as the
    others, fitted again, make up for it. ``words`` says so.
    """

    names: tuple[str, ...]
    change_deg: float
    words: str

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return asdict(self) | {"names": list(self.names)}


def response(samples: Samples, form: Form, point: Point, spread: Uncertainty | None) -> dict[str, Parameter]:
    """Describe the hysteresis by what the data can fix, with 95 % intervals by the delta method.

    ``saturation_deg``: largest |h| at the centre. ``slope_after_reversal``: mean dh/df from a reversal out of
    saturation until h is 0; 1 + slope is the angle's response to f there, 0 for a play. ``reach_deg``: path of f after
    such a reversal until h has gone 90 % of the way to the other side. ``n``: sharpness, of one Bouc-Wen element.
    ``asymmetry``: (limit of |h| with f rising - falling) / sum; of a Bouc-Wen layer, from the asymmetric law fitted
    from there. Intervals of positive values are those of their logarithm. A slope whose interval spans more than a
    factor of 100 has none: the way to h = 0 is finer than the steps of the record.

    Parameters
    ----------
    samples, form, point
        The end of the least squares, with hysteresis.
    spread
        Its uncertainty; None for no intervals.
    """
    reader, law = Reader.of(spread, samples, form, point), range(form.law.stop)

    def along(log_of: Callable[[Form, Point], float]) -> tuple[float, Floats]:
        def of_q(q: Floats) -> float:
            return log_of(form, replace(point, q=q))

        return of_q(point.q), reader.gradient(of_q, point.q, law)

    found = {}
    for name, log_of, unit in (
        ("saturation_deg", _log_half_width, "deg"),
        ("slope_after_reversal", _log_slope, "1"),
        ("reach_deg", lambda form, point: _log_way(form, point, _WAY), "deg"),
    ):
        value, gradient = along(log_of)
        found[name] = reader.positive(math.exp(value), gradient, unit)
    slope = found["slope_after_reversal"]
    if slope.low is not None and slope.high is not None and slope.high > _WIDEST * slope.low:
        slope = found["slope_after_reversal"] = replace(slope, low=None, high=None)
    if point.sign < 0:
        ends = [None if end is None else -end for end in (slope.high, slope.low)]
        found["slope_after_reversal"] = Parameter(-slope.value, ends[0], ends[1], "1")
    if form.base_law.name in ("bouc-wen", "asymmetric-bouc-wen") and form.elements == 1:
        found["n"] = _sharpness(samples, form, point, reader)
    asymmetry = _asymmetry(samples, form, point, spread)
    return found if asymmetry is None else found | {"asymmetry": asymmetry}


def after_reversal(form: Form, point: Point) -> dict[str, float]:
    """Give what describes one model behind a reversal: slope_after_reversal, and reach_deg in deg."""
    slope = point.sign * math.exp(_log_slope(form, point))
    return {"slope_after_reversal": slope, "reach_deg": math.exp(_log_way(form, point, _WAY))}


def _sharpness(samples: Samples, form: Form, point: Point, reader: Reader) -> Parameter:
    """Return n; an end of its interval at a bound of the search is open."""
    low, high = (bound[2] for bound in form.bounds(samples))
    n = reader.positive(math.exp(point.q[2]), reader.along(2), "1")
    if n.low is None or n.high is None:
        return n
    return replace(
        n,
        low=max(n.low, math.exp(low)),
        high=None if n.high >= math.exp(high) else n.high,
    )


def _symmetric(form: Form, point: Point) -> list[Element]:
    """Return the elements at the centre, without what differs between sides, directions or positions; saturated."""
    rows = form.values(point.q[np.newaxis], 0)[0]
    rows[:, 4:-1] = 0.0
    rows[:, -1] = point.sign  # after a long way in which f rose
    return [form.base_law.element(point.sign, row, form.place) for row in rows]


def _log_half_width(form: Form, point: Point) -> float:
    rows = form.values(point.q[np.newaxis], 0)[0]
    return math.log(sum(form.base_law.half_width_deg(point.sign, row) for row in rows))


def _log_saturation(form: Form, point: Point) -> float:
    return math.log(sum(float(np.exp(row[1])) for row in form.values(point.q[np.newaxis], 0)[0]))


def _log_slope(form: Form, point: Point) -> float:
    """Logarithm of the mean |dh/df| from a reversal out of saturation until h is 0."""
    return _log_saturation(form, point) - _log_way(form, point, 0.5)


def _log_way(form: Form, point: Point, share: float) -> float:
    """Logarithm of the path of f after a reversal until h has gone a share of the way to the other side."""
    elements = _symmetric(form, point)
    saturation = math.exp(_log_saturation(form, point))
    wanted = (1 - 2 * share) * saturation

    def missing(log_way: float) -> float:
        path = form.place.centre_deg - np.array([0.0, math.exp(log_way)])
        return point.sign * sum(float(element.along(path)[-1]) for element in elements) - wanted

    low = high = math.log(saturation)
    while missing(low) < 0:
        low -= 2.0
    while missing(high) > 0:
        high += 2.0
    return float(brentq(missing, low, high, xtol=1e-12))


def _asymmetry(samples: Samples, form: Form, point: Point, spread: Uncertainty | None) -> Parameter | None:
    """Return tanh of the law's constant of direction; a Bouc-Wen layer is first fitted with the asymmetric law.

    That has no forward derivatives: None for a form that asks for them.
    """
    if (
        form.elements > 1
        or spread is None
        or is_forward(form)
        or form.base_law.name not in ("bouc-wen", "asymmetric-bouc-wen")
    ):
        return None
    if form.base_law is BOUC_WEN:
        samples = samples.thinned(_SAMPLES * len(form.groups))
        form, point = extended(form, point, LAWS["asymmetric-bouc-wen"], (0.0, 0.0))
        point, _ = polish(samples, form, point, tolerance=COARSE)
        spread = uncertainty(samples, form, point)
    half = spread.half_width(np.eye(form.size + len(point.c))[4])
    low, high = math.tanh(point.q[4] - half), math.tanh(point.q[4] + half)
    return Parameter(math.tanh(point.q[4]), low, high, "1")


def open_parameters(
    samples: Samples, form: Form, point: Point, spread: Uncertainty | None, parameters: dict[str, Parameter]
) -> Open | None:
    """Find out which of A, beta, gamma and n the data leave open, and how much the angle depends on them.

    Parameters
    ----------
    samples, form, point, spread
        The end of the least squares.
    parameters
        A, beta, gamma and n with their intervals.

    Returns
    -------
    Open or None
        None if all four are fixed: no interval has ends of other signs or wider apart than a factor of 3. Also for a
        model that is not one Bouc-Wen element with intervals.
    """
    if spread is None or point.sign == 0 or form.base_law is not BOUC_WEN or form.elements > 1:
        return None
    low, high = form.bounds(samples)
    at_bound = {
        name
        for name, i in (("n", 2), ("gamma", 3))
        if min(point.q[i] - low[i], high[i] - point.q[i]) < 1e-3 * (high[i] - low[i])
    }
    names = tuple(name for name in ("A", "beta", "gamma", "n") if name in at_bound or not is_fixed(name, parameters))
    if not names:
        return None
    few = samples.thinned(_SAMPLES * len(form.groups))
    limit = math.sqrt(1 + spread.quantile**2 / max(1.0, spread.effective))
    moved = []
    for name, i in (("n", 2), ("gamma / beta", 3)):
        half = spread.half_width(np.eye(form.size + len(point.c))[i])
        ends = max(low[i], point.q[i] - half), min(high[i], point.q[i] + half)
        moved.append((name, [_move(few, form, point, (i, end), limit) for end in ends]))
    change = max(one.change_deg for _, two in moved for one in two)
    ranges = " or ".join(_range(name, two) for name, two in moved if two[1].value - two[0].value > _SAME)
    words = (
        f"the data do not fix {', '.join(names)} one by one, and the angle hardly depends on which: "
        f"with {ranges or 'n or gamma / beta elsewhere'} (95 %), the others fitted again, it changes by at most "
        f"{change:.2g} deg rms; read the saturation and the reach instead"
    )
    return Open(names, change, words)


class _Moved(NamedTuple):
    """Value of an entry of q that was moved, and by how much the angle then changes, rms."""

    value: float
    change_deg: float


def _range(name: str, ends: Sequence[_Moved]) -> str:
    values = [math.exp(one.value) if name == "n" else one.value for one in ends]
    return f"{name} from {values[0]:.3g} to {values[1]:.3g}"


def _move(samples: Samples, form: Form, point: Point, aim: tuple[int, float], limit: float) -> _Moved:
    """Move an entry of q towards the end of its interval, ``aim``, while the error rises by less than a factor.

    The interval is that of a linear model; the factor is that of its profile: m_eff log(rmse^2) rises by t^2.
    """
    i, end = aim
    best, before = rmse(samples, form, point), form.angle(samples, point)
    for share in _SHARES_OF_WAY:
        value = float(point.q[i] + share * (end - point.q[i]))
        other, _ = polish(samples, form, point, {i: value}, COARSE)
        if rmse(samples, form, other) <= limit * best:
            change = (form.angle(samples, other) - before)[samples.train]
            return _Moved(value, float(np.sqrt(np.mean(change**2))))
    return _Moved(float(point.q[i]), 0.0)


def is_fixed(name: str, parameters: Mapping[str, Parameter]) -> bool:
    """Tell whether samples fix a parameter: the ends of its interval are within a factor of 3 of each other.

    What may be 0 counts by the width of its interval: gamma beside beta, an initial state beside the saturation, a zero
    or an offset in any case.
    """
    low, high = parameters[name].low, parameters[name].high
    if low is None or high is None:
        return False
    if name == "gamma":
        return high - low < 2 * (1 - 1 / _FIXED) * parameters["beta"].value
    if name.startswith("h0_deg"):
        return high - low < parameters["saturation_deg"].value
    if name.startswith(("offset_", "zero_")):
        return True
    return low * high > 0 and max(high / low, low / high) < _FIXED
