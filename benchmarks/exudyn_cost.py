"""Where the multibody model spends its time: counters and timers of Exudyn's static solver."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import exudyn as exu


@dataclass
class Cost:
    """Sums over all calls of the static solver; seconds. ``failed`` solves lead to a halved step."""

    solved: int = 0
    failed: int = 0
    newton: int = 0
    total_s: float = 0.0
    jacobian_s: float = 0.0
    factorization_s: float = 0.0
    residual_s: float = 0.0


@contextmanager
def counted() -> Iterator[Cost]:
    """Count the work of the static solver inside the block; its timers cost a few percent."""
    cost, solve = Cost(), exu.MainSystem.SolveStatic

    def solve_and_count(mbs: Any, settings: Any, *args: Any, **kwargs: Any) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # the new setting prints as well
            settings.displayComputationTime = True
        ok = False
        try:
            ok = bool(solve(mbs, settings, *args, **kwargs))
        finally:
            solver = mbs.sys["staticSolver"]
            cost.solved, cost.failed = cost.solved + ok, cost.failed + (not ok)
            cost.newton += solver.it.newtonStepsCount
            if solver.timer.total > 0:  # after a failed solve a timer may be negative
                cost.total_s += solver.timer.total
                cost.jacobian_s += solver.timer.jacobianODE2
                cost.factorization_s += solver.timer.factorization
                cost.residual_s += solver.timer.ODE2RHS
        return ok

    exu.MainSystem.SolveStatic = solve_and_count
    try:
        yield cost
    finally:
        exu.MainSystem.SolveStatic = solve
