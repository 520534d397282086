"""The main job end to end, on the defaults: files, figures, verdicts; and the page again from stored results."""

import json
import re
import shutil
import time

import pytest
from once import made_once
from results_folder import copy_results

from fem_models.multibody import quasi_static
from hysteresis.records.record_file import read_record
from studies.bench_record import SHIPPED, bench_like_record
from studies.commands.cli import call
from studies.report.templates import significant


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    def make(out):
        began = time.monotonic()
        assert call(["run", "--out", str(out), "--quiet"]) == 0
        assert time.monotonic() - began < 150

    return made_once(tmp_path_factory, "run", make)


def test_run_stores_what_the_page_shows(folder):
    stored = json.loads((folder / "run.json").read_text())
    assert [loop["record"] for loop in stored["loops"]] == ["du2018-10N", "du2018-20N"]
    for name in ("du2018-10N", "du2018-20N", "bench-like-20N", "du2018-20N-analytic"):
        assert read_record(folder / "records" / f"{name}.csv").kind == "simulated"
    parts = json.loads((folder / "separate-du2018-20N.json").read_text())["contributions"]
    assert sum(part["share"] for part in parts.values()) == pytest.approx(1, abs=1e-9)
    assert [item["file"] for item in stored["separations"]] == ["separate-du2018-20N.json"]
    for item in stored["fits"]:
        fit = json.loads((folder / f"identify-{item['name']}.json").read_text())
        assert fit["heldout"]["rmse_deg"] < fit["baseline"]["heldout"]["rmse_deg"]


def test_page_is_self_contained(folder):
    html = (folder / "report.html").read_text()
    assert not re.search(r'(src|href)="(?!data:|#)', re.sub(r"<script\b.*?</script>", "", html, flags=re.S))
    assert not re.search(r"<script [^>]*src", html)
    # three charts of the loops, one of the parts, three a fit, and of the trace eight of residuals, two
    # of the loop and two of candidates; plotly.js has "<svg" of its own
    assert re.sub(r"<script\b.*?</script>", "", html, flags=re.S).count("<svg") == 3 + 1 + 3 * 4 + 8 + 2 + 2
    assert "data:image/png;base64," in html
    assert "stated" in html
    assert "assumed" in html


def test_report_again_is_the_same(folder):
    before = (folder / "report.html").read_bytes()
    assert call(["report", str(folder)]) == 0
    assert (folder / "report.html").read_bytes() == before


def test_report_as_json_or_quiet(tmp_path, tmp_path_factory, capsys):
    folder = copy_results(tmp_path_factory, tmp_path)["trace"]
    assert call(["report", str(folder), "--json", "--seed", "3"]) == 0
    assert json.loads(capsys.readouterr().out)["report"] == str(folder / "report.html")
    assert call(["report", str(folder), "--quiet"]) == 0
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("name", ["bench-like-20N", "du2018-10N", "du2018-20N-analytic"])
def test_report_refuses_records_that_changed(name, folder, tmp_path, capsys):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    record = copy / "records" / f"{name}.csv"
    record.write_text(record.read_text().replace("1", "2"))
    assert call(["report", str(copy)]) == 2
    assert f"{name}.csv: sha256" in capsys.readouterr().err
    record.unlink()
    assert call(["report", str(copy)]) == 2
    assert f"{name}.csv: No such file" in capsys.readouterr().err


def test_report_refuses_a_run_without_checksums(folder, tmp_path, capsys):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    stored = json.loads((copy / "run.json").read_text())
    del stored["sha256"]
    for content, said in ((stored, "sha256: missing"), ([], "[]: expected a table")):
        (copy / "run.json").write_text(json.dumps(content))
        assert call(["report", str(copy)]) == 2
        assert f"run.json: {said}" in capsys.readouterr().err


def test_an_interrupted_run_does_not_pass_for_a_finished_one(folder, tmp_path, capsys, monkeypatch):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)

    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(quasi_static, "solve_multibody", interrupted)
    assert call(["run", "--out", str(copy), "--quiet"]) == 130
    said = capsys.readouterr().err
    assert re.fullmatch(
        r"notchbend: interrupted: \d+ whole files are in .*copy, the same command starts again .*\n", said
    )
    assert not (copy / "run.json").exists()
    assert not (copy / "report.html").exists()
    assert call(["report", str(copy)]) == 2


def test_report_names_a_broken_result(folder, tmp_path, capsys):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    (copy / "identify-du2018-10N.csv").unlink()
    assert call(["report", str(copy)]) == 2
    assert "identify-du2018-10N.csv" in capsys.readouterr().err


def test_shipped_record_is_what_its_script_makes():
    shipped, made = read_record(SHIPPED), bench_like_record()
    assert "Not a measurement" in shipped.title
    assert "seed" in shipped.title
    # readings are rounded to 1e-4 deg; the solver may differ in the last digits from machine to machine
    assert abs(shipped.angle_deg - made.angle_deg).max() < 2e-4


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.012345, "0.0123"), (1234.5, "1234"), (45.25, "45.2"), (1.2e-9, "1.20e-09"), (14, "14"), (0.0, "0.0")],
)
def test_numbers_have_three_digits(value, text):
    assert significant(value) == text


@pytest.mark.slow
def test_a_rig_with_one_tendon_has_a_report_without_cross_checks(tmp_path):
    """They need two tendons; its page could not be read, for want of a row of them for each loop."""
    assert call(["run", "--preset", "notched-wrist-90", "--amplitude", "0.3", "--out", str(tmp_path), "--quiet"]) == 0
    page = (tmp_path / "report.html").read_text()
    assert "no cross-checks: they need two tendons" in page
    assert 'id="crosschecks"' not in page
    assert 'id="loops"' in page
