"""Temperatures of the joints of an assembled rig whose superelastic sections heat themselves.

They are iterated together with the equilibrium. At the strains that Exudyn finds, each joint has the temperature of the
heat that is set free there, and the next search has the plateaus of that temperature. A spring in each joint leads it:
it has the slope by which the temperature follows the strains, without force where the search starts. So the iteration
is Newton's, and the spring carries nothing in the end. Without it, joints on a flat plateau take each other's bending.
"""

from __future__ import annotations

import numpy as np

from fem_models.joint.superelastic_section import fibre_stress, heat_exchange
from fem_models.multibody.section import SectionRow
from hysteresis.arrays import Floats

TOLERANCE_MPA = 1e-3
"""How far the plateaus of a joint may be from those that its heat leaves."""
FULL_GUESSES = 6
"""Later guesses go half the way: where fibres transform, the search may alternate between branches."""
_ITERATIONS, _SMALL_MPA, _SAME_K = 50, 1e-6, 1e-10


class JointTemperatures:
    """Temperatures above the surroundings, K, shapes (N,).

    ``last`` are those at the last equilibrium, ``now`` those that the plateaus have, ``coldest`` the lowest so far.
    The spring of a joint has the stiffness ``stiffness`` over ``weights`` times elongation and bending, shape (2, N).
    """

    def __init__(self, row: SectionRow | None, joints: int) -> None:
        self.row = row
        self.heating = None if row is None else row.law.heating
        self.last, self.now, self.coldest = np.zeros(joints), np.zeros(joints), np.zeros(joints)
        self.stiffness, self.weights = np.zeros(joints), np.zeros((2, joints))
        self.exchange, self.guesses = (0.0, 0.0), 0

    def begin(self, time_s: float) -> None:
        """Start a step of a length in time, at the temperatures of the last equilibrium."""
        if self.heating is not None:
            self.exchange = heat_exchange(time_s, self.heating.time_s)
            self.now, self.guesses = self.last, 0
            self.stiffness = np.zeros_like(self.last)  # the springs of the last search would act in this one's answer

    def shift_MPa(self, temperature_K: Floats) -> Floats:
        """Rise of the plateaus; none falls below 0 (runs that get there are refused)."""
        if self.row is None or self.heating is None:
            return np.zeros_like(temperature_K)
        least = min(self.row.law.lower, self.row.law.lower_pressed)
        return np.maximum(self.heating.rise * temperature_K, -least)

    def freed(self, strain: Floats, rest: Floats, temperature_K: Floats) -> Floats:
        """Temperatures by the heat that strains set free at plateaus of a temperature; strains of the fibres (k, N)."""
        row = self.row
        assert row is not None
        left, gained = self.exchange
        after = strain - fibre_stress(row.law, strain, rest, self.shift_MPa(temperature_K)) / row.law.young
        transformed = (row.area_mm2 * (np.abs(after) - np.abs(rest))).sum(axis=0)
        return np.asarray(left * self.last + gained * row.heat * transformed)

    def agree(self, strain: Floats, rest: Floats) -> bool:
        """Take the temperatures that strains lead to, and the springs; whether they are those of the plateaus."""
        row, heating = self.row, self.heating
        if row is None or heating is None:
            return True
        gain, warm, law = self.exchange[1] * row.heat, self.now, row.law
        for _ in range(_ITERATIONS):  # one equation a joint, whose slope hardly varies
            shift = self.shift_MPa(warm)
            near, far = (fibre_stress(law, strain, rest, shift + step) for step in (0.0, _SMALL_MPA))
            by_shift = row.area_mm2 * (far - near) / _SMALL_MPA
            slope = 1 + gain * heating.rise * np.abs(by_shift).sum(axis=0) / law.young
            off = warm - self.freed(strain, rest, warm)
            if np.abs(off).max() <= _SAME_K:
                break
            warm = warm - off / slope
        agreed = bool(heating.rise * np.abs(warm - self.now).max() <= TOLERANCE_MPA)
        if not agreed:
            part = 1.0 if self.guesses < FULL_GUESSES else 0.5
            self.now, self.guesses = self.now + part * (warm - self.now), self.guesses + 1
            self.weights = np.array([by_shift.sum(axis=0), (row.height_mm * by_shift).sum(axis=0)])
            self.stiffness = heating.rise * gain / slope / row.length_mm
        return agreed

    def accept(self, strain: Floats, rest: Floats) -> Floats:
        """Note the temperatures at an equilibrium; return by how much the plateaus have risen since the last, MPa."""
        if self.heating is None:
            return np.zeros_like(self.last)
        warmer = self.freed(strain, rest, self.now)
        risen = self.shift_MPa(warmer) - self.shift_MPa(self.last)
        self.last, self.coldest = warmer, np.minimum(self.coldest, warmer)
        return risen
