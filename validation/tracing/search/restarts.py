"""Fits from other starting points, for optima that a first fit has missed."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.baseline.equivalent_rig import EquivalentRigProblem
from validation.tracing.fitting.evidence import is_noise
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import fit
from validation.tracing.search.search import Progress, Search
from validation.tracing.settings import (
    CONTAINED_TOLERANCE,
    FEW_STEPS,
    LEAST_TOE,
    LOOP_FACTORS,
    LOOP_FACTORS_FINAL,
    LOOP_PARAMETER,
    MOST_RESTARTS,
    NO_SLOPE,
    PROMISING,
    TOE_PARAMETER,
)


def best_of_other_loops(search: Search, fitted: Fitted) -> Fitted:
    """Fit again from other loops of the material, unless the residual is noise; the best fit of all samples.

    The search compares effects by all samples; at its end the training samples decide (:func:`best_of_restarts`).
    """
    if is_noise(fitted):
        return fitted
    found = [fitted]
    others = other_loops(fitted, LOOP_FACTORS)
    for ahead, x in zip(reversed(range(len(others))), others, strict=True):
        search.report(f"{' + '.join(fitted.names) or 'the baseline model'}, from another loop", ahead)
        with suppress(SolverError, RigError):
            found.append(fit(fitted.model, fitted.holdout, x, threads=search.threads))
    return min(found, key=lambda other: other.square)


def best_of_restarts(search: Search, fitted: Fitted) -> Fitted:
    """Fit an augmented model again from other starting points; the best fit of the training samples.

    A fit may end in a valley along which the training samples do not distinguish two parameters, such as backlash and
    friction at the base, or beside wrong tendons (:func:`other_tendons`). Of an equivalent rig the effects are also
    fitted beside the baseline's start. On a known rig other loops are tried again from a fit that is better: a loop may
    be several optima away.
    """
    if not (search.policy.restarted and fitted.names):
        return fitted
    valley = along_the_valley(fitted) if search.policy.along_valley else ()
    starts = (*other_loops(fitted), *other_tendons(fitted), *valley)
    best = best_from(fitted, starts, search.threads, search.report)
    for _ in range(MOST_RESTARTS if search.policy.along_valley else 0):
        if best is fitted or best.train_square > (1 - CONTAINED_TOLERANCE) * fitted.train_square:
            break
        fitted, best = best, best_from(best, other_loops(best), search.threads, search.report)
    return best_from_start(search, best) if search.policy.absorbs_effects else best


def best_from_start(search: Search, fitted: Fitted) -> Fitted:
    """Fit a model of an equivalent rig again, its effects as they are, beside the baseline's start; the better fit.

    The fitted baseline may have absorbed the effect, so that its parameters lead to another optimum. The start has
    tendons that are all but linear.
    """
    start, effects = dict(search.problem.start), fitted.model.values(fitted.x)[1]
    if TOE_PARAMETER in start:
        start[TOE_PARAMETER] = LEAST_TOE * search.problem.preload_N
    search.report(f"{' + '.join(fitted.names)}, from the start of the baseline", 0)
    with suppress(SolverError, RigError):
        there = fit(fitted.model, fitted.holdout, fitted.model.coordinates(start, effects), threads=search.threads)
        return min(fitted, there, key=lambda one: one.train_square)
    return fitted


def best_from(fitted: Fitted, starts: Sequence[Floats], threads: int, report: Progress) -> Fitted:
    """Fit a model from other starting points, those to the end that are promising; the best fit, or the one given."""
    found = [fitted]
    for ahead, x in zip(reversed(range(len(starts))), starts, strict=True):
        report(f"{' + '.join(fitted.names)}, from another start", ahead)
        with suppress(SolverError, RigError):
            there = fit(fitted.model, fitted.holdout, x, threads=threads, most_steps=FEW_STEPS)
            if there.train_square < PROMISING**2 * fitted.train_square:
                found.append(fit(fitted.model, fitted.holdout, there.x, threads=threads))
    return min(found, key=lambda other: other.train_square)


def best_of_other_tendons(search: Search, fitted: Fitted) -> Fitted:
    """Fit a model of an equivalent rig again from tendons with hardly a toe region; the better fit."""
    return best_from(fitted, other_tendons(fitted), search.threads, search.report)


def other_tendons(fitted: Fitted) -> list[Floats]:
    """Coordinates of an equivalent rig with tendons that are all but linear; none where they are, or have no toe.

    Soft tendons and linear ones are two optima, and a baseline without the effect may be in the wrong one.
    """
    problem, (baseline, effects) = fitted.model.problem, fitted.model.values(fitted.x)
    own = {name for values in effects for name in values}
    if not isinstance(problem, EquivalentRigProblem) or TOE_PARAMETER not in baseline.keys() - own:
        return []
    linear = LEAST_TOE * problem.preload_N
    if baseline[TOE_PARAMETER] <= linear:
        return []
    return [fitted.model.coordinates({**baseline, TOE_PARAMETER: linear}, effects)]


def other_loops(fitted: Fitted, factors: Sequence[float] = LOOP_FACTORS_FINAL) -> list[Floats]:
    """Coordinates of a fitted model with other loops of the material; none where it has no such loop."""
    baseline, effects = fitted.model.values(fitted.x)
    if LOOP_PARAMETER not in baseline:
        return []
    loop = baseline[LOOP_PARAMETER]
    return [fitted.model.coordinates({**baseline, LOOP_PARAMETER: factor * loop}, effects) for factor in factors]


def along_the_valley(fitted: Fitted) -> list[Floats]:
    """Coordinates at a distance of 1, in both directions, along the line that the training samples determine least."""
    slopes = fitted.rows.jacobian[fitted.rows.train]
    lengths = np.linalg.norm(slopes, axis=0)
    acts = lengths > NO_SLOPE * lengths.max()
    *_, directions = np.linalg.svd(slopes[:, acts], full_matrices=False)
    flattest = np.zeros(acts.size)
    flattest[acts] = directions[-1] / np.abs(directions[-1]).max()
    return [fitted.x + flattest, fitted.x - flattest]
