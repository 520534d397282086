"""A quasi-static rig with distributed friction, written apart from ``fem_models`` and from the lumped rig.

One angle t, two tendons, no time: flexures k1 t + k2 t^2 + k3 t^3, tendons T = k e (1 + c e), and two banks of
Maxwell-slip elements (Iwan 1966, doi 10.1115/1.3625199), one for the metal and one for the tendons along their guides.
The elements of a bank have drawn shares and drawn slip angles. The friction of the guides grows with the preload of a
record, but not with the tension of the moment.

Units are mm, N, rad inside.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numba import njit

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from validation.practice.draw import Case, Noiseless, Truth, with_white_noise
from validation.practice.planned import Planned, program_of

Rng = np.random.Generator
ELEMENTS = 12
"""Of each bank."""
TOLD_ERROR = 0.03
"""Relative standard deviation of the stiffnesses that the sidecar tells."""
PRELOADS_N = (20.0, 10.0)


@dataclass(frozen=True, eq=False)
class MaxwellSlipRig:
    """Parameters of the rig.

    Parameters
    ----------
    arm_mm, tendon_N_per_mm, tendon_growth_per_mm
        Of either tendon: its arm, stiffness, and how that grows with the stretch.
    flexure
        k1, k2 and k3, Nmm per rad, rad^2 and rad^3.
    metal_Nmm, guides_Nmm
        Moments at which all elements of a bank slip; that of the guides at 20 N.
    metal_rad, guides_rad
        Angles at which the elements slip, shape (n,) each.
    metal_shares, guides_shares
        Shares of the elements in the moment, shape (n,) each.
    friction_growth
        Relative growth of the guides' friction from 0 to 20 N of preload.
    """

    arm_mm: float
    tendon_N_per_mm: float
    tendon_growth_per_mm: float
    flexure: Floats
    metal_Nmm: float
    guides_Nmm: float
    metal_rad: Floats
    guides_rad: Floats
    metal_shares: Floats
    guides_shares: Floats
    friction_growth: float


@njit(cache=True)
def _bend(drive: Floats, pulls: Floats, flexure: Floats, tops: Floats, slips: Floats) -> Floats:
    """Angle of each sample, rad; ``pulls`` are arm, stiffness, growth and rest stretch, elements have tops and slips.

    The balance of moments is monotone in the angle and solved by bisection between two bounds.
    """
    arm, stiffness, growth, rest = pulls
    angle, out = 0.0, np.empty(drive.size)
    moment = np.zeros(tops.size)
    for k in range(drive.size):
        low, high = angle - 0.5, angle + 0.5
        for _ in range(44):
            t = 0.5 * (low + high)
            stretch = drive[k] - arm * t
            a, b = max(rest + stretch, 0.0), max(rest - stretch, 0.0)
            total = arm * stiffness * (a * (1 + growth * a) - b * (1 + growth * b))
            total -= t * (flexure[0] + t * (flexure[1] + t * flexure[2]))
            for i in range(tops.size):
                own = moment[i] + tops[i] / slips[i] * (t - angle)
                total -= min(max(own, -tops[i]), tops[i])
            if total > 0.0:
                low = t
            else:
                high = t
        new = 0.5 * (low + high)
        for i in range(tops.size):
            moment[i] = min(max(moment[i] + tops[i] / slips[i] * (new - angle), -tops[i]), tops[i])
        angle = new
        out[k] = angle
    return out


def simulate_maxwell_slip(rig: MaxwellSlipRig, preload_N: float, drive_mm: Floats) -> Floats:
    """Angle of the rig along a drive from rest, shape (m,), deg."""
    stiffness, growth = rig.tendon_N_per_mm, rig.tendon_growth_per_mm
    rest = (np.sqrt(1 + 4 * growth * preload_N / stiffness) - 1) / (2 * growth) if growth else preload_N / stiffness
    friction = (1 + rig.friction_growth * preload_N / 20.0) / (1 + rig.friction_growth)
    tops = np.concatenate([rig.metal_Nmm * rig.metal_shares, friction * rig.guides_Nmm * rig.guides_shares])
    slips = np.concatenate([rig.metal_rad, rig.guides_rad])
    pulls = np.array([rig.arm_mm, stiffness, growth, rest])
    return np.degrees(_bend(drive_mm, pulls, rig.flexure, tops, slips))


def draw_maxwell_slip(seed: int, number: int) -> Case:
    """Draw a clean rig and four records of it; the sidecar tells measured joints, with errors.

    The same arguments give the same records.
    """
    rng = np.random.default_rng((seed, zlib.crc32(b"maxwell slip"), number))
    rig, noise = _drawn_rig(rng), round(float(rng.uniform(0.03, 0.08)), 4)
    told = _told(rig, rng)
    records = []
    for i, plan in enumerate(_plans(rng)):
        program = program_of(plan)
        record = Record(
            drive=program.drive_mm,
            angle_deg=simulate_maxwell_slip(rig, plan.preload_N, program.drive_mm),
            time_s=program.time_s,
            cycle=program.cycle,
            title=f"Practice record {i + 1} of a rig with distributed friction, no measurement",
            kind="simulated",
            rig={**told, "preload_N": plan.preload_N},
        )
        records.append(record)
    truth = Truth((), {}, (), (), engine="maxwell slip", noise_deg=noise, rig="maxwell slip")
    zeros = tuple(float(zero) for zero in rng.normal(0.0, 0.1, len(records)))
    return with_white_noise(Noiseless(f"clean-{number:02d}", tuple(records), zeros, truth), rng)


def _drawn_rig(rng: Rng) -> MaxwellSlipRig:
    stiffness = float(rng.uniform(25.0, 80.0))

    def shares() -> Floats:
        return np.asarray(rng.dirichlet(np.ones(ELEMENTS)))

    metal, guides = float(rng.uniform(0.05, 0.2)), float(np.exp(rng.uniform(*np.log((0.002, 0.02)))))
    return MaxwellSlipRig(
        arm_mm=float(rng.uniform(2.0, 3.2)),
        tendon_N_per_mm=float(rng.uniform(40.0, 90.0)),
        tendon_growth_per_mm=float(rng.uniform(0.0, 0.1)),
        flexure=stiffness * np.array([1.0, rng.uniform(-0.02, 0.02), rng.uniform(-0.1, 0.4)]),
        metal_Nmm=stiffness * float(rng.uniform(0.03, 0.12)),
        guides_Nmm=float(rng.uniform(1.0, 5.0)),
        metal_rad=metal * rng.uniform(0.1, 1.0, ELEMENTS),
        guides_rad=guides * rng.uniform(0.1, 1.0, ELEMENTS),
        metal_shares=shares(),
        guides_shares=shares(),
        friction_growth=float(rng.uniform(0.0, 1.5)),
    )


def _plans(rng: Rng) -> list[Planned]:
    full = round(float(rng.uniform(1.2, 2.4)), 2)
    slow = round(float(np.exp(rng.uniform(*np.log((0.04, 0.2))))), 3)
    fast, cycles = round(slow * float(rng.uniform(4.0, 12.0)), 3), int(rng.integers(3, 6))
    high, low = PRELOADS_N
    rows = [(high, full, slow), (low, full, slow), (high, full, fast), (low, round(0.55 * full, 2), fast)]
    return [Planned(*row, cycles, int(rng.integers(60, 160))) for row in rows]


def _told(rig: MaxwellSlipRig, rng: Rng) -> dict[str, float]:
    off, free, joints = 1 + rng.normal(0.0, TOLD_ERROR, 2), 150.0, 12
    return {
        "joints": joints,
        "moment_arm_mm": round(rig.arm_mm, 3),
        "flexure_stiffness_Nmm_per_rad": round(joints * float(rig.flexure[0]) * float(off[0]), 2),
        "tendon_EA_N": round(rig.tendon_N_per_mm * free * float(off[1]), 1),
        "tendon_free_length_mm": free,
        "pitch_mm": 2.5,
    }
