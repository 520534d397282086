"""The page: what stands in the folder is shown, and in a browser it draws, turns, changes theme, and prints."""

import html as markup
import json
import re
import shutil
import sys
from pathlib import Path

import browser
import numpy as np
import pytest
import xarray as xr
import zarr
from browser import chromium, ink, keep_picture, listen, tints
from page_links import dead_references
from results_folder import copy_results

from studies.commands.cli import call
from studies.report import pdf
from studies.report.page import write_report
from studies.report.study import read_study

SECTIONS = {
    "run": {"summary", "todo", "rig", "crosschecks", "loops", "contributions", "layer", "versions"},
    "trace": {"summary", "todo", "trace"},
    "study": {"summary", "study", "pareto", "versions"},
}


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """Three folders, each with the results of one command."""
    return copy_results(tmp_path_factory, tmp_path_factory.mktemp("parts"))


@pytest.fixture(scope="module")
def whole(parts, tmp_path_factory):
    """A folder with all of it, and its page."""
    folder = tmp_path_factory.mktemp("all")
    for part in parts.values():
        shutil.copytree(part, folder, dirs_exist_ok=True)
    return write_report(folder)


@pytest.fixture(scope="module")
def opened(whole):
    """The page in a browser, drawn, and what it said."""
    with chromium() as running:
        page = running.new_context(color_scheme="light", viewport={"width": 1280, "height": 900}).new_page()
        heard = listen(page)
        page.goto(whole.as_uri())
        page.wait_for_selector("html[data-ready=yes]", timeout=60_000)
        yield page, heard


def sections(html: str) -> set[str]:
    return set(re.findall(r'<h2 id="(\w+)"', html))


def words(html: str) -> str:
    """The page without its scripts and styles."""
    return re.sub(r"<(script|style)\b.*?</\1>", "", html, flags=re.S)


def test_a_run_without_a_picture_says_why_in_one_line(parts, tmp_path):
    """As ``notchbend run`` stores it where the extra ``view`` is not installed."""
    folder = shutil.copytree(parts["run"], tmp_path / "run")
    stored = json.loads((folder / "run.json").read_text())
    reason = "pyvista is not installed: expected for pictures: pip install 'notchbend[view]'"
    stored["picture"] = {"caption": "du2018 at 2.2 mm", "missing": reason}
    (folder / "run.json").write_text(json.dumps(stored))
    page = words(write_report(folder).read_text())
    assert markup.unescape(re.search(r'<p class="warn">(No picture: .*)</p>', page)[1]) == f"No picture: {reason}"
    assert "Drag to rotate" not in page


def own_rig(parts, folder, **changes):
    """The run as that of a user's own rig, without its fits and its separation: none of its records was fitted."""
    shutil.copytree(parts["run"], folder)
    for path in folder.glob("separate*.json"):
        path.unlink()
    stored = json.loads((folder / "run.json").read_text())
    name, loop = "du2018-20N", stored["loops"][-1]["record"]
    prediction = {"record": name, "predicted": loop, "rmse_deg": 0.4, "max_abs_deg": 1.0, "noise_floor_deg": 0.05}
    prediction |= {"width_deg": 2.0, "predicted_width_deg": 1.0}
    own = {"name": "mine", "option": "--rig mine.toml", "amplitude_mm": 2.2, "predictions": [prediction]}
    stored |= {"own": own, "fits": [], "separations": []} | changes
    (folder / "run.json").write_text(json.dumps(stored))
    return words(write_report(folder).read_text())


def test_the_page_of_an_own_rig_names_only_sections_that_it_has(parts, tmp_path):
    """It had named calibrated numbers where it had none, and linked to records that had no section."""
    page = own_rig(parts, tmp_path / "own")
    assert "times the noise: measure friction and stiffness." in page
    assert "records" in sections(page)
    assert dead_references(page) == []


def test_the_elements_of_the_paper_are_none_of_an_own_rig(parts, tmp_path):
    own, paper = own_rig(parts, tmp_path / "own"), words(write_report(parts["run"]).read_text())
    assert "elements an arc" in paper
    assert "elements an arc" not in own
    assert "largest difference without friction" in own


