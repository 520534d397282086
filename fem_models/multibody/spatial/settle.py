"""Which guides slide and which segments are slack, found within one step of Newton's method.

Rings, flexures and the paths of tendons are linear in such a step; guides stick or slide, and segments are taut or
slack. While the limits of friction stay, its end is the least of a convex function that is quadratic in pieces, and the
search goes down it, as in :mod:`fem_models.spatial.kernels.settle`. Rings are condensed for one set of taut segments at
a time; here the equations are dense.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import lu_factor, lu_solve
from scipy.optimize import brentq

from hysteresis.arrays import Floats, Mask

TURNS = 40  # how often guides and segments change in one step, at most
LEVEL = 1e-4  # of the slope at the start of a step: where the search along it ends
SLACK = 1e-8  # stiffness of slack tendon over that of taut one: next to no force, and a direction for the search


class Condensed(NamedTuple):
    """Slopes in the slips with one set of taut segments, the rings in their places."""

    factors: Any  # of the tangent of the rings
    follow: Floats  # (r, g): step of the rings
    pulls: Floats  # (m (N + 1), g): tensions as if all were taut


class Tangent:
    """Slopes of what acts at some coordinates, of m tendons and N joints: r unknowns of rings, g = m N guides.

    The m (N + 1) tensions are, tendon by tendon, that between wheel and base and those over the notches. ``bare`` is
    the tangent of the rings without tendons.
    """

    def __init__(self, rings: Floats, paths: Floats, stiff: Floats, taut: Mask) -> None:
        """Take the tangent of the rings, shape (r, r), as some segments are taut, shape (m, N).

        ``paths``, shape (m N, r), are slopes of the lengths over the notches, ``stiff`` (m N,) the stiffnesses.
        """
        (m, n), self.stiff, self.drives = taut.shape, stiff, np.arange(taut.shape[0]) * (taut.shape[1] + 1)
        self.over = np.delete(np.arange(m * (n + 1)), self.drives)  # tensions over notches
        self.paths, self.shape = paths, (m, n)
        self.bare = rings + (paths.T * (parts_of(taut).ravel() * stiff)) @ paths
        self.slides = np.zeros((m * (n + 1), m * n))  # stretch by slips
        guide = np.arange(m * n).reshape(m, n)
        self.slides[self.drives, guide[:, 0]] = -1.0
        self.slides[self.over, guide.ravel()] = 1.0
        self.slides[self.over.reshape(m, n)[:, :-1].ravel(), guide[:, 1:].ravel()] = -1.0
        self.known: dict[bytes, Condensed] = {}

    def condensed(self, taut: Mask) -> Condensed:
        """Let the rings follow the slips, with segments that are taut, shape (m N,)."""
        key = taut.tobytes()
        if key not in self.known:
            weighed = self.paths.T * (parts_of(taut) * self.stiff)
            factors = lu_factor(self.bare - weighed @ self.paths, check_finite=False)
            slides = self.slides[self.over]
            follow = lu_solve(factors, weighed @ slides, check_finite=False)
            pulls = np.zeros_like(self.slides)
            pulls[self.over] = self.stiff[:, None] * (slides + self.paths @ follow)
            self.known[key] = Condensed(factors, follow, pulls)
        return self.known[key]


def parts_of(taut: Mask) -> Floats:
    """Parts of their stiffness that tendons have."""
    return np.where(taut, 1.0, SLACK)


class Guides(NamedTuple):
    """What acts where a step starts, and the laws of friction; shapes (g,) but for the rings and tensions."""

    rings: Floats  # (r,): what is out of balance, without tensions over notches
    tension: Floats  # (m (N + 1),): as if all were taut
    free: Floats  # (m,): stiffness between wheel and base
    force: Floats  # of bristles that stick
    bristle: Floats
    limit: Floats  # where no tendon has tension
    ratio: Floats  # slope of the limit in the sum of the tensions before and beyond
    viscous: Floats
    drag: float
    open: Floats  # stiffness that a guide has even where it slides


class Point(NamedTuple):
    """A step of rings and slips, and what acts at its end."""

    rings: Floats
    slips: Floats
    tension: Floats  # as if all were taut
    force: Floats  # of bristles that stick
    limit: Floats


class Step:
    """One step of Newton's method from where ``guides`` are."""

    def __init__(self, tangent: Tangent, guides: Guides) -> None:
        self.tangent, self.guides = tangent, guides

    def pairs(self, tension: Floats) -> tuple[Floats, Floats]:
        """Tensions, shape (m (N + 1), ...), before and beyond each guide, shapes (g, ...)."""
        m, n = self.tangent.shape
        rows = tension.reshape(m, n + 1, *tension.shape[1:])
        return rows[:, :-1].reshape(m * n, *tension.shape[1:]), rows[:, 1:].reshape(m * n, *tension.shape[1:])

    def point(self, rings: Floats, slips: Floats) -> Point:
        """Work out what acts after a step."""
        tangent, guides = self.tangent, self.guides
        stretch = tangent.slides @ slips
        tension = guides.tension.copy()
        tension[tangent.over] += tangent.stiff * (stretch[tangent.over] + tangent.paths @ rings)
        tension[tangent.drives] += guides.free * stretch[tangent.drives]
        before, beyond = self.pairs(np.maximum(tension, 0.0))
        force, limit = guides.force + guides.bristle * slips, guides.limit + guides.ratio * (before + beyond)
        return Point(rings, slips, tension, force, limit)

    def solve(self, state: Floats, taut: Mask) -> Point:
        """Find where guides in their states lead to, and tendons that are taut or not, shape (m (N + 1),)."""
        tangent, guides = self.tangent, self.guides
        own = tangent.condensed(taut[tangent.over])
        part = parts_of(taut)
        acting = guides.rings - tangent.paths.T @ (part * guides.tension)[tangent.over]
        ahead = -lu_solve(own.factors, acting, check_finite=False)
        tension, pulls = guides.tension.copy(), own.pulls.copy()
        tension[tangent.over] += tangent.stiff * (tangent.paths @ ahead)
        pulls[tangent.drives] = guides.free[:, None] * tangent.slides[tangent.drives]
        before, beyond = self.pairs(part * tension)
        before_slope, beyond_slope = self.pairs(part[:, None] * pulls)
        pressing = sum(self.pairs(taut * tension)), sum(self.pairs(taut[:, None] * pulls))
        by_sum = state * guides.ratio
        matrix = before_slope - beyond_slope - by_sum[:, None] * pressing[1]
        matrix[np.diag_indices_from(matrix)] -= np.where(state == 0.0, guides.bristle, guides.open) + guides.drag
        held = np.where(state == 0.0, guides.force, state * guides.limit + by_sum * pressing[0])
        slips = np.asarray(np.linalg.solve(matrix, held - (before - beyond - guides.viscous)), dtype=float)
        return self.point(ahead + own.follow @ slips, slips)

    def part_down(self, start: Point, end: Point) -> float:
        """Part of the way from a point to another that leads down, to where the slope changes its sign.

        Slack tendon makes steps a thousand times as long as those that bristles allow: the part may be small.
        """
        tangent, guides = self.tangent, self.guides
        rings, slips = end.rings - start.rings, end.slips - start.slips
        stretch = tangent.slides @ slips
        stretch[tangent.over] += tangent.paths @ rings
        here = rings @ (guides.rings + tangent.bare @ start.rings) - slips @ (
            guides.viscous + guides.drag * start.slips
        )
        climb = rings @ (tangent.bare @ rings) - guides.drag * (slips @ slips)
        pairs = tuple(zip(start[2:], end[2:], strict=True))

        def slope(part: float) -> float:
            tension, force, limit = (a + part * (b - a) for a, b in pairs)
            tension = np.where(tension > 0.0, tension, SLACK * tension)
            return float(stretch @ tension + slips @ np.clip(force, -limit, limit) - here - part * climb)

        first = slope(0.0)
        if first >= 0.0 or slope(1.0) <= -LEVEL * first:
            return 1.0
        return float(brentq(slope, 0.0, 1.0, xtol=1e-18, maxiter=200, disp=False))


