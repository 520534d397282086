"""The whole way of docs/guide/first-steps.md with a rig file and two CSVs that the test makes: commands as printed."""

import json
import re
import shlex
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from functools import cache, partial
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from how_made import printed

from fem_models.chain import simulate_chain
from fem_models.chain.solve import solve_chain
from fem_models.load import triangle
from fem_models.rig import read_rig
from fem_models.rig.rig import Friction
from hysteresis.records.record_file import read_record
from studies.commands import tracing
from studies.commands.cli import call
from studies.own_rig import design_report
from studies.own_rig.metal import law_of_metal
from studies.report import write_report
from validation.tracing import catalogue, trace_records

PAGE = (Path(__file__).parents[3] / "docs" / "guide" / "first-steps.md").read_text()
COMMANDS = [shlex.split(line) for line in re.findall(r"^    notchbend (.*)$", PAGE, re.M)]
pytestmark = pytest.mark.slow
FEW, TRACE_LOADED = ("backlash", "guide_friction"), tracing.trace_loaded
NOISE_DEG, SHEATH_N = 0.05, 0.8
"""Noise of the records; friction of the bench, while the rig file says 0.5 N."""


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    """A folder with the rig file of the page, two bare CSVs, and what all commands of the page left and printed."""
    folder = tmp_path_factory.mktemp("day")
    printed = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for module in (tracing, design_report):  # the page traces the same two records twice
            patch.setattr(module, "trace_loaded", traced_once)
        Path("mine.toml").write_text(re.search(r"```toml\n(preload_N.*?)```", PAGE, re.S)[1])
        for preload in (10.0, 20.0):
            write_bench(preload)
        for words in COMMANDS:
            if words[0] != "app":  # it serves until Ctrl-C
                printed[" ".join(words)] = run(words)
    return folder, printed


@cache
def traced(files: tuple[str, ...]):
    """The trace of records, with two effects of the catalogue: enough to find that none is missing."""
    few = partial(trace_records, effects=[effect for effect in catalogue() if effect.name in FEW])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tracing, "trace_records", few)
        patch.setattr(tracing, "limits_of", lambda trace: [])
        return TRACE_LOADED([read_record(file) for file in files])


def traced_once(records, **options):
    return traced(tuple(str(Path(record.source).resolve()) for record in records))


def write_bench(preload: float) -> None:
    """What the reader measures: the rig of the page with more friction, and noise."""
    rig = replace(read_rig(Path("mine.toml")), preload_N=preload, friction=Friction(sheath_N=SHEATH_N))
    record = simulate_chain(rig, triangle(1.5, step_mm=0.15, cycles=2))
    noise = np.random.default_rng(int(preload)).normal(0, NOISE_DEG, record.drive.size)
    table = np.column_stack([record.drive, record.angle_deg + noise])
    names = {"header": "drive_mm,angle_deg", "comments": "", "fmt": "%.5f", "delimiter": ","}
    np.savetxt(f"bench-{preload:g}N.csv", table, **names)


def run(words: list[str]) -> str:
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = call(words)
    assert code == 0, f"{' '.join(words)}: {err.getvalue()}"
    return out.getvalue() + err.getvalue()


def test_the_page_goes_the_whole_way(day):
    """Every command that the page has to show, in its order."""
    names = [" ".join(words[:2]) if words[0] == "record" else words[0] for words in COMMANDS]
    steps = ["simulate", "record new", "record new", "run", "identify", "trace", "separate", "report", "app"]
    assert names == steps


def test_simulate_prints_strain_and_the_drive_where_limits_are_passed(day):
    _, printed = day
    text = next(text for command, text in printed.items() if command.startswith("simulate"))
    assert re.search(r"^peak strain 2\.\d+ %$", text, re.M)
    passed = re.search(
        r"^fatigue at 10\^7 cycles \(0\.4 %, alternating\): passed in this run at ([\d.]+) mm, joint \d+", text, re.M
    )
    assert 0 < float(passed[1]) < 1.5
    assert re.search(r"^strain to which superelasticity is tested \(6 %, peak\): not passed", text, re.M)


