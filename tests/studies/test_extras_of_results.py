"""A figure, a page or a second opinion that fails is one line: the result is written, and the exit code is 0."""

import json

import numpy as np
import pytest
from small_study import study_file

from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.multibody import quasi_static as multibody
from fem_models.rig import preset
from fem_models.rig.presets_in_space import any_preset
from hysteresis.records.record import Record
from hysteresis.records.record_file import write_record
from hysteresis.records.sidecar import toml
from studies.commands import tracing, workspace
from studies.commands.cli import call
from studies.own_rig import loops
from studies.report import page, plots
from studies.report.parts import fits
from validation.tracing import figures

ODD = "received -0.0343787 (range checks can be switched off)"


def odd(*given, **more):
    raise ZeroDivisionError(f"{ODD}\nand more")


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Two clean records of the preset with noise."""
    place, noise = tmp_path_factory.mktemp("bench"), np.random.default_rng(0)
    for preload in (10.0, 20.0):
        run = simulate_chain(preset("du2018", preload_N=preload), sine(1.0, 0.1, cycles=2, samples_per_cycle=48))
        angle = np.round(run.angle_deg + noise.normal(0, 0.01, run.angle_deg.size), 4)
        rig = {"preset": "du2018", "preload_N": preload}
        record = Record(drive=run.drive, angle_deg=angle, time_s=run.time_s, cycle=run.cycle, rig=rig)
        write_record(record, place / f"r{preload:g}.csv")
    return place


def traced(bench, out, capsys, *options):
    arguments = ["trace", *(str(bench / f"r{n}.csv") for n in (10, 20)), "--out", str(out), "--threads", "1"]
    assert call([*arguments, *options]) == 0
    return json.loads((out / "trace.json").read_text()), capsys.readouterr()


def test_a_trace_keeps_its_verdict(bench, tmp_path, capsys, monkeypatch):
    """All that comes after the verdict fails at once, with an error that nobody expects."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "report.html").write_text('<meta name="generator" content="notchbend">of an older trace')
    monkeypatch.setattr(multibody, "solve_multibody", odd)
    monkeypatch.setattr(figures, "loop_figure", odd)
    monkeypatch.setattr(tracing, "trace_page", odd)
    monkeypatch.setattr(tracing, "next_experiment", odd)
    monkeypatch.setattr(tracing, "limits_of", odd)
    stored, said = traced(bench, out, capsys)
    line = f"ZeroDivisionError: {ODD}"
    assert stored["verdict"] == "none"
    assert stored["multibody"] is None
    assert stored["multibody_words"] == f"stopped before the end: {line}"
    assert [one["file"] for one in stored["figures"]] == ["trace-residual.png"]  # clean: no candidates
    for what in ("no trace-loops.png", "no detection limits", "no next experiment", "no report.html"):
        assert f"{what}: {line}" in stored["words"]
        assert f"{what[1:]}: {line}" in said.out
    assert f"Multibody model: stopped before the end: {line}." in said.out
    assert (out / "trace-samples.csv").exists()
    assert not (out / "report.html").exists()


def test_a_page_of_a_trace_has_the_line_of_a_chart_and_of_the_second_opinion(bench, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(multibody, "solve_multibody", odd)
    drawn, first = plots.chart_svg, []
    monkeypatch.setattr(
        plots, "chart_svg", lambda chart, width: odd() if not first and not first.append(1) else drawn(chart, width)
    )
    traced(bench, tmp_path, capsys)
    html = (tmp_path / "report.html").read_text()
    assert f"not drawn: ZeroDivisionError: {ODD}" in html
    assert f"stopped before the end: ZeroDivisionError: {ODD}" in html
    assert html.count('<div class="chart">') > 5  # the others


def test_ctrl_c_in_the_second_opinion_stops_a_trace(bench, tmp_path, capsys, monkeypatch):
    def stopped(rig, program):
        raise KeyboardInterrupt

    monkeypatch.setattr(multibody, "solve_multibody", stopped)
    assert call(["trace", str(bench / "r10.csv"), "--out", str(tmp_path / "out"), "--threads", "1"]) == 130


def test_identify_keeps_its_fit(bench, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(fits, "figure_of_fit", odd)
    (tmp_path / "identify.png").write_bytes(b"")
    command = ["identify", str(bench / "r20.csv"), "--law", "bouc-wen", "--out", str(tmp_path), "--force"]
    assert call(command) == 0
    stored = json.loads((tmp_path / "identify.json").read_text())
    assert stored["notes"][-1] == f"no identify.png: ZeroDivisionError: {ODD}"
    assert f"no identify.png: ZeroDivisionError: {ODD}" in capsys.readouterr().out
    assert not (tmp_path / "identify.png").exists()


@pytest.mark.slow  # worker processes
def test_a_study_keeps_its_dataset(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(page, "page_text", odd)
    out = tmp_path / "out"
    assert call(["study", str(study_file(tmp_path)), "--out", str(out), "--workers", "1", "--json"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["cases"] == 12
    assert said.err == f"notchbend: no report.html: ZeroDivisionError: {ODD}\n"
    assert (out / "study.zarr").exists()
    assert json.loads((out / "study.json").read_text())["state"] == "finished"


@pytest.mark.slow  # the whole main job
def test_a_run_keeps_its_results(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(loops, "write_tube", odd)
    monkeypatch.setattr(page, "page_of", odd)
    assert call(["run", "--preset", "du2018", "--amplitude", "0.5", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr()
    stored = json.loads((tmp_path / "run.json").read_text())
    assert stored["picture"]["missing"] == f"not drawn: ZeroDivisionError: {ODD}"
    assert f"notchbend: no report.html: ZeroDivisionError: {ODD}\n" in said.err
    assert not (tmp_path / "report.html").exists()


def test_a_workspace_keeps_its_numbers(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(workspace, "_figure", odd)
    (tmp_path / "wrist.toml").write_text(toml(any_preset("zhang2026").to_dict()))
    line = [
        "workspace",
        "--rig",
        str(tmp_path / "wrist.toml"),
        "--amplitude",
        "0.4",
        "--circles",
        "1",
        "--directions",
        "8",
    ]
    assert call([*line, "--out", str(tmp_path / "ws")]) == 0
    assert f"no workspace.png: ZeroDivisionError: {ODD}" in capsys.readouterr().out
    assert {path.name for path in (tmp_path / "ws").iterdir()} == {"workspace.json", "workspace.csv"}
