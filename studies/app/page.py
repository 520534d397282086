"""``notchbend app``: a local page with sliders that update the loop and the tube.

trame synchronises the page with Python, and vtk.js draws the tube in the browser. Python draws nothing and needs no
OpenGL, and the page loads nothing from the network.
"""

from __future__ import annotations

import asyncio
import base64
import socket
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.view import SceneError
from hysteresis.plain import to_plain
from studies.app.guard import HOST, Guard
from studies.app.loop_svg import loop_svg
from studies.app.playground import Answer, Slider, answer, sliders
from studies.engines import MissingError
from studies.report.tube import shaded

if TYPE_CHECKING:
    import pyvista as pv

TOP_STRAIN_PERCENT = 6.0
"""End of the colour scale: the strain of the test for superelasticity (ASTM F2516)."""
LIGHT, DARK = (1.0, 1.0, 1.0), (0.09, 0.11, 0.145)
"""Background of the tube, as ``--card`` in ``app.css``."""
OBLIQUE = np.array([[0.93, 0.0, 0.37], [-0.13, 0.94, 0.32], [-0.35, -0.35, 0.87]])
"""Rotation to an oblique view, as in the pictures of :mod:`fem_models.view.manipulator`: about x, then about y."""
STYLE = Path(__file__).with_name("app.css")


class ServeError(MissingError):
    """The page cannot be served; one line with the reason."""


def serve(
    rig: Rig, amplitude_mm: float, *, port: int, browser: bool, ready: Callable[[str], None] = lambda address: None
) -> None:
    """Serve the page of a rig until it is interrupted; ``ready`` is called with its address.

    Parameters
    ----------
    port
        Port on 127.0.0.1; 0 takes any free port.

    Raises
    ------
    RigError, SolverError
        A rig that cannot follow the amplitude to start with.
    ServeError
        A port that is not available.
    """
    first = answer(rig, {s.name: s.start for s in sliders(rig, amplitude_mm)})
    _require_free(port)
    from trame.app import get_server

    server = get_server("notchbend", client_type="vue3")
    guard = Guard()
    # not our command line
    server.cli.parse_known_args = partial(server.cli.parse_known_args, ["--authKey", guard.secret])
    page = Page(server, rig, sliders(rig, amplitude_mm), first)
    page.build()
    server.controller.on_server_bind.add(lambda bound: guard.protect(bound.app))

    def announce(**_: Any) -> None:
        ready(guard.address(server.port))
        if browser:
            asyncio.get_running_loop().run_in_executor(None, webbrowser.open, guard.address(server.port))

    server.controller.on_server_ready.add(announce)
    server.start(port=port, host=HOST, open_browser=False, show_connection_info=False, disable_logging=True, timeout=0)


def _require_free(port: int) -> None:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except (OSError, OverflowError) as error:
            why = getattr(error, "strerror", None) or error
            raise ServeError(f"--port {port}: {why}: expected a free port of {HOST}, or 0 for any") from None


