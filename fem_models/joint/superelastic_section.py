"""Superelastic section of a notch: fibres that share a curvature and an axial strain, in series with elastic roots.

The tendons press the rings together with the thrust N, the sum of their tensions. A fibre at the distance y from the
neutral axis, towards tendon a, has the strain (g - y phi)/L: phi is the bending of the section over its length L, g
its elongation. Thrust and moment are the integrals of the stress,

    N = -int stress dA        M = -int stress y dA        angle of the joint = phi + M/k_roots

so that the neutral axis moves with the load. The stress of each fibre follows the flag of
:func:`fem_models.joint.superelastic.flag_moment`, in tension and in compression, with its own history. The plateaus of
compression may be higher.

A section that heats itself has one temperature, T above the surroundings. The transformed strain z of its fibres sets
heat free, and all plateaus rise by b T (He and Sun 2011, doi 10.1016/j.ijsolstr.2011.02.017; one mass):

    dT/dt = (heat) d(int |z| dA)/dt - T/time

Engines solve for T at the end of each step together with the load, so that the plateau a step ends on is the one that
its heat leaves. Over a step of the length h the exchange of heat is exact for a transformation at a constant rate
(:func:`heat_exchange`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fem_models.joint.flexure import beam_of_notch, elasticity, flexure_of_notch
from fem_models.joint.section import section_fibres
from fem_models.joint.superelastic import FlagFibres, flag_moment, require_plateau
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Superelastic
from fem_models.rig.joints import NotchedTube
from fem_models.rig.rig import Material
from hysteresis.arrays import Floats

_ITERATIONS, _SHORTER_STEPS = 100, 60
_ROUNDING, _SMALL = 1e-12, 1e-9  # the latter a strain


class Heating(NamedTuple):
    """Self-heating of a section.

    ``heat`` is the temperature that the integral of the transformed strain over all fibres (mm^2) brings, K/mm^2, with
    no exchange of heat; ``rise`` what a plateau rises by, MPa/K; ``time_s`` the time constant of the exchange.
    """

    heat: float
    rise: float
    time_s: float


@dataclass(frozen=True)
class SuperelasticSection:
    """Fibres of one joint between its elastic parts; mm, N, MPa, rad.

    Parameters
    ----------
    height_mm
        Distances from the neutral axis away from tendon a, -y, shape (k,): positive bending stretches the upper ones.
    area_mm2
        Areas of the fibres, shape (k,), without the share of a Jenkins loop.
    length_mm
        Length over which the section bends: E I of the root over the beam's bending stiffness.
    root_compliance
        Of the roots in the rings, rad/Nmm: they stay elastic. 0 for rigid roots.
    axial_compliance
        Axial compliance in series that is not that of the section over its length, mm/N: a V is wider beside its root.
    elastic_N_per_mm
        Axial stiffness of the share of the metal that belongs to a Jenkins loop, which slips in bending only.
    young, climb
        Modulus, and slope of the plateaus.
    upper, lower
        Stresses at which the transformation starts, and at which it starts to return, in tension.
    upper_pressed, lower_pressed
        The same in compression.
    span
        Strain of the transformation.
    heating
        What the section needs to heat itself; None where it keeps the temperature of its surroundings.
    """

    height_mm: Floats
    area_mm2: Floats
    length_mm: float
    root_compliance: float
    axial_compliance: float
    elastic_N_per_mm: float
    young: float
    upper: float
    lower: float
    upper_pressed: float
    lower_pressed: float
    climb: float
    span: float
    heating: Heating | None


@dataclass(frozen=True)
class SectionPath:
    """What a section does along a path; arrays of shape (m,).

    ``tangent`` is dM/d(angle) at a constant thrust. ``loss_mJ`` is the work of transformation so far.
    """

    moment_Nmm: Floats
    tangent: Floats
    elongation_mm: Floats
    loss_mJ: Floats


def superelastic_section(rig: Rig) -> SuperelasticSection | None:
    """Section of a rig's joints; None without a superelastic law, and for measured joints, which have no section.

    Raises
    ------
    RigError
        A plateau as steep as the elastic law.
    """
    law = rig.superelastic
    if law is None or not isinstance(rig.joint, NotchedTube):
        return None
    require_plateau(law, rig.material)
    return _section(rig.joint, rig.material, law)


@lru_cache(maxsize=1024)
def _section(joint: NotchedTube, material: Material, law: Superelastic) -> SuperelasticSection:
    metal, loop_share = elasticity(material), material.loop_share
    between, whole = beam_of_notch(joint, metal), flexure_of_notch(joint, metal)
    y, area = section_fibres(joint, law.fibres_per_side)
    length = metal.young * float((y**2 * area).sum()) / between.bending_Nmm_per_rad
    axial, share, pressed = metal.young * float(area.sum()) / length, 1 - loop_share, law.compression_factor
    assert between.axial_N_per_mm is not None
    return SuperelasticSection(
        height_mm=-y,
        area_mm2=share * area,
        length_mm=length,
        root_compliance=max(1 / whole.bending_Nmm_per_rad - 1 / between.bending_Nmm_per_rad, 0.0) / share,
        axial_compliance=max(1 / between.axial_N_per_mm - 1 / axial, 0.0),
        elastic_N_per_mm=loop_share * axial,
        young=metal.young,
        upper=law.plateau_MPa + law.shift_MPa,
        lower=law.unloading_plateau_MPa + law.shift_MPa,
        upper_pressed=pressed * law.plateau_MPa + law.shift_MPa,
        lower_pressed=pressed * law.unloading_plateau_MPa + law.shift_MPa,
        climb=1e3 * law.plateau_modulus_GPa,
        span=law.transformation_strain,
        heating=_heating(law, float(area.sum())),
    )


def _heating(law: Superelastic, area_mm2: float) -> Heating | None:
    """Self-heating of a section of an area, the share of a Jenkins loop included: it takes up heat."""
    if law.heating_time_s is None:
        return None
    heat = law.complete_heating_K / (law.transformation_strain * area_mm2)
    return Heating(heat, law.clausius_clapeyron_MPa_per_K, law.heating_time_s)


def heat_exchange(time_s: float, constant_s: float) -> tuple[float, float]:
    """Parts of the temperature before a step, and of the heat set free in it, that are there at its end.

    dT/dt = heat/time_s - T/constant_s, solved for a constant rate of heat. No time is a slow step: none is left.
    """
    if time_s == 0:
        return 0.0, 0.0
    h = time_s / constant_s
    return math.exp(-h), -math.expm1(-h) / h


def require_warm(rig: Rig, section: SuperelasticSection | None, warming_K: Floats) -> None:
    """Check that no unloading plateau has fallen to 0 in a run; temperatures above the surroundings, shape (m, N).

    Raises
    ------
    SolverError
        A section that has cooled so far that its metal would stay martensite.
    """
    if section is None or section.heating is None or warming_K.size == 0:
        return
    coldest, joint = float(warming_K.min()), 1 + int(warming_K.min(axis=0).argmin())
    if section.heating.rise * coldest <= -min(section.lower, section.lower_pressed):
        raise SolverError(
            f"rig {rig.name}: joint {joint} cools by {-coldest:.3g} K, and its unloading plateau falls to 0: "
            "expected a higher unloading plateau, a smaller latent heat or a shorter heating_time_s"
        )


def elongation_under_mm(section: SuperelasticSection, thrust_N: float) -> float:
    """Elongation of a straight, virgin section under a thrust, mm: below 0 where it is pressed together.

    Raises
    ------
    SolverError
        As :func:`section_path`.
    """
    area, young, length = float(section.area_mm2.sum()), section.young, section.length_mm
    elastic = -thrust_N / (young * area / length + section.elastic_N_per_mm)
    if -elastic / length * young <= section.upper_pressed:
        return elastic
    return float(section_path(section, 0.0, thrust_N).elongation_mm[0])


def section_path(section: SuperelasticSection, angle_rad: ArrayLike, thrust_N: ArrayLike) -> SectionPath:
    """Bend a virgin section along a path of angles under thrusts, slowly; both broadcast to shape (m,).

    It keeps the temperature of its surroundings. The angle is that of the joint, roots included. Newton's method on
    angle and elongation of the section.

    Raises
    ------
    SolverError
        A thrust that the section does not carry: a flat plateau has no equilibrium beyond its stress.
    """
    angle, thrust = np.broadcast_arrays(np.atleast_1d(angle_rad).astype(float), np.asarray(thrust_N, dtype=float))
    rest, bent, elongation, loss = np.zeros(section.area_mm2.size), 0.0, 0.0, 0.0
    rows = []
    for goal, push in zip(angle, thrust, strict=True):
        bent, elongation, moment, tangent = _equilibrium(section, rest, (bent, elongation), (goal, push))
        strain = (elongation + section.height_mm * bent) / section.length_mm
        stress = fibre_stress(section, strain, rest)
        moved = strain - stress / section.young
        loss += transformation_loss_mJ(section, stress, moved, rest)
        rest = moved
        rows.append((moment, tangent, elongation, loss))
    return SectionPath(*np.array(rows).T)


def fibre_stress(section: SuperelasticSection, strain: Floats, rest: Floats, shift_MPa: ArrayLike = 0.0) -> Floats:
    """Stress of the fibres at strains, with their rest strains, MPa; shapes (k,) or (k, N).

    ``shift_MPa`` raises all plateaus, shape () or (N,).
    """
    one, pressed, shift = np.ones_like(strain), strain < 0, np.asarray(shift_MPa, dtype=float)
    upper = shift + np.where(pressed, section.upper_pressed, section.upper)
    lower = shift + np.where(pressed, section.lower_pressed, section.lower)
    law = FlagFibres(section.young * one, upper, lower, section.span * one, section.climb * one)
    return flag_moment(strain, rest, law)


def transformation_loss_mJ(
    section: SuperelasticSection,
    stress: Floats,
    after: Floats,
    before: Floats,
    risen_MPa: ArrayLike = 0.0,
    volume_mm3: Floats | None = None,
) -> float:
    """Work of moving rest strains to where the fibres have a stress; shapes (k,) or (k, N).

    Rest strains move on plateaus only, along which the stress rises in proportion to them, and by ``risen_MPa``, shape
    () or (N,), with the temperature: the mean counts. ``volume_mm3``, shape (k, N), is that of the fibres of joints
    that differ.
    """
    climb = section.climb / (1 - section.climb / section.young)
    work = (stress - 0.5 * (climb * (after - before) + np.sign(stress) * risen_MPa)) * (after - before)
    if volume_mm3 is not None:
        return float((volume_mm3 * work).sum())
    return section.length_mm * float((section.area_mm2 @ work).sum())


def _equilibrium(
    section: SuperelasticSection, rest: Floats, start: tuple[float, float], load: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Bending and elongation of the section under (angle, thrust); with the moment and its tangent.

    The potential is convex: a step of Newton's method that leads beyond its least value is shortened.
    """
    (bent, elongation), root = start, section.root_compliance
    to_moment = 1 / root if root > 0 else 0.0
    bent = bent if root > 0 else load[0]
    at = _balance(section, rest, (bent, elongation), load)
    for _ in range(_ITERATIONS):
        off_angle, off_thrust, moment, (kpp, kpm, kmm) = at
        determinant = (1 + root * kmm) * kpp - root * kpm**2
        if abs(off_angle) < _ROUNDING and abs(off_thrust) < _ROUNDING * section.upper * float(section.area_mm2.sum()):
            return bent, elongation, moment, (kmm * kpp - kpm**2) / determinant
        turn = -(kpp * off_angle - root * kpm * off_thrust) / determinant
        reach = -((1 + root * kmm) * off_thrust - kpm * off_angle) / determinant
        downhill, part = off_angle * to_moment * turn + off_thrust * reach, 1.0
        for _ in range(_SHORTER_STEPS):
            at = _balance(section, rest, (bent + part * turn, elongation + part * reach), load)
            slope = at[0] * to_moment * turn + at[1] * reach
            if slope <= -0.5 * downhill:
                break
            part *= min(max(downhill / (downhill - slope), 0.1), 0.9)
        bent, elongation = bent + part * turn, elongation + part * reach
    raise SolverError(f"section under a thrust of {load[1]:g} N at {np.degrees(load[0]):g} deg: no equilibrium")


def _balance(
    section: SuperelasticSection, rest: Floats, at: tuple[float, float], load: tuple[float, float]
) -> tuple[float, float, float, tuple[float, float, float]]:
    """How far angle and thrust are from a load; moment; slopes of the pull in both, and of the moment in bending."""
    (bent, elongation), height, area, length = at, section.height_mm, section.area_mm2, section.length_mm
    strain = (elongation + height * bent) / length
    stress = fibre_stress(section, strain, rest)
    slope = area / length * (fibre_stress(section, strain + _SMALL, rest) - stress) / _SMALL
    pull, moment = float(area @ stress) + section.elastic_N_per_mm * elongation, float(area * stress @ height)
    least = 1e-6 * section.young * float(area.sum()) / length  # of a flat plateau throughout
    slopes = (
        float(slope.sum()) + section.elastic_N_per_mm + least,
        float(slope @ height),
        float(slope * height @ height),
    )
    return bent + section.root_compliance * moment - load[0], pull + load[1], moment, slopes
