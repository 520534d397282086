"""The exported rig: what the file has and says it has lost, and the loop that MuJoCo makes of it."""

import csv
import io
from dataclasses import replace
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.export import guide_table, mujoco_model
from fem_models.export.loop import guide_loop
from fem_models.export.mujoco import SPEED_MM_PER_S, TIME_STEP_S
from fem_models.export.mujoco_notes import KEPT
from fem_models.export.springs import springs
from fem_models.joint import joint_mechanics
from fem_models.load import LoadProgram
from fem_models.rig import effects, preset
from fem_models.rig.rig import EFFECT_TABLES, Friction, Rig, Tendon
from fem_models.rig.tendon_law import tendon_tension_N

AMPLITUDE = 2.2
EFFECTS = {
    "slack": effects.Slack(0.1, -0.1),
    "backlash": effects.Backlash(0.2),
    "eccentricity": effects.Eccentricity(0.1),
    "superelastic": effects.Superelastic(),
    "closure": effects.Closure(1000.0),
    "gravity": effects.Gravity(0.1),
    "tip_stop": effects.TipStop(20.0, 1.0),
    "creep": effects.Creep(0.1, 10.0),
    "drag": effects.Drag(0.1),
    "preload_loss": effects.PreloadLoss(0.1, 10.0),
    "fatigue": effects.Fatigue(0.1, 0.1, 10.0),
    "tip_load": effects.TipLoad(0.05, 90.0),
    "drive_gain": effects.DriveGain(0.02),
    "stribeck": effects.Stribeck(0.1, 1.0),
    "position_friction": effects.PositionFriction(0.1),
    "run_in": effects.RunIn(0.1, 10.0),
    "tip_mass": effects.TipMass(1.0),
}


def exported(rig: Rig, amplitude: float = AMPLITUDE) -> str:
    return mujoco_model(rig, guide_loop(rig, amplitude))


def parsed(text: str) -> ElementTree.Element:
    return ElementTree.fromstring(text)


def comments(text: str) -> str:
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    return "\n".join(one.text or "" for one in ElementTree.fromstring(text, parser) if one.tag is ElementTree.Comment)


# --- the file ----------------------------------------------------------------------------------------------------


def test_rings_tendons_and_friction_are_there():
    rig = preset("du2018")
    root, joint = parsed(exported(rig)), joint_mechanics(rig)
    hinges = [one for one in root.iter("joint") if (one.get("name") or "").startswith("joint")]
    assert len(hinges) == rig.joints
    # 225.39 Nmm/rad of the flexure in series with the ring's 774,462
    assert float(hinges[0].get("stiffness")) == pytest.approx(1e-3 / (1 / 225.38997 + 1 / 774461.76), rel=1e-6)
    metal = [one for one in root.iter("joint") if (one.get("name") or "").startswith("metal")]
    assert len(metal) == 3 * rig.joints
    assert {float(one.get("frictionloss")) for one in metal} == {
        float(f"{1e-3 * one:.9g}") for one in joint.jenkins.slip_moment_Nmm
    }
    sites = {one.get("name") for one in root.iter("site") if one.get("name")}
    for spatial in root.iter("spatial"):
        assert {one.get("site") for one in spatial} <= sites
    whole = root.find(".//spatial[@name='tendon_a']")
    assert len(whole) == 2 * rig.joints + 1  # the bead, both ends of every hole, the anchor
    for side in "ab":
        slip = root.find(f".//joint[@name='slip_{side}']")
        dry = rig.friction.sheath_N + rig.friction.guide_N
        # the capstan adds (T + T) tanh(mu wrap / 2) of some 0.01 N
        assert dry < float(slip.get("frictionloss")) < dry + 0.05
        assert len(root.findall(".//spatial[@frictionloss]")) == 2 * (rig.joints - 1)


def test_solver_settings_hold_friction():
    option = parsed(exported(preset("du2018"))).find("option")
    assert int(option.get("noslip_iterations")) >= 5
    assert option.get("integrator") == "implicitfast"


def test_play_is_a_dead_band_between_drive_and_wheel():
    root = parsed(exported(replace(preset("du2018"), backlash=effects.Backlash(0.3))))
    band = root.find(".//fixed[@name='play']").get("springlength").split()
    assert [float(one) for one in band] == pytest.approx([-1.5e-4, 1.5e-4])
    assert float(root.find(".//joint[@name='wheel']").get("frictionloss")) > 0
    assert parsed(exported(preset("du2018"))).find(".//joint[@name='wheel']") is None


@pytest.mark.parametrize("name", EFFECT_TABLES)
def test_every_effect_is_kept_or_said_to_be_lost(name):
    rig = replace(preset("du2018"), **{name: EFFECTS[name]})
    text = exported(rig, 0.5)
    said = [line.strip() for line in comments(text).splitlines()]
    if name in KEPT:
        assert any(line.startswith("Kept:") and f"; {name}" in line for line in said)
    else:
        assert any(line.startswith(f"Lost: {name}: ") for line in said)
    if name in KEPT:  # it changes the model, not its comments alone
        plain = parsed(exported(preset("du2018"), 0.5))
        assert ElementTree.tostring(parsed(text)) != ElementTree.tostring(plain)


def test_a_load_across_the_weight_is_said_to_be_lost():
    rig = replace(preset("du2018"), gravity=effects.Gravity(0.1, -90.0), tip_load=effects.TipLoad(0.05, 0.0))
    assert "load on the tip, 0.05 N" in comments(exported(rig, 0.5))