class Page:
    """The page of one rig: the values of its sliders, and the answer that it shows."""

    def __init__(self, server: Any, rig: Rig, moved: Sequence[Slider], first: Answer) -> None:
        self.server, self.state, self.rig, self.sliders, self.first = server, server.state, rig, moved, first
        self.wanted: dict[str, float] = {}
        self.task: asyncio.Task[None] | None = None
        self.state.backdrop = None
        self.state.client_only("backdrop")  # each browser has its own
        self.state.trame__title = f"notchbend: {rig.name}"
        self.state.rig_name = rig.name  # data: in the template it would be evaluated
        for slider in moved:
            self.state[slider.key] = slider.start
        self.show(first)

    def show(self, found: Answer) -> None:
        """Show an answer on the page."""
        with self.state:
            self.state.message = ""
            self.state.figures = [{"name": name, "value": value} for name, value in found.figures]
            self.state.loop = loop_svg([(self.first.drive_mm, self.first.angle_deg), (found.drive_mm, found.angle_deg)])
            self.state.tube = to_plain(mesh_of(found.tube))

    def refuse(self, error: Exception) -> None:
        """Show why there is no answer; the last one stays, greyed out."""
        with self.state:
            self.state.message = " ".join(str(error).split())

    def values(self) -> dict[str, float]:
        """Give the values of the sliders by dotted name; a browser sends them as text."""
        return {slider.name: float(self.state[slider.key]) for slider in self.sliders}

    def changed(self, **_: Any) -> None:
        """Follow the sliders; while an answer is computed, all moves but the last are skipped."""
        self.wanted = self.values()
        if self.task is None or self.task.done():
            self.task = asyncio.get_running_loop().create_task(self._follow())

    async def _follow(self) -> None:
        done: Mapping[str, float] | None = None
        while done != self.wanted:
            done = dict(self.wanted)
            try:
                self.show(await asyncio.to_thread(answer, self.rig, done))
            except (RigError, SolverError, SceneError, ValueError) as error:
                self.refuse(error)

    def reset(self) -> None:
        """Set every slider to the number of the rig."""
        for slider in self.sliders:
            self.state[slider.key] = slider.start

    def build(self) -> None:
        """Lay out the page."""
        from trame.ui.html import DivLayout
        from trame.widgets import client, html, vtk

        keys = [slider.key for slider in self.sliders]
        self.state.change(*keys)(self._changed_when_served)
        with DivLayout(self.server, classes="page"):
            client.Style(STYLE.read_text(encoding="utf-8"))
            dark = "window.matchMedia('(prefers-color-scheme: dark)').matches"
            client.ClientTriggers(mounted=f"backdrop = {dark} ? {list(DARK)} : {list(LIGHT)}")
            with html.Header():
                html.H1("{{ rig_name }}")
                html.P(
                    "Chain model, one closed cycle for each move. Grey: the rig with its own numbers.", classes="soft"
                )
            with html.Section(classes="controls", raw_attrs=['aria-label="Sliders"']):
                for slider in self.sliders:
                    self._slider(html, slider)
                html.Button("Reset", type="button", click=self.reset)
            with html.Main(raw_attrs=[":class=\"{ stale: message !== '' }\""]):
                html.P("{{ message }}", classes="message", v_show=("message !== ''",), raw_attrs=['role="alert"'])
                with (
                    html.Dl(classes="figures", raw_attrs=['aria-live="polite"']),
                    html.Div(v_for="item in figures", key=("item.name",)),
                ):
                    html.Dt("{{ item.name }}")
                    html.Dd("{{ item.value }}")
                with html.Div(classes="views"):
                    html.Div(v_html=("loop",), classes="loop")
                    with html.Div(
                        classes="tube", raw_attrs=['role="figure"', 'aria-label="The bent tube, coloured by strain"']
                    ):
                        with (
                            vtk.VtkView(v_if="backdrop", background=("backdrop",), style="width: 100%; height: 100%"),
                            vtk.VtkGeometryRepresentation(
                                mapper=("{ colorByArrayName: 'colour', scalarMode: 3, colorMode: 0 }",),
                                property=("{ lighting: false }",),
                            ),
                        ):
                            vtk.VtkMesh("tube", state=("tube",))
                        with html.Div(classes="scale"):
                            html.Span("0")
                            html.I()
                            html.Span(f"{TOP_STRAIN_PERCENT:g} % strain")

    def _changed_when_served(self, **state: Any) -> None:
        if self.server.running:
            self.changed(**state)

    @staticmethod
    def _slider(html: Any, slider: Slider) -> None:
        unit = f" {slider.unit}" if slider.unit else ""
        with html.Label(classes="slider", raw_attrs=[f'for="{slider.key}"']):
            html.Span(slider.label)
            html.Output(
                f"{{{{ Number({slider.key}).toFixed({slider.decimals}) }}}}{unit}", raw_attrs=[f'for="{slider.key}"']
            )
            html.Input(
                type="range",
                v_model_number=slider.key,
                raw_attrs=[
                    f'id="{slider.key}"',
                    f'min="{slider.low:g}"',
                    f'max="{slider.high:g}"',
                    f'step="{slider.step:g}"',
                ],
            )


@dataclass(frozen=True)
class PackedArray:
    """An array as vtk.js reads it: base64 of its bytes."""

    bvals: str
    dtype: str
    shape: tuple[int, ...]


@dataclass(frozen=True)
class MeshPoints:
    """Points of a surface, mm, and its triangles."""

    points: PackedArray
    polys: PackedArray


@dataclass(frozen=True)
class MeshColour:
    """Red, green and blue of every point."""

    values: PackedArray
    name: str = "colour"
    numberOfComponents: int = 3
    type: str = "Uint8Array"
    location: str = "PointData"
    dataRange: tuple[int, int] = (0, 255)


@dataclass(frozen=True)
class MeshState:
    """A coloured surface as vtk.js reads it."""

    mesh: MeshPoints
    field: MeshColour


def mesh_of(tube: pv.PolyData) -> MeshState:
    """Give the surface of a tube with the colour of its strain."""
    triangles = tube.faces.reshape(-1, 4)[:, 1:]
    colour = shaded(tube.points.astype(float), triangles, np.asarray(tube["strain_percent"]), TOP_STRAIN_PERCENT)
    return MeshState(
        MeshPoints(
            points=_packed((tube.points @ OBLIQUE.T).astype(np.float32)),
            polys=_packed(tube.faces.astype(np.uint32)),
        ),
        MeshColour(_packed(colour)),
    )


def _packed(values: NDArray[Any]) -> PackedArray:
    array = np.ascontiguousarray(values)
    return PackedArray(base64.b64encode(array.tobytes()).decode(), str(array.dtype), array.shape)
