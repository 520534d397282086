"""What is known of a declared rig before its records: tolerances of its numbers, and the laws that its metal may have.

Each number has a prior around the value that the rig states. It is a function of a standard normal variable z, so that
a rig drawn from the prior is one vector z, shape (p,), and any z is a possible number:

    log      value = stated exp(spread z)
    logit    value of 0 to 1, ln(value/(1 - value)) = that of the stated one + spread z
    plain    value = stated + spread z
    range    value = low + (high - low) Phi(z), uniform between two ends; for a law that the rig does not state
    above 0  value = median ln(1 + exp(spread z))/ln 2, which is nearly straight above the median; for play

Numbers that a rig states as 0, as a sheath without friction, may be 0 or not known: there is a law (:class:`Law`) in
which they are 0, and one in which each has a wider prior of its own. Play of the drive is such a number by itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.special import ndtr

from fem_models.rig import Rig, RigError
from fem_models.rig.effects import Backlash, Superelastic
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from fem_models.rig.metal import METAL_RANGES
from hysteresis.arrays import Floats
from hysteresis.messages import quoted

Shape = Literal["log", "logit", "plain", "range", "above 0"]


@dataclass(frozen=True)
class Prior:
    """How a number spreads about the value that a rig states.

    Parameters
    ----------
    unit
        Of the number.
    shape
        How z makes the number: see the module.
    spread
        Standard deviation of the logarithm, of the logit, or in the number's own unit.
    source
        Where the spread comes from, or why it is assumed.
    how
        How the number is measured by itself.
    unstated
        Median and spread of a rig that has it, where the rig states 0; None where 0 cannot be, or is kept.
    unstated_shape
        Shape where the rig states 0, if it is another one.
    """

    unit: str
    shape: Shape
    spread: float
    source: str
    how: str
    unstated: tuple[float, float] | None = None
    unstated_shape: Shape | None = None


_UNKNOWN = "friction is not on a drawing: a factor of 5 either way is two standard deviations; assumed"
_LOOP = "a law of the loop, not of the metal: no drawing has it; assumed"
_FITTED = "spread of published constants of the alloy at one temperature; assumed"

METAL_TEST = "bend the notched tube without tendons, there and back"
"""How the law of the metal is told."""
_PULL = "pull a length of the metal, there and back"
PRIORS: Mapping[str, Prior] = {
    "sheath_N": Prior(
        "N", "log", 0.8, _UNKNOWN, "draw the tendon through its sheath alone, tension at both ends", (0.3, 1.2)
    ),
    "capstan_coefficient": Prior(
        "-", "log", 0.8, "steel on NiTi 0.2, up to 0.4 by fit (York et al., ICRA 2015), oiled far less; assumed",
        "tension at wheel and tip with the tube held bent", (0.03, 1.2),
    ),
    "guide_N": Prior("N", "log", 0.8, _UNKNOWN, "draw the tendon through the straight tube, tension at both ends"),
    "EA_N": Prior(
        "N", "log", 0.3, "a strand has 50 to 85 % metal, and 150 to 200 GPa; assumed",
        "pull the tendon alone: force over stretch",
    ),
    "toe_N": Prior(
        "N", "log", 0.7, "a strand or a splice that settles: no data sheet has it; assumed",
        "pull the tendon alone, at tensions about the preload", (3.0, 1.2),
    ),
    "free_length_mm": Prior("mm", "log", 0.02, "3 mm of 150 mm, by tape along a curved path; assumed", "measure it"),
    "backlash_mm": Prior(
        "mm", "log", 0.5, "of gears, couplings and fixings, and of tendons in their holes: no drawing has it; assumed",
        "turn the drive there and back: how far it moves before the tip, or a tendon's tension, does",
        (0.04, 1.0), "above 0",
    ),
    "backlash_takes_up_N": Prior(
        "N", "log", 1.5, "the preload that halves the play: none is known; assumed", "the same at another preload"
    ),
    "moment_arm_mm": Prior(
        "mm", "plain", 0.025, "ISO 2768-1 fine, +-0.05 mm up to 6 mm, as two standard deviations",
        "the places of the guides under a microscope",
    ),
    "depth_mm": Prior(
        "mm", "plain", 0.01, "wire or laser cutting, +-0.02 mm as two standard deviations; assumed",
        "the depth of the notches under a microscope",
    ),
    "youngs_modulus_GPa": Prior(
        "GPa", "log", 0.15, "40 to 80 GPa of austenite, doi 10.1016/j.commatsci.2021.110357, about a stated value",
        "bend the tube before it is cut",
    ),
    "flexure_stiffness_Nmm_per_rad": Prior("Nmm/rad", "log", 0.05, "a bending test of one joint; assumed", METAL_TEST),
    "loop_share": Prior("-", "logit", 0.8, _LOOP, METAL_TEST, (0.1, 1.2)),
    "loop_angle_deg": Prior("deg", "log", 0.6, _LOOP, METAL_TEST),
    "plateau_MPa": Prior("MPa", "log", 0.08, _FITTED, _PULL),
    "unloading_plateau_MPa": Prior("MPa", "log", 0.15, _FITTED, _PULL),
    "transformation_strain": Prior("-", "log", 0.15, _FITTED, _PULL),
    "plateau_modulus_GPa": Prior("GPa", "log", 0.3, _FITTED, _PULL),
}  # fmt: skip
"""Numbers that are fitted to records, with their priors, by their names in ``separate.json``."""

FLAG = ("plateau_MPa", "unloading_plateau_MPa", "transformation_strain", "plateau_modulus_GPa")
LOOP = ("loop_share", "loop_angle_deg")
PLAY = "backlash_mm"
_OF_PLAY = (PLAY, "backlash_takes_up_N")
NO_PLAY = Backlash(0.0, takes_up_N=10.0)
"""Backlash of a rig that states none: it may have some, of which a preload takes up a part."""
FARTHEST = 12.0
"""Standard deviations up to which a prior is followed: a search that strays stays among finite numbers."""
_CLOSE_TO_ONE = 1e-6
_LARGEST = 1e9  # tolerance


def stated_values(rig: Rig) -> dict[str, float]:
    """Values of :data:`PRIORS` in a rig; tendon a stands for both, the notch at the base for all.

    Of the backlash it is the width that the preload leaves.
    """
    dry, metal, tendon, play = rig.friction, rig.material, rig.tendon_a, rig.backlash or NO_PLAY
    values = {
        "sheath_N": dry.sheath_N,
        "capstan_coefficient": dry.capstan_coefficient,
        "guide_N": dry.guide_N,
        "EA_N": tendon.EA_N,
        "toe_N": tendon.toe_N,
        "free_length_mm": tendon.free_length_mm,
        "backlash_mm": float(play.left_mm(rig.preload_N)),
        "moment_arm_mm": tendon.moment_arm_mm,
    }
    if play.takes_up_N is not None:
        values["backlash_takes_up_N"] = play.takes_up_N
    match rig.joint:
        case NotchedTube(_, notch):
            depth = notch.depth_mm
            values |= {
                "depth_mm": depth[0] if isinstance(depth, tuple) else depth,
                "youngs_modulus_GPa": metal.youngs_modulus_GPa,
            }
        case MeasuredJoint() as joint:
            values |= {"flexure_stiffness_Nmm_per_rad": joint.flexure_stiffness_Nmm_per_rad}
    values |= {name: getattr(metal, name) for name in LOOP}
    law = rig.superelastic
    return values if law is None else values | {name: getattr(law, name) for name in FLAG}


def with_values(rig: Rig, values: Mapping[str, float], preload_N: float | None = None) -> Rig:
    """Replace some of :data:`PRIORS` in a rig; both tendons get the same, but arms and depths are moved alike.

    The backlash of ``values`` is what ``preload_N`` leaves, by default the preload of the rig.

    Raises
    ------
    RigError
        Values that no rig can have.
    """
    of_tendon = {name: values[name] for name in ("EA_N", "toe_N", "free_length_mm") if name in values}
    further = values.get("moment_arm_mm", rig.tendon_a.moment_arm_mm) - rig.tendon_a.moment_arm_mm
    tendons = [replace(one, moment_arm_mm=one.moment_arm_mm + further, **of_tendon) for one in rig.tendons]

    def of(part: Any, names: tuple[str, ...]) -> Any:
        return replace(part, **{name: values[name] for name in names if name in values})

    return replace(
        rig,
        friction=of(rig.friction, ("sheath_N", "capstan_coefficient", "guide_N")),
        material=of(rig.material, (*LOOP, "youngs_modulus_GPa")),
        tendon_a=tendons[0],
        tendon_b=tendons[1] if len(tendons) == 2 else None,
        backlash=_with_backlash(rig, values, rig.preload_N if preload_N is None else preload_N),
        joint=_with_joint(rig, values),
        superelastic=None if rig.superelastic is None else of(rig.superelastic, FLAG),
    )


def _with_backlash(rig: Rig, values: Mapping[str, float], preload_N: float) -> Backlash | None:
    if not any(name in values for name in _OF_PLAY):
        return rig.backlash
    stated = rig.backlash or NO_PLAY
    play = replace(stated, takes_up_N=values.get("backlash_takes_up_N", stated.takes_up_N))
    left = values.get(PLAY, float(stated.left_mm(preload_N)))
    wide = replace(play, width_mm=left / float(replace(play, width_mm=1.0).left_mm(preload_N)))
    return wide if wide.width_mm > 0 else rig.backlash


def _with_joint(rig: Rig, values: Mapping[str, float]) -> NotchedTube | MeasuredJoint:
    match rig.joint:
        case NotchedTube(_, notch) if "depth_mm" in values:
            depth = notch.depth_mm
            if isinstance(depth, tuple):
                deeper = values["depth_mm"] - depth[0]
                return replace(rig.joint, notch=replace(notch, depth_mm=tuple(one + deeper for one in depth)))
            return replace(rig.joint, notch=replace(notch, depth_mm=values["depth_mm"]))
        case MeasuredJoint() if "flexure_stiffness_Nmm_per_rad" in values:
            return replace(rig.joint, flexure_stiffness_Nmm_per_rad=values["flexure_stiffness_Nmm_per_rad"])
    return rig.joint


@dataclass(frozen=True)
class Coordinate:
    """One number of a rig as a function of a standard normal variable.

    ``ends`` are those of a range; ``may_be_none`` is that of a number which the rig states as 0.
    """

    shape: Shape
    middle: float
    spread: float
    ends: tuple[float, float] = (0.0, 1.0)
    may_be_none: bool = False

    def at(self, z: float) -> float:
        """Give the number; beyond :data:`FARTHEST` it does not change."""
        z = min(max(z, -FARTHEST), FARTHEST)
        match self.shape:
            case "log":
                return self.middle * math.exp(self.spread * z)
            case "logit":
                odds = self.middle / (1 - self.middle) * math.exp(self.spread * z)
                return min(odds / (1 + odds), 1 - _CLOSE_TO_ONE)
            case "plain":
                return self.middle + self.spread * z
            case "above 0":
                return self.middle * math.log1p(math.exp(self.spread * z)) / math.log(2)
            case "range":
                return self.ends[0] + (self.ends[1] - self.ends[0]) * float(ndtr(z))


@dataclass(frozen=True, eq=False)
class Law:
    """A law of the metal, with the coordinates of all numbers of the rig that are not known exactly.

    ``metal`` takes the place of the stated law: None keeps it. Several laws of the same ``name`` differ in which of the
    numbers that the rig states as 0 have a coordinate. ``preload_N`` is that at which its backlash is known.
    """

    name: str
    preload_N: float
    coordinates: Mapping[str, Coordinate]
    metal: Superelastic | None = None

    def values(self, z: Floats) -> dict[str, float]:
        """Numbers by name at z, shape (p,)."""
        return {name: one.at(at) for (name, one), at in zip(self.coordinates.items(), z.tolist(), strict=True)}

    def on(self, rig: Rig) -> Rig:
        """Return a rig with this law of its metal."""
        if self.metal is None:
            return rig
        return replace(rig, material=replace(rig.material, loop_share=0.0), superelastic=self.metal)

    def rig_at(self, z: Floats, rig: Rig) -> Rig:
        """Rig of the same preload at z, shape (p,).

        Raises
        ------
        RigError
            No rig has these values.
        """
        return with_values(self.on(rig), self.values(z), self.preload_N)


def laws_of(rig: Rig, tolerance: Mapping[str, object] | None = None) -> tuple[Law, ...]:
    """Laws that the metal of a rig may have: its own, and the flag where a notched tube states none.

    Each is there with and without play where the rig states none, and with and without the other numbers stated as 0.
    The first of each name has those, and no play.

    Parameters
    ----------
    tolerance
        ``[rig.tolerance]`` of a sidecar: standard deviations by the names of :data:`PRIORS`, in their units.

    Raises
    ------
    RigError
        A tolerance of an unknown name, or one that is no number above 0.
    """
    tolerance = tolerance or {}
    known = stated_values(rig)
    for name, size in tolerance.items():
        if name not in known:
            raise RigError(f"rig.tolerance.{name}: expected one of {', '.join(known)}")
        most = 0.5 if PRIORS[name].shape == "logit" else _LARGEST
        if isinstance(size, bool) or not isinstance(size, int | float) or not 0 < size < most:
            expected = f"expected a standard deviation above 0 and below {most:g}"
            raise RigError(f"rig.tolerance.{name} = {quoted(size)}: {expected}")
    stated = Law("linear" if rig.superelastic is None else "flag", rig.preload_N, _coordinates(rig, tolerance))
    metals = [stated]
    if rig.superelastic is None and isinstance(rig.joint, NotchedTube):
        flag = Law("flag", rig.preload_N, {}, Superelastic())
        metals.append(replace(flag, coordinates=_coordinates(flag.on(rig), tolerance, states_flag=False)))
    return tuple(law for metal in metals for law in _with_and_without(metal))


def _with_and_without(law: Law) -> list[Law]:
    """Leave out play, the other numbers that may be 0, both, or neither."""
    none = {name for name, one in law.coordinates.items() if one.may_be_none}
    play = set(_OF_PLAY) if PLAY in none else set()
    others = (none - play) | (set(LOOP) if LOOP[0] in none else set())
    without = dict.fromkeys(frozenset(names) for names in (play, set(), play | others, others))

    def left(names: frozenset[str]) -> dict[str, Coordinate]:
        return {name: one for name, one in law.coordinates.items() if name not in names}

    return [replace(law, coordinates=left(names)) for names in without]


def _coordinates(
    rig: Rig, tolerance: Mapping[str, object], *, states_flag: bool = True
) -> dict[str, Coordinate]:  # fmt: skip
    """Coordinates of the numbers of a rig that are open: not of what it states as 0 and what has no prior for that."""
    found = {}
    for name, value in stated_values(rig).items():
        prior = PRIORS[name]
        if name in FLAG and not states_flag:
            low, high, _ = METAL_RANGES[f"superelastic.{name}"]
            found[name] = Coordinate("range", 0.5 * (low + high), 1.0, (low, high))
        elif name in tolerance:
            found[name] = _of_tolerance(prior.shape, value, float(tolerance[name]))  # type: ignore[arg-type]
        elif value > 0:
            found[name] = Coordinate(prior.shape, value, prior.spread)
        elif prior.unstated is not None:
            found[name] = Coordinate(prior.unstated_shape or prior.shape, *prior.unstated, may_be_none=True)
    if rig.superelastic is not None and rig.material.loop_share == 0:
        found = {name: one for name, one in found.items() if name not in LOOP}
    if rig.preload_N == 0:  # a tendon without tension cannot have a toe region
        found.pop("toe_N", None)
    return found


def _of_tolerance(shape: Shape, value: float, size: float) -> Coordinate:
    """Coordinate of a number with a stated standard deviation in its own unit."""
    middle = value or size
    match shape:
        case "plain":
            return Coordinate(shape, value, size)
        case "logit":
            return Coordinate(shape, middle, size / (middle * (1 - middle)))
        case _:
            return Coordinate(shape, middle, math.sqrt(math.log1p((size / middle) ** 2)))


def drawn(laws: tuple[Law, ...], rng: np.random.Generator) -> tuple[Law, Floats]:
    """Draw a law, each with the same odds, and its z from the prior."""
    law = laws[int(rng.integers(len(laws)))]
    return law, rng.standard_normal(len(law.coordinates))
