"""Preloads that were exchanged between two sidecars: with them put back, the baseline alone explains the records."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from pathlib import Path

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.records.record import Record
from validation.tracing.baseline.known_rig import KnownRigProblem, known_rig_problem
from validation.tracing.fitting import Fitted, Model, fit
from validation.tracing.fitting.evidence import nothing_to_explain, significant_ratio
from validation.tracing.search.restarts import best_of_other_loops
from validation.tracing.search.search import Search
from validation.tracing.settings import FEW_STEPS, SAME_PRELOAD, SIGNIFICANT_LOOSE

MOST_PAIRS = 6
"""Pairs of records whose preloads are exchanged at most: each is a fit of the baseline."""


def exchanged_words(search: Search, baseline: Fitted) -> str | None:
    """Say which two records fit to the noise with each other's preload; None where no pair does, or none is needed.

    An effect of the catalogue has at least one parameter more, so that it is the less likely explanation.
    """
    problem = search.problem
    if not isinstance(problem, KnownRigProblem) or nothing_to_explain(baseline, search.policy):
        return None
    records = [one.record for one in problem.records]
    most = max(SIGNIFICANT_LOOSE, significant_ratio(baseline, search.policy))
    pairs = [(a, b) for a, b in combinations(range(len(records)), 2) if _differ(records[a], records[b])]
    for a, b in pairs if len(pairs) <= MOST_PAIRS else ():
        found = _with_exchanged(search, baseline, records, a, b)
        if found is not None and found.rmse_deg <= most * found.noise.deg:
            names = " and ".join(Path(records[k].source).name or f"record {k + 1}" for k in (a, b))
            return (
                f"with the preloads of {names} exchanged ({records[a].rig['preload_N']:g} and "
                f"{records[b].rig['preload_N']:g} N) the rig as declared fits to {found.rmse_deg:.2g} deg: compare "
                "their sidecars with the bench"
            )
    return None


def _differ(one: Record, other: Record) -> bool:
    """Whether two records state preloads of their own that differ."""
    if "preload_N" not in one.rig or "preload_N" not in other.rig:
        return False
    low, high = sorted((float(one.rig["preload_N"]), float(other.rig["preload_N"])))
    return high > (1 + SAME_PRELOAD) * low


def _with_exchanged(
    search: Search, baseline: Fitted, records: Sequence[Record], first: int, second: int
) -> Fitted | None:
    """Fit the baseline to records two of which have each other's preload; None where it fits no better at once."""
    own = [one.rig for one in records]
    own[first], own[second] = (
        {**own[one], "preload_N": own[other]["preload_N"]} for one, other in ((first, second), (second, first))
    )
    with suppress(SolverError, RigError):
        problem = known_rig_problem([replace(one, rig=rig) for one, rig in zip(records, own, strict=True)])
        if problem is not None:
            model = Model(problem)
            search.report("the baseline model, preloads exchanged", 0)
            start = model.coordinates(problem.start, [])
            few = fit(model, baseline.holdout, start, threads=search.threads, most_steps=FEW_STEPS)
            if few.square < baseline.square:
                found = fit(model, baseline.holdout, few.x, threads=search.threads)
                return best_of_other_loops(replace(search, problem=problem, _forms={}), found)
    return None
