"""``export --to dxf`` and the like, ``import``, and ``nb.export``: files there and back, and what is refused."""

import tomllib

import pytest

import notchbend as nb
from fem_models.rig import read_rig
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig_file import read_any_rig
from studies.commands.cli import call
from studies.drawings import DrawingChoice

WRIST = ["--preset", "notched-wrist-90"]
TABLE = "depth_mm,width_mm,spacing_mm,count\n1.40,0.5,1.5,5\n"
CURVE = "angle_deg,moment_Nmm\n" + "".join(f"{angle},{8 * angle}\n" for angle in range(16))


@pytest.fixture(autouse=True)
def inside(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def needs_ezdxf():
    pytest.importorskip("ezdxf", reason="ezdxf is not installed: the extras drawing and dev have it")


@pytest.mark.parametrize("beam", ["plane", "radial"])
def test_dxf_there_and_back(tmp_path, beam):
    """The rig file of the drawing is the rig that was drawn, and says what it is from; nothing else is written."""
    needs_ezdxf()
    assert call(["export", *WRIST, "--to", "dxf", "--kerf", "0.02", "--beam", beam, "--out", "a.dxf", "--quiet"]) == 0
    assert call(["import", "a.dxf", *WRIST, "--out", "again.toml", "--quiet"]) == 0
    found, rig = read_rig(tmp_path / "again.toml"), nb.preset("notched-wrist-90")
    assert found.to_dict()["tube"] == rig.to_dict()["tube"]
    one, other = found.to_dict()["notch"], rig.to_dict()["notch"]
    for name in ("depth_mm", "width_mm", "spacing_mm"):
        assert one[name] == pytest.approx(other[name], abs=1e-4)
    assert (one["shape"], one["count"]) == (other["shape"], other["count"])
    assert "# from a.dxf" in (tmp_path / "again.toml").read_text()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.dxf", "again.toml"]


def test_rig_in_space_there_and_back(tmp_path):
    needs_ezdxf()
    space = ["--preset", "zhang2026"]
    assert call(["export", *space, "--to", "dxf", "--out", "z.dxf", "--quiet"]) == 0
    assert call(["import", "z.dxf", *space, "--out", "z.toml", "--quiet"]) == 0
    found, rig = read_any_rig(tmp_path / "z.toml"), any_preset("zhang2026")
    assert found.to_dict()["notch"]["depth_mm"] == pytest.approx(rig.to_dict()["notch"]["depth_mm"], abs=1e-4)


def test_table_and_curve_become_rigs(tmp_path, capsys):
    (tmp_path / "notches.csv").write_text(TABLE)
    (tmp_path / "curve.csv").write_text(CURVE)
    assert call(["import", "notches.csv", *WRIST, "--out", "table.toml"]) == 0
    assert "notch.depth_mm: 1.4" in capsys.readouterr().out
    assert tomllib.loads((tmp_path / "table.toml").read_text())["notch"]["count"] == 5
    assert call(["import", "curve.csv", *WRIST, "--out", "curve.toml"]) == 0
    assert "stiffness at rest: 458.4 N mm/rad" in capsys.readouterr().out  # 8 N mm per deg
    assert read_rig(tmp_path / "curve.toml").joints == 5


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["export", *WRIST, "--to", "dxf", "--out", "a.svg"], "expected a name that ends in .dxf"),
        (["export", *WRIST, "--to", "svg", "--kerf", "0.02", "--out", "a.svg"], "expected --to dxf"),
        (["export", *WRIST, "--to", "dxf", "--kerf", "0.6", "--out", "a.dxf"], "kerf"),
        (["export", *WRIST, "--to", "dxf", "--beam", "round", "--out", "a.dxf"], "expected one of plane, radial"),
        (["export", *WRIST, "--to", "dxf", "--amplitude", "1", "--out", "a.dxf"], "expected --rig or --preset alone"),
        (["import", "notches.csv", *WRIST, "--out", "a.json"], "expected a name that ends in .toml"),
        (["import", "notches.csv", *WRIST, "--kerf", "0.02", "--out", "a.toml"], "expected a DXF"),
        (["import", "none.csv", *WRIST, "--out", "a.toml"], "none.csv"),
        (["import", "none.dxf", *WRIST, "--out", "a.toml"], "none.dxf"),
        (["import", "bad.csv", *WRIST, "--out", "a.toml"], "depth_mm = 'deep': expected a number"),
        (["import", "notches.csv", "--rig", "bench.toml", "--out", "a.toml"], "expected [tube] and [notch]"),
        (["import", "picture.png", *WRIST, "--out", "a.toml"], "expected a drawing"),
    ],
)
def test_refuses_in_one_line_and_writes_nothing(tmp_path, capsys, command, said):
    if "dxf" in " ".join(command):
        needs_ezdxf()
    (tmp_path / "notches.csv").write_text(TABLE)
    (tmp_path / "curve.csv").write_text(CURVE)
    (tmp_path / "bad.csv").write_text(TABLE.replace("1.40", "deep"))
    (tmp_path / "picture.png").write_bytes(b"")
    call(["import", "curve.csv", *WRIST, "--out", "bench.toml", "--quiet"])
    before = sorted(tmp_path.iterdir())
    capsys.readouterr()
    assert call([*command, "--quiet"]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("to", ["svg", "pdf", "dxf"])
def test_python_writes_the_same_drawing(tmp_path, to):
    if to == "dxf":
        needs_ezdxf()
    assert call(["export", *WRIST, "--to", to, "--out", f"one.{to}", "--quiet"]) == 0
    found = nb.export(nb.preset("notched-wrist-90"), tmp_path / f"two.{to}", to=to)
    assert found == (tmp_path / f"two.{to}",)
    assert found[0].read_bytes() == (tmp_path / f"one.{to}").read_bytes()


def test_python_draws_a_rig_in_space_and_refuses_what_is_no_rig(tmp_path):
    (path,) = nb.export("zhang2026", tmp_path / "z.svg", to="svg")
    assert "made by notchbend" in path.read_text()
    record = nb.simulate("du2018", nb.triangle(0.2, cycles=1), "analytic")
    with pytest.raises(ValueError, match="of a Record: expected a rig"):
        nb.export(record, tmp_path / "r.svg", to="svg")
    with pytest.raises(ValueError, match="cutting: of a flat pattern"):
        nb.export("du2018", tmp_path / "r.xml", cutting=DrawingChoice(0.02))
    with pytest.raises(nb.RecordError, match=r"ends in \.svg"):
        nb.export("du2018", tmp_path / "r.pdf", to="svg")
    with pytest.raises(nb.RigError, match="kerf_mm"):
        nb.export("du2018", tmp_path / "r.svg", to="svg", cutting=DrawingChoice(0.02))
