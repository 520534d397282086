"""A rig of parts in series, written apart from ``fem_models`` and from the lumped rig, for scores alone.

It shares no code, no law and no integrator with either, and nothing is learnt from or tuned on its records.

- **Chain**: n joints in series. The flexure of a joint is a series of units, each a spring beside a Jenkins element,
  which is a spring in series with a slider (Jenkins 1962, doi 10.1115/1.3640535; Iwan 1966, doi 10.1115/1.3625199).
  Under a moment M a unit turns by q, where M = K q + k (q - s) and the slider s moves as soon as k |q - s| reaches its
  yield. So the turn of a joint is an explicit function of its moment, and the model is solved by compliances.
- **Tendon**: a stiff segment from the wheel to the base and a soft one from there to the tip, both unilateral. Between
  them the tendon rubs on a bush, which presses with the mean of the two tensions: it slips if
  |T1 - T2| > mu (T1 + T2) / 2. No sidecar can declare that friction. There is none along the chain.
- **Balance**: one moment r_a T2_a - r_b T2_b for all joints, plus what forces at the tip add to each of them. Each
  sample is an equilibrium of its own, found by brackets; rate enters by drag at the bush, time by creep.

Where an effect of the catalogue has more than one law in use, the rig has another than the other two generators: exact
tangents to an eccentric wheel, a power law of drag, Andrade creep, a preload that is lost with the logarithm of the
travel, a Hertz contact, an exact oblique view, a rational toe region, a logger that averages, a hyperbolic drift.

Units are mm, N, rad, s inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.interpolate import PchipInterpolator

from hysteresis.arrays import Floats

CREEP_POWER = 3.0
"""Andrade's law: the strain grows with the cube root of time (Proc. R. Soc. A 84, 1910, doi 10.1098/rspa.1910.0050)."""
DRAG_POWER = 0.7
"""Exponent of the speed in the drag of a grease (power-law fluid)."""
CONTACT_POWER = 1.5
"""Exponent of the depth in a Hertz contact."""
LONGEST_CYCLES = 5.0
"""Cycles after which the lost part of the preload is :attr:`SeriesRig.preload_loss`."""
GUIDE_MM = 60.0
"""From the axle of the wheel to the guides on either side of it, mm."""


@dataclass(frozen=True)
class Flexures:
    """Units of all joints, arrays of shape (joints, units): one joint a row, its units in series.

    Parameters
    ----------
    spring_Nmm_per_rad
        Spring of a unit, which stays when the slider moves.
    jenkins_Nmm_per_rad
        Spring of the Jenkins element beside it.
    yield_Nmm
        Moment at which its slider moves.
    """

    spring_Nmm_per_rad: Floats
    jenkins_Nmm_per_rad: Floats
    yield_Nmm: Floats

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.spring_Nmm_per_rad.shape[0])

    @property
    def slid_Nmm_per_rad(self) -> Floats:
        """Stiffness of each joint while all its sliders move, shape (joints,)."""
        return np.asarray(1.0 / np.sum(1.0 / self.spring_Nmm_per_rad, axis=1))


@dataclass(frozen=True)
class SeriesRig:
    """Parameters of the rig; effects are off where their parameter is 0 or infinite.

    Pairs are of tendon a, which bends to positive angles, and of tendon b. A single tendon has ``pair`` false.
    """

    flexures: Flexures
    pitch_mm: float = 2.5
    arm_mm: tuple[float, float] = (2.6, 2.6)
    stiff_N_per_mm: tuple[float, float] = (200.0, 200.0)  # wheel to base
    soft_N_per_mm: tuple[float, float] = (90.0, 90.0)  # base to tip
    base_friction: float = 0.08
    preload_N: float = 20.0
    pair: bool = True
    toe_mm: float = 0.0  # of the soft segments
    play_mm: float = 0.0
    drive_gain: float = 0.0
    wheel_radius_mm: float = 10.0
    run_out_mm: float = 0.0
    run_out_rad: float = 0.0
    slack_mm: tuple[float, float] = (0.0, 0.0)
    preload_loss: float = 0.0  # after LONGEST_CYCLES
    preload_cycles: float = 1.0  # the logarithm's scale
    creep_mm_per_N: float = 0.0  # after one second
    drag_N: float = 0.0  # at 1 mm/s
    tip_force_N: tuple[float, float] = (0.0, 0.0)  # along the straight rig, and to the side of tendon a
    contact_mm: float = np.inf  # deflection of the tip at which it meets an obstacle
    contact_N_per_mm15: float = 1.0
    delay_s: float = 0.0
    drift_rad: float = 0.0  # that it tends to
    drift_s: float = 60.0  # after which half of it is there
    view_rad: float = 0.0  # tilt of the camera's axis
    view_axis_rad: float = 0.0  # direction in the plane of bending about which it tilts
    substeps: int = 2


