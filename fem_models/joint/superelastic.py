"""Superelastic Nitinol of a measured joint: flag-shaped fibres of an assumed strip, as elements in the joint's angle.

A notched tube has a section, with a thrust: :mod:`fem_models.joint.superelastic_section`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.checks import require
from fem_models.rig.effects import Superelastic
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Material
from hysteresis.arrays import Floats

FIBRES = 8
"""Fibres from the neutral axis to either edge: the moment of a flexure is within 1 % of that of 400."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(FIBRES)
LEAST_PART = 1e-9
"""Least share of the total stiffness: smaller elements are rounding."""


@dataclass(frozen=True)
class FlagFibres:
    """Parallel flag elements of one joint; arrays of shape (k,).

    An element with the stiffness k (Nmm/rad) starts to transform when its moment reaches ``upper_Nmm`` and to transform
    back when it falls to ``lower_Nmm``. It is fully transformed when its rest angle has moved by ``span_rad``. On the
    plateau its moment rises by ``slope`` (Nmm/rad). The stiffnesses add up to the bending stiffness of the joint.
    """

    stiffness: Floats
    upper_Nmm: Floats
    lower_Nmm: Floats
    span_rad: Floats
    slope: Floats


def flag_fibres(rig: Rig) -> FlagFibres:
    """Fibres of a rig of measured joints; none where the rig is not superelastic, or has a section.

    A fibre at the distance y from the neutral axis has the strain y theta/L over the bending length L of the beam and
    contributes the moment sigma y dA, E y^2 dA/L per radian. The joint has the share of roots of its ``roots_share``,
    elastic in series with all fibres, and the section of :func:`_assumed_section`. Without a known section the thrust
    of the tendons is left out.

    Raises
    ------
    RigError
        A plateau as steep as the elastic law; a law that needs a section: other in compression, or self-heating.
    """
    law = rig.superelastic
    if isinstance(rig.joint, MeasuredJoint) and rig.joint.has_law:
        require(law is None, "superelastic", "given", "absent with a law of the joint, law_share of [bench]")
        return law_elements(rig.joint)
    if law is None or not isinstance(rig.joint, MeasuredJoint):
        none = np.empty(0)
        return FlagFibres(none, none, none, none, none)
    require_plateau(law, rig.material)
    for name, without in (("compression_factor", 1.0), ("heating_time_s", None)):
        value = getattr(law, name)
        require(value == without, f"superelastic.{name}", value, f"{without}: measured joints have no section")
    young_GPa, bending = rig.material.youngs_modulus_GPa, rig.joint.flexure_stiffness_Nmm_per_rad
    elastic = bending / (1 - rig.joint.roots_share)
    fibres = _fibres(law, young_GPa, *_assumed_section(rig, elastic / (young_GPa * 1e3)))
    return _with_roots(fibres, bending, elastic)


def law_elements(joint: MeasuredJoint) -> FlagFibres:
    """Flag elements of the moment-angle law of a measured joint."""
    stiffness = joint.flexure_stiffness_Nmm_per_rad * np.array(joint.law_share)
    upper = stiffness * np.radians(joint.law_onset_deg)
    span = np.radians(joint.law_span_deg)
    return FlagFibres(stiffness, upper, upper * np.array(joint.law_return), span, np.zeros_like(stiffness))


def require_plateau(law: Superelastic, material: Material) -> None:
    """Check that the plateau of a law is less steep than its elastic part.

    Raises
    ------
    RigError
        If it is not.
    """
    require(
        law.plateau_modulus_GPa < material.youngs_modulus_GPa,
        "superelastic.plateau_modulus_GPa",
        law.plateau_modulus_GPa,
        f"below material.youngs_modulus_GPa = {material.youngs_modulus_GPa:g}",
    )


def _fibres(law: Superelastic, young_GPa: float, y: Floats, area: Floats, length: float) -> FlagFibres:
    """Fibres at the distances y (mm) with areas (mm^2), shapes (k,), that bend over a length (mm)."""
    young = young_GPa * 1e3
    stiffness = young * y**2 * area / length
    return FlagFibres(
        stiffness=stiffness,
        upper_Nmm=stiffness * (law.plateau_MPa + law.shift_MPa) / young * length / y,
        lower_Nmm=stiffness * (law.unloading_plateau_MPa + law.shift_MPa) / young * length / y,
        span_rad=law.transformation_strain * length / y,
        slope=stiffness * law.plateau_modulus_GPa / young_GPa,
    )


