"""Parts of the page: the folders of identify, validate and compensate, designs within limits, and what to do."""

import json
import re
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.metrics import Errors
from studies.commands.cli import call
from studies.report.charts import Chart, Heat, Line
from studies.report.live import chart_json
from studies.report.page import write_report
from studies.report.parts.advice import what_to_do
from studies.report.parts.feasible import feasibility, region_plate
from studies.report.plots import parts_plate
from studies.report.still import has_legend_above
from studies.report.study import read_study
from studies.report.summary import study_verdicts, trace_verdict
from studies.results import write_result
from studies.results.compensation import CompensationSummary
from studies.results.fit import Baseline, NotFixed, StoredFit
from studies.results.run import CrossCheckRow
from studies.results.trace import NamedEffect, StoredTrace
from studies.results.validation import BentRow, ModelStiffness, StoredModels, StoredValidation

SMALL, LARGE = (Errors(rmse_deg=x, max_abs_deg=3 * x, max_rel_percent=1.0, normalised=0.01) for x in (0.06, 0.4))


def page(folder) -> str:
    return re.sub(r"<script\b.*?</script>", "", write_report(folder).read_text(), flags=re.S)


def write_identify(folder, *, heldout=SMALL, train=SMALL) -> None:
    fit = StoredFit(
        kinematics="analytic",
        parameters={"A": Parameter(1.0, 0.9, None, "deg")},
        heldout=heldout,
        warnings=(),
        baseline=Baseline(LARGE),
        heldout_by="the last cycle",
        noise_floor_deg=0.05,
        records=("a/bench-10N.csv", "a/bench 20N.csv"),
        train=train,
        layer={"saturation_deg": Parameter(0.5, 0.4, 0.6, "deg"), "asymmetry": Parameter(0.1, -0.1, 0.3, "1")},
        not_fixed=NotFixed(("A", "n"), "A and n compensate for each other"),
    )
    write_result(folder / "identify.json", fit)
    x = np.linspace(-1, 1, 9)
    rows = [f"{v},{20 * v},{20 * v + 0.1},{20 * v + 0.01},{int(v > 0)},{20 * v}" for v in x]
    head = "drive,angle_deg,f_alone_deg,predicted_deg,heldout,predicted_by_law_deg"
    for name in ("identify.csv", "identify-2.csv"):
        (folder / name).write_text("\n".join([head, *rows]) + "\n")


def test_the_folder_of_identify_has_a_page(tmp_path):
    write_identify(tmp_path, train=replace(SMALL, rmse_deg=0.0421))
    html = page(tmp_path)
    assert html.count("<svg") == 2 * 3  # two records, three charts each
    assert "saturation: largest |h|" in html
    assert "Not fixed by these data: A and n compensate for each other" in html
    row = re.search(r'<tr><th scope="row">bench-10N \+ bench 20N</th>.*?</tr>', html, re.S)[0]
    before, fitted, predicted = re.findall(r'<td class="n">([\d.]+)</td>', row)[:3]
    assert (before, fitted, predicted) == ("0.400", "0.0421", "0.0600")
    assert f"notchbend identify a/bench-10N.csv &#39;a/bench 20N.csv&#39; --out {tmp_path} --seed 0" in html


def test_the_folder_of_validate_has_a_page(tmp_path, capsys):
    numbers = {field.name: 0.5 for field in fields(CrossCheckRow)} | {"rig": "mine", "preload_N": 15.0}
    bent = (BentRow(1.0, 12.5, 0.0),)
    models = (
        ModelStiffness("solid", 500.0, 900.0, 300.0, 0.0, bent),
        ModelStiffness("chain", 512.5, None, None, 2.5, (BentRow(1.0, 12.2, -2.4),)),
    )
    write_result(
        tmp_path / "validate.json",
        StoredValidation((CrossCheckRow(**numbers),), StoredModels("mine", "solid", models), "--rig mine.toml"),
    )
    assert call(["report", str(tmp_path), "--quiet"]) == 0, capsys.readouterr().err
    html = page(tmp_path)
    assert "512.5 (+2.5 %)" in html
    assert "12.20 (-2.4 %)" in html
    assert f"notchbend validate --rig mine.toml --out {tmp_path}" in html
    assert "2.5 %" in re.search(r'<td class="found">(.*?)</td>', html)[1]


def test_the_folder_of_compensate_has_a_page(tmp_path):
    found = CompensationSummary(1, 3, 0.05, 0.4, 0.03, "mm", (), "bench.csv", "wanted.csv", "drive.csv")
    write_result(tmp_path / "drive-compensate.json", found)
    (tmp_path / "drive.csv").write_text("time_s,drive_mm,angle_deg\n0,0.0,0\n1,1.1,20\n2,0.1,0\n")
    html = page(tmp_path)
    assert "0.400 → 0.0500 deg" in html
    assert html.count("<svg") == 2
    assert f"notchbend compensate bench.csv --reference wanted.csv --out {tmp_path}/drive.csv" in html
    (tmp_path / "drive.csv").unlink()
    assert call(["report", str(tmp_path)]) == 2


