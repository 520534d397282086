"""Six stiffnesses of every notch of a rig in space, and `notchbend validate` of one."""

import functools
import json
from dataclasses import replace

import pytest

from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import with_notch
from fem_models.spatial import WheelProgram, simulate_in_space
from hysteresis.records.sidecar import toml
from studies.commands import wrist_comparison as comparison
from studies.commands.cli import call
from validation.joints.six_stiffnesses import compare_in_space

ZHANG = any_preset("zhang2026")
NOTCH = replace(ZHANG.joint.notch, count=4, depth_mm=(1.58, 1.58, 1.6, 1.6))
LAYOUT = replace(ZHANG.layout, turns_deg=ZHANG.turns_deg[:4])
WRIST = replace(ZHANG, joint=replace(ZHANG.joint, notch=NOTCH), layout=LAYOUT)


@pytest.mark.slow
def test_validate_compares_every_notch_and_the_bent_wrist(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(comparison, "compare_in_space", functools.partial(compare_in_space, refinement=0.35))
    (tmp_path / "wrist.toml").write_text(toml(WRIST.to_dict() | {"name": "mine"}))
    line = ["validate", "--rig", str(tmp_path / "wrist.toml"), "--amplitude", "0.1", "--out", str(tmp_path / "out")]
    assert call([*line, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown == json.loads((tmp_path / "out/six-stiffnesses.json").read_text())
    assert [one["depth_mm"] for one in shown["notches"]] == [1.58, 1.58, 1.6, 1.6]
    first, third = shown["notches"][0], shown["notches"][2]
    assert first["solid"] == shown["notches"][1]["solid"]
    for name in ("weak", "strong", "torsion", "shear_in"):  # a coarse mesh is stiffer than the metal
        assert first["solid"][name] > third["solid"][name]  # the deeper notch gives way
        assert first["ratio"][name] == pytest.approx(1.0, abs=0.25)
    assert shown["drives_mm"] == [[0.1, 0.0], [0.0, 0.1]]
    for k, models in enumerate(shown["bent"]):
        solid, section, multibody = (model["bending_deg"] for model in models)
        assert solid[k] == pytest.approx(section[k], rel=0.1)
        assert multibody == pytest.approx(section, abs=1e-3)
    record = simulate_in_space(WRIST, WheelProgram([[0.0, 0.0], [0.1, 0.0]]))
    assert shown["bent"][0][1]["bending_deg"][0] == pytest.approx(record.angle_deg[-1], abs=0.02)  # other steps
    assert call(["report", str(tmp_path / "out"), "--quiet"]) == 0
    page = (tmp_path / "out/report.html").read_text()
    assert '<th scope="row">1 to 2</th>' in page
    assert page.count("multibody, section") == 2
    assert call([*line, "--force"]) == 0
    text = capsys.readouterr().out
    assert text.count("0, 0.1") == 3  # solid, section, multibody


def test_a_model_without_equilibrium_is_left_out_with_a_note(monkeypatch):
    from fem_models.rig.checks import SolverError
    from validation.joints import six_stiffnesses

    def fails(*_):
        raise SolverError("none found")

    monkeypatch.setattr(six_stiffnesses, "solve_spatial_multibody", fails)
    alike = with_notch(WRIST, replace(NOTCH, depth_mm=1.6))
    found = compare_in_space(alike, amplitude_mm=0.1, refinement=0.3)
    assert found.notes == ("multibody, section: none found",) * 2
    assert [len(models) for models in found.bent] == [2, 2]
