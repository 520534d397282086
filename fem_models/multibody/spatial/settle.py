"""Which guides stick and which slide, found within one step of Newton's method, as in the chain in space.

Rings are condensed: what remains is linear in the slips but for the guides, which stick or slide. While their limits
stay, that is the least of a convex function that is quadratic in pieces, and the search goes down it. See
:mod:`fem_models.spatial.kernels.settle`; here the equations are dense.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from hysteresis.arrays import Floats

TURNS = 40  # how often guides change in one step, at most
LEVEL = 1e-4  # of the slope at the start of a step: where the search along it ends


class Guides(NamedTuple):
    """Tensions at the guides, linear in the step of the slips, shape (g,) for g guides, and the laws of their friction.

    ``net`` is the tension before a guide less that beyond it and less viscous forces, ``total`` the sum of both.
    """

    net: Floats  # where the step starts, the rings in their places
    net_slope: Floats  # (g, g)
    total: Floats  # change as the rings go to their places
    total_slope: Floats  # (g, g)
    force: Floats  # of bristles that stick
    bristle: Floats
    limit: Floats
    ratio: Floats  # slope of the limit in the sum
    open: Floats  # stiffness that a guide has even where it slides

    def at(self, step: Floats) -> tuple[Floats, Floats, Floats]:
        """Give net tensions, forces of bristles and limits after a step."""
        limit = self.limit + self.ratio * (self.total + self.total_slope @ step)
        return self.net + self.net_slope @ step, self.force + self.bristle * step, np.maximum(limit, 0.0)

    def step(self, state: Floats) -> Floats:
        """Solve with guides in their states."""
        slides = state != 0.0
        matrix = self.net_slope - (state * self.ratio)[:, None] * self.total_slope
        matrix[np.diag_indices_from(matrix)] -= np.where(slides, self.open, self.bristle)
        held = np.where(slides, state * (self.limit + self.ratio * self.total), self.force)
        return np.asarray(np.linalg.solve(matrix, held - self.net))


def next_states(state: Floats, force: Floats, limit: Floats, tolerance: float) -> Floats:
    """States by the forces; a guide that slides sticks before it slides in the other direction."""
    loose = np.where(np.abs(force) > limit + tolerance, np.sign(force), 0.0)
    return np.where(state == 0.0, loose, np.where(force * state < limit - tolerance, 0.0, state))


def settle(guides: Guides, state: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """Change states, shape (g,), until they agree with the end of the step; returns the step of the slips and them.

    Where they do not, the step ends at the lowest point.
    """
    kept = np.zeros_like(state)
    for turn in range(TURNS):
        step = guides.step(state)
        _, force, limit = guides.at(step)
        if np.array_equal(next_states(state, force, limit, tolerance), state):
            return step, state
        kept = kept + (1.0 if turn == 0 else _part_down(guides, kept, step)) * (step - kept)
        _, force, limit = guides.at(kept)
        state = np.where(np.abs(force) > limit, np.sign(force), 0.0)
    return kept, state


def _part_down(guides: Guides, start: Floats, end: Floats) -> float:
    """Part of the step that leads down, to where the slope changes its sign.

    Slack tendon makes steps a thousand times as long as those that bristles allow: the part may be small.
    """
    here, there, way = guides.at(start), guides.at(end), end - start

    def slope(part: float) -> float:
        net, force, limit = (a + part * (b - a) for a, b in zip(here, there, strict=True))
        return -float((net - np.clip(force, -limit, limit)) @ way)

    first = slope(0.0)
    if first >= 0.0 or slope(1.0) <= -LEVEL * first:
        return 1.0
    return float(brentq(slope, 0.0, 1.0, xtol=1e-18, maxiter=200, disp=False))
