"""A camera that does not look at right angles."""

from __future__ import annotations

from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats
from validation.tracing.effect import (
    CurveForm,
    Effect,
    FreeParameter,
    RelativeParameter,
    RigForm,
    SampleInputs,
    Scale,
    Values,
)

GAIN = FreeParameter("gain", "-", -0.9, 5.0, 0.01, linear=True)
PERSPECTIVE = FreeParameter("perspective_per_deg", "1/deg", -0.02, 0.02, 1e-4, linear=True)


def observe(angle_deg: Floats, inputs: SampleInputs, values: Values) -> Floats:
    """Angle read: theta (1 + gain + perspective theta); the offset is a record's own zero, always free."""
    return angle_deg * (1 + values.get("gain", 0.0) + values.get("perspective_per_deg", 0.0) * angle_deg)


def _gain(scale: Scale, rig: Rig | None) -> list[Values]:
    return [{"gain": side * 0.02} for side in (-1, 1)]


def _perspective(scale: Scale, rig: Rig | None) -> list[Values]:
    return [{"perspective_per_deg": side * 0.02 / scale.angle_deg} for side in (-1, 1)]


def _both(scale: Scale, rig: Rig | None) -> list[Values]:
    """Give sizes of both; the search finds their signs."""
    return [{"gain": 0.02, "perspective_per_deg": 0.02 / scale.angle_deg}]


_CURVE = CurveForm(
    (RelativeParameter("perspective_per_deg", "1/angle", -0.5, 0.5, 0.005),),
    ({"perspective_per_deg": 0.02}, {"perspective_per_deg": -0.02}),
    observe=observe,  # f takes the gain
)

EFFECT = Effect(
    name="camera_misalignment",
    physics="A tilted or uncalibrated camera reads a wrong angle: gain, offset and, to first order of its tilt, a part "
    "even in the angle. A function of the angle alone, without a loop (pinhole model; Hartley and Zisserman 2004, doi "
    "10.1017/CBO9780511811685).",
    distinguished_by="Gravity is a smooth function of the angle, too, and unequal tendons have an even part, which changes "
    "with preload. Turn the camera, or read a known angle.",
    rig_forms=(
        RigForm((GAIN,), _gain, observe=observe),
        RigForm((PERSPECTIVE,), _perspective, observe=observe),
        RigForm((GAIN, PERSPECTIVE), _both, observe=observe),
    ),
    curve_forms=(_CURVE,),
)
