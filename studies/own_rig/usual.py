"""Values of a rig that no such device has: most often another unit, or a digit too many."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fem_models.rig import Rig
from fem_models.rig.joints import NotchedTube


@dataclass(frozen=True)
class Usual:
    """The range that a value of such devices has, and where it is from; ``of`` gives it, None where a rig has none."""

    name: str
    of: Callable[[Rig], float | None]
    low: float
    high: float
    unit: str
    source: str


def _diameter_mm(rig: Rig) -> float | None:
    return rig.joint.tube.outer_diameter_mm if isinstance(rig.joint, NotchedTube) else None


def _modulus_GPa(rig: Rig) -> float | None:
    return rig.material.youngs_modulus_GPa if isinstance(rig.joint, NotchedTube) else None


USUAL = (
    Usual("material.youngs_modulus_GPa", _modulus_GPa, 5.0, 100.0, "GPa",
          "Nitinol 28 to 83: SMA Inc., Selected Properties of NiTi; a thin flexure 17: notched-wrist-90"),
    Usual("tube.outer_diameter_mm", _diameter_mm, 0.3, 20.0, "mm",
          "a needle-sized wrist has 1.16 (York et al., ICRA 2015), du2018 of this package 6.2"),
    Usual("tendon_a.EA_N", lambda rig: rig.tendon_a.EA_N, 100.0, 200_000.0, "N",
          "E pi/4 d^2 of Nitinol at 0.05 mm, 60 GPa, to steel at 1 mm, 200 GPa"),
    Usual("preload_N", lambda rig: rig.preload_N, 0.0, 400.0, "N",
          "a steel wire of 0.5 mm breaks at 2,000 MPa x pi/4 d^2 = 390 N"),
)  # fmt: skip
"""Ranges that are wide of the devices known to us; a value outside is said, not refused."""


def unusual(rig: Rig) -> list[str]:
    """Say which values of a rig no such device has, with the usual range and its source."""
    words = []
    for one in USUAL:
        value = one.of(rig)
        if value is not None and not one.low <= value <= one.high:
            usual = f"usual is {one.low:g} to {one.high:g} {one.unit} ({one.source})"
            words.append(f"{one.name} = {value:g} {one.unit}: {usual}")
    diameter = _diameter_mm(rig)
    for name, tendon in zip(("tendon_a", "tendon_b"), rig.tendons, strict=False):
        if diameter is not None and tendon.moment_arm_mm > 0.5 * diameter:
            found = f"{name}.moment_arm_mm = {tendon.moment_arm_mm:g}: outside the tube of {diameter:g} mm"
            words.append(f"{found}: usual is a tendon within its outer radius, {0.5 * diameter:g} mm")
    return words