def next_states(state: Floats, force: Floats, limit: Floats, tolerance: float) -> Floats:
    """States by the forces; a guide that slides sticks before it slides in the other direction."""
    loose = np.where(np.abs(force) > limit + tolerance, np.sign(force), 0.0)
    return np.where(state == 0.0, loose, np.where(force * state < limit - tolerance, 0.0, state))


def settle(step: Step, state: Floats, taut: Mask, tolerance: float) -> tuple[Point, Floats]:
    """Change states, shape (g,), and taut tendons, until they agree with the end of the step; returns it and states.

    Where they do not, the step ends at the lowest point.
    """
    kept: Point | None = None
    for _ in range(TURNS):
        end = step.solve(state, taut)
        pulls = np.where(taut, end.tension > -tolerance, end.tension > tolerance)
        if np.array_equal(pulls, taut) and np.array_equal(next_states(state, end.force, end.limit, tolerance), state):
            return end, state
        if kept is None:
            kept = end
        else:
            part, last = step.part_down(kept, end), kept
            kept = (
                end
                if part == 1.0
                else step.point(
                    last.rings + part * (end.rings - last.rings), last.slips + part * (end.slips - last.slips)
                )
            )
        state = np.where(np.abs(kept.force) > kept.limit, np.sign(kept.force), 0.0)
        taut = kept.tension > 0.0
    assert kept is not None
    return kept, state