def test_a_name_cannot_leave_its_comment():
    rig = replace(preset("du2018"), name='x --> <option timestep="9"/> \x00 <!-- "')
    root = parsed(exported(rig, 0.5))
    assert len(root.findall("option")) == 1


def test_springs_follow_the_toe_region():
    tendon = Tendon(EA_N=17_000.0, moment_arm_mm=2.64, free_length_mm=150.0, toe_N=40.0)
    law = springs(tendon, 20.0, 5.0, 60.0)
    stretch = np.linspace(-0.7, 0.6, 200)
    tension = tendon_tension_N(tendon, stretch, 20.0, 0.0)
    inside = (tension > 5) & (tension < 60)
    assert inside.sum() > 100
    np.testing.assert_allclose(law.tension_N(stretch)[inside], tension[inside], rtol=2.5e-3)
    assert law.tension_N(np.array([-100.0]))[0] == 0.0
    assert (law.stiffness_N_per_mm > 0).all()


# --- the table ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def table() -> list[dict[str, str]]:
    rig = replace(preset("du2018"), friction=Friction(capstan_coefficient=0.1, guide_N=0.2, rest_wrap_deg=30.0))
    return list(csv.DictReader(io.StringIO(guide_table(guide_loop(rig, AMPLITUDE)))))


def test_table_obeys_the_law_of_its_guides(table):
    assert len(table) == (2 + 4 + 4 + 1) * 2 * 14
    ends = [row for row in table if float(row["drive_mm"]) == AMPLITUDE and row["branch"] == "first"]
    for row in table:
        before, beyond = float(row["tension_before_N"]), float(row["tension_beyond_N"])
        limit = 0.2 + (before + beyond) * np.tanh(0.05 * np.radians(float(row["wrap_deg"])))
        assert float(row["friction_limit_N"]) == pytest.approx(limit, rel=1e-6)
        assert abs(before - beyond) <= limit + 1e-6
    sliding = [one for one in ends if one["tendon"] == "a"]
    for row in sliding:  # pulled all the way: every guide of tendon a slides
        drop = float(row["tension_before_N"]) - float(row["tension_beyond_N"])
        assert drop == pytest.approx(float(row["friction_limit_N"]), rel=1e-6)


def test_tension_is_passed_from_guide_to_guide(table):
    for one, other in pairwise(table):
        if other["guide"] != "0":
            assert one["tension_beyond_N"] == other["tension_before_N"]


# --- the loop in MuJoCo ------------------------------------------------------------------------------------------


class Followed:
    """The model of a rig in MuJoCo, whose drive moves at a constant speed."""

    def __init__(self, rig: Rig) -> None:
        self.mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: the extras bench and dev have it")
        self.model = self.mujoco.MjModel.from_xml_string(exported(rig))
        self.data, self.at = self.mujoco.MjData(self.model), 0.0

    def angle_at(self, drive_mm: float, speed_mm_per_s: float = 2 * SPEED_MM_PER_S) -> float:
        steps = max(1, round(abs(drive_mm - self.at) / (speed_mm_per_s * TIME_STEP_S)))
        for k in range(steps):
            self.data.ctrl[0] = 1e-3 * (self.at + (drive_mm - self.at) * (k + 1) / steps)
            self.mujoco.mj_step(self.model, self.data)
        self.at = drive_mm
        return float(np.degrees(self.data.sensordata[0]))

    def angle_after(self, time_s: float) -> float:
        self.mujoco.mj_step(self.model, self.data, round(time_s / TIME_STEP_S))
        return float(np.degrees(self.data.sensordata[0]))


@pytest.mark.parametrize("preload", [10.0, 20.0])
def test_mujoco_follows_the_loop_of_the_chain(preload):
    rig = preset("du2018", preload_N=preload)
    drive = AMPLITUDE * np.array([0.0, 0.25, 0.5, 0.75, 1.0, 0.9, 0.75, 0.5, 0.25, 0.0, -0.25, -0.5, -0.75, -1.0])
    expected = simulate_chain(rig, LoadProgram(drive)).angle_deg
    model = Followed(rig)
    found = np.array([model.angle_at(one) for one in drive])
    assert np.abs(found - expected).max() < 0.2


def test_mujoco_holds_where_the_drive_stops():
    model = Followed(preset("du2018"))
    model.angle_at(1.0)
    at_rest = model.angle_after(1.0)
    assert model.angle_after(5.0) == pytest.approx(at_rest, abs=1e-3)


def test_mujoco_has_play_and_weight():
    play = replace(preset("du2018"), backlash=effects.Backlash(0.4), gravity=effects.Gravity(0.3))
    drive = np.array([0.15, 1.0, 0.7])
    expected = simulate_chain(play, LoadProgram(np.array([0.0, *drive]))).angle_deg[1:]
    model = Followed(play)
    found = np.array([model.angle_at(one, SPEED_MM_PER_S) for one in drive])
    assert np.abs(found - expected).max() < 0.2


def test_mujoco_bends_a_rig_of_one_tendon():
    tube = preset("notched-wrist-90", preload_N=2.0)
    rig = replace(tube, superelastic=None, friction=Friction(guide_N=0.1))  # the file has no more of them
    drive = np.array([0.3, 0.6, 0.3])
    expected = simulate_chain(rig, LoadProgram(np.array([0.0, *drive]))).angle_deg[1:]
    model = Followed(rig)
    for one, angle in zip(drive, expected, strict=True):
        model.angle_at(one, 0.4 * SPEED_MM_PER_S)
        assert model.angle_after(0.2) == pytest.approx(angle, abs=0.2)
