"""What practice records may hide: the effects of the catalogue.

Every effect is drawn with its character (which side, which phase, which mixture) at random and its size left open, as a
part from 0 to 1 of what a rig may plausibly have; :mod:`validation.practice.cases` solves for the size.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.rig.effects import (
    Backlash,
    Closure,
    Creep,
    Drag,
    Eccentricity,
    Fatigue,
    Gravity,
    PreloadLoss,
    Slack,
    Superelastic,
    TipStop,
)
from fem_models.rig.rig import Wheel
from hysteresis.arrays import Floats
from hysteresis.record import Record
from validation.practice.protocols import Ground


def _same(rig: Rig) -> Rig:
    return rig


def _as_logged(index: int, program: LoadProgram) -> LoadProgram:
    return program


def _as_is(index: int, record: Record, angle_deg: Floats) -> Floats:
    return angle_deg


@dataclass(frozen=True)
class Hidden:
    """An effect of a size.

    Parameters
    ----------
    numbers
        What was hidden, units in the names.
    rig
        A rig with the effect.
    drive
        What the wheel really did, from the record's index and what was logged.
    seen
        The angle that is observed, from the record's index, the run and the angle so far; shape (m,) -> (m,).
    """

    numbers: Mapping[str, float]
    rig: Callable[[Rig], Rig] = _same
    drive: Callable[[int, LoadProgram], LoadProgram] = _as_logged
    seen: Callable[[int, Record, Floats], Floats] = _as_is


@dataclass(frozen=True)
class Family:
    """An effect of drawn character: ``at(size)`` for sizes from ``least`` to 1, the bounds of what is plausible."""

    at: Callable[[float], Hidden]
    least: float = field(default=1e-4)


Rng = np.random.Generator
Draw = Callable[[Rng, Ground], Family]


def either_sign(rng: Rng) -> float:
    """Draw 1 or -1."""
    return float(rng.choice([-1.0, 1.0]))


# --- the catalogue, in the rig -----------------------------------------------------------------------------------


def _backlash(rng: Rng, ground: Ground) -> Family:
    def at(size: float) -> Hidden:
        width = 0.5 * size
        return Hidden({"width_mm": width}, rig=lambda rig: replace(rig, backlash=Backlash(width)))

    return Family(at)


def _tendon_slack(rng: Rng, ground: Ground) -> Family:
    """Ropes longer than the preload asks for; not quite by the same, so that the dead zone is off the centre."""
    rope = ground.protocol.rig.tendon_a
    stretch = 20.0 * (rope.free_length_mm + ground.protocol.rig.joints * ground.protocol.rig.pitch_mm) / rope.EA_N
    off = float(rng.uniform(-0.3, 0.3))

    def at(size: float) -> Hidden:
        a, b = (2 * stretch * size * (1 + side * off) for side in (1, -1))
        return Hidden({"tendon_a_mm": a, "tendon_b_mm": b}, rig=lambda rig: replace(rig, slack=Slack(a, b)))

    return Family(at)


def _unequal_tendons(rng: Rng, ground: Ground) -> Family:
    """Tendon b has another moment arm, stiffness or free length, one of them or a mixture."""
    mixture = rng.uniform(-1.0, 1.0, 3)
    if rng.random() < 0.6:
        mixture *= np.arange(3) == rng.integers(3)
    mixture /= np.abs(mixture).max()

    def at(size: float) -> Hidden:
        arm, EA, free = (float(np.exp(size * m * most)) for m, most in zip(mixture, (0.15, 0.5, 0.5), strict=True))

        def rig(rig: Rig) -> Rig:
            b = rig.tendon_b
            assert b is not None
            uneven = replace(
                b, moment_arm_mm=arm * b.moment_arm_mm, EA_N=EA * b.EA_N, free_length_mm=free * b.free_length_mm
            )
            return replace(rig, tendon_b=uneven)

        return Hidden({"arm_ratio": arm, "EA_ratio": EA, "free_length_ratio": free}, rig=rig)

    return Family(at)


def _tendon_stiffening(rng: Rng, ground: Ground) -> Family:
    """More of a toe region than is declared."""

    def at(size: float) -> Hidden:
        more = 200.0 * size

        def rig(rig: Rig) -> Rig:
            a, b = (replace(rope, toe_N=rope.toe_N + more) for rope in rig.tendons)
            return replace(rig, tendon_a=a, tendon_b=b)

        return Hidden({"more_toe_N": more}, rig=rig)

    return Family(at)


def _tendon_creep(rng: Rng, ground: Ground) -> Family:
    time = ground.longest_s * float(rng.uniform(0.05, 0.5))

    def at(size: float) -> Hidden:
        creep = Creep(fraction=3.0 * size, time_s=time)
        return Hidden({"fraction": creep.fraction, "time_s": time}, rig=lambda rig: replace(rig, creep=creep))

    return Family(at)


def _preload_loss(rng: Rng, ground: Ground) -> Family:
    cycles = float(rng.uniform(0.7, 4.0))

    def at(size: float) -> Hidden:
        loss = PreloadLoss(fraction=0.8 * size, cycles=cycles)
        numbers = {"fraction": loss.fraction, "cycles": cycles}
        return Hidden(numbers, rig=lambda rig: replace(rig, preload_loss=loss))

    return Family(at)


def _guide_friction(rng: Rng, ground: Ground) -> Family:
    """Ropes bent on their way to the base: the capstan's friction with the manipulator straight."""

    def at(size: float) -> Hidden:
        wrap = 150.0 * size
        return Hidden(
            {"rest_wrap_deg": wrap},
            rig=lambda rig: replace(rig, friction=replace(rig.friction, rest_wrap_deg=wrap)),
        )

    return Family(at, least=0.2)


