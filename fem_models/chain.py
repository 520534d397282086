"""The compiled twin of the multibody model: the same rig as a chain of joints and rope segments, quasi-static.

Unknowns are the joint angles and the slip of either tendon at every guide. A joint sees only the rope segments that
cross its notch, and a guide only its two neighbouring segments, so the tangent is a band of half width 4 and a Newton
step costs time linear in the number of joints. Friction, material loop and their histories follow the same laws as
in the multibody model (:mod:`fem_models.friction`), with exact tangents, the dependence of a sliding guide's friction
on tensions and wrap included.

What it leaves out beside the multibody model: flexibility of the rings, shear of the flexures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fem_models.friction import jenkins_elements
from fem_models.presets import sidecar_table
from fem_models.program import LoadProgram, SolverError
from fem_models.rig import Rig
from fem_models.snr import BENCH_GAP, bending_length_mm, flexure, moment_arms_mm
from hysteresis.record import Record

Floats = NDArray[np.float64]
_BAND = 4


@dataclass(frozen=True)
class ChainSettings:
    """Numerical settings. ``tolerance`` is of the residual, over the preload; the rest as in the multibody model."""

    bristle_ratio: float = 0.02
    max_step_mm: float = 0.1
    max_halvings: int = 12
    newton_iterations: int = 20
    tolerance: float = 1e-10


@dataclass(frozen=True)
class ChainSolution:
    """A record with what only the model knows; fields as in :class:`fem_models.multibody.MultibodySolution`."""

    record: Record
    segment_tensions_N: Floats
    wheel_work_mJ: Floats
    friction_loss_mJ: Floats
    material_loss_mJ: Floats


@njit(cache=True)
def _toe_tension(stretch: float, k: float, toe: float, preload: float, guess: float) -> tuple[float, float]:
    """Tension and its slope of the rope between wheel and base; unilateral if linear."""
    if toe == 0.0:
        tension = preload + k * stretch
        return (tension, k) if tension > 0.0 else (0.0, 0.0)
    target = preload + toe * math.log(preload) + k * stretch
    y = math.log(max(guess, 1e-300))
    for _ in range(60):  # Newton on exp(y) + toe y, convex and increasing
        e = math.exp(min(y, 700.0))
        step = (e + toe * y - target) / (e + toe)
        step = max(step, -2.0)
        y -= step
        if abs(step) < 1e-15 * (1.0 + abs(y)):
            break
    tension = math.exp(y)
    return tension, k * tension / (tension + toe)


@njit(cache=True)
def _solve_band(a: Floats, b: Floats) -> None:
    """Solve in place a banded system stored as a[i, j - i + 4], by elimination without pivoting."""
    n = b.size
    for i in range(n):
        pivot = 1.0 / a[i, _BAND]
        for r in range(i + 1, min(i + _BAND + 1, n)):
            factor = a[r, i - r + _BAND] * pivot
            if factor != 0.0:
                for c in range(1, min(_BAND, n - 1 - i) + 1):
                    a[r, i + c - r + _BAND] -= factor * a[i, _BAND + c]
                b[r] -= factor * b[i]
    for i in range(n - 1, -1, -1):
        total = b[i]
        for c in range(1, min(_BAND, n - 1 - i) + 1):
            total -= a[i, _BAND + c] * b[i + c]
        b[i] = total / a[i, _BAND]


@njit(cache=True)
def _segment(
    ea: float, eb: float, ca: float, cb: float, q: float, preload: float
) -> tuple[float, float, float, float, float, float]:
    """Tensions of both ropes over one pitch, and dTa/dea, dTa/deb, dTb/dea, dTb/deb.

    The flexure shortens by q (Ta + Tb - 2 T0) and both ropes with it; a slack rope has no tension and no stiffness.
    """
    target_a = preload + ca * (ea + 2.0 * q * preload)
    target_b = preload + cb * (eb + 2.0 * q * preload)
    d = 1.0 + (ca + cb) * q
    ta = ((1.0 + cb * q) * target_a - ca * q * target_b) / d
    tb = ((1.0 + ca * q) * target_b - cb * q * target_a) / d
    if ta > 0.0 and tb > 0.0:
        cross = -ca * cb * q / d
        return ta, tb, (1.0 + cb * q) * ca / d, cross, cross, (1.0 + ca * q) * cb / d
    ta, tb = target_a / (1.0 + ca * q), target_b / (1.0 + cb * q)
    if ta > 0.0 and ta >= tb:
        return ta, 0.0, ca / (1.0 + ca * q), 0.0, 0.0, 0.0
    if tb > 0.0:
        return 0.0, tb, 0.0, 0.0, 0.0, cb / (1.0 + cb * q)
    return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


# Constants of a rig in one array, so that the kernels take one argument for all of them.
(_PRELOAD, _ELASTIC, _ARM_A, _ARM_B, _HALF_GAP, _ROPE_A, _ROPE_B, _FREE_A, _FREE_B, _TOE_A, _TOE_B, _AXIAL, _MU, _GUIDE,
 _SHEATH, _REST_WRAP, _BRISTLE_A, _BRISTLE_B, _TOLERANCE) = range(19)  # fmt: skip


@njit(cache=True)
def _friction(
    slip: float, rest: float, stiffness: float, constant: float, ratio: float, wrap: float, mu: float,
    proximal: float, distal: float,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Friction of a guide, its slope in the slip, in both tensions (the same for both), in the wrap; its limit."""
    limit = constant + (proximal + distal) * ratio
    force = stiffness * (slip - rest)
    if abs(force) <= limit:
        return force, stiffness, 0.0, 0.0, limit
    sign = 1.0 if force > 0.0 else -1.0
    return sign * limit, 0.0, sign * ratio, sign * (proximal + distal) * 0.5 * mu * (1.0 - ratio * ratio), limit


