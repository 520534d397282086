"""Wheel motions that make the tip of a wrist follow wanted angles, with the chain in space as the model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.checks import SolverError, require
from fem_models.spatial.drives import round_axes
from fem_models.spatial.motion.steps import Equilibrium, at_rest, moved_to
from fem_models.spatial.rig import of_rig_in_space
from hysteresis.arrays import Floats

MOST_TRIALS = 80
"""Most trial steps for one sample."""
PROBES_MM = (0.02, 0.2, 0.005)
"""Changes of a wheel that show a slope, one after the other where the ones before have misled: smaller ones see tendons
that are stuck, larger ones tendons that slide."""
MOST_HALVINGS = 8
"""Of a step that does not bring the angles nearer."""
LONGEST_MM = 0.5
"""Longest correction of a wheel at once."""


@dataclass(frozen=True, eq=False)
class WheelMotion:
    """Wheel motions that were found.

    Parameters
    ----------
    wheels_mm
        Shape (s, wheels).
    bending_deg
        Shape (s, 2), that of the model with these motions.
    trials
        Steps of the model that were taken.
    """

    wheels_mm: Floats
    bending_deg: Floats
    trials: int


def compensated_wheels(
    rig: Rig,
    wanted_deg: Floats,
    *,
    tolerance_deg: float = 1e-3,
    progress: Callable[[int, int], None] | None = None,
) -> WheelMotion:
    """Find the motion of the wheels so that the bending of the tip follows wanted angles, from the rig at rest.

    Two wheels move freely. Three or four move along the axes of :func:`fem_models.spatial.drives.round_axes`: of all
    motions with the same angles, that by which no tendon pulls against another one.

    A secant method (Broyden 1965, doi 10.1090/S0025-5718-1965-0198670-6) at each sample: the wrist with its friction
    is taken from the last sample to a trial, and left as it was where the angles are off. Slopes are kept from sample
    to sample, and found again by small steps of either wheel where they mislead, as at a reversal.

    Parameters
    ----------
    wanted_deg
        Shape (s, 2), bending towards y and towards z.
    tolerance_deg
        Largest error of the angles at a sample.

    Raises
    ------
    RigError
        A rig with one wheel, angles of another shape or not finite.
    SolverError
        Angles that no motion was found for; the message has the sample.
    """
    wanted = np.array(wanted_deg, dtype=float)
    shaped = wanted.ndim == 2 and wanted.shape[1] == 2 and len(wanted) > 0
    require(shaped, "wanted_deg", f"shape {wanted.shape}", "two angles a sample")
    require(bool(np.isfinite(wanted).all()), "wanted_deg", "NaN or infinite", "finite numbers")
    require(rig.wheel_count >= 2, "wheels", f"{rig.wheel_count}", "2 to 4 of a rig whose two angles are wanted")
    axes = round_axes(rig)
    search = _Search(rig, axes @ rig.winding(), tolerance_deg)
    wheels, found = np.empty_like(wanted), np.empty_like(wanted)
    for s, angles in enumerate(wanted):
        search.go_to(angles, s)
        wheels[s], found[s] = search.wheels, search.state.bending_deg
        if progress is not None:
            progress(s + 1, len(wanted))
    return WheelMotion(wheels @ axes, found, search.trials)


class _Search:
    """Where the wrist is, and the slopes of its bending in the wheels: two of them, or two axes of more."""

    def __init__(self, rig: Rig, winding: Floats, tolerance_deg: float) -> None:
        self.winding, self.tolerance = winding, tolerance_deg
        self.state, self.wheels, self.trials = at_rest(of_rig_in_space(rig)), np.zeros(2), 0
        self.slopes = self._slopes(self.wheels, self.state, 0.2)

    def go_to(self, angles: Floats, sample: int) -> None:
        """Move the wheels until the angles are as wanted."""
        wheels, trial = self.wheels, self.state
        off = trial.bending_deg - angles
        first, probes, misled = self.trials, list(PROBES_MM), 0
        while np.abs(off).max() > self.tolerance:
            step = self._newton(off)
            if self.trials - first > MOST_TRIALS or not step.any():
                raise SolverError(
                    f"sample {sample}: no motion of the wheels found for {angles[0]:.4g}, {angles[1]:.4g} deg: "
                    f"{np.abs(off).max():.2g} deg off after {self.trials - first} trials"
                )
            step *= min(1.0, LONGEST_MM / np.abs(step).max())
            ahead, step = self._shortened(wheels, step, angles, float(np.linalg.norm(off)))
            rest = ahead.bending_deg - angles
            misled = misled + 1 if np.linalg.norm(rest) > 0.5 * np.linalg.norm(off) else 0
            self.slopes += np.outer(rest - off - self.slopes @ step, step) / (step @ step)
            if np.linalg.norm(rest) < np.linalg.norm(off):
                wheels, trial, off = wheels + step, ahead, rest
            if misled >= 2 and probes:  # a wheel that turns back finds its tendons stuck
                self.slopes, misled = self._slopes(wheels, trial, probes.pop(0)), 0
        self.wheels, self.state = wheels, trial

    def _newton(self, off: Floats) -> Floats:
        """Step by the slopes; the shortest one, 0 perhaps, where a wheel whose tendon is slack moves nothing."""
        try:
            return np.asarray(-np.linalg.solve(self.slopes, off), dtype=float)
        except np.linalg.LinAlgError:
            return np.asarray(-np.linalg.lstsq(self.slopes, off, rcond=None)[0], dtype=float)

    def _shortened(self, wheels: Floats, step: Floats, angles: Floats, off: float) -> tuple[Equilibrium, Floats]:
        """Halve a step until it brings the angles nearer: tendons that were stuck begin to slide on the way."""
        for _ in range(MOST_HALVINGS):
            ahead = self._trial(wheels + step)
            if np.linalg.norm(ahead.bending_deg - angles) < off:
                break
            step = 0.5 * step
        return ahead, step

    def _trial(self, wheels: Floats) -> Equilibrium:
        self.trials += 1
        return moved_to(self.state, wheels @ self.winding)

    def _slopes(self, wheels: Floats, at: Equilibrium, probe_mm: float) -> Floats:
        """Slopes of the angles in the wheels, deg/mm, shape (2, 2), by steps from the last sample."""
        moved = [self._trial(wheels + step).bending_deg for step in probe_mm * np.eye(2)]
        return np.column_stack([(bending - at.bending_deg) / probe_mm for bending in moved])
