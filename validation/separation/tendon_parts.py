"""Friction, tendon elasticity and material in the loop of a :class:`TendonRig`, by switching them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hysteresis.arrays import Floats
from validation.separation.contributions import SETS, divide
from validation.separation.tendon_rig import TendonRig, run_of_stroke


def switched(rig: TendonRig, on: frozenset[str]) -> TendonRig:
    """Switch friction, elasticity of the tendon (its slack with it) and the material's loop off where not ``on``."""
    off: dict[str, float] = {}
    if "friction" not in on:
        off |= {"entry": 0.0, "constant_N": 0.0, "capstan": 0.0}
    if "tendon_elasticity" not in on:
        off |= {"stretch_mm_per_N": 0.0, "slack_mm": 0.0}
    if "material" not in on:
        off |= {"loop_share": 0.0}
    return replace(rig, **off)


@dataclass(frozen=True)
class Parts:
    """Shares of friction, tendon elasticity, material and interaction; each adds up to 1."""

    tension_width: dict[str, float]  # of the loop of bending over tension, largest width in deg
    stroke_width: dict[str, float]  # of the loop of bending over stroke
    energy: dict[str, float]
    width_deg: float  # of bending over tension, the whole
    energy_mJ: float
    closure_percent: float  # work in a cycle over the losses that were booked


def parts(rig: TendonRig, top_deg: float, samples: int = 150) -> Parts:
    """Divide the loop from rest to a bending and back; all combinations of sources go through the same bending."""
    loops = {on: _closed(switched(rig, on), top_deg, samples) for on in SETS}
    values = [{on: loop[i] for on, loop in loops.items()} for i in range(3)]
    tension, stroke, energy = ({k: v / sum(d.values()) for k, v in d.items()} for d in map(divide, values))
    whole = loops[SETS[-1]]
    return Parts(tension, stroke, energy, whole[0], whole[2], 100 * (whole[2] / whole[3] - 1))


def _closed(rig: TendonRig, top_deg: float, samples: int) -> tuple[float, float, float, float]:
    """Widths of bending over tension and over stroke, deg, work and losses, mJ, of the second cycle from rest."""
    high = _stroke_to(rig, top_deg)
    up = np.linspace(rig.start_mm, high, samples)
    run = run_of_stroke(rig, np.concatenate([up, up[::-1][1:], up[1:], up[::-1][1:]]), rig.zero_N)
    rising, falling = slice(2 * samples - 2, 3 * samples - 2), slice(3 * samples - 3, None)
    last = slice(2 * samples - 2, None)
    lost = run.friction_mJ + run.material_mJ
    return (
        _width(run.tension_N, run.bending_deg, rising, falling),
        _width(run.stroke_mm, run.bending_deg, rising, falling),
        float(run.work_mJ[last][-1] - run.work_mJ[last][0]),
        float(lost[last][-1] - lost[last][0]),
    )


def _stroke_to(rig: TendonRig, top_deg: float) -> float:
    low, high = rig.start_mm, rig.start_mm + 100.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        bent = run_of_stroke(rig, np.linspace(rig.start_mm, middle, 20), rig.zero_N).bending_deg[-1]
        low, high = (middle, high) if bent < top_deg else (low, middle)
    return high


def _width(x: Floats, y: Floats, rising: slice, falling: slice) -> float:
    """Largest distance of the two branches in y, over where both are."""
    grid = np.linspace(max(x[rising].min(), x[falling].min()), min(x[rising].max(), x[falling].max()), 400)
    one, other = (np.interp(grid, np.maximum.accumulate(a), b) for a, b in
                  ((x[rising], y[rising]), (x[falling][::-1], y[falling][::-1])))  # fmt: skip
    return float(np.abs(one - other).max())
