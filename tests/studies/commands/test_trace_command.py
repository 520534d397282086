"""``notchbend trace`` and ``effects``: trace.json, the page, the figures and the next program, all or none of them."""

import json
import re
import shutil
import sys
from dataclasses import replace

import numpy as np
import pytest
from how_made import printed
from rich.console import Console

from docs.make.effects import PAGE, PARAMETERS, page, parameter_page
from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.multibody import quasi_static as multibody
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Backlash
from fem_models.rig.of_record import rig_of
from hysteresis.files import write_files
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import write_record
from studies import progress
from studies.commands import tracing
from studies.commands.cli import call
from studies.programs import program_of_file
from studies.report import write_report
from studies.report.trace_page import trace_page
from studies.results.trace_samples import read_samples, samples_of
from validation.tracing import trace_records
from validation.tracing.effect import catalogue
from validation.tracing.figures import figures
from validation.tracing.next_experiment import Experiment, Trial, next_experiment
from validation.tracing.result import TraceReport, errors_of, in_words, trace_report
from validation.tracing.second_opinion import second_opinion

NOISE_DEG, WIDTH_MM = 0.01, 0.06
ERROR_KEYS = {"rmse_deg", "max_abs_deg", "max_rel_percent", "normalised"}
PNG = b"\x89PNG\r\n\x1a\n"