def _viscous_drag(rng: Rng, ground: Ground) -> Family:
    sheath = float(rng.choice([0.0, 1.0, rng.uniform()]))
    stiffness = 20.0  # Nmm s/rad

    def at(size: float) -> Hidden:
        drag = Drag(size * sheath * 0.5, size * (1 - sheath) * stiffness)
        numbers = {"sheath_N_s_per_mm": drag.sheath_N_s_per_mm, "joint_Nmm_s_per_rad": drag.joint_Nmm_s_per_rad}
        return Hidden(numbers, rig=lambda rig: replace(rig, drag=drag))

    return Family(at)


def _superelastic_plateau(rng: Rng, ground: Ground) -> Family:
    """Superelastic plateau that the outer fibres reach at a part of the full bend."""
    rig = ground.protocol.rig
    young_GPa = rig.material.youngs_modulus_GPa
    largest_MPa = 1e3 * young_GPa * max(float(run.peak_strain.max()) for run in ground.runs)
    back, climb = float(rng.uniform(0.4, 0.9)), float(rng.uniform(0.0, 0.15)) * young_GPa

    def at(size: float) -> Hidden:
        plateau = largest_MPa * (1 - 0.8 * size)
        law = Superelastic(plateau, back * plateau, plateau_modulus_GPa=climb)
        numbers = {"plateau_MPa": plateau, "unloading_plateau_MPa": back * plateau, "plateau_modulus_GPa": climb}
        return Hidden(numbers, rig=lambda rig: replace(rig, superelastic=law))

    return Family(at)


def _functional_fatigue(rng: Rng, ground: Ground) -> Family:
    loss, residual = float(rng.uniform(0.3, 1.0)), either_sign(rng) * float(rng.uniform(0.3, 1.0))
    cycles = float(rng.uniform(0.7, 4.0))
    joint_deg = ground.bend_deg / ground.protocol.rig.joints

    def at(size: float) -> Hidden:
        tired = Fatigue(loop_loss=size * loss, residual_deg=0.5 * size * residual * joint_deg, cycles=cycles)
        numbers = {"loop_loss": tired.loop_loss, "residual_deg": tired.residual_deg, "cycles": cycles}
        return Hidden(numbers, rig=lambda rig: replace(rig, fatigue=tired))

    return Family(at)


def _notch_closure(rng: Rng, ground: Ground) -> Family:
    """Edges that meet at a part of the largest angle of a joint."""
    largest = max(
        float(np.abs(run.record.notches_deg).max()) for run in ground.runs if run.record.notches_deg is not None
    )
    stiffness = float(np.exp(rng.uniform(*np.log((500.0, 20_000.0)))))

    def at(size: float) -> Hidden:
        closed = Closure(stiffness, angle_deg=largest * (1 - 0.5 * size))
        numbers = {"angle_deg": largest * (1 - 0.5 * size), "stiffness_Nmm_per_rad": stiffness}
        return Hidden(numbers, rig=lambda rig: replace(rig, closure=closed))

    return Family(at)


def _gravity(rng: Rng, ground: Ground) -> Family:
    direction = float(rng.uniform(-180.0, 180.0))

    def at(size: float) -> Hidden:
        weight = Gravity(ring_mass_g=40.0 * size, direction_deg=direction)
        numbers = {"ring_mass_g": weight.ring_mass_g, "direction_deg": direction}
        return Hidden(numbers, rig=lambda rig: replace(rig, gravity=weight))

    return Family(at)


