"""A camera that is tilted or not calibrated."""

from __future__ import annotations

from functools import partial

from fem_models.rig import Rig
from hysteresis.arrays import Floats
from validation.tracing.effect import (
    CurveForm,
    Effect,
    FreeParameter,
    RelativeParameter,
    RigForm,
    SampleInputs,
    Scale,
    Sensible,
    Values,
    read_in_planes,
)

SENSIBLE_GAIN = Sensible(
    -0.1,
    0.1,
    "a scale in the picture, or the tube's own length, gives the gain to some per cent",
    name="camera gain",
    about=1.0,
)
SENSIBLE_PERSPECTIVE = Sensible(
    -0.3, 0.3, "of a camera tilted by 15 to 20 deg at a distance of some tube lengths", "1/half range"
)
GAIN = FreeParameter("gain", "-", -0.9, 5.0, 0.01, linear=True, sensible=SENSIBLE_GAIN)
PERSPECTIVE = FreeParameter(
    "perspective_per_deg", "1/deg", -0.02, 0.02, 1e-4, linear=True, sensible=SENSIBLE_PERSPECTIVE
)


def observe(angle_deg: Floats, inputs: SampleInputs, values: Values) -> Floats:
    """Angle that is read, theta (1 + gain + perspective theta); an offset is part of the free zero of a record."""
    return angle_deg * (1 + values.get("gain", 0.0) + values.get("perspective_per_deg", 0.0) * angle_deg)


def _gain(scale: Scale, rig: Rig | None) -> list[Values]:
    return [{"gain": side * 0.02} for side in (-1, 1)]


def _perspective(scale: Scale, rig: Rig | None) -> list[Values]:
    return [{"perspective_per_deg": side * 0.02 / scale.angle_deg} for side in (-1, 1)]


def _both(scale: Scale, rig: Rig | None) -> list[Values]:
    """Give sizes of both parameters; the search finds their signs."""
    return [{"gain": 0.02, "perspective_per_deg": 0.02 / scale.angle_deg}]


_CURVE = CurveForm(
    (
        RelativeParameter(
            "perspective_per_deg", "1/angle", -0.5, 0.5, 0.005, amount=True, sensible=SENSIBLE_PERSPECTIVE
        ),
    ),
    ({"perspective_per_deg": 0.02}, {"perspective_per_deg": -0.02}),
    observe=observe,  # a gain is part of f
)
_CURVE_GAIN = CurveForm(
    (RelativeParameter("gain", "-", -0.9, 5.0, 0.01, amount=True, sensible=SENSIBLE_GAIN),),
    ({"gain": 0.02}, {"gain": -0.02}),
    observe=observe,
    needs=frozenset({"reference"}),  # which holds f
)

EFFECT = Effect(
    name="camera_misalignment",
    seen="a wrong angle, without a loop of its own",
    physics="A tilted or uncalibrated camera adds a gain, an offset and, to first order of its tilt, a part that is "
    "even in the angle (pinhole model; Hartley and Zisserman 2004, doi 10.1017/CBO9780511811685).",
    distinguished_by="Turn the camera, or read a known angle. Gravity is also a smooth function of the angle. Unequal "
    "tendons also have an even part, but theirs changes with preload.",
    rig_forms=(
        RigForm((GAIN,), _gain, observe=observe),
        RigForm((PERSPECTIVE,), _perspective, observe=observe),
        RigForm((GAIN, PERSPECTIVE), _both, observe=observe),
    ),
    curve_forms=(_CURVE, _CURVE_GAIN),
    space_forms=(
        *read_in_planes((GAIN,), partial(_gain, rig=None), observe),
        *read_in_planes((PERSPECTIVE,), partial(_perspective, rig=None), observe),
    ),
)
