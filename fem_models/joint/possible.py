"""Preloads and drives that a rig cannot have, said before its first step.

They buckle the tube, close a notch or break a tendon.

A tendon crosses the rigid gap of a notch on a chord, so that its tension pulls a bent joint further: the tangent of a
joint of stiffness k is k - sum of T g/4 over the tendons, g being the rigid gap (:mod:`fem_models.chain.laws`, slope of
the lever at no angle). Tendons that slide freely keep one tension from wheel to tip, and resist a joint only as far as
the whole path changes:

    K = diag(k_i) + A S A^T        G = diag(sum_t T_t g_i/4)        S^-1 = diag(1/s_t) + sum_i q_i

with the stiffness s_t of a whole tendon, the arms in the columns of A, and the axial compliance q of the joints, which
the thrust of all tendons shortens. The tube buckles where K - G has a negative eigenvalue. Bends
whose angles add up to nothing, an S, change no path: for equal joints that is where the thrust of all tendons
passes 4 k/g. Friction of the guides may hold a straight tube above it, up to the first motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from fem_models.joint.mechanics import JointMechanics
from fem_models.joint.row import JointRow
from fem_models.rig import Rig, RigError
from fem_models.rig.tendon_law import tendon_stiffness_N_per_mm, tendon_stretch_mm, tendon_tension_N
from hysteresis.arrays import Floats

MOST_STRAIN = 0.1
"""Largest strain of a tendon. None bears it: cold-drawn steel yields below 2 %, fibres of
polyethylene (UHMWPE) break at 4 %, superelastic Nitinol ends its plateau at 6 to 8 %."""
SURE = 1.15
"""Angle at rest over the one that closes a notch, from which on a preload is refused: the estimate is linear, and the
chain without friction differs from it by up to a tenth."""
_HALVINGS = 50


class _AtRest(NamedTuple):
    """A straight tube under its tendons."""

    resists: Floats  # K of the module, (N, N)
    drives: Floats  # diagonal of G, (N,)
    moments: Floats  # of the tendons on the joints, Nmm, (N,)


def require_possible(rig: Rig, joints: JointRow) -> None:
    """Refuse a preload that a rig cannot have; for programs of a drive in mm: a tendon force takes the preload's place.

    Raises
    ------
    RigError
        One line with the preload and the number at which the tube buckles, a notch closes at rest, or a tendon breaks.
    """
    require_strain(rig)
    if rig.preload_N == 0.0 or _is_far(rig, joints):
        return
    one_sided = joints.first.one_sided
    held = any(getattr(rig, name) is not None for name in ("gravity", "tip_load", "tip_mass", "tip_stop"))
    if rig.tendon_b is not None and not one_sided and rig.precurvature_deg == 0.0 and not held:  # others bend at rest
        _require_straight(rig, joints)
    bends = rig.tendon_b is None or one_sided
    if bends and rig.closure is None and joints.first.closure_angle_rad < math.inf:
        _require_open_at_rest(rig, joints)


def require_strain(rig: Rig) -> None:
    """Refuse a preload that stretches a tendon by more than :data:`MOST_STRAIN`.

    Raises
    ------
    RigError
        One line with the preload, and the one that stretches the tendon so far.
    """
    for name, tendon in zip(("tendon_a", "tendon_b"), rig.tendons, strict=False):
        most = MOST_STRAIN * tendon.EA_N
        if rig.preload_N > most:
            raise RigError(
                f"rig {rig.name}: preload_N = {rig.preload_N:g}: expected at most {most:.4g}, where {name} of EA_N = "
                f"{tendon.EA_N:g} is stretched by {100 * MOST_STRAIN:g} %: steel yields below 2 %, polyethylene breaks "
                "at 4 %"
            )


def require_reach(rig: Rig, drive_mm: Floats, slack_mm: Floats) -> None:
    """Refuse a drive that stretches a tendon by more than :data:`MOST_STRAIN`, wherever the tube bends.

    A joint draws in at most its pitch and twice the arm of the tendon.

    Parameters
    ----------
    drive_mm, slack_mm
        Of a schedule, shapes (m,) and (m, 2).

    Raises
    ------
    RigError
        One line with the drive, and the one that stretches the tendon so far.
    """
    for side, (name, tendon) in enumerate(zip(("tendon_a", "tendon_b"), rig.tendons, strict=False)):
        stretched = tendon_stretch_mm(tendon, MOST_STRAIN * tendon.EA_N, max(rig.preload_N, 1e-9), rig.length_mm)
        drawn_in = rig.length_mm + 2 * rig.joints * abs(tendon.moment_arm_mm)
        sign, most = 1 - 2 * side, float(stretched) + drawn_in + slack_mm[:, side]
        worst = int(np.argmax(sign * drive_mm - most))
        if sign * drive_mm[worst] > most[worst]:
            raise RigError(
                f"rig {rig.name}: drive_mm = {drive_mm[worst]:g}: expected at {'least' if side else 'most'} "
                f"{sign * most[worst]:.4g}, where {name} of EA_N = {tendon.EA_N:g} is stretched by "
                f"{100 * MOST_STRAIN:g} %, however far the tube bends"
            )


def buckling_preload_N(rig: Rig, joints: JointRow) -> float:
    """Preload at which the straight tube buckles if its tendons slide freely; inf where none does."""
    at_rest = _at_rest(rig, joints)
    if not (at_rest.drives > 0).any():
        return math.inf
    if joints.alike and rig.joints > 1:  # bent to an S, which no path resists
        return rig.preload_N * joints_stiffness(rig, joints)[0] / at_rest.drives[0]
    last = rig.joints - 1
    found = eigh(np.diag(at_rest.drives), at_rest.resists, eigvals_only=True, subset_by_index=[last, last])
    return rig.preload_N / float(found[0])


def _is_far(rig: Rig, joints: JointRow) -> bool:
    """Whether no joint by itself, without what tendons resist, buckles or closes: most rigs, and searches try many."""
    if rig.slack is not None:
        return False
    thrust = len(rig.tendons) * rig.preload_N
    for joint in joints.each[:1] if joints.alike else joints.each:
        left = _stiffness(rig, joint) - 0.25 * thrust * joint.rigid_gap_mm
        moment = rig.preload_N * (joint.arms_mm.a - joint.arms_mm.b)
        if left <= 0.0 or joint.rest_angle_rad + moment / left > joint.closure_angle_rad:
            return False
    return True


def _require_straight(rig: Rig, joints: JointRow) -> None:
    most = buckling_preload_N(rig, joints)
    if rig.preload_N > most:
        stiff, gaps = joints_stiffness(rig, joints), joints.of("rigid_gap_mm")
        raise RigError(
            f"rig {rig.name}: preload_N = {rig.preload_N:g}: expected below {most:.4g}, where the straight tube "
            f"buckles: its joints of {_range(stiff)} Nmm/rad carry the thrust of {len(rig.tendons)} tendons over gaps "
            f"of {_range(gaps)} mm"
        )


def _require_open_at_rest(rig: Rig, joints: JointRow) -> None:
    """Refuse a preload that closes a notch: for sure, as friction takes all it can, and before plateaus or loops give.

    The bend is (K - G)^-1 of the moments of the tendons; a notch that nothing holds open any more closes, too.
    """
    limit, at_rest = joints.of("closure_angle_rad"), _at_rest(rig, joints)
    part = 1.0 - min(_friction_N(rig, float(limit.sum())) / rig.preload_N, 1.0)

    def closes(share: float, beyond: float = 1.0) -> bool:
        """Whether a share of the preload bends a notch beyond so many times the angle that closes it."""
        left = at_rest.resists - share * part * np.diag(at_rest.drives)
        if np.linalg.eigvalsh(left)[0] <= 0.0:
            return True
        angle = joints.first.rest_angle_rad + np.linalg.solve(left, share * part * at_rest.moments)
        return bool((angle > beyond * limit).any())

    if not closes(1.0, SURE):
        return
    share = _begins(closes)
    raise RigError(
        f"rig {rig.name}: preload_N = {rig.preload_N:g}: expected below about {share * rig.preload_N:.2g}, where "
        f"{'its tendon' if rig.tendon_b is None else 'tendon a, which has the longer arm,'} closes a notch at rest "
        f"(at {_range(np.degrees(limit))} deg), or a rig with [closure]"
    )


def _begins(holds: Callable[[float], bool]) -> float:
    """Give the least share of 1 from which on something holds, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def joints_stiffness(rig: Rig, joints: JointRow) -> Floats:
    """Bending stiffness of each joint where it begins to bend, with its dry elements, Nmm/rad, shape (N,)."""
    if joints.alike:
        return np.full(rig.joints, _stiffness(rig, joints.first))
    return np.array([_stiffness(rig, joint) for joint in joints.each])


