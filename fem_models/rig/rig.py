"""The rig: frozen values, checked where they are made. Units stand in the names (mm, N, GPa, deg)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from typing import Any, Literal

from fem_models.rig.checks import RigError, require, require_numbers
from fem_models.rig.effects import (
    Backlash,
    Closure,
    Creep,
    Drag,
    Eccentricity,
    Fatigue,
    Gravity,
    PreloadLoss,
    Slack,
    Superelastic,
    TipStop,
)

NotchShape = Literal["v_pair", "rectangular_pair", "rectangular"]
NOTCH_SHAPES: tuple[str, ...] = ("v_pair", "rectangular_pair", "rectangular")


@dataclass(frozen=True)
class Tube:
    """The tube that is notched. Diameters in mm, outer above inner, both positive."""

    outer_diameter_mm: float
    inner_diameter_mm: float

    def __post_init__(self) -> None:
        require_numbers("tube", self)
        require(self.inner_diameter_mm > 0, "tube.inner_diameter_mm", self.inner_diameter_mm, "above 0")
        require(
            self.inner_diameter_mm < self.outer_diameter_mm,
            "tube.inner_diameter_mm",
            self.inner_diameter_mm,
            f"below tube.outer_diameter_mm = {self.outer_diameter_mm}",
        )


@dataclass(frozen=True)
class Notch:
    """A row of equal notches.

    Parameters
    ----------
    shape
        ``v_pair``: two opposed V cuts (the paper); ``rectangular_pair``: two opposed slots;
        ``rectangular``: one-sided slots (York et al., ICRA 2015).
    count
        Number of joints.
    depth_mm
        Depth of one cut from the outer surface.
    width_mm
        Opening along the tube axis at the outer surface.
    spacing_mm
        Uncut tube between two notches; the pitch is ``width_mm + spacing_mm``.
    root_width_mm
        Width of the flat root of a V (wire kerf); slots have the same width all the way and take None.
    rigid_roots
        Whether rings are rigid where flexures are rooted in them, as in the paper's analytic model. Metal is not:
        :mod:`fem_models.joint.roots`.
    """

    shape: NotchShape
    count: int
    depth_mm: float
    width_mm: float
    spacing_mm: float
    root_width_mm: float | None = None
    rigid_roots: bool = False

    def __post_init__(self) -> None:
        require(isinstance(self.rigid_roots, bool), "notch.rigid_roots", self.rigid_roots, "true or false")
        require(self.shape in NOTCH_SHAPES, "notch.shape", self.shape, "one of " + ", ".join(NOTCH_SHAPES))
        require_numbers("notch", self)
        require(
            isinstance(self.count, int) and self.count >= 1,
            "notch.count",
            self.count,
            "a whole number of at least 1",
        )
        for name in ("depth_mm", "width_mm", "spacing_mm"):
            require(getattr(self, name) > 0, f"notch.{name}", getattr(self, name), "above 0")
        if self.shape == "v_pair":
            root = self.root_width_mm
            require(root is not None, "notch.root_width_mm", root, "a number: a V needs the width of its root")
            assert root is not None
            require(
                0 <= root < self.width_mm,
                "notch.root_width_mm",
                root,
                f"at least 0 and below notch.width_mm = {self.width_mm}",
            )
        else:
            require(self.root_width_mm is None, "notch.root_width_mm", self.root_width_mm, "absent for a slot")

    @property
    def pitch_mm(self) -> float:
        """Joint to joint distance, mm."""
        return self.width_mm + self.spacing_mm


def check_cut(tube: Tube, notch: Notch) -> None:
    """Raise a RigError where the notch would cut the tube in two."""
    one_sided = notch.shape == "rectangular"
    limit = tube.outer_diameter_mm / (1 if one_sided else 2)
    which = "the outer diameter" if one_sided else "the outer radius, for cuts from both sides"
    require(notch.depth_mm < limit, "notch.depth_mm", notch.depth_mm, f"below {limit:g} mm, {which}")


@dataclass(frozen=True)
class Material:
    """Nitinol of the flexures: linear elasticity and, in parallel, a rate-independent material loop.

    ``loop_share`` is the part of the flexure's bending stiffness carried by Jenkins elements (elastic up
    to a slip moment); their slip angles are spread evenly up to ``loop_angle_deg`` of one joint. A share
    of 0 switches the material loop off.
    """

    youngs_modulus_GPa: float
    poissons_ratio: float
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
        Axial stiffness times length of the taut rope.
    moment_arm_mm
        Distance of the tendon from the tube axis. One-sided notches shift the neutral axis: see
        :func:`fem_models.joint.flexure.moment_arms_mm`. For measured joints it is the moment arm itself.
    free_length_mm
        Rope between wheel and base.
    toe_N
        Tension of the toe region: the rope between wheel and base has k(T) = k_inf T / (T + toe_N).
        0 is a linear rope.
    """

    EA_N: float
    moment_arm_mm: float
    free_length_mm: float
    toe_N: float = 0.0

    def __post_init__(self) -> None:
        require_numbers("tendon", self)
        for name in ("EA_N", "moment_arm_mm", "free_length_mm"):
            require(getattr(self, name) > 0, f"tendon.{name}", getattr(self, name), "above 0")
        require(self.toe_N >= 0, "tendon.toe_N", self.toe_N, "at least 0")


