"""A zero that drifts with time."""

from __future__ import annotations

from functools import partial

import numpy as np

from fem_models.rig import Rig
from hysteresis.arrays import Floats
from validation.tracing.effect import (
    CurveForm,
    Effect,
    FreeParameter,
    Need,
    RelativeParameter,
    RigForm,
    SampleInputs,
    Scale,
    Sensible,
    Values,
    read_in_planes,
)

SENSIBLE_DEG = Sensible(
    -1.0, 1.0, "an offset beyond the motion itself is a broken mounting, no drift", "half range/duration"
)
SENSIBLE_SIZE = Sensible(-1.0, 1.0, "an offset beyond the motion itself is a broken mounting, no drift", "half range")
SENSIBLE_TIME = Sensible(4.0, 1e6, "what settles within a cycle is no warming up", "quarter cycle")
RATE = FreeParameter("deg_per_s", "deg/s", -10.0, 10.0, 1e-5, linear=True, sensible=SENSIBLE_DEG)
SIZE = FreeParameter("size_deg", "deg", -50.0, 50.0, 0.02, linear=True, sensible=SENSIBLE_SIZE)
TIME = FreeParameter("time_s", "s", 1e-2, 1e6, 0.3, log=True, sensible=SENSIBLE_TIME)


def observe(angle_deg: Floats, inputs: SampleInputs, values: Values) -> Floats:
    """Add an offset that grows with time, steadily or towards a limit."""
    if "deg_per_s" in values:
        return angle_deg + values["deg_per_s"] * inputs.time_s
    return angle_deg - values["size_deg"] * np.expm1(-inputs.time_s / values["time_s"])


def _steady(scale: Scale, rig: Rig | None) -> list[Values]:
    return [{"deg_per_s": side * 0.01 * scale.angle_deg / scale.duration_s} for side in (-1, 1)]


def _to_a_limit(scale: Scale, rig: Rig | None) -> list[Values]:
    return [
        {"size_deg": side * 0.01 * scale.angle_deg, "time_s": time_s}
        for time_s in np.geomspace(0.1 * scale.duration_s, 2.0 * scale.longest_s, 5).tolist()
        for side in (-1, 1)
    ]


_TIME: frozenset[Need] = frozenset({"time"})
_CURVES = (
    CurveForm(
        (RelativeParameter("deg_per_s", "angle/time", -2.0, 2.0, 0.005, amount=True, sensible=SENSIBLE_DEG),),
        ({"deg_per_s": 0.01},),
        observe=observe,
        needs=_TIME,
    ),
    CurveForm(
        (
            RelativeParameter("size_deg", "angle", -2.0, 2.0, 0.005, amount=True, sensible=SENSIBLE_SIZE),
            RelativeParameter("time_s", "time", 3e-3, 1e3, 0.3, log=True, sensible=SENSIBLE_TIME),
        ),
        tuple({"size_deg": 0.01, "time_s": part} for part in (0.1, 0.5, 2.0, 10.0)),
        observe=observe,
        needs=_TIME,
    ),
)

EFFECT = Effect(
    name="thermal_drift",
    seen="the offset changes slowly, with one sign whatever the load",
    physics="Sensor, motor and mounting warm up. The offset of the reading follows, steadily or towards a limit.",
    distinguished_by="Record a dwell at full drive on both sides. Thermal drift keeps its sign; creep changes it with "
    "the load.",
    rig_forms=(
        RigForm((RATE,), _steady, observe=observe, needs=_TIME),
        RigForm((SIZE, TIME), _to_a_limit, observe=observe, needs=_TIME),
    ),
    curve_forms=(*_CURVES,),
    space_forms=read_in_planes((RATE,), partial(_steady, rig=None), observe, _TIME),
)
