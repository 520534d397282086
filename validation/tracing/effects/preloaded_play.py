"""Clearance that tension takes up."""

from __future__ import annotations

from dataclasses import replace

from fem_models.rig import Rig
from fem_models.rig.effects import Backlash
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve_kernels import play
from validation.tracing.effect import (
    CurveContext,
    CurveForm,
    Effect,
    FreeParameter,
    RelativeParameter,
    RigForm,
    Scale,
    Sensible,
    Values,
)

SENSIBLE_FREE_WIDTH = Sensible(0.0, 2.0, "fixings with more clearance are loose", "half stroke")
SENSIBLE_PRELOADED_WIDTH = Sensible(
    0.0, 0.5, "a wider play leaves the angle still for most of the stroke", "half stroke"
)
WIDTH = FreeParameter("free_width_mm", "mm", 0.0, 5.0, 0.05, linear=True, sensible=SENSIBLE_FREE_WIDTH)
TENSION = FreeParameter("takes_up_N", "N", 0.05, 20.0, 0.3, log=True)
"""What tensions beyond the usual preloads take up does not change from record to record: it is play in gears."""
AT_PRELOAD = FreeParameter("preloaded_width_mm", "mm", 0.0, 5.0, 0.05, linear=True, sensible=SENSIBLE_PRELOADED_WIDTH)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the play that the preload of the record leaves: two plays in series are one play of both widths."""
    declared = 0.0 if rig.backlash is None else float(rig.backlash.left_mm(rig.preload_N))
    left = values.get("preloaded_width_mm", 0.0)
    if "free_width_mm" in values:
        left = values["free_width_mm"] / (1.0 + rig.preload_N / values["takes_up_N"])
    return replace(rig, backlash=Backlash(declared + left))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [
        {"free_width_mm": part * scale.drive, "takes_up_N": min(max(0.5 * rig.preload_N, 1.0), 10.0)}
        for part in (0.05, 0.2)
    ]


def _of_one_preload(scale: Scale, rig: Rig) -> list[Values]:
    return [{"preloaded_width_mm": part * scale.drive} for part in (0.02, 0.08, 0.25)]  # as of backlash


def _taken_up(x: Floats, curve: CurveContext, values: Values) -> Floats:
    left = values["free_width"] / (1.0 + curve.preload_ratio / values["takes_up"])
    return play(x, left, curve.initial_state)


def _left(x: Floats, curve: CurveContext, values: Values) -> Floats:
    return play(x, values["preloaded_width"], curve.initial_state)


_CURVES = (
    CurveForm(
        (
            RelativeParameter("free_width", "drive", 0.0, 3.0, 0.01, amount=True, sensible=SENSIBLE_FREE_WIDTH),
            RelativeParameter("takes_up", "-", 0.02, 1.0, 0.3, log=True),  # over the largest preload
        ),
        tuple({"free_width": w, "takes_up": 0.4} for w in (0.05, 0.25)),
        drive=_taken_up,
        needs=frozenset({"preloads"}),
    ),
    CurveForm(  # the same operator as play: one preload does not tell them apart
        (
            RelativeParameter(
                "preloaded_width", "drive", 0.0, 1.0, 0.01, amount=True, sensible=SENSIBLE_PRELOADED_WIDTH
            ),
        ),
        tuple({"preloaded_width": w} for w in (0.02, 0.08, 0.25)),
        drive=_left,
        needs=frozenset({"one preload"}),
    ),
)

EFFECT = Effect(
    name="preloaded_play",
    seen="a play that is narrower at a higher preload",
    physics="Clearance of a tendon in its holes or fixings that tension closes: a play of the width w/(1 + T/T0) at "
    "the preload T. Each record has its own width. The authors of the reference rig name it (Mechanical Sciences 9, "
    "2018).",
    distinguished_by="Record a second preload: this play shrinks as the preload grows, and a play in gears does not. "
    "At one preload they are the same.",
    rig_forms=(
        RigForm((WIDTH, TENSION), _starts, rig=_rig, needs=frozenset({"wheel", "preloads"})),
        RigForm((AT_PRELOAD,), _of_one_preload, rig=_rig, needs=frozenset({"wheel", "one preload"})),
    ),
    curve_forms=(*_CURVES,),
)
