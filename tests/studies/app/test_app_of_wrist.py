"""`notchbend app` of a rig in space: what follows from the sliders, and the page in a browser."""

import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from browser import chromium, ink, keep_picture, listen, require_browser, serving

from fem_models.rig import preset
from fem_models.rig.checks import RigError, SolverError
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import rig_in_space
from fem_models.rig.rig_file import any_rig_of_tables, read_any_rig
from fem_models.spatial.drives import circle
from fem_models.spatial.motion.run_record import simulate_in_space
from hysteresis.records.record_file import read_record, write_record
from studies.app.advice import in_words
from studies.app.files import rig_text
from studies.app.loop_svg import plot_svg
from studies.app.page import answer_of, sliders_of
from studies.app.playground import AMPLITUDE, answer
from studies.commands import call

WRIST = any_preset("zhang2026")
EVIL = "{{7*7}} <img src=x onerror=alert(1)> {{constructor.constructor('alert(2)')()}} `${alert(3)}`'\""


def start_of(rig, amplitude_mm):
    return {slider.name: slider.start for slider in sliders_of(rig, amplitude_mm)}


def test_a_planar_rig_in_space_has_the_answer_of_the_planar_page():
    """Same loop, same strain, same tensions; the path is the loop of its only wheel."""
    rig, values = preset("du2018"), start_of(preset("du2018"), 2.2)
    planar, found = answer(rig, values), answer_of(rig_in_space(rig), values)
    for one, other in zip(found.plots, planar.plots, strict=False):
        np.testing.assert_allclose(one.now, other.now, atol=1e-6)
    shown, expected = dict(found.figures), dict(planar.figures)
    assert shown["Largest angle"] == expected["Largest angle"]
    assert shown["Loop width, wheel 1"] == expected["Largest loop width"]
    assert shown["Tension"] == expected["Tension"]
    assert shown["Peak strain, weak bending"] == expected["Peak strain"]
    assert [words.removeprefix("Wheel 1: ") for words in found.warnings] == list(planar.warnings)
    assert [plot.kind for plot in found.plots] == ["whole", "bare", "path"]


def test_every_slider_moves_the_answer():
    values = start_of(WRIST, 0.8)
    first = answer_of(WRIST, values)
    assert [plot.kind for plot in first.plots] == ["whole", "bare", "whole", "bare", "path"]
    assert first.directions_deg == pytest.approx((0.0, 90.0), abs=1e-9)
    assert list(first.records) == ["-wheel-1", "-wheel-2", "-path"]
    for slider in sliders_of(WRIST, 0.8):
        moved = answer_of(WRIST, values | {slider.name: slider.start + 5 * slider.step})
        assert moved.figures != first.figures or moved.mesh != first.mesh, slider.name
    svg = plot_svg(first.plots[-1], first.plots[-1], None)
    assert {path.get("class") for path in ET.fromstring(svg).iter("path")} == {"grid", "before", "smooth", "now"}


def test_a_circle_is_round_in_the_page():
    """A millimetre is as long along both axes."""
    plot = answer_of(WRIST, start_of(WRIST, 0.8)).plots[-1]
    svg = ET.fromstring(plot_svg(plot, plot, None))
    drawn = next(path.get("d") for path in svg.iter("path") if path.get("class") == "now")
    places = np.array([point.split() for point in drawn[1:].split("L")], dtype=float)
    assert np.ptp(places, axis=0) / np.ptp(plot.now, axis=1) == pytest.approx([31.0] * 2, rel=0.3)
    ratio = np.ptp(places, axis=0) / np.ptp(plot.now, axis=1)
    assert ratio[0] == pytest.approx(ratio[1], rel=5e-3)


def test_three_wheels_bend_towards_y_and_z():
    rig = any_rig_of_tables(WRIST.to_dict() | {"tendons": {"angles_deg": [0, 120, 240]}}, "three")
    found = answer_of(rig, start_of(rig, 0.8))
    assert list(found.records) == ["-towards-y", "-towards-z", "-path"]


def test_a_measured_record_stands_beside():
    found = answer_of(WRIST, start_of(WRIST, 0.8))
    whole_1, bare_1, whole_2, bare_2, path = found.beside(found.records["-wheel-2"])
    assert (whole_1, bare_1) == (None, None)  # wheel 1 stands still in it
    assert np.abs(whole_2[1]).max() == pytest.approx(np.abs(found.plots[2].now[1]).max())
    assert bare_2 is not None
    assert path[0].shape == path[1].shape
    both = found.beside(found.records["-path"])
    assert both[:4] == (None,) * 4
    assert both[4] is not None
    planar = replace(found.records["-wheel-1"], angle_2_deg=None, tip_mm=None)
    assert found.beside(planar) == (None,) * 5


