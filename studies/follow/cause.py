"""The effect that explains a change of a device: from the numbers of its laws where one does, else by a trace.

Two laws describe the device as it was: of the angle, and of the difference of both tensions where they were measured.
An effect changes one number of each, so it predicts both: play shortens both paths, friction widens the loop of the
angle and raises the tension of a tendon that is pulled, a camera that was turned changes no tension at all. The effect
whose numbers leave the smallest errors in the last records is named, where they explain nearly all of the change.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis import Fit, identify
from hysteresis.arrays import Floats
from hysteresis.drift.explained import Left, left_by
from hysteresis.drift.states import BOW, DRAG, GAIN, LAG, PLAY, SPEED, TENSION, WIDTH, ZERO, Followed
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.records.record import Record, RecordError
from studies.follow.result import NamedCause
from validation.tracing import catalogue, trace_records
from validation.tracing.effect import CurveContext, CurveForm, Effect, RelativeParameter, Sensible, Values
from validation.tracing.fitting import Fitted
from validation.tracing.outcome import Trace
from validation.tracing.result import fitted_parameters

TRACED = 3
"""Records before a change, and last records, that are traced: more take longer and hardly say more."""
SPREAD = 10
"""Records before a change that its numbers are compared with."""
SENSOR_ZERO = "zero"
"""Name of a change of the angle's zero alone: the mounting of sensor or drive. It is no effect of the catalogue."""
PRELOAD = "preload_loss"
SLACK = "tendon_slack"
STANDS_FOR: dict[str, tuple[Followed, Followed]] = {
    "guide_friction": (WIDTH, WIDTH),
    "backlash": (PLAY, PLAY),
    "viscous_drag": (DRAG, SPEED),
    "time_delay": (LAG, ZERO),
    "drive_gain": (GAIN, GAIN),
    "camera_misalignment": (BOW, ZERO),
    "gravity": (BOW, BOW),
}
"""The number of each law, of the angle and of the tensions, that does what an effect does."""
EXPLAINED = 0.8
"""Share of the change that an effect has to explain to be named without a trace (docs/validation/follow.md)."""
_SAME = 1.02  # of the error: effects that leave as much are not distinguished
_LOOSE = 3.0  # standard deviations of the noise: a tension within them is none
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
    old, new = _spread(before, SPREAD), list(after[-TRACED:])
    if largest.name == ZERO.name and clear <= {ZERO.name}:
        words = "the zero of the angle has moved and nothing else: look at the mounting of sensor and drive"
        return NamedCause((SENSOR_ZERO,), (), "parameters", "effect", words)
    if largest.name == TENSION.name:
        return _of_tension(largest, new)
    told = explanations(fit, old, new)
    if told and told[0].share >= EXPLAINED:
        return _of_numbers(told)
    try:
        trace = trace_records(
            new, reference=_spread(before, TRACED), threads=threads, effects=effects_of_drift(), progress=progress
        )
    except (RecordError, RigError, SolverError) as error:
        return NamedCause((), (), "not traced", "unexplained", f"not traced: {error}")
    return _of_trace(trace, told)


@dataclass(frozen=True)
class Explanation:
    """How well an effect explains the change by its numbers.

    ``tension`` says whether tensions are among the channels, ``angle`` has the errors of the angle, deg. ``error`` is
    the root mean square of the errors of the channels over their limits, and ``share`` the part of their mean squares
    above the usual that is explained.
    """

    effect: str
    error: float
    share: float
    angle: Left
    tension: bool


def explanations(fit: Fit, reference: Sequence[Record], records: Sequence[Record]) -> list[Explanation]:
    """Compare all effects that have numbers (:data:`STANDS_FOR`), the one with the smallest error first.

    Parameters
    ----------
    fit
        Of the angle of the first record.
    reference, records
        The device as it was, at least three, and as it is.
    """
    timed = all(one.time_s is not None for one in [*reference, *records])
    effects = {name: pair for name, pair in STANDS_FOR.items() if timed or not {LAG, DRAG, SPEED} & {*pair}}
    angle = left_by(fit, reference, records, _once([pair[0] for pair in effects.values()]))
    pulled = [_by_tensions(group) for group in (reference, records)]
    tension = dict[str, Left]()
    if pulled[0] and pulled[1]:
        law = identify(pulled[0][0], settings=IdentifySettings(law=fit.form.base_law.name))
        if law.delay_s == 0:
            tension = left_by(law, pulled[0], pulled[1], _once([pair[1] for pair in effects.values()]))
    found = []
    for effect, (of_angle, of_tension) in effects.items():
        channels = [angle[of_angle.name], *([tension[of_tension.name]] if tension else [])]
        error = math.sqrt(sum((one.left / one.limit) ** 2 for one in channels) / len(channels))
        found.append(Explanation(effect, error, _share(channels), channels[0], bool(tension)))
    best = min(one.error for one in found)
    # of effects that leave as much, the one with fewer free numbers: a sensor changes no tension

    def order(one: Explanation) -> tuple[float, int, float]:  # of equal ones that with fewer free numbers
        return max(one.error, _SAME * best), sum(number is not ZERO for number in effects[one.effect]), one.error

    return sorted(found, key=order)