def test_record_new_says_what_it_understood(day):
    folder, printed = day
    text = next(text for command, text in printed.items() if command.startswith("record new bench-20N"))
    assert "columns: drive = 'drive_mm', angle = 'angle_deg' (commas)" in text
    assert "2 whole cycles after an approach" in text
    assert "(amplitude 1.5), steps of 0.15 mm" in text
    noise = float(re.search(r"noise: ([\d.]+) deg", text)[1])
    assert noise == pytest.approx(NOISE_DEG, rel=0.35)
    record = read_record(folder / "bench-20N.csv")
    assert record.rig == {"file": str(folder / "mine.toml"), "preload_N": 20.0}


def test_the_design_report_has_both_preloads_both_records_and_what_to_do(day):
    folder, printed = day
    stored = json.loads((folder / "design" / "run.json").read_text())
    assert [loop["record"] for loop in stored["loops"]] == ["mine-10N", "mine-20N"]
    assert [check["preload_N"] for check in stored["crosscheck"]] == [10.0, 20.0]
    assert [fit["record"] for fit in stored["fits"]] == ["bench-10N", "bench-20N"]
    for one in stored["own"]["predictions"]:  # the bench has 1.6 times the friction of the file, so a wider loop
        assert one["rmse_deg"] > 1.3 * one["noise_floor_deg"]
        assert one["width_deg"] > 1.2 * one["predicted_width_deg"]
    html = (folder / "design" / "report.html").read_text()
    html = re.sub(r"<script\b.*?</script>", "", html, flags=re.S)
    parts = [
        "design",
        "summary",
        "todo",
        "rig",
        "crosschecks",
        "loops",
        "records",
        "contributions",
        "layer",
        "trace",
        "versions",
    ]
    assert re.findall(r'<h2 id="(\w+)"', html) == parts
    assert re.search(r"<code>sheath_N</code></th><td class=\"n\">0\.[78]", html)  # calibrated, while the file has 0.5
    todo = re.search(r'<ol class="todo">(.*?)</ol>', html, re.S)[1]
    loop = stored["loops"][1]
    amplitude = loop["fatigue_amplitude_mm"]
    rig = replace(law_of_metal(read_rig(folder / "mine.toml"), -1.5, 1.5, folder / "mine.toml").rig, preload_N=20.0)
    strain = 100 * solve_chain(rig, triangle(amplitude, cycles=2)).peak_strain  # another engine, at that amplitude
    assert 0.5 * np.ptp(strain, axis=0).max() == pytest.approx(0.4, rel=0.05)  # the multibody model shears, too
    assert f"fatigue at 10^7 cycles (0.4 % alternating) is passed in cycles of more than ±{amplitude:.2f} mm" in todo
    slack = [one.get("slack_from_mm") is not None for one in stored["loops"]]
    assert [f"a tendon of {one['record']} goes slack" in todo for one in stored["loops"]] == slack
    assert "Measure next" in todo
    command = next(command for command in printed if command.startswith("run"))
    assert f"notchbend {command}" in html
    assert "\nreport: design/report.html\n" in printed[command]


def test_every_page_says_how_it_was_made(day):
    """The commands are those of the guide, which have run as they are printed."""
    folder, _ = day
    write_report(folder / "parts")
    files = {"run": "design/run", "identify": "fit/identify", "trace": "missing/trace", "separate": "parts/separate"}
    for words in COMMANDS:
        if words[0] in files:
            file = folder / f"{files[words[0]]}.json"
            assert words[0] in printed(file, (file.parent / "report.html").read_text(), words)


def test_the_records_say_the_friction_of_the_bench(day):
    """The calibrated rig has the friction of the bench, and not that of the file; the trace finds nothing missing."""
    folder, _ = day
    found = json.loads((folder / "parts" / "separate.json").read_text())["calibration"]["constants"]["sheath_N"]
    assert found["low"] <= SHEATH_N <= found["high"]
    assert found["low"] > 0.5
    assert json.loads((folder / "missing" / "trace.json").read_text())["verdict"] == "none"


def test_identify_draws_its_fit_and_has_a_page(day):
    folder, _ = day
    assert (folder / "fit" / "identify.png").read_bytes().startswith(b"\x89PNG")
    html = re.sub(r"<script\b.*?</script>", "", (folder / "fit" / "report.html").read_text(), flags=re.S)
    assert '<h2 id="layer">' in html
    assert html.count("<svg") == 3  # record and model, the same less f, residual
    assert "notchbend identify bench-20N.csv --out fit" in html
