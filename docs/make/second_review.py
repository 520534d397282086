"""Writes the table of ``docs/validation/second-review.md``: ``python -m docs.make.second_review``, half a minute.

Findings of a review with closed forms of its own: the closed form, the figure that the review saw, the figure now.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from benchmarks.covered_shares import NOISES_DEG, counts, kept
from docs.make.pages import DOCS, put_between_marks, table
from docs.make.separation import SCORE
from fem_models.chain.solve import simulate_chain, solve_chain
from fem_models.joint.mechanics import joint_mechanics
from fem_models.joint.section import root_section
from fem_models.load import LoadProgram, triangle
from fem_models.multibody.quasi_static import solve_multibody_by_force
from fem_models.rig import Rig, preset
from fem_models.rig.effects import Creep
from fem_models.rig.joints import MeasuredJoint, Notch
from fem_models.rig.rig import Friction, Tendon, notched_tube
from fem_models.spatial import DeadLoads, solve_spatial, spatial_rig
from hysteresis.arrays import Floats
from hysteresis.records.metrics import loop_width
from validation.separation import loop_program, separate

PAGE = DOCS / "validation" / "second-review.md"
LAW_WIDTH_DEG = 5.51
"""Of equation 7 with the constants of equation 10, over +-45 deg: readings.md."""
AMPLITUDE_MM = 2.2


@dataclass(frozen=True)
class Finding:
    """One row of the page."""

    what: str
    right: str
    before: str
    now: str


def _widths(rig: Rig, amplitude_mm: float) -> tuple[Floats, Floats]:
    """Widths of the last cycle between its branches, deg, over the drive, mm."""
    record = simulate_chain(rig, triangle(amplitude_mm, cycles=2, step_mm=0.05))
    found = loop_width(record.drive, record.angle_deg, record.cycle)
    return found.drive, found.width_deg


def reading() -> Finding:
    """Bound of the paper's largest error by the width of the preset's loop."""
    width = _widths(preset("du2018"), AMPLITUDE_MM)[1].max()
    return Finding(
        "1: least possible largest error of equation 10 on the preset's loop at 20 N, deg",
        "at most 1.48, Table 1",
        "1.65",
        f"{(LAW_WIDTH_DEG - width) / 2:.2f}",
    )


def intervals() -> Finding:
    """Shares that the intervals of ``separate`` hold."""
    rows = [one for one in kept(SCORE) if one.noise_deg == NOISES_DEG[0]]
    drawn, members = (counts([one for one in rows if one.members is like], "share") for like in (False, True))
    return Finding(
        "2: shares of the energy that the 95 % intervals of `separate` hold, [rigs](separation.md) unlike the file",
        "95 %",
        "10 of 30",
        f"{drawn[0]} of {drawn[1]} drawn from the priors, {members[0]} of {members[1]} of the ensemble",
    )


def strain() -> Finding:
    """Peak strain of a linear rig: bending, and the thrust of both tendons over the root's area and modulus."""
    rig = preset("du2018-full-widths")
    run = solve_chain(rig, LoadProgram(np.linspace(0.0, AMPLITUDE_MM, 23)))
    assert run.record.notches_deg is not None
    bending = np.abs(np.radians(run.record.notches_deg)) * joint_mechanics(rig).peak_strain_per_rad
    area_N = 1e3 * rig.material.youngs_modulus_GPa * root_section(rig.joint).area_mm2
    exact = bending + run.segment_tensions_N[:, :, 1:].sum(axis=1) / area_N
    shown = 100 * np.abs(run.peak_strain).max()
    return Finding("3: peak strain at 20 N and 2.2 mm, %", f"{100 * exact.max():.3f}", "2.03", f"{shown:.3f}")


def shape() -> list[Finding]:
    """Where the loop of the preset is wide, and at which amplitudes."""
    rig = preset("du2018")
    x, width = _widths(rig, AMPLITUDE_MM)
    half = _widths(rig, 0.5 * AMPLITUDE_MM)[1].max()
    at = np.interp([0.0, 0.9 * AMPLITUDE_MM], x, width) / width.max()
    return [
        Finding("4: width at zero drive over the largest", "1, the paper", "0.993, and an argmax", f"{at[0]:.3f}"),
        Finding("5: width at 1.1 mm over that at 2.2 mm", "1, the paper", "0.76", f"{half / width.max():.2f}"),
        Finding("5: width at 0.9 of the stroke over the largest", "the least, the paper", "0.84", f"{at[1]:.2f}"),
    ]


def stiff_joints() -> list[Finding]:
    """Tension at the tip behind ten rigid bends of 9 deg, the base with half of one: 20 N exp(-mu phi)."""
    force, found = np.arange(0.0, 20.1, 0.5), []
    exact = 20 * np.exp(-0.3 * np.radians(9.5 * 9.0))
    for stiffness, before in ((1e6, "12.92"), (1e7, "13.15"), (1e8, "13.84")):
        rig = Rig(
            name="rigid bends",
            joint=MeasuredJoint(10, 2.6, stiffness),
            material=preset("du2018").material,
            tendon_a=Tendon(EA_N=9000.0, moment_arm_mm=2.62, free_length_mm=150.0),
            tendon_b=None,
            wheel=preset("du2018").wheel,
            preload_N=0.0,
            precurvature_deg=9.0,
            friction=Friction(capstan_coefficient=0.3),
        )
        tip = solve_multibody_by_force(rig, force).segment_tensions_N[-1, 0, -1]
        what = f"7: tension at the tip, joints of {stiffness:g} Nmm/rad, multibody model, N"
        found.append(Finding(what, f"{exact:.2f}", before, f"{tip:.2f}"))
    return found