def _with_roots(fibres: FlagFibres, bending: float, elastic: float) -> FlagFibres:
    """Fibres of the stiffness ``elastic`` with roots in series that leave ``bending`` of it, Nmm/rad."""
    roots = 1 / bending - 1 / elastic
    return in_series(fibres, 1 / roots) if roots > 0 else fibres


def _assumed_section(rig: Rig, second_moment_per_length_mm3: float) -> tuple[Floats, Floats, float]:
    """Fibres of a measured joint, whose section is not known: a strip half as high as the distance of the tendons.

    It bends over the whole pitch. Stresses of such a joint are those of this strip, not of the metal.
    """
    y = 0.25 * rig.tendon_a.moment_arm_mm * (1 + _NODES)
    area = _WEIGHTS * second_moment_per_length_mm3 * rig.pitch_mm / float((y**2 * _WEIGHTS).sum())
    return y, area, rig.pitch_mm


def in_series(fibres: FlagFibres, root_Nmm_per_rad: float) -> FlagFibres:
    """Elements that together bend as the given ones in series with a spring, and may again stand in parallel.

    A sum of flag elements loads along straight segments, from one event to the next: an element enters its plateau, or
    leaves it fully transformed. The spring makes each segment longer and softer, K' = K k/(K + k). The step of K' at
    which an element enters its plateau therefore differs from the step at which it leaves, because others are on their
    plateau by then. Parts of elements have equal steps: what the first to enter takes from the stiffness, the first to
    leave returns. Loading is exact, with up to 2k - 1 elements. In unloading the plateaus keep their ratio, which is
    exact for elements of one ratio as long as none was fully transformed, and else within 3 % of the largest moment.
    """
    k, climb, upper, lower, span = (
        fibres.stiffness, fibres.slope, fibres.upper_Nmm, fibres.lower_Nmm, fibres.span_rad
    )  # fmt: skip

    def softer(stiffness: Floats) -> Floats:
        return stiffness * root_Nmm_per_rad / (stiffness + root_Nmm_per_rad)

    def in_total(angle: Floats) -> Floats:  # angle with that of the spring, in loading
        on_plateau = climb * angle[:, None] + (1 - climb / k) * upper
        full = k * (angle[:, None] - span)
        moment = np.maximum(np.minimum(k * angle[:, None], on_plateau), full).sum(axis=1)
        return angle + moment / root_Nmm_per_rad

    starts, ends = upper / k, ((1 - climb / k) * upper + k * span) / (k - climb)
    angles, changes = np.concatenate([starts, ends]), np.concatenate([climb - k, k - climb])
    order = np.argsort(angles, kind="stable")
    entering = order < k.size
    tangent = np.maximum(k.sum() + np.cumsum([0.0, *changes[order]]), 0.0)
    steps = np.diff(softer(tangent))
    taken, given = np.cumsum(-steps[entering]), np.cumsum(steps[~entering])

    edges = np.concatenate([[0.0], np.sort(np.concatenate([taken, given]))])
    amount = np.diff(edges)
    kept = (amount > LEAST_PART * softer(k.sum())) | (amount == amount.max())
    amount, middle = amount[kept], (0.5 * (edges[:-1] + edges[1:]))[kept]
    last = k.size - 1  # rounding may put a middle beyond the last part
    first = order[entering][np.minimum(np.searchsorted(taken, middle), last)]
    start = in_total(starts[first])
    end = in_total(ends[order[~entering] - k.size])[np.minimum(np.searchsorted(given, middle), last)]
    slope = amount * max(float(softer(tangent[:1])[0] - taken[-1]), 0.0) / amount.sum()
    stiffness = amount + slope
    return FlagFibres(
        stiffness=stiffness,
        upper_Nmm=stiffness * start,
        lower_Nmm=stiffness * start * (lower / upper)[first],
        span_rad=end - (slope * end + amount * start) / stiffness,
        slope=slope,
    )


def flag_moment(angle_rad: Floats, rest_rad: Floats, fibres: FlagFibres) -> Floats:
    """Moment of flag elements at their angles, Nmm; all shapes (k,).

    The elastic line from the rest angle, bounded by the loading branch (up to the plateau, along it, and beyond the
    span of the transformation) and the unloading branch, symmetric in the angle.
    """
    k, s, u = fibres.stiffness, fibres.slope, np.abs(angle_rad)
    sign = np.where(angle_rad < 0, -1.0, 1.0)
    full = k * (u - fibres.span_rad)
    low = np.maximum(np.minimum(k * u, s * u + (1 - s / k) * fibres.lower_Nmm), full)
    high = np.maximum(np.minimum(k * u, s * u + (1 - s / k) * fibres.upper_Nmm), full)
    return sign * np.clip(sign * k * (angle_rad - rest_rad), low, high)
