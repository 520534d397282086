"""The quantities that a study computes, by group and by engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from validation.separation.contributions import PARTS


@dataclass(frozen=True)
class Quantity:
    """Unit and description of a column of the dataset."""

    units: str
    long_name: str


GROUPS: dict[str, dict[str, Quantity]] = {
    "loop": {
        "full_scale_angle_deg": Quantity("deg", "largest bending angle, in either direction"),
        "loop_width_at_zero_deg": Quantity("deg", "width of the loop at zero drive, positive where the angle lags"),
        "loop_width_max_deg": Quantity("deg", "largest width of the loop"),
        "dissipated_mJ": Quantity("mJ", "work of the wheel over the last cycle"),
        "tension_max_N": Quantity("N", "largest tension anywhere along the tendons"),
        "tension_min_N": Quantity("N", "smallest tension anywhere along the tendons"),
        "slack_reached": Quantity("1", "1 where a tendon falls to 1 % of the preload or less, else 0"),
    },
    "strain": {
        "peak_strain_percent": Quantity("%", "largest strain of the outermost fibre at a notch root"),
        "superelastic_margin": Quantity("1", "strain to which superelasticity is tested (6 %) over the peak strain"),
        "plateau_margin": Quantity("1", "strain at the start of the plateau over the peak strain"),
        "fatigue_margin": Quantity("1", "alternating strain for 10^7 cycles (0.4 %) over that of the loop"),
    },
    "notches": {
        "notch_angle_max_deg": Quantity("deg", "largest angle of a notch where the manipulator bends most"),
        "notch_angle_spread_deg": Quantity("deg", "largest less smallest angle of a notch, in the same place"),
        "notch_angle_gradient_deg": Quantity("deg", "angle of the notch at the tip less that at the base, likewise"),
    },
    "bouc-wen": {
        "bouc_wen_A": Quantity("1", "A of the improved Bouc-Wen law"),
        "bouc_wen_beta": Quantity("deg^-n", "beta of the improved Bouc-Wen law"),
        "bouc_wen_gamma": Quantity("deg^-n", "gamma of the improved Bouc-Wen law"),
        "bouc_wen_n": Quantity("1", "n of the improved Bouc-Wen law"),
        "saturation_deg": Quantity("deg", "largest |h| of the improved Bouc-Wen law"),
    },
    "contributions": {
        f"{part}_share": Quantity("1", f"share of the dissipated energy: {part.replace('_', ' ')}") for part in PARTS
    },
    "joint": {
        "bending_Nmm_per_rad": Quantity("N mm/rad", "bending stiffness of one joint, as a solid"),
        "axial_N_per_mm": Quantity("N/mm", "axial stiffness of one joint, as a solid"),
        "shear_N_per_mm": Quantity("N/mm", "shear stiffness of one joint, as a solid"),
    },
}
"""Quantities by group, all of them numbers; NaN if an engine cannot give it or the case failed."""

OPTIONAL_GROUPS = ("bouc-wen", "contributions")  # they make a case many times slower
ENGINE_GROUPS: dict[str, tuple[str, ...]] = {
    "chain": ("loop", "strain", "notches", *OPTIONAL_GROUPS),
    "multibody": ("loop", "strain", "notches", *OPTIONAL_GROUPS),
    "analytic": ("loop", "strain", "notches"),
    "solid": ("joint", "strain"),
}
"""Groups of each engine; the first two are the default."""


def quantity_names(engine: str, groups: Sequence[str]) -> tuple[str, ...]:
    """Give the names of the quantities of a study, in the order of the dataset."""
    wanted = [group for group in ENGINE_GROUPS[engine] if group in groups]
    return tuple(name for group in wanted for name in GROUPS[group])


QUANTITIES: dict[str, Quantity] = {name: q for group in GROUPS.values() for name, q in group.items()}
