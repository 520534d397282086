"""One tendon, one bending robot, a load cell at the motor: stroke in, tension and bending out; quasi-static.

The tension T at the cell reaches the robot through a sheath or over pulleys whose wrap does not change,
T0 between (T - F) exp(-phi) and (T + F) exp(phi), and goes on from disc to disc, over the angle that each section has
bent: T_i between T_(i-1) exp(-mu theta) and T_(i-1) exp(mu theta) (capstan, Euler-Eytelwein). Within these ends a
tension stays what it was: the tendon sticks. A section bends as T_i - bias says, by an elastic part and one that slips
(Jenkins element, Iwan 1966, doi 10.1115/1.3625199), and not below straight. The stroke is arm times bending plus the
stretch of the tendon. There is no time in it.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from hysteresis.arrays import Floats

SECTIONS = 10
AT_REST_N = 0.4
_LARGEST_N = 1e3
_TOLERANCE_MM = 1e-11
_ITERATIONS = 200


@dataclass(frozen=True)
class TendonRig:
    """Constants of the rig.

    Parameters
    ----------
    entry
        phi: logarithm of the tension ratio before the robot, one way.
    constant_N
        F: friction before the robot that does not grow with tension.
    capstan
        mu: coefficient along the bent robot, 1/rad.
    zero_N
        What the load cell shows without load.
    bias_N
        Tension at the robot below which it stays straight.
    compliance_deg_per_N
        Bending per tension when all sections have the same, without the loop of the material.
    loop_share, loop_angle_deg
        Share of the stiffness that slips, and bending of the whole robot at which it does.
    stretch_mm_per_N
        Of the tendon.
    slack_mm, slack_N
        Slack and sag: slack_mm is left where the cell shows :data:`AT_REST_N`; it goes as exp(-tension / slack_N).
    cell_side
        Share of the tendon that stretches by the tension at the cell; the rest by that at the robot.
    arm_mm
        Of the tendon about the bending axis.
    start_mm
        Stroke of the straight robot without stretch and without slack.
    """

    entry: float = 0.2
    constant_N: float = 0.0
    capstan: float = 0.05
    zero_N: float = 0.0
    bias_N: float = 0.5
    compliance_deg_per_N: float = 20.0
    loop_share: float = 0.1
    loop_angle_deg: float = 8.0
    stretch_mm_per_N: float = 0.4
    slack_mm: float = 0.7
    slack_N: float = 0.2
    cell_side: float = 0.7
    arm_mm: float = 5.0
    start_mm: float = 0.4

    def row(self) -> Floats:
        """Constants in the order of the fields, shape (14,)."""
        return np.array(astuple(self), dtype=float)


@dataclass(frozen=True, eq=False)
class Run:
    """What the rig does along a stroke, shapes (m,). Work and losses are cumulative, mJ."""

    stroke_mm: Floats
    tension_N: Floats  # as the cell shows it
    bending_deg: Floats
    robot_N: Floats  # true tension at the robot's base
    work_mJ: Floats
    friction_mJ: Floats
    material_mJ: Floats


def bending_of_tension(rig: TendonRig, tension_N: ArrayLike, sections: int = SECTIONS) -> Floats:
    """Bending along a path of the cell's reading, shape (m,) -> (m,), deg; straight and at rest before it."""
    return _by_tension(np.ascontiguousarray(tension_N, dtype=float), rig.row(), sections)


def run_of_stroke(rig: TendonRig, stroke_mm: ArrayLike, first_N: float, sections: int = SECTIONS) -> Run:
    """Tension and bending along a path of the stroke, shape (m,); straight before it, the cell showing ``first_N``."""
    stroke = np.ascontiguousarray(stroke_mm, dtype=float)
    return Run(stroke, *_by_stroke(stroke, first_N, rig.row(), sections))


