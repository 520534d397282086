"""The reachable tip set of a wrist in space, with friction and without, and what force moves the tip by how much."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.checks import require
from fem_models.rig.rig import Friction
from fem_models.spatial.drives import WheelProgram, round_axes
from fem_models.spatial.motion.steps import Equilibrium, at_rest, moved_to
from fem_models.spatial.rig import of_rig_in_space
from fem_models.spatial.solve import SpatialSolution, solve_spatial
from fem_models.spatial.tables import ELEMENTS, SLIP
from hysteresis.arrays import Floats

STUCK = 1e6
"""Factor of the limits of friction and of the loop where all shall stick."""


@dataclass(frozen=True, eq=False)
class Workspace:
    """Tips for drives on circles of all w wheels: k circles, d directions. One wheel has a curve: k is 1.

    Parameters
    ----------
    wheels_mm
        Shape (k, d, w).
    smooth_mm, smooth_deg
        Tip, shape (k, d, 3), and bending, (k, d, 2), of the wrist without friction and without a loop of the material.
    forth_mm, back_mm, forth_deg, back_deg
        The same with both, the wheels going round from the first axis to the second one, and back; on a curve up, and
        down.
    least_tension_N, largest_tension_N
        At the wheels, with friction.
    """

    wheels_mm: Floats
    smooth_mm: Floats
    smooth_deg: Floats
    forth_mm: Floats
    forth_deg: Floats
    back_mm: Floats
    back_deg: Floats
    least_tension_N: float
    largest_tension_N: float

    @property
    def is_curve(self) -> bool:
        """Whether the tip reaches a curve, of one wheel, in place of an area."""
        return self.wheels_mm.shape[2] == 1

    @property
    def spread_mm(self) -> Floats:
        """Distance of the tips that the same drives reach on the way forth and back, shape (k, d)."""
        return np.asarray(np.linalg.norm(self.forth_mm - self.back_mm, axis=2))

    def area_mm2(self, tip_mm: Floats) -> float:
        """Area that the tip reaches, seen along the tube: that within the outermost circle (shoelace formula).

        Of circles, not of a curve.
        """
        y, z = tip_mm[-1, :, 1], tip_mm[-1, :, 2]
        return 0.5 * abs(float(y @ np.roll(z, -1) - z @ np.roll(y, -1)))

    def length_mm(self, tip_mm: Floats) -> float:
        """Length of a curve of tips."""
        return float(np.linalg.norm(np.diff(tip_mm[-1], axis=0), axis=1).sum())


def workspace(
    rig: Rig,
    amplitude_mm: float,
    *,
    circles: int = 4,
    directions: int = 36,
    progress: Callable[[int, int], None] | None = None,
) -> Workspace:
    """Find the tips for drives on circles of all wheels, up to an amplitude (:func:`round_axes`).

    Each circle starts from rest. The wheels go once round before the tips are taken, so that friction has its
    direction, then once forth and once back. One wheel goes from end to end in place of that, with as many samples as
    there are directions; a wheel with one tendon from rest to the amplitude.

    Raises
    ------
    RigError
        An argument out of its range, a notch that closes.
    SolverError
        A drive without equilibrium.
    """
    require(math.isfinite(amplitude_mm) and amplitude_mm > 0, "amplitude", amplitude_mm, "above 0")
    require(1 <= circles <= 100, "circles", circles, "from 1 to 100")
    require(8 <= directions <= 360, "directions", directions, "from 8 to 360")
    one_wheel = rig.wheel_count == 1
    rings = _curve(rig, amplitude_mm, directions) if one_wheel else _circles(rig, amplitude_mm, circles, directions)
    parts, tensions = list[tuple[SpatialSolution, SpatialSolution]](), list[tuple[float, float]]()
    for k, ring in enumerate(rings):
        way, forth, back = _way(ring)
        friction, smooth = (_run(one, way) for one in (rig, smooth_rig(rig)))
        parts.append((friction, smooth))
        pulls = friction.tensions_N[:, :, 0]
        tensions.append((float(pulls.min()), float(pulls.max())))
        if progress is not None:
            progress(k + 1, len(rings))
    runs, smooth_runs = zip(*parts, strict=True)
    return Workspace(
        wheels_mm=rings,
        smooth_mm=np.array([run.tip_mm[forth] for run in smooth_runs]),
        smooth_deg=np.array([run.bending_deg[forth] for run in smooth_runs]),
        forth_mm=np.array([run.tip_mm[forth] for run in runs]),
        forth_deg=np.array([run.bending_deg[forth] for run in runs]),
        back_mm=np.array([run.tip_mm[back][::-1] for run in runs]),
        back_deg=np.array([run.bending_deg[back][::-1] for run in runs]),
        least_tension_N=min(low for low, _ in tensions),
        largest_tension_N=max(high for _, high in tensions),
    )


def _way(ring: Floats) -> tuple[Floats, slice, slice]:
    """Drives from rest on over a circle or a curve, shape (d, w), and the parts of them that are looked at."""
    d = len(ring)
    if ring.shape[1] > 1:  # out, round, round again, and back twice
        way = np.concatenate([0 * ring[:1], ring, ring, ring[:1], ring[::-1], ring[::-1]])
        return way, slice(1 + d, 1 + 2 * d), slice(2 + 3 * d, 2 + 4 * d)
    way = np.concatenate([0 * ring[:1], ring[::-1], ring, ring[::-1]])  # to one end, down, up, and down
    return way, slice(1 + d, 1 + 2 * d), slice(1 + 2 * d, 1 + 3 * d)


def _circles(rig: Rig, amplitude_mm: float, circles: int, directions: int) -> Floats:
    """Drives of all wheels, shape (circles, directions, wheels)."""
    turn = 2 * math.pi * np.arange(directions) / directions
    unit = np.column_stack([np.cos(turn), np.sin(turn)]) @ round_axes(rig)
    return np.array([amplitude_mm * (k + 1) / circles * unit for k in range(circles)])


def _curve(rig: Rig, amplitude_mm: float, samples: int) -> Floats:
    """Drives of one wheel, rising, shape (1, samples, 1)."""
    low = -amplitude_mm if rig.winds_both_ways(1) else 0.0
    return np.linspace(low, amplitude_mm, samples)[None, :, None]


def smooth_rig(rig: Rig) -> Rig:
    """Return the rig without friction and without a loop of the material: its tip is a function of the drives."""
    return replace(rig, friction=Friction(), material=replace(rig.material, loop_share=0.0))


def _run(rig: Rig, wheels_mm: Floats) -> SpatialSolution:
    return solve_spatial(of_rig_in_space(rig), WheelProgram(wheels_mm).of_tendons(rig))


@dataclass(frozen=True, eq=False)
class TipCompliance:
    """Motion of the tip for a force on it, wheels held, mm/N: shape (3, 3), x along the straight tube, y, z.

    Parameters
    ----------
    wheels_mm
        Shape (w,), where it was taken.
    held
        All guides stick, and so do the elements of the material: the stiffest that the wrist can be.
    sliding
        Of the wrist without friction and loop with the same drives: tensions are alike along a tendon.
    """

    wheels_mm: Floats
    held: Floats
    sliding: Floats


def tip_compliance(rig: Rig, wheels_mm: Floats, *, force_N: float = 1e-3) -> TipCompliance:
    """Find the compliance of the tip where the wheels have gone straight from rest, by small forces either way.

    Raises
    ------
    RigError
        Another number of drives than the rig has wheels.
    SolverError
        A step without equilibrium.
    """
    wheels = np.array(wheels_mm, dtype=float)
    require(wheels.shape == (rig.wheel_count,), "wheels_mm", f"shape {wheels.shape}", f"{rig.wheel_count} drives")
    drives = wheels @ rig.winding()
    held, free = (moved_to(at_rest(of_rig_in_space(one)), drives) for one in (rig, smooth_rig(rig)))
    return TipCompliance(wheels, _slopes(_stuck(held), force_N), _slopes(free, force_N))


def _stuck(at: Equilibrium) -> Equilibrium:
    """Raise all limits of dry elements: what they carry now they go on carrying."""
    joints = at.parameters.joints.copy()
    joints[:, SLIP : SLIP + 2 * ELEMENTS] *= STUCK
    limit = STUCK * at.parameters.scale
    return replace(at, parameters=at.parameters._replace(joints=joints, guide=limit))


def _slopes(at: Equilibrium, force_N: float) -> Floats:
    base = np.array(at.parameters.tip)
    tips = [[moved_to(at, at.drives, base + sign * force).tip_mm for sign in (1, -1)] for force in force_N * np.eye(3)]
    return np.column_stack([(ahead - behind) / (2 * force_N) for ahead, behind in tips])
