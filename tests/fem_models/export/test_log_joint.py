"""The joint of a log: values of known joints with their intervals, what is left out, and the loop in MuJoCo."""

import functools
from xml.etree import ElementTree

import numpy as np
import pytest

from fem_models.export.log_joint import CONTROL, LogJoint, joint_of_log
from fem_models.export.log_mujoco import log_model
from hysteresis.files import RecordError
from hysteresis.laws.prandtl_ishlinskii import plays
from hysteresis.records.record import Record

ARM_MM = 5.0
NOISE_DEG = 0.05
ALL = {"frictionloss", "damping", "stiffness", "springref"}


def strokes(size: float, samples: int = 400) -> np.ndarray:
    return size * np.interp(np.linspace(0, 7, samples), np.arange(8), [0, 1, -1, 1, -0.5, 0.8, -1, 0])


def noisy(angle_rad: np.ndarray, noise_deg: float = NOISE_DEG, seed: int = 0) -> np.ndarray:
    return np.degrees(angle_rad) + noise_deg * np.random.default_rng(seed).standard_normal(len(angle_rad))


def driven(seed: int = 0) -> Record:
    """A gap of 0.8 mm at -0.10472 rad/mm."""
    drive = strokes(5.0)
    return Record(drive, noisy(np.radians(-6 * plays(drive, [0.4])[0] + 3), seed=seed))


def pulled(seed: int = 0, samples: int = 400) -> Record:
    """0.05 N m/rad, friction of 0.002 N m, at rest at -0.2 rad."""
    force = 10 + strokes(10.0, samples)
    moment = 1e-3 * ARM_MM * force
    return Record(force, noisy(plays(moment, [0.002])[0] / 0.05 - 0.2, seed=seed), drive_unit="N")


@functools.cache
def damped(rates=(0.25, 1.0), seed: int = 0) -> Record:
    """0.12 N m/rad, friction of 0.008 N m, damping of 0.006 N m s/rad, at rest at 0.05 rad; 16 s of two sines."""
    k, friction, d, rest = 0.12, 0.008, 0.006, 0.05
    fine = np.arange(0, 16, 0.001)
    moment = 0.05 * np.sin(2 * np.pi * np.where(fine < 8, rates[0] * fine, rates[1] * (fine - 8)))
    angle = np.empty(fine.size)
    now = rest
    for j, one in enumerate(moment):  # d v = M - k (angle - rest), less friction
        free = one - k * (now - rest)
        now += 0.001 / (d + 0.001 * k) * (free - min(friction, max(-friction, free)))
        angle[j] = now
    every = slice(None, None, 10)
    return Record(moment[every] / (1e-3 * ARM_MM), noisy(angle[every], seed=seed), drive_unit="N", time_s=fine[every])


def tendons(noise_deg: float = 0.02) -> Record:
    """A gap of 0.6 mm at 0.1 rad/mm, a drive of 1 N m/rad, an axis of 0.1 N m/rad with friction of 0.01 N m."""
    drive = strokes(5.0)
    wheel = 0.1 * plays(drive, [0.3])[0]
    angle = (plays(wheel, [0.01])[0] + 0.1 * 0.02) / 1.1
    tension = 20 + (wheel - angle) / (1e-3 * ARM_MM)
    return Record(drive, noisy(angle, noise_deg), tension_a_N=tension, tension_b_N=np.full(400, 20.0))


def near(joint: LogJoint, true: dict[str, float], within: float) -> None:
    assert set(true) <= set(joint.values)
    for name, value in true.items():
        found = joint.values[name]
        assert found.value == pytest.approx(value, rel=within, abs=2e-3), name
        assert found.low < found.value < found.high
        # twice the distance of the 95 % ends: 1 in 10,000 is outside
        half = found.high - found.low
        assert found.value - half <= value <= found.value + half, name


@functools.cache
def of_damped() -> LogJoint:
    return joint_of_log(damped(), ARM_MM)


# --- values ------------------------------------------------------------------------------------------------------


def test_the_play_of_a_drive_is_backlash():
    joint = joint_of_log(driven(), None)
    near(joint, {"backlash": 0.8 * np.radians(6), "gain": -1e3 * np.radians(6), "zero": np.radians(3)}, 0.01)
    assert set(joint.missing) == ALL
    assert all("no force" in why for why in joint.missing.values())