@dataclass(frozen=True)
class SeriesRun:
    """What the rig does, one row a sample.

    Parameters
    ----------
    angle_deg
        As a sensor reads it, shape (m,).
    turn_rad
        Sum of the turns of all joints, shape (m,).
    wheel_N, bending_N
        Tensions on the wheel's and on the tip's side of the bush, tendons a and b, shape (m, 2).
    pulled_mm, slipped_mm
        What the wheel has wound in, and what has slid through the bush towards it, shape (m, 2).
    lost_mJ
        Work that the sliders of the flexures have taken since the start, shape (m,).
    tip_mm
        Deflection of the tip to the side of tendon a, shape (m,).
    """

    angle_deg: Floats
    turn_rad: Floats
    wheel_N: Floats
    bending_N: Floats
    pulled_mm: Floats
    slipped_mm: Floats
    lost_mJ: Floats
    tip_mm: Floats


class _Laws(NamedTuple):
    spring: Floats
    jenkins: Floats
    yields: Floats
    pitch: float
    arm: Floats
    stiff: Floats
    soft: Floats
    toe: float
    rest: Floats  # stretch of stiff and soft segments at the preload, (2, 2): tendon, segment
    friction: float
    drag: float
    creep: float
    tip_x: float
    tip_y: float
    contact: float
    contact_stiffness: float


class _State(NamedTuple):
    """History, updated in place: sliders (joints, units), slip at the base (2,), creep (2,), turns (joints,)."""

    slider: Floats
    slip: Floats
    creep: Floats
    turn: Floats
    force: Floats  # of the contact and the bending moment, last sample: where the next search starts


@njit(cache=True)
def _pull(stretch: float, stiffness: float, toe: float) -> float:
    """Tension of a segment: k e, or with a toe region k e^2 / (e + toe)."""
    if stretch <= 0.0:
        return 0.0
    return stiffness * stretch * stretch / (stretch + toe)


@njit(cache=True)
def _joint(moment: float, j: int, s: _State, c: _Laws) -> float:
    """Turn of joint j under a moment: its units in series, each with its slider where it was or at its yield."""
    turn = 0.0
    for i in range(c.spring.shape[1]):
        q = (moment + c.jenkins[j, i] * s.slider[j, i]) / (c.spring[j, i] + c.jenkins[j, i])
        held = c.jenkins[j, i] * (q - s.slider[j, i])
        if held > c.yields[j, i]:
            q = (moment - c.yields[j, i]) / c.spring[j, i]
        elif held < -c.yields[j, i]:
            q = (moment + c.yields[j, i]) / c.spring[j, i]
        turn += q
    return turn


@njit(cache=True)
def _drag(moved: float, dt: float, c: _Laws) -> float:
    return 0.0 if c.drag == 0.0 else c.drag * (abs(moved) / dt) ** DRAG_POWER


