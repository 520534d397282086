"""A rig as MJCF, the model file of MuJoCo: rings on hinges, tendons over sites, dry friction by ``frictionloss``.

A tendon of MuJoCo has one tension. Here it therefore ends in the base on a bead, a slider with friction which the
tendon from the wheel pulls on one side and the tendon in the tube on the other. What slides past a guide further on is
the change of the path beyond it: the friction of that guide belongs to a tendon without stiffness from there to the
tip. The same law holds the wheel in its play, and the Jenkins elements of the material. Units: m, N, kg, rad, s.

Facts about MJCF: XML reference of MuJoCo, mujoco.readthedocs.io (``springlength`` of two values is a dead band,
``frictionloss`` of joints and tendons, ``noslip_iterations``). Why the settings of the solver are these: the default
friction of MuJoCo creeps, docs/validation/benchmarks.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from xml.etree import ElementTree

import numpy as np

from fem_models.export.loop import GuideLoop
from fem_models.export.mujoco_notes import notes
from fem_models.export.springs import Springs, springs
from fem_models.export.weights import dead_weights
from fem_models.joint import JointMechanics, JointRow, joint_row
from fem_models.rig import Rig
from fem_models.rig.joints import NotchedTube
from hysteresis.arrays import Floats

MM = 1e-3  # m
TIME_STEP_S = 1e-3
FASTEST = 1.0
"""Bound of the model's modes in radians a step: MuJoCo integrates springs explicitly, which is stable below 2."""
DAMPING = 0.5
"""Damping over the critical one of the softest mode, in which flexures alone bend."""
SPEED_MM_PER_S = 0.5
"""Speed of the drive, in the time of the model, up to which its inertia and damping are small against its friction."""
WHEEL = 300.0
"""Stiffness of the drive over that of both tendons at the wheel."""
HOLD = 2.0
"""Friction that holds the wheel in its play, over the largest difference of the tendons: it never gives way."""
FRICTION = {"solreffriction": "0.002 1", "solimpfriction": "0.99 0.99 0.001"}
NOSLIP_ITERATIONS = 10
FAR = "-100"  # m or rad: the lower end of a spring that only pulls
LEAST_MASS_KG = 1e-7  # of parts whose weight the rig does not have

Element = ElementTree.Element


@dataclass(frozen=True, eq=False)
class _Model:
    """What the parts of the file share; m, N, rad, kg, s. Arrays of shape (t, N) are of tendons and guides."""

    rig: Rig
    joints: JointRow
    arms: Floats  # (t, N), signed: y of the tendons from each joint
    springs: tuple[Springs, ...]
    friction: Floats  # (t, N), N
    hold: float  # of the wheel in its play
    track: float  # length on which a bead slides
    inertia: _Inertia


@dataclass(frozen=True)
class _Inertia:
    """Inertia by stiffness, and damping by inertia, so that the model comes to rest soon: neither is the rig's."""

    per_stiffness: float  # s^2
    per_inertia: float  # 1/s

    def of(self, stiffness: float) -> dict[str, str]:
        """Attributes of a joint that springs of this stiffness hold."""
        inertia = self.per_stiffness * stiffness
        return {"armature": _number(inertia), "damping": _number(self.per_inertia * inertia)}


def mujoco_model(rig: Rig, loop: GuideLoop) -> str:
    """Write the rig as MJCF; comments say how to drive it, and what it has lost.

    Parameters
    ----------
    loop
        Of the amplitude that the model is meant for: the friction of a guide is its mean along this loop, and the
        springs of a toe region cover its tensions.

    Returns
    -------
    The text of the file.
    """
    model = _derive(rig, loop)
    rig = replace(rig, name="".join(one if one.isprintable() else " " for one in rig.name))  # XML has no others
    root = Element("mujoco", model=rig.name)
    for note in notes(rig, model.joints, loop, SPEED_MM_PER_S):
        root.append(ElementTree.Comment(f" {note} ".replace("--", "- -")))
    _settings(root, model)
    world, tendons = _add(root, "worldbody"), Element("tendon")
    _wheel(world, tendons, model)
    _rings(world, model)
    _material(world, tendons, model)
    root.append(tendons)
    _tendons(tendons, model)
    bending = _add(tendons, "fixed", name="bending")
    for i in range(1, rig.joints + 1):
        _add(bending, "joint", joint=f"joint{i}", coef="1")
    _drive(root, model)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _derive(rig: Rig, loop: GuideLoop) -> _Model:
    joints = joint_row(rig)
    arms = (joints.of("arms_mm") * [1.0, -1.0]).T[: len(rig.tendons)]
    wheel = loop.before_N[:, :, 0]
    free = tuple(
        springs(tendon, rig.preload_N, float(wheel[:, side].min()), float(wheel[:, side].max()))
        for side, tendon in enumerate(rig.tendons)
    )
    slip = 2 * float(np.abs(loop.drive_mm).max()) + rig.joints * float(np.abs(arms).max()) * 0.5
    return _Model(
        rig=rig,
        joints=joints,
        arms=MM * arms,
        springs=free,
        friction=loop.limit_N.mean(axis=0),
        hold=HOLD * float(np.abs(wheel[:, 0] - wheel[:, -1] if len(arms) == 2 else wheel[:, 0]).max()),
        track=MM * slip,
        inertia=_inertia(rig, joints),
    )


