"""Detection limits: the smallest size of each effect that these records would have shown.

An effect is added to the model that was found, larger and larger, and the records are thought of as made with it. What
the other parameters cannot absorb of its action (their linearised fit) must be large enough for the test to claim it
(:mod:`validation.tracing.inference.limits`) in nine of ten repetitions. Where rules decide, it must be named by them:
worth naming against the error that is left, beyond the bar of the criterion and beyond what counts as noise, and a
large enough part of what is above the noise. A search may miss an effect of that size for want of a start.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve import CurveProblem
from validation.tracing.baseline.equivalent_rig import EquivalentRigProblem
from validation.tracing.baseline.known_rig import KnownRigProblem, is_of_measured_joints
from validation.tracing.baseline.play_operators import PlayProblem
from validation.tracing.effect import Effect, FreeParameter, Values
from validation.tracing.fitting.evidence import significant_ratio
from validation.tracing.fitting.fitted import Fitted, rms
from validation.tracing.fitting.least_squares import solve
from validation.tracing.fitting.model import Model
from validation.tracing.plausibility import has_no_scale
from validation.tracing.problem import AddedEffect
from validation.tracing.result import DetectionLimit
from validation.tracing.settings import (
    AT_FLOOR,
    CURVE,
    DETECTION_RUNS,
    EQUIVALENT_RIG,
    EXPLAINED_SHARE,
    FAR_ABOVE,
    KNOWN_RIG,
    LARGEST_FACTOR,
    MOST_OF_ERROR,
    NEAR_NOISE,
    NINE_OF_TEN,
    PARTIAL_SHARE,
    SAME_ACTION,
    VERY_STRONG_EVIDENCE,
    WORTH_NAMING,
)

Needed = Callable[[Floats], float]
"""How many times larger a change of all that is fitted must be to be named, shape (m,), deg; infinite: no size is."""


def detection_limits(
    fitted: Fitted, effects: Sequence[Effect], floor_deg: float, needed: Needed | None = None
) -> list[DetectionLimit]:
    """Give the detection limit of each effect with an amount that a model does not have.

    Effects without a limit within the bounds of their parameters are left out: no size that the fit allows would show.
    So are amounts to which an equivalent rig gives no scale, such as g of a ring.

    Parameters
    ----------
    fitted
        The model that was found, fitted to records.
    floor_deg
        Noise floor; the error that is left counts where it is larger.
    needed
        How much larger a change must be, by the rules if it is not given.
    """
    needed = needed or _by_rules(fitted, floor_deg, len(effects))
    out = []
    for effect in effects:
        if effect.name in fitted.names:
            continue
        found = [limit for form in _forms(fitted, effect) if (limit := _limit(fitted, effect, form, needed))]
        if found:
            out.append(found[0])
    return out


def absorbed_effects(fitted: Fitted, effects: Sequence[Effect], limits: Sequence[DetectionLimit]) -> tuple[str, ...]:
    """Name the effects with an amount that have no limit: the parameters of the model absorb them at every size."""
    shown = {*fitted.names, *(one.name for one in limits)}
    problem = fitted.model.problem
    return tuple(
        effect.name
        for effect in effects
        if effect.name not in shown
        and any(
            p.acts_from_zero and not has_no_scale(problem, p)
            for form in _forms(fitted, effect)
            if problem.starts(form)
            for p in form.parameters
        )
    )


def _by_rules(fitted: Fitted, floor_deg: float, effects: int) -> Needed:
    """Give what the rules ask of a change."""
    left = max(floor_deg, fitted.heldout_rmse_deg if math.isfinite(fitted.heldout_rmse_deg) else 0.0)
    needed = _needed(fitted, left, floor_deg, effects)
    return lambda change: needed.over(_action(fitted, change))


@dataclass(frozen=True)
class _Action:
    """Rms of an effect that other parameters cannot absorb, deg: of the angle, and of all that is fitted."""

    angle_deg: float
    all_deg: float


@dataclass(frozen=True)
class _Needed:
    """Rms action, deg, from which an effect is named in nine of ten repetitions.

    ``all_deg`` is what the criterion asks of all that is fitted. Of the angle, or of all, the error must fall enough to
    be worth naming: by ``angle_worth_deg`` or ``all_worth_deg``; and of the angle by ``angle_least_deg`` in any case.
    """

    all_deg: float
    angle_worth_deg: float
    all_worth_deg: float
    angle_least_deg: float

    def over(self, action: _Action) -> float:
        """How many times the action is needed; infinite for an action of the channels where the angle must move."""

        def ratio(needed: float, there: float) -> float:
            return needed / there if there > 0 else 0.0 if needed == 0 else math.inf

        worth = min(ratio(self.angle_worth_deg, action.angle_deg), ratio(self.all_worth_deg, action.all_deg))
        least = ratio(self.angle_least_deg, action.angle_deg)
        return max(ratio(self.all_deg, action.all_deg), worth, least)


def _needed(fitted: Fitted, left_deg: float, floor_deg: float, effects: int) -> _Needed:
    """Give what an effect needs beside a model with an error of the angle.

    With the action a and the error that is left s, the error before is sqrt(s^2 + a^2). The rules ask for a ratio of
    the errors of ``WORTH_NAMING`` and for a gain n log(1 + a^2 / s^2) of the criterion; n are independent samples. The
    amplitude of the action is known to s / sqrt(n). Channels that are fitted with the angle have errors, too.
    """
    count, of_angle = max(2.0, fitted.samples), max(2.0, fitted.angle_samples)
    bar = VERY_STRONG_EVIDENCE + 2 * math.log(max(1, effects)) + math.log(count)
    by_criterion = math.sqrt(math.expm1(min(bar / count, 50.0)))
    by_worth = math.sqrt(1 / WORTH_NAMING**2 - 1)
    all_left = left_deg * math.sqrt(fitted.square / fitted.mean_square) if fitted.mean_square > 0 else left_deg
    return _Needed(
        all_deg=all_left * (by_criterion + NINE_OF_TEN / math.sqrt(count)),
        angle_worth_deg=left_deg * (by_worth + NINE_OF_TEN / math.sqrt(of_angle)),
        all_worth_deg=all_left * (by_worth + NINE_OF_TEN / math.sqrt(count)),
        angle_least_deg=max(
            _beyond_noise_deg(fitted, left_deg, floor_deg), _large_part_deg(fitted, left_deg, floor_deg)
        ),
    )


def _beyond_noise_deg(fitted: Fitted, left_deg: float, floor_deg: float) -> float:
    """Rms action that takes the residual beyond what counts as noise; 0 where it is beyond without.

    Beside an equivalent rig whose residual is noise an effect is tried nevertheless. One with a larger residual is
    given none up to :data:`NEAR_NOISE` (:func:`validation.tracing.verdict.is_too_little`), nor are measured joints. A
    known rig whose residual exceeds the noise is given none up to :data:`FAR_ABOVE`, since the residual with an effect
    exceeds it, too (both: :func:`validation.tracing.verdict.left_near_noise`).
    """
    problem = fitted.model.problem
    if isinstance(problem, EquivalentRigProblem):
        noise = significant_ratio(fitted, EQUIVALENT_RIG)
        bar = 0.0 if left_deg <= noise * floor_deg else NEAR_NOISE
    else:
        bar = significant_ratio(fitted, CURVE if isinstance(problem, CurveProblem) else KNOWN_RIG)
        if isinstance(problem, KnownRigProblem) and left_deg > bar * floor_deg:
            bar = FAR_ABOVE
        elif is_of_measured_joints(problem):
            bar = NEAR_NOISE
    missing = (bar * floor_deg) ** 2 - left_deg**2
    return math.sqrt(missing) + _margin_deg(fitted, left_deg) if missing > 0 else 0.0


def _large_part_deg(fitted: Fitted, left_deg: float, floor_deg: float) -> float:
    """Rms action that is as large a part of the mean square above the noise as the verdict asks of an effect.

    With the action a and the part p it is a^2 >= p (left^2 + a^2 - floor^2), where more than noise is left. Inner folds
    ask less of a known rig, and of play operators any part may be named that takes :data:`PARTIAL_SHARE`; of a change
    since a reference, that part of the whole mean square.
    """
    problem = fitted.model.problem
    if isinstance(problem, PlayProblem) and problem.is_compared:  # of the whole mean square
        return math.sqrt(PARTIAL_SHARE / (1 - PARTIAL_SHARE)) * left_deg + _margin_deg(fitted, left_deg)
    if left_deg <= AT_FLOOR * floor_deg:
        return 0.0
    if isinstance(problem, PlayProblem):
        part = PARTIAL_SHARE
    else:
        part = EXPLAINED_SHARE if isinstance(problem, EquivalentRigProblem | CurveProblem) else MOST_OF_ERROR
    return math.sqrt(part / (1 - part) * (left_deg**2 - floor_deg**2)) + _margin_deg(fitted, left_deg)


def _margin_deg(fitted: Fitted, left_deg: float) -> float:
    """How much the action is off at most in nine of ten repetitions."""
    return NINE_OF_TEN * left_deg / math.sqrt(max(2.0, fitted.samples))


def _forms(fitted: Fitted, effect: Effect) -> list[Any]:
    """Forms with an amount, those with the fewest parameters first."""
    forms = [f for f in fitted.model.problem.forms(effect) if any(p.acts_from_zero for p in f.parameters)]
    return sorted(forms, key=lambda form: len(form.parameters))


def _limit(fitted: Fitted, effect: Effect, form: Any, needed: Needed) -> DetectionLimit | None:
    """Scale the first start of a form until its action is as large as needed; None beyond its bounds.

    Of several amounts, such as a sine and a cosine, one acts alone, the first with a limit: its size is the effect's.
    """
    starts = fitted.model.problem.starts(form)
    own = {p.name for p in form.parameters}
    if not starts:
        return None
    start = {name: value for name, value in starts[0].items() if name in own}
    amounts = [p for p in form.parameters if p.acts_from_zero and start[p.name]]
    nothing = {p.name: 0.0 for p in form.parameters if p.acts_from_zero}
    alone = (
        _limit_of_amount(fitted, AddedEffect(effect, form), p, start | nothing | {p.name: start[p.name]}, needed)
        for p in amounts
        if not has_no_scale(fitted.model.problem, p)
    )
    return next(filter(None, alone), None)


def _limit_of_amount(
    fitted: Fitted, added: AddedEffect, amount: FreeParameter, start: dict[str, float], needed: Needed
) -> DetectionLimit | None:
    """Scale an amount until its action is as large as needed; None beyond its bounds, or without an action."""
    form = added.form
    most = _largest_factor(form.parameters, start)
    factor = min(1.0, most)
    for _ in range(DETECTION_RUNS):
        change = _change(fitted, added, _scaled(form.parameters, start, factor))
        if change is None or not math.isfinite(step := needed(change)) or step <= 0.0:
            return None
        if abs(step - 1.0) < SAME_ACTION:
            return DetectionLimit(added.effect.name, amount.name, abs(start[amount.name]) * factor, amount.unit)
        factor = float(np.clip(factor * step, 1.0 / LARGEST_FACTOR, LARGEST_FACTOR))
        if factor > most:
            return None
    return None  # no size has just the action that is needed


def _largest_factor(parameters: Sequence[FreeParameter], start: Values) -> float:
    factors = [
        (p.high if start[p.name] > 0 else p.low) / start[p.name]
        for p in parameters
        if p.acts_from_zero and start[p.name]
    ]
    return min(factors, default=0.0)


def _scaled(parameters: Sequence[FreeParameter], start: Values, factor: float) -> dict[str, float]:
    return {p.name: start[p.name] * (factor if p.acts_from_zero else 1.0) for p in parameters}


def action_deg(fitted: Fitted, added: AddedEffect, values: Values) -> float | None:
    """Rms change of the angle by an effect, less what the other parameters absorb of it; None without a solution."""
    change = _change(fitted, added, values)
    return None if change is None else _action(fitted, change).angle_deg


def _change(fitted: Fitted, added: AddedEffect, values: Values) -> Floats | None:
    """Change of all that is fitted by an effect, shape (m,), deg; None without a solution."""
    model = Model(fitted.model.problem, (*fitted.model.added, added))
    baseline, effects = fitted.model.values(fitted.x)
    low, high = model.bounds()
    x = np.clip(model.coordinates(baseline, [*effects, values]), low, high)
    try:
        change = fitted.holdout.stacked(model.errors(x)) - fitted.rows.errors
    except (SolverError, RigError):
        return None
    return change if np.isfinite(change).all() else None


def _action(fitted: Fitted, change: Floats) -> _Action:
    jacobian: Floats = fitted.rows.jacobian  # channels that were fitted with the angle fix parameters, too
    remaining = change + jacobian @ solve(jacobian, -change)
    return _Action(rms(remaining[: fitted.error_deg.size]), rms(remaining))
