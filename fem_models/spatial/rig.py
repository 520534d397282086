"""A wrist in space: joints with six stiffnesses and a frame each, tendons round the tube, dead loads.

Axes: x along the straight tube from base to tip, y where a notch without turn bends to, z = x times y.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from fem_models.joint import JointMechanics, joint_mechanics, joint_row
from fem_models.joint.contact import ring_weight_N, tip_force_N, weight_N
from fem_models.joint.flexure import elasticity
from fem_models.rig import Rig
from fem_models.rig.checks import require, require_in_range
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from fem_models.rig.layout import KNOWN_EFFECTS, Space, Weight
from fem_models.rig.rig import EFFECT_TABLES, Friction, Material, Tendon, with_joint
from fem_models.spatial.stiffness import NotchStiffness, notch_stiffness, shear_centre_mm
from hysteresis.arrays import Floats

MEASURED_RATIO = 100.0
"""Strong bending and torsion of a measured joint over its bending stiffness: not known, and stiff here."""
RIGID_RING = 1e9
"""Stiffness of a ring in series over that of a notch whose stiffness has the ring in it."""


@dataclass(frozen=True)
class SpatialTendon:
    """A tendon at an angle round the tube axis, from y towards z, through guides at every ring.

    ``twist_deg_per_mm`` turns it on with the length of the tube, counted from the first joint: a helix.
    """

    tendon: Tendon
    angle_deg: float
    twist_deg_per_mm: float = 0.0

    def __post_init__(self) -> None:
        for name in ("angle_deg", "twist_deg_per_mm"):
            require_in_range(name, getattr(self, name))


@dataclass(frozen=True)
class SpatialJoint:
    """One notch of a wrist, all numbers in its own frame: 1 along the tube, 2 in its bending plane, 3 across.

    Parameters
    ----------
    turn_deg
        Angle of the notch about the tube axis: its axis 2 from y towards z.
    pitch_mm
        Length of tendon that crosses it, from the middle of a ring to that of the next one.
    mechanics
        The planar joint: lengths, neutral axis, closure, weak bending.
    stiffness
        The six stiffnesses; an infinite shear or axial one is rigid.
    ring
        Stiffness of the uncut tube in series, Nmm/rad: bending and torsion.
    shear_centre_mm
        Place of the shear centre along axis 2, from the neutral axis: where the notch twists about.
    beyond_mm, to_ring_mm
        From its middle to that of the next notch, of the last one as if another followed, and to the middle of its
        ring.
    """

    turn_deg: float
    pitch_mm: float
    mechanics: JointMechanics
    stiffness: NotchStiffness
    ring: tuple[float, float]
    shear_centre_mm: float
    beyond_mm: float
    to_ring_mm: float

    def __post_init__(self) -> None:
        require_in_range("turn_deg", self.turn_deg)
        for name, value in self.stiffness._asdict().items():
            require(value > 0, f"stiffness.{name}", value, "above 0")


@dataclass(frozen=True)
class DeadLoads:
    """Weights and forces that keep their direction in space.

    ``ring_weight_N`` is the weight of one ring as a vector, at its middle. ``tip_N`` acts on the middle of the last
    ring: a force, or the weight of a mass (:func:`with_masses`).
    """

    ring_weight_N: Space = (0.0, 0.0, 0.0)
    tip_N: Space = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("ring_weight_N", "tip_N"):
            value = getattr(self, name)
            require(len(value) == 3, name, value, "three numbers")
            for component in value:
                require_in_range(name, component)


@dataclass(frozen=True)
class SpatialRig:
    """A wrist that bends in space.

    The loop of the material acts on either bending axis by itself; its elastic constants are in the joints already.
    ``contact_Nmm_per_rad`` is the stiffness of closed notches; 0 is none.

    Raises
    ------
    RigError
        No joint or tendon, a preload at or below 0 with a toe region, numbers out of their range.
    """

    name: str
    joints: tuple[SpatialJoint, ...]
    tendons: tuple[SpatialTendon, ...]
    preload_N: float
    material: Material = field(default_factory=Material)
    friction: Friction = field(default_factory=Friction)
    contact_Nmm_per_rad: float = 0.0
    loads: DeadLoads = field(default_factory=DeadLoads)

    def __post_init__(self) -> None:
        require(len(self.joints) > 0, "joints", len(self.joints), "at least 1")
        require(len(self.tendons) > 0, "tendons", len(self.tendons), "at least 1")
        toe = any(one.tendon.toe_N > 0 for one in self.tendons)
        taut = math.isfinite(self.preload_N) and (self.preload_N > 0 or (self.preload_N == 0 and not toe))
        require(taut, "preload_N", self.preload_N, "above 0" if toe else "at least 0")

    @property
    def mean_pitch_mm(self) -> float:
        """Length over the number of joints; guides that stick are as stiff as tendon of this length."""
        pitches = [joint.pitch_mm for joint in self.joints]
        return pitches[0] if len(set(pitches)) == 1 else sum(pitches) / len(pitches)


def spatial_rig(
    rig: Rig,
    *,
    turns_deg: float | Sequence[float] = 0.0,
    tendons_deg: Sequence[float] | None = None,
    twist_deg_per_mm: float = 0.0,
    stiffness: NotchStiffness | Sequence[NotchStiffness] | None = None,
) -> SpatialRig:
    """Take a planar rig into space.

    Parameters
    ----------
    turns_deg
        One angle turns the whole rig with its tendons and loads about the tube axis. A row of N angles turns every
        notch by its own; tendons and loads then stay. (0, 90, 0, 90, ...) bends in two planes.
    tendons_deg
        Angles of the tendons, all like tendon a. None is tendon a at 0 and tendon b, if there is one, at 180 degrees.
    stiffness
        The six stiffnesses of every notch, or a row of N, such as those of solids a pitch long: what the rings give is
        in them. None derives them from the section, with the rings in series.

    Raises
    ------
    RigError
        An effect of the rig that the chain in space does not have, or a row of turns of another length.
    """
    for name in EFFECT_TABLES:
        known = name in KNOWN_EFFECTS or getattr(rig, name) is None
        require(known, name, "given", f"none in space: of the effects there are {', '.join(KNOWN_EFFECTS)}")
    whole = 0.0
    if isinstance(turns_deg, int | float):
        whole = float(turns_deg)
        turns = [whole] * rig.joints
    else:
        turns = [float(turn) for turn in turns_deg]
        require(len(turns) == rig.joints, "turns_deg", f"{len(turns)} angles", f"one for each of {rig.joints} joints")
    if tendons_deg is None:
        placed = [SpatialTendon(one, whole + 180.0 * i, twist_deg_per_mm) for i, one in enumerate(rig.tendons)]
    else:
        placed = [SpatialTendon(rig.tendon_a, whole + float(angle), twist_deg_per_mm) for angle in tendons_deg]
    weight, tip = ring_weight_N(rig), tip_force_N(rig)
    return SpatialRig(
        name=rig.name,
        joints=_joints(rig, turns, stiffness),
        tendons=tuple(placed),
        preload_N=rig.preload_N,
        material=rig.material,
        friction=rig.friction,
        contact_Nmm_per_rad=rig.closure.stiffness_Nmm_per_rad if rig.closure else 0.0,
        loads=DeadLoads(_in_space(weight, whole), _in_space(tip, whole)),
    )


def of_rig_in_space(rig: Rig, stiffness: Sequence[NotchStiffness] | None = None) -> SpatialRig:
    """Make the chain in space of a rig; ``stiffness`` as in :func:`spatial_rig`.

    Raises
    ------
    RigError
        As :func:`spatial_rig`.
    """
    planar = spatial_rig(rig.in_plane, turns_deg=rig.turns_deg, stiffness=stiffness)
    tendons = tuple(SpatialTendon(*one) for one in zip(rig.tendons, rig.angles_deg, strict=True))
    loads, layout = planar.loads, rig.layout
    if layout is not None:
        force = _sum(_sum(loads.tip_N, layout.tip_force_N), _weight_N(layout.tip))
        loads = DeadLoads(_sum(loads.ring_weight_N, _weight_N(layout.ring)), force)
    return replace(planar, tendons=tendons, loads=loads)


def _weight_N(weight: Weight | None) -> Space:
    if weight is None:
        return 0.0, 0.0, 0.0
    x, y, z = (weight_N(weight.mass_g) * part / math.hypot(*weight.direction) for part in weight.direction)
    return x, y, z


def _joints(
    rig: Rig, turns_deg: Sequence[float], stiffness: NotchStiffness | Sequence[NotchStiffness] | None
) -> tuple[SpatialJoint, ...]:
    """Make the joints, notches that differ among them."""
    given = [stiffness] * rig.joints if stiffness is None or isinstance(stiffness, NotchStiffness) else list(stiffness)
    require(len(given) == rig.joints, "stiffness", f"{len(given)} notches", f"one for each of {rig.joints} joints")
    same = rig.joint.alike and len(set(given)) == 1
    kinds = [_kind(with_joint(rig, number), given[number]) for number in range(1 if same else rig.joints)]
    lengths = joint_row(rig).lengths
    segments, to_ring = lengths.segments.tolist(), lengths.to_ring.tolist()
    beyond = [*lengths.beyond[:-1].tolist(), 2 * to_ring[-1]]
    places = zip(turns_deg, segments, beyond, to_ring, strict=True)
    return tuple(
        SpatialJoint(turn, segment, *kinds[min(k, len(kinds) - 1)], further, half)
        for k, (turn, segment, further, half) in enumerate(places)
    )


_Kind = tuple[JointMechanics, NotchStiffness, tuple[float, float], float]


def _kind(rig: Rig, stiffness: NotchStiffness | None) -> _Kind:
    mechanics = joint_mechanics(rig)
    law = isinstance(rig.joint, MeasuredJoint) and rig.joint.has_law
    require(not law, "rig.law_share", "given", "none in space: joints are linear but for their loop")
    linear = mechanics.hardening.is_linear
    require(linear, "rig.hardening_slope", "given", "none in space: joints are linear but for their loop")
    shears = _shear_centre_mm(rig, mechanics)
    if stiffness is not None:  # what the ring gives is in it
        return mechanics, stiffness, (RIGID_RING * stiffness.strong, RIGID_RING * stiffness.torsion), shears
    ring = mechanics.ring.bending_Nmm_per_rad
    series = (ring, ring / (1 + rig.material.poissons_ratio))  # G J = E I/(1 + nu) of a round tube
    return mechanics, _stiffness(rig, mechanics), series, shears


def _shear_centre_mm(rig: Rig, mechanics: JointMechanics) -> float:
    """Place of the shear centre from the neutral axis, towards the cut; that of measured joints is not known."""
    if not (isinstance(rig.joint, NotchedTube) and rig.joint.one_sided):
        return 0.0
    return mechanics.flexure.neutral_offset_mm - shear_centre_mm(rig.joint)


def _in_space(planar: tuple[float, float], turn_deg: float) -> Space:
    turn = math.radians(turn_deg)
    return planar[0], planar[1] * math.cos(turn), planar[1] * math.sin(turn)


def _stiffness(rig: Rig, mechanics: JointMechanics) -> NotchStiffness:
    match rig.joint:
        case MeasuredJoint(flexure_stiffness_Nmm_per_rad=weak):
            stiff = MEASURED_RATIO * weak
            return NotchStiffness(weak, stiff, stiff, math.inf, math.inf, math.inf)
        case NotchedTube() as tube:
            six = notch_stiffness(tube, elasticity(rig.material))
            # the axial spring is the planar chain's
            return six._replace(axial=1 / mechanics.axial_compliance)


def with_masses(
    rig: SpatialRig, direction: Sequence[float] | Floats, *, ring_g: float = 0.0, tip_g: float = 0.0
) -> SpatialRig:
    """Add the weights of rings and of a mass at the tip to a rig; ``direction`` is that of gravity, of any length.

    Raises
    ------
    RigError
        A direction without length, a mass below 0.
    """
    size = math.hypot(*direction)
    require(len(direction) == 3 and 0 < size < math.inf, "direction", tuple(direction), "three numbers, not all 0")
    for name, mass in (("ring_g", ring_g), ("tip_g", tip_g)):
        require(mass >= 0, name, mass, "at least 0")
    down = [float(part) / size for part in direction]
    return replace(
        rig,
        loads=DeadLoads(
            _sum(rig.loads.ring_weight_N, [weight_N(ring_g) * part for part in down]),
            _sum(rig.loads.tip_N, [weight_N(tip_g) * part for part in down]),
        ),
    )


def _sum(one: Space, other: Sequence[float]) -> Space:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]