def _inertia(rig: Rig, joints: JointRow) -> _Inertia:
    """Inertia that leaves every mode slower than :data:`FASTEST`, and damping by the softest mode.

    A row of the stiffness, over what its joint is given here, sums up to at most 4 (Gershgorin): 4 / per_stiffness
    bounds the squares of the frequencies.
    """
    per_stiffness = 4 * (TIME_STEP_S / FASTEST) ** 2
    softest = min(
        MM * joint.flexure.bending_Nmm_per_rad / (per_stiffness * _hinge_stiffness(rig, joint)) for joint in joints.each
    )
    return _Inertia(per_stiffness, 2 * DAMPING * math.sqrt(softest))


def _hinge_stiffness(rig: Rig, joint: JointMechanics) -> float:
    """Bound of the stiffness that a hinge sees, Nm/rad: the sum of its row."""
    n, stiffness = rig.joints, joint.flexure.bending_Nmm_per_rad
    for side, arm in enumerate(joint.arms_mm[: len(rig.tendons)]):
        stiffness += _in_tube_N_per_mm(rig, side) * arm**2 * n
    contact = rig.closure.stiffness_Nmm_per_rad if rig.closure else 0.0
    return MM * (stiffness + contact)


def _settings(root: Element, model: _Model) -> None:
    _add(root, "compiler", angle="radian", autolimits="true")
    option = _add(
        root,
        "option",
        timestep=_number(TIME_STEP_S),
        gravity=_numbers(*dead_weights(model.rig).gravity, 0),
        integrator="implicitfast",
        noslip_iterations=str(NOSLIP_ITERATIONS),
        noslip_tolerance="0",
    )
    _add(option, "flag", contact="disable")
    default = _add(root, "default")
    _add(default, "site", size=_number(0.1 * model.arms[0, 0]), rgba="0.1 0.1 0.1 1")
    _add(default, "geom", contype="0", conaffinity="0", rgba="0.7 0.7 0.75 0.5")
    _add(default, "joint", **FRICTION)
    _add(default, "tendon", width=_number(0.05 * model.arms[0, 0]), rgba="0.8 0.3 0.1 1")


def _inertial(body: Element, at: float = 0.0, mass: float = 0.0) -> None:
    mass = max(mass, LEAST_MASS_KG)
    _add(body, "inertial", pos=_numbers(at, 0, 0), mass=_number(mass), diaginertia=_numbers(*3 * [1e-6 * mass]))


def _wheel(world: Element, tendons: Element, model: _Model) -> None:
    """Add the drive, a hinge that the actuator turns, and with play a wheel that follows it."""
    rig = model.rig
    radius, gain = MM * rig.wheel.radius_mm, 1 + (rig.drive_gain.error if rig.drive_gain else 0.0)
    stiffness = _drive_stiffness(rig) * radius**2
    at = _numbers(-MM * rig.tendon_a.free_length_mm, 0, 0)
    play = rig.backlash is not None
    for name in ("drive", "wheel") if play else ("drive",):
        body = _add(world, "body", name=name, pos=at)
        _inertial(body)
        _add(body, "geom", type="cylinder", size=_numbers(radius, 0.1 * radius), mass="0")
        hold = {"frictionloss": _number(model.hold * radius)} if name == "wheel" else {}
        _add(body, "joint", name=name, type="hinge", axis="0 0 1", **model.inertia.of(2 * stiffness), **hold)
    if rig.backlash is not None:
        half = MM * float(rig.backlash.left_mm(rig.preload_N)) / 2
        play_spring = _add(
            tendons,
            "fixed",
            name="play",
            springlength=_numbers(-half, half),
            stiffness=_number(stiffness / radius**2),
        )
        _add(play_spring, "joint", joint="drive", coef=_number(gain * radius))
        _add(play_spring, "joint", joint="wheel", coef=_number(-radius))
    _free_tendons(tendons, model, "wheel" if play else "drive", radius if play else gain * radius)


