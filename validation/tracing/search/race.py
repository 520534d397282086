"""A race of effects beside a fitted model: from several starts each, with budgets that grow; the better half goes on.

Starts of an effect are those of the largest linearised gain beside the fitted model and beside the declared parameters
and, after the second round, the other optima of the baseline from the best fit so far.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.effect import Effect, RigForm
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import fit
from validation.tracing.fitting.model import Model
from validation.tracing.search.restarts import along_the_valley, best_from, other_loops, other_tendons
from validation.tracing.search.search import Progress
from validation.tracing.search.starts import FormStarts, best_starts
from validation.tracing.settings import COMPETITOR_SQUARE

BUDGETS = {4: 16.0, 8: 4.0, 16: 4.0, 30: 4.0}
"""Least-squares steps of each round, and the mean square over the least one above which a runner falls out."""
OPTIMA_AFTER, OPTIMA_NEAR = 8, 4.0
"""Budget after which the other optima of the baseline join, for effects within this mean square over the least one."""
GAINS = 0.995
"""Part of its mean square that a runner must leave at most to go on: others have arrived, or are stuck."""
LOOPS = (0.5, 2.0)
"""Factors on the loop of the material, which has several optima."""


@dataclass(frozen=True, eq=False)
class _Runner:
    """A model with one more effect, its coordinates, and the mean square there; ``fitted`` once it has run."""

    effect: str
    model: Model
    x: Floats
    square: float
    fitted: Fitted | None = None


def raced(
    base: Fitted, effects: Sequence[Effect], threads: int, report: Progress, known: Sequence[Fitted] = ()
) -> list[Fitted]:
    """Fit each of some effects in addition to those of a model: the best fit of each, the best effect first.

    ``known`` are such fits that were made beside another baseline: they compete. ``report`` is called before every fit.
    """
    declared = None if known else _declared(base, threads)
    done = [_Runner(one.names[-1], one.model, one.x, one.train_square, one) for one in known]
    field = [runner for effect in effects for runner in _starts(base, declared, effect, threads)]
    for budget, far in BUDGETS.items():
        ran = list[tuple[_Runner, _Runner]]()
        for ahead, one in zip(reversed(range(len(field))), field, strict=True):
            report(" + ".join((*base.names, one.effect)), ahead)
            if (there := _run(base, one, budget, threads)) is not None:
                ran.append((one, there))
        done += [there for _, there in ran]
        least = min((one.square for one in done), default=0.0)
        field = [there for before, there in ran if before.fitted is None or there.square < GAINS * before.square]
        if budget == OPTIMA_AFTER:
            field += [
                other for one in _best(done).values() if one.square <= OPTIMA_NEAR * least for other in _optima(one)
            ]
        field.sort(key=lambda one: one.square)
        kept = [*field[: (len(field) + 1) // 2]]
        if budget < OPTIMA_AFTER:  # every effect gets that far
            kept += [one for one in _best(field).values() if one not in kept]
        places = {(one.effect, f"{one.square:.2e}", one.fitted is None and id(one)): one for one in reversed(kept)}
        field = [one for one in reversed(places.values()) if one.square <= far * least]
    fits = sorted((one.fitted for one in _best(done).values() if one.fitted), key=lambda one: one.train_square)
    near = [one for one in fits if one.train_square <= COMPETITOR_SQUARE * fits[0].train_square]
    again = [best_from(one, _further(one), threads, report) for one in near]
    return sorted([*again, *fits[len(near) :]], key=lambda one: one.train_square)


def _further(fitted: Fitted) -> list[Floats]:
    """Coordinates from which a fit may come to a better optimum."""
    return [*other_loops(fitted), *other_tendons(fitted), *along_the_valley(fitted)]


def _best(runners: Iterable[_Runner]) -> Mapping[str, _Runner]:
    """Best runner of each effect."""
    out = dict[str, _Runner]()
    for one in runners:
        if one.effect not in out or one.square < out[one.effect].square:
            out[one.effect] = one
    return out


def _declared(base: Fitted, threads: int) -> Fitted | None:
    """Give the model with the declared parameters of its baseline, its effects as they are; None without a solution."""
    values = base.model.values(base.x)[1]
    with suppress(SolverError, RigError):
        start = base.model.coordinates(base.model.problem.start, values)
        return fit(base.model, base.holdout, start, threads=threads, most_steps=1)
    return None


def _starts(base: Fitted, declared: Fitted | None, effect: Effect, threads: int) -> list[_Runner]:
    """Give starts of an effect by their linearised gains, of those beside the declared parameters the best one."""
    problem = base.model.problem
    forms = [one for one in problem.forms(effect) if not (isinstance(one, RigForm) and one.refines)]
    starts = [FormStarts(form, problem.starts(form)) for form in forms]
    chosen = [(base, one) for one in best_starts(base, effect, starts, threads)]
    if declared is not None:
        chosen += [(declared, one) for one in best_starts(declared, effect, starts, threads)[:1]]
    return [
        _Runner(effect.name, Model(problem, (*base.model.added, one.added)), one.x, (1 - one.gain) * of.train_square)
        for of, one in chosen
    ]


def _run(base: Fitted, runner: _Runner, budget: int, threads: int) -> _Runner | None:
    """Give a runner some steps; None where it has no solution."""
    with suppress(SolverError, RigError):
        there = fit(runner.model, base.holdout, runner.x, threads=threads, most_steps=budget)
        return _Runner(runner.effect, runner.model, there.x, there.train_square, there)
    return None


def _optima(runner: _Runner) -> list[_Runner]:
    """Give starts from the other optima of the baseline."""
    if runner.fitted is None:
        return []
    xs = [*other_loops(runner.fitted, LOOPS), *other_tendons(runner.fitted)]
    return [_Runner(runner.effect, runner.model, x, runner.square) for x in xs]
