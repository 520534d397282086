"""The rig: frozen values, checked when they are made. Units are part of the names (mm, N, GPa, deg)."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

from fem_models.rig.checks import RigError, require, require_in_range, require_length, require_numbers
from fem_models.rig.effects import (
    EFFECTS,
    Backlash,
    Closure,
    Creep,
    Drag,
    DriveGain,
    Eccentricity,
    Fatigue,
    Gravity,
    PositionFriction,
    PreloadLoss,
    RunIn,
    Slack,
    Stribeck,
    Superelastic,
    TipLoad,
    TipMass,
    TipStop,
)
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.layout import IN_SPACE, KNOWN_EFFECTS, Layout, LayoutKeys, wheels_of_pairs, winding
from hysteresis.arguments import checked_class
from hysteresis.arrays import Floats
from hysteresis.display import html_table
from hysteresis.messages import quoted

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True)
class Material:
    """Nitinol of the flexures: linear elasticity and, in parallel, a material loop that does not depend on the rate.

    ``loop_share`` is the part of the flexure's bending stiffness carried by Jenkins elements (elastic up
    to a slip moment); their slip angles are spread evenly up to ``loop_angle_deg`` of one joint. A share
    of 0 switches the material loop off.

    Jenkins elements are a loop of plastic kind, fitted to loops of angle over drive. They are not the law of Nitinol,
    which is :class:`fem_models.rig.effects.Superelastic`: they lose energy at any strain, stay bent without load, and
    know neither temperature nor plateau. A rig may have both: the share of the elements does not follow the flag.

    The elastic constants without a value are those of austenite (GitHub confluentmedical/nitinol-design-concepts,
    115-open-frame-shape-set; measured moduli go from 40 to 80 GPa, doi 10.1016/j.commatsci.2021.110357).
    """

    youngs_modulus_GPa: float = 62.9
    poissons_ratio: float = 0.33
    loop_share: float = 0.0
    loop_angle_deg: float = 1.0

    def __post_init__(self) -> None:
        require_numbers("material", self)
        require(self.youngs_modulus_GPa > 0, "material.youngs_modulus_GPa", self.youngs_modulus_GPa, "above 0")
        require(-1 < self.poissons_ratio < 0.5, "material.poissons_ratio", self.poissons_ratio, "in (-1, 0.5)")
        require(0 <= self.loop_share < 1, "material.loop_share", self.loop_share, "in [0, 1)")
        require(self.loop_angle_deg > 0, "material.loop_angle_deg", self.loop_angle_deg, "above 0")


@dataclass(frozen=True)
class Tendon:
    """One tendon from the wheel to the tip.

    Parameters
    ----------
    EA_N
        Axial stiffness times length of the taut tendon.
    moment_arm_mm
        Distance of the tendon from the tube axis; in a rig file at most the outer radius. One-sided notches shift the
        neutral axis: see :class:`fem_models.joint.mechanics.JointMechanics`. For measured joints it is the moment arm
        itself.
    free_length_mm
        Length of the tendon between wheel and base.
    toe_N
        Tension of the toe region: between wheel and base the tendon has k(T) = k_inf T / (T + toe_N). 0 is a linear
        tendon.
    """

    EA_N: float
    moment_arm_mm: float
    free_length_mm: float
    toe_N: float = 0.0

    def __post_init__(self) -> None:
        require_numbers("tendon", self)
        for name in ("EA_N", "free_length_mm"):
            require(getattr(self, name) > 0, f"tendon.{name}", getattr(self, name), "above 0")
        require_length("tendon.moment_arm_mm", self.moment_arm_mm)
        require(self.toe_N >= 0, "tendon.toe_N", self.toe_N, "at least 0")


@dataclass(frozen=True)
class Friction:
    """Dry friction of a tendon at its guides.

    Parameters
    ----------
    capstan_coefficient
        mu of T2 = T1 exp(mu phi), phi being the wrap of the tendon at a guide.
    guide_N
        Friction of one guide that does not depend on the tension.
    sheath_N
        The same between wheel and base, acting at the base.
    rest_wrap_deg
        Wrap at the base with the manipulator straight, from the path between wheel and base.
    stick_compliance_mm_per_N
        Compliance of a guide that sticks, before it slides: asperities and a polymer's liner give way (the bristles
        of Canudas de Wit et al. 1995, doi 10.1109/9.376053). 0 is friction that holds until it slides.
    """

    capstan_coefficient: float = 0.0
    guide_N: float = 0.0
    sheath_N: float = 0.0
    rest_wrap_deg: float = 0.0
    stick_compliance_mm_per_N: float = 0.0

    def __post_init__(self) -> None:
        require_numbers("friction", self)
        for f in fields(self):
            require(getattr(self, f.name) >= 0, f"friction.{f.name}", getattr(self, f.name), "at least 0")


@dataclass(frozen=True)
class Wheel:
    """The wheel on which both tendons are wound, in opposite directions."""

    radius_mm: float

    def __post_init__(self) -> None:
        require_numbers("wheel", self)
        require_length("wheel.radius_mm", self.radius_mm)


EFFECT_TABLES = tuple(EFFECTS)
"""Names of the optional effects of a rig, off by default."""


@checked_class(RigError)
@dataclass(frozen=True, repr=False)
class Rig:
    """A manipulator with two antagonistic tendons on one wheel, or with a single tendon.

    ``joint`` gives the notches of a tube, equal or different, or the stiffness of measured joints, which are
    equal. A positive drive pulls tendon a, which bends the manipulator towards positive angles. The optional parts from
    ``slack`` on are effects, off by default, each in :mod:`fem_models.rig.effects`.

    With a single tendon (``tendon_b`` None) the flexures spring back; the preload may be 0 unless the tendon has a toe
    region. ``precurvature_deg`` is the angle of every joint without load. At that shape the tendons have their rest
    length and the drive is zero.

    ``layout`` makes the rig bend in space: turned notches, tendons round the tube, wheels, loads in any direction. The
    rest is then the rig as if no notch were turned. Axes: x along the straight tube from base to tip, y where a notch
    without turn bends to, z = x times y. None is a rig of one plane.
    """

    name: str
    material: Material
    tendon_a: Tendon
    tendon_b: Tendon | None
    wheel: Wheel
    preload_N: float
    precurvature_deg: float = 0.0
    friction: Friction = field(default_factory=Friction)
    joint: NotchedTube | MeasuredJoint = field(kw_only=True)
    slack: Slack | None = None
    backlash: Backlash | None = None
    eccentricity: Eccentricity | None = None
    superelastic: Superelastic | None = None
    closure: Closure | None = None
    gravity: Gravity | None = None
    tip_stop: TipStop | None = None
    creep: Creep | None = None
    drag: Drag | None = None
    preload_loss: PreloadLoss | None = None
    fatigue: Fatigue | None = None
    tip_load: TipLoad | None = None
    drive_gain: DriveGain | None = None
    stribeck: Stribeck | None = None
    position_friction: PositionFriction | None = None
    run_in: RunIn | None = None
    tip_mass: TipMass | None = None
    layout: Layout | None = None

    def __post_init__(self) -> None:
        for name in ("preload_N", "precurvature_deg"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise RigError(f"{name} = {quoted(value)}: expected a number")
            require_in_range(name, value)
        single = self.tendon_b is None and self.tendon_a.toe_N == 0
        taut = math.isfinite(self.preload_N) and (self.preload_N > 0 or (single and self.preload_N == 0))
        require(taut, "preload_N", self.preload_N, "at least 0" if single else "above 0")
        require(abs(self.precurvature_deg) < 90, "precurvature_deg", self.precurvature_deg, "within +-90")
        match self.joint:
            case NotchedTube(tube):
                for name, tendon in zip(("tendon_a", "tendon_b"), self.tendons, strict=False):
                    require(
                        tendon.moment_arm_mm < tube.outer_diameter_mm,
                        f"{name}.moment_arm_mm",
                        tendon.moment_arm_mm,
                        f"below tube.outer_diameter_mm = {tube.outer_diameter_mm}",
                    )
            case MeasuredJoint():
                needs_angle = self.closure is not None and self.closure.angle_deg is None
                require(not needs_angle, "closure.angle_deg", None, "a number: measured joints have no notch")
        if self.layout is not None:
            known = f"none in space: of the effects there are {', '.join(KNOWN_EFFECTS)}"
            for name in EFFECT_TABLES:
                require(name in KNOWN_EFFECTS or getattr(self, name) is None, name, "given", known)
            measured = isinstance(self.joint, MeasuredJoint)
            require(not measured, "bench", "given", "[tube] and [notch] of a rig in space")
            count, n = len(self.layout.turns_deg), self.joints
            require(count == n, "notch.turn_deg", f"{count} angles", f"one for each of {n} notches")

    @property
    def is_planar(self) -> bool:
        """Whether the rig bends in one plane."""
        return self.layout is None

    @property
    def in_plane(self) -> Rig:
        """The rig as if no notch were turned; itself where it bends in one plane."""
        return self if self.layout is None else replace(self, layout=None)

    @property
    def tendons(self) -> tuple[Tendon, ...]:
        """Tendon a and, where there is one, tendon b; in space every tendon, in the order of its angle."""
        own = (self.tendon_a,) if self.tendon_b is None else (self.tendon_a, self.tendon_b)
        if self.layout is None or len(own) == len(self.layout.angles_deg):
            return own
        return (self.tendon_a,) * len(self.layout.angles_deg)

    @property
    def turns_deg(self) -> tuple[float, ...]:
        """Turn of each notch about the tube axis, from y towards z."""
        return (0.0,) * self.joints if self.layout is None else self.layout.turns_deg

    @property
    def angles_deg(self) -> tuple[float, ...]:
        """Angles of the tendons round the tube, from y towards z: tendon a at 0, tendon b at 180 in one plane."""
        return (0.0, 180.0)[: len(self.tendons)] if self.layout is None else self.layout.angles_deg

    @property
    def wheels(self) -> tuple[int, ...]:
        """Number of the wheel of each tendon, from 1."""
        return (1,) * len(self.tendons) if self.layout is None else self.layout.wheels

    @property
    def wheel_count(self) -> int:
        """Number of wheels."""
        return max(self.wheels)

    def winding(self) -> Floats:
        """Give what a drive of each wheel winds in of each tendon: 1, -1 or 0, shape (wheels, tendons)."""
        return winding(self.wheels)

    def winds_both_ways(self, wheel: int) -> bool:
        """Whether a wheel, counted from 1, has a second tendon, which a positive drive lets out."""
        return self.wheels.count(wheel) > 1

    def with_preload(self, preload_N: float | None) -> Rig:
        """Return the rig at another preload; itself for None."""
        return self if preload_N is None else replace(self, preload_N=preload_N)

    @property
    def depends_on_rate(self) -> bool:
        """Whether a quasi-static loop depends on the times of its program: self-heating, creep, drag, speed."""
        heats = self.superelastic is not None and self.superelastic.heating_time_s is not None
        return heats or any(part is not None for part in (self.creep, self.drag, self.stribeck))

    @property
    def joints(self) -> int:
        """Number of single notched rings."""
        return self.joint.joints

    @property
    def pitch_mm(self) -> float:
        """Joint to joint distance, mm; a RigError where it differs from notch to notch."""
        return self.joint.pitch_mm

    @property
    def length_mm(self) -> float:
        """Length from base to tip, mm."""
        return self.joint.length_mm

    @property
    def mean_pitch_mm(self) -> float:
        """Length over the number of joints, mm; the pitch where all joints are equal."""
        return self.pitch_mm if self.joint.alike else self.length_mm / self.joints

    def parts(self) -> dict[str, str | float | DataclassInstance | None]:
        """Values of a rig but its layout by their names in a rig file; ``joint`` is [tube] and [notch], or [bench]."""
        out: dict[str, str | float | DataclassInstance | None] = {}
        for f in fields(self):
            if f.name == "layout":
                continue
            match getattr(self, f.name):
                case NotchedTube(tube, notch):
                    out |= {"tube": tube, "notch": notch}
                case MeasuredJoint() as measured:
                    out["bench"] = measured
                case value:
                    out[f.name] = value
        return out

    def to_dict(self) -> dict[str, Any]:
        """Nested plain values for TOML and JSON, without absent parts; a single tendon gives ``tendons`` = 1."""
        out = {
            name: value if isinstance(value, str | float | int) else _plain(value)
            for name, value in self.parts().items()
            if value is not None
        }
        if self.layout is not None:
            return self.layout.in_tables(out)
        return out | ({"tendons": 1} if self.tendon_b is None else {})

    def __repr__(self) -> str:
        if self.layout is not None:
            counts = {"notch": self.joints, "tendon": len(self.angles_deg), "wheel": self.wheel_count}
            ends = {"notch": "es"}
            notches, tendons, wheels = (f"{n} {name}{ends.get(name, 's') * (n != 1)}" for name, n in counts.items())
            return f"Rig({self.name!r}, {notches}, {tendons} on {wheels}, preload {self.preload_N:g} N)"
        made = "measured joints" if isinstance(self.joint, MeasuredJoint) else "notches"
        tendons = f"{len(self.tendons)} tendon{'s' if self.tendon_b else ''}"
        effects = "".join(f", {name}" for name in EFFECT_TABLES if getattr(self, name) is not None)
        return f"Rig({self.name!r}, {self.joints} {made}, {tendons}, preload {self.preload_N:g} N{effects})"

    def _repr_html_(self) -> str:
        parts = {name: value for name, value in self.to_dict().items() if name != "name"}
        rows = [
            (name, ", ".join(f"{k} = {v}" for k, v in value.items()) if isinstance(value, dict) else f"{value}")
            for name, value in parts.items()
        ]
        return html_table(f"rig {self.name}", rows)


def _plain(part: DataclassInstance) -> dict[str, float | str | list[float]]:
    values = {name: value for name, value in asdict(part).items() if value is not None and value != ()}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


def require_planar(rig: Rig) -> Rig:
    """Give a rig of one plane as it is.

    Raises
    ------
    RigError
        A rig that bends in space.
    """
    if not rig.is_planar:
        raise RigError(f"rig {rig.name} {IN_SPACE}")
    return rig


def rig_in_space(rig: Rig, keys: LayoutKeys | None = None) -> Rig:
    """Take a planar rig into space, with what a rig file says of it.

    Without angles the tendons are a at 0 and b, if there is one, at 180 degrees.

    Raises
    ------
    RigError
        Measured joints, an effect that the chain in space does not have, or a number of turns other than that of the
        notches.
    """
    keys = keys or LayoutKeys("")
    turns = keys.turns_deg if isinstance(keys.turns_deg, tuple) else (keys.turns_deg,) * rig.joints
    angles = keys.angles_deg or rig.angles_deg
    wheels = keys.wheels or wheels_of_pairs(angles)
    return replace(rig, layout=Layout(turns, angles, wheels, keys.tip_force_N, keys.ring, keys.tip))


def numeric_fields(rig: Rig) -> dict[str, float]:
    """Every number of a rig by dotted name, for tables of sources and for studies; none that differs along the tube."""
    out: dict[str, float] = {}
    for name, value in rig.parts().items():
        if is_dataclass(value):
            for f in fields(value):
                number = getattr(value, f.name)
                if isinstance(number, int | float) and not isinstance(number, bool):
                    out[f"{name}.{f.name}"] = number
        elif isinstance(value, int | float):
            out[name] = value
    return out


def with_number(rig: Rig, name: str, value: float) -> Rig:
    """Return the rig with one number changed; its name is dotted, as in :func:`numeric_fields`.

    Raises
    ------
    RigError
        A name that is not a number of this rig, or an impossible value.
    """
    if name not in numeric_fields(rig):
        raise RigError(f"{name} = {value}: expected a number of rig {rig.name}")
    part, _, key = name.rpartition(".")
    if not part:
        return _with_part(rig, name, value)
    change: dict[str, Any] = {key: value}
    return _with_part(rig, part, replace(rig.parts()[part], **change))  # type: ignore[type-var]


def _with_part(rig: Rig, name: str, value: object) -> Rig:
    match value:
        case Tube():
            return replace(rig, joint=replace(notched_tube(rig), tube=value))
        case Notch():
            return with_notch(rig, value)
        case MeasuredJoint():
            return replace(rig, joint=value)
    change: dict[str, Any] = {name: value}
    return replace(rig, **change)


def notched_tube(rig: Rig) -> NotchedTube:
    """Tube and notches of a rig.

    Raises
    ------
    RigError
        Measured joints.
    """
    if not isinstance(rig.joint, NotchedTube):
        raise RigError(f"rig {rig.name}: measured joints: expected [tube] and [notch]")
    return rig.joint


def with_notch(rig: Rig, notch: Notch) -> Rig:
    """Return the rig with another notch in the same tube.

    Raises
    ------
    RigError
        As :func:`notched_tube`; a notch that would cut the tube in two.
    """
    return replace(rig, joint=replace(notched_tube(rig), notch=notch))


def with_joint(rig: Rig, number: int) -> Rig:
    """Return the rig with all joints as the one of a number, 0 at the base; itself where all are equal."""
    return rig if rig.joint.alike else replace(rig, joint=rig.joint.of_joint(number))
