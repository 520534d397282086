"""The charts of a trace: drawn from the samples in its folder, which are checked when they are read."""

import json
from dataclasses import replace

import numpy as np
import pytest
from results_folder import ERRORS

from hysteresis.fitting.uncertainty import Parameter
from studies.commands.cli import call
from studies.report.charts import Bars, Line, Span
from studies.report.live import chart_json
from studies.report.page import page_of
from studies.report.parts.traced import MOST_POINTS, trace_command, trace_plates
from studies.results import write_result
from studies.results.trace import FigureFile, FoldErrors, NamedEffect, StoredTrace
from studies.results.trace_samples import TraceSamples, read_samples, samples_csv
from validation.tracing.fitting.ranking import RankedModel

WIDTH_DEG, LEFT_DEG = 1.0, 0.2


def samples(count: int = 2, per_branch: int = 30) -> TraceSamples:
    """Loops of constant width about x -> 20 x; the baseline lacks the loop, the augmented model is LEFT_DEG off."""
    up = np.linspace(-1, 1, per_branch, endpoint=False)
    drive = np.concatenate([up, -up, up, -up])
    side = np.repeat([-1.0, 1.0, -1.0, 1.0], per_branch) * WIDTH_DEG / 2
    m = drive.size
    tile = np.tile(drive, count)
    return TraceSamples(
        drive_unit="mm",
        clock="time_s",
        record=np.repeat(np.arange(count) + 1, m),
        cycle=np.tile(np.repeat([1, 2], m // 2), count),
        drive=tile,
        time=np.tile(np.arange(m, dtype=float), count),
        angle_deg=20 * tile + np.tile(side, count),
        baseline_deg=20 * tile,
        augmented_deg=20 * tile + np.tile(side, count) - LEFT_DEG,
    )


def result(count: int = 2) -> StoredTrace:
    best = RankedModel("backlash", 0.2, 0.15, 0.25, 0.0, chosen=True)
    other = RankedModel("tendon_slack", 0.3, 0.2, 0.4, 40.0, chosen=False)
    alone = RankedModel("", 0.5, 0.4, 0.6, 100.0, chosen=False)
    return StoredTrace(
        verdict="effect",
        records=tuple(f"r{i}.csv" for i in range(count)),
        noise_floor_deg=0.05,
        before=FoldErrors(ERRORS, ERRORS),
        after=FoldErrors(ERRORS, ERRORS),
        effects=(NamedEffect("backlash", {"width_mm": Parameter(0.1, 0.08, 0.12, "mm")}),),
        figures=(FigureFile("trace-residual.png", "Residual"),),
        alike=10.0,
        samples_file="trace-samples.csv",
        held_out=(*[False] * (count - 1), True),
        ranking=(best, other, alone),
    )


def test_residuals_stand_side_by_side_on_one_scale_with_the_noise():
    residuals, _, _ = trace_plates(result(), samples())
    before, after = residuals.charts[:2]
    assert (before.title, after.title) == ("Baseline model, over the drive", "With backlash, over the drive")
    assert before.y_range == after.y_range == pytest.approx((-1.15 * WIDTH_DEG / 2, 1.15 * WIDTH_DEG / 2))
    band, *lines = after.marks
    assert band == Span("y", -0.1, 0.1)
    assert [line.name for line in lines] == ["r0", "r1 (held out)"]
    np.testing.assert_allclose(lines[0].y, LEFT_DEG)
    assert [chart.legend for chart in residuals.charts] == [True] + [False] * 7  # named once
    means = residuals.charts[-2].marks[1]
    np.testing.assert_allclose(means.spread, WIDTH_DEG / 2)  # of a loop of constant width about its mean


def test_a_loop_is_drawn_less_its_backbone():
    _, loops, _ = trace_plates(result(), samples())
    measured, baseline, augmented = loops.charts[1].marks
    assert np.abs(measured.y[2:-2]).max() == pytest.approx(WIDTH_DEG / 2, abs=0.05)
    assert np.median(np.abs(baseline.y)) < 1e-9
    np.testing.assert_allclose(measured.y - augmented.y, LEFT_DEG)


def test_candidates_have_the_colours_of_their_models_and_the_noise():
    *_, candidates = trace_plates(result(), samples())
    noise, bars = candidates.charts[0].marks
    assert noise == Span("x", 0.05, 0.05)
    assert isinstance(bars, Bars)
    assert bars.categories == ("backlash", "tendon slack", "baseline model alone")
    assert bars.tones == ("blue", "grey", "orange")
    figure = json.loads(chart_json(candidates.charts[0]))
    assert figure["data"][0]["marker"]["color"] == ["var(--blue)", "var(--grey)", "var(--orange)"]  # names of the theme
    assert figure["layout"]["shapes"][0]["xref"] == "x"
    twice = replace(result(), ranking=(best := result().ranking[0], replace(best, chosen=False), *result().ranking[1:]))
    names = trace_plates(twice, samples())[-1].charts[0].marks[-1].categories
    assert names[:2] == ("backlash", "backlash (2)")  # bars of one name would be added up
    folds = replace(result(), ranking=tuple(replace(row, bic_above_best=None) for row in result().ranking))
    assert len(trace_plates(folds, samples())[-1].charts) == 1  # folds rank them, not the criterion


def test_of_long_and_of_many_records_a_part_is_drawn_in_one_colour():
    residuals, *_ = trace_plates(result(7), samples(7, per_branch=200))
    _, line = residuals.charts[0].marks
    assert isinstance(line, Line)
    assert (line.tone, line.name) == ("grey", "7 records")
    assert line.x.size <= MOST_POINTS


def test_the_command_names_every_reference():
    said = trace_command(("new 1.csv",), ("a.csv", "b.csv"))
    assert said == "notchbend trace 'new 1.csv' --reference a.csv --reference b.csv --out DIR"


@pytest.fixture
def folder(tmp_path):
    write_result(tmp_path / "trace.json", result())
    (tmp_path / "trace-samples.csv").write_text(samples_csv(samples()))
    return tmp_path


def test_samples_are_read_as_they_were_written(folder):
    read, written = read_samples(folder / "trace-samples.csv", records=2), samples()
    assert (read.drive_unit, read.clock) == ("mm", "time_s")
    for name, column in written.columns().items():
        np.testing.assert_allclose(read.columns()[name], column, atol=1e-5, err_msg=name)


def test_the_report_draws_charts_and_names_the_pictures(folder):
    (trace,) = page_of(folder).traces
    assert [len(plate.charts) for plate in trace.plates] == [8, 4, 2]
    assert (trace.figures, trace.pictures) == ((), ("trace-residual.png",))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("record,cycle", "r,cycle", "trace-samples.csv: column 'record' missing"),
        ("\n1,1,-1,", "\n3,1,-1,", "trace-samples.csv:2: column record = 3: expected a whole number from 1 to 2"),
        ("\n1,1,-1,", "\n1,-1,-1,", "trace-samples.csv:2: column cycle = -1: expected a whole number from 0"),
        ("\n1,1,-1,", "\n1,1,x,", "trace-samples.csv:2: column 'drive_mm' = 'x': expected a number"),
        ("\n2,", "\n1,", "trace-samples.csv: column record: none of 2: expected 1 to 2"),
    ],
)
def test_spoiled_samples_are_named_in_one_line(old, new, said, folder, capsys):
    path = folder / "trace-samples.csv"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new) if old == "\n2," else text.replace(old, new, 1))
    assert call(["report", str(folder)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (folder / "report.html").exists()


def test_samples_outside_the_folder_are_refused(folder, capsys):
    write_result(folder / "trace.json", replace(result(), samples_file="../trace-samples.csv"))
    assert call(["report", str(folder)]) == 2
    assert "outside its folder" in capsys.readouterr().err
