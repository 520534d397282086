"""The law of a measured joint from its curve: the curve comes back, engines that lack it say so."""

import math
import re
from dataclasses import replace

import meshio
import numpy as np
import pytest

from fem_models.analytic import simulate_analytic
from fem_models.joint import joint_mechanics
from fem_models.joint.law_of_curve import law_of_curve, without_law
from fem_models.joint.superelastic import flag_fibres
from fem_models.load import LoadProgram, triangle
from fem_models.multibody import solve_multibody
from fem_models.rig import RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.joints import MeasuredJoint
from fem_models.spatial.rig import spatial_rig
from studies.drawings.curves import curve_of_vtu, rig_of_curve
from studies.export import write_model

BASE = preset("du2018")
UP = np.radians(np.linspace(0.0, 6.0, 41))
LOOP = np.concatenate([UP, UP[-2::-1]])


def softening(angle):
    """Moment, Nmm, of an elastic joint that softens: 100 tanh(4 angle)."""
    return 100 * np.tanh(4 * angle * 3)


def flag(angle):
    """A plateau at 60 Nmm from 3 deg on, and back at 30."""
    k, up = 60 / math.radians(3), angle[: len(UP)]
    loading = np.minimum(k * up, 60.0)
    back = np.minimum(np.maximum(60 + k * (angle[len(UP) :] - UP[-1]), 30.0), k * angle[len(UP) :])
    return np.concatenate([loading, back])


@pytest.mark.parametrize(("angle", "moment"), [(UP, softening(UP)), (LOOP, flag(LOOP))])
def test_law_follows_its_curve(angle, moment):
    law = law_of_curve(angle, moment, "curve.csv")
    assert law.most < 0.04  # a sharp kink between two of the onsets that the fit chooses from
    joint = law.joint(14, 2.6)
    found = flag_fibres(replace(BASE, joint=joint))
    assert found.stiffness == pytest.approx(law.elements.stiffness)
    assert found.upper_Nmm == pytest.approx(law.elements.upper_Nmm)
    assert found.lower_Nmm == pytest.approx(law.elements.lower_Nmm)
    assert joint_mechanics(replace(BASE, joint=joint)).spring_Nmm_per_rad == 0.0


def test_a_curve_that_stiffens_is_refused():
    with pytest.raises(RigError, match="nowhere stiffer than at its beginning") as error:
        law_of_curve(UP, UP**3, "curve.csv")
    assert "\n" not in str(error.value)


def test_csv_becomes_the_joints_of_a_rig_file(tmp_path):
    from fem_models.rig import read_rig
    from studies.drawings.imported import rig_file

    path = tmp_path / "curve.csv"
    rows = zip(np.degrees(UP).tolist(), (softening(UP) / 1e3).tolist(), strict=True)
    path.write_text("angle_deg,moment_Nm\n" + "".join(f"{a},{m}\n" for a, m in rows))
    rig, _ = rig_of_curve(path, BASE)
    assert rig.joint.flexure_stiffness_Nmm_per_rad == pytest.approx(1200, rel=0.02)
    assert rig.joint.rigid_gap_mm == pytest.approx(joint_mechanics(BASE).rigid_gap_mm)
    (tmp_path / "rig.toml").write_text(rig_file(rig, "curve.csv"))
    assert read_rig(tmp_path / "rig.toml") == rig


def test_engines_without_the_law_say_so_in_one_line(tmp_path):
    rig = replace(BASE, joint=law_of_curve(UP, softening(UP), "a").joint(14, 2.6))
    for call in (
        lambda: simulate_analytic(rig, triangle(1.0)),
        lambda: spatial_rig(rig),
        lambda: write_model(rig, tmp_path / "a.xml", to="mujoco", amplitude_mm=1.0),
    ):
        with pytest.raises(RigError, match="law_share"):
            call()
    simulate_analytic(replace(rig, joint=without_law(rig.joint)), triangle(1.0))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"law_share": (0.5, 0.4)}, "rig.law_share = 0.9 in sum: expected 1 in sum"),
        ({"law_return": (1.5, 1.0)}, "rig.law_return = 1.5: expected above 0, at most 1"),
        ({"law_span_deg": (1.0,)}, "rig.law_span_deg = 1 numbers: expected 2"),
        ({"hardening_slope": 0.1}, "rig.hardening_slope = 0.1: expected 0 with a law"),
    ],
)
def test_refuses_an_impossible_law(change, said):
    law = {"law_share": (0.5, 0.5), "law_onset_deg": (1.0, 2.0), "law_return": (1.0, 1.0), "law_span_deg": (9.0, 9.0)}
    with pytest.raises(RigError, match=said):
        MeasuredJoint(3, 2.0, 100.0, **{**law, **change})


def test_steps_of_finite_elements(tmp_path):
    """Two faces of a block, the far one turned by 4 and 8 deg about y and moved; two forces make the couple."""
    points = np.array([(x, y, z) for z in (-1.0, 1.0) for x in (-0.5, 0.5) for y in (-0.5, 0.5)])
    for number, degrees in ((1, 4.0), (2, 8.0)):
        turn, far = math.radians(degrees), points[:, 2] > 0
        moved, force = np.zeros_like(points), np.zeros_like(points)
        x, z = points[far, 0], points[far, 2] - 1.0
        moved[far, 0] = x * math.cos(turn) + z * math.sin(turn) - x + 0.1
        moved[far, 2] = -x * math.sin(turn) + z * math.cos(turn) - z
        force[far, 2] = -np.sign(x) * degrees / math.cos(turn)  # over arms of cos(turn): 4 nodes of 0.5 each
        mesh = meshio.Mesh(points, [("hexahedron", [[0, 1, 3, 2, 4, 5, 7, 6]])], {"U": moved, "RF": force})
        mesh.write(tmp_path / f"step-{number}.vtu")
    angle, moment = curve_of_vtu(tmp_path / "step-1.vtu")
    assert np.degrees(angle) == pytest.approx([0, 4, 8])
    assert moment == pytest.approx([0, 8, 16])


@pytest.mark.slow
def test_rings_that_meet_along_the_tendon_are_told_in_one_line():
    """A flat curve bends one joint alone; its rings meet at 2 asin(pitch / 5 over twice the arm), by hand."""
    rig = replace(BASE, joint=law_of_curve(UP, softening(UP), "a").joint(1, 2.6))
    meet = math.degrees(2 * math.asin(0.2 * 2.6 / (2 * BASE.tendon_a.moment_arm_mm)))
    with pytest.raises(SolverError, match="where its rings meet along the tendon") as error:
        solve_multibody(rig, LoadProgram(np.linspace(0.0, 1.4, 5)))
    assert "\n" not in str(error.value)
    assert float(re.search(r"bent to ([\d.]+) deg", str(error.value)).group(1)) == pytest.approx(meet, rel=0.02)
