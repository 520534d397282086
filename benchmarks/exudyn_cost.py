"""Where the multibody model spends its time: counts and timers of Exudyn's static solver itself."""

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
    """Count what the static solver does inside the block; its timers cost a few percent."""
    cost, solve = Cost(), exu.MainSystem.SolveStatic

    def solve_and_count(mbs: Any, settings: Any, *args: Any, **kwargs: Any) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # its successor prints as well
            settings.displayComputationTime = True
        ok = False
        try:
            ok = bool(solve(mbs, settings, *args, **kwargs))
        finally:
            solver = mbs.sys["staticSolver"]
            cost.solved, cost.failed = cost.solved + ok, cost.failed + (not ok)
            cost.newton += solver.it.newtonStepsCount
            if solver.timer.total > 0:  # a solve that failed may leave its timers running backwards
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
