"""Size of an injected effect relative to the noise, and the size that gives a wanted ratio.

The size is what the effect adds to the angle beyond what the parameters of the baseline model can absorb, to first
order: root mean square over the four records, over the noise.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.joints import MeasuredJoint
from hysteresis.arrays import Floats
from validation.practice.injected import Family, Injected, observed
from validation.practice.protocols import BaselineRuns, Kind, Loading, Protocol

MODERATE = (3.0, 8.0)
"""Range of the size of an injected effect over the noise."""
TOLERANCE = 0.1
"""Relative deviation of a size from its target."""
_STEP = 0.02  # relative, for the derivatives of the baseline model
_CURVE_DEGREE = 7  # of the polynomial that stands for f(x) if the geometry is unknown
_TRIALS = 14


class OutOfReachError(Exception):
    """An effect that has no moderate size within its bounds."""


def baseline_tangent(baseline: BaselineRuns, kind: Kind = "known") -> Floats:
    """Differentiate the angle by the parameters of the baseline model: shape (samples of all records, k).

    The parameters are sheath and capstan friction, the give of guides that stick, share and slip angle of the material
    loop, the stiffness of both tendons, and one zero per record. For a rig of ``unknown`` geometry so are those of the
    equivalent rig (:mod:`validation.tracing.baseline.equivalent_rig`): moment arm, free length, toe region, friction of
    the guides, stiffness of the flexures, and a cubic between drive and wheel.
    """
    angle = np.concatenate([run.record.angle_deg for run in baseline.runs])
    columns = [np.concatenate(observed(changed, ())) - angle for changed in _neighbours(baseline, kind)]
    zeros = np.repeat(np.eye(len(baseline.runs)), [run.record.angle_deg.size for run in baseline.runs], axis=0)
    return np.column_stack([*columns, zeros])


def _neighbours(baseline: BaselineRuns, kind: Kind) -> list[Protocol]:
    """Protocols with one parameter of the baseline model a little larger each."""
    up, protocol = 1 + _STEP, baseline.protocol
    rig = protocol.rig
    dry, nitinol, (a, b) = rig.friction, rig.material, rig.tendons
    soft = 0.1 * rig.mean_pitch_mm / a.EA_N  # a tenth of what a pitch of tendon gives
    rigs = [
        replace(rig, friction=replace(dry, sheath_N=up * dry.sheath_N)),
        replace(rig, friction=replace(dry, capstan_coefficient=up * dry.capstan_coefficient)),
        replace(rig, friction=replace(dry, stick_compliance_mm_per_N=dry.stick_compliance_mm_per_N + soft)),
        replace(rig, material=replace(nitinol, loop_share=up * nitinol.loop_share)),
        replace(rig, material=replace(nitinol, loop_angle_deg=up * nitinol.loop_angle_deg)),
        replace(rig, tendon_a=replace(a, EA_N=up * a.EA_N), tendon_b=replace(b, EA_N=up * b.EA_N)),
    ]
    if kind == "known":
        return [replace(protocol, rig=changed) for changed in rigs]
    wider = [
        (replace(a, moment_arm_mm=up * a.moment_arm_mm), replace(b, moment_arm_mm=up * b.moment_arm_mm)),
        (replace(a, free_length_mm=up * a.free_length_mm), replace(b, free_length_mm=up * b.free_length_mm)),
        (replace(a, toe_N=a.toe_N + _STEP * rig.preload_N), replace(b, toe_N=b.toe_N + _STEP * rig.preload_N)),
    ]
    rigs += [replace(rig, tendon_a=one, tendon_b=other) for one, other in wider]
    rigs.append(replace(rig, friction=replace(dry, guide_N=dry.guide_N + _STEP * rig.preload_N / rig.joints)))
    rigs.append(_stiffer(rig, up))
    driven = [_driven(protocol, baseline.full_mm, power) for power in (1, 2)]
    return [*(replace(protocol, rig=changed) for changed in rigs), *driven]


def _stiffer(rig: Rig, factor: float) -> Rig:
    """Rig whose flexures are stiffer."""
    joint = rig.joint
    if isinstance(joint, MeasuredJoint):
        stiff = factor * joint.flexure_stiffness_Nmm_per_rad
        return replace(rig, joint=replace(joint, flexure_stiffness_Nmm_per_rad=stiff))
    modulus = factor * rig.material.youngs_modulus_GPa
    return replace(rig, material=replace(rig.material, youngs_modulus_GPa=modulus))


def _driven(protocol: Protocol, full_mm: float, power: int) -> Protocol:
    """Protocol whose wheel winds in a little more where the drive is large, by a power of it over the largest."""

    def bent(loading: Loading) -> Loading:
        drive = loading.program.drive_mm
        more = _STEP * (drive / full_mm) ** power
        return replace(loading, program=replace(loading.program, drive_mm=drive * (1.0 + more)))

    return replace(protocol, loadings=tuple(map(bent, protocol.loadings)))


def curve_columns(baseline: BaselineRuns) -> Floats:
    """Columns of a smooth f(x) that all records share: shape (samples of all records, degree)."""
    drive = np.concatenate([loading.program.drive_mm for loading in baseline.protocol.loadings])
    return np.asarray(np.polynomial.chebyshev.chebvander(drive / baseline.full_mm, _CURVE_DEGREE)[:, 1:])


def size_over_noise(baseline: BaselineRuns, injected: Injected, absorbed: Floats) -> float:
    """RMS over the noise of what an effect adds to the angle beyond the span of the columns ``absorbed``."""
    added = np.concatenate(observed(baseline.protocol, [injected]))
    added -= np.concatenate([run.record.angle_deg for run in baseline.runs])
    fit, *_ = np.linalg.lstsq(absorbed, added, rcond=None)
    return float(np.sqrt(np.mean((added - absorbed @ fit) ** 2)) / baseline.protocol.noise_deg)


def solve_size(
    baseline: BaselineRuns, family: Family, absorbed: Floats, target: float, *, exact: bool = False
) -> tuple[Injected, float]:
    """Find an effect with a size near the target, by secants of the logarithms in a bracket; return its size, too.

    If the bounds of the effect do not reach the target, its largest or least size is taken if that is moderate, unless
    the target is to be met (``exact``).

    Raises
    ------
    OutOfReachError
        No such size between the bounds of the effect.
    """
    low, high = family.least, 1.0
    at_low = at_high = math.nan
    size = max(0.1, 2 * family.least)
    for _ in range(_TRIALS):
        injected = family.at(size)
        try:
            ratio = size_over_noise(baseline, injected, absorbed)
        except SolverError:
            ratio = math.inf
        at_bound = (ratio > target and size <= family.least) or (ratio < target and size >= 1.0)
        moderate = not exact and MODERATE[0] <= ratio <= MODERATE[1]
        if abs(ratio / target - 1) < TOLERANCE or (at_bound and moderate):
            return injected, ratio
        if at_bound:
            break
        if ratio > target:
            high, at_high = size, ratio
        else:
            low, at_low = size, ratio
        size = _next_size((low, high), (at_low, at_high), size, ratio / target, target)
    raise OutOfReachError


def _next_size(
    bracket: tuple[float, float], ratios: tuple[float, float], size: float, over_target: float, target: float
) -> float:
    (low, high), (at_low, at_high) = bracket, ratios
    if math.isfinite(at_low) and math.isfinite(at_high) and 0 < at_low < at_high:
        part = math.log(target / at_low) / math.log(at_high / at_low)
        return float(low * (high / low) ** min(max(part, 0.1), 0.9))
    if 0 < over_target < math.inf:  # one end is known: effects are nearly proportional to their size
        return min(max(size / over_target, low), high)
    return math.sqrt(low * high)
