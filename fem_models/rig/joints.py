"""The joints of a manipulator: notches cut into a tube, or joints known by measurement alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from fem_models.rig.checks import MOST_JOINTS, require, require_length, require_numbers

NotchShape = Literal["v_pair", "rectangular_pair", "rectangular"]
NOTCH_SHAPES: tuple[str, ...] = ("v_pair", "rectangular_pair", "rectangular")


@dataclass(frozen=True)
class Tube:
    """The tube before it is notched. Diameters in mm, outer above inner, both positive."""

    outer_diameter_mm: float
    inner_diameter_mm: float

    def __post_init__(self) -> None:
        require_numbers("tube", self)
        require_length("tube.inner_diameter_mm", self.inner_diameter_mm)
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
        Width of the flat root of a V (wire kerf). A slot has one width at all depths and takes None.
    rigid_roots
        Whether rings are rigid where flexures are rooted in them, as in the paper's analytic model. Real rings are
        not: :mod:`fem_models.joint.roots`.
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
            isinstance(self.count, int) and 1 <= self.count <= MOST_JOINTS,
            "notch.count",
            self.count,
            f"a whole number of at least 1, at most {MOST_JOINTS:,}",
        )
        for name in ("depth_mm", "width_mm", "spacing_mm"):
            require_length(f"notch.{name}", getattr(self, name))
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


@dataclass(frozen=True)
class NotchedTube:
    """A tube and the notches that are cut into it.

    Raises
    ------
    RigError
        A notch that would cut the tube in two.
    """

    tube: Tube
    notch: Notch

    def __post_init__(self) -> None:
        depth, outer = self.notch.depth_mm, self.tube.outer_diameter_mm
        limit = outer / (1 if self.one_sided else 2)
        which = "the outer diameter" if self.one_sided else "the outer radius, for cuts from both sides"
        require(depth < limit, "notch.depth_mm", depth, f"below {limit:g} mm, {which}")

    @property
    def one_sided(self) -> bool:
        """Whether the notches are on one side of the tube only."""
        return self.notch.shape == "rectangular"

    @property
    def joints(self) -> int:
        """Number of notches."""
        return self.notch.count

    @property
    def pitch_mm(self) -> float:
        """Joint to joint distance, mm."""
        return self.notch.pitch_mm


@dataclass(frozen=True)
class MeasuredJoint:
    """Joints whose stiffness was measured, in place of tube, notch and elastic constants; ``[bench]`` of a rig file.

    Parameters
    ----------
    joints
        Number of joints.
    pitch_mm
        Joint to joint distance.
    flexure_stiffness_Nmm_per_rad
        Bending stiffness of one joint. Its shear and axial compliance are not known and left out.
    rigid_gap_mm
        Length beside the part that bends (a fifth of the pitch), both ends together. It moves with the rings, and the
        tendon crosses it freely, as it crosses a V notch beyond its root.
    roots_share
        Share of the joint's compliance at the roots of the flexure in the rings, where superelastic metal stays
        elastic.
    hardening_slope, hardening_limit, hardening_angle_deg
        The bending stiffness of a real flexure varies along the bend. Over the one at rest it is
        1 + (slope u + limit u^2) / (1 + u^2), u being the angle from rest over ``hardening_angle_deg``: it begins to
        grow by the slope, and far beyond that angle it is larger by the limit. Negative numbers soften. It stays
        above 0 where limit - sqrt(slope^2 + limit^2) > -2.
    """

    joints: int
    pitch_mm: float
    flexure_stiffness_Nmm_per_rad: float
    rigid_gap_mm: float = 0.0
    roots_share: float = 0.0
    hardening_slope: float = 0.0
    hardening_limit: float = 0.0
    hardening_angle_deg: float = 5.0

    def __post_init__(self) -> None:
        require_numbers("rig", self)
        require(
            isinstance(self.joints, int) and 1 <= self.joints <= MOST_JOINTS,
            "rig.joints",
            self.joints,
            f"a whole number >= 1, at most {MOST_JOINTS:,}",
        )
        require_length("rig.pitch_mm", self.pitch_mm)
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
        require(self.hardening_angle_deg > 0, "rig.hardening_angle_deg", self.hardening_angle_deg, "above 0")
        slope, limit = self.hardening_slope, self.hardening_limit
        positive = limit - math.hypot(slope, limit) > -2
        require(positive, "rig.hardening_slope", slope, f"a stiffness above 0 with hardening_limit = {limit:g}")
        require(0 <= self.roots_share < 1, "rig.roots_share", self.roots_share, "from 0 to below 1")
