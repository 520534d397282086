"""The tubes that a search may try: stock sizes, whole numbers of notches, dimensions that can be cut."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.joints import Notch, NotchedTube, NotchShape, Tube
from fem_models.rig.rig import notched_tube
from hysteresis.arrays import Floats
from studies.design.measure import Wire
from studies.design.requirement import Requirements
from studies.design.stock import TubeSize, WireSize


@dataclass(frozen=True)
class Cutting:
    """What the cutting process can do: ``kerf_mm``, ``least_bridge_mm`` of metal left, and dimensions on a grid."""

    kerf_mm: float
    least_bridge_mm: float
    grid_mm: float


@dataclass(frozen=True)
class Ranges:
    """Ranges of the numbers of a tube; ``depth_share`` is the depth over what would cut the tube in two."""

    count: tuple[int, int]
    depth_share: tuple[float, float]
    width_mm: tuple[float, float]
    spacing_mm: tuple[float, float]
    preload_N: tuple[float, float]


@dataclass(frozen=True)
class Candidate:
    """A tube that may be tried: what is bought and what is cut."""

    tube: TubeSize
    wire: WireSize
    count: int
    depth_mm: float
    width_mm: float
    spacing_mm: float
    preload_N: float

    def values(self) -> dict[str, float]:
        """Give its numbers by dotted names of a rig file, and the wire."""
        return {
            "tube.outer_diameter_mm": self.tube.outer_mm,
            "tube.inner_diameter_mm": self.tube.inner_mm,
            "wire_mm": self.wire.diameter_mm,
            "notch.count": self.count,
            "notch.depth_mm": self.depth_mm,
            "notch.width_mm": self.width_mm,
            "notch.spacing_mm": self.spacing_mm,
            "preload_N": self.preload_N,
        }


@dataclass(frozen=True)
class Space:
    """All tubes of a search: ``base`` has the metal, the friction and the rest of the rig."""

    base: Rig
    shape: NotchShape
    tubes: tuple[TubeSize, ...]
    wires: tuple[WireSize, ...]
    cutting: Cutting
    ranges: Ranges

    @property
    def size(self) -> int:
        """Number of variables: a tube, a wire, a count, three lengths, and a preload with two tendons."""
        return 7 if self.base.tendon_b is not None else 6

    def candidate(self, unit: Floats) -> Candidate:
        """Make the tube of a point of the unit cube, shape (size,)."""
        u, ranges = np.clip(unit, 0.0, 1.0).tolist(), self.ranges
        tube, wire = _pick(self.tubes, u[0]), _pick(self.wires, u[1])
        count = _pick(range(ranges.count[0], ranges.count[1] + 1), u[2])
        severed = tube.outer_mm * (1.0 if self.shape == "rectangular" else 0.5)
        preload = self.base.preload_N if len(u) < 7 else round(_at(ranges.preload_N, u[6]), 1)
        return Candidate(
            tube=tube,
            wire=wire,
            count=count,
            depth_mm=self._on_grid(_at(ranges.depth_share, u[3]) * severed),
            width_mm=self._on_grid(_at(ranges.width_mm, u[4])),
            spacing_mm=self._on_grid(_at(ranges.spacing_mm, u[5])),
            preload_N=preload,
        )

    def _on_grid(self, length: float) -> float:
        grid = self.cutting.grid_mm
        return round(max(round(length / grid), 1) * grid, 6)

    def rig(self, candidate: Candidate, name: str = "design") -> Rig:
        """Make the rig of a tube: its tendons lie along the inner wall.

        Raises
        ------
        RigError
            A tube that cannot be made.
        """
        one = candidate
        root = self.cutting.kerf_mm if self.shape == "v_pair" else None
        rigid = notched_tube(self.base).notch.rigid_roots
        notch = Notch(self.shape, one.count, one.depth_mm, one.width_mm, one.spacing_mm, root, rigid)
        arm = 0.5 * (one.tube.inner_mm - one.wire.diameter_mm)
        tendon = replace(self.base.tendon_a, EA_N=one.wire.EA_N, moment_arm_mm=arm)
        return replace(
            self.base,
            name=name,
            joint=NotchedTube(Tube(one.tube.outer_mm, one.tube.inner_mm), notch),
            tendon_a=tendon,
            tendon_b=None if self.base.tendon_b is None else tendon,
            preload_N=one.preload_N,
        )

    def wire(self, candidate: Candidate) -> Wire:
        """Give its tendon, as :func:`studies.design.measure.measure` takes it."""
        return Wire(candidate.wire.diameter_mm, candidate.wire.breaking_N)

    def shortfalls(self, candidate: Candidate, requirements: Requirements) -> dict[str, float]:
        """Say what geometry alone refuses, each by how much of its bound it is missed; nothing if nothing does.

        The process: bridges and kerf. The requirements: diameters, length and radius, and the bend at which slots
        would be closed if their flexures had no height, N w/depth, which no real one reaches.
        """
        one, cutting, severed = candidate, self.cutting, candidate.tube.outer_mm
        left = severed - one.depth_mm * (1 if self.shape == "rectangular" else 2)
        bend, length = math.radians(requirements.bend_deg), one.count * (one.width_mm + one.spacing_mm)
        tendons = 1 if self.base.tendon_b is None else 2
        found = {
            "least bridge": _below(min(left, one.spacing_mm), cutting.least_bridge_mm),
            "kerf": _below(one.width_mm, cutting.kerf_mm),
            "wire": _below(one.tube.inner_mm / 2, one.wire.diameter_mm),
        }
        if self.shape == "rectangular":
            found["bend_deg"] = _below(one.count * one.width_mm / one.depth_mm, bend)
        known = {
            "outer_diameter_mm": one.tube.outer_mm,
            "free_lumen_mm": one.tube.inner_mm - tendons * one.wire.diameter_mm,
            "length_mm": length,
            "bending_radius_mm": length / bend,
        }
        for need in requirements.each:
            if need.quantity in known:
                found[need.quantity] = max(-need.share(known[need.quantity]), 0.0)
        return {name: by for name, by in found.items() if by > 0}


Item = TypeVar("Item")


def _pick(items: Sequence[Item], u: float) -> Item:
    return items[min(int(u * len(items)), len(items) - 1)]


def _at(ends: tuple[float, float], u: float) -> float:
    return ends[0] + u * (ends[1] - ends[0])


def _below(value: float, least: float) -> float:
    return max(least - value, 0.0) / least