@njit(cache=True)
def _assemble(
    drive: float, x: Floats, c: Floats, history: tuple[Floats, Floats, Floats, Floats, Floats], guess: Floats,
    a: Floats, b: Floats, tension: Floats, limit: Floats,
) -> float:  # fmt: skip
    """Fill tangent ``a`` and residual ``b`` at x = (theta_i, slip a, slip b) guide by guide; largest residual, N.

    ``history``: rest points of guides (2, N) and Jenkins elements (k, N), slip moments and stiffnesses (k,).
    ``tension`` (2, N+1) and ``limit`` (2, N) are filled as well.
    """
    rest, jenkins_rest, jenkins_stiffness, slip_moment, _ = history
    n = rest.shape[1]
    a[:] = 0.0
    a[0, _BAND] = 1.0  # the base does not turn
    b[0] = 0.0
    a[3 * n + 1, _BAND] = 1.0  # the ropes are anchored at the tip
    a[3 * n + 2, _BAND] = 1.0
    b[3 * n + 1] = 0.0
    b[3 * n + 2] = 0.0
    preload, mu = c[_PRELOAD], c[_MU]
    tp_a, k_a = _toe_tension(drive - x[1], c[_FREE_A], c[_TOE_A], preload, guess[0])
    tp_b, k_b = _toe_tension(-drive - x[2], c[_FREE_B], c[_TOE_B], preload, guess[1])
    tension[0, 0], tension[1, 0] = tp_a, tp_b
    # slopes of the proximal tensions in (theta_i, slip a and b of the last guide, slip a and b of this guide)
    pa = (0.0, 0.0, 0.0, -k_a, 0.0)
    pb = (0.0, 0.0, 0.0, 0.0, -k_b)
    worst = 0.0
    for i in range(n):  # guide i, and the segment and joint i + 1 beyond it
        u = 3 * i + 1
        v = u + 3
        theta = x[u + 2]
        sn, cs = math.sin(0.5 * theta), math.cos(0.5 * theta)
        ra, rb, gap = c[_ARM_A], c[_ARM_B], c[_HALF_GAP]  # path of either rope over the notch, its slope and curvature
        path_a, arm_a, bow_a = 2.0 * (gap * (1.0 - cs) + ra * sn), gap * sn + ra * cs, 0.5 * (gap * cs - ra * sn)
        path_b, arm_b, bow_b = 2.0 * (gap * (1.0 - cs) - rb * sn), gap * sn - rb * cs, 0.5 * (gap * cs + rb * sn)
        ta, tb, aa, ab, ba, bb = _segment(
            x[u] - x[v] - path_a, x[u + 1] - x[v + 1] - path_b, c[_ROPE_A], c[_ROPE_B], c[_AXIAL], preload
        )
        tension[0, i + 1], tension[1, i + 1] = ta, tb
        a_theta, b_theta = -(aa * arm_a + ab * arm_b), -(ba * arm_a + bb * arm_b)
        # the joint beyond the guide
        moment, slope = c[_ELASTIC] * theta, c[_ELASTIC]
        for j in range(slip_moment.size):
            part = jenkins_stiffness[j] * (theta - jenkins_rest[j, i])
            if abs(part) <= slip_moment[j]:
                moment += part
                slope += jenkins_stiffness[j]
            else:
                moment += math.copysign(slip_moment[j], part)
        row = u + 2
        b[row] = moment - ta * arm_a - tb * arm_b
        worst = max(worst, abs(b[row]) / c[_ARM_A])
        a[row, _BAND] = slope - ta * bow_a - tb * bow_b - arm_a * a_theta - arm_b * b_theta
        by_a, by_b = arm_a * aa + arm_b * ba, arm_a * ab + arm_b * bb
        a[row, u - row + _BAND] = -by_a
        a[row, u + 1 - row + _BAND] = -by_b
        a[row, v - row + _BAND] = by_a
        a[row, v + 1 - row + _BAND] = by_b
        # the guide
        before = x[u - 1]
        wrap = 0.5 * (abs(theta) + abs(before))
        constant = c[_GUIDE]
        if i == 0:
            wrap += c[_REST_WRAP]
            constant += c[_SHEATH]
        ratio = math.tanh(0.5 * mu * wrap)
        half_before = 0.5 if before > 0.0 else (-0.5 if before < 0.0 else 0.0)
        half_theta = 0.5 if theta > 0.0 else (-0.5 if theta < 0.0 else 0.0)
        for side in range(2):
            row = u + side
            if side == 0:
                proximal, distal, slopes = tp_a, ta, pa
                d_here, d_other, d_theta, stiffness = aa, ab, a_theta, c[_BRISTLE_A]
            else:
                proximal, distal, slopes = tp_b, tb, pb
                d_here, d_other, d_theta, stiffness = bb, ba, b_theta, c[_BRISTLE_B]
            force, by_slip, by_tension, by_wrap, top = _friction(
                x[row], rest[side, i], stiffness, constant, ratio, wrap, mu, proximal, distal
            )
            limit[side, i] = top
            b[row] = proximal - distal - force
            worst = max(worst, abs(b[row]))
            into, out = 1.0 - by_tension, 1.0 + by_tension
            other = u + 1 - side
            # segment before the guide
            if i > 0:
                a[row, u - 1 - row + _BAND] += into * slopes[0]
                a[row, u - 3 - row + _BAND] += into * slopes[1]
                a[row, u - 2 - row + _BAND] += into * slopes[2]
            a[row, u - row + _BAND] += into * slopes[3]
            a[row, u + 1 - row + _BAND] += into * slopes[4]
            # segment beyond it
            a[row, row - row + _BAND] -= out * d_here
            a[row, other - row + _BAND] -= out * d_other
            a[row, row + 3 - row + _BAND] += out * d_here
            a[row, other + 3 - row + _BAND] += out * d_other
            a[row, u + 2 - row + _BAND] -= out * d_theta
            # the guide's friction itself
            a[row, _BAND] -= by_slip
            a[row, u - 1 - row + _BAND] -= by_wrap * half_before
            a[row, u + 2 - row + _BAND] -= by_wrap * half_theta
        pa = (a_theta, aa, ab, -aa, -ab)
        pb = (b_theta, ba, bb, -ba, -bb)
        tp_a, tp_b = ta, tb
    return worst


