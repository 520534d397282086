"""Optional effects of a rig: each a small table, absent by default, that both engines model.

Names and meanings follow the list of effects in the documentation (docs/theory/effects.md). The sign convention is
given where it matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_models.rig.checks import require, require_numbers
from hysteresis.arrays import Floats


@dataclass(frozen=True)
class Slack:
    """Unequal rest lengths: how much longer a tendon is than the preload requires, in mm; negative is shorter.

    A tendon cannot push, so a large enough value leaves it slack around zero drive.
    """

    tendon_a_mm: float = 0.0
    tendon_b_mm: float = 0.0

    def __post_init__(self) -> None:
        require_numbers("slack", self)


@dataclass(frozen=True)
class Backlash:
    """Play of width ``width_mm`` between drive and wheel, as tendon displacement; it starts centred.

    With ``takes_up_N`` it is clearance of the tendons in their holes and fixings, which the preload T takes up: a play
    of the width w/(1 + T/takes_up), which is half of w at that preload: a rope in tension is held out of line by that
    much less (tie rod under axial tension; Timoshenko and Gere, Theory of Elastic Stability, 1961, chapter 1). T is the
    preload, about which the tensions of both tendons reverse, less what :class:`PreloadLoss` has taken from it: a width
    that followed the tension of the moment would give out energy.
    """

    width_mm: float
    takes_up_N: float | None = None

    def __post_init__(self) -> None:
        require_numbers("backlash", self)
        require(self.width_mm >= 0, "backlash.width_mm", self.width_mm, "at least 0")
        require(self.takes_up_N is None or self.takes_up_N > 0, "backlash.takes_up_N", self.takes_up_N, "above 0")

    def left_mm(self, preload_N: Floats | float) -> Floats:
        """Width of the play that a preload leaves, of the shape of the preload."""
        taken = 0.0 if self.takes_up_N is None else np.asarray(preload_N) / self.takes_up_N
        return np.asarray(self.width_mm / (1 + taken))


@dataclass(frozen=True)
class Eccentricity:
    """Radial runout of the wheel: x + e [sin(x/R + p) - sin(p)] in place of x, R being the wheel's radius."""

    amplitude_mm: float
    phase_deg: float = 0.0

    def __post_init__(self) -> None:
        require_numbers("eccentricity", self)


LEAST_FIBRES, MOST_FIBRES = 8, 512
"""Fibres on a side of a superelastic section: fewer miss its moment by a percent, more only take time."""


@dataclass(frozen=True)
class Superelastic:
    """Flag-shaped law of Nitinol, applied fibre by fibre through the section; without constants that of a common alloy.

    The default plateaus, at 37 degrees, and the transformation strain are measured (GitHub
    confluentmedical/nitinol-design-concepts, 115-open-frame-shape-set: 460-500 MPa on loading, 240-210 on unloading,
    0.046), and so are 6.52 MPa/K and, in compression, a start at 690 MPa: 1.44 times 480. That ``compression_factor``
    is not the default, 1: laws that were fitted to bending are the same on both sides.

    Self-heating: the transformation sets latent heat free and takes it back. Each joint has one temperature, of all
    metal in its section over the length that bends, which goes back to that of the surroundings with
    ``heating_time_s``. None keeps it there: a slow rig. Only latent heat over heat capacity counts, 31 K here. The
    default latent heat is T slope strain/density (Clausius and Clapeyron, 310 K, 6450 kg/m^3), the heat capacity 3 R
    per mole of atoms (Dulong and Petit). A maker's table (SMA Inc., Selected Properties of NiTi) has 24 J/g and 0.84
    J/(g K): 29 K.

    Parameters
    ----------
    plateau_MPa, unloading_plateau_MPa
        Stress at which the austenite transforms, and at which the martensite transforms back, at ``reference_C``.
    transformation_strain
        Strain of the complete transformation; beyond it the martensite is taken as stiff as the austenite.
    plateau_modulus_GPa
        Slope of both plateaus, which stay parallel; 0 is flat.
    compression_factor
        Both plateaus in compression over those in tension, at ``reference_C``.
    temperature_C, reference_C
        Temperature of the surroundings, and the one at which the plateaus are given.
    clausius_clapeyron_MPa_per_K
        Rise of all plateaus with the temperature, in tension and in compression.
    heating_time_s
        Time constant of the exchange of heat with the surroundings; the load program needs times.
    latent_heat_J_per_g, heat_capacity_J_per_gK
        Of the complete transformation, and of the metal.
    fibres_per_side
        Fibres on either side of the neutral axis, up to :data:`MOST_FIBRES`. In a cycle the error of the moment is
        0.1 % of the largest with 16, that of the loss 0.5 %, that of the slope 2 % of the elastic one (rms); with 256
        all three are below 0.1 %. The time of a run grows with their number.
    """

    plateau_MPa: float = 480.0
    unloading_plateau_MPa: float = 225.0
    transformation_strain: float = 0.046
    plateau_modulus_GPa: float = 0.0
    compression_factor: float = 1.0
    temperature_C: float = 37.0
    reference_C: float = 37.0
    clausius_clapeyron_MPa_per_K: float = 6.52
    heating_time_s: float | None = None
    latent_heat_J_per_g: float = 14.4
    heat_capacity_J_per_gK: float = 0.47
    fibres_per_side: int = 16

    def __post_init__(self) -> None:
        require_numbers("superelastic", self)
        require(self.plateau_MPa > 0, "superelastic.plateau_MPa", self.plateau_MPa, "above 0")
        require(
            0 < self.unloading_plateau_MPa <= self.plateau_MPa,
            "superelastic.unloading_plateau_MPa",
            self.unloading_plateau_MPa,
            f"above 0, up to plateau_MPa = {self.plateau_MPa}",
        )
        for name in ("transformation_strain", "compression_factor", "heat_capacity_J_per_gK", "heating_time_s"):
            value = getattr(self, name)
            require(value is None or value > 0, f"superelastic.{name}", value, "above 0")
        for name in ("plateau_modulus_GPa", "clausius_clapeyron_MPa_per_K", "latent_heat_J_per_g"):
            value = getattr(self, name)
            require(value >= 0, f"superelastic.{name}", value, "at least 0")
        fibres = self.fibres_per_side
        within = isinstance(fibres, int) and LEAST_FIBRES <= fibres <= MOST_FIBRES
        expected = f"a whole number from {LEAST_FIBRES} to {MOST_FIBRES}"
        require(within, "superelastic.fibres_per_side", fibres, expected)
        require(
            self.least_plateau_MPa > 0,
            "superelastic.temperature_C",
            self.temperature_C,
            f"warmer: the unloading plateau falls to {self.least_plateau_MPa:g} MPa, and the metal stays martensite",
        )

    @property
    def shift_MPa(self) -> float:
        """Rise of all plateaus at the temperature of the surroundings."""
        return self.clausius_clapeyron_MPa_per_K * (self.temperature_C - self.reference_C)

    @property
    def start_MPa(self) -> float:
        """Stress at which the metal leaves its elastic line, on the side where that is first."""
        return min(1.0, self.compression_factor) * self.plateau_MPa + self.shift_MPa

    @property
    def least_plateau_MPa(self) -> float:
        """Lowest plateau, of unloading, at the temperature of the surroundings."""
        return min(1.0, self.compression_factor) * self.unloading_plateau_MPa + self.shift_MPa

    @property
    def complete_heating_K(self) -> float:
        """Rise of the temperature by a complete transformation that keeps its heat."""
        return self.latent_heat_J_per_g / self.heat_capacity_J_per_gK