def test_values_that_cannot_be_are_said():
    values = start_of(WRIST, 0.8)
    with pytest.raises(RigError, match=r"notch\.depth_mm = 1\.9"):
        answer_of(WRIST, values | {"notch.depth_mm": 1.9})
    with pytest.raises(SolverError) as error:
        answer_of(WRIST, values | {AMPLITUDE: 12.0})
    said = in_words(error.value, values | {AMPLITUDE: 12.0}, values)
    assert "Try a smaller amplitude." in said
    words = "rig x, sample 4 of 9: no equilibrium between drives (0.3, -0.3, 0.1, -0.1) and (0.4, -0.4, 0.2, -0.2), 3 %"
    assert "beyond a drive of 0.3 mm" in in_words(SolverError(words), values, values)


def test_a_saved_rig_is_read_as_it_was(tmp_path):
    (tmp_path / "rig.toml").write_text(rig_text(WRIST))
    assert read_any_rig(tmp_path / "rig.toml") == WRIST


def test_bad_input_is_one_line(capsys):
    assert call(["app", "--no-browser", "--preset", "zhang2026", "--amplitude", "30"]) == 2
    error = capsys.readouterr().err
    assert "zhang2026" in error
    assert error.count("\n") == 1


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """Address of an app whose rig in space and record have hostile names."""
    require_browser()
    folder = tmp_path_factory.mktemp("hostile")
    rig = replace(WRIST, name=EVIL)
    (folder / "rig.toml").write_text(rig_text(rig))
    write_record(replace(simulate_in_space(WRIST, circle(0.6)), title=EVIL + "{{6*7}}"), folder / "bench.csv")
    with serving("--rig", str(folder / "rig.toml"), "--record", str(folder / "bench.csv")) as address:
        yield address


def test_the_page_shows_loops_path_and_picture(served, tmp_path):
    """In either style, wide and narrow; names are text, sliders work, and what is saved is what they say."""
    with chromium() as running:
        for scheme, width in (("light", 1400), ("dark", 420)):
            page = running.new_context(color_scheme=scheme, viewport={"width": width, "height": 1000}).new_page()
            heard, dialogs = listen(page), []
            page.on("dialog", lambda dialog, into=dialogs: (into.append(dialog.message), dialog.dismiss()))
            page.goto(served)
            page.wait_for_selector(".loop .now", timeout=30_000)
            page.wait_for_selector(".tube canvas", timeout=30_000)
            page.wait_for_timeout(1500)
            assert page.locator("h1").inner_text() == EVIL
            assert page.title() == f"notchbend: {EVIL}"
            assert f"{EVIL}{{{{6*7}}}}" in page.locator(".legend").inner_text()
            assert page.locator(".loop").count() == 5
            assert page.locator(".loop.path .smooth").count() == 1
            assert page.locator(".loop .measured").count() == 1  # the path: in a circle no wheel moves alone
            assert ink(page.locator(".tube").screenshot(), height=0.85) > 0.03
            assert page.locator("img").count() == 0
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            assert (dialogs, heard.errors, heard.hosts) == ([], [], [])
            keep_picture(page, f"app-in-space-{scheme}-{width}", full_page=True)
            if width > 1000:
                moved_and_saved(page, tmp_path)
            page.close()


def moved_and_saved(page, folder):
    before = page.locator(".loop .now").first.get_attribute("d")
    page.locator("#preload_N").fill("4")
    page.wait_for_function(
        "before => document.querySelector('.loop .now').getAttribute('d') !== before", arg=before, timeout=10_000
    )
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save the record").click()
    saved.value.save_as(folder / "record.zip")
    zipfile.ZipFile(folder / "record.zip").extractall(folder)
    (inside,) = (path for path in folder.iterdir() if path.is_dir() and any(path.glob("*-path.csv")))
    assert {path.stem.split("-rig")[0].removeprefix(inside.name) for path in inside.glob("*.csv")} == {
        "-wheel-1", "-wheel-2", "-path",
    }  # fmt: skip
    record = read_record(next(inside.glob("*-wheel-2.csv")))
    assert record.rig["preload_N"] == 4
    assert np.ptp(record.drive) == 0
    assert np.ptp(record.drive_2) > 2
