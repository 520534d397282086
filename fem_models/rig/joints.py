"""The joints of a manipulator: notches cut into a tube, or joints known by measurement alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Literal, NamedTuple

from fem_models.rig.checks import MOST_JOINTS, RigError, require, require_length, require_numbers

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


OfEach = float | tuple[float, ...]
"""A number of a notch: one for all notches, or one for each, from the base to the tip."""
OF_EACH: tuple[str, ...] = ("depth_mm", "width_mm", "spacing_mm", "root_width_mm")
"""Fields of a notch that may differ along the tube."""


class Cut(NamedTuple):
    """One notch; the fields are those of :class:`Notch`."""

    shape: NotchShape
    depth_mm: float
    width_mm: float
    spacing_mm: float
    root_width_mm: float | None
    rigid_roots: bool

    @property
    def pitch_mm(self) -> float:
        """Length of the notch and of the ring beyond it, mm."""
        return self.width_mm + self.spacing_mm


class Places(NamedTuple):
    """Where notches and rings stand along the straight tube, mm from the base; tuples of N.

    ``middles`` are of the notches, ``centres`` of the rings beyond them, the last of which is the tip.
    """

    middles: tuple[float, ...]
    centres: tuple[float, ...]


@dataclass(frozen=True)
class Notch:
    """A row of notches, equal or different.

    ``depth_mm``, ``width_mm``, ``spacing_mm`` and ``root_width_mm`` are a number for all notches or a tuple of
    ``count`` numbers, the notch at the base first. A tuple of equal numbers becomes the number.

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
        Uncut tube beyond a notch, up to the next one or to the end; the pitch is ``width_mm + spacing_mm``. Before the
        first notch it is as long as beyond it. Base and tip are in the middle of the first and of the last ring.
    root_width_mm
        Width of the flat root of a V (wire kerf). A slot has one width at all depths and takes None.
    rigid_roots
        Whether rings are rigid where flexures are rooted in them, as in the paper's analytic model. Real rings are
        not: :mod:`fem_models.joint.roots`.
    """

    shape: NotchShape
    count: int
    depth_mm: OfEach
    width_mm: OfEach
    spacing_mm: OfEach
    root_width_mm: OfEach | None = None
    rigid_roots: bool = False

    def __post_init__(self) -> None:
        require(isinstance(self.rigid_roots, bool), "notch.rigid_roots", self.rigid_roots, "true or false")
        require(self.shape in NOTCH_SHAPES, "notch.shape", self.shape, "one of " + ", ".join(NOTCH_SHAPES))
        for name in OF_EACH:
            if isinstance(value := getattr(self, name), list):
                object.__setattr__(self, name, tuple(value))
        require_numbers("notch", self, lists=OF_EACH)
        require(
            isinstance(self.count, int) and 1 <= self.count <= MOST_JOINTS,
            "notch.count",
            self.count,
            f"a whole number of at least 1, at most {MOST_JOINTS:,}",
        )
        for name in OF_EACH:
            self._take(name)
        for name in ("depth_mm", "width_mm", "spacing_mm"):
            for label, value in self.named(name):
                require_length(label, value)
        if self.shape == "v_pair":
            root = self.root_width_mm
            require(root is not None, "notch.root_width_mm", root, "a number: a V needs the width of its root")
            for k, (label, value) in enumerate(self.named("root_width_mm")):
                width = _of(self.width_mm, k)
                require(0 <= value < width, label, value, f"at least 0 and below notch.width_mm = {width}")
        else:
            require(self.root_width_mm is None, "notch.root_width_mm", self.root_width_mm, "absent for a slot")

    def _take(self, name: str) -> None:
        """Check how many numbers a field has; equal ones become one."""
        values = getattr(self, name)
        if not isinstance(values, tuple):
            return
        if len(values) != self.count:
            found = f"{len(values)} number{'s' * (len(values) != 1)}"
            raise RigError(f"notch.{name} = {found}: expected one number, or {self.count}, one a notch")
        if all(value == values[0] for value in values):
            object.__setattr__(self, name, values[0])

    def named(self, name: str) -> list[tuple[str, float]]:
        """Numbers of a field with their names for messages; one for all notches where they are equal.

        A root that is broader than some of the widths has a number for each notch.
        """
        values = getattr(self, name)
        if not isinstance(values, tuple) and name == "root_width_mm" and isinstance(self.width_mm, tuple):
            values = (values,) * self.count
        if isinstance(values, tuple):
            return [(f"notch.{name} of notch {k}", value) for k, value in enumerate(values, start=1)]
        return [(f"notch.{name}", values)]

    @cached_property
    def alike(self) -> bool:
        """Whether all notches are equal; computed once, because searches ask ten thousand times."""
        return not any(isinstance(getattr(self, name), tuple) for name in OF_EACH)

    def at(self, number: int) -> Cut:
        """One notch, by its number from the base, 0."""
        root = None if self.root_width_mm is None else _of(self.root_width_mm, number)
        depth, width, spacing = (_of(values, number) for values in (self.depth_mm, self.width_mm, self.spacing_mm))
        return Cut(self.shape, depth, width, spacing, root, self.rigid_roots)


def _of(values: OfEach, number: int) -> float:
    return values[number] if isinstance(values, tuple) else values


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
        outer = self.tube.outer_diameter_mm
        limit = outer / (1 if self.one_sided else 2)
        which = "the outer diameter" if self.one_sided else "the outer radius, for cuts from both sides"
        for label, depth in self.notch.named("depth_mm"):
            require(depth < limit, label, depth, f"below {limit:g} mm, {which}")

    @property
    def one_sided(self) -> bool:
        """Whether the notches are on one side of the tube only."""
        return self.notch.shape == "rectangular"

    @property
    def joints(self) -> int:
        """Number of notches."""
        return self.notch.count

    @property
    def alike(self) -> bool:
        """Whether all notches are equal."""
        return self.notch.alike

    @cached_property
    def cut(self) -> Cut:
        """The notch, where all are equal.

        Raises
        ------
        RigError
            Notches that differ.
        """
        for name in OF_EACH:
            if isinstance(getattr(self.notch, name), tuple):
                raise RigError(f"notch.{name}: differs from notch to notch: expected one number here")
        return self.notch.at(0)

    @property
    def pitch_mm(self) -> float:
        """Joint to joint distance, mm.

        Raises
        ------
        RigError
            A pitch that differs from notch to notch.
        """
        for name, value in (("width_mm", self.notch.width_mm), ("spacing_mm", self.notch.spacing_mm)):
            if isinstance(value, tuple):
                raise RigError(f"notch.{name}: differs from notch to notch: expected one pitch here")
        return self.notch.at(0).pitch_mm

    @property
    def length_mm(self) -> float:
        """Length from base to tip, mm."""
        if not isinstance(self.notch.width_mm, tuple) and not isinstance(self.notch.spacing_mm, tuple):
            return self.joints * self.pitch_mm
        return self.places().centres[-1]

    def places(self) -> Places:
        """Where notches and rings stand along the straight tube."""
        cuts = [self.notch.at(k) for k in range(self.joints)]
        if len({(cut.width_mm, cut.spacing_mm) for cut in cuts}) == 1:
            return even_places(self.joints, cuts[0].pitch_mm)
        ends = list(accumulate((cut.pitch_mm for cut in cuts), initial=cuts[0].spacing_mm / 2))
        middles = tuple(end + cut.width_mm / 2 for end, cut in zip(ends, cuts, strict=False))
        return Places(middles, tuple(end - cut.spacing_mm / 2 for end, cut in zip(ends[1:], cuts, strict=True)))

    def of_joint(self, number: int) -> NotchedTube:
        """Tube of one notch alone, by its number from the base, 0; the tube itself where all are equal.

        Its rings are as long as the mean of those on either side: the pitch is the length of tendon from the middle of
        one to that of the other.
        """
        if self.alike:
            return self
        cut, before = self.notch.at(number), self.notch.at(max(number - 1, 0))
        spacing = 0.5 * (before.spacing_mm + cut.spacing_mm)
        notch = Notch(cut.shape, 1, cut.depth_mm, cut.width_mm, spacing, cut.root_width_mm, cut.rigid_roots)
        return NotchedTube(self.tube, notch)


def even_places(joints: int, pitch_mm: float) -> Places:
    """Places of joints at equal distances."""
    return Places(tuple((k + 0.5) * pitch_mm for k in range(joints)), tuple((k + 1) * pitch_mm for k in range(joints)))


LAW: tuple[str, ...] = ("law_share", "law_onset_deg", "law_return", "law_span_deg")
"""Fields of the moment-angle law of a measured joint: one number an element."""
MOST_ELEMENTS = 64


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
    law_share, law_onset_deg, law_return, law_span_deg
        A moment-angle law in place of a linear flexure: flag elements in parallel, one number each
        (:class:`fem_models.joint.superelastic.FlagFibres`). An element has a share of the stiffness. Its moment is
        constant from the angle of its onset on, over its span; beyond the span the element is as stiff as before it.
        On the way back the moment is ``law_return`` times as large: 1 is elastic, less is a superelastic loop.
        ``notchbend import`` fits them to the curve of a bench or of finite elements.
    """

    joints: int
    pitch_mm: float
    flexure_stiffness_Nmm_per_rad: float
    rigid_gap_mm: float = 0.0
    roots_share: float = 0.0
    hardening_slope: float = 0.0
    hardening_limit: float = 0.0
    hardening_angle_deg: float = 5.0
    law_share: tuple[float, ...] = ()
    law_onset_deg: tuple[float, ...] = ()
    law_return: tuple[float, ...] = ()
    law_span_deg: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name in LAW:
            object.__setattr__(self, name, tuple(getattr(self, name)))
        require_numbers("rig", self, lists=LAW)
        self._require_law()
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

    @property
    def has_law(self) -> bool:
        """Whether a moment-angle law takes the place of the linear flexure."""
        return bool(self.law_share)

    def _require_law(self) -> None:
        """Check the elements of the law."""
        count = len(self.law_share)
        for name in LAW:
            values = getattr(self, name)
            require(
                len(values) == count, f"rig.{name}", f"{len(values)} numbers", f"{count}, one an element of the law"
            )
        if not count:
            return
        require(count <= MOST_ELEMENTS, "rig.law_share", f"{count} numbers", f"at most {MOST_ELEMENTS}")
        require(all(one > 0 for one in self.law_share), "rig.law_share", min(self.law_share), "above 0")
        total = sum(self.law_share)
        require(abs(total - 1) < 1e-6, "rig.law_share", f"{total:.9g} in sum", "1 in sum")
        require(all(one > 0 for one in self.law_onset_deg), "rig.law_onset_deg", min(self.law_onset_deg), "above 0")
        require(all(one > 0 for one in self.law_span_deg), "rig.law_span_deg", min(self.law_span_deg), "above 0")
        for one in self.law_return:
            require(0 < one <= 1, "rig.law_return", one, "above 0, at most 1")
        for name in ("hardening_slope", "hardening_limit", "roots_share"):
            require(getattr(self, name) == 0, f"rig.{name}", getattr(self, name), "0 with a law of its own, law_share")

    @property
    def alike(self) -> bool:
        """Measured joints are."""
        return True

    @property
    def length_mm(self) -> float:
        """Length from base to tip, mm."""
        return self.joints * self.pitch_mm

    def places(self) -> Places:
        """Where joints and rings stand along the straight tube."""
        return even_places(self.joints, self.pitch_mm)

    def of_joint(self, number: int) -> MeasuredJoint:
        """Joint by its number from the base, 0: all are equal."""
        return self
