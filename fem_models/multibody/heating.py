"""Temperatures of the joints of an assembled rig whose superelastic sections heat themselves.

They are iterated together with the equilibrium. At given temperatures Exudyn finds the strains, and the heat that these
set free gives other temperatures. A joint whose temperature rises sets less heat free: its next guess is the secant
through the last two, joint by joint.
"""

from __future__ import annotations

import numpy as np

from fem_models.joint.superelastic_section import SuperelasticSection, fibre_stress, heat_exchange
from hysteresis.arrays import Floats

TOLERANCE_MPA = 1e-3
"""How far the plateaus of a joint may be from those that its heat leaves."""
STEEPEST = 50.0
"""How much less a joint heats itself per K that it is warmer, at most: bounds the secant."""


class JointTemperatures:
    """Temperatures above the surroundings, K, shapes (N,).

    ``last`` are those at the last equilibrium, ``now`` those that the plateaus have, ``coldest`` the lowest so far.
    """

    def __init__(self, section: SuperelasticSection | None, joints: int) -> None:
        self.section = section
        self.heating = None if section is None else section.heating
        self.last, self.now = np.zeros(joints), np.zeros(joints)
        self.coldest = np.zeros(joints)
        self.exchange, self.before = (0.0, 0.0), (np.zeros(joints), np.zeros(joints))

    def begin(self, time_s: float) -> None:
        """Start a step of a length in time, at the temperatures of the last equilibrium."""
        if self.heating is not None:
            self.exchange = heat_exchange(time_s, self.heating.time_s)
            self.before = self.last, np.zeros_like(self.last)
            self.now = self.last

    def shift_MPa(self, temperature_K: Floats) -> Floats:
        """Rise of the plateaus; none falls below 0 (runs that get there are refused)."""
        if self.section is None or self.heating is None:
            return np.zeros_like(temperature_K)
        least = min(self.section.lower, self.section.lower_pressed)
        return np.maximum(self.heating.rise * temperature_K, -least)

    def following(self, strain: Floats, rest: Floats) -> Floats:
        """Temperatures by the heat that strains set free at the present plateaus; strains of the fibres (k, N)."""
        section = self.section
        assert section is not None
        assert self.heating is not None
        left, gained = self.exchange
        after = strain - fibre_stress(section, strain, rest, self.shift_MPa(self.now)) / section.young
        freed = section.area_mm2 @ (np.abs(after) - np.abs(rest))
        return np.asarray(left * self.last + gained * self.heating.heat * freed)

    def agree(self, strain: Floats, rest: Floats) -> bool:
        """Whether plateaus and heat agree; if not, take the next guess."""
        if self.heating is None:
            return True
        off = self.following(strain, rest) - self.now
        if self.heating.rise * np.abs(off).max() <= TOLERANCE_MPA:
            return True
        where, was = self.before
        moved = self.now - where
        slope = np.where(moved == 0, -1.0, (off - was) / np.where(moved == 0, 1.0, moved))
        self.before = self.now, off
        self.now = self.now - off / np.clip(slope, -STEEPEST, -1.0)
        return False

    def accept(self, strain: Floats, rest: Floats) -> Floats:
        """Note the temperatures at an equilibrium; return by how much the plateaus have risen since the last, MPa."""
        if self.heating is None:
            return np.zeros_like(self.last)
        warmer = self.following(strain, rest)
        risen = self.shift_MPa(warmer) - self.shift_MPa(self.last)
        self.last, self.coldest = warmer, np.minimum(self.coldest, warmer)
        return risen