@njit(cache=True)
def _bend(true_N: float, row: Floats, old: Floats, new: Floats) -> float:
    """Bend all sections at a true tension at the cell: the sum in deg. Rows: tension, bending, elastic part."""
    entry, constant, capstan = row[0], row[1], row[2]
    bias, compliance, share, sections = row[4], row[5], row[6], old.shape[1]
    slips, stiffness = row[7] / sections, sections / compliance
    up = math.exp(entry)
    least, most = max(0.0, true_N - constant) / up, (true_N + constant) * up
    total = 0.0
    for i in range(sections):
        tension = min(max(old[0, i], least), most)
        moment = (tension - bias) / stiffness  # in degrees of an elastic section
        before, elastic = old[1, i], old[2, i]
        bent = moment + share * (before - elastic)
        now = elastic + bent - before
        if abs(now) > slips:
            now = math.copysign(slips, now)
            bent = (moment - share * now) / (1.0 - share)
        if bent < 0.0:
            bent = 0.0
            now = min(slips, max(-slips, elastic - before))
        new[0, i], new[1, i], new[2, i] = tension, bent, now
        total += bent
        wrap = math.exp(capstan * math.radians(bent))
        least, most = tension / wrap, tension * wrap
    return total


@njit(cache=True)
def _rest(true_N: float, sections: int) -> tuple[Floats, Floats]:
    old = np.zeros((3, sections))
    old[0] = true_N
    return old, old.copy()


@njit(cache=True)
def _by_tension(tension: Floats, row: Floats, sections: int) -> Floats:
    out = np.empty(tension.shape[0])
    old, new = _rest(max(0.0, tension[0] - row[3]), sections)
    for j in range(tension.shape[0]):
        out[j] = _bend(max(0.0, tension[j] - row[3]), row, old, new)
        old[:] = new
    return out


@njit(cache=True)
def _stretch(mean_N: float, row: Floats) -> float:
    return row[8] * mean_N - row[9] * math.exp(-(mean_N + row[3] - AT_REST_N) / row[10])


@njit(cache=True)
def _excess(true_N: float, stroke: float, row: Floats, old: Floats, new: Floats) -> float:
    """Stroke that a tension needs, over the one that is given; it grows with the tension."""
    bent = _bend(true_N, row, old, new)
    mean = row[11] * true_N + (1.0 - row[11]) * new[0, 0]
    return row[13] + row[12] * math.radians(bent) + _stretch(mean, row) - stroke


@njit(cache=True)
def _tension_at(stroke: float, guess: float, row: Floats, old: Floats, new: Floats) -> float:
    """Find the tension by false position (Illinois); 0 where the tendon is slack."""
    a, miss_a = 0.0, _excess(0.0, stroke, row, old, new)
    if miss_a >= 0.0:
        return 0.0
    b = max(guess, 0.1)
    miss_b = _excess(b, stroke, row, old, new)
    while miss_b < 0.0 and b < _LARGEST_N:
        a, miss_a, b = b, miss_b, 1.5 * b
        miss_b = _excess(b, stroke, row, old, new)
    for _ in range(_ITERATIONS):
        t = (a * miss_b - b * miss_a) / (miss_b - miss_a)
        miss = _excess(t, stroke, row, old, new)
        if abs(miss) < _TOLERANCE_MM:
            return t
        if miss * miss_b < 0.0:
            a, miss_a = b, miss_b
        else:
            miss_a *= 0.5
        b, miss_b = t, miss
    return b


@njit(cache=True)
def _by_stroke(
    stroke: Floats, first_N: float, row: Floats, sections: int
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    m = stroke.shape[0]
    out = np.zeros((6, m))
    true = max(0.0, first_N - row[3])
    old, new = _rest(true, sections)
    share, per_deg = row[6] * sections / row[5], math.radians(row[12])
    for j in range(m):
        before = true
        true = _tension_at(stroke[j], 1.02 * before + 0.01, row, old, new)
        _bend(true, row, old, new)
        mean = row[11] * true + (1.0 - row[11]) * new[0, 0]
        was = row[11] * before + (1.0 - row[11]) * old[0, 0]
        longer = _stretch(mean, row) - _stretch(was, row)
        turned, material = 0.0, 0.0
        friction = 0.5 * (before + true - was - mean) * longer
        for i in range(sections):
            bent = new[1, i] - old[1, i]
            turned += bent
            friction += 0.5 * (before + true - old[0, i] - new[0, i]) * per_deg * bent
            material += share * per_deg * new[2, i] * (bent - new[2, i] + old[2, i])
        out[0, j], out[1, j], out[2, j] = true + row[3], new[1].sum(), new[0, 0]
        if j > 0:
            out[3, j] = out[3, j - 1] + 0.5 * (before + true) * (longer + per_deg * turned)
            out[4, j], out[5, j] = out[4, j - 1] + friction, out[5, j - 1] + material
        old[:] = new
    return out[0], out[1], out[2], out[3], out[4], out[5]