@dataclass(frozen=True)
class Closure:
    """Edges of a notch that meet: a stiff spring beyond an angle of the joint.

    With ``angle_deg`` None the angle comes from the geometry. One-sided notches close in the positive direction only.
    """

    stiffness_Nmm_per_rad: float
    angle_deg: float | None = None

    def __post_init__(self) -> None:
        require_numbers("closure", self)
        k, angle = self.stiffness_Nmm_per_rad, self.angle_deg
        require(k > 0, "closure.stiffness_Nmm_per_rad", k, "above 0")
        require(angle is None or angle > 0, "closure.angle_deg", angle, "above 0")


@dataclass(frozen=True)
class Gravity:
    """Weight of the rings, in the bending plane.

    ``direction_deg`` is the direction of gravity, measured from the axis of the straight tube towards positive bending:
    0 points along the tube to its tip, -90 against positive bending.
    """

    ring_mass_g: float
    direction_deg: float = -90.0

    def __post_init__(self) -> None:
        require_numbers("gravity", self)
        require(self.ring_mass_g >= 0, "gravity.ring_mass_g", self.ring_mass_g, "at least 0")


@dataclass(frozen=True)
class TipStop:
    """A frictionless obstacle: it pushes the tip back where the tip's y is beyond ``y_mm``, on the side of its sign."""

    y_mm: float
    stiffness_N_per_mm: float

    def __post_init__(self) -> None:
        require_numbers("tip_stop", self)
        require(self.stiffness_N_per_mm > 0, "tip_stop.stiffness_N_per_mm", self.stiffness_N_per_mm, "above 0")


@dataclass(frozen=True)
class TipLoad:
    """A dead force on the centre of the last ring, fixed in space: a constant pull, of a string over a pulley for one.

    ``direction_deg`` is where the force points, counted as the direction of :class:`Gravity` is: 90 pushes the tip
    towards positive bending. The force comes on on the way to the first sample. It keeps its direction as the tube
    bends. It has no mass; what hangs at the tip is a :class:`TipMass`.
    """

    force_N: float
    direction_deg: float = -90.0

    def __post_init__(self) -> None:
        require_numbers("tip_load", self)
        require(self.force_N >= 0, "tip_load.force_N", self.force_N, "at least 0")


@dataclass(frozen=True)
class TipMass:
    """A mass at the centre of the last ring: a tool. It has weight in both engines, inertia in the dynamic one.

    The weight is a dead load of mass times 9.80665 m/s^2, added to :class:`TipLoad` and the weight of the
    rings. ``direction_deg`` is the direction of gravity, as of :class:`Gravity`. In a rig that bends in a horizontal
    plane a mass has inertia alone: there a tip load of the same size the other way takes the weight off.
    """

    mass_g: float
    direction_deg: float = -90.0

    def __post_init__(self) -> None:
        require_numbers("tip_mass", self)
        require(self.mass_g >= 0, "tip_mass.mass_g", self.mass_g, "at least 0")