@njit(cache=True)
def _newton(
    drive: float, x: Floats, c: Floats, history: tuple[Floats, Floats, Floats, Floats, Floats], guess: Floats,
    a: Floats, b: Floats, tension: Floats, limit: Floats, iterations: int,
) -> bool:  # fmt: skip
    """Solve for the equilibrium at a drive, from x; x is changed whether it converges or not."""
    for _ in range(iterations):
        worst = _assemble(drive, x, c, history, guess, a, b, tension, limit)
        if worst <= c[_TOLERANCE] * c[_PRELOAD]:
            return True
        if not worst < 1e9 * c[_PRELOAD]:
            return False
        _solve_band(a, b)
        for i in range(x.size):
            x[i] -= b[i]
    return False


@njit(cache=True)
def _accept(
    x: Floats, c: Floats, history: tuple[Floats, Floats, Floats, Floats, Floats], limit: Floats, before: Floats
) -> tuple[float, float]:
    """Move the rest points of what has slipped; return the losses in guides and material, mJ.

    A sliding guide's force changes from the limit ``before`` to the present one: their mean is booked.
    """
    rest, jenkins_rest, jenkins_stiffness, slip_moment, _ = history
    friction = material = 0.0
    n = rest.shape[1]
    for side in range(2):
        stiffness = c[_BRISTLE_A] if side == 0 else c[_BRISTLE_B]
        for i in range(n):
            force = stiffness * (x[3 * i + 1 + side] - rest[side, i])
            if abs(force) > limit[side, i]:
                slid = math.copysign((abs(force) - limit[side, i]) / stiffness, force)
                rest[side, i] += slid
                friction += 0.5 * (limit[side, i] + before[side, i]) * abs(slid)
            before[side, i] = limit[side, i]
    for j in range(slip_moment.size):
        for i in range(n):
            moment = jenkins_stiffness[j] * (x[3 * i + 3] - jenkins_rest[j, i])
            if abs(moment) > slip_moment[j]:
                slid = math.copysign((abs(moment) - slip_moment[j]) / jenkins_stiffness[j], moment)
                jenkins_rest[j, i] += slid
                material += slip_moment[j] * abs(slid)
    return friction, material


