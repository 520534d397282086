"""No command replaces a file that it did not write; it replaces its own, and with --force it says what it replaces."""

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib import image

from hysteresis.own import foreign, is_own, marked_page, marked_pdf, marked_png
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record, write_record
from studies.commands.cli import call
from studies.results import write_result

MEASURED = "drive_mm,angle_deg\n0,0\n1,20\n0,1\n-1,-20\n0,-1\n1,20\n"
SIDECAR = 'schema = 1\nkind = "measured"\n[columns]\ndrive = "drive_mm"\nangle = "angle_deg"\n'
SIMULATE = ["simulate", "--preset", "du2018", "--amplitude", "1", "--engine", "analytic", "--quiet", "--out"]
SEPARATE = ["separate", "--preset", "du2018", "--quiet", "--out"]


def test_a_measured_record_is_kept(tmp_path, capsys):
    loop = tmp_path / "loop.csv"
    loop.write_text(MEASURED)
    for sidecar in (None, SIDECAR, SIDECAR.replace("measured", "simulated")):  # a word of a hand is no mark
        if sidecar is not None:
            loop.with_suffix(".toml").write_text(sidecar)
        assert call([*SIMULATE, str(loop)]) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"notchbend: {loop}: not written by notchbend")
        assert "--force" in error
        assert loop.read_text() == MEASURED
        assert loop.with_suffix(".toml").exists() == (sidecar is not None)


def test_a_measured_record_that_was_converted_is_kept(tmp_path):
    x = np.array([0.0, 1.0, 0.0])
    write_record(Record(drive=x, angle_deg=x), tmp_path / "loop.csv")
    before = (tmp_path / "loop.csv").read_bytes()
    assert call([*SIMULATE, str(tmp_path / "loop.csv")]) == 2
    assert (tmp_path / "loop.csv").read_bytes() == before


def test_force_replaces_and_names_what_it_replaces(tmp_path, capsys):
    loop = tmp_path / "loop.csv"
    loop.write_text(MEASURED)
    assert call([*SIMULATE, str(loop), "--force"]) == 0
    assert f"--force: {loop} is replaced" in capsys.readouterr().err
    assert read_record(loop).kind == "simulated"


def test_the_same_command_runs_twice(tmp_path, capsys):
    loop, again = tmp_path / "loop.csv", []
    for _ in range(2):
        assert call([*SIMULATE, str(loop)]) == 0
        again.append((loop.read_bytes(), loop.with_suffix(".toml").read_bytes()))
    assert again[0] == again[1]
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("command", "names"),
    [
        (SEPARATE, ["separate.json"]),
        (["trace", "loop.csv", "--quiet", "--out"], ["report.html", "next-experiment.csv", "trace-loops.png"]),
        (["identify", "loop.csv", "--quiet", "--out"], ["identify.json", "identify.csv"]),
        (["run", "--quiet", "--out"], ["run.json", "report.html", "records/du2018-10N.csv", "tube.png"]),
        (["validate", "--quiet", "--out"], ["validate.json"]),
        (["study", "preload", "--quiet", "--out"], ["study.json", "pareto.json", "inputs/preload.toml"]),
    ],
)
def test_foreign_files_are_kept_by_every_command(command, names, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("loop.csv").write_text(MEASURED)
    for i, name in enumerate(names):
        path = tmp_path / f"out{i}" / name
        path.parent.mkdir(parents=True)
        path.write_text("mine")
        assert call([*command, f"out{i}"]) == 2
        assert f"{name}: not written by notchbend" in capsys.readouterr().err
        assert path.read_text() == "mine"
        assert [file.name for file in (tmp_path / f"out{i}").rglob("*") if file.is_file()] == [path.name]


def test_a_page_is_replaced_only_if_it_is_a_report(tmp_path, capsys):
    assert call([*SEPARATE, str(tmp_path)]) == 0
    (tmp_path / "report.html").write_text("<html><head></head>mine")
    assert call(["report", str(tmp_path), "--quiet"]) == 2
    assert "report.html: not written by notchbend" in capsys.readouterr().err
    (tmp_path / "report.html").unlink()
    for _ in range(2):
        assert call(["report", str(tmp_path), "--quiet"]) == 0
    assert '<meta name="generator" content="notchbend">' in (tmp_path / "report.html").read_text()


def test_every_kind_of_file_has_its_mark(tmp_path):
    write_result(tmp_path / "a.json", {"schema": 1})
    (tmp_path / "a.html").write_text(marked_page("<html>\n<head>\n</head>"))
    png = bytes.fromhex("89504e470d0a1a0a0000000d494844520000000100000001080000000037"
                        "6ef9240000000a49444154789c63600000000200017368c1270000000049454e44ae426082")  # fmt: skip
    (tmp_path / "a.png").write_bytes(marked_png(png))
    assert marked_png(marked_png(png)) == marked_png(png)
    (tmp_path / "a.pdf").write_bytes(marked_pdf(b"%PDF-1.4\n%%EOF\n"))
    for path in tmp_path.iterdir():
        assert is_own(path), path
    for name, content in {
        "b.json": b"{}",
        "b.html": b"<head>",
        "b.png": png,
        "b.pdf": b"%PDF",
        "b.csv": b"a,b",
    }.items():
        (tmp_path / name).write_bytes(content)
        assert not is_own(tmp_path / name), name


def test_a_marked_picture_is_still_the_picture(tmp_path):
    pixels = np.arange(48.0).reshape(4, 4, 3) / 48
    image.imsave(tmp_path / "a.png", pixels)
    (tmp_path / "b.png").write_bytes(marked_png((tmp_path / "a.png").read_bytes()))
    np.testing.assert_array_equal(image.imread(tmp_path / "a.png"), image.imread(tmp_path / "b.png"))


def test_a_file_that_a_marked_one_names_is_own(tmp_path):
    (tmp_path / "next.csv").write_text("drive_mm\n1\n")
    assert foreign([tmp_path / "next.csv"]) == [tmp_path / "next.csv"]
    (tmp_path / "trace.json").write_text(json.dumps({"maker": "notchbend", "next": {"file": "next.csv"}}))
    assert foreign([tmp_path / "trace.json", tmp_path / "next.csv"]) == []
    (tmp_path / "trace.json").write_text(json.dumps({"next": {"file": "next.csv"}}))
    assert len(foreign([tmp_path / "trace.json", tmp_path / "next.csv"])) == 2
