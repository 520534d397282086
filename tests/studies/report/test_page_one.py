"""The first page: rows with a requirement and without, its drawing, and what stands behind it."""

import re
import shutil
from dataclasses import replace

import pytest
from page_links import dead_references
from results_folder import copy_results

from fem_models.drawings import side_view_svg
from fem_models.rig import preset
from studies.own_rig.key_numbers import derived
from studies.report.page import write_report
from studies.report.parts.page_one import page_one_section
from studies.results import write_result
from studies.results.page_one import FILE, KeyNumber, PageOne, Tightening

BEND = KeyNumber("Bend", "deg", 63.2, "at least 60", 3.2, 0.97, "met", note="of the tip")
TENSION = KeyNumber("Tension", "N", 21.0, "at most 20", -1.0, 0.2, "not met")
PLAIN = KeyNumber("Bend", "deg", 63.2, note="a <note> & more")


def page(*rows, drawing=None):
    tighten = (Tightening("notch.depth_mm", "+0.02 mm", 1.5, -4.0, None),)
    return PageOne(
        at="at 1.3 mm and 20 N", rows=rows, tighten=tighten, first=("Tighten depth first.",), drawing=drawing
    )


@pytest.fixture
def run(tmp_path_factory, tmp_path):
    return shutil.copytree(copy_results(tmp_path_factory, tmp_path)["run"], tmp_path / "one")


def html_of(folder, made):
    write_result(folder / FILE, made)
    return re.sub(r"<(script|style)\b.*?</\1>", "", write_report(folder).read_text(), flags=re.S)


def test_a_requirement_has_margin_probability_and_verdict(run):
    html = html_of(run, page(BEND, TENSION))
    assert "Do not cut yet: 1 of 2 requirements are met. Look at: Tension (not met)." in html
    assert re.search(r'data-label="P\(met\)">97.0 %', html)
    assert re.search(r'<span class="state look">not met</span>', html)
    assert html.index('id="design"') < html.index('id="summary"')
    assert dead_references(html) == []


def test_without_a_requirement_there_is_no_verdict(run):
    (run / "drawing.svg").write_text(side_view_svg(preset("du2018")))
    html = html_of(run, page(PLAIN, drawing="drawing.svg"))
    assert "No requirement was given" in html
    assert "P(met)" not in html
    assert "a &lt;note&gt; &amp; more" in html
    assert 'src="data:image/svg+xml;base64,' in html
    assert re.search(r"All \d+ numbers of the rig", html)
    assert "data:image/svg+xml" not in html_of(run, page(PLAIN))


def test_all_met():
    found = page_one_section(page(BEND), None)
    assert (found.good, found.judged, found.has_odds) == (True, True, True)
    assert found.verdict == "By the model, cut a first tube: all 1 requirements are met, each as surely as was asked."
    sure_of_nothing = page_one_section(page(replace(BEND, p_met=None)), None)
    assert "how surely is not known" in sure_of_nothing.verdict


def test_few_draws_leave_a_verdict_open():
    found = page_one_section(page(replace(BEND, p_low=0.92, p_asked=0.95)), None)
    assert "draw more before" in found.verdict
    assert "Bend" in found.verdict


def test_derived_numbers():
    """Closing angle of a V by hand: 2 atan of half the width over the radius."""
    found = derived(preset("du2018"))
    assert found["joint.closes_at_deg"] == pytest.approx(25.698, abs=1e-3)
    assert found["length_mm"] == pytest.approx(14 * 2.6)
