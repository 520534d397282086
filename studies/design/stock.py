"""Stock sizes of tubes and wires, each with its source; a design file may have its own."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class TubeSize:
    """A tube that can be bought; diameters in mm."""

    outer_mm: float
    inner_mm: float
    source: str


@dataclass(frozen=True)
class WireSize:
    """A tendon that can be bought.

    ``strength_MPa`` is its least tensile strength, NaN where it is not known; ``modulus_GPa`` that of the wire.
    """

    diameter_mm: float
    strength_MPa: float
    modulus_GPa: float
    source: str

    @property
    def area_mm2(self) -> float:
        """Area of the full section."""
        return math.pi * self.diameter_mm**2 / 4

    @property
    def EA_N(self) -> float:
        """Axial stiffness times length."""
        return 1e3 * self.modulus_GPa * self.area_mm2

    @property
    def breaking_N(self) -> float:
        """Breaking load."""
        return self.strength_MPa * self.area_mm2


_CTR = "GitHub hitzhangchao/CTR"
TUBES: tuple[TubeSize, ...] = (
    TubeSize(1.10, 0.90, "GitHub comet-lab/SPIE-2021 fd701c7, src/notchsynthesis.m"),
    TubeSize(1.16, 0.86, "York et al., ICRA 2015"),
    TubeSize(1.26, 1.10, _CTR),
    TubeSize(1.60, 1.40, "GitHub comet-lab/SPIE-2021"),
    TubeSize(1.62, 1.40, "GitHub nepacheco/MastersThesis 4f920c7"),
    TubeSize(1.65, 1.40, _CTR),
    TubeSize(2.25, 1.75, _CTR),
)
"""Nitinol tubes of published devices: someone has bought them."""

_STEEL = "EN 10270-1, class DH, as listed by durofer.ch; modulus 206 GPa"
WIRES: tuple[WireSize, ...] = tuple(
    WireSize(diameter, strength, 206.0, _STEEL)
    for diameter, strength in (
        (0.10, 2800.0),
        (0.15, 2800.0),
        (0.20, 2800.0),
        (0.25, 2800.0),
        (0.30, 2660.0),
        (0.35, 2600.0),
        (0.40, 2560.0),
    )
)
"""Patented steel wire with its least strength."""

KERF_MM = 0.025
"""Of a fibre laser focused to 25 um (medicaldesignbriefs.com, Fine laser cutting for medical components)."""
LEAST_BRIDGE_MM = 0.1
"""Least width of metal left between two cuts or beside one: assumed, four kerfs. Ask who cuts the tube."""
GRID_MM = 0.005
"""Dimensions are whole multiples of it: assumed, below the tolerance of a cut."""