@dataclass(frozen=True)
class Friction:
    """Dry friction of a tendon against what guides it.

    Parameters
    ----------
    capstan_coefficient
        mu of T2 = T1 exp(mu phi), phi being the wrap of the tendon at a guide.
    guide_N
        Friction of one guide that does not depend on the tension.
    sheath_N
        The same between wheel and base, acting at the base.
    rest_wrap_deg
        Wrap at the base with the manipulator straight (the way of the tendon from the wheel).
    """

    capstan_coefficient: float = 0.0
    guide_N: float = 0.0
    sheath_N: float = 0.0
    rest_wrap_deg: float = 0.0

    def __post_init__(self) -> None:
        require_numbers("friction", self)
        for f in fields(self):
            require(getattr(self, f.name) >= 0, f"friction.{f.name}", getattr(self, f.name), "at least 0")


@dataclass(frozen=True)
class Wheel:
    """The wheel on which both tendons are wound in opposite directions."""

    radius_mm: float

    def __post_init__(self) -> None:
        require_numbers("wheel", self)
        require(self.radius_mm > 0, "wheel.radius_mm", self.radius_mm, "above 0")


@dataclass(frozen=True)
class Bench:
    """Joints measured on the bench, in place of tube, notch and material constants.

    Stiffness is that of one joint; shear and axial compliance of such a joint are not known and left out. A joint bends
    over a fifth of its pitch; ``rigid_gap_mm`` is the length beside it, both ends together, that turns with the rings
    and that the tendon crosses freely, as it does a V notch beyond its root. ``roots_share`` is the part of the joint's
    compliance that the roots of the flexure in the rings have: superelastic metal stays elastic there.
    """

    joints: int
    pitch_mm: float
    flexure_stiffness_Nmm_per_rad: float
    rigid_gap_mm: float = 0.0
    roots_share: float = 0.0

    def __post_init__(self) -> None:
        require_numbers("rig", self)
        require(
            isinstance(self.joints, int) and self.joints >= 1,
            "rig.joints",
            self.joints,
            "a whole number >= 1",
        )
        require(self.pitch_mm > 0, "rig.pitch_mm", self.pitch_mm, "above 0")
        require(
            self.flexure_stiffness_Nmm_per_rad > 0,
            "rig.flexure_stiffness_Nmm_per_rad",
            self.flexure_stiffness_Nmm_per_rad,
            "above 0",
        )
        require(
            0 <= self.rigid_gap_mm <= 0.5 * self.pitch_mm,
            "rig.rigid_gap_mm",
            self.rigid_gap_mm,
            f"between 0 and half of rig.pitch_mm = {self.pitch_mm:g}",
        )
        require(0 <= self.roots_share < 1, "rig.roots_share", self.roots_share, "from 0 to below 1")


