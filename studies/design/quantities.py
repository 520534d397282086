"""What can be required of a tube: names, units and words of the quantities."""

from __future__ import annotations

from dataclasses import dataclass, fields

from studies.sweep.quantities import Quantity

QUANTITIES: dict[str, Quantity] = {
    "bend_deg": Quantity("deg", "largest bend within the limits of tension and drive"),
    "bending_radius_mm": Quantity("mm", "length of the notched part over the required bend"),
    "closing_bend_deg": Quantity("deg", "bend at which the first notch closes"),
    "notch_angle_deg": Quantity("deg", "largest angle of a notch, at the required bend"),
    "reach_mm": Quantity("mm", "distance of the tip from the axis of the straight tube, at the required bend"),
    "length_mm": Quantity("mm", "length of the notched part"),
    "outer_diameter_mm": Quantity("mm", "outer diameter of the tube"),
    "free_lumen_mm": Quantity("mm", "largest circle beside the tendons in the tube"),
    "tension_N": Quantity("N", "tension of the tendon at the wheel, at the required bend"),
    "tendon_margin": Quantity("1", "breaking load of the tendon over that tension"),
    "tendon_strain_percent": Quantity("%", "strain of a solid wire that follows the required bend evenly"),
    "drive_mm": Quantity("mm", "travel of the tendon to the required bend"),
    "tip_force_N": Quantity("N", "force across the tip that the largest tension allowed holds at the required bend"),
    "tip_stiffness_N_per_mm": Quantity("N/mm", "force across the tip by its motion, drive held, at the required bend"),
    "peak_strain_percent": Quantity("%", "largest strain of a flexure, at the required bend"),
    "alternating_strain_percent": Quantity("%", "half the range of strain in a cycle to the required bend and back"),
    "cycles": Quantity("1", "cycles to the required bend and back that 97.5 % of tubes bear"),
    "loop_width_deg": Quantity("deg", "largest width of the loop of a cycle to the required bend and back"),
}
"""Quantities in the order in which they are shown; ``1`` is the unit of a ratio or a count."""


@dataclass(frozen=True)
class Measured:
    """Quantities of one tube, by the names of :data:`QUANTITIES`; NaN where a model does not give them."""

    bend_deg: float = float("nan")
    bending_radius_mm: float = float("nan")
    closing_bend_deg: float = float("nan")
    notch_angle_deg: float = float("nan")
    reach_mm: float = float("nan")
    length_mm: float = float("nan")
    outer_diameter_mm: float = float("nan")
    free_lumen_mm: float = float("nan")
    tension_N: float = float("nan")
    tendon_margin: float = float("nan")
    tendon_strain_percent: float = float("nan")
    drive_mm: float = float("nan")
    tip_force_N: float = float("nan")
    tip_stiffness_N_per_mm: float = float("nan")
    peak_strain_percent: float = float("nan")
    alternating_strain_percent: float = float("nan")
    cycles: float = float("nan")
    loop_width_deg: float = float("nan")

    def of(self, name: str) -> float:
        """Give a quantity by name."""
        return float(getattr(self, name))


assert [one.name for one in fields(Measured)] == list(QUANTITIES)
