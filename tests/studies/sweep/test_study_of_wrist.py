"""Studies of a rig that bends in space: quantities of a case, numbers that may be varied, and what is refused."""

import numpy as np
import pytest
from small_study import study_file

from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig_file import any_rig_of_tables
from fem_models.spatial.motion.workspace import tip_compliance, workspace
from hysteresis.records.sidecar import toml
from studies.commands.cli import call
from studies.sweep import open_study, read_study, run_study
from studies.sweep.cases import evaluate
from studies.sweep.inputs import CaseInputs, CaseTables, ProgramTable, with_values
from studies.sweep.plan import cases, plan_of
from studies.sweep.study_file import ready_studies
from studies.sweep.wrist import CIRCLES, DIRECTIONS

TEXT = """schema = 1
[rig]
file = "wrist.toml"
[program]
amplitude_mm = 0.6
step_mm = 0.1
[vary]
friction.capstan_coefficient = [0.0, 0.15]
[quantities]
groups = ["planes"]
"""
GROUPS = ("planes", "workspace", "compliance")


@pytest.fixture
def folder(tmp_path):
    """A folder with a wrist of six notches and four tendons."""
    tables = any_preset("zhang2026").to_dict() | {"name": "mine"}
    tables["notch"] |= {"count": 6, "turn_deg": [0, 90, 0, 90, 0, 90]}
    (tmp_path / "wrist.toml").write_text(toml(tables))
    return tmp_path


def base(folder, **program) -> CaseTables:
    tables = read_study(study_file(folder, TEXT)).tables
    return CaseTables(tables.rig, ProgramTable(**{"amplitude_mm": 0.6, "cycles": 1, "step_mm": 0.1, **program}))


def found(tables: CaseTables, groups=GROUPS):
    outcome = evaluate("k", CaseInputs(tables.rig, tables.program, "chain-in-space", groups, 0))
    assert outcome.status == "ok", outcome.message
    return outcome.quantities


def test_quantities_are_those_of_workspace_and_compliance(folder):
    tables = base(folder)
    q, rig = found(tables), any_rig_of_tables(tables.rig, "wrist")
    reach = workspace(rig, 0.6, circles=CIRCLES, directions=DIRECTIONS)
    assert q["area_mm2"] == reach.area_mm2(reach.forth_mm)
    assert q["area_without_friction_mm2"] == reach.area_mm2(reach.smooth_mm)
    assert q["largest_spread_mm"] == reach.spread_mm.max() > 0
    held = np.linalg.svd(tip_compliance(rig, np.array([0.6, 0.0])).held, compute_uv=False)[0]
    assert q["bent_compliance_held_mm_per_N"] == pytest.approx(held)
    assert q["straight_compliance_held_mm_per_N"] < q["straight_compliance_sliding_mm_per_N"]


def test_without_friction_there_is_no_loop_and_no_spread(folder):
    """A wrist without friction and loop of the material is a function of its drives."""
    q = found(with_values(base(folder), {"friction.capstan_coefficient": 0.0}))
    none = ("loop_width_1_deg", "lost_motion_1_mm", "loop_width_2_deg", "lost_motion_2_mm", "largest_spread_mm")
    assert [q[name] for name in none] == pytest.approx([0.0] * 5, abs=1e-8)
    assert q["area_mm2"] == pytest.approx(q["area_without_friction_mm2"], rel=1e-9)
    with_friction = found(base(folder), ("planes",))
    assert min(with_friction[name] for name in none[:4]) > 1e-4


def test_a_wrist_turned_as_a_whole_by_a_quarter_exchanges_its_planes(folder):
    """Tendons stand a quarter turn apart: notches turned by 90 degrees bend in the other plane."""
    straight = found(base(folder), ("planes",))
    turned = with_values(base(folder), {"notch.turn_step_deg": 90.0, "notch.turn_deg": 90.0})
    assert turned.rig["notch"]["turn_deg"] == [90.0, 180.0, 270.0, 360.0, 450.0, 540.0]
    q = found(turned, ("planes",))
    for name in ("full_scale_angle", "loop_width"):
        for k, other in ((1, 2), (2, 1)):
            assert q[f"{name}_{k}_deg"] == pytest.approx(straight[f"{name}_{other}_deg"], rel=1e-6)


@pytest.mark.parametrize(
    "values",
    [
        {"preload_N": 4.0},
        {"tendon.EA_N": 2e3},
        {"notch.depth_mm": 1.5},
        {"notch.width_mm": 0.5},
        {"notch.turn_deg": 45},
    ],
    ids=str,
)
def test_numbers_of_the_rig_matter(folder, values):
    tables = base(folder)
    changed = with_values(tables, values)
    assert found(changed, ("planes",))["full_scale_angle_1_deg"] != pytest.approx(
        found(tables, ("planes",))["full_scale_angle_1_deg"], rel=1e-4
    )


def test_a_study_is_run_from_its_file(folder):
    run_study(read_study(study_file(folder, TEXT)), folder / "out", workers=1)
    data = open_study(folder / "out")
    assert data.attrs["engine"] == "chain-in-space"
    assert (data.status == "ok").all()
    none, some = data.lost_motion_1_mm.values
    assert none < 1e-8 < 1e-3 < some


def test_the_ready_study_is_read():
    study = read_study(ready_studies()["two-planes"])
    assert study.groups == GROUPS
    assert len(plan_of(study)) == len(list(cases(study, plan_of(study).points())))


PLANAR = TEXT.replace('file = "wrist.toml"', 'preset = "du2018"')
BAD = {
    "engine": (TEXT.replace("schema = 1", 'schema = 1\nengine = "solid"'), "engine = 'solid': expected chain"),
    "group": (TEXT.replace('["planes"]', '["loop"]'), "quantities.groups = 'loop'"),
    "file": (TEXT.replace("amplitude_mm = 0.6\nstep_mm = 0.1", 'file = "drive.csv"'), "expected amplitude_mm"),
    "turn": (PLANAR.replace("friction.capstan_coefficient", "notch.turn_deg"), "bends in one plane"),
    "planar": (PLANAR.replace("schema = 1", 'schema = 1\nengine = "chain-in-space"'), "bends in one plane"),
    "effect": (TEXT.replace('"wrist.toml"', '"wrist.toml"\nbacklash.width_mm = 0.1'), "none in space"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_refused(folder, name, capsys):
    text, words = BAD[name]
    (folder / "drive.csv").write_text("drive_mm\n0\n1\n-1\n1\n")
    assert call(["study", str(study_file(folder, text)), "--out", str(folder / "out")]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
