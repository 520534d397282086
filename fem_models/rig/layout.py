"""The layout of a rig that bends in space, and its keys in a rig file: turned notches, tendons, loads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_models.rig.checks import RigError, require, require_in_range
from hysteresis.arrays import Floats
from hysteresis.messages import as_given, listed, quoted
from hysteresis.records.rows import is_number

Space = tuple[float, float, float]
MOST_TENDONS = 4
"""Most tendons of a rig file: records have columns for the tensions of tendons a to d."""
IN_SPACE = (
    "bends in space, which run, simulate, validate, study, workspace, compensate, trace and app know: "
    "expected a planar rig here"
)
"""End of the message of everything that knows planar rigs only."""
KNOWN_EFFECTS = ("closure", "gravity", "tip_load", "tip_mass")
"""Effects of a rig that the chain in space has, too."""
_LOADS = ("tendons", "tip_load", "gravity", "tip_mass")
"""Keys that may say something of space, beside the turn of the notches."""
_PLANAR = (((0.0,), (1,)), ((0.0, 180.0), (1, 1)))
"""Angles and wheels of the tendons of planar rigs."""


@dataclass(frozen=True)
class Weight:
    """A mass, g, and the direction of gravity: x along the straight tube, y in its bending plane, z across."""

    mass_g: float
    direction: Space


@dataclass(frozen=True)
class Layout:
    """What makes a rig bend in space.

    Parameters
    ----------
    turns_deg
        Turn of each notch about the tube axis, from y towards z.
    angles_deg
        Angles of the tendons round the tube, from y towards z. Two are tendons a and b of the rig; of any other number
        all are like tendon a.
    wheels
        Number of the wheel of each tendon, from 1. The first tendon of a wheel is wound in by a positive drive, the
        second one is let out.
    tip_force_N, ring, tip
        Dead force at the tip, weight of one ring and of a mass at the tip, with a direction in space, in addition to
        the planar loads of the rig, which act in y.

    Raises
    ------
    RigError
        Angles out of their range, or a number of wheels other than that of the tendons.
    """

    turns_deg: tuple[float, ...]
    angles_deg: tuple[float, ...]
    wheels: tuple[int, ...]
    tip_force_N: Space = (0.0, 0.0, 0.0)
    ring: Weight | None = None
    tip: Weight | None = None

    def __post_init__(self) -> None:
        for turn in (*self.turns_deg, *self.angles_deg):
            require_in_range("turn_deg", turn)
        wheels = len(self.wheels)
        require(wheels == len(self.angles_deg), "tendons.wheels", f"{wheels} wheels", "one for each tendon")

    def in_tables(self, planar: Mapping[str, Any]) -> dict[str, str | float | dict[str, Any]]:
        """Add the layout to the tables of the planar rig, as a rig file has them."""
        out, same = dict(planar), all(turn == self.turns_deg[0] for turn in self.turns_deg)
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


def winding(wheels: Sequence[int]) -> Floats:
    """Give what a drive of each wheel winds in of each tendon: 1, -1 or 0, shape (wheels, tendons)."""
    out = np.zeros((max(wheels), len(wheels)))
    for j, wheel in enumerate(wheels):
        out[wheel - 1, j] = -1.0 if wheel in wheels[:j] else 1.0
    return out


@dataclass(frozen=True)
class LayoutKeys:
    """What a rig file says of the layout.

    Parameters
    ----------
    found
        The key that takes the rig into space, for messages.
    turns_deg
        Turn of the notches about the tube axis: one for all, or one a notch.
    angles_deg, wheels
        Angles of the tendons round the tube, and the number of the wheel of each; () without a table ``[tendons]``.
    tip_force_N
        Dead force at the tip.
    ring, tip
        Weights of one ring and of a mass at the tip.
    """

    found: str
    turns_deg: float | tuple[float, ...] = 0.0
    angles_deg: tuple[float, ...] = ()
    wheels: tuple[int, ...] = ()
    tip_force_N: Space = (0.0, 0.0, 0.0)
    ring: Weight | None = None
    tip: Weight | None = None


def split_tables(tables: Mapping[str, Any], where: str) -> tuple[dict[str, Any], LayoutKeys | None]:
    """Divide the tables of a rig file into those of a planar rig and what takes it into space.

    ``[[notch]]`` rows are a table already. None is a planar rig: no notch is turned, tendons are at 0, or at 0 and 180
    degrees on one wheel, and no load has three components.

    Raises
    ------
    RigError
        One line with ``where``, key, value and what was expected.
    """
    data, notch = dict(tables), tables.get("notch")
    if data.keys().isdisjoint(_LOADS) and not (isinstance(notch, Mapping) and "turn_deg" in notch):
        return data, None
    turns = _turns(data, where)
    angles, wheels = _tendons(data, where)
    force = _tip_force(data, where)
    ring = _weight(data, "gravity", "ring_mass_g", where)
    tip = _weight(data, "tip_mass", "mass_g", where)
    keys = {
        "notch.turn_deg": any(turns) if isinstance(turns, tuple) else turns != 0,
        "tendons.angles_deg": bool(angles) and (angles, wheels) not in _PLANAR,
        "tip_load.force_N": force is not None,
        "gravity.direction": ring is not None,
        "tip_mass.direction": tip is not None,
    }
    found = [name for name, is_there in keys.items() if is_there]
    if not found:
        return data, None
    return data, LayoutKeys(found[0], turns, angles, wheels, force or (0.0, 0.0, 0.0), ring, tip)


def _turns(data: dict[str, Any], where: str) -> float | tuple[float, ...]:
    """Take ``turn_deg`` out of the table of the notches."""
    notch = data.get("notch")
    if not isinstance(notch, Mapping) or "turn_deg" not in notch:
        return 0.0
    data["notch"] = {key: value for key, value in notch.items() if key != "turn_deg"}
    given = notch["turn_deg"]
    if isinstance(given, list | tuple):
        turns = _numbers(given, f"{where}: notch.turn_deg")
        count = notch.get("count")
        if len(turns) != count:
            found = f"{len(turns)} number{'s' * (len(turns) != 1)}"
            raise RigError(f"{where}: notch.turn_deg = {found}: expected one number, or {count}, one a notch")
        return turns
    return _numbers([given], f"{where}: notch.turn_deg")[0]


def _tendons(data: dict[str, Any], where: str) -> tuple[tuple[float, ...], tuple[int, ...]]:
    """Take the table ``[tendons]``; what is left is the number of tendons of a planar rig."""
    table = data.get("tendons")
    if not isinstance(table, Mapping):
        return (), ()
    for key in table:
        if key not in ("angles_deg", "wheels"):
            found = f"{where}: tendons.{as_given(key)} = {quoted(table[key])}"
            raise RigError(f"{found}: expected one of {listed(['angles_deg', 'wheels'])}")
    given = table.get("angles_deg")
    if not isinstance(given, list | tuple) or not 1 <= len(given) <= MOST_TENDONS:
        expected = f"a list of 1 to {MOST_TENDONS} angles round the tube"
        raise RigError(f"{where}: tendons.angles_deg = {quoted(given)}: expected {expected}")
    if "tendon_b" in data:
        raise RigError(f"{where}: [tendon_b]: expected absent with [tendons], whose tendons are all alike")
    angles = _numbers(given, f"{where}: tendons.angles_deg")
    wheels = wheels_of_pairs(angles) if "wheels" not in table else _wheels(table["wheels"], len(angles), where)
    data["tendons"] = 2 if len(angles) == 2 else 1
    return angles, wheels


def wheels_of_pairs(angles_deg: Sequence[float]) -> tuple[int, ...]:
    """Wheel of each tendon: opposite tendons share one, in the order of the angles.

    Where a tendon has none opposite, each one has its own wheel.
    """
    wheels = [0] * len(angles_deg)
    for j, angle in enumerate(angles_deg):
        opposite = [
            k for k in range(j + 1, len(angles_deg)) if not wheels[k] and _off(angles_deg[k] - angle - 180) < 1e-6
        ]
        if not wheels[j] and opposite:
            wheels[j] = wheels[opposite[0]] = max(wheels) + 1
    return tuple(wheels) if all(wheels) else tuple(range(1, len(angles_deg) + 1))


def _off(angle_deg: float) -> float:
    return abs(math.remainder(angle_deg, 360.0))


def _wheels(given: object, count: int, where: str) -> tuple[int, ...]:
    good = isinstance(given, list | tuple) and len(given) == count and all(type(one) is int for one in given)
    numbers = tuple(given) if good and isinstance(given, list | tuple) else ()
    used = sorted(set(numbers))
    if not good or used != list(range(1, len(used) + 1)) or max(map(numbers.count, used)) > 2:
        expected = f"the number of its wheel, from 1, for each of {count} tendons, at most 2 on a wheel"
        raise RigError(f"{where}: tendons.wheels = {quoted(given)}: expected {expected}")
    return numbers


def _tip_force(data: dict[str, Any], where: str) -> Space | None:
    """Take a tip load of three components."""
    load = data.get("tip_load")
    if not isinstance(load, Mapping) or not isinstance(load.get("force_N"), list | tuple):
        return None
    if len(load) > 1:
        other = next(key for key in load if key != "force_N")
        raise RigError(f"{where}: tip_load.{as_given(other)}: expected absent with a force_N of three components")
    del data["tip_load"]
    return _vector(load["force_N"], f"{where}: tip_load.force_N")


def _weight(data: dict[str, Any], table: str, mass: str, where: str) -> Weight | None:
    """Take a weight whose direction has three components."""
    given = data.get(table)
    if not isinstance(given, Mapping) or "direction" not in given:
        return None
    for key in given:
        if key not in ("direction", mass):
            raise RigError(f"{where}: {table}.{as_given(key)}: expected {mass} and direction, of three components")
    if mass not in given:
        raise RigError(f"{where}: {table}.{mass}: missing, expected in [{table}]")
    direction = _vector(given["direction"], f"{where}: {table}.direction")
    if math.hypot(*direction) == 0:
        raise RigError(f"{where}: {table}.direction = {quoted(given['direction'])}: expected one that is not 0")
    size = _numbers([given[mass]], f"{where}: {table}.{mass}")[0]
    if not 0 <= size <= 1e9:
        raise RigError(f"{where}: {table}.{mass} = {size:g}: expected at least 0, at most 1e+09")
    del data[table]
    return Weight(size, direction)


def _vector(given: object, name: str) -> Space:
    if not isinstance(given, list | tuple) or len(given) != 3:
        raise RigError(f"{name} = {quoted(given)}: expected three components, x, y and z")
    x, y, z = _numbers(given, name)
    return x, y, z


def _numbers(given: Sequence[object], name: str) -> tuple[float, ...]:
    for one in given:
        if not is_number(one):
            raise RigError(f"{name} = {quoted(one)}: expected a number")
        require_in_range(name, float(one))  # type: ignore[arg-type]
    return tuple(float(one) for one in given)  # type: ignore[arg-type]
