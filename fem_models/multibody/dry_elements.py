"""Dry friction, material and drag of an assembled rig: rest points of what slips, forces of what drags, losses.

Each element is an Exudyn connector whose constants are set here. Guides stand in the order tendon a then b, base to
tip; Jenkins and flag elements element by element, joint by joint.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import fem_models.multibody.connector_laws as laws
from fem_models.joint import JointRow
from fem_models.joint.superelastic import FlagFibres, flag_moment
from fem_models.joint.superelastic_section import fibre_stress, transformation_loss_mJ
from fem_models.load.stepping import Load
from fem_models.multibody.assembly import Model, bristle_N_per_mm
from fem_models.multibody.heating import JointTemperatures
from fem_models.multibody.section import fibre_lengths_mm, section_row
from fem_models.rig import Rig
from hysteresis.arrays import Floats

_PLATEAUS = (  # where the law of a fibre finds them, see connector_laws
    "staticFrictionOffsetForce",
    "dynamicFrictionForce",
    "exponentialDecayStatic",
    "frictionProportionalZone",
)

_HARDENING = ("velocityOffset", "viscousFrictionFactor", "damping")
"""Where the law of a flexure finds slope, limit and angle."""

FAR_N = 1e6  # far above any friction: a bristle with this limit sticks, one with this force slides


@dataclass(frozen=True)
class Losses:
    """Losses since the start, mJ; ``jump`` is what goes to the pseudo-viscosity."""

    friction: float = 0.0
    material: float = 0.0
    drag: float = 0.0
    jump: float = 0.0


def set_each(mbs: Any, connectors: list[int], field: str, values: Iterable[float]) -> None:
    """Set a parameter of several connectors."""
    put = mbs.SetObjectParameter
    for connector, value in zip(connectors, values, strict=True):
        put(connector, field, value)


class Guides:
    """Guides as bristles: springs with rest points, whose forces are limited.

    ``limit`` and ``sliding`` are those at the last equilibrium; ``sliding`` is 0 where a guide sticks, else the sign of
    its friction.
    """

    def __init__(self, model: Model, rig: Rig, bristle_ratio: float, scale_N: float) -> None:
        bristle = [bristle_N_per_mm(rig, tendon, bristle_ratio) for tendon in rig.tendons]
        self.model, self.tendons, self.scale = model, len(rig.tendons), scale_N
        self.bristle = np.concatenate(bristle)
        self.rest, self.limit, self.sliding = (np.zeros(self.bristle.size) for _ in range(3))
        self.slack, self.states = (False,) * self.tendons, ("pulls",) * self.tendons
        self.loose = np.zeros(self.bristle.size, dtype=bool)
        self.smooth = np.full(rig.joints, rig.friction.guide_N == 0)
        self.smooth[0] &= rig.friction.sheath_N == 0
        self.open = np.repeat(
            [laws.OPEN_STIFFNESS * tendon.EA_N / rig.mean_pitch_mm for tendon in rig.tendons], rig.joints
        )
        self.given = {
            field: np.full(self.bristle.size, np.nan) for field in ("offset", "staticFrictionOffsetForce", "damping")
        }

    def _put(self, field: str, values: Floats) -> None:
        """Set a parameter of the guides in which it changes."""
        changed = np.flatnonzero(values != self.given[field]).tolist()
        set_each(self.model.mbs, [self.model.guides[k] for k in changed], field, values[changed].tolist())
        self.given[field] = values

    def fix(self, sliding: Floats, limit: Floats) -> None:
        """Make each guide stick or slide for a whole solve, so that Newton's method meets no kink."""
        self._put("damping", np.where(self.loose, 0.0, self.open))
        self._put("offset", np.where(sliding == 0, self.rest, -sliding * FAR_N))
        self._put("staticFrictionOffsetForce", np.where(sliding == 0, FAR_N, limit))

    def let_go(self) -> None:
        """Leave the guides without force; :meth:`fix` gives it back."""
        none = np.zeros(self.bristle.size)
        for field in ("offset", "staticFrictionOffsetForce", "damping"):
            self._put(field, none)

    def make_slack(self, slack: Sequence[bool], *, known: bool = False) -> None:
        """Say which tendons are slack: their segments are soft, and guides without constant friction hold nothing.

        The tension is the same all along such a tendon. Its segments therefore share the slack by their lengths. Where
        it is ``known`` that the others are taut their law has no kink.
        """
        joints = self.bristle.size // self.tendons
        states = tuple("slack" if now else "taut" if known else "pulls" for now in slack)
        for side, (now, before) in enumerate(zip(states, self.states, strict=True)):
            if now == before:
                continue
            rows = slice(side * joints, (side + 1) * joints)
            for number, law in zip(self.model.segments[rows], self.model.segment_laws[rows], strict=True):
                for field, value in getattr(law, now).items():
                    self.model.mbs.SetObjectParameter(number, field, value)
            self.loose[rows] = slack[side] & self.smooth
        self.slack, self.states = tuple(slack), states

    def unheld(self, sliding: Floats) -> Floats:
        """States in which no guide of a slack tendon holds it."""
        return np.where(self.loose & (sliding == 0), 1.0, sliding)

    def next_states(self, q: Floats, sliding: Floats, limit: Floats) -> Floats:
        """States by the forces of the bristles; a guide that slides sticks before it slides in the other direction."""
        force = self.bristle * (q[self.model.slip] - self.rest)
        tolerance = 1e-9 * self.scale
        loose = np.where(np.abs(force) > limit + tolerance, np.sign(force), 0.0)
        states = np.where(sliding == 0, loose, np.where(force * sliding < limit - tolerance, 0.0, sliding))
        return np.where(self.loose, self.unheld(sliding), states)

    def base_slides(self, sliding: Floats) -> bool:
        """Whether a tendon has begun to slide at the base, or to slide in the other direction."""
        joints = self.sliding.size // self.tendons
        now, before = sliding[::joints], self.sliding[::joints]
        return bool(np.any((now != 0) & (now != before)))

    def accept(self, q: Floats, limit: Floats) -> float:
        """Move the rest points of what has slipped; return the loss, mJ.

        A sliding guide's force changes from the last limit to the present one: their mean is booked.
        """
        slip = q[self.model.slip]
        force = np.clip(self.bristle * (slip - self.rest), -limit, limit)
        rest = slip - force / self.bristle
        loss = float(0.5 * (self.limit + limit) @ np.abs(rest - self.rest))
        self.rest, self.limit = rest, limit
        return loss


