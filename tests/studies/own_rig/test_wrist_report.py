"""The design report of a rig in space: its figures beside those of the planar report, its page, what it refuses."""

import json
import re
import shutil

import numpy as np
import pytest
from browser import chromium, keep_picture, listen

from fem_models.chain.parameters import ChainSettings
from fem_models.chain.solve import solve_chain
from fem_models.rig.checks import SolverError
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import rig_in_space
from fem_models.rig.rig_file import any_rig_of_tables
from fem_models.spatial.rig import of_rig_in_space
from fem_models.spatial.solve import solve_spatial
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_record
from hysteresis.records.sidecar import toml
from studies.commands.cli import call
from studies.own_rig import wrist_report as design_report
from studies.own_rig.design import Design
from studies.own_rig.loops import write_loop
from studies.own_rig.programs import programs_of_report
from studies.own_rig.wheels import motions_of, wheel_loop
from studies.own_rig.wrist_report import FINE, wrist_report
from studies.report.parts.reach import read_reach
from studies.results.wrist import read_wrist

WRIST = any_preset("zhang2026")
NAME = "{{7*7}}<img src=x onerror=alert(1)><script>alert(2)<svg onload=alert(3)>`${alert(4)}`'\"$\\frac{$"
TEXT = f"</script></title></svg>{NAME}<a href='javascript:alert(5)'>it</a>"