@pytest.mark.parametrize("name", SECTIONS)
def test_a_part_is_shown_where_its_results_stand(name, parts, capsys):
    assert call(["report", str(parts[name]), "--quiet"]) == 0, capsys.readouterr().err
    html = (parts[name] / "report.html").read_text()
    assert sections(html) == SECTIONS[name]
    assert dead_references(html) == []


def test_all_parts_stand_in_one_page_in_order(whole):
    found = re.findall(r'<h2 id="(\w+)"', whole.read_text())
    order = "summary todo rig crosschecks loops contributions layer trace study pareto versions"
    assert found == order.split()


def test_page_loads_nothing_and_names_how_to_make_its_numbers(whole):
    html = words(whole.read_text())
    assert not re.search(r'(src|href)="(?!data:|#)', html)
    for command in (
        f"run --out {whole.parent}",
        "validate",
        "simulate --preset du2018",
        "separate",
        "identify",
        "trace",
        "study",
    ):
        assert f"notchbend {command}" in html
    verdicts = re.findall(r"<tr><td><span class=\"state.*?</tr>", html, re.S)
    assert len(verdicts) == 10  # six of the run, and one each of the separation, the trace, the study and the front
    assert all("<code>notchbend " in verdict for verdict in verdicts)


def test_what_results_say_is_text_and_not_markup(whole):
    html = whole.read_text()
    for said in ("a <source>", "a <warning>", "no equilibrium <here>"):
        assert said not in html
        assert said.replace("<", "&lt;").replace(">", "&gt;") in html


def test_pictures_have_words_and_tables_have_headers(whole):
    html = words(whole.read_text())
    for picture in re.findall(r"<img [^>]*>", html):
        assert re.search(r'alt="[^"]{5,}"', picture)
    for still in re.findall(r'<div class="still"[^>]*>(?=<svg)', html):
        assert re.search(r'role="img" aria-label="[^"]{5,}"', still)
    tables = re.findall(r"<table.*?</table>", html, re.S)
    assert tables
    assert all('<th scope="col"' in table for table in tables)


def test_an_interrupted_study_is_shown_as_one(parts, tmp_path):
    folder = tmp_path / "study"
    shutil.copytree(parts["study"], folder)
    status = zarr.open_group(folder / "study.zarr", mode="r+")["status"]
    status[1, :] = np.full(4, "pending", dtype=np.dtypes.StringDType())
    html = words(write_report(folder).read_text())
    assert "24 cases, 1 of them failed." in html
    assert "4 of 24 cases have not been run" in html
    assert "1 failed, for the reasons below, 4 not run yet" in html


def test_of_many_samples_a_part_is_drawn(tmp_path):
    """The pictures are of the first 1,024 cases, and say so; the numbers of all of them."""
    count = 3000
    values = np.arange(count, dtype=float)
    data = xr.Dataset(
        {
            "tension_max_N": ("case", values, {"units": "N", "long_name": "largest tension"}),
            "status": ("case", np.full(count, "ok", dtype=np.dtypes.StringDType())),
            "message": ("case", np.full(count, "", dtype=np.dtypes.StringDType())),
        },
        {"case": np.arange(count), "preload_N": ("case", values), "notch.depth_mm": ("case", values[::-1].copy())},
    )
    data.to_zarr(tmp_path / "study.zarr", mode="w", zarr_format=3, consolidated=False)
    (tmp_path / "study.json").write_text('{"axes": {"preload_N": {}, "notch.depth_mm": {}}}')
    section = read_study(tmp_path)
    (plate,) = section.plates
    assert plate.charts[0].marks[0].x.tolist() == values[:1024].tolist()
    assert "the first 1,024 samples" in plate.caption
    assert (section.cases, section.rows[0].high) == (count, count - 1)


