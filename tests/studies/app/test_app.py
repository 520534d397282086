"""`notchbend app`: what follows from the sliders, and the page in a browser."""

import xml.etree.ElementTree as ET
import zipfile
from urllib.parse import urlsplit

import numpy as np
import pytest
from browser import chromium, ink, keep_picture, listen, require_browser, serving, tints

from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_mechanics
from fem_models.rig import RigError, preset, read_rig
from fem_models.rig.checks import SolverError
from fem_models.rig.of_record import rig_of
from fem_models.rig.presets import PRESETS
from fem_models.view.manipulator import tendon_lines
from hysteresis.records.metrics import loop_width
from hysteresis.records.record_file import read_record
from studies.app.loop_svg import Curve, loop_svg
from studies.app.playground import AMPLITUDE, answer, sliders, with_values
from studies.app.scene import mesh_of
from studies.bench_record import SHIPPED
from studies.commands import call
from studies.report.tube import coarse_surface
from validation.separation import loop_program

AMPLITUDES = {"du2018": 2.2, "du2018-full-widths": 2.2, "notched-wrist-90": 1.0, "notched-wrist-150": 1.0}


def at_start(name):
    rig = preset(name)
    return rig, {slider.name: slider.start for slider in sliders(rig, AMPLITUDES[name])}


def angles(found):
    """Angle of the closed cycle."""
    return found.plots[0].now[1]


def test_answer_is_that_of_the_chain():
    rig, values = at_start("du2018")
    found = answer(rig, values)
    record = solve_chain(rig, loop_program(-2.2, 2.2)).record
    drive, angle = found.plots[0].now
    assert angle.max() == pytest.approx(record.angle_deg.max(), rel=1e-12)  # sums in another order
    assert drive[0] == drive[-1] == 2.2  # a closed cycle
    assert angle[0] == pytest.approx(angle[-1], abs=0.02)
    width = loop_width(record.drive, record.angle_deg, record.cycle).max_deg
    assert dict(found.figures)["Largest loop width"] == f"{width:.2f} deg"
    full = int(record.angle_deg.argmax())
    largest = np.radians(record.notches_deg[full]).max() * joint_mechanics(rig).peak_strain_per_rad
    # the scene integrates the flexibility by trapezoids, the closed form by quadrature
    bent = coarse_surface(rig, record.notches_deg[full])
    assert bent["strain_percent"].max() == pytest.approx(100 * largest, rel=1e-4)
    assert found.mesh == mesh_of(bent, tendon_lines(rig, record.notches_deg[full]), rig.joint.tube.outer_diameter_mm)


@pytest.mark.parametrize("name", PRESETS)
def test_every_rig_has_an_answer_and_every_slider_moves_it(name):
    rig, values = at_start(name)
    loops = [answer(rig, values)]
    for slider in sliders(rig, AMPLITUDES[name]):
        assert slider.low <= slider.start <= slider.high
        # a step of the slider towards the middle of its range; friction needs a preload to act on in a rig without
        direction = 1 if slider.start < 0.5 * (slider.low + slider.high) else -1
        moved = answer(rig, values | {slider.name: slider.start + 5 * direction * slider.step})
        loops.append(moved)
        assert not np.array_equal(angles(moved), angles(loops[0])), slider.name
    assert all(np.isfinite(angles(found)).all() for found in loops)


@pytest.mark.parametrize("name", PRESETS)
def test_notches_go_from_a_quarter_of_the_tube_through_its_wall_and_answer_there(name):
    """They had gone from 85 % of the deepest cut on."""
    rig, values = at_start(name)
    (depth,) = (slider for slider in sliders(rig, AMPLITUDES[name]) if slider.name == "notch.depth_mm")
    tube = rig.joint.tube
    assert depth.low == pytest.approx(tube.outer_diameter_mm / 4, abs=depth.step)
    assert depth.low > (tube.outer_diameter_mm - tube.inner_diameter_mm) / 2
    shallow, start = answer(rig, values | {depth.name: depth.low}), answer(rig, values)
    assert 0 < np.abs(angles(shallow)).max() < np.abs(angles(start)).max()


