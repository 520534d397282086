"""Effects of the catalogue that a rig in series may have, each in the rig's own law."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from validation.practice.catalogue import ABSORBED
from validation.practice.draw import CLEAN
from validation.practice.rig_effects import RUN_OUT
from validation.practice.series.rig import SeriesRig

Rng = np.random.Generator
Change = Callable[[SeriesRig, float], SeriesRig]
"""From a rig without the effect and a size from 0 to 1, which is large, to one that has it."""

DOMINANT = "dominant_run_out"
"""A wheel's run-out of :data:`DOMINANT_SIZES`. Its share of the error is that beyond the twin without it."""
SIZES = (3.0, 8.0)
"""Times the noise, root mean square over all records, beyond the constants of the rig."""
DOMINANT_SIZES = (10.0, 16.0)
UNDECLARED = ("guide_friction",)
"""What every rig of this make has and no sidecar declares: its name counts neither for nor against."""


def effects(rng: Rng, reach_mm: float) -> Mapping[str, Change]:
    """Give all effects with their character drawn (sign, phase, mixture).

    Parameters
    ----------
    reach_mm
        Largest deflection of the tip without them.
    """
    side = float(rng.choice([-1.0, 1.0]))
    phase, direction = (float(rng.uniform(0.0, 2 * np.pi)) for _ in range(2))
    part, late = float(rng.uniform(0.0, 1.0)), float(rng.uniform(0.2, 1.0))
    off = float(rng.uniform(-0.3, 0.3))
    hard = float(np.exp(rng.uniform(*np.log((2.0, 50.0)))))

    def slack(rig: SeriesRig, size: float) -> SeriesRig:
        rest = rig.preload_N * (1 / rig.stiff_N_per_mm[0] + 1 / rig.soft_N_per_mm[0])
        return replace(rig, slack_mm=(2 * rest * size * (1 + off), 2 * rest * size * (1 - off)))

    def unequal(rig: SeriesRig, size: float) -> SeriesRig:
        arm, soft = (0.2 * side * size, 0.0) if part < 0.5 else (0.1 * side * size, 0.6 * size)
        return replace(
            rig,
            arm_mm=(rig.arm_mm[0], rig.arm_mm[1] * (1 + arm)),
            soft_N_per_mm=(rig.soft_N_per_mm[0], rig.soft_N_per_mm[1] / (1 + soft)),
        )

    def run_out(rig: SeriesRig, size: float) -> SeriesRig:
        return replace(rig, run_out_mm=RUN_OUT * rig.wheel_radius_mm * size, run_out_rad=phase)

    return {
        "backlash": lambda rig, size: replace(rig, play_mm=0.6 * size),
        "tendon_slack": slack,
        "unequal_tendons": unequal,
        "tendon_stiffening": lambda rig, size: replace(rig, toe_mm=0.6 * size),
        "tendon_creep": lambda rig, size: replace(rig, creep_mm_per_N=0.01 * size),
        "preload_loss": lambda rig, size: replace(rig, preload_loss=0.95 * size, preload_cycles=0.3 + late),
        "viscous_drag": lambda rig, size: replace(rig, drag_N=6.0 * size),
        "time_delay": lambda rig, size: replace(rig, delay_s=0.5 * size),
        "tip_contact": lambda rig, size: replace(
            rig, contact_mm=reach_mm * (1.0 - 0.7 * size), contact_N_per_mm15=hard
        ),
        "wheel_eccentricity": run_out,
        "camera_misalignment": lambda rig, size: replace(rig, view_rad=0.7 * size, view_axis_rad=direction),
        "thermal_drift": lambda rig, size: replace(rig, drift_rad=0.2 * side * size, drift_s=150.0 * late),
        "drive_gain": lambda rig, size: replace(rig, drive_gain=0.15 * side * size),
        "tip_load": lambda rig, size: replace(
            rig, tip_force_N=(2.0 * size * np.cos(direction), 2.0 * size * np.sin(direction))
        ),
        DOMINANT: run_out,
    }


SERIES_LABELS = (*effects(np.random.default_rng(0), 1.0), CLEAN)
"""Effects that a rig may have, the dominant run-out, and ``clean``."""


def labels_of(kind: str) -> tuple[str, ...]:
    """Labels that are drawn: a rig of unknown geometry takes some effects whole, or most of a run-out."""
    return tuple(label for label in SERIES_LABELS if kind == "known" or label not in {*ABSORBED, DOMINANT})


def effects_of(label: str) -> tuple[str, ...]:
    """Names of the catalogue that are right for a label."""
    return () if label == CLEAN else ("wheel_eccentricity",) if label == DOMINANT else (label,)


def numbers_of(name: str, rig: SeriesRig) -> dict[str, float]:
    """Constants of an effect that mean the same in every model: the others are those of the rig's own laws."""
    same = {
        "backlash": {"width_mm": rig.play_mm},
        "drive_gain": {"error": rig.drive_gain},
        "time_delay": {"delay_s": rig.delay_s},
        "wheel_eccentricity": {"amplitude_mm": rig.run_out_mm, "radius_mm": rig.wheel_radius_mm},
    }
    return same.get(name, {})