@njit(cache=True)
def _slip(side: int, wound: float, path: float, dt: float, s: _State, c: _Laws) -> float:
    """Where the tendon is in the bush: as before if it sticks, else where friction and drag are met.

    ``wound`` is what the wheel has wound in, ``path`` what bending has shortened between base and tip, both mm.
    """
    first, second = c.rest[side, 0] + wound, path - c.rest[side, 1] + s.creep[side]
    at = s.slip[side]
    one = _pull(first - at, c.stiff[side], 0.0)
    two = _pull(at - second, c.soft[side], c.toe)
    if abs(one - two) <= 0.5 * c.friction * (one + two):
        return at
    sign = 1.0 if one > two else -1.0
    less, more = 1.0 - sign * 0.5 * c.friction, 1.0 + sign * 0.5 * c.friction
    if first <= second:  # slack in all: it moves until nothing pulls it
        end = first if sign > 0.0 else second
        if c.drag == 0.0:
            return end
    elif c.toe == 0.0 and c.drag == 0.0:
        stiff, soft = less * c.stiff[side], more * c.soft[side]
        return (stiff * first + soft * second) / (stiff + soft)
    else:
        end = first if sign > 0.0 else second
    low, high = at, end  # where it would move on, and where it would not
    for _ in range(100):
        middle = 0.5 * (low + high)
        one = _pull(first - middle, c.stiff[side], 0.0)
        two = _pull(middle - second, c.soft[side], c.toe)
        if sign * (less * one - more * two) > _drag(middle - at, dt, c):
            low = middle
        else:
            high = middle
        if abs(high - low) < 1e-13:
            break
    return 0.5 * (low + high)


@njit(cache=True)
def _tendons(turn: float, wound: Floats, dt: float, s: _State, c: _Laws) -> float:
    """Moment of the tendons on every joint at a bend of the whole chain."""
    moment = 0.0
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        path = sign * c.arm[side] * turn
        at = _slip(side, wound[side], path, dt, s, c)
        moment += sign * c.arm[side] * _pull(at - path + c.rest[side, 1] - s.creep[side], c.soft[side], c.toe)
    return moment


@njit(cache=True)
def _excess(moment: float, loads: Floats, wound: Floats, dt: float, s: _State, c: _Laws) -> float:
    """Moment of the tendons beyond an assumed one: falls as that rises."""
    turn = 0.0
    for j in range(loads.size):
        turn += _joint(moment + loads[j], j, s, c)
    return _tendons(turn, wound, dt, s, c) - moment


@njit(cache=True)
def _moment(start: float, loads: Floats, wound: Floats, dt: float, s: _State, c: _Laws) -> float:
    """Moment in balance: a bracket from the last one, then false position with every fourth step a bisection."""
    low = high = start
    at_low = at_high = _excess(start, loads, wound, dt, s, c)
    step = 0.01 if at_low > 0.0 else -0.01
    for _ in range(60):
        if at_low >= 0.0 >= at_high:
            break
        if step > 0.0:
            low, at_low = high, at_high
            high += step
            at_high = _excess(high, loads, wound, dt, s, c)
        else:
            high, at_high = low, at_low
            low += step
            at_low = _excess(low, loads, wound, dt, s, c)
        step *= 2.0
    for trial in range(200):
        if at_low == 0.0 or high - low < 1e-11 * (1.0 + abs(low)):
            break
        part = at_low / (at_low - at_high) if trial % 4 < 3 else 0.5
        middle = low + min(max(part, 1e-3), 1.0 - 1e-3) * (high - low)
        at = _excess(middle, loads, wound, dt, s, c)
        if at > 0.0:
            low, at_low = middle, at
        else:
            high, at_high = middle, at
    return low if at_low == 0.0 else 0.5 * (low + high)


@njit(cache=True)
def _tip_height(turns: Floats, pitch: float) -> float:
    heading = height = 0.0
    for j in range(turns.size):
        heading += turns[j]
        height += pitch * np.sin(heading)
    return height