def test_a_force_tells_friction_and_spring():
    joint = joint_of_log(pulled(), ARM_MM)
    near(joint, {"frictionloss": 0.002, "stiffness": 0.05, "springref": -0.2}, 0.01)
    assert joint.missing["damping"].startswith("the record has no time")
    assert joint.missing["backlash"].startswith("a force drives")


def test_two_rates_tell_damping_from_friction():
    joint = of_damped()
    near(joint, {"frictionloss": 0.008, "stiffness": 0.12, "springref": 0.05, "damping": 0.006}, 0.01)


def test_one_rate_does_not_tell_damping():
    joint = joint_of_log(damped(rates=(0.5, 0.5)), ARM_MM)
    assert "damping" not in joint.values
    assert joint.missing["damping"].startswith("one rate")


def test_no_damping_is_left_out_with_its_bound():
    n = 1200  # three times as fast after the middle
    time_s = np.cumsum(np.where(np.arange(n) < n // 2, 0.03, 0.01))
    force = 10 + 10 * np.sin(2 * np.pi * np.arange(n) / 200)
    moment = 1e-3 * ARM_MM * force
    angle = noisy(plays(moment, [0.002])[0] / 0.05)
    joint = joint_of_log(Record(force, angle, drive_unit="N", time_s=time_s), ARM_MM)
    assert "damping" not in joint.values
    assert "not told from 0: at most" in joint.missing["damping"]
    assert joint.number("frictionloss") == pytest.approx(0.002, rel=0.02)


def test_tensions_tell_backlash_from_friction_that_winds_the_drive_up():
    joint = joint_of_log(tendons(), ARM_MM)
    near(joint, {"backlash": 0.06, "gain": 100.0, "drive_stiffness": 1.0}, 0.12)
    near(joint, {"frictionloss": 0.01, "stiffness": 0.1, "springref": 0.02}, 0.01)
    # without the tensions all of it is lost motion: 0.6 mm + 2 * 0.01 N m / (1 N m/rad * 0.1 rad/mm), at 1 / 1.1
    record = tendons()
    alone = joint_of_log(Record(record.drive, record.angle_deg), None)
    assert alone.number("backlash") == pytest.approx(0.8 * 0.1 / 1.1, rel=0.01)


def test_noise_hides_the_stiffness_of_the_drive():
    joint = joint_of_log(tendons(noise_deg=0.5), ARM_MM)
    assert "drive_stiffness" not in joint.values
    assert "the noise is" in joint.missing["drive_stiffness"] or "rigid" in joint.missing["drive_stiffness"]


def test_a_loop_without_width_has_no_friction_and_no_backlash():
    drive = strokes(5.0)
    assert "at most" in joint_of_log(Record(drive, noisy(0.1 * drive)), None).missing["backlash"]
    found = joint_of_log(Record(10 + drive, noisy(0.1 * drive), drive_unit="N"), ARM_MM)
    assert "at most" in found.missing["frictionloss"]
    assert found.number("stiffness") == pytest.approx(0.05, rel=0.01)


def test_tensions_without_arm_have_no_moment():
    joint = joint_of_log(tendons(), None)
    assert set(joint.missing) == ALL
    assert "--moment-arm" in joint.missing["frictionloss"]


@pytest.mark.parametrize(
    ("record", "arm", "said"),
    [
        (pulled(), None, "moment arm: missing"),
        (Record(np.arange(9.0), np.arange(9.0)), None, "never reverses"),
        (Record(strokes(1.0), np.full(400, 2.0)), None, "angle = 2 throughout"),
        (Record(strokes(1.0), strokes(1.0), tension_a_N=np.full(400, 7.0)), 5.0, "force = 7 N throughout"),
    ],
)
def test_refuses_in_one_line(record, arm, said):
    with pytest.raises(RecordError, match=said) as error:
        joint_of_log(record, arm)
    assert "\n" not in str(error.value)


def test_intervals_cover():
    """95 % of 20 logs with other noise: fewer than 14 within has a chance of 1 in 3,000."""
    true = {"frictionloss": 0.002, "stiffness": 0.05, "springref": -0.2}
    within = dict.fromkeys(true, 0)
    for seed in range(20):
        joint = joint_of_log(pulled(seed=seed, samples=160), ARM_MM)
        for name, value in true.items():
            within[name] += joint.values[name].low <= value <= joint.values[name].high
    assert min(within.values()) >= 15


# --- the file ----------------------------------------------------------------------------------------------------


def comments(text: str) -> list[str]:
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    return [(one.text or "").strip() for one in ElementTree.fromstring(text, parser) if one.tag is ElementTree.Comment]


def test_every_value_stands_with_its_interval_and_what_is_missing_is_not_there():
    joint = joint_of_log(pulled(), ARM_MM)
    text = log_model(joint)
    root = ElementTree.fromstring(text)
    axis = root.find(".//joint[@name='axis']")
    for name in ("frictionloss", "stiffness", "springref"):
        assert float(axis.get(name)) == pytest.approx(joint.number(name), rel=1e-8)
        assert any(one.startswith(f"{name} = ") and "95 %: " in one for one in comments(text))
    assert axis.get("damping") is None
    assert any(one.startswith("Not in the log: damping: the record has no time") for one in comments(text))
    assert root.find(".//joint[@name='backlash']") is None


def test_backlash_is_a_second_joint_with_a_range():
    joint = joint_of_log(driven(), None)
    root = ElementTree.fromstring(log_model(joint))
    low, high = map(float, root.find(".//joint[@name='backlash']").get("range").split())
    assert high == pytest.approx(joint.number("backlash") / 2, rel=1e-8)
    assert low == -high
    axis = root.find(".//joint[@name='axis']")
    assert not {"stiffness", "damping", "springref"} & set(axis.keys())


def test_a_title_cannot_leave_its_comment():
    record = Record(strokes(1.0), strokes(1.0), title='x ---> <option/> \x00 <!-- "')
    assert len(ElementTree.fromstring(log_model(joint_of_log(record, None))).findall("option")) == 1


# --- the loop in MuJoCo ------------------------------------------------------------------------------------------


def replayed(joint: LogJoint, seconds: float | None = None) -> np.ndarray:
    """Drive the model by the record, in its own time or in so many seconds; its angle, deg, at the samples."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: the extras bench and dev have it")
    model = mujoco.MjModel.from_xml_string(log_model(joint))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    record, step = joint.record, model.opt.timestep
    time_s = np.linspace(0, seconds, record.drive.size) if seconds else record.time_s - record.time_s[0]
    at = step * np.arange(1, round(time_s[-1] / step) + 1)
    found = []
    for control in CONTROL[record.drive_unit][1] * np.interp(at, time_s, record.drive):
        data.ctrl[0] = control
        mujoco.mj_step(model, data)
        found.append(data.qpos[0])
    return np.degrees(np.interp(time_s, at, found))


@pytest.mark.parametrize(
    ("joint", "seconds", "within"),
    [
        (lambda: joint_of_log(driven(), None), 20.0, 0.15),
        (lambda: joint_of_log(pulled(), ARM_MM), 20.0, 0.15),
        (of_damped, None, 0.2),
        (lambda: joint_of_log(tendons(), ARM_MM), 40.0, 0.1),
    ],
    ids=["backlash", "friction", "damping", "backlash and friction"],
)
def test_mujoco_follows_the_record(joint, seconds, within):
    joint = joint()
    found = replayed(joint, seconds)
    # of the loops, which are 4.8, 4.6, 7.6 and 4.2 deg wide without damping
    assert np.abs(found - joint.predicted_deg).max() < within
    error = np.sqrt(np.mean((found - joint.record.angle_deg) ** 2))
    assert error < 1.5 * joint.rmse_deg + 0.02
    assert joint.rmse_deg < 0.06
    assert 0.3 * joint.rmse_deg < joint.noise_deg < 1.5 * joint.rmse_deg


def test_the_start_within_a_gap_is_kept():
    drive = strokes(5.0)
    record = Record(drive, noisy(0.1 * plays(drive, [0.4], [0.3])[0]))
    joint = joint_of_log(record, None)
    assert joint.predicted_deg[0] == pytest.approx(np.degrees(0.03), abs=0.05)
    assert replayed(joint, 10.0)[0] == pytest.approx(joint.predicted_deg[0], abs=0.05)
