"""A lumped rig, written apart from ``fem_models``: another generator of practice records.

The tracer fits rigs of :mod:`fem_models`. Records of the same engine prove little of it, so this rig shares no code, no
law and no integrator with that package: one angle, two tendons, one equation of moments, integrated in time by implicit
Euler steps.

- Tendons: exponential toe region, T = k [e - e_t (1 - exp(-e / e_t))] for e > 0, slack below.
- Guides: LuGre bristles with the Stribeck curve (Canudas de Wit et al. 1995, doi 10.1109/9.376053), whose Coulomb level
  is a constant and a part of the tension that grows with the bend.
- Flexures: a monotone curve through drawn points (PCHIP); material loop: the Dahl model (1968).
- Stops: softplus springs. Creep: four Kelvin-Voigt elements over three decades, which make a logarithmic law.

Units are mm, N, rad, s inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.interpolate import PchipInterpolator

from hysteresis.arrays import Floats, Ints

DECADES = np.array([0.3, 3.0, 30.0, 300.0])
"""Times of the creep elements, s."""
GRID = 400
"""Points of the table that the flexures' curve is read from."""


@dataclass(frozen=True)
class LumpedRig:
    """Parameters of the rig; effects are off where their parameter is 0 or infinite.

    ``curve`` is the moment of the flexures over the one at ``reach_rad``, at even angles from 0 to there.
    ``cycles`` is the number after which ``preload_loss``, ``loop_loss`` and ``residual_rad`` have reached half of their
    final value.
    """

    arm_mm: tuple[float, float] = (2.6, 2.6)
    tendon_N_per_mm: tuple[float, float] = (60.0, 60.0)
    toe_mm: float = 0.02
    preload_N: float = 20.0
    slack_mm: float = 0.0  # tendon longer than the preload wants, both
    bending_Nmm_per_rad: float = 60.0
    curve: tuple[float, ...] = (0.0, 1 / 3, 2 / 3, 1.0)  # moment over the linear one's end, at even angles up to reach
    reach_rad: float = 1.0
    loop_Nmm: float = 4.0  # of the material, saturated
    loop_rad: float = 0.05  # angle over which it saturates
    coulomb_N: float = 1.0
    capstan: float = 0.03
    wrap_rad: float = 0.3
    stiction: float = 1.0  # static over Coulomb friction
    stribeck_mm_per_s: float = 0.5
    bristle_N_per_mm: float = 80.0
    viscous_N_s_per_mm: float = 0.0
    joint_drag_Nmm_s_per_rad: float = 0.0
    play_mm: float = 0.0
    wheel_radius_mm: float = 10.0
    run_out_mm: float = 0.0
    run_out_rad: float = 0.0
    weight_Nmm: float = 0.0
    weight_rad: float = 0.0
    closure_rad: float = np.inf
    contact_rad: float = np.inf
    stop_Nmm_per_rad: float = 3_000.0
    creep_mm_per_N: float = 0.0  # per decade of time
    preload_loss: float = 0.0
    loop_loss: float = 0.0
    residual_rad: float = 0.0
    cycles: float = 3.0  # over which the two above settle
    delay_s: float = 0.0
    drift_rad: float = 0.0
    drift_s: float = 60.0
    camera: tuple[float, float] = (0.0, 0.0)  # gain - 1, perspective
    substeps: int = 4


class _Laws(NamedTuple):
    """What the compiled integrator needs, in one place."""

    arm: Floats
    stiffness: Floats
    toe: float
    moment_angles: Floats
    moments: Floats
    loop: float
    loop_angle: float
    coulomb: float
    capstan: float
    wrap: float
    stiction: float
    stribeck: float
    bristle: float
    viscous: float
    drag: float
    weight: float
    weight_angle: float
    closure: float
    contact: float
    stop: float
    creep: float


class _State(NamedTuple):
    """History, updated in place: bristles (2,), material loop (1,), creep of either tendon (2, 4)."""

    bristle: Floats
    loop: Floats
    creep: Floats


@njit(cache=True)
def _tension(stretch: float, stiffness: float, toe: float) -> float:
    if stretch <= 0.0:
        return 0.0
    return stiffness * (stretch - toe * (1.0 - np.exp(-stretch / toe)))


@njit(cache=True)
def _softplus(x: float, width: float) -> float:
    return x if x > 30.0 * width else width * np.log1p(np.exp(x / width))


@njit(cache=True)
def _dahl(force: float, moved: float, stiffness: float, top: float) -> float:
    """Force of a Dahl bristle after it moved, exactly for a constant top."""
    if moved == 0.0 or top <= 0.0:
        return force if top > 0.0 else 0.0
    end = top if moved > 0.0 else -top
    return end + (force - end) * np.exp(-abs(moved) * stiffness / top)