@njit(cache=True)
def _levers(turns: Floats, pitch: float, force_x: float, force_y: float, loads: Floats) -> float:
    """Put the moments of a force at the tip about all joints into ``loads``; return their largest change."""
    n, change = turns.size, 0.0
    heading = turns.sum()
    x = y = 0.0  # from a joint to the tip
    for j in range(n - 1, -1, -1):
        x += pitch * np.cos(heading)
        y += pitch * np.sin(heading)
        new = x * force_y - y * force_x
        change = max(change, abs(new - loads[j]))
        loads[j] = new
        heading -= turns[j]
    return change


@njit(cache=True)
def _settle(contact: float, loads: Floats, turns: Floats, wound: Floats, dt: float, s: _State, c: _Laws) -> float:
    """Moment in balance with a force of the contact, turns of all joints put into ``turns``; nan if none is found."""
    moment = s.force[1]
    force_y = c.tip_y - contact
    for _ in range(300):
        change = _levers(turns, c.pitch, c.tip_x, force_y, loads)
        moment = _moment(moment, loads, wound, dt, s, c)
        for j in range(loads.size):
            turns[j] = _joint(moment + loads[j], j, s, c)
        if change < 1e-10 or (c.tip_x == 0.0 and force_y == 0.0):
            return moment
    return np.nan


@njit(cache=True)
def _beyond_contact(
    force: float, loads: Floats, turns: Floats, wound: Floats, dt: float, s: _State, c: _Laws
) -> tuple[float, float]:
    """Force of the depth that an assumed force leaves, beyond that force: falls as it rises. And the moment."""
    moment = _settle(force, loads, turns, wound, dt, s, c)
    depth = max(_tip_height(turns, c.pitch) - c.contact, 0.0)
    return c.contact_stiffness * depth**CONTACT_POWER - force, moment


@njit(cache=True)
def _balance(loads: Floats, turns: Floats, wound: Floats, dt: float, s: _State, c: _Laws) -> float:
    """Moment in balance; beside an obstacle the force is bracketed from the last one, as in :func:`_moment`."""
    at_low, moment = _beyond_contact(0.0, loads, turns, wound, dt, s, c)
    if not at_low > 0.0:
        s.force[0] = 0.0
        return moment
    low, high = 0.0, max(1.02 * s.force[0], 1e-3)
    at_high, moment = _beyond_contact(high, loads, turns, wound, dt, s, c)
    while at_high > 0.0:
        low, at_low = high, at_high
        high *= 1.5
        at_high, moment = _beyond_contact(high, loads, turns, wound, dt, s, c)
    for trial in range(200):
        if np.isnan(moment) or high - low < 1e-9 * (1.0 + high):
            break
        part = at_low / (at_low - at_high) if trial % 4 < 3 else 0.5
        middle = low + min(max(part, 1e-3), 1.0 - 1e-3) * (high - low)
        at, moment = _beyond_contact(middle, loads, turns, wound, dt, s, c)
        if at > 0.0:
            low, at_low = middle, at
        else:
            high, at_high = middle, at
    s.force[0] = 0.5 * (low + high)
    return moment