def study(tmp_path, margin):
    """Two preloads by three depths; the loop is narrowest at the last depth, whose fatigue margin is the given one."""
    dims, shape = ("preload_N", "notch.depth_mm"), (2, 3)
    width = np.array([[3.0, 2.0, 1.0], [2.8, 1.8, 0.8]])
    margins = np.array([[1.2, 1.1, margin], [1.3, 1.05, margin]])
    texts = {
        name: (dims, np.full(shape, v, dtype=np.dtypes.StringDType()))
        for name, v in (("status", "ok"), ("message", ""))
    }
    data = xr.Dataset(
        {
            "full_scale_angle_deg": (dims, np.full(shape, 40.0), {"units": "deg"}),
            "loop_width_max_deg": (dims, width, {"units": "deg"}),
            "fatigue_margin": (dims, margins, {"units": "1"}),
            **texts,
        },
        {"preload_N": [10.0, 20.0], "notch.depth_mm": [2.7, 2.75, 2.8]},
        {"title": "depth", "engine": "chain"},
    )
    data.to_zarr(tmp_path / "study.zarr", mode="w", zarr_format=3, consolidated=False)
    return data


def test_a_design_that_breaks_the_fatigue_limit_is_no_best_design(tmp_path):
    found = feasibility(study(tmp_path, margin=0.9))
    assert (found.cases, found.kept) == (6, 4)
    assert found.best.feasible
    assert found.best.at == {"preload_N": 20.0, "notch.depth_mm": 2.75}  # 1.8 deg; 0.8 deg breaks the limit
    section = read_study(tmp_path)
    states = {verdict.title: verdict.state for verdict in study_verdicts(section, "notchbend study")}
    assert states == {"Study": "holds", "Designs within limits": "look"}
    (words,) = what_to_do(tmp_path, section.feasible)
    median = 100 * np.median([3.0, 2.0, 2.8, 1.8]) / 40
    assert f"{100 * (1 - 4.5 / median):.0f} % less than the median of the 4 designs" in words
    html = page(tmp_path)
    assert "4 of 6 cases keep all limits." in html
    assert words in html


def test_where_all_designs_keep_the_limits_it_is_a_green_tick(tmp_path):
    found = feasibility(study(tmp_path, margin=1.5))
    assert (found.kept, found.best.width_deg) == (6, 0.8)
    verdicts = study_verdicts(read_study(tmp_path), "notchbend study")
    assert [verdict.state for verdict in verdicts] == ["holds", "holds"]


def test_where_no_design_keeps_the_limits_the_advice_says_so(tmp_path):
    data = study(tmp_path, margin=1.5)
    data["fatigue_margin"] = 0.1 * data["fatigue_margin"]
    found = feasibility(data)
    assert (found.kept, found.best.feasible) == (0, False)
    (words,) = what_to_do(tmp_path, found)
    assert words.startswith("No design of the study keeps all limits")
    assert "fatigue margin 0.15" in words


def test_the_region_shows_every_case_once(tmp_path):
    data = study(tmp_path, margin=0.9)
    (chart,) = region_plate(data, ("preload_N", "notch.depth_mm"), feasibility(data)).charts
    counts = {mark.name: mark.x.size for mark in chart.marks}
    assert counts == {"outside the limits": 2, "within all limits": 4, "narrowest loop": 1}


def shares(interval):
    """Friction makes all of a loop, with an interval; the material makes none, less a rounding error."""
    rows = {"friction": (1.0, interval), "material": (-1e-14, None)}
    parts = {
        name: SimpleNamespace(share_of=lambda _, v=value: v, interval=lambda _, e=ends: e)
        for name, (value, ends) in rows.items()
    }
    return SimpleNamespace(contributions=parts)


def test_bars_are_seen_beside_intervals_that_are_far_wider():
    (narrow,) = parts_plate(shares((0.8, 1.2))).charts
    (wide,) = parts_plate(shares((-20.0, 22.0))).charts
    assert narrow.x_range is None
    assert wide.x_range == pytest.approx((-50.0, 150.0))  # half the bars' reach on either side
    assert "in the table" in parts_plate(shares((-20.0, 22.0))).caption
    assert json.loads(chart_json(wide))["layout"]["xaxis"]["range"] == pytest.approx([-50.0, 150.0])
    assert "material 0 %" in wide.alt  # no minus before a zero


def test_a_legend_stands_above_what_fills_a_chart():
    x = np.array([0.0, 1.0])
    lines = (Line(x, x, "a"), Line(x, x, "b"))
    filled = Chart("", "x", "y", (Heat(x, x, np.eye(2), ""), *lines), "")
    assert has_legend_above(filled)
    assert not has_legend_above(replace(filled, legend=False))
    assert not has_legend_above(Chart("", "x", "y", lines, ""))


