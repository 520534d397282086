"""Play between drive and wheel."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

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
    SpaceForm,
    Values,
)

SENSIBLE_WIDTH = Sensible(0.0, 0.5, "a wider play leaves the angle still for most of the stroke", "half stroke")
WIDTH = FreeParameter("width_mm", "mm", 0.0, 5.0, 0.05, linear=True, sensible=SENSIBLE_WIDTH)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the widths: two plays in series are one play of both widths."""
    declared = 0.0 if rig.backlash is None else float(rig.backlash.left_mm(rig.preload_N))
    return replace(rig, backlash=Backlash(declared + values["width_mm"]))


def _wheels(wheels_mm: Floats, values: Values) -> Floats:
    """Give every wheel a play; at rest it stands in the middle."""
    return np.column_stack([play(column, values["width_mm"], 0.0) for column in wheels_mm.T])


def _starts(scale: Scale, rig: Rig | None) -> list[Values]:
    return [{"width_mm": part * scale.drive} for part in (0.02, 0.08, 0.25)]


def _play(x: Floats, curve: CurveContext, values: Values) -> Floats:
    return play(x, values["width"], curve.initial_state)


_CURVE = CurveForm(
    (RelativeParameter("width", "drive", 0.0, 1.0, 0.01, amount=True, sensible=SENSIBLE_WIDTH),),
    tuple({"width": w} for w in (0.02, 0.08, 0.25)),
    drive=_play,
    still_over="width",
)

EFFECT = Effect(
    name="backlash",
    seen="after every reversal the angle stands still, over the same stroke everywhere",
    physics="Clearance in gears or couplings between motor and wheel: a play operator (Krasnosel'skii and Pokrovskii "
    "1989, ISBN 978-3-642-64782-6).",
    distinguished_by="Record a second amplitude, and three preloads. The width of a play changes with neither. That "
    "of a Bouc-Wen loop changes, and so does that of friction with an elastic tendon. Friction at the base before "
    "tendons without a toe region is the same as a play.",
    rig_forms=(RigForm((WIDTH,), _starts, rig=_rig, needs=frozenset({"wheel"})),),
    curve_forms=(_CURVE,),
    space_forms=(SpaceForm((WIDTH,), partial(_starts, rig=None), wheels=_wheels),),
)
