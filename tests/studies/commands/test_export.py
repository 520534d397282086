"""``notchbend export`` and ``nb.export``: the files, and what is refused."""

from xml.etree import ElementTree

import pytest

import notchbend as nb
from studies.commands.cli import call

EXPORT = ["export", "--to", "mujoco", "--preset", "du2018", "--preload", "10", "--amplitude", "0.5", "--quiet"]


def test_writes_model_and_table(tmp_path):
    assert call([*EXPORT, "--out", str(tmp_path / "rig.xml")]) == 0
    assert ElementTree.parse(tmp_path / "rig.xml").getroot().get("model") == "du2018"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["rig-guides.csv", "rig.xml"]


def test_python_writes_the_same(tmp_path):
    call([*EXPORT, "--out", str(tmp_path / "rig.xml")])
    rig = nb.preset("du2018", preload_N=10)
    model, table = nb.export(rig, tmp_path / "again.xml", to="mujoco", amplitude_mm=0.5)
    assert model.read_bytes() == (tmp_path / "rig.xml").read_bytes()
    assert table.read_bytes() == (tmp_path / "rig-guides.csv").read_bytes()
    with pytest.raises(ValueError, match="expected one of mujoco"):
        nb.export(rig, tmp_path / "other.xml", to="drake")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (["--out", "rig.csv"], "expected a name that ends in .xml"),
        (["--out", "rig.xml", "--amplitude", "0"], "amplitude_mm = 0.0: expected above 0"),
        (["--out", "rig.xml", "--amplitude", "nan"], "amplitude_mm = nan: expected above 0"),
        (["--out", "rig.xml", "--amplitude", "400"], "expected a smaller drive"),
        (["--out", "rig.xml", "--to", "drake"], "'mujoco'"),
    ],
)
def test_refuses_in_one_line_and_writes_nothing(tmp_path, monkeypatch, capsys, change, said):
    monkeypatch.chdir(tmp_path)
    assert call([*EXPORT, *change]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())
