"""`notchbend app`: what follows from the sliders, and the page in a browser."""

import subprocess
import sys
import threading
import xml.etree.ElementTree as ET
from queue import Queue

import numpy as np
import pytest
from browser import chromium, ink, listen, require_browser, screenshots, tints

from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_mechanics
from fem_models.rig import RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.presets import PRESETS
from hysteresis.metrics import loop_width
from studies.app.loop_svg import loop_svg
from studies.app.playground import AMPLITUDE, answer, sliders, with_values
from studies.commands import call
from validation.separation import loop_program

AMPLITUDES = {"du2018": 2.2, "notched-wrist-90": 1.0, "notched-wrist-150": 1.0}


def at_start(name):
    rig = preset(name)
    return rig, {slider.name: slider.start for slider in sliders(rig, AMPLITUDES[name])}


def test_answer_is_that_of_the_chain():
    rig, values = at_start("du2018")
    found = answer(rig, values)
    record = solve_chain(rig, loop_program(-2.2, 2.2)).record
    assert found.angle_deg.max() == pytest.approx(record.angle_deg.max(), rel=1e-12)  # sums in another order
    assert found.drive_mm[0] == found.drive_mm[-1] == 2.2  # a closed cycle
    assert found.angle_deg[0] == pytest.approx(found.angle_deg[-1], abs=0.02)
    width = loop_width(record.drive, record.angle_deg, record.cycle).max_deg
    assert dict(found.figures)["Largest loop width"] == f"{width:.2f} deg"
    full = int(record.angle_deg.argmax())
    largest = np.radians(record.notches_deg[full]).max() * joint_mechanics(rig).peak_strain_per_rad
    # the scene integrates the flexibility by trapezoids, the closed form by quadrature
    assert found.tube["strain_percent"].max() == pytest.approx(100 * largest, rel=1e-4)


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
        same = moved.angle_deg.shape == loops[0].angle_deg.shape and np.array_equal(moved.angle_deg, loops[0].angle_deg)
        assert not same, slider.name
    assert all(np.isfinite(found.angle_deg).all() for found in loops)


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
    svg = ET.fromstring(loop_svg([(drive, angle), (0.5 * drive, 0.5 * angle)]))
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
    port = served.rstrip("/").rsplit(":", 1)[1]
    assert call(["app", "--no-browser", "--port", port]) == 2
    assert f"--port {port}" in capsys.readouterr().err


@pytest.fixture(scope="module")
def served():
    """Address of a running app."""
    require_browser()
    command = "from studies.commands import main; main()"
    arguments = ["app", "--port", "0", "--no-browser"]
    app = subprocess.Popen(
        [sys.executable, "-c", command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    line = Queue()
    threading.Thread(target=lambda: line.put(app.stdout.readline()), daemon=True).start()
    try:
        said = line.get(timeout=60)
        assert "http://127.0.0.1:" in said
        yield said.split()[-1]
    finally:
        app.terminate()
        app.communicate(timeout=20)


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
    return page.locator(".loop .now").get_attribute("d")


def move(page, key: str, value: float) -> None:
    """Move a slider and wait for the loop that follows."""
    before = loop(page)
    page.locator(f"#{key}").fill(str(value))
    page.wait_for_function(
        "before => document.querySelector('.loop .now').getAttribute('d') !== before", arg=before, timeout=10_000
    )


def test_page_opens_without_errors_or_network(opened, tmp_path):
    page, heard = opened
    assert heard.errors == []
    assert heard.hosts == []
    assert page.title() == "notchbend: du2018"
    assert page.locator("input[type=range]").count() == 6
    for i in range(6):  # each has a label that a reader of the screen says
        key = page.locator("input[type=range]").nth(i).get_attribute("id")
        assert page.locator(f"label[for={key}] span").inner_text()
    page.screenshot(path=screenshots(tmp_path) / "app.png")


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
    page.wait_for_function("document.querySelector('.figures').innerText.includes('45.01 deg')", timeout=10_000)
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


def test_a_rig_that_cannot_follow_is_said_on_the_page(opened, tmp_path):
    page, heard = opened
    page.locator("#notch_depth_mm").fill("3.065")  # deeper than the wall can carry
    page.wait_for_selector(".message:visible", timeout=10_000)
    assert "du2018" in page.locator(".message").inner_text()
    page.screenshot(path=screenshots(tmp_path) / "app-message.png")
    page.get_by_role("button", name="Reset").click()
    page.wait_for_selector(".message", state="hidden", timeout=10_000)
    assert heard.errors == []
