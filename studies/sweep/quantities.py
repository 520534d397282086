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


_TENSIONS = {
    "tension_max_N": Quantity("N", "largest tension anywhere along the tendons"),
    "tension_min_N": Quantity("N", "smallest tension anywhere along the tendons"),
    "slack_reached": Quantity("1", "1 where a tendon falls to 1 % of the preload or less, else 0"),
}


def _plane(k: int) -> dict[str, Quantity]:
    """Quantities of the loop of wheel k, counted from 1."""
    return {
        f"full_scale_angle_{k}_deg": Quantity("deg", f"largest bending angle while wheel {k} moves alone"),
        f"loop_width_{k}_deg": Quantity("deg", f"largest width of the loop of wheel {k}"),
        f"lost_motion_{k}_mm": Quantity("mm", f"largest width of the loop of wheel {k} along the drive"),
        f"across_{k}_deg": Quantity("deg", f"largest bending across the plane in which wheel {k} bends"),
    }


GROUPS: dict[str, dict[str, Quantity]] = {
    "loop": {
        "full_scale_angle_deg": Quantity("deg", "largest bending angle, in either direction"),
        "loop_width_at_zero_deg": Quantity("deg", "width of the loop at zero drive, positive where the angle lags"),
        "loop_width_max_deg": Quantity("deg", "largest width of the loop"),
        "dissipated_mJ": Quantity("mJ", "work of the wheel over the last cycle"),
        **_TENSIONS,
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
    "planes": {**_plane(1), **_plane(2), **_TENSIONS},
    "workspace": {
        "largest_bending_deg": Quantity("deg", "largest bending of the tip, wheels on circles"),
        "area_mm2": Quantity("mm^2", "area that the tip reaches, seen along the tube"),
        "area_without_friction_mm2": Quantity("mm^2", "the same without friction and loop of the material"),
        "largest_spread_mm": Quantity("mm", "largest distance of tips that the same drives reach forth and back"),
        "mean_spread_mm": Quantity("mm", "mean distance of these tips"),
    },
    "compliance": {
        f"{place}_compliance_{state}_mm_per_N": Quantity("mm/N", f"largest motion of the {place} tip by force, {words}")
        for place in ("straight", "bent")
        for state, words in (("held", "guides that stick"), ("sliding", "no friction, no loop"))
    },
}
"""Quantities by group, all of them numbers; NaN if an engine cannot give it or the case failed."""

OPTIONAL_GROUPS = ("bouc-wen", "contributions")  # they make a case many times slower
IN_SPACE = "chain-in-space"
"""The engine of a study whose rig bends in space."""
ENGINE_GROUPS: dict[str, tuple[str, ...]] = {
    "chain": ("loop", "strain", "notches", *OPTIONAL_GROUPS),
    "multibody": ("loop", "strain", "notches", *OPTIONAL_GROUPS),
    "analytic": ("loop", "strain", "notches"),
    "solid": ("joint", "strain"),
    IN_SPACE: ("planes", "workspace", "compliance"),
}
"""Groups of each engine; the first two are the default."""


def quantity_names(engine: str, groups: Sequence[str]) -> tuple[str, ...]:
    """Give the names of the quantities of a study, in the order of the dataset."""
    wanted = [group for group in ENGINE_GROUPS[engine] if group in groups]
    return tuple(name for group in wanted for name in GROUPS[group])


QUANTITIES: dict[str, Quantity] = {name: q for group in GROUPS.values() for name, q in group.items()}
