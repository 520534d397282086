"""A rig that bends in space: a planar rig whose notches are turned about the tube, with tendons round it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_models.rig.checks import RigError, require, require_in_range
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import EFFECT_TABLES, Rig, Tendon
from fem_models.rig.rig_file import rig_and_space, rig_and_space_of_file
from fem_models.rig.space_tables import Space, SpaceKeys, Weight, wheels_of_pairs
from hysteresis.arrays import Floats
from hysteresis.display import html_table

KNOWN_EFFECTS = ("closure", "gravity", "tip_load", "tip_mass")
"""Effects of a planar rig that the chain in space has, too."""


@dataclass(frozen=True, repr=False)
class RigInSpace:
    """A rig that bends in two planes.

    Axes: x along the straight tube from base to tip, y where a notch without turn bends to, z = x times y.

    Parameters
    ----------
    rig
        Tube, notches, material, friction, tendons and preload, as if no notch were turned. Its planar loads act in y.
    turns_deg
        Turn of each notch about the tube axis, from y towards z.
    angles_deg
        Angles of the tendons round the tube, from y towards z. Two are tendons a and b of ``rig``; of any other number
        all are like tendon a.
    wheels
        Number of the wheel of each tendon, from 1. The first tendon of a wheel is wound in by a positive drive, the
        second one is let out.
    tip_force_N, ring, tip
        Dead force at the tip, weight of one ring and of a mass at the tip, with a direction in space, beside those of
        ``rig``.

    Raises
    ------
    RigError
        Measured joints, an effect that the chain in space does not have, or a number of turns other than that of the
        notches.
    """

    rig: Rig
    turns_deg: tuple[float, ...]
    angles_deg: tuple[float, ...]
    wheels: tuple[int, ...]
    tip_force_N: Space = (0.0, 0.0, 0.0)
    ring: Weight | None = None
    tip: Weight | None = None

    def __post_init__(self) -> None:
        known = f"none in space: of the effects there are {', '.join(KNOWN_EFFECTS)}"
        for name in EFFECT_TABLES:
            require(name in KNOWN_EFFECTS or getattr(self.rig, name) is None, name, "given", known)
        require(not isinstance(self.rig.joint, MeasuredJoint), "bench", "given", "[tube] and [notch] of a rig in space")
        count, n = len(self.turns_deg), self.rig.joints
        require(count == n, "notch.turn_deg", f"{count} angles", f"one for each of {n} notches")
        for turn in (*self.turns_deg, *self.angles_deg):
            require_in_range("turn_deg", turn)
        wheels = len(self.wheels)
        require(wheels == len(self.angles_deg), "tendons.wheels", f"{wheels} wheels", "one for each tendon")

    @property
    def name(self) -> str:
        """Name of the rig."""
        return self.rig.name

    @property
    def preload_N(self) -> float:
        """Preload of every tendon, N."""
        return self.rig.preload_N

    @property
    def joints(self) -> int:
        """Number of notches."""
        return self.rig.joints

    @property
    def tendons(self) -> tuple[Tendon, ...]:
        """Every tendon, in the order of its angle."""
        own = self.rig.tendons
        return own if len(own) == len(self.angles_deg) else (self.rig.tendon_a,) * len(self.angles_deg)

    @property
    def wheel_count(self) -> int:
        """Number of wheels."""
        return max(self.wheels)

    def winding(self) -> Floats:
        """Give what a drive of each wheel winds in of each tendon: 1, -1 or 0, shape (wheels, tendons)."""
        out = np.zeros((self.wheel_count, len(self.wheels)))
        for j, wheel in enumerate(self.wheels):
            out[wheel - 1, j] = -1.0 if wheel in self.wheels[:j] else 1.0
        return out

    def winds_both_ways(self, wheel: int) -> bool:
        """Whether a wheel, counted from 1, has a second tendon, which a positive drive lets out."""
        return self.wheels.count(wheel) > 1

    def with_preload(self, preload_N: float | None) -> RigInSpace:
        """Return the rig at another preload; itself for None."""
        return self if preload_N is None else replace(self, rig=replace(self.rig, preload_N=preload_N))

    def to_dict(self) -> dict[str, str | float | dict[str, Any]]:
        """Nested plain values, as in a rig file."""
        out: dict[str, Any] = self.rig.to_dict()
        same = all(turn == self.turns_deg[0] for turn in self.turns_deg)
        out["notch"] = out["notch"] | {"turn_deg": self.turns_deg[0] if same else list(self.turns_deg)}
        out["tendons"] = {"angles_deg": list(self.angles_deg), "wheels": list(self.wheels)}
        out["tendon"] = out.pop("tendon_a")
        out.pop("tendon_b", None)
        if any(self.tip_force_N):
            out["tip_load"] = {"force_N": list(self.tip_force_N)}
        for table, mass, weight in (("gravity", "ring_mass_g", self.ring), ("tip_mass", "mass_g", self.tip)):
            if weight is not None:
                out[table] = {mass: weight.mass_g, "direction": list(weight.direction)}
        return out

    def __repr__(self) -> str:
        counts = {"notch": self.joints, "tendon": len(self.angles_deg), "wheel": self.wheel_count}
        ends = {"notch": "es"}
        notches, tendons, wheels = (f"{n} {name}{ends.get(name, 's') * (n != 1)}" for name, n in counts.items())
        return f"RigInSpace({self.name!r}, {notches}, {tendons} on {wheels}, preload {self.preload_N:g} N)"

    def _repr_html_(self) -> str:
        parts = {name: value for name, value in self.to_dict().items() if name != "name"}
        rows = [
            (name, ", ".join(f"{k} = {v}" for k, v in value.items()) if isinstance(value, dict) else f"{value}")
            for name, value in parts.items()
        ]
        return html_table(f"rig {self.name}", rows)


def rig_in_space(rig: Rig, keys: SpaceKeys | None = None) -> RigInSpace:
    """Take a planar rig into space, with what a rig file says of it.

    Without angles the tendons are a at 0 and b, if there is one, at 180 degrees.

    Raises
    ------
    RigError
        As :class:`RigInSpace`.
    """
    keys = keys or SpaceKeys("")
    turns = keys.turns_deg if isinstance(keys.turns_deg, tuple) else (keys.turns_deg,) * rig.joints
    angles = keys.angles_deg or tuple(180.0 * j for j in range(len(rig.tendons)))
    wheels = keys.wheels or wheels_of_pairs(angles)
    return RigInSpace(rig, turns, angles, wheels, keys.tip_force_N, keys.ring, keys.tip)


def rig_in_space_of_tables(tables: Mapping[str, Any], where: str) -> RigInSpace:
    """Make a rig in space from the tables of a rig file or from :meth:`RigInSpace.to_dict`.

    One whose turns are 0 and whose tendons are those of a planar rig is still one in space here.

    Raises
    ------
    RigError
        One line with ``where``, field, value and what was expected.
    """
    rig, keys = rig_and_space(tables, where, "rig")
    try:
        return rig_in_space(rig, keys)
    except RigError as error:
        raise RigError(f"{where}: {error}") from None


def read_any_rig(path: Path | str) -> Rig | RigInSpace:
    """Read a rig file, of a planar rig or of one that bends in space.

    Beyond :func:`fem_models.rig.rig_file.read_rig`: ``turn_deg`` in [notch], one angle or one a notch;
    ``angles_deg`` in [tendons], and ``wheels`` where opposite tendons do not share one; ``force_N`` of [tip_load] and
    ``direction`` of [gravity] and [tip_mass] as three components.

    Raises
    ------
    RigError
        One line with file, field, value and what was expected.
    """
    path = Path(path)
    rig, keys = rig_and_space_of_file(path)
    if keys is None:
        return rig
    try:
        return rig_in_space(rig, keys)
    except RigError as error:
        raise RigError(f"{path}: {error}") from None
