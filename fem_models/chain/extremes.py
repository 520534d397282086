"""Extremes of a run, compiled: what studies take of it, in one pass over its samples and without arrays of its size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_models.chain.compiled import chain_njit
from fem_models.chain.follow import Run
from fem_models.joint import JointRow
from fem_models.joint.strain import EQUAL
from hysteresis.arrays import Floats


@dataclass(frozen=True)
class RunExtremes:
    """Bending at the tip, rad, shape (m,), and the ends of what else a run has.

    Tensions are those anywhere along the tendons, N; ``steepest_rad`` is the largest angle of a joint, in either
    direction. The strains are those of :func:`fem_models.joint.strain.largest_strains`, NaN of joints whose section is
    not known.
    """

    tip_rad: Floats
    steepest_rad: float
    tension_min_N: float
    tension_max_N: float
    peak_strain: float
    alternating_strain: float


def extremes_of_run(joints: JointRow, run: Run, tendons: int) -> RunExtremes:
    """Find the extremes of a run of so many tendons: those of its arrays, to the last bit."""
    one, tip = joints.first, np.empty(len(run.angles))
    each = joints.each[:1] if joints.alike else joints.each
    fibres = np.array([joint.outer_fibres_per_rad for joint in each])
    mean = np.array([joint.section.length_mm if joint.section else joint.axial_strain_per_N for joint in each])
    by_thrust = one.section is None
    return RunExtremes(tip, *_extremes(run, tendons, fibres, mean, one.rest_angle_rad, by_thrust, tip))


@chain_njit(allocates=True)  # called from Python
def _extremes(
    run: Run, tendons: int, fibres: Floats, mean: Floats, rest: float, by_thrust: bool, tip: Floats
) -> tuple[float, float, float, float, float]:
    """Fill the bending at the tip, and find the other fields of :class:`RunExtremes`.

    ``fibres``, shape (N, 2) or (1, 2) of equal joints, are the strains of both outer fibres per radian; ``mean``, shape
    (N,) or (1,), makes the mean strain of the thrust, or of the elongation, as
    :func:`fem_models.joint.strain.peak_strain` has it.
    """
    angles, tensions, joints = run.angles, run.tensions, run.angles.shape[1]
    ends = np.zeros((4, joints))  # of both fibres: the lowest and the highest strain, each also that of rest
    steepest, low, high = 0.0, np.inf, -np.inf
    for k in range(angles.shape[0]):
        bent = 0.0
        for i in range(joints):
            angle, j = angles[k, i], min(i, mean.size - 1)
            bent += angle
            steepest = max(steepest, abs(angle))
            turned = angle - rest
            if by_thrust:
                pressed = (tensions[k, 0, i + 1] + tensions[k, 1, i + 1]) * mean[j]
            else:
                pressed = -run.longer[k, i] / mean[j]
            near, far = fibres[j, 0] * turned + pressed, fibres[j, 1] * turned - pressed
            ends[0, i], ends[1, i] = min(ends[0, i], near), max(ends[1, i], near)
            ends[2, i], ends[3, i] = min(ends[2, i], far), max(ends[3, i], far)
        tip[k] = bent
        for side in range(tendons):
            for i in range(joints + 1):
                low, high = min(low, tensions[k, side, i]), max(high, tensions[k, side, i])
    peak = alternating = 0.0
    for i in range(joints):
        fibre = 0 if (1.0 + EQUAL) * max(ends[1, i], -ends[0, i]) >= max(ends[3, i], -ends[2, i]) else 2
        bottom, top = ends[fibre, i], ends[fibre + 1, i]
        peak, alternating = max(peak, top, -bottom), max(alternating, 0.5 * (top - bottom))
    if not np.isfinite(fibres).all():
        peak = alternating = np.nan
    return steepest, low, high, peak, alternating
