"""Effects of the catalogue that change the rig.

Each is drawn with a random character (side, phase, mixture). Its size is left open: a part from 0 to 1 of what is
plausible for the rig. :mod:`validation.practice.size` solves for it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import (
    Backlash,
    Closure,
    Creep,
    Drag,
    DriveGain,
    Eccentricity,
    Fatigue,
    Gravity,
    PositionFriction,
    PreloadLoss,
    RunIn,
    Slack,
    Stribeck,
    Superelastic,
    TipLoad,
    TipStop,
)
from fem_models.rig.rig import Wheel
from validation.practice.injected import Draw, Family, Injected, Rng, either_sign
from validation.practice.protocols import BaselineRuns

RUN_OUT = 0.1
"""Largest run-out of a wheel over its radius: more is no run-out of a wheel that was turned."""


def _backlash(rng: Rng, baseline: BaselineRuns) -> Family:
    def at(size: float) -> Injected:
        width = 0.5 * size
        return Injected({"width_mm": width}, rig=lambda rig: replace(rig, backlash=Backlash(width)))

    return Family(at)


def _tendon_slack(rng: Rng, baseline: BaselineRuns) -> Family:
    """Tendons too long for the preload; by different lengths, so that the dead zone is off the centre."""
    rig = baseline.protocol.rig
    tendon = rig.tendon_a
    stretch = 20.0 * (tendon.free_length_mm + rig.length_mm) / tendon.EA_N
    off = float(rng.uniform(-0.3, 0.3))

    def at(size: float) -> Injected:
        a, b = (2 * stretch * size * (1 + side * off) for side in (1, -1))
        return Injected({"tendon_a_mm": a, "tendon_b_mm": b}, rig=lambda rig: replace(rig, slack=Slack(a, b)))

    return Family(at)


def _unequal_tendons(rng: Rng, baseline: BaselineRuns) -> Family:
    """Tendon b differs in moment arm, stiffness or free length, in one of them or in a mixture."""
    mixture = rng.uniform(-1.0, 1.0, 3)
    if rng.random() < 0.6:
        mixture *= np.arange(3) == rng.integers(3)
    mixture /= np.abs(mixture).max()

    def at(size: float) -> Injected:
        arm, EA, free = (float(np.exp(size * m * most)) for m, most in zip(mixture, (0.15, 0.5, 0.5), strict=True))

        def rig(rig: Rig) -> Rig:
            b = rig.tendon_b
            assert b is not None
            other = replace(
                b, moment_arm_mm=arm * b.moment_arm_mm, EA_N=EA * b.EA_N, free_length_mm=free * b.free_length_mm
            )
            return replace(rig, tendon_b=other)

        return Injected({"arm_ratio": arm, "EA_ratio": EA, "free_length_ratio": free}, rig=rig)

    return Family(at)


def _tendon_stiffening(rng: Rng, baseline: BaselineRuns) -> Family:
    """Toe region larger than the nominal one."""

    def at(size: float) -> Injected:
        more = 200.0 * size

        def rig(rig: Rig) -> Rig:
            a, b = (replace(tendon, toe_N=tendon.toe_N + more) for tendon in rig.tendons)
            return replace(rig, tendon_a=a, tendon_b=b)

        return Injected({"more_toe_N": more}, rig=rig)

    return Family(at)


def _tendon_creep(rng: Rng, baseline: BaselineRuns) -> Family:
    time = baseline.longest_s * float(rng.uniform(0.05, 0.5))

    def at(size: float) -> Injected:
        creep = Creep(fraction=3.0 * size, time_s=time)
        return Injected({"fraction": creep.fraction, "time_s": time}, rig=lambda rig: replace(rig, creep=creep))

    return Family(at)


def _preload_loss(rng: Rng, baseline: BaselineRuns) -> Family:
    cycles = float(rng.uniform(0.7, 4.0))

    def at(size: float) -> Injected:
        loss = PreloadLoss(fraction=0.8 * size, cycles=cycles)
        numbers = {"fraction": loss.fraction, "cycles": cycles}
        return Injected(numbers, rig=lambda rig: replace(rig, preload_loss=loss))

    return Family(at)


def _guide_friction(rng: Rng, baseline: BaselineRuns) -> Family:
    """Capstan friction of tendons that wrap around something before the base of the straight manipulator."""

    def at(size: float) -> Injected:
        wrap = 150.0 * size
        return Injected(
            {"rest_wrap_deg": wrap},
            rig=lambda rig: replace(rig, friction=replace(rig.friction, rest_wrap_deg=wrap)),
        )

    return Family(at, least=0.2)


def _viscous_drag(rng: Rng, baseline: BaselineRuns) -> Family:
    sheath = float(rng.choice([0.0, 1.0, rng.uniform()]))
    stiffness = 20.0  # Nmm s/rad

    def at(size: float) -> Injected:
        drag = Drag(size * sheath * 0.5, size * (1 - sheath) * stiffness)
        numbers = {"sheath_N_s_per_mm": drag.sheath_N_s_per_mm, "joint_Nmm_s_per_rad": drag.joint_Nmm_s_per_rad}
        return Injected(numbers, rig=lambda rig: replace(rig, drag=drag))

    return Family(at)


def _superelastic_plateau(rng: Rng, baseline: BaselineRuns) -> Family:
    """Superelastic plateau that the outer fibres reach at a part of the full bending."""
    rig = baseline.protocol.rig
    young_GPa = rig.material.youngs_modulus_GPa
    largest_MPa = 1e3 * young_GPa * max(float(run.peak_strain.max()) for run in baseline.runs)
    unloading, slope = float(rng.uniform(0.4, 0.9)), float(rng.uniform(0.0, 0.15)) * young_GPa

    def at(size: float) -> Injected:
        plateau = largest_MPa * (1 - 0.8 * size)
        law = Superelastic(plateau, unloading * plateau, 0.04, slope)
        numbers = {"plateau_MPa": plateau, "unloading_plateau_MPa": unloading * plateau, "plateau_modulus_GPa": slope}
        return Injected(numbers, rig=lambda rig: replace(rig, superelastic=law))

    return Family(at)


def _functional_fatigue(rng: Rng, baseline: BaselineRuns) -> Family:
    loss, residual = float(rng.uniform(0.3, 1.0)), either_sign(rng) * float(rng.uniform(0.3, 1.0))
    cycles = float(rng.uniform(0.7, 4.0))
    joint_deg = baseline.bend_deg / baseline.protocol.rig.joints

    def at(size: float) -> Injected:
        fatigue = Fatigue(loop_loss=size * loss, residual_deg=0.5 * size * residual * joint_deg, cycles=cycles)
        numbers = {"loop_loss": fatigue.loop_loss, "residual_deg": fatigue.residual_deg, "cycles": cycles}
        return Injected(numbers, rig=lambda rig: replace(rig, fatigue=fatigue))

    return Family(at)


def _notch_closure(rng: Rng, baseline: BaselineRuns) -> Family:
    """Notch edges that meet at a part of the largest angle of a joint."""
    largest = max(
        float(np.abs(run.record.notches_deg).max()) for run in baseline.runs if run.record.notches_deg is not None
    )
    stiffness = float(np.exp(rng.uniform(*np.log((500.0, 20_000.0)))))

    def at(size: float) -> Injected:
        closed = Closure(stiffness, angle_deg=largest * (1 - 0.5 * size))
        numbers = {"angle_deg": largest * (1 - 0.5 * size), "stiffness_Nmm_per_rad": stiffness}
        return Injected(numbers, rig=lambda rig: replace(rig, closure=closed))

    return Family(at)


def _gravity(rng: Rng, baseline: BaselineRuns) -> Family:
    direction = float(rng.uniform(-180.0, 180.0))

    def at(size: float) -> Injected:
        weight = Gravity(ring_mass_g=40.0 * size, direction_deg=direction)
        numbers = {"ring_mass_g": weight.ring_mass_g, "direction_deg": direction}
        return Injected(numbers, rig=lambda rig: replace(rig, gravity=weight))

    return Family(at)


def _tip_contact(rng: Rng, baseline: BaselineRuns) -> Family:
    """Obstacle that the tip meets at a part of its largest deflection."""
    tip = baseline.runs[0].record.tip_mm
    assert tip is not None
    largest, stiffness = float(tip[:, 1].max()), float(np.exp(rng.uniform(*np.log((0.1, 20.0)))))

    def at(size: float) -> Injected:
        stop = TipStop(y_mm=largest * (1 - 0.5 * size), stiffness_N_per_mm=stiffness)
        numbers = {"y_mm": stop.y_mm, "stiffness_N_per_mm": stiffness}
        return Injected(numbers, rig=lambda rig: replace(rig, tip_stop=stop))

    return Family(at)


def _wheel_eccentricity(rng: Rng, baseline: BaselineRuns) -> Family:
    """Eccentric wheel, from one that hardly rotates to a pinion with several revolutions over the stroke."""
    revolutions = float(np.exp(rng.uniform(*np.log((0.05, 2.0)))))
    radius = baseline.full_mm / (np.pi * revolutions)
    phase = float(rng.uniform(-180.0, 180.0))

    def at(size: float) -> Injected:
        eccentric = Eccentricity(RUN_OUT * radius * size, phase)
        return Injected(
            {"amplitude_mm": eccentric.amplitude_mm, "phase_deg": phase, "radius_mm": radius},
            rig=lambda rig: replace(rig, eccentricity=eccentric, wheel=Wheel(radius)),
        )

    return Family(at)


def _drive_gain(rng: Rng, baseline: BaselineRuns) -> Family:
    sign = either_sign(rng)

    def at(size: float) -> Injected:
        off = DriveGain(0.15 * sign * size)
        return Injected({"error": off.error}, rig=lambda rig: replace(rig, drive_gain=off))

    return Family(at)


def _tip_load(rng: Rng, baseline: BaselineRuns) -> Family:
    direction = float(rng.uniform(-180.0, 180.0))

    def at(size: float) -> Injected:
        load = TipLoad(force_N=5.0 * size, direction_deg=direction)
        numbers = {"force_N": load.force_N, "direction_deg": direction}
        return Injected(numbers, rig=lambda rig: replace(rig, tip_load=load))

    return Family(at)


def _stribeck_friction(rng: Rng, baseline: BaselineRuns) -> Family:
    """Velocity weakening with a speed between those of the slow and of the fast records."""
    programs = [loading.program for loading in baseline.protocol.loadings]
    fastest = [
        float(np.abs(np.gradient(program.drive_mm, program.time_s)).max())
        for program in programs
        if program.time_s is not None
    ]
    speed = float(np.exp(rng.uniform(np.log(0.3 * min(fastest)), np.log(max(fastest)))))

    def at(size: float) -> Injected:
        law = Stribeck(rise=3.0 * size, speed_mm_per_s=speed)
        return Injected({"rise": law.rise, "speed_mm_per_s": speed}, rig=lambda rig: replace(rig, stribeck=law))

    return Family(at)


def _position_friction(rng: Rng, baseline: BaselineRuns) -> Family:
    sign = either_sign(rng)

    def at(size: float) -> Injected:
        law = PositionFriction(2.0 * sign * size / baseline.full_mm)
        return Injected({"growth_per_mm": law.growth_per_mm}, rig=lambda rig: replace(rig, position_friction=law))

    return Family(at)


def _run_in(rng: Rng, baseline: BaselineRuns) -> Family:
    cycles = float(rng.uniform(0.5, 2.0))

    def at(size: float) -> Injected:
        law = RunIn(excess=4.0 * size, cycles=cycles)
        return Injected({"excess": law.excess, "cycles": cycles}, rig=lambda rig: replace(rig, run_in=law))

    return Family(at)


def _preloaded_play(rng: Rng, baseline: BaselineRuns) -> Family:
    takes_up = float(rng.uniform(2.0, 20.0))

    def at(size: float) -> Injected:
        width = 1.5 * size

        def rig(rig: Rig) -> Rig:
            return replace(rig, backlash=Backlash(width / (1 + rig.preload_N / takes_up)))

        return Injected({"free_width_mm": width, "takes_up_N": takes_up}, rig=rig)

    return Family(at)


RIG_EFFECTS: dict[str, Draw] = {
    "backlash": _backlash,
    "tendon_slack": _tendon_slack,
    "unequal_tendons": _unequal_tendons,
    "tendon_stiffening": _tendon_stiffening,
    "tendon_creep": _tendon_creep,
    "preload_loss": _preload_loss,
    "guide_friction": _guide_friction,
    "viscous_drag": _viscous_drag,
    "superelastic_plateau": _superelastic_plateau,
    "functional_fatigue": _functional_fatigue,
    "notch_closure": _notch_closure,
    "gravity": _gravity,
    "tip_contact": _tip_contact,
    "wheel_eccentricity": _wheel_eccentricity,
    "drive_gain": _drive_gain,
    "tip_load": _tip_load,
    "stribeck_friction": _stribeck_friction,
    "position_friction": _position_friction,
    "run_in": _run_in,
    "preloaded_play": _preloaded_play,
}
"""By name."""
