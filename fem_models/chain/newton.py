"""One equilibrium of the chain by Newton's method, compiled. See :mod:`fem_models.chain.solve`.

Each guide has a state, stuck or sliding in one direction, that a Newton step keeps: within it everything is smooth.
States follow from the forces between the steps: a primal-dual active set (Hintermueller, Ito and Kunisch 2002, doi
10.1137/S1052623401383558), except that a guide sticks before it slides in the other direction.
"""

from __future__ import annotations

from typing import NamedTuple

from fem_models.chain.compiled import chain_njit
from fem_models.chain.equations import BAND, Balance, Pace, Work, balance_at, copy, fill_tangent
from fem_models.chain.parameters import Memory, Parameters
from fem_models.chain.sweep import sweep
from fem_models.load.stepping import Load
from hysteresis.arrays import Floats

LARGEST_ROTATION = 0.02  # rad of a joint in a step of Newton's method, lest tendons fall slack meanwhile

FULL_STEPS = 15  # later ones are halved where fibres transform: they may alternate between branches


class Attempt(NamedTuple):
    """A step from the last equilibrium to a load, as Newton's method tries it."""

    load: Load
    pace: Pace
    iterations: int
    fine: bool  # a step that is not may not let a tendon begin to slide at the base


@chain_njit(error_model="python")  # a zero pivot raises ZeroDivisionError
def eliminate(a: Floats, b: Floats, z: Floats, both: bool, reach: int) -> None:
    """Solve the band of half width ``reach`` for b, and for z if ``both``, in place, without pivoting; a is lost."""
    n = b.size
    for i in range(n):
        pivot = 1.0 / a[i, BAND]
        for r in range(i + 1, min(i + reach + 1, n)):
            factor = a[r, i - r + BAND] * pivot
            if factor != 0.0:
                for k in range(1, min(reach, n - 1 - i) + 1):
                    a[r, i + k - r + BAND] -= factor * a[i, BAND + k]
                b[r] -= factor * b[i]
                if both:
                    z[r] -= factor * z[i]
    for i in range(n - 1, -1, -1):
        total, second = b[i], z[i]
        for k in range(1, min(reach, n - 1 - i) + 1):
            total -= a[i, BAND + k] * b[i + k]
            if both:
                second -= a[i, BAND + k] * z[i + k]
        b[i] = total / a[i, BAND]
        if both:
            z[i] = second / a[i, BAND]


@chain_njit(error_model="python")
def eliminate_outside(x: Floats, work: Work, balance: Balance) -> None:
    """Solve the tangent at x for the residuals, in place, where there are loads from outside.

    A touched tip stop adds k l l^T to the tangent, l being the tip's levers: Sherman-Morrison with a second solution.
    """
    b, lever, z, touched = work.residual, work.lever, work.behind, balance.stop_stiffness > 0.0
    fill_tangent(x, work, balance)
    if touched:
        copy(lever, z)
    eliminate(work.tangent, b, z, touched, BAND)
    if touched:
        by_b = by_z = 0.0
        for i in range(x.size):
            by_b += lever[i] * b[i]
            by_z += lever[i] * z[i]
        scale = balance.stop_stiffness * by_b / (1.0 + balance.stop_stiffness * by_z)
        for i in range(x.size):
            b[i] -= scale * z[i]
    for i in range(x.size - 3, 3, -3):  # joints from headings
        b[i] -= b[i - 3]


@chain_njit()
def base_slides(before: Floats, state: Floats) -> bool:
    """Whether a tendon has begun to slide at the base, or to slide in the other direction; states (2, N)."""
    for side in range(2):  # noqa: SIM110 - compiled
        if state[side, 0] != 0.0 and state[side, 0] != before[side, 0]:
            return True
    return False


@chain_njit()
def are_numbers(values: Floats) -> bool:
    """Whether no value is NaN, which a maximum does not see."""
    total = 0.0
    for i in range(values.size):
        total += values[i]
    return total == total


@chain_njit(error_model="python")
def newton(x: Floats, rig: Parameters, memory: Memory, work: Work, before: Floats, attempt: Attempt) -> int:
    """Solve for the equilibrium from x, and return the iterations it took, or -1; x is changed in either case.

    ``before`` are the states of the guides, (2, N), at the last equilibrium. A step that is not fine is given up
    where a tendon begins to slide at the base: the work of the wheel has a corner there, and a quarter of the longest
    step keeps the balance of energies. In the first iteration the guides keep the states they come with, which x may
    not agree with yet.
    """
    b = work.residual
    for iteration in range(attempt.iterations):
        balance = balance_at(x, rig, memory, attempt.load, work, attempt.pace, iteration > 0)
        if iteration > 0 and not attempt.fine and base_slides(before, work.state):
            return -1
        if balance.largest <= rig.tolerance:
            return iteration if are_numbers(b) else -1
        if not balance.largest < 1e9 * rig.scale:
            return -1
        if balance.outside:
            eliminate_outside(x, work, balance)
        else:
            sweep(x, work, balance)
        most = 0.0
        for i in range(3, x.size, 3):
            most = max(most, abs(b[i]))
        part = min(1.0, LARGEST_ROTATION / most) if most > 0.0 else 1.0
        if iteration >= FULL_STEPS and memory.fibre_area.size > 0:
            part *= 0.5
        for i in range(x.size):
            x[i] -= part * b[i]
    return -1