@njit(cache=True)
def _run(
    drives: Floats, c: Floats, history: tuple[Floats, Floats, Floats, Floats, Floats], max_step: float,
    max_halvings: int, iterations: int, angles: Floats, tensions: Floats, energies: Floats,
) -> tuple[int, float, float]:  # fmt: skip
    """Visit the drives from rest; fill angles (m, N), tensions (m, 2, N+1), energies (m, 3: work, friction, material).

    Returns (-1, 0, 0), or the sample that did not converge and the drives between which it did not.
    """
    n = angles.shape[1]
    size = 3 * (n + 1)
    x, trial = np.zeros(size), np.zeros(size)
    a, b = np.zeros((size, 2 * _BAND + 1)), np.zeros(size)
    tension, limit, before = np.zeros((2, n + 1)), np.zeros((2, n)), np.zeros((2, n))
    guess = np.full(2, c[_PRELOAD])
    at = work = friction = material = 0.0
    if not _newton(0.0, x, c, history, guess, a, b, tension, limit, 10 * iterations):
        return 0, 0.0, 0.0
    before[:] = limit
    pull = tension[0, 0] - tension[1, 0]
    for k in range(drives.size):
        target = drives[k]
        least = max_step / 2.0**max_halvings
        step = max_step
        while at != target:
            gap = target - at
            pieces = math.ceil(abs(gap) / step - 1e-9)
            goal = target if pieces <= 1 else at + gap / pieces
            trial[:] = x
            if not _newton(goal, trial, c, history, guess, a, b, tension, limit, iterations):
                step = 0.5 * min(step, abs(goal - at))
                if step < least:
                    return k, at, goal
                continue
            x[:] = trial
            lost = _accept(x, c, history, limit, before)
            friction += lost[0]
            material += lost[1]
            guess[0], guess[1] = tension[0, 0], tension[1, 0]
            now = tension[0, 0] - tension[1, 0]
            work += 0.5 * (pull + now) * (goal - at)
            pull, at = now, goal
            step = min(max_step, 2.0 * step)
        for i in range(n):
            angles[k, i] = x[3 * i + 3]
        tensions[k] = tension
        energies[k, 0], energies[k, 1], energies[k, 2] = work, friction, material
    return -1, 0.0, 0.0