def rig_file(path, name="mine", **tables):
    """A wrist of 8 notches, with other tables."""
    notch = WRIST.to_dict()["notch"] | {"count": 8, "turn_deg": [0, 90] * 4}
    path.write_text(toml(WRIST.to_dict() | {"name": name, "notch": notch} | tables))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The report of a wrist at two preloads, by the command."""
    top = tmp_path_factory.mktemp("wrist")
    rig = rig_file(top / "wrist.toml")
    line = ["run", "--rig", str(rig), "--preload", "2", "--preload", "3", "--amplitude", "0.4", "--out"]
    assert call([*line, str(top / "report"), "--quiet"]) == 0
    return top / "report"


@pytest.mark.slow
def test_a_planar_rig_in_space_has_the_figures_of_the_planar_report(tmp_path):
    """Loops, tensions, strain and energy of the planar report, by the multibody model, and of the chain."""
    rig = any_preset("du2018-full-widths")
    loop, theory = programs_of_report(2.2, both_ways=True)
    solution, planar = write_loop(rig, loop, theory, tmp_path, "planar")
    space = rig_in_space(rig)
    design = Design("space", "--rig space.toml", (space,), 2.2)
    summary = wrist_report(design, tmp_path, made=None, progress=False)
    (found,) = summary.loops
    for name in ("full_scale_deg", "loop_width_deg", "peak_strain_percent"):  # seen: up to 2e-4
        assert getattr(found, name) == pytest.approx(getattr(planar, name), abs=1e-3), name
    for name in ("wheel_work_mJ", "friction_loss_mJ", "material_loss_mJ"):  # mJ; seen: below 1e-3 of them
        assert getattr(found, name) == pytest.approx(getattr(planar, name), rel=2e-3), name
    assert found.fatigue_amplitude_mm == pytest.approx(planar.fatigue_amplitude_mm, abs=1e-3)
    assert (found.slack_from_mm, planar.slack_from_mm) == (None, None)
    assert (found.direction_deg, found.across_deg, found.largest_torsion_deg) == (0, 0, 0)
    record = read_record(tmp_path / "records" / f"{found.record}.csv")
    chain = solve_chain(rig, loop, ChainSettings(max_step_mm=FINE.max_step_mm)).record
    np.testing.assert_allclose(record.drive, chain.drive)
    # deg and N; the chain with the same steps, and the other engine: seen 4e-14; 5e-4 and 2.3e-3
    for name, within in (("angle_deg", 1e-3), ("tension_a_N", 5e-3), ("tension_b_N", 5e-3)):
        np.testing.assert_allclose(getattr(record, name), getattr(chain, name), atol=1e-9)
        np.testing.assert_allclose(getattr(record, name), getattr(solution.record, name), atol=within)


def test_four_wheels_that_bend_together_are_two_wheels_with_pairs():
    """Opposite tendons on wheels of their own, moved by the cosine of their angles, are moved as on one wheel."""
    tables = WRIST.to_dict() | {"tendons": {"angles_deg": [0, 180, 90, 270], "wheels": [1, 2, 3, 4]}}
    four, loops = any_rig_of_tables(tables, "four"), []
    program, _ = programs_of_report(0.8, both_ways=True)
    for rig in (WRIST, four):
        for motion in motions_of(rig):
            run = solve_spatial(of_rig_in_space(rig), motion.of_wheels(program).of_tendons(rig), FINE)
            loops.append(wheel_loop(rig, motion, program, run, ("a", "b")))
    assert [loop.moves for loop in loops] == ["wheel 1", "wheel 2", "towards y", "towards z"]
    for one, other in zip(loops[:2], loops[2:], strict=True):
        assert other.full_scale_deg == pytest.approx(one.full_scale_deg, rel=1e-9)
        assert other.loop_width_deg == pytest.approx(one.loop_width_deg, rel=1e-6)
        assert other.largest_tension_N == pytest.approx(one.largest_tension_N, rel=1e-9)
        assert abs(one.energy_gap_percent) < 0.2


def test_the_folder_has_what_the_page_shows(folder):
    found = read_wrist(folder)
    assert [(loop.moves, loop.preload_N) for loop in found.loops] == [
        (f"wheel {k}", preload) for preload in (2.0, 3.0) for k in (1, 2)
    ]
    assert [one.turn_deg for one in found.notches] == [0, 90] * 4
    assert [(one.angle_deg, one.wheel, one.wound_in) for one in found.tendons] == [
        (0, 1, True), (180, 1, False), (90, 2, True), (270, 2, False),
    ]  # fmt: skip
    assert len(found.compliance) == 3
    path = found.paths[0]
    tips = [read_record(folder / "records" / f"{name}.csv").tip_mm for name in (path.record, path.smooth)]
    assert path.largest_apart_mm == pytest.approx(np.linalg.norm(tips[0] - tips[1], axis=1).max(), rel=1e-6)
    assert found.notes == ()
    for name in ("workspace.json", "workspace.csv", "workspace.png", "tube.json", "tube.png"):
        assert (folder / name).exists(), name


def test_the_page_has_all_parts_and_is_written_again(folder, capsys):
    page = (folder / "report.html").read_text()
    ids = re.findall(r'<h2 id="(\w+)"', page)
    assert ids == ["summary", "todo", "rig", "loops", "tensions", "path", "stiffness", "workspace", "versions"]
    assert 'href="#stiffness"' in page
    assert page.count("<td>in</td>") == page.count("<td>out</td>") == 2
    assert call(["report", str(folder), "--quiet"]) == 0
    assert (folder / "report.html").read_text() == page


def test_charts_are_drawn_without_errors_or_network(folder):
    with chromium() as running:
        page = running.new_context(viewport={"width": 1280, "height": 900}).new_page()
        heard = listen(page)
        page.goto((folder / "report.html").as_uri())
        page.wait_for_selector("html[data-ready=yes]", timeout=60_000)
        assert (heard.errors, heard.hosts) == ([], [])
        assert page.locator(".live[data-drawn=yes]").count() == page.locator(".live").count() > 15
        keep_picture(page, "wrist-report", full_page=True)


def test_records_that_changed_are_refused(folder, tmp_path, capsys):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    record = next(copy.glob("records/*-path.csv"))
    record.write_text(record.read_text().replace("0.", "1.", 1))
    assert call(["report", str(copy)]) == 2
    assert "sha256" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("keys", "value", "said"),
    [
        (("loops", 0, "record"), "../../wrist", "record"),
        (("loops", 0, "unit"), [0.0, 0.0], "no such wheels move"),
        (("loops", 0, "unit"), [], "no such wheels move"),
        (("loops",), [], "loops: empty"),
        (("notches", 0, "turn_deg"), "x", "turn_deg"),
        (("picture", "file"), "/etc/passwd", "picture.file"),
    ],
)
def test_a_spoiled_summary_is_refused_in_one_line(keys, value, said, folder, tmp_path, capsys):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    summary = json.loads((copy / "wrist.json").read_text())
    place = summary
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    (copy / "wrist.json").write_text(json.dumps(summary))
    assert call(["report", str(copy)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.slow
def test_a_spoiled_workspace_is_refused_in_one_line(folder, tmp_path, capsys):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    summary = json.loads((copy / "workspace.json").read_text())
    for change, said in (
        ({"circles": 3}, "expected 3 circles of 36 tips"),
        ({"circles": 10**9}, "at most 36000 tips"),
        ({"file": "../workspace.csv"}, "file"),
    ):
        (copy / "workspace.json").write_text(json.dumps(summary | change))
        with pytest.raises(RecordError, match=rf"^[^\n]*{said}[^\n]*$") as refused:
            read_reach(copy)
    assert call(["report", str(copy)]) == 2  # the last one: the other parts of the page are drawn before
    assert str(refused.value) in capsys.readouterr().err


@pytest.mark.slow
def test_names_of_a_hostile_rig_file_are_text(tmp_path):
    """The name of the rig leads to no other folder, and in a browser it is text; so is every text of the summary."""
    rig, out = rig_file(tmp_path / "wrist.toml", name=f"../../{TEXT}"), tmp_path / "report"
    assert call(["run", "--rig", str(rig), "--amplitude", "0.3", "--out", str(out), "--quiet"]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report", "wrist.toml"]
    (tmp_path / "wanted.csv").write_text("angle_deg,angle_2_deg\n0,0\n2,0\n2,1\n0,2\n")
    line = ["compensate", str(rig), "--reference", str(tmp_path / "wanted.csv"), "--out", str(out / "drives.csv")]
    assert call([*line, "--quiet"]) == 0
    summary = json.loads((out / "wrist.json").read_text())
    summary |= {"option": TEXT, "notes": [TEXT], "versions": {TEXT: TEXT}}
    summary["picture"]["caption"] = TEXT
    summary["rig"][0] |= {"name": TEXT, "source": TEXT, "note": TEXT}
    summary["loops"][0] |= {"title": TEXT, "moves": TEXT}
    summary["loops"][0]["strain_limits"][0] |= {"name": TEXT, "kind": TEXT, "source": TEXT}
    (out / "wrist.json").write_text(json.dumps(summary))
    assert call(["report", str(out), "--quiet"]) == 0
    html = (out / "report.html").read_text()
    for tag in ("<img src=x", "<svg onload", "<script>alert"):
        assert tag not in html
    assert "{{7*7}}" in re.sub(r"<(script|style)\b.*?</\1>", "", html, flags=re.S)  # not 49
    with chromium() as running:
        page = running.new_context().new_page()
        heard, dialogs = listen(page), []
        page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
        page.goto((out / "report.html").as_uri())
        page.wait_for_selector("html[data-ready=yes]", timeout=60_000)
        assert (dialogs, heard.errors, heard.hosts) == ([], [], [])
        assert page.locator("[onerror], [onload], img[src=x], [href^='javascript']").count() == 0
        assert NAME in page.locator("h1").inner_text()


def test_what_is_refused(folder, tmp_path, capsys):
    rig, out = str(folder.parent / "wrist.toml"), str(tmp_path / "out")
    record = str(next(folder.glob("records/*.csv")))
    for line, said in (
        (["--rig", rig, record], "its report takes no records"),
        (["--preset", "zhang2026", "--ensemble"], "--ensemble with rig zhang2026"),
        (["--rig", rig, "--amplitude", "30"], "mine"),
        (["--rig", rig, "--preload", "-1"], "preload_N = -1"),
        (["--rig", rig, "--preload", "2", "--preload", "2"], "given twice"),
    ):
        assert call(["run", *line, "--out", out]) == 2
        error = capsys.readouterr().err
        assert said in error
        assert error.count("\n") == 1


def test_what_has_no_equilibrium_beside_the_loops_is_a_note(tmp_path, monkeypatch):
    def refused(*_, **__):
        raise SolverError("no equilibrium here")

    for name in ("workspace", "compliance_of"):
        monkeypatch.setattr(design_report, name, refused)
    whole = design_report._run
    monkeypatch.setattr(
        design_report, "_run", lambda rig, program, title: (refused if "path" in title else whole)(rig, program, title)
    )
    rig = rig_file(tmp_path / "wrist.toml")
    assert call(["run", "--rig", str(rig), "--amplitude", "0.3", "--out", str(tmp_path / "out"), "--quiet"]) == 0
    found = read_wrist(tmp_path / "out")
    assert len(found.notes) == 3
    assert (found.paths, found.compliance) == ((), ())
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count("no equilibrium here") == 3
    assert 'id="path"' not in page


@pytest.mark.slow
def test_a_wrist_that_does_not_bend_has_no_lost_motion(tmp_path):
    """A tube of 359.9 mm bends by 1e-8 deg: widths along the drive are those of rounding."""
    rig = rig_file(tmp_path / "stiff.toml", tube={"outer_diameter_mm": 359.9, "inner_diameter_mm": 2.74})
    out = tmp_path / "out"
    assert call(["run", "--rig", str(rig), "--amplitude", "0.2", "--out", str(out), "--quiet"]) == 0
    assert [loop.lost_motion_mm for loop in read_wrist(out).loops] == [None, None]
    assert "NaN" not in (out / "wrist.json").read_text()
    assert call(["report", str(out), "--quiet"]) == 0