def grid(tmp_path, sizes):
    """A study over a grid; the fatigue margin and the width of the loop fall from the first value of each axis on."""
    steps = np.meshgrid(*(np.linspace(0, 1, size) for size in sizes.values()), indexing="ij")
    fall = sum(steps) / len(sizes)
    texts = {
        k: (tuple(sizes), np.full(fall.shape, v, np.dtypes.StringDType()))
        for k, v in (("status", "ok"), ("message", ""))
    }
    numbers = {"full_scale_angle_deg": 40 + 0 * fall, "loop_width_max_deg": 4 - 2 * fall, "fatigue_margin": 1.5 - fall}
    units = {"units": "deg", "long_name": "largest angle"}
    values = {name: (tuple(sizes), column, units) for name, column in numbers.items()}
    data = xr.Dataset({**values, **texts}, {name: np.arange(size) + 1.0 for name, size in sizes.items()})
    data["fatigue_margin"].attrs = {"units": "1"}
    data.to_zarr(tmp_path / "study.zarr", mode="w", zarr_format=3, consolidated=False)
    return data


def test_preload_depth_and_count_are_small_multiples_with_the_region(tmp_path):
    data = grid(tmp_path, {"preload_N": 4, "notch.count": 3, "notch.depth_mm": 5})
    width, angle = read_study(tmp_path).plates[:2]
    assert (width.heading, angle.heading) == ("Width of the loop, % of the full scale", "Largest angle, deg")
    assert [chart.title for chart in width.charts] == ["notch count 1", "notch count 2", "notch count 3"]
    assert {(chart.x_label, chart.y_label) for chart in width.charts} == {("notch depth, mm", "preload, N")}
    kept = 0
    for place, chart in enumerate(width.charts):
        heat, inside, outside, *best = chart.marks
        layer = data.isel({"notch.count": place}).transpose("preload_N", "notch.depth_mm")
        np.testing.assert_allclose(heat.z, 100 * layer["loop_width_max_deg"].values / 40)
        assert heat.scale == pytest.approx((5.0, 10.0))  # one scale: 2 and 4 deg of 40
        feasible = layer["fatigue_margin"].values >= 1
        assert (inside.x.size, outside.x.size) == (feasible.sum(), (~feasible).sum())
        assert {*zip(inside.y - 1, inside.x - 1, strict=True)} == {*zip(*np.nonzero(feasible), strict=True)}
        kept += len(best)
    assert kept == 1  # the best design of those within the limits is in one of the charts
    assert f"{int((data['fatigue_margin'] >= 1).sum())} of the 60 designs drawn keep all limits" in width.caption
    page(tmp_path)


def test_two_axes_have_no_small_multiples_and_a_fourth_is_held(tmp_path):
    (tmp_path / "two").mkdir()
    grid(tmp_path / "two", {"preload_N": 4, "notch.depth_mm": 5, "notch.count": 1})
    assert read_study(tmp_path / "two").plates[0].charts[0].title == "Designs within the limits"
    grid(tmp_path, {"tube.wall_mm": 3, "notch.depth_mm": 30, "notch.angle_deg": 3, "notch.count": 9})
    plate = read_study(tmp_path).plates[0]
    assert len(plate.charts) == 6  # of nine counts
    assert plate.charts[0].marks[0].z.shape == (3, 24)  # of 30 depths
    assert plate.caption.startswith("One scale of colours for all charts; notch angle, deg at 2.")


@pytest.mark.parametrize(("verdict", "said"), [("none", "the layer alone does not"), ("effect", "see its trace")])
def test_advice_on_a_fit_knows_its_trace(verdict, said, tmp_path):
    write_identify(tmp_path, heldout=replace(SMALL, rmse_deg=0.15))
    assert "`notchbend trace` looks for what is missing" in what_to_do(tmp_path)[0]
    effects = (NamedEffect("backlash"),) if verdict == "effect" else ()
    records = ("bench-10N.csv", "bench 20N.csv")
    write_result(
        tmp_path / "trace.json", StoredTrace(verdict, records, effects=effects, next_experiment="a slow record")
    )
    layer, *rest = what_to_do(tmp_path)
    assert "3 times the noise" in layer
    assert said in layer
    assert rest[-1] == "Measure next, for the trace of bench-10N.csv, bench 20N.csv: a slow record."
    assert len(rest) == 1 + (verdict == "effect")


def test_a_part_of_a_residual_is_not_called_the_residual():
    words = trace_verdict(StoredTrace("partial", ("a.csv",), effects=(NamedEffect("backlash"),)), "command").words
    assert words.startswith("a part of the residual is traced to an effect")