@njit(cache=True)
def _friction(side: int, tension: float, angle: float, moved: float, dt: float, s: _State, c: _Laws) -> float:
    """Friction force of the guides of one tendon after it moved, N."""
    speed = moved / dt
    top = c.coulomb + c.capstan * (c.wrap + abs(angle)) * tension
    top *= 1.0 + (c.stiction - 1.0) * np.exp(-((speed / c.stribeck) ** 2))
    return _dahl(s.bristle[side], moved, c.bristle, top) + c.viscous * speed


@njit(cache=True)
def _flexure(angle: float, c: _Laws) -> float:
    """Moment of the flexures: the curve, and stops."""
    moment = np.interp(abs(angle), c.moment_angles, c.moments)
    moment = moment if angle >= 0.0 else -moment
    if c.closure < 1e9:
        moment += c.stop * (_softplus(angle - c.closure, 0.004) - _softplus(-angle - c.closure, 0.004))
    if c.contact < 1e9:
        moment += c.stop * _softplus(angle - c.contact, 0.004)
    return moment


@njit(cache=True)
def _balance(angle: float, last: float, stretch: Floats, dt: float, loop: float, s: _State, c: _Laws) -> float:
    """Moment out of balance, Nmm: negative where the angle is too large. ``stretch`` is that at the angle zero."""
    turn = angle - last
    out = c.weight * np.sin(angle + c.weight_angle) - c.drag * turn / dt
    out -= _flexure(angle, c) + _dahl(s.loop[0], turn, loop / c.loop_angle, loop)
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        tension = _tension(stretch[side] - sign * c.arm[side] * angle, c.stiffness[side], c.toe)
        moved = c.arm[side] * turn
        out += c.arm[side] * (sign * tension - _friction(side, tension, angle, moved, dt, s, c))
    return out


@njit(cache=True)
def _solve(last: float, stretch: Floats, dt: float, loop: float, s: _State, c: _Laws) -> float:
    """Angle in balance: bracketed from the last one, then by false position (Illinois; Dowell, Jarratt 1971)."""
    low = high = last
    at_low = at_high = _balance(last, last, stretch, dt, loop, s, c)
    step = 1e-4
    if at_low == 0.0:
        return last
    for _ in range(60):
        if at_low > 0.0 > at_high or at_high == 0.0:
            break
        if at_low > 0.0:  # the angle in balance is larger
            low, at_low = high, at_high
            high += step
            at_high = _balance(high, last, stretch, dt, loop, s, c)
        else:
            high, at_high = low, at_low
            low -= step
            at_low = _balance(low, last, stretch, dt, loop, s, c)
            if at_low >= 0.0:
                break
        step *= 2.0
    side = 0
    for turn in range(200):
        if high - low < 1e-11:
            break
        middle = low + (high - low) * at_low / (at_low - at_high) if turn % 8 < 7 else 0.5 * (low + high)
        middle = min(max(middle, low + 1e-12), high - 1e-12)
        at = _balance(middle, last, stretch, dt, loop, s, c)
        if abs(at) < 1e-12:
            return middle
        if at > 0.0:
            low, at_low = middle, at
            at_high *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            high, at_high = middle, at
            at_low *= 0.5 if side == -1 else 1.0
            side = -1
    return 0.5 * (low + high)


@njit(cache=True)
def _integrate(
    drive: Floats, time: Floats, preload: Floats, loops: Floats, residual: Floats, substeps: int, c: _Laws
) -> Floats:
    """Angles and tensions at the wheel, shape (m, 3). ``preload`` is the stretch of either tendon at rest, (m, 2)."""
    m = drive.size
    out = np.empty((m, 3))
    s = _State(np.zeros(2), np.zeros(1), np.zeros((2, DECADES.size)))
    angle, x, t = 0.0, 0.0, time[0] - 1.0
    stretch = np.zeros(2)
    for k in range(m):
        for part in range(1, substeps + 1):
            share = part / substeps
            here = x + share * (drive[k] - x)
            dt = max((time[k] - t) / substeps, 1e-6)
            for side in range(2):
                sign = 1.0 if side == 0 else -1.0
                stretch[side] = preload[k, side] + sign * here - s.creep[side].sum()
            shift = residual[k]
            now = _solve(angle - shift, stretch - np.array([1.0, -1.0]) * c.arm * shift, dt, loops[k], s, c) + shift
            turn = now - angle
            for side in range(2):
                sign = 1.0 if side == 0 else -1.0
                tension = _tension(stretch[side] - sign * c.arm[side] * now, c.stiffness[side], c.toe)
                moved = c.arm[side] * turn
                whole = _friction(side, tension, now, moved, dt, s, c)
                s.bristle[side] = whole - c.viscous * moved / dt
                for j in range(DECADES.size):
                    goal = c.creep * tension
                    s.creep[side, j] += (goal - s.creep[side, j]) * (1.0 - np.exp(-dt / DECADES[j]))
                out[k, 1 + side] = tension
            s.loop[0] = _dahl(s.loop[0], turn, loops[k] / c.loop_angle, loops[k])
            angle = now
        x, t = drive[k], time[k]
        out[k, 0] = angle
    return out