def test_values_that_cannot_be_are_named():
    rig, values = at_start("du2018")
    with pytest.raises(RigError, match=r"notch\.depth_mm = 3\.2"):
        answer(rig, values | {"notch.depth_mm": 3.2})
    with pytest.raises(SolverError, match="du2018"):
        answer(rig, values | {AMPLITUDE: 30.0})
    with pytest.raises(RigError, match=r"notch\.colour = 1"):
        with_values(rig, {"notch.colour": 1.0})


def test_loop_is_drawn_to_scale():
    drive, angle = np.array([2.0, 0.0, -2.0, 0.0, 2.0]), np.array([40.0, 1.0, -40.0, -1.0, 40.0])
    drawn = loop_svg([Curve("before", drive, angle), Curve("now", 0.5 * drive, 0.5 * angle)], "bending angle, deg")
    svg = ET.fromstring(drawn)
    curves = {path.get("class"): path.get("d") for path in svg.iter("path")}
    before, now = (np.array([p.split() for p in curves[k][1:].split("L")], dtype=float) for k in ("before", "now"))
    assert np.allclose(np.ptp(now, axis=0), 0.5 * np.ptp(before, axis=0), atol=0.2)
    ticks = [text.text for text in svg.iter("text")]
    assert {"-2", "0", "2", "-40", "40", "drive, mm", "bending angle, deg"} <= set(ticks)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--preset", "du2019"], "du2019"),
        (["--preset", "du2018", "--rig", "mine.toml"], "--preset or --rig"),
        (["--amplitude", "-1"], "--amplitude = -1"),
        (["--amplitude", "60"], "du2018"),
        (["--port", "70000"], "70000"),
    ],
)
def test_bad_input_is_one_line(arguments, said, capsys):
    assert call(["app", "--no-browser", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_a_port_in_use_is_named(served, capsys):
    port = str(urlsplit(served).port)
    assert call(["app", "--no-browser", "--port", port]) == 2
    assert f"--port {port}" in capsys.readouterr().err


@pytest.fixture(scope="module")
def served():
    """Address of a running app."""
    require_browser()
    with serving() as address:
        yield address


@pytest.fixture(scope="module")
def opened(served):
    """The page in a browser, and what it said."""
    with chromium() as running:
        page = running.new_context(color_scheme="dark", viewport={"width": 1280, "height": 800}).new_page()
        heard = listen(page)
        page.goto(served)
        page.wait_for_selector(".loop .now", timeout=30_000)
        page.wait_for_selector(".tube canvas", timeout=30_000)
        page.wait_for_timeout(1500)
        yield page, heard


def loop(page) -> str:
    return page.locator(".loop .now").first.get_attribute("d")


def move(page, key: str, value: float) -> None:
    """Move a slider and wait for the loop that follows."""
    before = loop(page)
    page.locator(f"#{key}").fill(str(value))
    page.wait_for_function(
        "before => document.querySelector('.loop .now').getAttribute('d') !== before", arg=before, timeout=10_000
    )


def test_page_opens_without_errors_or_network(opened):
    page, heard = opened
    assert heard.errors == []
    assert heard.hosts == []
    assert page.title() == "notchbend: du2018"
    assert page.locator("input[type=range]").count() == 6
    for i in range(6):  # each has a label that a reader of the screen says
        key = page.locator("input[type=range]").nth(i).get_attribute("id")
        assert page.locator(f"label[for={key}] span").inner_text()
    keep_picture(page, "app")


def test_tube_is_drawn_and_follows(opened):
    page, _ = opened
    before = page.locator(".tube").screenshot()
    assert ink(before, height=0.9) > 0.03  # the scale stands at the foot
    assert tints(before, height=0.9) > 20
    move(page, "amplitude_mm", 1.0)
    page.wait_for_timeout(600)
    assert page.locator(".tube").screenshot() != before


def test_sliders_change_the_loop_and_its_numbers(opened):
    page, heard = opened
    page.get_by_role("button", name="Reset").click()
    angle = dict(answer(*at_start("du2018")).figures)["Largest angle"]
    shown = "angle => document.querySelector('.figures').innerText.includes(angle)"
    page.wait_for_function(shown, arg=angle, timeout=10_000)
    start = loop(page)
    for key, value in (
        ("preload_N", 10),
        ("notch_depth_mm", 2.725),
        ("notch_width_mm", 1.6),
        ("friction_sheath_N", 0.5),
        ("friction_capstan_coefficient", 0.1),
    ):
        move(page, key, value)
    rig, values = at_start("du2018")
    wanted = {"preload_N": 10, "notch.depth_mm": 2.725, "notch.width_mm": 1.6, "friction.sheath_N": 0.5}
    found = answer(rig, values | wanted | {"friction.capstan_coefficient": 0.1})
    page.wait_for_timeout(500)
    shown = page.locator(".figures").inner_text()
    assert all(value in shown for _, value in found.figures)
    page.get_by_role("button", name="Reset").click()
    page.wait_for_function("start => document.querySelector('.loop .now').getAttribute('d') === start", arg=start)
    assert heard.errors == []


def test_a_rig_that_cannot_follow_is_said_on_the_page(opened):
    page, heard = opened
    page.locator("#notch_depth_mm").fill("3.065")  # deeper than the wall can carry
    page.wait_for_selector("main .message:visible", timeout=10_000)
    said = page.locator("main .message").inner_text()
    assert said.startswith("These values are not possible: rig du2018: preload_N = 20: expected below 3.737")
    keep_picture(page, "app-message")
    page.get_by_role("button", name="Reset").click()
    page.wait_for_selector("main .message", state="hidden", timeout=10_000)
    assert heard.errors == []


def test_what_is_saved_is_what_the_sliders_say(opened, tmp_path):
    page, heard = opened
    page.get_by_role("button", name="Reset").click()
    move(page, "preload_N", 12)
    page.wait_for_timeout(300)
    with page.expect_download() as rig_file:
        page.get_by_role("button", name="Save the rig").click()
    assert rig_file.value.suggested_filename == "du2018.toml"
    rig_file.value.save_as(tmp_path / "mine.toml")
    assert read_rig(tmp_path / "mine.toml") == preset("du2018", preload_N=12.0)
    with page.expect_download() as record:
        page.get_by_role("button", name="Save the record").click()
    record.value.save_as(tmp_path / "record.zip")
    zipfile.ZipFile(tmp_path / "record.zip").extractall(tmp_path)
    found = read_record(tmp_path / "du2018" / "du2018.csv")
    expected = solve_chain(preset("du2018", preload_N=12.0), loop_program(-2.2, 2.2)).record
    assert np.array_equal(found.angle_deg, expected.angle_deg)
    assert rig_of(found) == preset("du2018", preload_N=12.0)
    assert heard.errors == []


def test_a_measured_record_is_opened_beside(opened):
    page, heard = opened
    chosen = [SHIPPED, SHIPPED.with_suffix(".toml")]
    assert page.locator(".loop .measured").count() == 0
    page.locator("input[type=file]").set_input_files(chosen)
    page.wait_for_selector(".loop .measured", state="attached", timeout=10_000)
    assert page.locator(".loop .measured").count() == 2  # the angle, and the angle less its backbone
    assert read_record(SHIPPED).title in page.locator(".legend").inner_text()
    page.get_by_role("button", name="Close it").click()
    page.wait_for_selector(".loop .measured", state="detached", timeout=10_000)
    page.locator("input[type=file]").set_input_files(chosen[1:])
    page.wait_for_selector(".files .message:visible", timeout=10_000)
    assert page.locator(".files .message").inner_text() == "no CSV was chosen: expected a record, CSV"
    assert heard.errors == []
