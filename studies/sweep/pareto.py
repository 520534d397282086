"""Designs that no other beats: NSGA-II (doi 10.1109/4235.996017, as in pymoo) over the ranges of a study's axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.termination import get_termination
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from hysteresis.arrays import Floats
from studies.sweep.cases import QUANTITIES, Outcome, StudyError
from studies.sweep.plan import on_axes
from studies.sweep.study_file import Axis, Limit, Pareto, Study

Evaluate = Callable[[list[Mapping[str, float]]], Sequence[Outcome | None]]
_WORST = 1e30  # of a case that failed: it is out by its constraint anyway, but the search wants numbers


def pareto(study: Study, evaluate: Evaluate) -> dict[str, Any]:
    """Contents of ``pareto.json``: the front of all designs that were tried and keep their limits.

    A design is left out where another is at least as good in all objectives and better in one. Axes that are not
    variables of the search stay at the middle of their range.

    Raises
    ------
    StudyError
        No design that keeps the limits.
    """
    assert study.pareto is not None
    asked = study.pareto
    axes = [axis for axis in study.axes if axis.name in asked.variables]
    fixed = {axis.name: _middle(axis) for axis in study.axes if axis.name not in asked.variables}
    tried = dict[tuple[float, ...], dict[str, Any]]()
    search = NSGA2(pop_size=asked.population)
    size = {"n_obj": len(asked.objectives), "n_ieq_constr": 1 + len(_bounds(asked.limits))}
    search.setup(
        Problem(n_var=len(axes), xl=np.zeros(len(axes)), xu=np.ones(len(axes)), **size),
        termination=get_termination("n_gen", asked.generations), seed=asked.seed, verbose=False,
    )  # fmt: skip
    while search.has_next():
        population = search.ask()
        rows = on_axes(axes, np.asarray(population.get("X"), dtype=float))
        points = [dict(zip([a.name for a in axes], row.tolist(), strict=True)) for row in rows]
        found = list(evaluate([{**fixed, **point} for point in points]))
        scores = [_scored(asked, outcome) for outcome in found]
        population.set("F", np.array([f for f, _ in scores]), "G", np.array([g for _, g in scores]))
        # told to the search without a further evaluation
        for individual in population:
            individual.evaluated.update({"F", "G", "H"})
        search.tell(infills=population)
        for point, outcome, (_, violations) in zip(points, found, scores, strict=True):
            if outcome is not None and max(violations) <= 0:
                tried[tuple(point.values())] = {"values": point, "quantities": outcome.quantities}
    return _result(study, asked, fixed, tried)


def _middle(axis: Axis) -> float:
    middle = 0.5 * (axis.low + axis.high)
    return float(round(middle)) if axis.whole else middle


def _bounds(limits: Sequence[Limit]) -> list[tuple[str, float, float]]:
    """Limits as (quantity, sign, bound): sign (value - bound) <= 0."""
    return [
        (limit.quantity, sign, bound)
        for limit in limits
        for sign, bound in ((-1.0, limit.low), (1.0, limit.high))
        if bound is not None
    ]


def _scored(asked: Pareto, outcome: Outcome | None) -> tuple[list[float], list[float]]:
    """Objectives, all to be minimised, and constraints, kept where at most 0; the first is that the case is well."""
    bounds = _bounds(asked.limits)
    if outcome is None or outcome.status != "ok":
        return [_WORST] * len(asked.objectives), [1.0] + [_WORST] * len(bounds)
    q = outcome.quantities
    goals = [q[name] * (1 if goal == "min" else -1) for name, goal in asked.objectives]
    kept = [sign * (q[name] - bound) for name, sign, bound in bounds]
    if not np.isfinite([*goals, *kept]).all():
        return [_WORST] * len(goals), [1.0] + [_WORST] * len(bounds)
    return goals, [0.0, *kept]


def front(goals: Floats) -> NDArray[np.int64]:
    """Rows of (n, objectives), all to be minimised, that no other row dominates."""
    return np.sort(np.asarray(NonDominatedSorting().do(goals, only_non_dominated_front=True), dtype=np.int64))


def _result(
    study: Study, asked: Pareto, fixed: Mapping[str, float], tried: Mapping[tuple[float, ...], dict[str, Any]]
) -> dict[str, Any]:
    if not tried:
        raise StudyError(f"{study.path}: pareto.limits: no design keeps them: expected wider limits or ranges")
    designs = [tried[key] for key in sorted(tried)]
    signs = np.array([1.0 if goal == "min" else -1.0 for _, goal in asked.objectives])
    goals = signs * np.array([[d["quantities"][name] for name, _ in asked.objectives] for d in designs])
    return {
        "schema": 1,
        "engine": study.engine,
        "objectives": {n: {"goal": goal, "units": QUANTITIES[n].units} for n, goal in asked.objectives},
        "limits": {limit.quantity: {"min": limit.low, "max": limit.high} for limit in asked.limits},
        "variables": {a.name: [a.low, a.high] for a in study.axes if a.name in asked.variables},
        "fixed": dict(fixed),
        "population": asked.population,
        "generations": asked.generations,
        "seed": asked.seed,
        "designs_tried": asked.population * asked.generations,
        "designs_feasible": len(designs),
        "front": [
            designs[i]["values"]
            | {name: None if not np.isfinite(v) else v for name, v in designs[i]["quantities"].items()}
            for i in front(goals)
        ],
    }