def _share(channels: Sequence[Left]) -> float:
    """Part of the change of all channels that is explained, at most 1."""
    changed = sum(max(0.0, one.unexplained**2 - one.usual**2) / one.limit**2 for one in channels)
    left = sum(max(0.0, one.left**2 - one.usual**2) / one.limit**2 for one in channels)
    return 1.0 - left / max(changed, 1e-300)


def _once(numbers: Sequence[Followed]) -> list[Followed]:
    return list(dict.fromkeys(numbers))


def _by_tensions(records: Sequence[Record]) -> list[Record]:
    """Give records with the difference of both tensions in place of the angle; none where one lacks them."""
    found = [
        replace(one, angle_deg=one.tension_a_N - one.tension_b_N)
        for one in records
        if one.tension_a_N is not None and one.tension_b_N is not None
    ]
    return found if len(found) == len(records) else []


def _of_tension(shift: Shift, new: Sequence[Record]) -> NamedCause:
    """Name what changed the mean tension: slack where both tendons are loose at once, else a preload that was lost."""
    if shift.ratio >= 0:
        return NamedCause((), (), "parameters", "unexplained", "the mean tension has risen")
    if any(_is_loose(one) for one in new):
        words = "the mean tension has fallen, and both tendons are loose at once: a tendon has slipped or stretched"
        return NamedCause((SLACK,), (PRELOAD,), "parameters", "effect", words)
    words = "the mean tension has fallen: the tendons have lost preload"
    return NamedCause((PRELOAD,), (), "parameters", "effect", words)


def _is_loose(record: Record) -> bool:
    """Whether both tendons are without tension at one place of a record, within the noise of its load cells."""
    if record.tension_a_N is None or record.tension_b_N is None:
        return False
    both = np.maximum(record.tension_a_N, record.tension_b_N)
    noise = max(float(np.std(np.diff(one, 2))) / math.sqrt(6.0) for one in (record.tension_a_N, record.tension_b_N))
    return bool(both.min() <= _LOOSE * noise)


def _contains(one: Explanation, other: Explanation) -> bool:
    """Whether an effect differs from another one by a change of the tensions that was measured and is not there."""
    (angle, tension), (same, none) = STANDS_FOR[one.effect], STANDS_FOR[other.effect]
    return one.tension and angle is same and none is ZERO and tension is not ZERO


def _of_numbers(told: Sequence[Explanation]) -> NamedCause:
    """Name the best explanation; those with the same numbers are not distinguished from it."""
    best = told[0]
    alike = tuple(one.effect for one in told[1:] if one.error <= _SAME * best.error and not _contains(one, best))
    words = (
        f"{best.effect}: the error of the last records falls from {best.angle.unexplained:.2g} to {best.angle.left:.2g}"
        f" deg with it"
    )
    if alike:
        words += f"; {', '.join(alike)} explain{'s' if len(alike) == 1 else ''} as much"
    return NamedCause((best.effect,), alike, "parameters", "effect", words)


def _spread(records: Sequence[Record], most: int) -> list[Record]:
    """Give at most so many records, evenly over those there are."""
    at = np.unique(np.linspace(0, len(records) - 1, min(most, len(records))).round().astype(int))
    return [records[k] for k in at]


def _of_trace(trace: Trace, told: Sequence[Explanation]) -> NamedCause:
    """Name what a trace names; of effects that it does not distinguish, what the numbers of the laws say of them."""
    if not trace.names:
        nearest = f": nearest is {' + '.join(trace.candidates[0].names)}" if trace.candidates else ""
        return NamedCause((), (), "trace", trace.verdict, f"no effect of the catalogue explains it{nearest}")
    fitted, names, others = _likeliest(trace, told)
    before, after = trace.baseline.heldout_rmse_deg, trace.augmented.heldout_rmse_deg
    words = f"{' + '.join(names)}: the error of the last records falls from {before:.2g} to {after:.2g} deg with it"
    if others:
        words += f"; {', '.join(others)} cannot be distinguished from it by the trace"
    parameters = dict(fitted_parameters(fitted)[-1]) if len(names) == 1 else {}
    return NamedCause(names, others, "trace", trace.verdict, words, parameters)


def _likeliest(trace: Trace, told: Sequence[Explanation]) -> tuple[Fitted, tuple[str, ...], tuple[str, ...]]:
    """Give the model that is named, its effects with the likeliest first, and those that are not distinguished.

    Among effects that have numbers (:data:`STANDS_FOR`) the one with the smallest error is first; equal ones stay in
    the order of the trace. Of single effects without such numbers the one with the fewest parameters is first.
    """
    named, first = trace.augmented, tuple(trace.names)
    alike = tuple(name for name in dict.fromkeys(n for group in trace.confusable for n in group) if name not in first)
    rivals = {one.names[-1]: one.fitted for one in reversed(trace.candidates) if one.names[-1] in alike}
    every = [*first, *rivals] if len(first) == 1 else [*first]
    errors = {one.effect: one.error for one in told if one.effect in every}
    if errors:
        chosen = next(name for name in every if errors.get(name, math.inf) <= _SAME * min(errors.values()))
    elif len(first) == 1 and rivals:
        models = {first[0]: named} | rivals
        chosen = min(models, key=lambda name: len(models[name].model.added[-1].form.parameters))
    else:
        return named, first, alike
    if len(first) > 1:  # effects that are named together
        return named, (chosen, *(name for name in first if name != chosen)), alike
    others = tuple(name for name in (first[0], *alike) if name != chosen)
    return rivals.get(chosen, named), (chosen,), others