def test_of_a_fine_grid_a_part_is_drawn(tmp_path):
    """At most 200 values of the two axes in the pictures, the third in its middle; the numbers of all cases."""
    sizes = {"preload_N": 450, "notch.depth_mm": 3, "notch.count": 5}
    shape = tuple(sizes.values())
    angle = np.arange(np.prod(shape), dtype=float).reshape(shape)
    data = xr.Dataset(
        {"full_scale_angle_deg": (tuple(sizes), angle, {"units": "deg", "long_name": "angle"})}
        | {
            name: (tuple(sizes), np.full(shape, text, dtype=np.dtypes.StringDType()))
            for name, text in (("status", "ok"), ("message", ""))
        },
        {name: np.arange(size, dtype=float) for name, size in sizes.items()},
    )
    data.to_zarr(tmp_path / "study.zarr", mode="w", zarr_format=3, consolidated=False)
    section = read_study(tmp_path)
    heat = section.plates[0].charts[0].marks[0]
    assert np.array_equal(heat.z, angle[::3, :, 2].T)
    assert "notch count at 2" in section.plates[0].caption
    assert "at most 200 values of an axis" in section.plates[0].caption
    assert section.rows[0].high == angle.max()


def test_same_results_give_the_same_page(whole):
    before = whole.read_bytes()
    assert write_report(whole.parent).read_bytes() == before


