"""Effects of the catalogue that change the observed angle."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from hysteresis import Record
from hysteresis.arrays import Floats
from validation.practice.injected import Draw, Family, Injected, Rng, either_sign
from validation.practice.protocols import BaselineRuns


def _clock(record: Record) -> Floats:
    assert record.time_s is not None
    return record.time_s - record.time_s[0]


def _time_delay(rng: Rng, baseline: BaselineRuns) -> Family:
    def at(size: float) -> Injected:
        delay = 0.2 * size

        def observe(index: int, record: Record, angle_deg: Floats) -> Floats:
            time = _clock(record)  # the rig is at rest before the record
            return np.asarray(PchipInterpolator(time, angle_deg)(np.maximum(time - delay, 0.0)))

        return Injected({"delay_s": delay}, observe=observe)

    return Family(at)


def _camera_misalignment(rng: Rng, baseline: BaselineRuns) -> Family:
    """Gain and perspective error in a random mixture; every record has a zero of its angle anyway."""
    mixture, bend = float(rng.uniform(0.0, 2 * np.pi)), baseline.bend_deg

    def at(size: float) -> Injected:
        gain, perspective = 0.1 * size * float(np.cos(mixture)), 0.1 * size * float(np.sin(mixture)) / bend
        return Injected(
            {"gain": gain, "perspective_per_deg": perspective},
            observe=lambda index, record, angle: angle * (1 + gain + perspective * angle),
        )

    return Family(at)


def _thermal_drift(rng: Rng, baseline: BaselineRuns) -> Family:
    """Offset that grows with time, linearly or with saturation, from zero in each record.

    What settles within a cycle is no warming up: the tracer names none, and none is drawn.
    """
    sign, long = either_sign(rng), baseline.longest_s
    least = max(0.2, baseline.cycle_s / long)
    time = long * float(rng.uniform(least, 1.0)) if rng.integers(2) else 0.0

    def at(size: float) -> Injected:
        most = 3.0 * size * sign

        def observe(index: int, record: Record, angle_deg: Floats) -> Floats:
            t = _clock(record)
            return angle_deg + most * (-np.expm1(-t / time) if time else t / long)

        return Injected({"drift_deg": most, "time_s": time or long, "saturates": float(time > 0)}, observe=observe)

    return Family(at)


OBSERVED_EFFECTS: dict[str, Draw] = {
    "time_delay": _time_delay,
    "camera_misalignment": _camera_misalignment,
    "thermal_drift": _thermal_drift,
}
"""By name."""
