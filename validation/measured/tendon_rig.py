"""Quasi-static rig of one tendon, a bending robot and a load cell at the motor: stroke in, tension and bending out.

The tension T at the cell reaches the robot through a sheath or over pulleys of constant wrap. T0 lies between
(T - F) exp(-phi) and (T + F) exp(phi). From disc to disc the tension changes with the bending theta of each section:
T_i lies between T_(i-1) exp(-mu theta) and T_(i-1) exp(mu theta) (capstan equation, Euler-Eytelwein). Within these
limits the tendon sticks and a tension stays constant. A section bends according to T_i - bias by an elastic part and a
slipping part (Jenkins element, Iwan 1966, doi 10.1115/1.3625199), and not below straight. The stroke is arm times
bending plus the stretch of the tendon.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import NamedTuple

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
    """Parameters of the rig.

    Parameters
    ----------
    entry
        phi: logarithm of the tension ratio before the robot, in one direction.
    constant_N
        F: friction before the robot that does not depend on the tension.
    capstan
        mu: capstan coefficient along the bent robot, 1/rad.
    zero_N
        Reading of the load cell without load.
    bias_N
        Tension at the robot below which it stays straight.
    compliance_deg_per_N
        Bending per tension if all sections have the same tension, without the loop of the material.
    loop_share, loop_angle_deg
        Share of the stiffness that slips, and bending of the whole robot at which it slips.
    stretch_mm_per_N
        Of the tendon.
    slack_mm, slack_N
        Slack and sag: slack_mm at a reading of :data:`AT_REST_N`, decreasing as exp(-tension / slack_N).
    cell_side
        Share of the tendon that stretches with the tension at the cell; the rest stretches with that at the robot.
    arm_mm
        Moment arm of the tendon about the bending axis.
    start_mm
        Stroke of the straight robot without stretch and slack.
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
        """Parameters in the order of the fields, shape (14,)."""
        return np.array(astuple(self), dtype=float)


class _Values(NamedTuple):
    """Parameters of a :class:`TendonRig` for the compiled functions."""

    entry: float
    constant_N: float
    capstan: float
    zero_N: float
    bias_N: float
    compliance_deg_per_N: float
    loop_share: float
    loop_angle_deg: float
    stretch_mm_per_N: float
    slack_mm: float
    slack_N: float
    cell_side: float
    arm_mm: float
    start_mm: float


def _values(rig: TendonRig) -> _Values:
    return _Values(*rig.row().tolist())


@dataclass(frozen=True, eq=False)
class Run:
    """Response of the rig along a stroke, shapes (m,).

    ``tension_N`` is the reading of the cell, ``robot_N`` the true tension at the robot's base. Work and losses are
    cumulative, mJ.
    """

    stroke_mm: Floats
    tension_N: Floats
    bending_deg: Floats
    robot_N: Floats
    work_mJ: Floats
    friction_mJ: Floats
    material_mJ: Floats


def bending_of_tension(rig: TendonRig, tension_N: ArrayLike, sections: int = SECTIONS) -> Floats:
    """Bending along a path of the cell's reading, shape (m,) -> (m,), deg, from the straight robot at rest."""
    return _by_tension(np.ascontiguousarray(tension_N, dtype=float), _values(rig), sections)


def run_of_stroke(rig: TendonRig, stroke_mm: ArrayLike, first_N: float, sections: int = SECTIONS) -> Run:
    """Tension and bending along a path of the stroke, shape (m,), from the straight robot at a reading ``first_N``."""
    stroke = np.ascontiguousarray(stroke_mm, dtype=float)
    return Run(stroke, *_by_stroke(stroke, first_N, _values(rig), sections))