class Material:
    """Jenkins and flag elements of all joints, fibres of their sections, and their rest angles."""

    def __init__(self, model: Model, rig: Rig, joints: JointRow) -> None:
        n, mbs, joint = rig.joints, model.mbs, joints.first
        self.model = model
        self.jenkins_stiffness = joints.of("jenkins.stiffness").T.ravel()
        self.slip_moment = joints.of("jenkins.slip_moment_Nmm").T.ravel()
        fibres, share = joint.fibres, 1 - rig.material.loop_share
        self.fibres = FlagFibres(
            stiffness=np.repeat(share * fibres.stiffness, n),
            upper_Nmm=np.repeat(share * fibres.upper_Nmm, n),
            lower_Nmm=np.repeat(share * fibres.lower_Nmm, n),
            span_rad=np.repeat(fibres.span_rad, n),
            slope=np.repeat(share * fibres.slope, n),
        )
        self.jenkins_rest = np.full(len(model.jenkins), joint.rest_angle_rad)
        self.flag_rest = np.zeros(len(model.flags))
        at_no_angle = 1 - self.fibres.slope / self.fibres.stiffness  # where the line of a plateau starts
        set_each(mbs, model.jenkins, "staticFrictionOffsetForce", self.slip_moment)
        set_each(mbs, model.jenkins, "offset", self.jenkins_rest)
        set_each(mbs, model.flags, "staticFrictionOffsetForce", at_no_angle * self.fibres.upper_Nmm)
        set_each(mbs, model.flags, "dynamicFrictionForce", at_no_angle * self.fibres.lower_Nmm)
        set_each(mbs, model.flags, "damping", self.fibres.slope)
        set_each(mbs, model.flags, "viscousFrictionFactor", self.fibres.span_rad)
        for field, value in zip(_HARDENING, joint.hardening, strict=True):
            set_each(mbs, model.hardening, field, [value] * len(model.hardening))
        set_each(mbs, model.hardening, "offset", [joint.rest_angle_rad] * len(model.hardening))
        self.row = section_row(joints)
        self.fibre_rest = np.zeros((len(model.fibres) // n, n))  # strains
        self.heat = JointTemperatures(self.row, n)
        if self.row is not None:
            self._set_fibres()

    def _set_fibres(self) -> None:
        """Set the flag of each fibre: its force over its elongation."""
        row, mbs, fibres = self.row, self.model.mbs, self.model.fibres
        assert row is not None
        set_each(mbs, fibres, "damping", (row.area_mm2 * row.law.climb / row.length_mm).ravel())
        span = np.broadcast_to(row.law.span * row.length_mm, self.fibre_rest.shape)
        set_each(mbs, fibres, "viscousFrictionFactor", span.ravel())
        self._set_plateaus()

    def _set_plateaus(self) -> None:
        """Set the plateaus of each fibre, at the temperature of its joint."""
        row = self.row
        assert row is not None
        law = row.law
        area, shift = (1 - law.climb / law.young) * row.area_mm2, self.heat.shift_MPa(self.heat.now)
        plateaus = law.upper, law.lower, law.upper_pressed, law.lower_pressed
        for field, plateau in zip(_PLATEAUS, plateaus, strict=True):
            set_each(self.model.mbs, self.model.fibres, field, (area * (plateau + shift)).ravel().tolist())

    def begin(self, time_s: float, q: Floats) -> None:
        """Start a step of a length in time, from coordinates."""
        if self.heat.heating is not None:
            self.heat.begin(time_s)
            self._set_plateaus()
            self._set_springs(q)

    def _set_springs(self, q: Floats) -> None:
        """Set the springs that lead the search for the temperature, without force at coordinates."""
        (pull, turn), mbs, heat = self.heat.weights, self.model.mbs, self.model.heat
        set_each(mbs, heat, "factor0", (-turn).tolist())
        set_each(mbs, heat, "factor1", pull.tolist())
        set_each(mbs, heat, "stiffness", self.heat.stiffness.tolist())
        set_each(mbs, heat, "offset", (pull * q[self.model.longer] + turn * q[self.model.bent]).tolist())

    def temperatures_agree(self, q: Floats, load: Load) -> bool:
        """Whether an equilibrium has the temperatures that its heat leaves; if not, guess others."""
        if self.heat.agree(self._strain(q, load), self.fibre_rest):
            return True
        self._set_plateaus()
        self._set_springs(q)
        return False

    def scale_loop(self, factor: float) -> None:
        """Scale the slip moments of the Jenkins elements."""
        set_each(self.model.mbs, self.model.jenkins, "staticFrictionOffsetForce", factor * self.slip_moment)

    def set_rest_angle(self, angle_rad: float) -> None:
        """Set the angle that the flag elements and the sections have without load."""
        set_each(self.model.mbs, self.model.flags, "velocityOffset", [angle_rad] * len(self.model.flags))
        if self.row is not None:
            set_each(self.model.mbs, self.model.fibres, "velocityOffset", (angle_rad * self.row.height_mm).ravel())

    def accept(self, q: Floats, load: Load) -> list[float]:
        """Move the rest angles of what has slipped; return the losses of Jenkins, flag elements and fibres, mJ."""
        angle, mbs, losses = self.model.joint_angles(q), self.model.mbs, []
        if self.model.jenkins:
            bend, limit = np.tile(angle, self.slip_moment.size // angle.size), load.loop_scale * self.slip_moment
            moment = np.clip(self.jenkins_stiffness * (bend - self.jenkins_rest), -limit, limit)
            rest, lost = _slipped(bend, moment, self.jenkins_stiffness, self.jenkins_rest)
            losses.append(lost)
            slipped = np.flatnonzero(np.abs(moment) >= limit)  # what sticks keeps its rest angle but for rounding
            set_each(mbs, [self.model.jenkins[k] for k in slipped], "offset", rest[slipped].tolist())
            self.jenkins_rest[slipped] = rest[slipped]
        if self.model.flags:
            bend = np.tile(angle - load.rest_angle, self.fibres.stiffness.size // angle.size)
            moment = flag_moment(bend, self.flag_rest, self.fibres)
            self.flag_rest, lost = _slipped(bend, moment, self.fibres.stiffness, self.flag_rest)
            losses.append(lost)
            set_each(mbs, self.model.flags, "offset", self.flag_rest)
        if self.row is not None:
            losses.append(self._transform(q, load))
        return losses

    def _strain(self, q: Floats, load: Load) -> Floats:
        """Strains of the fibres, shape (k, N)."""
        row, model = self.row, self.model
        assert row is not None
        return fibre_lengths_mm(row, q[model.bent] - load.rest_angle, q[model.longer]) / row.length_mm

    def _transform(self, q: Floats, load: Load) -> float:
        """Move the rest strains of the fibres; return the loss, mJ."""
        row, model = self.row, self.model
        assert row is not None
        strain = self._strain(q, load)
        stress = fibre_stress(row.law, strain, self.fibre_rest, self.heat.shift_MPa(self.heat.now))
        risen = self.heat.accept(strain, self.fibre_rest)
        rest = strain - stress / row.law.young
        volume = row.area_mm2 * row.length_mm
        loss = transformation_loss_mJ(row.law, stress, rest, self.fibre_rest, risen, volume)
        changed = np.flatnonzero(rest != self.fibre_rest)  # most stay elastic
        offset = (row.length_mm * rest).ravel()[changed]
        set_each(model.mbs, [model.fibres[k] for k in changed], "offset", offset)
        self.fibre_rest = rest
        return loss


class Dashpots:
    """Drag of the sheaths and of the joints; ``place`` and ``force`` are those at the last equilibrium."""

    def __init__(self, model: Model, rig: Rig) -> None:
        self.model, self.joints = model, rig.joints
        self.constants = np.empty(0)  # of the sheaths, N s/mm, then of the joints, Nmm s/rad
        if rig.drag is not None:
            drag = [rig.drag.sheath_N_s_per_mm, rig.drag.joint_Nmm_s_per_rad]
            self.constants = np.repeat(drag, [len(rig.tendons), rig.joints])
        self.place, self.force = 0.0 * self.constants, 0.0 * self.constants

    def damp_by_speed(self) -> None:
        """Make the dashpots act by their speed, which only a time integration knows."""
        set_each(self.model.mbs, self.model.dashpots, "stiffness", 0.0 * self.constants)
        set_each(self.model.mbs, self.model.dashpots, "damping", self.constants)

    def damp_over(self, time_s: float) -> None:
        """Implicit Euler: over a step a dashpot is a spring c/time from its last place; none over no time."""
        stiffness = self.constants / time_s if time_s > 0 else 0.0 * self.constants
        set_each(self.model.mbs, self.model.dashpots, "stiffness", stiffness)
        set_each(self.model.mbs, self.model.dashpots, "offset", self.place)

    def _of(self, q: Floats) -> Floats:
        """Places of the dashpots at coordinates, or their speeds at velocities; none without drag."""
        at_base = q[self.model.slip[:: self.joints]]
        return np.concatenate([at_base, self.model.joint_angles(q)])[: self.constants.size]

    def accept(self, q: Floats, velocities: Floats) -> float:
        """Note places and forces; return the loss by the mean of the last and the present force, mJ."""
        place, force = self._of(q), self.constants * self._of(velocities)
        loss = float(0.5 * (self.force + force) @ (place - self.place))
        self.place, self.force = place, force
        return loss


def _slipped(bend: Floats, moment: Floats, stiffness: Floats, rest: Floats) -> tuple[Floats, float]:
    """Rest angles that agree with the moments, and the energy that moving them took, mJ."""
    moved = bend - moment / stiffness
    return moved, float(moment @ (moved - rest))
