"""Candidates: a model with each of the other effects added, fitted as far as they are worth it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from validation.tracing.effect import Effect
from validation.tracing.fitting.evidence import is_noise
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.model import Model
from validation.tracing.plausibility import implausible
from validation.tracing.problem import AddedEffect
from validation.tracing.search.restarts import best_of_other_loops, best_of_other_tendons
from validation.tracing.search.search import Search
from validation.tracing.search.starts import Start, best_starts, every_start
from validation.tracing.settings import (
    BESIDE,
    COMPETITOR_AT_NOISE,
    COMPETITOR_SQUARE,
    FEW_STEPS,
    GAINS_FAST,
    MISFIT_ALIKE,
    OTHER_FORM_SQUARE,
    SIGNIFICANT_LOOSE,
)

Started = TypeVar("Started")


class Screened(NamedTuple):
    """A candidate after its first steps, and the number of the fitted model beside which it was started.

    ``linearised`` is the mean square after the linearised gain of its start.
    """

    base: int
    fitted: Fitted
    linearised: float


def candidates_with_one_more(search: Search, fitted: Fitted, most: int | None) -> list[Fitted]:
    """Add each effect that is not in a model yet, and fit the models.

    Parameters
    ----------
    most
        Effects with the largest linearised gain that are fitted; None for all.
    """
    policy = search.policy
    bases = [fitted] if fitted.names or search.early is None else [fitted, search.early]
    others = [effect for effect in search.effects if effect.name not in fitted.names]
    screened: list[Screened] = []
    for number, base in enumerate(bases):
        if base is search.early:
            screened += _first_steps_of_all(search, base, others, number)
            continue
        found = [starts for e in others if (starts := best_starts(base, e, search.forms(e), search.threads))]
        found.sort(key=lambda starts: -starts[0].gain)
        chosen = [s for starts in found[:most] for s in starts]
        for ahead, start in _counted_down(chosen, _finished_at_most(search, fitted)):
            known = base.rows.jacobian if policy.screened and _is_beside(base, start) else None
            there = search.with_effect(fitted, start.added, start.x, policy.first_steps, known, ahead)
            if there is not None:
                screened.append(Screened(number, there, (1.0 - start.gain) * base.square))
    screened.sort(key=lambda one: one.fitted.square)
    if not policy.screened:
        return [one.fitted for one in screened]
    finished = _finish(search, fitted, screened)
    return _lead_on(search, fitted, finished if fitted.names else _with_other_tendons(search, finished))


def _finished_at_most(search: Search, fitted: Fitted) -> int:
    """Fits after the first steps of all starts: the best candidates to convergence, the leading ones further."""
    policy = search.policy
    return (policy.later_finished if fitted.names else policy.finished) + policy.leading


def _counted_down(starts: Sequence[Started], later: int) -> Iterator[tuple[int, Started]]:
    """Give each start with the number of fits that follow it: those of the other starts, and ``later`` ones."""
    return ((len(starts) - done + later, start) for done, start in enumerate(starts, 1))


def _with_other_tendons(search: Search, candidates: Sequence[Fitted]) -> list[Fitted]:
    """Fit the leading effects from other tendons, too, where none explains the records.

    Only an equivalent rig has tendons that are free.
    """
    best = min(candidates, key=lambda g: g.square, default=None)
    if not search.policy.absorbs_effects or best is None or best.rmse_deg <= SIGNIFICANT_LOOSE * best.noise.deg:
        return [*candidates]
    leading = dict[str, Fitted]()
    for candidate in sorted(candidates, key=lambda g: g.square):
        if len(leading) < search.policy.finished and candidate.square < COMPETITOR_SQUARE * best.square:
            leading.setdefault(candidate.names[-1], candidate)
    again = {id(g): best_of_other_tendons(search, g) for g in leading.values()}
    return [again.get(id(g), g) for g in candidates]


def _first_steps_of_all(search: Search, early: Fitted, effects: Sequence[Effect], number: int) -> list[Screened]:
    """Give every start of every form a few steps beside a baseline after a few; the best of each form goes on.

    So far from an optimum the linearised gain says nothing: by it the baseline's own parameters take nearly all.
    """
    out = list[Screened]()
    later = _finished_at_most(search, early)
    every = [one for effect in effects for one in every_start(early, effect, search.forms(effect))]
    for ahead, one in _counted_down(every, later):
        each = {(np.round(x, 6) + 0.0).tobytes(): x for x in one.starts}  # from declared parameters they may be alike
        few = [search.with_effect(early, one.added, x, FEW_STEPS, ahead=ahead) for x in each.values()]
        there = [fitted for fitted in few if fitted is not None]
        if there:
            best = min(there, key=lambda fitted: fitted.square)
            best = search.with_effect(early, one.added, best.x, search.policy.first_steps, ahead=ahead) or best
            out.append(Screened(number, best, best.square))
    return out


def _is_beside(base: Fitted, start: Start) -> bool:
    """Whether a start is so near a fitted model that the derivatives of that model serve its first step.

    One from declared parameters is not: with derivatives from elsewhere its first steps fail.
    """
    return bool(np.abs(start.x[: base.x.size] - base.x).max(initial=0.0) <= BESIDE)


def _finish(search: Search, fitted: Fitted, screened: Sequence[Screened]) -> list[Fitted]:
    """Fit the best candidates to convergence; those that have fallen behind stay as they are.

    At least one effect of each base is fitted to convergence. Beside a baseline that has absorbed the true effect,
    effects that do nothing have the residual of that baseline, and would fill all places. On a known rig an effect
    near by the linearised gain of its start gets further steps before it counts as behind.
    """
    policy = search.policy
    most = policy.later_finished if fitted.names else policy.finished
    out = list[Fitted]()
    best = dict[str, float]()  # mean square after the first steps, of effects that are fitted to convergence
    followed = set[tuple[str, int]]()  # effects with the bases from which they were
    represented = set[int]()  # bases of which an effect is fitted to convergence
    at_noise = False
    least, near = screened[0].fitted.square if screened else math.inf, policy.near
    for number, candidate, linearised in screened:
        name = candidate.names[-1]
        place = len(best) < most or number not in represented
        if policy.follows_gain and name not in best and place and linearised < near * least <= candidate.square:
            candidate = _led_nearer(search, fitted, candidate, near * least)
        square = candidate.square
        if name not in best and place and square < near * least:
            best[name] = square
            represented.add(number)
        first = (name, number) not in followed
        if not (name in best and (first or (not at_noise and square <= OTHER_FORM_SQUARE * best[name]))):
            out.append(candidate)
            continue
        followed.add((name, number))
        finished = search.with_effect(fitted, candidate.model.added[-1], candidate.x, ahead=policy.leading)
        out.append(finished or candidate)
        if finished is not None and finished.square < least:
            least, at_noise = finished.square, is_noise(finished)
            near = policy.near_at_noise if at_noise else policy.near
    return out


def _led_nearer(search: Search, fitted: Fitted, candidate: Fitted, enough: float) -> Fitted:
    """Give a candidate further steps until its mean square is low enough, as long as they gain fast.

    A start that is near by its linearised gain may need more than the first steps, where the baseline has absorbed a
    good part of the effect and has to come back.
    """
    while candidate.square >= enough:
        further = search.with_effect(fitted, candidate.model.added[-1], candidate.x, search.policy.first_steps)
        if further is None or further.square >= candidate.square:
            break
        slow = further.square > GAINS_FAST * candidate.square
        candidate = further
        if slow:
            break
    return candidate


def _lead_on(search: Search, fitted: Fitted, candidates: list[Fitted]) -> list[Fitted]:
    """Fit the best forms of the leading effects with more parameters and from other loops."""
    if not candidates:
        return candidates
    leading = dict[str, Fitted]()
    for candidate in sorted(candidates, key=lambda g: g.square):
        if len(leading) < search.policy.leading:
            leading.setdefault(candidate.names[-1], candidate)
    rest = [g for g in candidates if leading.get(g.names[-1]) is not g]
    best = min(candidates, key=lambda g: g.square)
    most = COMPETITOR_AT_NOISE * best.square if is_noise(best) else math.inf

    def led_on(candidate: Fitted) -> Fitted:
        return best_of_other_loops(search, _with_richer_form(search, fitted, candidate))

    return [*(led_on(g) if g.square <= most else g for g in leading.values()), *rest]


def _with_richer_form(search: Search, fitted: Fitted, candidate: Fitted) -> Fitted:
    """Fit the last effect of a candidate in its forms with more parameters, unless the residual is noise.

    A form that makes no sense gives way to one that does and fits about as well: a wheel whose radius is free to one of
    the declared radius.
    """
    senseless = bool(implausible(candidate))
    if is_noise(candidate) and not senseless:
        return candidate
    *before, last = candidate.model.added
    baseline, effects = candidate.model.values(candidate.x)
    few = list[Fitted | None]()
    for form, starts in ((one.form, one.starts) for one in search.forms(last.effect)):
        if set(effects[-1]) < {p.name for p in form.parameters}:
            added = AddedEffect(last.effect, form)
            model = Model(search.problem, (*before, added))
            rows = [model.coordinates(baseline, [*effects[:-1], {**values, **effects[-1]}]) for values in starts]
            few += [search.with_effect(fitted, added, x, FEW_STEPS) for x in np.unique(rows, axis=0)]
    found = [g for g in few if g is not None]
    if not found:
        return candidate
    best = min(found, key=lambda g: g.square)
    best = search.with_effect(fitted, best.model.added[-1], best.x) or best
    if senseless and best.square < MISFIT_ALIKE**2 * candidate.square and not implausible(best):
        return best
    samples = best.samples
    return min((candidate, best), key=lambda g: g.bic(samples))
