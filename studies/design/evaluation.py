"""A tube against its requirements: geometry first, the chain where geometry does not refuse it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from studies.design.measure import Use, Wire, measure
from studies.design.quantities import Measured
from studies.design.requirement import Requirements
from studies.design.space import Candidate, Space
from studies.design.tolerance import Tolerances

REFUSED = 10.0
"""Added to the shortfall of a tube that geometry refuses: the search takes any that was bent as the better one."""
CANNOT = "cannot be bent"
UNKNOWN = 1e3
"""Shortfall of a quantity that is not known, such as the tension at a bend that is not reached."""
STEP = 1.5
"""Standard deviations at which the influence of a tolerance is taken."""


@dataclass(frozen=True)
class Task:
    """Requirements and settings that all tubes of a search share."""

    space: Space
    requirements: Requirements
    use: Use
    tolerances: Tolerances


@dataclass(frozen=True)
class Evaluated:
    """A tube that was tried.

    ``shortfalls`` are what it misses of each requirement or of the process, over the bound; empty where it meets all.
    ``bent`` says whether the chain bent it. ``reliability`` is the margin of each requirement in standard deviations of
    what the tolerances do to it, to first order; empty where it was not asked.
    """

    candidate: Candidate
    measured: Measured
    shortfalls: Mapping[str, float]
    bent: bool
    reliability: tuple[float, ...] = ()

    @property
    def missed(self) -> float:
        """Sum of the shortfalls, what a search has to bring to 0."""
        return sum(self.shortfalls.values()) + (0.0 if self.bent else REFUSED)


def bent(rig: Rig, wire: Wire, use: Use) -> Measured | None:
    """Measure a tube; None of one that cannot be bent."""
    try:
        return measure(rig, wire, use)
    except (RigError, SolverError):
        return None


def evaluate(task: Task, candidate: Candidate) -> Evaluated:
    """Try a tube with its nominal numbers."""
    refused = task.space.shortfalls(candidate, task.requirements)
    if refused:
        return Evaluated(candidate, Measured(), refused, bent=False)
    try:
        rig = task.space.rig(candidate)
    except RigError:
        return Evaluated(candidate, Measured(), {CANNOT: 1.0}, bent=False)
    measured = bent(rig, task.space.wire(candidate), task.use)
    if measured is None:
        return Evaluated(candidate, Measured(), {CANNOT: 1.0}, bent=False)
    return Evaluated(candidate, measured, _missed(task.requirements, measured), bent=True)


def _missed(requirements: Requirements, measured: Measured) -> dict[str, float]:
    found = {}
    for one in requirements.each:
        share = one.share(measured.of(one.quantity))
        if math.isnan(share):  # what is not reached says by how much it is not: the bend does
            share = -UNKNOWN if measured.bend_deg >= requirements.bend_deg else -1.0
        if share < 0:
            found[one.quantity] = -share
    return found


def evaluate_robust(task: Task, candidate: Candidate) -> Evaluated:
    """Try a tube, and take the reliability of its requirements to first order.

    Each tolerance is moved to either side by :data:`STEP` standard deviations; the side that costs more margin counts,
    and the costs add up as independent ones do (first-order second moment).
    """
    nominal = evaluate(task, candidate)
    if nominal.shortfalls:
        return nominal
    shares = margins(task.requirements, nominal.measured)
    squares = np.zeros(len(shares))
    for k in range(len(task.tolerances.each)):
        lost = np.zeros(len(shares))
        for side in (-STEP, STEP):
            z = np.zeros(len(task.tolerances.each))
            z[k] = side
            lost = np.maximum(lost, shares - margins_drawn(task, candidate, z))
        squares += (np.minimum(lost, UNKNOWN) / STEP) ** 2
    spread = np.sqrt(squares)
    beta = [share / sd if sd > 0 else math.inf for share, sd in zip(shares.tolist(), spread.tolist(), strict=True)]
    return Evaluated(candidate, nominal.measured, {}, bent=True, reliability=tuple(beta))


def margins(requirements: Requirements, measured: Measured | None) -> Floats:
    """Margins over their bounds, shape (requirements,), negative where one is missed; all -1 where nothing is known."""
    if measured is None:
        return np.full(len(requirements.each), -1.0)
    shares = np.array([one.share(measured.of(one.quantity)) for one in requirements.each])
    return np.where(np.isnan(shares), -1.0, shares)


def margins_drawn(task: Task, candidate: Candidate, z: Floats) -> Floats:
    """Margins of the tube that a draw of the tolerances makes, shape (requirements,)."""
    try:
        rig = task.tolerances.drawn(task.space.rig(candidate), z)
    except RigError:
        return margins(task.requirements, None)
    return margins(task.requirements, bent(rig, task.space.wire(candidate), task.use))
