"""Force laws of nonlinear connectors, which Exudyn calls; it prescribes their parameters, whatever we name them.

They are symbolic: Exudyn records each law once, and then works it out without Python.
"""

from __future__ import annotations

from typing import Any

import exudyn as exu
from exudyn.utilities import CreateSymbolicUserFunction

OPEN_STIFFNESS = 1e-9  # of EA/pitch: it determines the slip of a slack tendon, which nothing else does


def stick_slip(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, open_stiffness: Any, rest: Any, vo: Any, fd: Any,
               limit: Any, ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    """Spring k from a rest point, up to a limit: guides and Jenkins elements."""
    return exu.symbolic.min(exu.symbolic.max(k * (u - rest), -limit), limit) + open_stiffness * u


def linear(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, rest: Any, vo: Any, fd: Any, limit: Any,
           ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    """Spring k from a rest point: without a law Exudyn's own tangent leaves out the factors of both coordinates."""
    return k * (u - rest)


def toe(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, preload: Any, vo: Any, fd: Any, limit: Any,
        ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    """Exponential spring of a tendon's toe region."""
    return preload * exu.symbolic.exp(k * u)


def tension_only(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, rest: Any, vo: Any, fd: Any, limit: Any,
                 ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    """Spring of a tendon without a toe region, which does not push."""
    return exu.symbolic.max(k * (u - rest), OPEN_STIFFNESS * k * (u - rest))


def flag(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, climb: Any, rest: Any, residual: Any, lower: Any,
         upper: Any, ve: Any, span: Any, rv: Any) -> Any:  # fmt: skip
    """Elastic line from the rest angle, between the loading and the unloading branch of the flag, on either side.

    ``lower`` and ``upper`` are where the lines of the plateaus would start at no angle; they rise by ``climb``.
    """
    low, high = exu.symbolic.min, exu.symbolic.max
    x = u - residual
    positive, negative = high(x, 0.0), high(-x, 0.0)
    line = k * (x - rest)

    def bounded(line: Any, x: Any) -> Any:
        full = k * (x - span)
        return low(high(line, high(low(k * x, climb * x + lower), full)), high(low(k * x, climb * x + upper), full))

    return high(bounded(line, positive), 0.0) - high(bounded(-line, negative), 0.0)


def hardening(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, angle: Any, rest: Any, slope: Any, fd: Any, fs: Any,
              ve: Any, limit: Any, rv: Any) -> Any:  # fmt: skip
    """Moment of a flexure beyond a linear one; :func:`fem_models.joint.hardening.beyond_linear_rad`.

    ``slope`` and ``limit`` may be negative: they stand where Exudyn takes any number.
    """
    w = (u - rest) / angle
    over = exu.symbolic.abs(w)
    beyond = 0.5 * slope * exu.symbolic.log(1.0 + w * w) + limit * (over - exu.symbolic.atan(over))
    return k * angle * exu.symbolic.sign(w) * beyond


def fibre(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, climb: Any, rest: Any, residual: Any, lower: Any,
          upper: Any, ve: Any, span: Any, rv: Any) -> Any:  # fmt: skip
    """Follow the law of :func:`flag` with fewer operations, one side at a time."""
    x = u - residual
    return _on_its_side(x, k * (x - rest), (k, climb, span), (lower, upper))


def fibre_of_two_sides(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, climb: Any, rest: Any, residual: Any,
                       lower: Any, upper: Any, upper_pressed: Any, span: Any, lower_pressed: Any) -> Any:  # fmt: skip
    """:func:`fibre` with other plateaus in compression."""
    x = u - residual
    pulled = 0.5 * (1.0 + exu.symbolic.sign(x))
    start, back = pulled * upper + (1.0 - pulled) * upper_pressed, pulled * lower + (1.0 - pulled) * lower_pressed
    return _on_its_side(x, k * (x - rest), (k, climb, span), (back, start))


def _on_its_side(x: Any, line: Any, law: tuple[Any, Any, Any], plateaus: tuple[Any, Any]) -> Any:
    """Stress of a fibre: the elastic line from its rest, between its two plateaus."""
    low, high = exu.symbolic.min, exu.symbolic.max
    (k, climb, span), (lower, upper) = law, plateaus
    side, size = exu.symbolic.sign(x), exu.symbolic.abs(x)
    elastic, rise = k * size, climb * size
    full = elastic - k * span
    return side * low(high(side * line, high(low(elastic, rise + lower), full)), high(low(elastic, rise + upper), full))


def closed_in_both_directions(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, angle: Any, vo: Any, fd: Any,
                              fs: Any, ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    """Contact of the edges of a pair of notches."""
    return k * (exu.symbolic.max(u - angle, 0.0) - exu.symbolic.max(-u - angle, 0.0))


def closed_in_one_direction(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, angle: Any, vo: Any, fd: Any,
                            fs: Any, ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    """Contact of the edges of a one-sided notch."""
    return k * exu.symbolic.max(u - angle, 0.0)


def stop_above(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, offset: Any) -> Any:
    """Stop that the tip meets moving towards tendon a."""
    # the offset is already subtracted from u (as of Exudyn 1.13.6; its documentation says otherwise)
    return [0.0 * u[0], k[1] * exu.symbolic.max(u[1], 0.0), 0.0 * u[2]]


def stop_below(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, offset: Any) -> Any:
    """Stop that the tip meets moving away from tendon a."""
    return [0.0 * u[0], -k[1] * exu.symbolic.max(-u[1], 0.0), 0.0 * u[2]]


def add_with_law(mbs: Any, connector: Any, law: Any) -> int:
    """Add a connector whose force follows a law; return its number."""
    number = mbs.AddObject(connector)
    symbolic = CreateSymbolicUserFunction(mbs, law, "springForceUserFunction", number)
    mbs.SetObjectParameter(number, "springForceUserFunction", symbolic)
    return int(number)