@dataclass(frozen=True)
class DriveGain:
    """Wheel radius or spindle pitch off by a part: (1 + error) x in place of x."""

    error: float

    def __post_init__(self) -> None:
        require_numbers("drive_gain", self)
        require(self.error > -1, "drive_gain.error", self.error, "above -1")


@dataclass(frozen=True)
class Stribeck:
    """Velocity weakening of all guides: their friction times 1 + rise exp(-v / speed), v being the wheel's rim speed.

    The speed of the rim stands for that of the tendon in its guides; it is smaller there by what the tendon stretches.
    The load program needs times.
    """

    rise: float
    speed_mm_per_s: float

    def __post_init__(self) -> None:
        require_numbers("stribeck", self)
        require(self.rise >= 0, "stribeck.rise", self.rise, "at least 0")
        require(self.speed_mm_per_s > 0, "stribeck.speed_mm_per_s", self.speed_mm_per_s, "above 0")


@dataclass(frozen=True)
class PositionFriction:
    """Friction of all guides that varies along the stroke: times exp(growth x), x being the drive, mm."""

    growth_per_mm: float

    def __post_init__(self) -> None:
        require_numbers("position_friction", self)


@dataclass(frozen=True)
class RunIn:
    """Friction of all guides that decreases in the first cycles: times 1 + excess exp(-cycle/cycles)."""

    excess: float
    cycles: float

    def __post_init__(self) -> None:
        require_numbers("run_in", self)
        require(self.excess > -1, "run_in.excess", self.excess, "above -1")
        require(self.cycles > 0, "run_in.cycles", self.cycles, "above 0")


@dataclass(frozen=True)
class Creep:
    """Kelvin-Voigt creep of both tendons between wheel and base.

    With the time constant ``time_s`` the tendon stretches further, by ``fraction`` of (T - preload) L_free/EA. The load
    program needs times.
    """

    fraction: float
    time_s: float

    def __post_init__(self) -> None:
        require_numbers("creep", self)
        require(self.fraction >= 0, "creep.fraction", self.fraction, "at least 0")
        require(self.time_s > 0, "creep.time_s", self.time_s, "above 0")


@dataclass(frozen=True)
class Drag:
    """Viscous loss of either tendon between wheel and base, and of every joint.

    The drag on a tendon is ``sheath_N_s_per_mm`` times its speed past the base, the moment on a joint
    ``joint_Nmm_s_per_rad`` times its angular velocity. The load program needs times.
    """

    sheath_N_s_per_mm: float = 0.0
    joint_Nmm_s_per_rad: float = 0.0

    def __post_init__(self) -> None:
        require_numbers("drag", self)
        require(self.sheath_N_s_per_mm >= 0, "drag.sheath_N_s_per_mm", self.sheath_N_s_per_mm, "at least 0")
        require(self.joint_Nmm_s_per_rad >= 0, "drag.joint_Nmm_s_per_rad", self.joint_Nmm_s_per_rad, "at least 0")


@dataclass(frozen=True)
class PreloadLoss:
    """Preload lost over the cycles: T0 [1 - fraction (1 - exp(-cycle/cycles))], by tendons that get longer."""

    fraction: float
    cycles: float

    def __post_init__(self) -> None:
        require_numbers("preload_loss", self)
        require(0 <= self.fraction < 1, "preload_loss.fraction", self.fraction, "in [0, 1)")
        require(self.cycles > 0, "preload_loss.cycles", self.cycles, "above 0")


@dataclass(frozen=True)
class Fatigue:
    """Functional fatigue: with 1 - exp(-cycle/cycles) the material loop shrinks and every joint keeps a residual angle.

    ``loop_loss`` is the fraction of the slip moments of the Jenkins elements that is lost in the end, ``residual_deg``
    the residual angle of one joint.
    """

    loop_loss: float
    residual_deg: float
    cycles: float

    def __post_init__(self) -> None:
        require_numbers("fatigue", self)
        require(0 <= self.loop_loss <= 1, "fatigue.loop_loss", self.loop_loss, "in [0, 1]")
        require(self.cycles > 0, "fatigue.cycles", self.cycles, "above 0")


EFFECTS: dict[str, type] = {
    "slack": Slack,
    "backlash": Backlash,
    "eccentricity": Eccentricity,
    "superelastic": Superelastic,
    "closure": Closure,
    "gravity": Gravity,
    "tip_stop": TipStop,
    "creep": Creep,
    "drag": Drag,
    "preload_loss": PreloadLoss,
    "fatigue": Fatigue,
    "tip_load": TipLoad,
    "drive_gain": DriveGain,
    "stribeck": Stribeck,
    "position_friction": PositionFriction,
    "run_in": RunIn,
    "tip_mass": TipMass,
}
"""Optional effects of a rig, off by default, by the names of their tables."""