def _drive_stiffness(rig: Rig) -> float:
    return WHEEL * sum(tendon.EA_N / (MM * tendon.free_length_mm) for tendon in rig.tendons)


def _free_tendons(tendons: Element, model: _Model, wheel: str, radius: float) -> None:
    """Add the tendons between wheel and base: parallel springs from the wheel's rim to the bead in the base."""
    rig = model.rig
    slack = (rig.slack.tendon_a_mm, rig.slack.tendon_b_mm) if rig.slack else (0.0, 0.0)
    for side, law in enumerate(model.springs):
        for k, (stiffness, start) in enumerate(zip(law.stiffness_N_per_mm, law.start_mm, strict=True)):
            spring = _add(
                tendons,
                "fixed",
                name=f"free_{'ab'[side]}{k}",
                springlength=f"{FAR} {_number(MM * (start + slack[side]))}",
                stiffness=_number(stiffness / MM),
            )
            _add(spring, "joint", joint=wheel, coef=_number(radius * (1, -1)[side]))
            _add(spring, "joint", joint=f"slip_{'ab'[side]}", coef="1")


def _rings(world: Element, model: _Model) -> None:
    """Add the base and the rings, one in the other, with the guides in each."""
    rig, joints, lengths, n = model.rig, model.joints, model.joints.lengths, model.rig.joints
    gaps, first = (MM * joints.of("rigid_gap_mm") / 2).tolist(), MM * joints.places.middles[0]
    beyond, to_ring = (MM * lengths.beyond).tolist(), (MM * lengths.to_ring).tolist()
    neutral = (-MM * joints.of("flexure.neutral_offset_mm")).tolist()
    outer = MM * rig.joint.tube.outer_diameter_mm / 2 if isinstance(rig.joint, NotchedTube) else float(model.arms[0, 0])
    weights = dead_weights(rig)
    parent, at, step = world, 0.0, 0.0
    for i in range(n + 1):
        joint = joints.each[max(i - 1, 0)]
        start, end = -first, first - gaps[0]  # of the base
        if i:
            start, end = gaps[i - 1], to_ring[i - 1] if i == n else beyond[i - 1] - gaps[i]
        body = _add(parent, "body", name=f"ring{i}", pos=_numbers(at, step, 0)) if i else world
        if i:
            if joint.rest_angle_rad:
                body.set("euler", _numbers(0, 0, joint.rest_angle_rad))
            _inertial(body, to_ring[i - 1], weights.ring_kg + (weights.tip_kg if i == n else 0.0))
            rest = _number(joint.rest_angle_rad)
            hinge = model.inertia.of(_hinge_stiffness(rig, joint))
            hinge |= {"stiffness": _number(MM * joint.elastic_Nmm_per_rad), "springref": rest, "ref": rest}
            _add(body, "joint", name=f"joint{i}", type="hinge", axis="0 0 1", **hinge)
        _add(body, "geom", type="cylinder", fromto=_numbers(start, 0, 0, end, 0, 0), size=_number(outer), mass="0")
        for side, y in enumerate(model.arms[:, max(i - 1, 0)].tolist()):
            _guide(body, model, side, i, (start, end, y))
        if i == n:
            _add(body, "site", name="tip", pos=_numbers(end, 0, 0))
        else:  # the neutral axis of the next notch may lie higher or lower
            parent, at = body, beyond[i - 1] if i else first
            step = neutral[i] - neutral[i - 1] if i else 0.0


def _guide(body: Element, model: _Model, side: int, i: int, place: tuple[float, float, float]) -> None:
    """Add the hole of a ring: two sites at its ends, and in the base a bead that tendons pull from both sides."""
    start, end, y = place
    name = f"{'ab'[side]}{i}"
    _add(body, "site", name=f"{name}in", pos=_numbers(start, y, 0))
    _add(body, "site", name=f"{name}out", pos=_numbers(end, y, 0))
    if i > 0:
        return
    bead = _add(body, "body", name=f"bead_{'ab'[side]}", pos=_numbers(0, y, 0))
    tendon = model.rig.tendons[side]
    stiffness = (tendon.EA_N / tendon.free_length_mm + _in_tube_N_per_mm(model.rig, side)) / MM
    _inertial(bead)
    _add(
        bead,
        "joint",
        name=f"slip_{'ab'[side]}",
        type="slide",
        axis="1 0 0",
        frictionloss=_number(float(model.friction[side, 0])),
        **model.inertia.of(stiffness),
    )
    _add(bead, "site", name=f"bead_{'ab'[side]}", pos=_numbers(end - model.track, 0, 0))