@njit(cache=True)
def _bend(true_N: float, rig: _Values, old: Floats, new: Floats) -> float:
    """Bend all sections at a true tension at the cell; return the sum, deg. Rows: tension, bending, elastic part."""
    entry, constant, capstan = rig.entry, rig.constant_N, rig.capstan
    bias, compliance, share, sections = rig.bias_N, rig.compliance_deg_per_N, rig.loop_share, old.shape[1]
    slips, stiffness = rig.loop_angle_deg / sections, sections / compliance
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
def _by_tension(tension: Floats, rig: _Values, sections: int) -> Floats:
    out = np.empty(tension.shape[0])
    old, new = _rest(max(0.0, tension[0] - rig.zero_N), sections)
    for j in range(tension.shape[0]):
        out[j] = _bend(max(0.0, tension[j] - rig.zero_N), rig, old, new)
        old[:] = new
    return out


@njit(cache=True)
def _stretch(mean_N: float, rig: _Values) -> float:
    return rig.stretch_mm_per_N * mean_N - rig.slack_mm * math.exp(-(mean_N + rig.zero_N - AT_REST_N) / rig.slack_N)


@njit(cache=True)
def _excess(true_N: float, stroke: float, rig: _Values, old: Floats, new: Floats) -> float:
    """Difference of the stroke at a tension from the given stroke; it increases with the tension."""
    bent = _bend(true_N, rig, old, new)
    mean = rig.cell_side * true_N + (1.0 - rig.cell_side) * new[0, 0]
    return rig.start_mm + rig.arm_mm * math.radians(bent) + _stretch(mean, rig) - stroke


@njit(cache=True)
def _tension_at(stroke: float, guess: float, rig: _Values, old: Floats, new: Floats) -> float:
    """Find the tension by false position (Illinois); 0 if the tendon is slack."""
    a, excess_a = 0.0, _excess(0.0, stroke, rig, old, new)
    if excess_a >= 0.0:
        return 0.0
    b = max(guess, 0.1)
    excess_b = _excess(b, stroke, rig, old, new)
    while excess_b < 0.0 and b < _LARGEST_N:
        a, excess_a, b = b, excess_b, 1.5 * b
        excess_b = _excess(b, stroke, rig, old, new)
    for _ in range(_ITERATIONS):
        t = (a * excess_b - b * excess_a) / (excess_b - excess_a)
        excess = _excess(t, stroke, rig, old, new)
        if abs(excess) < _TOLERANCE_MM:
            return t
        if excess * excess_b < 0.0:
            a, excess_a = b, excess_b
        else:
            excess_a *= 0.5
        b, excess_b = t, excess
    return b


@njit(cache=True)
def _by_stroke(
    stroke: Floats, first_N: float, rig: _Values, sections: int
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    m = stroke.shape[0]
    out = np.zeros((6, m))
    true = max(0.0, first_N - rig.zero_N)
    old, new = _rest(true, sections)
    share, per_deg = rig.loop_share * sections / rig.compliance_deg_per_N, math.radians(rig.arm_mm)
    for j in range(m):
        before = true
        true = _tension_at(stroke[j], 1.02 * before + 0.01, rig, old, new)
        _bend(true, rig, old, new)
        mean = rig.cell_side * true + (1.0 - rig.cell_side) * new[0, 0]
        was = rig.cell_side * before + (1.0 - rig.cell_side) * old[0, 0]
        longer = _stretch(mean, rig) - _stretch(was, rig)
        turned, material = 0.0, 0.0
        friction = 0.5 * (before + true - was - mean) * longer
        for i in range(sections):
            bent = new[1, i] - old[1, i]
            turned += bent
            friction += 0.5 * (before + true - old[0, i] - new[0, i]) * per_deg * bent
            material += share * per_deg * new[2, i] * (bent - new[2, i] + old[2, i])
        out[0, j], out[1, j], out[2, j] = true + rig.zero_N, new[1].sum(), new[0, 0]
        if j > 0:
            out[3, j] = out[3, j - 1] + 0.5 * (before + true) * (longer + per_deg * turned)
            out[4, j], out[5, j] = out[4, j - 1] + friction, out[5, j - 1] + material
        old[:] = new
    return out[0], out[1], out[2], out[3], out[4], out[5]