EFFECT_TABLES = (
    "slack",
    "backlash",
    "eccentricity",
    "superelastic",
    "closure",
    "gravity",
    "tip_stop",
    "creep",
    "drag",
    "preload_loss",
    "fatigue",
)
"""Names of the optional parts of a rig that are effects, off by default."""


@dataclass(frozen=True)
class Rig:
    """A manipulator with two antagonistic tendons on one wheel, or with one tendon alone.

    The joints come either from ``tube`` and ``notch`` or, measured, from ``bench``; exactly one of the two.
    Tendon a pulls towards positive angles when the drive is positive. The optional parts from ``slack`` on are
    effects that are off by default, each in :mod:`fem_models.rig.effects`.

    A rig of one tendon (``tendon_b`` None) springs back by its flexures; its preload may be 0 unless the tendon has a
    toe region. ``precurvature_deg`` is the angle that every joint has at rest, without load; the tendons have their
    rest length, and the drive its zero, at that shape.
    """

    name: str
    material: Material
    tendon_a: Tendon
    tendon_b: Tendon | None
    wheel: Wheel
    preload_N: float
    precurvature_deg: float = 0.0
    friction: Friction = field(default_factory=Friction)
    tube: Tube | None = None
    notch: Notch | None = None
    bench: Bench | None = None
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

    def __post_init__(self) -> None:
        for name in ("preload_N", "precurvature_deg"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise RigError(f"{name} = {value!r}: expected a number")
        single = self.tendon_b is None and self.tendon_a.toe_N == 0
        taut = math.isfinite(self.preload_N) and (self.preload_N > 0 or (single and self.preload_N == 0))
        require(taut, "preload_N", self.preload_N, "at least 0" if single else "above 0")
        require(abs(self.precurvature_deg) < 90, "precurvature_deg", self.precurvature_deg, "within +-90")
        if (self.tube is None) != (self.notch is None) or (self.tube is None) == (self.bench is None):
            raise RigError(f"rig {self.name}: expected either [tube] and [notch], or measured joints")
        if self.tube is not None and self.notch is not None:
            check_cut(self.tube, self.notch)
            for name, tendon in zip(("tendon_a", "tendon_b"), self.tendons, strict=False):
                require(
                    tendon.moment_arm_mm < self.tube.outer_diameter_mm,
                    f"{name}.moment_arm_mm",
                    tendon.moment_arm_mm,
                    f"below tube.outer_diameter_mm = {self.tube.outer_diameter_mm}",
                )
        if self.bench is not None:
            needs_angle = self.closure is not None and self.closure.angle_deg is None
            require(not needs_angle, "closure.angle_deg", None, "a number: measured joints have no notch")

    @property
    def tendons(self) -> tuple[Tendon, ...]:
        """Tendon a and, where there is one, tendon b."""
        return (self.tendon_a,) if self.tendon_b is None else (self.tendon_a, self.tendon_b)

    @property
    def joints(self) -> int:
        """Number of single notched rings."""
        return self.notch.count if self.notch is not None else self.bench.joints  # type: ignore[union-attr]

    @property
    def pitch_mm(self) -> float:
        """Joint to joint distance, mm."""
        return self.notch.pitch_mm if self.notch is not None else self.bench.pitch_mm  # type: ignore[union-attr]

    def to_dict(self) -> dict[str, Any]:
        """Nested plain values, for TOML and JSON; absent parts left out, an absent tendon b as ``tendons`` = 1."""

        def prune(table: Mapping[str, Any]) -> dict[str, Any]:
            return {k: prune(v) if isinstance(v, Mapping) else v for k, v in table.items() if v is not None}

        return prune(asdict(self)) | ({"tendons": 1} if self.tendon_b is None else {})


def numeric_fields(rig: Rig) -> dict[str, float]:
    """Every number of a rig under its dotted name, for tables of sources and for studies."""
    out: dict[str, float] = {}
    for f in fields(rig):
        value = getattr(rig, f.name)
        if is_dataclass(value):
            for g in fields(value):
                number = getattr(value, g.name)
                if isinstance(number, int | float) and not isinstance(number, bool):
                    out[f"{f.name}.{g.name}"] = number
        elif isinstance(value, int | float):
            out[f.name] = value
    return out
