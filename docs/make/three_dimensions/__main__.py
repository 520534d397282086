"""Draws the circle of the tip of ``docs/theory/three-dimensions.md``: ``python -m docs.make.three_dimensions``."""

from __future__ import annotations

from dataclasses import replace

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
from matplotlib.figure import Figure

from docs.make.pages import DOCS
from fem_models.rig import Rig, preset
from fem_models.rig.rig import Friction, Material
from fem_models.spatial import SpatialRig, solve_spatial, spatial_rig, wheel_drives
from hysteresis.arrays import Floats

SAMPLES, AMPLITUDE_MM = 120, 1.5


def two_planes(rig: Rig) -> SpatialRig:
    """Turn every second notch by 90 degrees, and put four tendons round the tube."""
    return spatial_rig(rig, turns_deg=[90.0 * (k % 2) for k in range(rig.joints)], tendons_deg=[0, 180, 90, 270])


def round_and_back() -> tuple[Floats, int]:
    """Drives of both wheels, shape (s, 2): out, once round, once back; and the samples of the way out."""
    out = np.stack([np.linspace(0, AMPLITUDE_MM, 16), np.zeros(16)], axis=1)
    angle = 2 * np.pi * np.arange(1, SAMPLES + 1) / SAMPLES
    ring = AMPLITUDE_MM * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([out, ring, ring[::-1][1:], out[-1:]]), len(out)


def draw() -> Figure:
    """Draw the tip's path across the tube, and what friction and material take away from it."""
    rig = preset("du2018")
    smooth = two_planes(replace(rig, friction=Friction(), material=Material(60.0, 0.33)))
    drives, lead = round_and_back()
    without, with_friction = (solve_spatial(one, wheel_drives(drives)) for one in (smooth, two_planes(rig)))
    figure = Figure(figsize=(9, 4.4), layout="constrained")
    path, lag = figure.subplots(1, 2)
    there, back = slice(lead - 1, lead + SAMPLES), slice(lead + SAMPLES - 1, None)
    path.plot(*without.tip_mm[there, 1:].T, color="0.6", lw=3, label="no friction, no loop")
    path.plot(*with_friction.tip_mm[there, 1:].T, color="tab:blue", label="friction and loop, round")
    path.plot(*with_friction.tip_mm[back, 1:].T, color="tab:orange", label="and back")
    path.set(xlabel="tip y, mm", ylabel="tip z, mm", aspect="equal")
    path.legend(loc="center")
    turn = 360 * np.arange(SAMPLES + 1) / SAMPLES
    off = np.linalg.norm(with_friction.bending_deg - without.bending_deg, axis=1)
    lag.plot(turn, off[there], color="tab:blue", label="round")
    lag.plot(turn[::-1], off[back], color="tab:orange", label="and back")
    lag.set(xlabel="direction of the drives, deg", ylabel="bending off that without friction, deg", ylim=(0, None))
    lag.legend()
    return figure


if __name__ == "__main__":
    draw().savefig(DOCS / "images" / "circle-of-the-tip.png", dpi=110)
