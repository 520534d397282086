"""Inputs of a run, sample by sample, from a load program and a rig's effects; the same for both engines."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fem_models.load.program import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import require_planar
from fem_models.rig.tendon_law import tendon_stretch_mm
from hysteresis.arrays import Floats


@dataclass(frozen=True)
class Schedule:
    """Inputs of a run, shapes (m,) or (m, 2) for tendons a and b.

    ``drive_mm``: displacement at the wheel's rim, after gain, play and eccentricity. ``slack_mm``: extra length of
    a tendon compared with rest. ``loop_scale``: factor of the slip moments of the Jenkins elements. ``friction_scale``:
    factor of the friction of all guides. ``residual_rad``: angle of every joint without load.
    ``time_s``: from the first sample on, zeros for a program without times.
    ``creep``: share of the remaining creep by which the tendons stretch from the last sample to this one.
    """

    drive_mm: Floats
    slack_mm: Floats
    loop_scale: Floats
    friction_scale: Floats
    residual_rad: Floats
    time_s: Floats
    creep: Floats


def play(drive: Floats, width: ArrayLike) -> Floats:
    """Play operator of a width, that of each sample; the play starts centred at zero: shape (m,) -> (m,)."""
    out = np.empty_like(drive)
    at = 0.0
    widths = np.broadcast_to(np.asarray(width, dtype=float), drive.shape)
    for k, (x, w) in enumerate(zip(drive.tolist(), widths.tolist(), strict=True)):
        at = min(max(at, x - w / 2), x + w / 2)
        out[k] = at
    return out


def _preload_N(rig: Rig, program: LoadProgram) -> Floats:
    """Preload that is left at every sample, shape (m,)."""
    lost = np.zeros(program.drive_mm.size)
    if rig.preload_loss is not None:
        lost = rig.preload_loss.fraction * _settled(program, rig.preload_loss.cycles)
    return rig.preload_N * (1 - lost)


def schedule(rig: Rig, program: LoadProgram) -> Schedule:
    """Work out the inputs of a run.

    Raises
    ------
    RigError
        Creep, drag, velocity weakening or self-heating without times, effects of the cycle count without cycles.
    """
    require_planar(rig)
    drive, m = program.drive_mm, program.drive_mm.size
    if rig.drive_gain is not None:
        drive = (1 + rig.drive_gain.error) * drive
    if rig.backlash is not None:
        drive = play(drive, rig.backlash.left_mm(_preload_N(rig, program)))
    if rig.eccentricity is not None:
        phase = np.radians(rig.eccentricity.phase_deg)
        wave = np.sin(drive / rig.wheel.radius_mm + phase) - np.sin(phase)
        drive = drive + rig.eccentricity.amplitude_mm * wave
    slack = np.zeros((m, 2))
    if rig.slack is not None:
        slack += [rig.slack.tendon_a_mm, rig.slack.tendon_b_mm]
    if rig.preload_loss is not None:
        tension = _preload_N(rig, program)
        length = rig.length_mm
        for side, tendon in enumerate(rig.tendons):
            slack[:, side] -= tendon_stretch_mm(tendon, tension, rig.preload_N, length)
    loop_scale, residual = np.ones(m), np.full(m, math.radians(rig.precurvature_deg))
    if rig.fatigue is not None:
        done = _settled(program, rig.fatigue.cycles)
        loop_scale = 1 - rig.fatigue.loop_loss * done
        residual = residual + np.radians(rig.fatigue.residual_deg) * done
    for name in ("creep", "drag", "stribeck"):
        if getattr(rig, name) is not None and program.time_s is None:
            raise RigError(f"rig {rig.name}: {name}: expected a load program with time_s")
    if program.time_s is None and rig.superelastic is not None and rig.superelastic.heating_time_s is not None:
        raise RigError(f"rig {rig.name}: superelastic.heating_time_s: expected a load program with time_s")
    time = np.zeros(m) if program.time_s is None else program.time_s - program.time_s[0]
    creep = np.zeros(m)
    if rig.creep is not None:
        creep[1:] = -np.expm1(-np.diff(time) / rig.creep.time_s)
    return Schedule(drive, slack, loop_scale, _friction_scale(rig, program, drive), residual, time, creep)


def force_schedule(rig: Rig, force_N: ArrayLike) -> Schedule:
    """Work out the inputs of a run under load control: the drives are tensions of tendon a at the wheel, in N.

    Effects between motor and base (slack, play, eccentricity, creep) do not change a prescribed force.

    Raises
    ------
    RigError
        A rig of two tendons; an effect that needs times or cycles; forces that are not a row of numbers of at least 0.
    """
    force = np.array(force_N, dtype=float)
    require_planar(rig)
    if rig.tendon_b is not None:
        raise RigError(f"rig {rig.name}: two tendons: expected a rig of one tendon under load control")
    for name in ("drag", "preload_loss", "fatigue", "drive_gain", "stribeck", "position_friction", "run_in"):
        if getattr(rig, name) is not None:
            raise RigError(f"rig {rig.name}: {name}: expected a rig without it under load control")
    if rig.superelastic is not None and rig.superelastic.heating_time_s is not None:
        raise RigError(f"rig {rig.name}: superelastic.heating_time_s: expected a rig without it under load control")
    if force.ndim != 1 or force.size == 0:
        raise RigError(f"force_N of shape {force.shape}: expected a row of forces")
    if not (np.isfinite(force) & (force >= 0)).all():
        raise RigError(f"force_N = {force[~(np.isfinite(force) & (force >= 0))][0]:g}: expected at least 0")
    m = force.size
    rest = np.full(m, math.radians(rig.precurvature_deg))
    return Schedule(force, np.zeros((m, 2)), np.ones(m), np.ones(m), rest, np.zeros(m), np.zeros(m))


def _friction_scale(rig: Rig, program: LoadProgram, drive: Floats) -> Floats:
    """Factor of the friction of all guides at every sample, by speed, place and cycle of the drive, shape (m,)."""
    scale = np.ones(drive.size)
    if rig.stribeck is not None and program.time_s is not None:  # which schedule requires
        speed = np.abs(np.gradient(drive, program.time_s))
        scale = scale * (1 + rig.stribeck.rise * np.exp(-speed / rig.stribeck.speed_mm_per_s))
    if rig.position_friction is not None:
        with np.errstate(over="ignore"):  # friction without end: the solver finds no equilibrium, and says where
            scale = scale * np.exp(rig.position_friction.growth_per_mm * drive)
    if rig.run_in is not None:
        scale = scale * (1 + rig.run_in.excess * (1 - _settled(program, rig.run_in.cycles)))
    return scale


def _settled(program: LoadProgram, cycles: float) -> Floats:
    """1 - exp(-cycle/cycles) of every sample, shape (m,)."""
    if program.cycle is None:
        raise RigError("cycle: missing, expected a load program that counts its cycles")
    return -np.expm1(-program.cycle / cycles)


def snap_hint(rig: Rig, *, load_control: bool) -> str:
    """Say what to do, at the end of a message, where a rig has no equilibrium; empty where nothing is known.

    On a flat plateau a tube may snap: between two forces there is no equilibrium near the last one, at any step.
    Nor may there be one where the law of a curve is flat: the bend gathers in a few joints.
    """
    if load_control and rig.superelastic is not None:
        return ": a tube may snap there under a force: expected a drive in mm, or a steeper plateau_modulus_GPa"
    if isinstance(rig.joint, MeasuredJoint) and rig.joint.has_law:
        flat = f"{max(rig.joint.law_onset_deg):.3g} deg"
        return f": beyond {flat} the law of a joint has no stiffness left, and single joints bend: expected less drive"
    return ""