@njit(cache=True)
def _run(wound: Floats, time: Floats, substeps: int, c: _Laws) -> Floats:
    """Rows of a run, shape (m, 9): turn, tensions at wheel and tip of a and b, slips of a and b, lost work, tip."""
    m, joints = time.size, c.spring.shape[0]
    out = np.empty((m, 9))
    s = _State(np.zeros(c.spring.shape), np.zeros(2), np.zeros(2), np.zeros(joints), np.zeros(2))
    loads, turns, here = np.zeros(joints), np.zeros(joints), np.zeros(2)
    last, before, lost = np.zeros(2), time[0] - 1.0, 0.0
    for row in range(m):
        dt = max((time[row] - before) / substeps, 1e-6)
        for part in range(1, substeps + 1):
            for side in range(2):
                here[side] = last[side] + part / substeps * (wound[row, side] - last[side])
            moment = _balance(loads, turns, here, dt, s, c)
            if not np.isfinite(moment):
                out[row:] = np.nan
                return out
            s.force[1] = moment
            for j in range(joints):
                for i in range(c.spring.shape[1]):
                    whole = moment + loads[j]
                    old = s.slider[j, i]
                    q = (whole + c.jenkins[j, i] * old) / (c.spring[j, i] + c.jenkins[j, i])
                    give = c.yields[j, i] / c.jenkins[j, i]
                    if q - old > give:
                        s.slider[j, i] = (whole - c.yields[j, i]) / c.spring[j, i] - give
                    elif q - old < -give:
                        s.slider[j, i] = (whole + c.yields[j, i]) / c.spring[j, i] + give
                    lost += c.yields[j, i] * abs(s.slider[j, i] - old)
            turn = turns.sum()
            for side in range(2):
                path = (1.0 if side == 0 else -1.0) * c.arm[side] * turn
                at = _slip(side, here[side], path, dt, s, c)
                stretch = at - path + c.rest[side, 1] - s.creep[side]
                tension = _pull(stretch, c.soft[side], c.toe)
                s.slip[side] = at
                out[row, 1 + side] = _pull(c.rest[side, 0] + here[side] - at, c.stiff[side], 0.0)
                out[row, 3 + side] = tension
                out[row, 5 + side] = at
                grown = s.creep[side] ** CREEP_POWER + (c.creep * tension) ** CREEP_POWER * dt
                s.creep[side] = grown ** (1.0 / CREEP_POWER)
            out[row, 0] = turn
        last[:] = wound[row]
        before = time[row]
        out[row, 7] = lost
        out[row, 8] = _tip_height(turns, c.pitch)
    return out


def simulate_series(rig: SeriesRig, drive_mm: Floats, time_s: Floats) -> SeriesRun:
    """Run the rig through a drive.

    Parameters
    ----------
    rig
        Parameters, effects among them.
    drive_mm, time_s
        What was logged, shapes (m,); the rig is straight and at rest one second before.

    Raises
    ------
    ValueError
        No equilibrium is found: a force at the tip is too large for the chain.
    """
    wound = pulled(rig, drive_mm)
    out = _run(wound, np.asarray(time_s, dtype=float), rig.substeps, _laws(rig))
    if not np.isfinite(out).all():
        raise ValueError(f"series rig: no equilibrium from sample {int(np.argmax(~np.isfinite(out[:, 0])))} on")
    return SeriesRun(
        angle_deg=np.degrees(_read(rig, out[:, 0], time_s)),
        turn_rad=out[:, 0],
        wheel_N=out[:, 1:3],
        bending_N=out[:, 3:5],
        pulled_mm=wound,
        slipped_mm=out[:, 5:7],
        lost_mJ=out[:, 7],
        tip_mm=out[:, 8],
    )


def pulled(rig: SeriesRig, drive_mm: Floats) -> Floats:
    """Give what the wheel has wound in, mm, shape (m, 2): play, gain, run-out, slack, lost preload."""
    moved = _played(np.asarray(drive_mm, dtype=float), rig.play_mm) * (1.0 + rig.drive_gain)
    wound = _wound(moved, rig)
    travel = np.cumsum(np.abs(np.diff(moved, prepend=0.0)))
    cycles = travel / max(4.0 * float(np.abs(moved).max()), 1e-12)
    settled = np.log1p(cycles / rig.preload_cycles) / np.log1p(LONGEST_CYCLES / rig.preload_cycles)
    lost = rig.preload_loss * settled[:, None] * _rest(rig).sum(axis=1)
    return np.asarray(wound - np.array(rig.slack_mm) - lost)


