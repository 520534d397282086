"""Preloads that were exchanged between two sidecars: with them put back, the baseline alone explains the records."""

from __future__ import annotations

import math
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
from validation.tracing.settings import EXPLAINED_SHARE, FEW_STEPS, SAME_PRELOAD, SIGNIFICANT_LOOSE

MOST_EXCHANGES = 6
"""Exchanges that are tried at most: each is a few steps of a fit."""


def exchanged_words(search: Search, baseline: Fitted) -> str | None:
    """Say whose preloads are exchanged, where the records then fit to the noise; None where none are, or need be.

    Exchanged are the preloads of all records of one with those of another, then those of two records. An effect of the
    catalogue has at least one parameter more, so that it is the less likely explanation.
    """
    problem = search.problem
    if not isinstance(problem, KnownRigProblem) or nothing_to_explain(baseline, search.policy):
        return None
    records = [one.record for one in problem.records]
    most = max(SIGNIFICANT_LOOSE, significant_ratio(baseline, search.policy))
    for first, second in _exchanges(records)[:MOST_EXCHANGES]:
        found = _with_exchanged(search, baseline, records, first, second)
        explains = found is not None and found.square < (1 - EXPLAINED_SHARE) * baseline.square
        if found is not None and explains and found.rmse_deg <= most * found.noise.deg:
            names = " and ".join(Path(records[k].source).name or f"record {k + 1}" for k in (*first, *second))
            preloads = " and ".join(f"{records[one[0]].rig['preload_N']:g}" for one in (first, second))
            return (
                f"with the preloads of {names} exchanged ({preloads} N) the rig as declared fits to "
                f"{found.rmse_deg:.2g} deg: compare their sidecars with the bench"
            )
    return None


def _exchanges(records: Sequence[Record]) -> list[tuple[list[int], list[int]]]:
    """Give records whose preloads may be exchanged: all of one preload with all of another, then one with another."""
    stated = [float(one.rig.get("preload_N", math.nan)) for one in records]
    groups = {value: [k for k, own in enumerate(stated) if own == value] for value in stated if value == value}

    def differ(one: float, other: float) -> bool:
        return max(one, other) > (1 + SAME_PRELOAD) * min(one, other)

    every = [(groups[a], groups[b]) for a, b in combinations(groups, 2) if differ(a, b)]
    pairs = [([a], [b]) for a, b in combinations(range(len(records)), 2) if differ(stated[a], stated[b])]
    return every + [one for one in pairs if one not in every]


def _with_exchanged(
    search: Search, baseline: Fitted, records: Sequence[Record], first: Sequence[int], second: Sequence[int]
) -> Fitted | None:
    """Fit the baseline to records that have each other's preload; None where it fits no better at once."""
    own = [one.rig for one in records]
    for these, others in ((first, second), (second, first)):
        for k in these:
            own[k] = {**own[k], "preload_N": records[others[0]].rig["preload_N"]}
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