@pytest.mark.parametrize(
    ("part", "file", "content", "said"),
    [
        ("trace", "trace.json", "{}", "trace.json: verdict: missing"),
        ("trace", "trace.json", "[1]", "trace.json"),
        ("trace", "trace-residual.csv", "drive,angle\n1,x\n", "trace-residual.csv"),
        ("study", "pareto.json", '{"front": 3}', "pareto.json"),
        ("study", "sensitivity.json", '{"quantities": {"a": {}}}', "sensitivity.json"),
        ("study", "study.zarr/zarr.json", "{", "study.zarr"),
        ("run", "tube.json", '{"points_mm": 1}', "tube.json"),
        ("run", "separate-du2018-20N.json", '{"schema": 1}', "separate-du2018-20N.json: rig: missing"),
    ],
)
def test_a_broken_result_is_named_in_one_line(part, file, content, said, parts, tmp_path, capsys):
    folder = tmp_path / "copy"
    shutil.copytree(parts[part], folder)
    (folder / "report.html").unlink(missing_ok=True)
    (folder / file).write_text(content)
    assert call(["report", str(folder)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (folder / "report.html").exists()


def test_an_empty_folder_is_no_report(tmp_path, capsys):
    assert call(["report", str(tmp_path)]) == 2
    assert "run.json" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_charts_are_drawn_without_errors_or_network(opened):
    page, heard = opened
    charts = page.locator(".chart").count()
    assert charts == page.locator(".chart.drawn .live[data-drawn=yes]").count() > 10
    for i in range(charts):
        chart = page.locator(".chart").nth(i)
        assert chart.locator(".live svg.main-svg, .live canvas").count() > 0
        if "solid" not in chart.get_attribute("class"):
            drawn = chart.locator(".trace path, .heatmaplayer image, .points path").count()
            assert drawn > 0, chart.inner_text()
    assert heard.errors == []
    assert heard.hosts == []
    keep_picture(page, "report-light")


def test_legends_stand_below_their_charts_clear_of_tool_bar_and_title(opened):
    """The tool bar had covered the legend of 16 charts of 17."""
    page, _ = opened
    boxes = page.evaluate(
        """() => [...document.querySelectorAll('.chart.drawn:not(.solid)')].map((chart) =>
        ['.live', 'g.legend', '.modebar', '.xtitle'].map((part) => {
          const box = chart.querySelector(part)?.getBoundingClientRect();
          return box ? [box.top, box.bottom] : null;
        }))"""
    )
    legends = [box for box in boxes if box[1] is not None]
    assert len(legends) > 3
    for live, legend, tools, title in legends:
        assert tools[1] <= legend[0]
        assert title[1] <= legend[0] + 1
        assert legend[1] <= live[1] + 1


def test_tube_is_there_and_turns(opened):
    page, _ = opened
    tube = page.locator(".chart.solid .live").first
    keep_picture(tube, "report-tube")
    before = tube.screenshot()
    assert ink(before, width=0.85) > 0.03  # the colour bar stands at the right
    assert tints(before, width=0.85) > 20  # metal in light and shade, and the colours of the strain
    page.get_by_role("button", name="From the tip").click()
    page.wait_for_timeout(400)
    turned = tube.screenshot()
    assert turned != before
    tube.focus()
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(400)
    assert tube.screenshot() != turned


def test_a_surface_of_the_study_can_be_chosen(opened):
    page, _ = opened
    surface = page.locator("section[aria-labelledby=study] .solid .live")
    before = surface.screenshot()
    assert ink(before) > 0.02
    page.get_by_role("combobox").select_option(index=1)
    page.wait_for_timeout(600)
    assert surface.screenshot() != before


def test_theme_can_be_changed(opened):
    page, heard = opened
    back = "getComputedStyle(document.body).backgroundColor"
    tick = "getComputedStyle(document.querySelector('.xtick text')).fill"
    light = page.evaluate(f"[{back}, {tick}]")
    page.get_by_role("button", name="Dark").click()
    # the charts are drawn again one after the other
    ticks = "[...document.querySelectorAll('.xtick text')].map(text => getComputedStyle(text).fill)"
    page.wait_for_function(f"{ticks}.every(fill => fill !== '{light[1]}')")
    dark = page.evaluate(f"[{back}, {tick}]")
    assert dark[0] != light[0]
    assert dark[1] != light[1]
    keep_picture(page, "report-dark")
    page.get_by_role("button", name="Light").click()
    page.wait_for_function(f"{ticks}.every(fill => fill === '{light[1]}')")
    assert heard.errors == []


def test_paper_has_still_pictures_in_light_colours(opened):
    page, _ = opened
    page.emulate_media(media="print", color_scheme="dark")
    try:
        assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        for i in range(page.locator(".chart").count()):
            assert not page.locator(".chart .live").nth(i).is_visible()
        assert page.locator(".still svg").first.is_visible()
        assert not page.locator("nav").is_visible()
        keep_picture(page, "report-print", full_page=True)
    finally:
        page.emulate_media(media="screen", color_scheme="light")


def test_pdf_is_printed(parts, tmp_path, capsys):
    browser.require_browser()
    folder = tmp_path / "study"
    shutil.copytree(parts["study"], folder)
    assert call(["report", str(folder), "--pdf", "--json"]) == 0, capsys.readouterr().err
    written = json.loads(capsys.readouterr().out)
    assert written["pdf"] == str(folder / "report.pdf")
    assert (folder / "report.pdf").read_bytes().startswith(b"%PDF-")
    assert (folder / "report.pdf").stat().st_size > 20_000
    assert not list(folder.glob(".pdf-*"))


def test_pdf_is_printed_by_weasyprint(parts, tmp_path, monkeypatch):
    pytest.importorskip("weasyprint", reason="WeasyPrint is not installed")
    monkeypatch.setattr(pdf, "BROWSERS", ("no-such-browser",))
    page = Path(shutil.copy(write_report(parts["study"]), tmp_path))
    assert pdf.write_pdf(page).read_bytes().startswith(b"%PDF-")


def test_weasyprint_without_its_libraries_is_one_line(parts, tmp_path, monkeypatch):
    (tmp_path / "weasyprint.py").write_text("raise OSError('cannot load library pango-1.0\\nsee the manual')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "weasyprint", raising=False)
    monkeypatch.setattr(pdf, "BROWSERS", ("no-such-browser",))
    page = Path(shutil.copy(write_report(parts["study"]), tmp_path))
    with pytest.raises(pdf.PdfError, match=r"^WeasyPrint: cannot load library pango-1\.0 see the manual: expected P"):
        pdf.write_pdf(page)
    assert not page.with_suffix(".pdf").exists()


def test_without_anything_to_print_with_there_is_one_line(parts, tmp_path, capsys, monkeypatch):
    folder = tmp_path / "trace"
    shutil.copytree(parts["trace"], folder)
    monkeypatch.setattr(pdf, "BROWSERS", ("no-such-browser",))
    monkeypatch.setattr(pdf, "has_weasyprint", lambda: False)
    assert call(["report", str(folder), "--pdf"]) == 2
    error = capsys.readouterr().err
    assert "--pdf: none of no-such-browser on the path, and no WeasyPrint" in error
    assert error.count("\n") == 1
    assert not (folder / "report.pdf").exists()