def _tip_contact(rng: Rng, ground: Ground) -> Family:
    """Obstacle that the tip meets on a part of its way."""
    tip = ground.runs[0].record.tip_mm
    assert tip is not None
    largest, stiffness = float(tip[:, 1].max()), float(np.exp(rng.uniform(*np.log((0.1, 20.0)))))

    def at(size: float) -> Hidden:
        stop = TipStop(y_mm=largest * (1 - 0.5 * size), stiffness_N_per_mm=stiffness)
        numbers = {"y_mm": stop.y_mm, "stiffness_N_per_mm": stiffness}
        return Hidden(numbers, rig=lambda rig: replace(rig, tip_stop=stop))

    return Family(at)


def _wheel_eccentricity(rng: Rng, ground: Ground) -> Family:
    """From a wheel that hardly turns to a pinion that turns some times over the stroke."""
    turns = float(np.exp(rng.uniform(*np.log((0.05, 2.0)))))
    radius = ground.full_mm / (np.pi * turns)
    phase = float(rng.uniform(-180.0, 180.0))

    def at(size: float) -> Hidden:
        uneven = Eccentricity(0.5 * radius * size, phase)
        return Hidden(
            {"amplitude_mm": uneven.amplitude_mm, "phase_deg": phase, "radius_mm": radius},
            rig=lambda rig: replace(rig, eccentricity=uneven, wheel=Wheel(radius)),
        )

    return Family(at)


# --- the catalogue, in what is observed --------------------------------------------------------------------------


def _clock(record: Record) -> Floats:
    assert record.time_s is not None
    return record.time_s - record.time_s[0]


def _time_delay(rng: Rng, ground: Ground) -> Family:
    def at(size: float) -> Hidden:
        delay = 0.2 * size

        def seen(index: int, record: Record, angle_deg: Floats) -> Floats:
            time = _clock(record)  # before the record the rig stands still
            return np.asarray(PchipInterpolator(time, angle_deg)(np.maximum(time - delay, 0.0)))

        return Hidden({"delay_s": delay}, seen=seen)

    return Family(at)


def _camera_misalignment(rng: Rng, ground: Ground) -> Family:
    """Gain and perspective in a drawn mixture; the offset is the record's zero, which every case has."""
    mixture, bend = float(rng.uniform(0.0, 2 * np.pi)), ground.bend_deg

    def at(size: float) -> Hidden:
        gain, perspective = 0.1 * size * float(np.cos(mixture)), 0.1 * size * float(np.sin(mixture)) / bend
        return Hidden(
            {"gain": gain, "perspective_per_deg": perspective},
            seen=lambda index, record, angle: angle * (1 + gain + perspective * angle),
        )

    return Family(at)


def _thermal_drift(rng: Rng, ground: Ground) -> Family:
    """Offset that grows with time, linear or saturating, anew in each record."""
    sign, long = either_sign(rng), ground.longest_s
    time = long * float(rng.uniform(0.2, 1.0)) if rng.integers(2) else 0.0

    def at(size: float) -> Hidden:
        most = 3.0 * size * sign

        def seen(index: int, record: Record, angle_deg: Floats) -> Floats:
            t = _clock(record)
            return angle_deg + most * (-np.expm1(-t / time) if time else t / long)

        return Hidden({"drift_deg": most, "time_s": time or long, "saturates": float(time > 0)}, seen=seen)

    return Family(at)


CATALOGUE: dict[str, Draw] = {
    "backlash": _backlash,
    "tendon_slack": _tendon_slack,
    "unequal_tendons": _unequal_tendons,
    "tendon_stiffening": _tendon_stiffening,
    "tendon_creep": _tendon_creep,
    "preload_loss": _preload_loss,
    "guide_friction": _guide_friction,
    "viscous_drag": _viscous_drag,
    "time_delay": _time_delay,
    "superelastic_plateau": _superelastic_plateau,
    "functional_fatigue": _functional_fatigue,
    "notch_closure": _notch_closure,
    "gravity": _gravity,
    "tip_contact": _tip_contact,
    "wheel_eccentricity": _wheel_eccentricity,
    "camera_misalignment": _camera_misalignment,
    "thermal_drift": _thermal_drift,
}
"""The effects that have a name, by it."""

DISTINCT: tuple[tuple[str, ...], ...] = (
    ("backlash", "guide_friction"),
    ("tendon_slack", "tendon_stiffening"),
    ("unequal_tendons", "camera_misalignment", "gravity", "wheel_eccentricity", "tip_contact"),
    ("viscous_drag", "time_delay"),
    ("tendon_creep", "thermal_drift", "preload_loss", "functional_fatigue"),
    ("superelastic_plateau", "notch_closure"),
)
"""Effects by kind: two of different kinds have little in common."""

ANGLE_ALONE = frozenset({"camera_misalignment", "gravity", "notch_closure", "tip_contact", "wheel_eccentricity"})
"""Effects that are a function of the angle or the drive alone: with the geometry unknown, f(x) takes them."""
