"""Effects of the catalogue that a practice case may have, and how they are related."""

from __future__ import annotations

from validation.practice.injected import Draw
from validation.practice.observed_effects import OBSERVED_EFFECTS
from validation.practice.rig_effects import RIG_EFFECTS

_NAMES = (
    "backlash",
    "tendon_slack",
    "unequal_tendons",
    "tendon_stiffening",
    "tendon_creep",
    "preload_loss",
    "guide_friction",
    "viscous_drag",
    "time_delay",
    "superelastic_plateau",
    "functional_fatigue",
    "notch_closure",
    "gravity",
    "tip_contact",
    "wheel_eccentricity",
    "camera_misalignment",
    "thermal_drift",
    "drive_gain",
    "tip_load",
    "stribeck_friction",
    "position_friction",
    "run_in",
    "preloaded_play",
)
CATALOGUE: dict[str, Draw] = {name: {**RIG_EFFECTS, **OBSERVED_EFFECTS}[name] for name in _NAMES}
"""The effects of the catalogue, by name, in the order of the tables of the score."""

DISTINCT: tuple[tuple[str, ...], ...] = (
    ("backlash", "guide_friction"),
    ("tendon_slack", "tendon_stiffening"),
    ("unequal_tendons", "camera_misalignment", "gravity", "wheel_eccentricity", "tip_contact"),
    ("viscous_drag", "time_delay"),
    ("tendon_creep", "thermal_drift", "preload_loss", "functional_fatigue"),
    ("superelastic_plateau", "notch_closure"),
)
"""Effects by kind, of which pairs are drawn; effects of different kinds have little in common.

Later effects of the catalogue are in no pair, so that the pairs of older sets stay what they were."""

ANGLE_ALONE = frozenset(
    {"camera_misalignment", "gravity", "notch_closure", "tip_contact", "wheel_eccentricity", "tip_load", "drive_gain"}
)
"""Effects that depend on the angle or the drive alone: if the geometry is unknown, f(x) absorbs them."""

ABSORBED = frozenset({"superelastic_plateau", "drive_gain"})
"""Effects that an equivalent rig takes whole: beyond its constants none of their sizes is three times the noise.
They are not drawn if the geometry is unknown."""
