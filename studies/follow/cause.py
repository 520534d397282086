"""The effect that explains a change of a device: from its numbers where one of them is the effect, else by a trace."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis import Fit
from hysteresis.arrays import Floats
from hysteresis.drift.states import GAIN, LAG, PLAY, TENSION, WIDTH, ZERO, Followed, left_by
from hysteresis.records.record import Record, RecordError
from studies.follow.result import NamedCause
from validation.tracing import catalogue, trace_records
from validation.tracing.effect import CurveContext, CurveForm, Effect, RelativeParameter, Sensible, Values
from validation.tracing.fitting import Fitted
from validation.tracing.outcome import Trace
from validation.tracing.result import fitted_parameters

TRACED = 3
"""Records before a change, and last records, that are traced: more take longer and hardly say more."""
SENSOR_ZERO = "zero"
"""Name of a change of the angle's zero alone: the mounting of sensor or drive. It is no effect of the catalogue."""
PRELOAD = "preload_loss"
STANDS_FOR: dict[str, Followed] = {
    "guide_friction": WIDTH,
    "backlash": PLAY,
    "viscous_drag": LAG,
    "time_delay": LAG,
    "drive_gain": GAIN,
}
"""The number of the law that does what an effect does: of effects that a trace does not distinguish, it tells more."""
_SAME = 1.02  # of the error: numbers that leave as much are not distinguished
_LEAST_LEFT = 0.3  # of the loop: less is no friction that changed

ProgressWords = Callable[[str, int, int], None]


def _grown(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Let the loop grow everywhere, as friction in the guides does that does not depend on the bend."""
    return np.full(f.shape, 1.0 + values["growth"])


_GROWN = CurveForm(
    (
        RelativeParameter(
            "growth",
            "-",
            _LEAST_LEFT - 1.0,
            5.0,
            0.02,
            amount=True,
            sensible=Sensible(_LEAST_LEFT - 1.0, 5.0, "wear and dry guides multiply friction by a few"),
        ),
    ),
    ({"growth": 0.2},),
    loop_size=_grown,
    needs=frozenset({"reference"}),
)


def effects_of_drift() -> list[Effect]:
    """Give the catalogue, with friction that grows everywhere: a reference distinguishes it from the bend's."""
    forms = {"guide_friction": _GROWN}
    return [
        replace(one, curve_forms=(*one.curve_forms, forms[one.name])) if one.name in forms else one
        for one in catalogue()
    ]


@dataclass(frozen=True)
class Shift:
    """How clearly a number has changed: its change over its standard deviation, and whether that is beyond chance."""

    name: str
    ratio: float
    clear: bool


def cause_of(
    fit: Fit,
    shifts: Sequence[Shift],
    before: Sequence[Record],
    after: Sequence[Record],
    *,
    threads: int = 2,
    progress: ProgressWords | None = None,
) -> NamedCause:
    """Name the cause of a change.

    Parameters
    ----------
    fit
        Of the first record.
    shifts
        Of all numbers that are followed.
    before, after
        Records of the device as it was, and as it is; the last :data:`TRACED` of each are traced.
    """
    largest = max(shifts, key=lambda one: abs(one.ratio))
    clear = {one.name for one in shifts if one.clear}
    if largest.name == ZERO.name and clear <= {ZERO.name}:
        words = "the zero of the angle has moved and nothing else: look at the mounting of sensor and drive"
        return NamedCause((SENSOR_ZERO,), (), "parameters", "effect", words)
    if largest.name == TENSION.name:
        fallen = largest.ratio < 0
        words = "the mean tension has " + ("fallen: the tendons have lost preload" if fallen else "risen")
        return NamedCause((PRELOAD,) if fallen else (), (), "parameters", "effect" if fallen else "unexplained", words)
    old, new = _spread(before), list(after[-TRACED:])
    try:
        trace = trace_records(new, reference=old, threads=threads, effects=effects_of_drift(), progress=progress)
    except (RecordError, RigError, SolverError) as error:
        return NamedCause((), (), "not traced", "unexplained", f"not traced: {error}")
    return _of_trace(trace, fit, new)


def _spread(records: Sequence[Record]) -> list[Record]:
    """Give up to :data:`TRACED` records, evenly over those there are."""
    at = np.unique(np.linspace(0, len(records) - 1, TRACED).round().astype(int))
    return [records[k] for k in at]


def _of_trace(trace: Trace, fit: Fit, new: Sequence[Record]) -> NamedCause:
    """Name what a trace names; of single effects that it does not distinguish, what the law tells of them."""
    if not trace.names:
        nearest = f": nearest is {' + '.join(trace.candidates[0].names)}" if trace.candidates else ""
        return NamedCause((), (), "trace", trace.verdict, f"no effect of the catalogue explains it{nearest}")
    fitted, names, others = _likeliest(trace, fit, new)
    before, after = trace.baseline.heldout_rmse_deg, trace.augmented.heldout_rmse_deg
    words = f"{' + '.join(names)}: the error of the last records falls from {before:.2g} to {after:.2g} deg with it"
    if others:
        words += f"; {', '.join(others)} cannot be distinguished from it by the trace"
    parameters = dict(fitted_parameters(fitted)[-1]) if len(names) == 1 else {}
    return NamedCause(names, others, "trace", trace.verdict, words, parameters)


def _likeliest(trace: Trace, fit: Fit, new: Sequence[Record]) -> tuple[Fitted, tuple[str, ...], tuple[str, ...]]:
    """Give the model that is named, its effects with the likeliest first, and those that are not distinguished.

    Among effects that have a number of the law (:data:`STANDS_FOR`) the one whose number has the smallest residual in
    the last records is first; equal ones stay in the order of the trace. Of single effects without such a number the
    one with the fewest parameters is first.
    """
    named, first = trace.augmented, tuple(trace.names)
    alike = tuple(name for name in dict.fromkeys(n for group in trace.confusable for n in group) if name not in first)
    rivals = {one.names[-1]: one.fitted for one in reversed(trace.candidates) if one.names[-1] in alike}
    every = [*first, *rivals] if len(first) == 1 else [*first]
    told = [name for name in every if name in STANDS_FOR]
    if told:
        left = {name: left_by(fit, new, STANDS_FOR[name]) for name in told}
        chosen = next(name for name in told if left[name] <= _SAME * min(left.values()))
    elif len(first) == 1 and rivals:
        models = {first[0]: named} | rivals
        chosen = min(models, key=lambda name: len(models[name].model.added[-1].form.parameters))
    else:
        return named, first, alike
    if len(first) > 1:  # effects that are named together
        return named, (chosen, *(name for name in first if name != chosen)), alike
    others = tuple(name for name in (first[0], *alike) if name != chosen)
    return rivals.get(chosen, named), (chosen,), others
