"""The joint of a log as MJCF, the model file of MuJoCo: one hinge with its values, and a second one for backlash.

``backlash`` is a hinge of the motor in the wheel, with the gap as its range; the actuator turns both together. What is
not measured, such as inertia, is chosen for the solver, and a comment says so. Units: m, N, kg, rad, s.
"""

from __future__ import annotations

from xml.etree import ElementTree

from fem_models.export.log_joint import CONTROL, LogJoint
from fem_models.export.mujoco import FRICTION, HOLD, LEAST_MASS_KG, NOSLIP_ITERATIONS, TIME_STEP_S, WHEEL
from hysteresis.fitting.uncertainty import Parameter

FASTEST = 0.5
"""Radians a step of each mode: slow enough for the integrator, fast against the drive."""
FREE_INERTIA = 1e-4
"""Inertia of an axis whose moments are not known, kg m2."""
HELD = 1e-3
"""Angle by which a motor gives way to the friction that holds an axis of unknown moments, over the gap."""
OF_AXIS = ("frictionloss", "damping", "stiffness", "springref")
"""Values that are attributes of the axis, by the names of MuJoCo."""

Element = ElementTree.Element


def log_model(joint: LogJoint) -> str:
    """Write the joint as MJCF; comments give each value with its interval, and say what the log does not tell.

    Returns
    -------
    The text of the file.
    """
    root = Element("mujoco", model=_printable(joint.name))
    chosen = dict[str, str]()
    world, tendons, actuator = Element("worldbody"), Element("tendon"), Element("actuator")
    if joint.gain == 0:
        _by_force(world, actuator, joint, chosen)
    else:
        _by_drive(world, tendons, actuator, joint, chosen)
    for note in _notes(joint, chosen):
        root.append(ElementTree.Comment(f" {_printable(note)} ".replace("--", "- -").replace("--", "- -")))
    _add(root, "compiler", angle="radian", autolimits="true")
    option = _add(
        root,
        "option",
        timestep=_number(TIME_STEP_S),
        integrator="implicitfast",
        gravity="0 0 0",
        noslip_iterations=str(NOSLIP_ITERATIONS),
        noslip_tolerance="0",
    )
    _add(option, "flag", contact="disable")
    _add(
        _add(root, "default"),
        "joint",
        solreflimit=FRICTION["solreffriction"],
        solimplimit=FRICTION["solimpfriction"],
        **FRICTION,
    )
    root.append(world)
    if len(tendons):
        root.append(tendons)
    root.append(actuator)
    _add(_add(root, "sensor"), "jointpos", name="angle", joint="axis")
    names = [str(one.get("name")) for one in world.iter("joint")]
    axis, wheel, motor = joint.start
    at = {"axis": axis, "wheel": wheel, "backlash": motor - wheel}
    control = _number(CONTROL[joint.record.drive_unit][1] * float(joint.record.drive[0]))
    start = " ".join(_number(at[name]) for name in names)
    _add(_add(root, "keyframe"), "key", name="start", qpos=start, ctrl=control)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _notes(joint: LogJoint, chosen: dict[str, str]) -> list[str]:
    unit = CONTROL[joint.record.drive_unit][0]
    arm = "" if joint.moment_arm_mm is None else f", moment arm {joint.moment_arm_mm:g} mm, taken as exact"
    return [
        f"log {joint.name}, made by notchbend. The axis as one hinge{arm}. Units: m, N, kg, rad, s.",
        f"Drive: the control is that of the record in {unit}. The sensor 'angle' is its angle in rad. The key frame "
        "'start' is its first sample.",
        *(f"{name} = {_with_interval(value)}" for name, value in joint.values.items()),
        *(f"Not in the log: {name}: {why}." for name, why in joint.missing.items()),
        *_of_backlash(joint),
        f"The loop of these values is {joint.rmse_deg:.3g} deg rms from the record, whose noise is "
        f"{joint.noise_deg:.2g} deg. A joint of MuJoCo has one spring and one friction: a curved or rounded loop is "
        "not in it.",
        "Chosen for the solver, not measured: " + "; ".join(f"{name} {words}" for name, words in chosen.items()) + ".",
    ]


def _of_backlash(joint: LogJoint) -> list[str]:
    if "backlash" not in joint.values or "stiffness" in joint.values:
        return []
    return ["backlash is all lost motion between drive and angle: play, and what stretches against friction."]


def _with_interval(value: Parameter) -> str:
    unit = "" if value.unit == "1" else f" {value.unit}"
    if value.low is None or value.high is None:
        return f"{value.value:.6g}{unit}, no interval"
    return f"{value.value:.6g}{unit}, 95 %: {value.low:.6g} to {value.high:.6g}"