def _wound(moved: Floats, rig: SeriesRig) -> Floats:
    """Tendon that an eccentric wheel winds in, from exact tangents to two guides on opposite sides, shape (m, 2).

    A tendon lies on the wheel from where it is fixed to where the tangent to its guide begins: its length is R times
    that arc, and the tangent. Both guides are at the height of the top of the wheel, :data:`GUIDE_MM` from its axle.
    """
    radius = rig.wheel_radius_mm
    if rig.run_out_mm == 0.0:
        return np.column_stack([moved, -moved])
    phase = np.concatenate([[0.0], moved / radius]) + rig.run_out_rad
    columns = []
    for sign in (1.0, -1.0):
        x, y = GUIDE_MM - sign * rig.run_out_mm * np.cos(phase), radius - rig.run_out_mm * np.sin(phase)
        free = np.sqrt(x**2 + y**2 - radius**2)
        start = np.arctan2(y, x) + np.arctan2(free, radius)  # of the tangent, as an angle on the wheel
        length = free - radius * start
        columns.append(sign * moved + length[1:] - length[0])
    return np.column_stack(columns)


def _read(rig: SeriesRig, turn: Floats, time_s: Floats) -> Floats:
    """Angle that the sensor reads, rad: view, drift, average of the logger.

    A camera whose axis is tilted shortens what lies across the axis of the tilt. A logger that averages twice the delay
    is late by it.
    """
    angle = turn
    if rig.view_rad:
        angle = _seen(turn, rig) - _seen(np.zeros(1), rig)
    clock = time_s - time_s[0]
    if rig.drift_rad:
        angle = angle + rig.drift_rad * clock / (clock + rig.drift_s)
    if rig.delay_s:
        whole = PchipInterpolator(clock, angle).antiderivative()

        def until(t: Floats) -> Floats:  # the integral of the angle, at rest before the record
            return np.where(t < 0.0, angle[0] * t, whole(np.maximum(t, 0.0)))

        angle = (until(clock) - until(clock - 2.0 * rig.delay_s)) / (2.0 * rig.delay_s)
    return np.asarray(angle)


def _seen(turn: Floats, rig: SeriesRig) -> Floats:
    along, across = np.cos(turn - rig.view_axis_rad), np.sin(turn - rig.view_axis_rad)
    seen: Floats = np.unwrap(np.arctan2(np.cos(rig.view_rad) * across, along))
    return seen


def _rest(rig: SeriesRig) -> Floats:
    """Stretch of both segments of both tendons at the preload, mm, shape (2, 2); nothing where there is no tendon."""
    tension, toe = rig.preload_N, rig.toe_mm
    rest = [
        (tension / stiff, (tension + np.sqrt(tension**2 + 4.0 * soft * tension * toe)) / (2.0 * soft))
        for stiff, soft in zip(rig.stiff_N_per_mm, rig.soft_N_per_mm, strict=True)
    ]
    return np.array([rest[0], rest[1] if rig.pair else (0.0, 0.0)])


def _laws(rig: SeriesRig) -> _Laws:
    there = np.array([1.0, 1.0 if rig.pair else 0.0])
    flexures = rig.flexures
    return _Laws(
        spring=np.ascontiguousarray(flexures.spring_Nmm_per_rad, dtype=float),
        jenkins=np.ascontiguousarray(flexures.jenkins_Nmm_per_rad, dtype=float),
        yields=np.ascontiguousarray(flexures.yield_Nmm, dtype=float),
        pitch=rig.pitch_mm,
        arm=np.array(rig.arm_mm),
        stiff=there * np.array(rig.stiff_N_per_mm),
        soft=there * np.array(rig.soft_N_per_mm),
        toe=rig.toe_mm,
        rest=_rest(rig),
        friction=rig.base_friction,
        drag=rig.drag_N,
        creep=rig.creep_mm_per_N,
        tip_x=rig.tip_force_N[0],
        tip_y=rig.tip_force_N[1],
        contact=rig.contact_mm,
        contact_stiffness=rig.contact_N_per_mm15,
    )


@njit(cache=True)
def _played(drive: Floats, width: float) -> Floats:
    """Output of a gear with play, from the middle of the play."""
    out, at = np.empty(drive.size), 0.0
    for k in range(drive.size):
        if drive[k] - at > 0.5 * width:
            at = drive[k] - 0.5 * width
        elif at - drive[k] > 0.5 * width:
            at = drive[k] + 0.5 * width
        out[k] = at
    return out