def simulate_lumped(rig: LumpedRig, drive_mm: Floats, time_s: Floats, cycle: Ints) -> tuple[Floats, Floats]:
    """Run the rig through a drive.

    Parameters
    ----------
    rig
        Parameters, effects among them.
    drive_mm, time_s, cycle
        What was logged, shapes (m,); the rig is at rest one second before.

    Returns
    -------
    tuple
        The angle that a sensor reads, deg, shape (m,), and the tensions at the wheel, N, shape (m, 2).
    """
    moved = _played(drive_mm, rig.play_mm)
    turn = moved / rig.wheel_radius_mm
    moved = moved + rig.run_out_mm * (np.sin(turn + rig.run_out_rad) - np.sin(rig.run_out_rad))
    settled = 1.0 - 1.0 / (1.0 + np.maximum(cycle, 0) / rig.cycles)  # a law of its own: hyperbolic
    rest = np.array([_stretch_mm(rig.preload_N, k, rig.toe_mm) for k in rig.tendon_N_per_mm])
    preload = rest * (1.0 - rig.preload_loss * settled[:, None]) - rig.slack_mm
    loops = np.maximum(rig.loop_Nmm * (1.0 - rig.loop_loss * settled), 1e-9)
    out = _integrate(moved, time_s, preload, loops, rig.residual_rad * settled, rig.substeps, _laws(rig))
    angle, tensions = out[:, 0], out[:, 1:]
    if rig.delay_s:
        angle = np.interp(time_s - rig.delay_s, time_s, angle)
    angle = angle + rig.drift_rad * (1.0 - np.exp(-(time_s - time_s[0]) / rig.drift_s))
    gain, perspective = rig.camera
    return np.degrees(angle * (1.0 + gain + perspective * angle)), tensions


def _laws(rig: LumpedRig) -> _Laws:
    grid = np.linspace(0.0, 2.5 * rig.reach_rad, GRID)
    points = np.linspace(0.0, rig.reach_rad, len(rig.curve))
    curve = PchipInterpolator(points, np.array(rig.curve) * rig.bending_Nmm_per_rad * rig.reach_rad)
    end, slope = float(curve(rig.reach_rad)), float(curve.derivative()(rig.reach_rad))
    moments = np.where(
        grid <= rig.reach_rad, curve(np.minimum(grid, rig.reach_rad)), end + slope * (grid - rig.reach_rad)
    )
    return _Laws(
        arm=np.array(rig.arm_mm),
        stiffness=np.array(rig.tendon_N_per_mm),
        toe=rig.toe_mm,
        moment_angles=grid,
        moments=moments,
        loop=rig.loop_Nmm,
        loop_angle=rig.loop_rad,
        coulomb=rig.coulomb_N,
        capstan=rig.capstan,
        wrap=rig.wrap_rad,
        stiction=rig.stiction,
        stribeck=rig.stribeck_mm_per_s,
        bristle=rig.bristle_N_per_mm,
        viscous=rig.viscous_N_s_per_mm,
        drag=rig.joint_drag_Nmm_s_per_rad,
        weight=rig.weight_Nmm,
        weight_angle=rig.weight_rad,
        closure=rig.closure_rad,
        contact=rig.contact_rad,
        stop=rig.stop_Nmm_per_rad,
        creep=rig.creep_mm_per_N,
    )


def _stretch_mm(tension_N: float, stiffness: float, toe: float) -> float:
    """Stretch at a tension: Newton's method on the toe law."""
    stretch = tension_N / stiffness + toe
    for _ in range(50):
        error = _tension(stretch, stiffness, toe) - tension_N
        stretch -= error / (stiffness * (1.0 - np.exp(-stretch / toe)))
    return stretch


@njit(cache=True)
def _played(drive: Floats, width: float) -> Floats:
    """Output of a play of a width, from its middle."""
    out = np.empty(drive.size)
    at = 0.0
    for k in range(drive.size):
        at = min(max(at, drive[k] - 0.5 * width), drive[k] + 0.5 * width)
        out[k] = at
    return out
