"""Rigs drawn at random within what a workshop can make.

Tubes of 1 to 8 mm with walls of 4 to 15 %, 4 to 24 notches of all three shapes, alike or each its own, one tendon or
two, preload 0.1 to 80 N, bends of 10 to 60 deg. Some have a toe region, a superelastic metal, closure, backlash.
See :mod:`validation.engines.checks.workshop_score`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.joint import joint_row
from fem_models.load import LoadProgram, triangle
from fem_models.rig import Rig
from fem_models.rig.effects import Backlash, Closure, Superelastic
from fem_models.rig.joints import Notch, NotchedTube, NotchShape, Tube
from fem_models.rig.layout import Layout
from fem_models.rig.rig import Friction, Material, Tendon, Wheel

QUARTER_SAMPLES = 22
"""Samples from rest to the largest drive: the paper's number."""
OPEN = 0.5
"""Largest mean angle of a joint over that at which its notch closes, of a rig without closure.

Friction lets the joints at the base bend further than the mean."""


def workshop_rig(seed: int | tuple[int, ...]) -> tuple[Rig, LoadProgram]:
    """Draw one rig, and a triangle of one cycle that bends it by 10 to 60 deg but for the stretch of its tendons."""
    rng = np.random.default_rng(seed)
    outer = rng.uniform(1.0, 8.0)
    inner = outer * (1 - 2 * rng.uniform(0.04, 0.15))
    shapes: tuple[NotchShape, ...] = ("v_pair", "rectangular_pair", "rectangular")
    shape = shapes[int(rng.integers(3))]
    count = int(rng.integers(4, 25))
    width = outer * rng.uniform(0.08, 0.3)
    most = outer if shape == "rectangular" else outer / 2
    depths = most * rng.uniform(0.65, 0.9) * (1 + rng.uniform(-0.02, 0.02, count))
    notch = Notch(
        shape,
        count,
        tuple(depths.tolist()) if rng.random() < 0.2 else float(depths[0]),
        width,
        outer * rng.uniform(0.1, 0.5),
        width * rng.uniform(0.3, 0.7) if shape == "v_pair" else None,
    )
    preload = 10 ** rng.uniform(-1, np.log10(80))
    tendon = Tendon(
        EA_N=10 ** rng.uniform(np.log10(2e3), 5),
        moment_arm_mm=inner / 2 * rng.uniform(0.85, 0.98),
        free_length_mm=rng.uniform(50, 800),
        toe_N=10 ** rng.uniform(-1, 1.3) if rng.random() < 1 / 3 else 0.0,
    )
    two, closes = rng.random() < 0.7, rng.random() < 0.5
    if two and shape == "rectangular":  # their preload bends it at rest already
        closes = True
    plateau = rng.uniform(350, 600)
    rig = Rig(
        name=f"workshop {seed}",
        joint=NotchedTube(Tube(outer, inner), notch),
        material=Material(rng.uniform(30, 75), 0.33, rng.choice([0.0, rng.uniform(0.05, 0.4)]), rng.uniform(1, 3)),
        tendon_a=tendon,
        tendon_b=tendon if two else None,
        wheel=Wheel(rng.uniform(4, 20)),
        preload_N=preload,
        friction=Friction(
            capstan_coefficient=float(rng.choice([0.0, 0.05, 0.1, 0.2, 0.3])),
            guide_N=float(rng.choice([0.0, rng.uniform(0, 0.05)])),
            sheath_N=float(rng.choice([0.0, rng.uniform(0, 0.5)])),
            rest_wrap_deg=float(rng.choice([0.0, rng.uniform(0, 90)])),
        ),
        superelastic=Superelastic(plateau, rng.uniform(0.3, 0.8) * plateau) if rng.random() < 1 / 3 else None,
        closure=Closure(10 ** rng.uniform(2, 4)) if closes else None,
        backlash=Backlash(rng.uniform(0.01, 0.1)) if rng.random() < 0.25 else None,
    )
    bend = np.radians(rng.uniform(10, 60))
    joints = joint_row(rig)
    if rig.closure is None:
        bend = min(bend, OPEN * float(joints.of("closure_angle_rad").min()) * count)
    amplitude = float(joints.first.arms_mm.a * bend)
    return rig, triangle(amplitude, step_mm=amplitude / QUARTER_SAMPLES)


def workshop_wrist(seed: int | tuple[int, ...]) -> tuple[Rig, list[list[float]]]:
    """Draw a wrist whose notches are turned by 90 deg in turn, with four tendons on two wheels; drives of the wheels.

    They lead out, and once round a circle.
    """
    rng = np.random.default_rng(seed)
    rig, program = workshop_rig((int(rng.integers(2**31)),))
    while rig.joint.notch.shape == "rectangular" or rig.tendon_b is None:  # type: ignore[union-attr]
        rig, program = workshop_rig((int(rng.integers(2**31)),))
    plane = replace(rig, name=f"wrist {seed}", tendon_b=None, superelastic=None, backlash=None)
    turns = tuple(90.0 * (k % 2) for k in range(rig.joints))
    wrist = replace(plane, layout=Layout(turns, angles_deg=(0.0, 180.0, 90.0, 270.0), wheels=(1, 1, 2, 2)))
    reach = 0.5 * float(program.drive_mm.max())
    out = np.linspace(0, reach, 8)[:, None] * [1.0, 0.0]
    turn = np.linspace(0, 2 * np.pi, 33)[1:]
    return wrist, [*out.tolist(), *(reach * np.stack([np.cos(turn), np.sin(turn)], axis=1)).tolist()]