def _stiffness(rig: Rig, joint: JointMechanics) -> float:
    if not joint.spring_Nmm_per_rad:
        return joint.flexure.bending_Nmm_per_rad  # before the plateau
    return joint.elastic_Nmm_per_rad + float(joint.jenkins.stiffness.sum())


def _tensions_N(rig: Rig, joints: JointRow) -> Floats:
    """Tensions at rest: the preload, but for tendons that are too long or too short."""
    slack = (0.0, 0.0) if rig.slack is None else (rig.slack.tendon_a_mm, rig.slack.tendon_b_mm)
    length = float(joints.lengths.segments.sum())
    return np.array(
        [
            float(tendon_tension_N(tendon, -longer, rig.preload_N, length))
            for tendon, longer in zip(rig.tendons, slack, strict=False)
        ]
    )


def _at_rest(rig: Rig, joints: JointRow) -> _AtRest:
    tensions, length = _tensions_N(rig, joints), float(joints.lengths.segments.sum())
    arms = np.column_stack([joints.of("arms_mm.a"), -joints.of("arms_mm.b")][: len(tensions)])
    each = [
        float(tendon_stiffness_N_per_mm(tendon, tension, length))
        for tendon, tension in zip(rig.tendons, tensions, strict=True)
    ]
    taut = np.flatnonzero(each)
    compliance = np.diag(1 / np.array(each)[taut]) + float(joints.of("axial_compliance").sum())
    resists = np.diag(joints_stiffness(rig, joints))
    if np.isfinite(compliance).all():
        resists = resists + arms[:, taut] @ np.linalg.lstsq(compliance, arms[:, taut].T)[0]
    return _AtRest(resists, 0.25 * float(tensions.sum()) * joints.of("rigid_gap_mm"), arms @ tensions)


def _friction_N(rig: Rig, turned_rad: float) -> float:
    """Friction of all guides together under the preload, N, bent by an angle in sum."""
    dry = rig.friction
    capstan = -math.expm1(-dry.capstan_coefficient * (math.radians(dry.rest_wrap_deg) + turned_rad))
    return dry.sheath_N + rig.joints * dry.guide_N + rig.preload_N * capstan


def _range(values: Floats) -> str:
    low, high = (f"{float(value):.4g}" for value in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"