def _constants(rig: Rig, settings: ChainSettings) -> tuple[Floats, Floats, Floats]:
    """Constants of the kernels, and stiffness and slip moment of the Jenkins elements of a joint."""
    joint, arms = flexure(rig), moment_arms_mm(rig)
    elastic, stiffness, slip_moment = jenkins_elements(rig.material, joint.bending_Nmm_per_rad)
    bend = bending_length_mm(rig)
    gap = rig.notch.width_mm if rig.notch else BENCH_GAP * rig.pitch_mm
    dry = rig.friction
    holds = dry.guide_N or dry.sheath_N or dry.capstan_coefficient
    ropes = (rig.tendon_a, rig.tendon_b)
    bristles = [(settings.bristle_ratio if holds else 1e-8) * rope.EA_N / rig.pitch_mm for rope in ropes]
    c = np.array(
        [
            rig.preload_N,
            elastic,
            *arms,
            0.5 * (gap - bend),
            *(rope.EA_N / rig.pitch_mm for rope in ropes),
            *(rope.EA_N / rope.free_length_mm for rope in ropes),
            *(rope.toe_N for rope in ropes),
            1 / joint.axial_N_per_mm if joint.axial_N_per_mm else 0.0,
            dry.capstan_coefficient,
            dry.guide_N,
            dry.sheath_N,
            np.radians(dry.rest_wrap_deg),
            *bristles,
            settings.tolerance,
        ],
        dtype=float,
    )
    return c, stiffness, slip_moment


def solve_chain(rig: Rig, program: LoadProgram, settings: ChainSettings | None = None) -> ChainSolution:
    """Run a load program quasi-statically; time, if the program has any, is only passed on.

    Raises
    ------
    SolverError
        When a step does not converge even after ``max_halvings`` halvings.
    """
    settings = settings or ChainSettings()
    c, stiffness, slip_moment = _constants(rig, settings)
    n, m = rig.joints, program.drive_mm.size
    history = (np.zeros((2, n)), np.zeros((stiffness.size, n)), stiffness, slip_moment, np.zeros(0))
    angles, tensions, energies = np.empty((m, n)), np.empty((m, 2, n + 1)), np.empty((m, 3))
    failed, start, end = _run(
        program.drive_mm, c, history, settings.max_step_mm, settings.max_halvings, settings.newton_iterations,
        angles, tensions, energies,
    )  # fmt: skip
    if failed >= 0:
        raise SolverError(
            f"rig {rig.name}, sample {failed} of {m}: no equilibrium between drives {start:.6g} and {end:.6g} mm"
        )
    shortening = np.cumsum(tensions[:, 0, 1:] + tensions[:, 1, 1:] - 2 * rig.preload_N, axis=1)[:, -1] * c[_AXIAL]
    heading = np.cumsum(angles, axis=1)
    along = rig.pitch_mm * (0.5 + np.cos(heading[:, :-1]).sum(axis=1) + 0.5 * np.cos(heading[:, -1])) - shortening
    across = rig.pitch_mm * (np.sin(heading[:, :-1]).sum(axis=1) + 0.5 * np.sin(heading[:, -1]))
    record = Record(
        drive=program.drive_mm,
        angle_deg=np.degrees(heading[:, -1]),
        title=f"{rig.name}, preload {rig.preload_N:g} N, chain",
        kind="simulated",
        time_s=program.time_s,
        cycle=program.cycle,
        tension_a_N=tensions[:, 0, 0],
        tension_b_N=tensions[:, 1, 0],
        notches_deg=np.degrees(angles),
        tip_mm=np.column_stack([along, across]),
        rig=sidecar_table(rig),
    )
    return ChainSolution(record, tensions, energies[:, 0], energies[:, 1], energies[:, 2])


def simulate_chain(rig: Rig, program: LoadProgram) -> Record:
    """Engine ``chain``: the record alone. See :func:`solve_chain`."""
    return solve_chain(rig, program).record