def bench_records(width_mm: float) -> list[Record]:
    """Three records of the preset from the chain model, at three preloads, with noise.

    Its tendons have a toe region: with linear ones, play is friction at the base. At two preloads it is capstan
    friction there beside it.
    """
    noise, out = np.random.default_rng(0), []
    for preload, amplitude in ((20.0, 1.0), (10.0, 0.5), (5.0, 0.5)):
        rig = {"preset": "du2018", "preload_N": preload}
        bare = Record(drive=[0, 1, 0], angle_deg=[0, 1, 0], kind="simulated", rig=rig)
        rig = replace(rig_of(bare), backlash=Backlash(width_mm) if width_mm else None)
        run = simulate_chain(rig, sine(amplitude, 0.1, cycles=2, samples_per_cycle=48))
        angle = np.round(run.angle_deg + noise.normal(0, NOISE_DEG, run.angle_deg.size), 4)
        out.append(replace(bare, drive=run.drive, angle_deg=angle, time_s=run.time_s, cycle=run.cycle))
    return out


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of records with backlash and of what the command writes, and the trace that it found."""
    place, traces = tmp_path_factory.mktemp("trace"), []
    for i, record in enumerate(bench_records(WIDTH_MM)):
        write_record(record, place / f"r{i}.csv")

    def noted(*records, **options):
        traces.append(trace_records(*records, **options))
        return traces[-1]

    arguments = ["trace", *(str(place / f"r{i}.csv") for i in range(3)), "--out", str(place / "out")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tracing, "trace_records", noted)
        assert call([*arguments, "--quiet", "--threads", "1"]) == 0
    (found,) = traces
    return place, found


@pytest.fixture(scope="module")
def folder(run):
    return run[0]


@pytest.fixture(scope="module")
def found(run):
    return run[1]


def stored(folder):
    return json.loads((folder / "out" / "trace.json").read_text(), parse_constant=pytest.fail)  # no NaN


def test_backlash_is_traced_and_the_file_has_the_documented_fields(folder):
    result = stored(folder)
    assert result["schema"] == 1
    assert result["records"] == ["r0.csv", "r1.csv", "r2.csv"]
    assert result["verdict"] == "effect"
    for stage in ("before", "after"):
        for part in ("train", "heldout"):
            assert set(result[stage][part]) == ERROR_KEYS
    (effect,) = result["effects"]
    assert effect["name"] == "backlash"
    assert effect["confusable_with"] == []
    width = effect["parameters"]["width_mm"]
    assert width["unit"] == "mm"
    assert width["low"] < WIDTH_MM < width["high"]  # the width that the records were made with
    assert effect["heldout_rmse_deg"] == pytest.approx(result["after"]["heldout"]["rmse_deg"], rel=1e-9)
    assert effect["delta_bic"] == pytest.approx(result["candidates"][0]["delta_bic"])
    # 3 x 109 samples determine the noise to 4 % (1/sqrt(2 m)), its estimate a little less well
    assert result["noise_floor_deg"] == pytest.approx(NOISE_DEG, rel=0.2)
    assert result["after"]["heldout"]["rmse_deg"] < 1.3 * NOISE_DEG < result["before"]["heldout"]["rmse_deg"]
    gains = [row["delta_bic"] for row in result["candidates"]]
    assert gains == sorted(gains, reverse=True)
    assert all(set(row) == {"name", "heldout_rmse_deg", "delta_bic"} for row in result["candidates"])
    assert set(result["multibody"]) == {"before", "after"}
    assert result["multibody"]["after"]["rmse_deg"] < 0.5 * result["multibody"]["before"]["rmse_deg"]
    assert "backlash" in result["next_experiment"]
    assert "whose protocol differs" in result["heldout_by"]


def test_the_file_has_the_test_beside_the_verdict(folder):
    result = stored(folder)
    assert (result["alpha"], result["simulations"]) == (0.05, 999)
    assert 0.001 <= result["p_none"] <= 0.05
    assert "backlash" in result["by_test"]["not_distinguished"]
    assert result["effects"][0]["p"] > 0.05
    assert result["discrepancy_deg"] < NOISE_DEG


def test_the_page_draws_its_charts_and_the_pictures_are_files(folder):
    html = (folder / "out" / "report.html").read_text()
    result = stored(folder)
    assert "The residual is traced to backlash." in html
    assert html.count('<div class="chart">') == 8 + 4 + 2  # residuals, loops, candidates
    assert "<img" not in re.sub(r"<script\b.*?</script>", "", html, flags=re.S)
    assert 'src="http' not in html
    assert len(result["figures"]) == 3
    for item in result["figures"]:
        assert (folder / "out" / item["file"]).read_bytes().startswith(PNG)


def test_the_samples_of_the_charts_are_those_of_the_trace(folder, found):
    """The file has what the trace found: residuals, held-out record, and the error of the best model."""
    report = TraceReport.from_dict(stored(folder))
    samples = read_samples(folder / "out" / report.samples_file, records=3)
    for name, fitted in (("baseline_deg", found.baseline), ("augmented_deg", found.augmented)):
        residual = samples.angle_deg - getattr(samples, name)
        np.testing.assert_allclose(residual, np.concatenate(fitted.residuals), atol=2e-5)
    assert report.held_out == (False, False, True)
    best, baseline = report.ranking[0], report.ranking[-1]
    assert (best.name, best.chosen, best.bic_above_best) == ("backlash", True, 0.0)
    assert best.low_deg < report.after.heldout.rmse_deg < best.high_deg < baseline.low_deg
    assert baseline.heldout_rmse_deg == pytest.approx(report.before.heldout.rmse_deg, rel=1e-9)


def test_simulate_accepts_the_next_program(folder):
    program = program_of_file(folder / "out" / "next-experiment.csv")
    assert stored(folder)["next_program"]["preload_N"] > 0
    assert program.time_s is not None
    assert np.abs(program.drive_mm).max() <= 1.25 + 1e-9  # of the widest record, 1 mm


def test_clean_records_have_no_effect_and_files_of_an_older_trace_are_removed(folder, tmp_path, capsys):
    for i, record in enumerate(bench_records(0.0)):
        write_record(record, tmp_path / f"r{i}.csv")
    out = tmp_path / "out"
    older = {"maker": "notchbend", "files": ["next-experiment.csv", "trace-candidates.png"]}  # by which they are own
    write_files({out / "next-experiment.csv": "old", out / "trace-candidates.png": b"old", out / "mine.txt": "mine"})
    write_files({out / "trace.json": json.dumps(older)})
    assert call(["trace", str(tmp_path / "r0.csv"), str(tmp_path / "r1.csv"), "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["verdict"], result["effects"]) == ("none", [])
    assert result["after"] == result["before"]
    assert result["before"]["heldout"]["rmse_deg"] < 1.3 * NOISE_DEG
    assert result["next_program"] is None
    kept = {path.name for path in out.iterdir()}
    pictures = {"trace-residual.png", "trace-loops.png"}
    assert kept == {"trace.json", "report.html", "trace-samples.csv", "mine.txt"} | pictures


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("drive_mm,angle_deg\n0,0\n1,1\n2,2\n3,3\n", ["r.csv", "never reverses"]),
        ("drive_mm,angle_deg\n0,7\n1,7\n2,7\n1,7\n0,7\n", ["r.csv", "angle = 7 deg", "changes"]),
        ("drive_mm,angle_deg\n0,0\n1,one\n0,0\n", ["r.csv:3", "one"]),
    ],
)
def test_bad_records_end_with_one_line_and_leave_nothing(text, words, tmp_path, capsys):
    (tmp_path / "r.csv").write_text(text)
    assert call(["trace", str(tmp_path / "r.csv"), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(word in error for word in words), error
    assert not (tmp_path / "out").exists()


def test_a_record_is_not_replaced_by_the_next_program(tmp_path, capsys):
    record = tmp_path / "next-experiment.csv"
    write_record(bench_records(0.0)[0], record)
    before = record.read_bytes()
    assert call(["trace", str(record), "--out", str(tmp_path)]) == 2
    assert "would replace it" in capsys.readouterr().err
    assert record.read_bytes() == before


def test_both_pages_print_the_command_and_it_runs_as_printed(folder, tmp_path, monkeypatch):
    out = tmp_path / "out"
    shutil.copytree(folder / "out", out)
    page = (out / "report.html").read_text()
    report = write_report(out).read_text()
    given = ["trace", *(folder / f"r{i}.csv" for i in range(3)), "--out", folder / "out", "--threads", 1]
    for one in (page, report):
        words = printed(out / "trace.json", one, given)
    before, traced = stored(folder), []

    def same(records, **options):
        traced.append(([record.source for record in records], options["threads"]))
        report = TraceReport.from_dict(before)
        pictures = {item.file: (out / item.file).read_bytes() for item in report.figures}
        program = (out / tracing.NEXT).read_text() if report.next_program else None
        return tracing.Traced(report, pictures, program, read_samples(out / report.samples_file, records=3))

    monkeypatch.setattr(tracing, "trace_loaded", same)  # the trace itself takes long
    assert call(words) == 0
    assert traced == [([str(path) for path in given[1:4]], 1)]
    assert {**stored(folder), "made": 0} == {**before, "made": 0}


def test_nothing_is_written_where_a_file_cannot_be(folder, tmp_path):
    report = TraceReport.from_dict(stored(folder))
    pictures = {item.file: (folder / "out" / item.file).read_bytes() for item in report.figures}
    samples = read_samples(folder / "out" / report.samples_file, records=3)
    (tmp_path / "trace.json").mkdir()  # a folder in the place of the last file
    with pytest.raises(RecordError, match=r"trace\.json"):
        tracing.write_trace(tracing.Traced(report, pictures, None, samples), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["trace.json"]


def test_a_trace_prints_in_one_line_shows_itself_in_a_notebook_and_converts(found):
    assert "\n" not in repr(found)
    assert repr(found).startswith("Trace(effect: backlash; held-out error 0.")
    assert repr(found).endswith("; rig)")
    assert "The residual is traced to backlash." in found._repr_html_()
    assert found.to_dict() == trace_report(found).to_dict()
    clean = replace(found, verdict="none", augmented=found.baseline, confusable=())
    assert repr(clean).startswith(f"Trace(none; held-out error {found.baseline.heldout_rmse_deg:.3g} deg, noise 0.0")


def test_an_unexplained_trace_names_no_effect_and_proposes_a_measurement(found):
    words = ("the residual depends on the rate",)
    smooth = replace(found.smooth, names=("the rate",))
    lost = replace(found, verdict="unexplained", augmented=found.baseline, confusable=(), words=words, smooth=smooth)
    experiment = next_experiment(lost)
    assert experiment.program is None
    assert "ten times the rate, 1 Hz: the residual depends on the rate" in experiment.words
    result = trace_report(lost, experiment=experiment)
    assert result.effects == ()
    assert result.after == result.before
    html = trace_page(result, samples_of(lost))
    assert "Baseline model, over the drive" in html
    assert "With backlash, over the drive" not in html
    assert "no effect of the catalogue explains" in html
    assert "The residual depends on the rate." in in_words(result)


def test_candidates_that_are_not_distinguished_are_named_together(found):
    ranked = sorted((c for c in found.candidates if len(c.names) == 1), key=lambda c: -c.delta_bic)
    best, second = ranked[:2]
    near = replace(second, delta_bic=best.delta_bic - 1.0)
    rest = tuple(c for c in found.candidates if c not in (best, second))
    torn = replace(found, verdict="ambiguous", confusable=(second.names,), candidates=(best, near, *rest))
    experiment = next_experiment(torn)
    assert f"backlash and {second.names[0]} differ by" in experiment.words
    result = trace_report(torn, experiment=experiment)
    assert result.effects[0].confusable_with == second.names
    assert any(f"backlash or {second.names[0]}" in line for line in in_words(result))


@pytest.mark.slow
def test_the_record_that_is_proposed_tells_play_from_friction_at_the_base(found):
    """At two preloads they are not distinguished, and the record that distinguishes them is below both."""
    of_two = trace_records(bench_records(WIDTH_MM)[:2], threads=1)
    named = {of_two.augmented.names[0], *of_two.confusable[0]}
    assert named == {"backlash", "guide_friction", "preloaded_play"}
    assert next_experiment(of_two).preload_N == 5.0
    assert found.names == ("backlash",)  # with that record


def test_the_proposed_record_distinguishes_the_competitors(found):
    """Simulated again here, by the chain model, for the two models that the sentence names."""
    experiment = next_experiment(found)
    runner_up = max((c for c in found.candidates if "backlash" not in c.names), key=lambda c: c.delta_bic)
    problem, angles = found.baseline.model.problem, []
    for fitted in (found.augmented, runner_up.fitted):
        baseline, more = fitted.model.values(fitted.x)
        added = [(a.form, values) for a, values in zip(fitted.model.added, more, strict=True)]
        bare = problem.runs[0][0]
        run = replace(bare, rig=replace(bare.rig, preload_N=experiment.preload_N))
        angles.append(simulate_chain(problem.rig(run, baseline, added), experiment.program).angle_deg)
    apart = angles[1] - angles[0]
    assert f"differ by {apart.std():.2g} deg rms" in experiment.words
    assert apart.std() > found.floor.deg


@pytest.mark.slow
def test_competitors_of_unknown_geometry_are_simulated_on_the_record_s_own_path():
    records = [
        replace(
            r, rig={"preload_N": r.rig["preload_N"]}, angle_deg=np.interp(r.time_s - 0.2, r.time_s, r.angle_deg)
        )
        for r in bench_records(0.0)[:2]
    ]  # fmt: skip
    shown = {"time_delay", "viscous_drag", "backlash"}
    found = trace_records(records, threads=1, effects=[effect for effect in catalogue() if effect.name in shown])
    assert not found.known
    best, second = sorted((c for c in found.candidates if len(c.names) == 1), key=lambda c: -c.delta_bic)[:2]
    named = replace(
        found, verdict="ambiguous", augmented=best.fitted, candidates=(best, second), confusable=(second.names,)
    )
    experiment = next_experiment(named)
    assert f"{best.names[0]} and {second.names[0]} differ by" in experiment.words
    assert experiment.program is not None
    assert experiment.preload_N in (5.0, 10.0, 20.0)  # no higher: that would pull the tendons further
    assert second_opinion(named).words == "not run: the geometry is unknown"
    assert set(trace_report(named).effects[0].parameters)
    assert len(figures(named)) == 3


def test_multibody_errors_are_those_of_the_same_runs(folder, found):
    """Both engines follow the same laws; measured joints have no shear and no soft rings. The command has run both."""
    result = stored(folder)
    for stage, fitted in (("before", found.baseline), ("after", found.augmented)):
        whole = np.sqrt(fitted.mean_square)
        assert result["multibody"][stage]["rmse_deg"] == pytest.approx(whole, rel=0.2)
    assert "3 of 3 records" in result["multibody_words"]
    assert "1 of 3 records" in second_opinion(found, cycles=2.0).words  # whole records, at least one


def test_a_failed_multibody_run_is_reported_in_words(found, monkeypatch):

    def fail(rig, program):
        raise SolverError("sample 3")

    monkeypatch.setattr(multibody, "solve_multibody", fail)
    opinion = second_opinion(found)
    assert (opinion.before, opinion.after) == (None, None)
    assert "sample 3" in opinion.words
    monkeypatch.setitem(
        sys.modules, "fem_models.multibody.quasi_static", None
    )  # as where Exudyn's libraries are missing
    opinion = second_opinion(found)
    assert "cannot be imported" in opinion.words
    assert trace_report(found, opinion=opinion).multibody is None


def test_a_report_alone_has_the_errors_of_the_trace(found):
    result = trace_report(found)
    assert result.after == errors_of(found.augmented)
    assert result.multibody is None
    json.dumps(result.to_dict(), allow_nan=False)


def test_a_stored_report_is_read_as_it_was_written(folder):
    """Against the file: the same keys in the same order, the same values."""
    text = (folder / "out" / "trace.json").read_text()
    report = TraceReport.from_dict(json.loads(text))
    made = {"made": json.loads(text)["made"]}  # by the command, which the report does not know
    assert json.dumps({"maker": "notchbend", **report.to_dict(), **made}, indent=2) + "\n" == text
    values = json.loads(text)
    del values["noise_floor_deg"]
    with pytest.raises(RecordError, match=r"trace\.json: noise_floor_deg: missing"):
        TraceReport.from_dict(values)


def test_effects_lists_the_catalogue(capsys):
    assert call(["effects", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["effects"]
    assert [row["name"] for row in rows] == [effect.name for effect in catalogue()]
    assert all(row["seen"] and row["physics"] and row["tell_apart"] for row in rows)
    assert call(["effects", "--quiet"]) == 0
    assert capsys.readouterr().out.split() == [effect.name for effect in catalogue()]
    assert call(["effects"]) == 0
    assert "wheel_eccentricity" in capsys.readouterr().out


def test_the_page_of_the_catalogue_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == page(catalogue()), "run python -m docs.make.effects"
    assert PARAMETERS.read_text(encoding="utf-8") == parameter_page(catalogue()), "run python -m docs.make.effects"


def test_progress_is_shown_on_a_terminal_only(monkeypatch):
    lines = []
    monkeypatch.setattr(progress, "Console", lambda stderr: Console(force_terminal=True, file=_Lines(lines)))
    with progress.stages(True, "tracing", 5, "fits") as stage:
        stage.count("backlash", 1, 5)
    with progress.stages(False, "tracing", 5, "fits") as stage:
        stage.begin("gravity")
    assert "tracing" in "".join(lines)
    assert "gravity" not in "".join(lines)


class _Lines:
    def __init__(self, lines):
        self.lines = lines

    def write(self, text):
        self.lines.append(text)

    def flush(self):
        pass


def test_a_program_without_times_is_written_without_times():
    trial = Trial("at rest", np.array([0.0, 1.0]), None, np.zeros(2, dtype=np.int64), 20.0)
    assert Experiment("words", trial).csv() == "drive_mm\n0\n1\n"
    assert Experiment("words").csv() is None