def _axis(world: Element, joint: LogJoint, armature: float, **more: str) -> Element:
    body = _body(world, "link")
    known = {name: _number(joint.values[name].value) for name in OF_AXIS if name in joint.values}
    _add(body, "joint", name="axis", type="hinge", axis="0 0 1", armature=_number(armature), **known, **more)
    return body


def _body(parent: Element, name: str) -> Element:
    body = _add(parent, "body", name=name)
    small = _number(1e-6 * LEAST_MASS_KG)
    _add(body, "inertial", pos="0 0 0", mass=_number(LEAST_MASS_KG), diaginertia=f"{small} {small} {small}")
    _add(body, "geom", type="capsule", fromto="0 0 0 0.02 0 0", size="0.002", mass="0", contype="0", conaffinity="0")
    return body


def _by_force(world: Element, actuator: Element, joint: LogJoint, chosen: dict[str, str]) -> None:
    assert joint.moment_arm_mm is not None
    armature = _armature(joint.number("stiffness"))
    chosen["armature"] = f"{armature:.3g} kg m2"
    _axis(world, joint, armature)
    _add(actuator, "motor", name="drive", joint="axis", gear=_number(1e-3 * joint.sign * joint.moment_arm_mm))


def _by_drive(world: Element, tendons: Element, actuator: Element, joint: LogJoint, chosen: dict[str, str]) -> None:
    """Add the motor, whose place in the wheel is the second hinge; the wheel is the axis, or turns it by a spring."""
    gap, own = joint.number("backlash"), joint.number("stiffness")
    if own > 0:
        stiff = joint.number("drive_stiffness")
        if stiff == 0:
            stiff = WHEEL * own
            chosen["drive_stiffness"] = f"{stiff:.3g} N m/rad"
        armature = _armature(own + stiff)
        _axis(world, joint, armature)
        chosen["armature of the axis"] = f"{armature:.3g} kg m2"
        servo, wheel = WHEEL * stiff, "wheel"
        inertia = _armature(servo + stiff)
        hold = HOLD * joint.largest_moment_Nm
        body = _body(world, wheel)
        held = {"frictionloss": _number(hold)} if gap else {}
        _add(body, "joint", name=wheel, type="hinge", axis="0 0 1", armature=_number(inertia), **held)
        spring = _add(tendons, "fixed", name="drive_spring", springlength="0 0", stiffness=_number(stiff))
        _add(spring, "joint", joint=wheel, coef="1")
        _add(spring, "joint", joint="axis", coef="-1")
    else:
        inertia, wheel = FREE_INERTIA, "axis"
        servo = inertia * (FASTEST / TIME_STEP_S) ** 2
        hold = HELD * servo * gap
        body = _axis(world, joint, inertia, **({"frictionloss": _number(hold)} if gap else {}))
    chosen["armature of motor and wheel"] = f"{inertia:.3g} kg m2"
    motor = _add(tendons, "fixed", name="motor")
    _add(motor, "joint", joint=wheel, coef="1")
    if gap:
        chosen[f"frictionloss of {wheel}, which holds it in the gap,"] = f"{hold:.3g} N m"
        rotor = _body(body, "motor")
        ends = f"{_number(-gap / 2)} {_number(gap / 2)}"
        _add(rotor, "joint", name="backlash", type="hinge", axis="0 0 1", range=ends, armature=_number(inertia))
        _add(motor, "joint", joint="backlash", coef="1")
    _servo(actuator, joint, servo, inertia)
    chosen["stiffness of the motor"] = f"{servo:.3g} N m/rad"


def _servo(actuator: Element, joint: LogJoint, stiffness: float, inertia: float) -> None:
    """Add a servo: moment = stiffness (zero + gain control - angle of the motor) - damping, critical for the motor."""
    gear = 1 / joint.gain
    gain, damping = stiffness / gear**2, 2 * (stiffness * inertia) ** 0.5 / gear**2
    bias = " ".join(map(_number, (gain * gear * joint.zero_rad, -gain, -damping)))
    _add(
        actuator,
        "general",
        name="drive",
        tendon="motor",
        gear=_number(gear),
        gainprm=_number(gain),
        biastype="affine",
        biasprm=bias,
    )


def _armature(stiffness: float) -> float:
    return float(stiffness * (TIME_STEP_S / FASTEST) ** 2)


def _printable(text: str) -> str:
    return "".join(one if one.isprintable() else " " for one in text)


def _add(parent: Element, tag: str, **attributes: str) -> Element:
    return ElementTree.SubElement(parent, tag, attributes)


def _number(value: float) -> str:
    return f"{value:.9g}"
