"""Strain of the flexures under load, and the strain limits that it exceeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fem_models.joint.mechanics import JointMechanics
from fem_models.joint.row import JointRow, joint_row
from fem_models.rig import Rig, RigError
from fem_models.rig.joints import MeasuredJoint
from hysteresis.arrays import Floats
from hysteresis.records.record import Record


@dataclass(frozen=True)
class StrainLimit:
    """A strain below which Nitinol should stay, and its source.

    ``kind``: ``peak`` limits the largest strain so far, in either direction; ``alternating`` limits half the range of a
    fibre's strain so far, which is the strain amplitude if the load is cycled over that range.
    """

    name: str
    strain: float
    kind: Literal["peak", "alternating"]
    source: str


@dataclass(frozen=True)
class Passed:
    """First load at which a limit is exceeded, interpolated between samples; None if it is not.

    ``joint`` counts from 1 at the base. ``largest`` is the largest strain of the limit's kind in the whole run.
    """

    limit: StrainLimit
    drive: float | None
    joint: int | None
    largest: float


EQUAL = 1e-3
"""Relative difference of two strains up to which neither is the larger one: a symmetric run strains both equally."""

FATIGUE = StrainLimit(
    "fatigue at 10^7 cycles",
    0.004,
    "alternating",
    "Pelton et al., J. Mech. Behav. Biomed. Mater. 1, 2008, 153-164, doi 10.1016/j.jmbbm.2007.06.003",
)
TRANSFORMATION = StrainLimit(
    "start of the plateau", 0.01, "peak", "usual for superelastic Nitinol; of a superelastic rig its own plateau over E"
)
SUPERELASTIC = StrainLimit(
    "strain to which superelasticity is tested", 0.06, "peak", "ASTM F2516: wire is loaded to 6 % and unloaded"
)


def strain_limits(rig: Rig) -> tuple[StrainLimit, ...]:
    """Limits of a rig's Nitinol, the lowest first; a superelastic rig has the plateau of its own law."""
    law, start = rig.superelastic, TRANSFORMATION
    if law is not None:
        young = 1e3 * rig.material.youngs_modulus_GPa
        start = StrainLimit(start.name, law.start_MPa / young, "peak", f"plateau_MPa over E of rig {rig.name}")
    return FATIGUE, start, SUPERELASTIC


def peak_strain(
    joint: JointMechanics | JointRow,
    joint_angles_rad: ArrayLike,
    elongation_mm: Floats | None = None,
    *,
    thrust_N: Floats | None = None,
) -> Floats:
    """Strain of the outermost fibre at the root of every notch, the shape of the angles.

    Of a row of joints the last axis of the angles has one a joint.

    Plane sections: the distance from the neutral axis times the angle from rest over the bending length, whatever the
    law of the stress (:attr:`fem_models.joint.mechanics.JointMechanics.peak_strain_per_rad`). The sign is that of the
    bending from rest. NaN for measured joints, whose section is not known.

    ``elongation_mm``, of superelastic sections, or ``thrust_N`` of linear notches (:func:`thrust_N`), both of shape
    (m, N), add the strain of the tendons' thrust: N/(E A) of the root. Of the two outer fibres of a joint it is then
    the one that the whole run strains more, on the side of tendon a if both are equal, and keeps the sign of the
    bending.
    """
    row = joint if isinstance(joint, JointRow) and not joint.alike else None
    one = joint.first if isinstance(joint, JointRow) else joint
    turned = np.asarray(joint_angles_rad, dtype=float) - one.rest_angle_rad
    if elongation_mm is not None and one.section is not None:
        mean = elongation_mm / (one.section.length_mm if row is None else row.of("section.length_mm"))
    elif thrust_N is not None and one.section is None:
        mean = -thrust_N * (one.axial_strain_per_N if row is None else row.of("axial_strain_per_N"))
    else:
        return turned * (one.peak_strain_per_rad if row is None else row.of("peak_strain_per_rad"))
    sides = one.outer_fibres_per_rad if row is None else row.of("outer_fibres_per_rad").T
    near, far = (side * turned + sign * mean for side, sign in zip(sides, (-1, 1), strict=True))
    return np.where((1 + EQUAL) * np.abs(near).max(axis=0) >= np.abs(far).max(axis=0), near, far)


