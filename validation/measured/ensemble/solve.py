"""The three constants that follow from the three numbers of the facts, once all others are chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.ensemble import with_constants
from hysteresis.arrays import Floats
from validation.measured.ensemble.facts import Facts, facts_of
from validation.measured.ensemble.priors import Model, Prior

START = {
    "tendon.EA_N": 17_000.0,
    "tendon.toe_N": 40.0,
    "friction.sheath_N": 1.4,
    "backlash.width_mm": 0.3,
}
"""Where every search begins, so that it depends on nothing but the constants that were chosen."""
COARSE_MM, PAPER_MM = 0.2, 0.1
"""Steps of the drive that a search begins and ends with."""
_STEP = 1e-3  # of finite differences of the logarithms
_LONGEST = 0.7  # step of a logarithm
_MARGIN = 1.0  # beyond the bounds of a prior, of a logarithm, that a search may go
_CLOSE_DEG = 5e-4
_ITERATIONS = 14


@dataclass(frozen=True)
class Solved:
    """Solved constants by name, and |d numbers/d ln constants|, deg^3, at the solution."""

    constants: dict[str, float]
    facts: Facts
    determinant: float


class _Search:
    """Numbers of the facts, as a function of the logarithms of three constants; keeps the last facts."""

    def __init__(self, rig: Rig, names: tuple[str, str, str], goal: Facts) -> None:
        self.rig, self.names, self.goal = rig, names, goal
        self.facts, self.step_mm = goal, COARSE_MM

    def off(self, z: Floats) -> Floats:
        """Numbers minus those of the goal, deg; NaN where the rig cannot follow the drive."""
        try:
            values = dict(zip(self.names, np.exp(z).tolist(), strict=True))
            self.facts = facts_of(with_constants(self.rig, values), self.step_mm)
        except (SolverError, RigError):
            return np.full(3, np.nan)
        return np.asarray(self.facts.numbers - self.goal.numbers)

    def jacobian(self, z: Floats, at: Floats) -> Floats:
        """Forward differences, deg per unit of the logarithm, shape (3, 3)."""
        return np.column_stack([(self.off(z + _STEP * one) - at) / _STEP for one in np.eye(3)])


def solve_constants(base: Rig, chosen: Mapping[str, float], model: Model, goal: Facts) -> Solved | None:
    """Find the solved constants of a model so that a rig shows the numbers of ``goal``, by Broyden's method.

    Returns
    -------
    Solved or None
        None where there is no such rig within the bounds of the priors.
    """
    try:
        rig = with_constants(base, {**chosen, **{name: START[name] for name in model.solved}})
    except RigError:
        return None
    search = _Search(rig, model.solved, goal)
    bounds = _bounds([model.priors[name] for name in model.solved])
    z = _root(search, np.log([START[name] for name in model.solved]), bounds)
    if z is None:
        return None
    constants = dict(zip(model.solved, np.exp(z).tolist(), strict=True))
    if not all(np.isfinite(model.priors[name].log_density_per_log(value)) for name, value in constants.items()):
        return None
    off = search.off(z)
    facts = search.facts
    determinant = abs(float(np.linalg.det(search.jacobian(z, off))))
    if not np.isfinite(determinant) or determinant < 1e-9:
        return None
    return Solved(constants, facts, determinant)


def _bounds(priors: list[Prior]) -> tuple[Floats, Floats]:
    low, high = np.log([[p.low, p.high] for p in priors]).T
    return low - _MARGIN, high + _MARGIN


def _scaled(off: Floats, goal: Facts) -> Floats:
    """Widths by their logarithms, which are nearly linear in those of the constants."""
    widths = np.array(goal.widths_deg)
    return np.append(off[0] / goal.full_scale_deg * 4, np.log(np.maximum(1 + off[1:] / widths, 1e-3)))


def _root(search: _Search, z: Floats, bounds: tuple[Floats, Floats]) -> Floats | None:
    """Solve with few samples of the drive first, then with the paper's."""
    slope: Floats | None = None
    for step_mm, close_deg in ((COARSE_MM, 10 * _CLOSE_DEG), (PAPER_MM, _CLOSE_DEG)):
        search.step_mm = step_mm
        found = _broyden(search, z, slope, bounds, close_deg)
        if found is None:
            return None
        z, slope = found
    return z


def _broyden(
    search: _Search, z: Floats, slope: Floats | None, bounds: tuple[Floats, Floats], close_deg: float
) -> tuple[Floats, Floats] | None:
    """Root and last tangent; where a step makes it much worse, the tangent is made anew once."""
    at = search.off(z)
    scaled, fresh = _scaled(at, search.goal), slope is None
    slope = _tangent(search, z, at) if slope is None else slope
    for _ in range(_ITERATIONS):
        if not (np.isfinite(scaled).all() and np.isfinite(slope).all()):
            return None
        if np.abs(at).max() < close_deg:
            return z, slope
        step = -np.linalg.lstsq(slope, scaled, rcond=1e-9)[0]
        step *= min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-12))
        trial = np.clip(z + step, *bounds)
        move = trial - z
        if not move.any():
            return None
        off = search.off(trial)
        now = _scaled(off, search.goal)
        if not np.linalg.norm(now) <= 1.5 * np.linalg.norm(scaled):
            if fresh:
                return None
            slope, fresh = _tangent(search, z, at), True
            continue
        slope = slope + np.outer(now - scaled - slope @ move, move) / float(move @ move)
        z, at, scaled, fresh = trial, off, now, False
    return None


def _tangent(search: _Search, z: Floats, at: Floats) -> Floats:
    """Jacobian of the scaled numbers, shape (3, 3)."""
    here = _scaled(at, search.goal)
    return np.column_stack([(_scaled(search.off(z + _STEP * one), search.goal) - here) / _STEP for one in np.eye(3)])
