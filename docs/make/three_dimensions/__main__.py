"""Draws the circles of the tip of ``docs/theory/three-dimensions.md``: ``python -m docs.make.three_dimensions``."""

from __future__ import annotations

from dataclasses import dataclass, replace

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
from matplotlib.figure import Figure

from docs.make.pages import DOCS
from fem_models.rig import Rig, preset
from fem_models.rig.layout import LayoutKeys
from fem_models.rig.rig import Friction, Material, rig_in_space
from fem_models.spatial import SpatialRig, WheelProgram, simulate_in_space, solve_spatial, spatial_rig, wheel_drives
from fem_models.spatial.motion.compensated import compensated_wheels
from fem_models.spatial.motion.workspace import smooth_rig
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
    rig = preset("du2018-full-widths")
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


RADIUS_DEG = 15.0


@dataclass(frozen=True)
class Circle:
    """Bending, shape (s, 2), deg, of three drives for one wanted circle, and their root mean square errors."""

    wanted: Floats
    bent: dict[str, Floats]
    rms_deg: dict[str, float]


def wanted_circle() -> Floats:
    """Angles of a circle: out, once round, and once back, shape (s, 2)."""
    out = np.column_stack([np.linspace(0, RADIUS_DEG, 11)[1:], np.zeros(10)])
    turn = 2 * np.pi * np.arange(1, SAMPLES + 1) / SAMPLES
    ring = RADIUS_DEG * np.column_stack([np.cos(turn), np.sin(turn)])
    return np.concatenate([out, ring, ring[::-1][1:], out[-1:]])


def compensated_circle() -> Circle:
    """Follow a circle by the drives of the wrist without friction and loop, and by compensated ones.

    The third drives were found with nine tenths of the friction: a model that is off.
    """
    rig = rig_in_space(preset("du2018-full-widths"), two_plane_keys())
    weaker = replace(rig, friction=scaled(rig.friction, 0.9))
    models = {"no compensation": smooth_rig(rig), "friction 10 % off": weaker, "compensated": rig}
    wanted, bent = wanted_circle(), dict[str, Floats]()
    for name, model in models.items():
        record = simulate_in_space(rig, WheelProgram(compensated_wheels(model, wanted).wheels_mm))
        assert record.angle_2_deg is not None
        bent[name] = np.column_stack([record.angle_deg, record.angle_2_deg])
    rms = {name: float(np.sqrt(np.mean(np.sum((angles - wanted) ** 2, axis=1)))) for name, angles in bent.items()}
    return Circle(wanted, bent, rms)


def two_plane_keys() -> LayoutKeys:
    """Turn every second notch of the default rig, with four tendons on two wheels."""
    return LayoutKeys("", tuple(90.0 * (k % 2) for k in range(14)), (0.0, 180.0, 90.0, 270.0), (1, 1, 2, 2))


def scaled(friction: Friction, part: float) -> Friction:
    """Scale all friction."""
    limits = {name: part * getattr(friction, name) for name in ("capstan_coefficient", "guide_N", "sheath_N")}
    return replace(friction, **limits)


def draw_compensated(found: Circle) -> Figure:
    """Draw what the tip does for one wanted circle."""
    figure = Figure(figsize=(9, 4.4), layout="constrained")
    path, off = figure.subplots(1, 2)
    path.plot(*found.wanted.T, color="0.75", lw=4, label="wanted")
    colours = {"no compensation": "tab:orange", "friction 10 % off": "tab:green", "compensated": "tab:blue"}
    for name, angles in found.bent.items():
        label = f"{name}: {found.rms_deg[name]:.2g} deg rms"
        path.plot(*angles.T, color=colours[name], lw=1.2, label=label)
        errors = np.linalg.norm(angles - found.wanted, axis=1)
        off.semilogy(np.maximum(errors, 1e-5), color=colours[name])
    path.set(xlabel="bending towards y, deg", ylabel="bending towards z, deg", aspect="equal")
    path.legend(loc="center", fontsize=8)
    off.set(xlabel="sample: out, round, back", ylabel="angles off the wanted ones, deg")
    return figure


if __name__ == "__main__":
    draw().savefig(DOCS / "images" / "circle-of-the-tip.png", dpi=110)
    draw_compensated(circle := compensated_circle()).savefig(DOCS / "images" / "compensated-circle.png", dpi=110)
    print("\n".join(f"{name}: {rms:.4f} deg rms" for name, rms in circle.rms_deg.items()))  # noqa: T201