def thrust_N(tensions_N: Floats) -> Floats:
    """Thrust on every joint, shape (m, N), from tensions of the segments of all tendons, shape (m, tendons, N + 1).

    The first segment ends at the base, the others cross a joint each.
    """
    return np.asarray(tensions_N[:, :, 1:].sum(axis=1))


def thrust_of_record_N(record: Record) -> Floats | None:
    """Thrust by the tensions at the wheel, shape (m, 1): what is lost to friction up to a joint counts as thrust there.

    None of a record without tensions.
    """
    tensions = [one for one in (record.tension_a_N, record.tension_b_N) if one is not None]
    return np.sum(tensions, axis=0)[:, None] if tensions else None


def strain_per_rad(rig: Rig) -> float:
    """Strain of the outermost fibre per radian of one joint, linear elastic.

    Of measured joints it is that of the strip whose fibres :func:`fem_models.joint.superelastic.flag_fibres` assumes;
    of notches that differ it is the largest.
    """
    if isinstance(rig.joint, MeasuredJoint):
        return 0.5 * rig.tendon_a.moment_arm_mm / rig.pitch_mm
    return max(joint.peak_strain_per_rad for joint in joint_row(rig).each)


def limits_passed(drive: ArrayLike, strain: ArrayLike, limits: tuple[StrainLimit, ...]) -> tuple[Passed, ...]:
    """Find where a run exceeds its limits.

    Parameters
    ----------
    drive
        Shape (m,): drives (mm) or forces (N) in the order of the run, from rest.
    strain
        Shape (m, N), of :func:`peak_strain`. The run starts from zero strain, which need not be a sample.

    Raises
    ------
    RigError
        Shapes that do not match, or strains that are not known.
    """
    x, e = np.asarray(drive, dtype=float), np.asarray(strain, dtype=float)
    if x.ndim != 1 or e.ndim != 2 or len(e) != x.size or x.size == 0:
        raise RigError(f"strain of shape {e.shape} at drives of shape {x.shape}: expected (m, N) and (m,)")
    if not np.isfinite(e).all():
        raise RigError("strain: not known: expected a rig with [tube] and [notch]")
    top, low = np.maximum.accumulate(np.maximum(e, 0.0)), np.minimum.accumulate(np.minimum(e, 0.0))
    measures = {"peak": np.maximum(top, -low), "alternating": 0.5 * (top - low)}
    return tuple(_first(x, measures[limit.kind], limit) for limit in limits)


def largest_strains(strain: Floats) -> dict[str, float]:
    """Give the largest strain of a whole run by kind of limit: ``largest`` of :func:`limits_passed`, to the last bit.

    ``strain`` has shape (m, N), as there.
    """
    top, low = np.maximum(strain.max(axis=0), 0.0), np.minimum(strain.min(axis=0), 0.0)
    return {"peak": float(np.maximum(top, -low).max()), "alternating": float((0.5 * (top - low)).max())}


def _first(drive: Floats, measure: Floats, limit: StrainLimit) -> Passed:
    worst = measure.max(axis=1)
    past = np.flatnonzero(worst > limit.strain)
    if not past.size:
        return Passed(limit, None, None, float(worst[-1]))
    k = int(past[0])
    at = float(drive[k])
    if k > 0:
        part = (limit.strain - worst[k - 1]) / (worst[k] - worst[k - 1])
        at = float(drive[k - 1] + part * (drive[k] - drive[k - 1]))
    return Passed(limit, at, int(measure[k].argmax()) + 1, float(worst[-1]))
