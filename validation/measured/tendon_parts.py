"""Contributions of friction, tendon elasticity and material to the loop of a :class:`TendonRig`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hysteresis.arrays import Floats
from validation.measured.tendon_rig import TendonRig, run_of_stroke
from validation.separation.contributions import SETS, divide


def switched(rig: TendonRig, on: frozenset[str]) -> TendonRig:
    """Switch off the sources that are not in ``on``; the slack belongs to the elasticity of the tendon."""
    off: dict[str, float] = {}
    if "friction" not in on:
        off |= {"entry": 0.0, "constant_N": 0.0, "capstan": 0.0}
    if "tendon_elasticity" not in on:
        off |= {"stretch_mm_per_N": 0.0, "slack_mm": 0.0}
    if "material" not in on:
        off |= {"loop_share": 0.0}
    return replace(rig, **off)


@dataclass(frozen=True)
class TendonContributions:
    """Shares of friction, tendon elasticity, material and interaction, each set adding up to 1.

    Parameters
    ----------
    tension_width, stroke_width
        Shares of the largest width of the loop of bending over tension, and of bending over stroke.
    energy
        Shares of the dissipated energy.
    width_deg
        Full width of the loop of bending over tension.
    energy_mJ
        Dissipated energy of the full loop.
    closure_percent
        Work in a cycle against the sum of the losses: relative error.
    """

    tension_width: dict[str, float]
    stroke_width: dict[str, float]
    energy: dict[str, float]
    width_deg: float
    energy_mJ: float
    closure_percent: float


def tendon_contributions(rig: TendonRig, top_deg: float, samples: int = 150) -> TendonContributions:
    """Divide the loop from rest to a bending and back; all combinations of sources reach the same bending."""
    loops = {on: _closed(switched(rig, on), top_deg, samples) for on in SETS}
    values = [{on: loop[i] for on, loop in loops.items()} for i in range(3)]
    tension, stroke, energy = ({k: v / sum(d.values()) for k, v in d.items()} for d in map(divide, values))
    whole = loops[SETS[-1]]
    return TendonContributions(tension, stroke, energy, whole[0], whole[2], 100 * (whole[2] / whole[3] - 1))


def _closed(rig: TendonRig, top_deg: float, samples: int) -> tuple[float, float, float, float]:
    """Widths over tension and over stroke, deg, and work and losses, mJ, of the second cycle from rest."""
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
    """Largest distance in y between the two branches, over their common range of x."""
    grid = np.linspace(max(x[rising].min(), x[falling].min()), min(x[rising].max(), x[falling].max()), 400)
    one, other = (np.interp(grid, np.maximum.accumulate(a), b) for a, b in
                  ((x[rising], y[rising]), (x[falling][::-1], y[falling][::-1])))  # fmt: skip
    return float(np.abs(one - other).max())
