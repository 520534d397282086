"""Main constant of an effect, where it means the same in every model, so that a size that was found can be scored."""

from __future__ import annotations

import math
from collections.abc import Mapping

Numbers = Mapping[str, float]


def size_of(effect: str, numbers: Numbers, rig: str) -> float | None:
    """Give the main constant of an effect from its parameters, as an answer or a truth has them; None without one.

    Parameters
    ----------
    effect
        Name.
    numbers
        Parameters by name, with units in the names.
    rig
        ``known`` or ``unknown``: some constants are those of a known geometry alone.

    Returns
    -------
    float or None
        Width of a backlash (the drive's unit); time delay (s); rate of a steady drift (deg/s); amplitude of a wheel's
        run-out (the drive's unit); lost part of the preload; width of a play without tension (the drive's unit). With
        a known rig also the relative error of the drive's gain, the plateau (MPa) and the angle at which notches close
        (deg).
    """
    match effect:
        case "backlash":
            return _starting(numbers, "width")
        case "time_delay":
            return numbers.get("delay_s")
        case "thermal_drift":
            return _drift(numbers)
        case "wheel_eccentricity":
            sine, cosine = _starting(numbers, "sine"), _starting(numbers, "cosine")
            both = None if sine is None or cosine is None else math.hypot(sine, cosine)
            return _starting(numbers, "amplitude") if both is None else both
        case "preload_loss":
            return numbers.get("fraction")
        case "preloaded_play":
            return _starting(numbers, "free_width")
        case "drive_gain" if rig == "known":
            return numbers.get("error")
        case "superelastic_plateau" if rig == "known":
            return numbers.get("plateau_MPa")
        case "notch_closure" if rig == "known":
            return numbers.get("angle_deg")
    return None


def _starting(numbers: Numbers, name: str) -> float | None:
    return next((value for key, value in numbers.items() if key == name or key.startswith(f"{name}_")), None)


def _drift(numbers: Numbers) -> float | None:
    """Rate of a steady drift; one that saturates has none."""
    if "deg_per_s" in numbers:
        return numbers["deg_per_s"]
    if numbers.get("saturates") == 0.0:
        return numbers["drift_deg"] / numbers["time_s"]
    return None