def closure() -> Finding:
    """Angle at which a V notch closes: its neutral line bends to an arc, its faces stay straight."""
    rig = preset("du2018-full-widths")
    joint, cut, lever = joint_mechanics(rig), notched_tube(rig).cut, 0.5 * notched_tube(rig).tube.outer_diameter_mm
    length, width = joint.bending_length_mm, float(np.mean(cut.width_mm))

    def apart(angle: float) -> float:
        half = 0.5 * angle
        return length / angle * np.sin(half) + 0.5 * (width - length) * np.cos(half) - lever * np.sin(half)

    exact, hinge = brentq(apart, 1e-3, 2.0), 2 * np.arctan(0.5 * width / lever)
    now = joint.closure_angle_rad / exact - 1
    return Finding("8: a V notch closes early by, %", "0", f"{100 * (1 - hinge / exact):.1f}", f"{abs(100 * now):.4f}")


def creep() -> Finding:
    """Fall of the angle one sample after a step of the drive, over that in the end, by the closed form."""
    fraction, time_s, step_s = 0.3, 20.0, 1.0
    base = preset("du2018")
    tendon = replace(base.tendon_a, toe_N=0.0)
    metal = replace(base.material, loop_share=0.0)
    rig = replace(base, friction=Friction(), material=metal, tendon_a=tendon, tendon_b=tendon)
    rig = replace(rig, creep=Creep(fraction, time_s))

    def angle(step: float) -> Floats:
        time = np.concatenate([[0.0], 1e-6 + step * np.arange(13)])
        drive = np.concatenate([[0.0], np.full(13, 0.2)])
        return solve_chain(rig, LoadProgram(drive, time_s=time)).record.angle_deg[1:]

    soon, late = angle(step_s), angle(40 * time_s)
    whole = (late[0] - late[-1]) / late[0]
    exact = -np.expm1(-step_s / (time_s * (1 - whole)))
    now = (soon[0] - soon[1]) / (late[0] - late[-1])
    return Finding("8: creep one sample after a step, over that in the end", f"{exact:.4f}", "0", f"{now:.4f}")


def shear_centre() -> Finding:
    """Distance from the neutral axis to the axis that a force across twists a thin arc about."""
    base = preset("du2018")
    tube = replace(notched_tube(base).tube, outer_diameter_mm=3.5, inner_diameter_mm=2.74)
    joint = replace(notched_tube(base), tube=tube, notch=Notch("rectangular", 5, 1.2, 1.5, 1.2))
    radius, a = 1.56, np.arccos((1.2 - 1.75) / 1.56)
    exact = 2 * radius * (np.sin(a) - a * np.cos(a)) / (a - np.sin(a) * np.cos(a)) - radius * np.sin(a) / a
    wrist = spatial_rig(replace(base, joint=joint))
    soft = replace(wrist.tendons[0].tendon, EA_N=1e-6, toe_N=0.0)
    alone = replace(wrist, tendons=(replace(wrist.tendons[0], tendon=soft),), preload_N=0.0, friction=Friction())
    load = DeadLoads(tip_N=(0.0, 0.0, 1e-4))
    twist_rad = np.radians(solve_spatial(replace(alone, loads=load), np.zeros((1, 1))).torsion_deg[0]) / 5
    one = wrist.joints[0]
    now = twist_rad / 1e-4 / (1 / one.stiffness.torsion + 1 / one.ring[1])
    what = "8: arm of a force across about a one-sided notch of 3.5/2.74 mm cut 1.2 mm deep, mm"
    return Finding(what, f"{exact:.2f}", "0", f"{now:.2f}")


def energy() -> Finding:
    """Energy of a cycle by the command ``separate``, and by the table of the page on contributions."""
    parts = separate(preset("du2018", preload_N=20.0), loop_program(-AMPLITUDE_MM, AMPLITUDE_MM))
    command = sum(parts.parts("dissipated_mJ").values())
    page = (DOCS / "guide" / "contributions.md").read_text(encoding="utf-8")
    sum_row = next(line for line in page.splitlines() if line.startswith("| sum |"))
    return Finding(
        "8: energy of a cycle, the command and the page on contributions, mJ",
        "the same",
        "30.65 and 30.53",
        f"{command:.2f} and {sum_row.split('|')[3].strip()}",
    )


def main() -> None:
    """Work out all rows and put them on the page."""
    found = [reading(), intervals(), strain(), *shape(), *stiff_joints(), closure(), creep(), shear_centre(), energy()]
    rows = [[one.what, one.right, one.before, one.now] for one in found]
    put_between_marks(PAGE, "docs.make.second_review", table(["finding", "right", "review", "now"], rows))


if __name__ == "__main__":
    main()
