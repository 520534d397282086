"""Still zone: how far the drive moves after a reversal before the angle follows.

Plays in series are plays: P_r(P_w(x)) = P_(r + w)(x). So play operators absorb a backlash, and no error falls where it
is added. What it predicts is still there to be tested: that nothing moves over the width w after a reversal, wherever
it is and however large the stroke. A model that cannot move there is contained in one that can. If it predicts data
that it has not seen as well, one that stands still for twice as far is refuted, and the residual shows hardly any
motion within w, the angle does stand still.

Friction between wheel and base does the same where the tendons beyond it are elastic: with the force F it is a play of
2 F / k, k being the stiffness of the free tendon. The angle alone does not distinguish the two.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from fem_models.rig.checks import RigError, SolverError
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve_kernels import play
from validation.tracing.baseline.curve_scale import PlacedForm
from validation.tracing.baseline.play_operators import PlayProblem
from validation.tracing.effect import CurveContext, CurveForm, Effect, RelativeParameter, Values
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.folds import gain, mean_square
from validation.tracing.fitting.model import Model
from validation.tracing.plausibility import implausible
from validation.tracing.problem import AddedEffect
from validation.tracing.search.by_folds import FoldFits, fit_to_all
from validation.tracing.settings import (
    FOLD_ALIKE,
    STILL_AS_GOOD,
    STILL_LEAST,
    STILL_MOST,
    STILL_MOTION,
    STILL_NARROWER,
    STILL_RISE,
    STILL_TOLERANCE,
    STILL_TWICE,
    STILL_WIDTHS,
)

SAME_STILL = ("guide_friction",)
"""An effect with the same still zone: friction between wheel and base."""


@dataclass(frozen=True, eq=False)
class StillZone:
    """A still zone that held-out samples show.

    Parameters
    ----------
    fitted
        The model with it, fitted to all samples, with the held-out errors of its fits to the folds.
    width
        In the drive's unit.
    refuted_deg
        Held-out error of the model that stands still for twice as far, deg rms.
    """

    fitted: Fitted
    width: float
    refuted_deg: float


def find_still_zone(best: Fitted, effects: Sequence[Effect], fits: FoldFits) -> StillZone | None:
    """Test whether the angle stands still after reversals, beside a model of play operators; None where it does not.

    Parameters
    ----------
    best
        Fitted to all samples.
    effects
        Of which those with a form that stands still are tried.
    """
    for effect in effects:
        for form in best.model.problem.forms(effect):
            if form.form.still_over and effect.name not in best.names:
                return _zone(best, AddedEffect(effect, form), fits)
    return None


def _zone(best: Fitted, added: AddedEffect, fits: FoldFits) -> StillZone | None:
    """Find the width up to which nothing speaks against a still zone, and test it and twice as much on the folds.

    The folds fit the width again, up to a third below.
    """
    width = _edge(best, added)
    if width is None:
        return None
    there = _fitted(best, added, width)
    narrower, twice = _fitted(best, added, width, STILL_NARROWER * width), _fitted(best, added, STILL_TWICE * width)
    if there is None or narrower is None or twice is None or implausible(there):
        return None
    if abs(_motion(there, width)) > STILL_MOTION:
        return None
    before, still, further = map(fits.everywhere, (best, narrower, twice))
    refuted = mean_square(further) > FOLD_ALIKE**2 * mean_square(still) and gain(further, still).is_positive
    if not refuted or mean_square(still) > STILL_AS_GOOD**2 * mean_square(before):
        return None
    free = replace(there, model=Model(best.model.problem, (*best.model.added, added)))
    return StillZone(fits.with_fold_errors(free, [narrower] * len(fits.folds)), width, math.sqrt(mean_square(further)))


def _edge(best: Fitted, added: AddedEffect) -> float | None:
    """Width beyond which the error of a still zone, fitted to all samples, rises; None where none is tolerated.

    Up to the true width the plays absorb the rest of a narrower one: the error says nothing there, and its least value
    is where a width suits the radii of the plays. At the true width it begins to rise.
    """
    problem = best.model.problem
    assert isinstance(problem, PlayProblem)
    widths = (problem.range[1] - problem.range[0]) * np.geomspace(STILL_LEAST, STILL_MOST, STILL_WIDTHS)
    tried = [_fitted(best, added, width) for width in widths.tolist()]
    error = np.array([math.inf if one is None else one.rmse_deg for one in tried])
    least = int(error.argmin())
    limit = STILL_RISE * error[least]
    above = np.flatnonzero(error[least:] > limit)
    if not math.isfinite(limit) or not above.size or not math.isfinite(error[least + above[0]]):
        return None
    k = least + int(above[0])
    return float(np.interp(limit, error[k - 1 : k + 1], widths[k - 1 : k + 1]))


def _motion(still: Fitted, width: float) -> float:
    """Motion of the angle within a still zone, over what it moves by for as much drive elsewhere.

    An angle that comes late goes on in the old direction, which is below 0. Infinite without a solution.
    """
    problem = still.model.problem
    assert isinstance(problem, PlayProblem)
    slope = 2 * problem.scale.angle / (problem.range[1] - problem.range[0])

    def moving(theta: Floats, context: CurveContext, values: Values) -> Floats:
        x = context.inputs.drive - context.drive_middle
        return theta + values["motion"] * slope * (x - play(x, width, context.initial_state))

    form = CurveForm((RelativeParameter("motion", "-", -5.0, 5.0, 0.1),), ({"motion": 0.0},), angle=moving)
    added = AddedEffect(still.model.added[-1].effect, problem.scale.placed(form))
    model, (baseline, effects) = Model(problem, (*still.model.added, added)), still.model.values(still.x)
    with suppress(SolverError, RigError):
        moved = fit_to_all(model, model.coordinates(baseline, [*effects, {"motion": 0.0}]))
        return float(model.values(moved.x)[1][-1]["motion"])
    return math.inf


def _fitted(best: Fitted, added: AddedEffect, width: float, low: float = math.nan) -> Fitted | None:
    """Fit a model with a still zone of a given width, or down to ``low``, to all samples; None without a solution."""
    form, name = added.form, _width_of(added.form)
    least = (1 - STILL_TOLERANCE) * (width if math.isnan(low) else low)
    near = tuple(
        replace(p, low=least, high=(1 + STILL_TOLERANCE) * width) if p.name == name else p for p in form.parameters
    )
    model = Model(best.model.problem, (*best.model.added, AddedEffect(added.effect, replace(form, parameters=near))))
    baseline, effects = best.model.values(best.x)
    with suppress(SolverError, RigError):
        return fit_to_all(model, model.coordinates(baseline, [*effects, {**form.starts[0], name: width}]))
    return None


def _width_of(form: PlacedForm) -> str:
    """Name of the width in the unit of the records."""
    relative: CurveForm = form.form
    return next(
        placed.name
        for own, placed in zip(relative.parameters, form.parameters, strict=True)
        if own.name == relative.still_over
    )