def _in_tube_N_per_mm(rig: Rig, side: int) -> float:
    return rig.tendons[side].EA_N / rig.length_mm


def _tendons(tendons: Element, model: _Model) -> None:
    """Add the tendons in the tube: a spring that only pulls from base to tip, and the friction of each guide.

    What slides past a guide is the change of the path beyond it, so its friction is that of a tendon from there on.
    """
    rig, rest, lengths = model.rig, model.joints.first.rest_angle_rad, model.joints.lengths
    gap = MM * model.joints.of("rigid_gap_mm") / 2
    in_holes = float((MM * lengths.beyond[:-1] - gap[:-1] - gap[1:]).sum())
    for side, y in enumerate(model.arms):
        name, n = "ab"[side], rig.joints
        chords = 2 * (gap * math.cos(rest / 2) - y * math.sin(rest / 2))
        length = float(chords.sum()) + in_holes + model.track
        stiffness = _in_tube_N_per_mm(rig, side) / MM
        spring = {"springlength": f"0 {_number(length - rig.preload_N / stiffness)}", "stiffness": _number(stiffness)}
        holes = [f"{name}0out"] + [f"{name}{i}{end}" for i in range(1, n) for end in ("in", "out")] + [f"{name}{n}in"]
        whole = _add(tendons, "spatial", name=f"tendon_{name}", **spring)
        for site in (f"bead_{name}", *holes):
            _add(whole, "site", site=site)
        for i in range(1, n):
            if model.friction[side, i] > 0:
                guide = _add(
                    tendons,
                    "spatial",
                    name=f"guide_{name}{i}",
                    frictionloss=_number(float(model.friction[side, i])),
                    **FRICTION,
                )
                for site in holes[2 * i :]:
                    _add(guide, "site", site=site)


def _material(world: Element, tendons: Element, model: _Model) -> None:
    """Add Jenkins elements: wheels that dry friction holds, each on a spring to its joint; and notches that close."""
    rig = model.rig
    for i, joint in enumerate(model.joints.each, start=1):
        for j, (stiffness, slip) in enumerate(zip(joint.jenkins.stiffness, joint.jenkins.slip_moment_Nmm, strict=True)):
            body = _add(world, "body", name=f"metal{i}_{j}")
            _inertial(body)
            rest = _number(joint.rest_angle_rad)
            dry = {"frictionloss": _number(MM * slip), "ref": rest, **model.inertia.of(MM * stiffness)}
            _add(body, "joint", name=f"metal{i}_{j}", type="hinge", axis="0 0 1", **dry)
            spring = _add(tendons, "fixed", name=f"metal{i}_{j}", springlength="0 0", stiffness=_number(MM * stiffness))
            _add(spring, "joint", joint=f"joint{i}", coef="1")
            _add(spring, "joint", joint=f"metal{i}_{j}", coef="-1")
        if rig.closure is not None and math.isfinite(joint.contact_angle_rad):
            angle = _number(joint.contact_angle_rad)
            closed = _add(
                tendons,
                "fixed",
                name=f"closed{i}",
                springlength=f"{FAR if joint.one_sided else '-' + angle} {angle}",
                stiffness=_number(MM * joint.with_ring(rig.closure.stiffness_Nmm_per_rad)),
            )
            _add(closed, "joint", joint=f"joint{i}", coef="1")


def _drive(root: Element, model: _Model) -> None:
    """Add an actuator in metres at the wheel's rim, and sensors."""
    radius = MM * model.rig.wheel.radius_mm
    stiffness = _drive_stiffness(model.rig)
    actuator = _add(root, "actuator")
    _add(actuator, "position", name="drive", joint="drive", gear=_number(radius), kp=_number(stiffness))
    sensor = _add(root, "sensor")
    _add(sensor, "tendonpos", name="bending", tendon="bending")
    _add(sensor, "framepos", name="tip", objtype="site", objname="tip")


def _add(parent: Element, tag: str, **attributes: str) -> Element:
    return ElementTree.SubElement(parent, tag, attributes)


def _number(value: float) -> str:
    return f"{value:.9g}"


def _numbers(*values: float) -> str:
    return " ".join(map(_number, values))
