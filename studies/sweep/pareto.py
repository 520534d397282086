"""Pareto-optimal designs: NSGA-II (doi 10.1109/4235.996017, as in pymoo) over the ranges of a study's axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.termination import get_termination
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from hysteresis.arrays import Floats, Ints
from studies.results.study import Bounds, Objective, ParetoFront
from studies.sweep.cases import Outcome
from studies.sweep.errors import StudyError
from studies.sweep.plan import on_axes
from studies.sweep.quantities import QUANTITIES
from studies.sweep.study_file import Axis, Limit, Pareto, Study

Evaluate = Callable[[list[Mapping[str, float]]], Sequence[Outcome | None]]
_WORST = 1e30  # objective of a failed case: its constraint excludes it, but the search needs a number


@dataclass(frozen=True)
class Design:
    """A design that was tried: its variables and its quantities by name."""

    values: Mapping[str, float]
    quantities: Mapping[str, float]


def pareto(study: Study, evaluate: Evaluate) -> ParetoFront:
    """Search for the Pareto front of the designs that keep the limits.

    A design is dominated if another is at least as good in all objectives and better in one. Axes that are not
    variables of the search stay at the middle of their range.

    Raises
    ------
    StudyError
        No design keeps the limits.
    """
    assert study.pareto is not None
    settings = study.pareto
    axes = [axis for axis in study.axes if axis.name in settings.variables]
    fixed = {axis.name: _middle(axis) for axis in study.axes if axis.name not in settings.variables}
    tried = dict[tuple[float, ...], Design]()
    search = NSGA2(pop_size=settings.population)
    size = {"n_obj": len(settings.objectives), "n_ieq_constr": 1 + len(_bounds(settings.limits))}
    search.setup(
        Problem(n_var=len(axes), xl=np.zeros(len(axes)), xu=np.ones(len(axes)), **size),
        termination=get_termination("n_gen", settings.generations), seed=settings.seed, verbose=False,
    )  # fmt: skip
    while search.has_next():
        population = search.ask()
        rows = on_axes(axes, np.asarray(population.get("X"), dtype=float))
        points = [dict(zip([a.name for a in axes], row.tolist(), strict=True)) for row in rows]
        found = list(evaluate([{**fixed, **point} for point in points]))
        scores = [_scored(settings, outcome) for outcome in found]
        population.set("F", np.array([f for f, _ in scores]), "G", np.array([g for _, g in scores]))
        # marked as evaluated, so that the search does not evaluate them again
        for individual in population:
            individual.evaluated.update({"F", "G", "H"})
        search.tell(infills=population)
        for point, outcome, (_, violations) in zip(points, found, scores, strict=True):
            if outcome is not None and max(violations) <= 0:
                tried[tuple(point.values())] = Design(point, outcome.quantities)
    return _result(study, settings, fixed, tried)


def _middle(axis: Axis) -> float:
    middle = 0.5 * (axis.low + axis.high)
    return float(round(middle)) if axis.whole else middle


def _bounds(limits: Sequence[Limit]) -> list[tuple[str, float, float]]:
    """Give the limits as (quantity, sign, bound), with sign (value - bound) <= 0."""
    return [
        (limit.quantity, sign, bound)
        for limit in limits
        for sign, bound in ((-1.0, limit.low), (1.0, limit.high))
        if bound is not None
    ]


def _scored(settings: Pareto, outcome: Outcome | None) -> tuple[list[float], list[float]]:
    """Give objectives, all to be minimised, and constraints, met if at most 0; the first one is that the case is ok."""
    bounds = _bounds(settings.limits)
    if outcome is None or outcome.status != "ok":
        return [_WORST] * len(settings.objectives), [1.0] + [_WORST] * len(bounds)
    q = outcome.quantities
    goals = [q[name] * (1 if goal == "min" else -1) for name, goal in settings.objectives]
    kept = [sign * (q[name] - bound) for name, sign, bound in bounds]
    if not np.isfinite([*goals, *kept]).all():
        return [_WORST] * len(goals), [1.0] + [_WORST] * len(bounds)
    return goals, [0.0, *kept]


def front(goals: Floats) -> Ints:
    """Find the rows of (n, objectives), all to be minimised, that no other row dominates."""
    return np.sort(np.asarray(NonDominatedSorting().do(goals, only_non_dominated_front=True), dtype=np.int64))


def _result(
    study: Study, settings: Pareto, fixed: Mapping[str, float], tried: Mapping[tuple[float, ...], Design]
) -> ParetoFront:
    if not tried:
        raise StudyError(f"{study.path}: pareto.limits: no design keeps them: expected wider limits or ranges")
    designs = [tried[key] for key in sorted(tried)]
    signs = np.array([1.0 if goal == "min" else -1.0 for _, goal in settings.objectives])
    goals = signs * np.array([[d.quantities[name] for name, _ in settings.objectives] for d in designs])
    return ParetoFront(
        engine=study.engine,
        objectives={n: Objective(goal, QUANTITIES[n].units) for n, goal in settings.objectives},
        limits={limit.quantity: Bounds(limit.low, limit.high) for limit in settings.limits},
        variables={a.name: (a.low, a.high) for a in study.axes if a.name in settings.variables},
        fixed=fixed,
        population=settings.population,
        generations=settings.generations,
        seed=settings.seed,
        designs_tried=settings.population * settings.generations,
        designs_feasible=len(designs),
        front=tuple(_row(designs[i]) for i in front(goals)),
    )


def _row(design: Design) -> Mapping[str, float | None]:
    """Give variables and quantities of a design, None for a quantity that is not finite."""
    quantities = {name: v if np.isfinite(v) else None for name, v in design.quantities.items()}
    return {**design.values, **quantities}
