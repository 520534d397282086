"""``notchbend app``: a local page with sliders that update the loop and the tube.

trame synchronises the page with Python, and vtk.js draws the tube in the browser. Python draws nothing and needs no
OpenGL, and the page loads nothing from the network.
"""

from __future__ import annotations

import asyncio
import socket
import threading
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.rig import Tendon
from fem_models.view import SceneError
from hysteresis.plain import to_plain
from hysteresis.records.record import Record, RecordError
from studies.app.advice import in_words
from studies.app.files import opened_record, record_files, rig_text
from studies.app.guard import HOST, Guard
from studies.app.loop_svg import plot_svg
from studies.app.playground import Answer, Slider, answer, sliders
from studies.app.scene import TOP_STRAIN_PERCENT
from studies.app.wrist import wrist_answer
from studies.engines import MissingError
from studies.results.files import file_stem

LIGHT, DARK = (1.0, 1.0, 1.0), (0.09, 0.11, 0.145)
"""Background of the tube, as ``--card`` in ``app.css``."""
STYLE = Path(__file__).with_name("app.css")
WORDS = {
    False: "Chain model: one closed cycle for each move of a slider.",
    True: "Chain in space: a closed cycle of each wheel and the path of the tip for each move of a slider.",
}
"""What is computed, of a planar rig and of one in space."""
REFIT, REFIT_AFTER_S = 0.05, 0.4
"""Change of the length of the tube, as a share, from which the view is fitted again, and how long after."""


class ServeError(MissingError):
    """The page cannot be served; one line with the reason."""


def serve(
    rig: Rig, amplitude_mm: float, *, port: int, browser: bool, measured: Record | None = None,
    ready: Callable[[str], None] = lambda address: None,
) -> None:  # fmt: skip
    """Serve the page of a rig until it is interrupted; ``ready`` is called with the address to open.

    Parameters
    ----------
    measured
        A record to show beside the simulated one; its drive is in mm.
    port
        Port on 127.0.0.1; 0 takes any free port.

    Raises
    ------
    RigError, SolverError
        A rig that cannot follow the amplitude to start with.
    ServeError
        A port that is not available.
    """
    first = answer_of(rig, {s.name: s.start for s in sliders_of(rig, amplitude_mm)})
    _require_free(port)
    from trame.app import get_server

    server = get_server("notchbend", client_type="vue3")
    guard = Guard()
    # not our command line
    server.cli.parse_known_args = partial(server.cli.parse_known_args, ["--authKey", guard.secret])
    page = Page(server, rig, amplitude_mm, first)
    page.put_beside(measured)
    page.build()
    server.controller.on_server_bind.add(lambda bound: guard.protect(bound.app))
    with TemporaryDirectory(prefix="notchbend-", ignore_cleanup_errors=True) as folder:  # of this user alone

        def announce(**_: Any) -> None:
            ready(guard.address(server.port))
            if browser:
                opened = guard.redirect(server.port, Path(folder)).as_uri()
                # some browsers stay in the foreground: a thread that the end of the process does not wait for
                threading.Thread(target=webbrowser.open, args=(opened,), daemon=True).start()

        server.controller.on_server_ready.add(announce)
        quiet = {"open_browser": False, "show_connection_info": False, "disable_logging": True}
        server.start(port=port, host=HOST, timeout=0, **quiet)


def sliders_of(rig: Rig, amplitude_mm: float) -> tuple[Slider, ...]:
    """Give the sliders of a rig, of one plane or in space: those of its tube, tendons and friction."""
    return sliders(rig.in_plane, amplitude_mm)


def answer_of(rig: Rig, values: Mapping[str, float]) -> Answer:
    """Run the rig with the values of the sliders.

    Raises
    ------
    RigError, SolverError
        A rig that is not possible, or cannot follow the drive; one line.
    """
    return answer(rig, values) if rig.is_planar else wrist_answer(rig, values)


def _require_free(port: int) -> None:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except (OSError, OverflowError) as error:
            why = getattr(error, "strerror", None) or error
            raise ServeError(f"--port {port}: {why}: expected a free port of {HOST}, or 0 for any") from None


class Page:
    """The page of one rig: the values of its sliders, the answer that it shows, and a measured record beside it."""

    def __init__(self, server: Any, rig: Rig, amplitude_mm: float, first: Answer) -> None:
        self.server, self.state, self.rig, self.first, self.found = server, server.state, rig, first, first
        self.sliders = sliders_of(rig, amplitude_mm)
        self.start = {slider.name: slider.start for slider in self.sliders}
        self.view: Any = None
        self.size_mm = first.rig.length_mm
        self.measured: Record | None = None
        self.wanted: dict[str, float] = {}
        self.task: asyncio.Task[None] | None = None
        self.state.backdrop = None
        self.state.client_only("backdrop")  # each browser has its own
        # names and titles are data of the page: in its template they would be evaluated
        self.state.trame__title = f"notchbend: {rig.name}"
        self.state.rig_name, self.state.stem = rig.name, file_stem(rig.name)
        self.state.measured_title, self.state.file_message = "", ""
        for slider in self.sliders:
            self.state[slider.key] = slider.start
        self.show(first)

    def show(self, found: Answer) -> None:
        """Show an answer on the page."""
        self.found = found
        with self.state:
            self.state.message = ""
            self.state.figures = [{"name": name, "value": value} for name, value in found.figures]
            self.state.warnings = list(found.warnings)
            self.state.tube = to_plain(found.mesh)
            self._draw()
        if self.view is not None and abs(found.rig.length_mm / self.size_mm - 1.0) > REFIT:
            self.size_mm = found.rig.length_mm
            # the browser has to have the new tube before it fits the view to it
            asyncio.get_running_loop().call_later(REFIT_AFTER_S, self.view.reset_camera)

    def _draw(self) -> None:
        plots, before = self.found.plots, self.first.plots
        beside = (None,) * len(plots) if self.measured is None else self.found.beside(self.measured)
        drawn = zip(plots, before, beside, strict=True)
        self.state.charts = [{"kind": plot.kind, "svg": plot_svg(plot, first, other)} for plot, first, other in drawn]

    def refuse(self, error: Exception, values: Mapping[str, float]) -> None:
        """Show why there is no answer; the last one stays, greyed out."""
        with self.state:
            self.state.message = in_words(error, values, self.start)

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
                self.show(await asyncio.to_thread(answer_of, self.rig, done))
            except (RigError, SolverError, SceneError, ValueError) as error:
                self.refuse(error, done)

    def reset(self) -> None:
        """Set every slider to the number of the rig."""
        for slider in self.sliders:
            self.state[slider.key] = slider.start

    def open(self, files: Sequence[Mapping[str, Any]]) -> None:
        """Show a record that was chosen in the page, or say why not."""
        try:
            self.put_beside(opened_record(files))
        except RecordError as error:
            with self.state:
                self.state.file_message = str(error)

    def put_beside(self, record: Record | None) -> None:
        """Show a measured record beside the simulated one; None removes it."""
        self.measured = record
        with self.state:
            self.state.file_message = ""
            self.state.measured_title = "" if record is None else record.title or "measured record"
            self._draw()

    def build(self) -> None:
        """Lay out the page."""
        from trame.ui.html import DivLayout
        from trame.widgets import client, html, vtk

        self.state.change(*(slider.key for slider in self.sliders))(self._changed_when_served)
        self.server.trigger("rig_file")(lambda: rig_text(self.found.rig))
        self.server.trigger("record_files")(lambda: record_files(self.found.records, self.found.rig))
        self.server.trigger("open_record")(self.open)
        with DivLayout(self.server, classes="page"):
            client.Style(STYLE.read_text(encoding="utf-8"))
            dark = "window.matchMedia('(prefers-color-scheme: dark)').matches"
            client.ClientTriggers(mounted=f"backdrop = {dark} ? {list(DARK)} : {list(LIGHT)}")
            with html.Header():
                html.H1("{{ rig_name }}")
                html.P(WORDS[not self.rig.is_planar], classes="soft")
            with html.Section(classes="controls", raw_attrs=['aria-label="Sliders"']):
                for slider in self.sliders:
                    self._slider(html, slider)
                html.Button("Reset", type="button", click=self.reset)
                self._files(html)
            with html.Main(raw_attrs=[":class=\"{ stale: message !== '' }\""]):
                self._words(html)
                with html.Div(classes="views"):
                    with html.Div(classes="loops"):
                        self._legend(html, in_space=not self.rig.is_planar)
                        html.Div(
                            v_for="(chart, i) in charts",
                            key=("i",),
                            v_html="chart.svg",
                            classes="loop",
                            raw_attrs=[':class="chart.kind"'],
                        )
                    self.view = self._tube(html, vtk, self.rig.tendons)

    @staticmethod
    def _words(html: Any) -> None:
        """Messages, numbers and warnings."""
        html.P("{{ message }}", classes="message", v_show=("message !== ''",), raw_attrs=['role="alert"'])
        with (
            html.Dl(classes="figures", raw_attrs=['aria-live="polite"']),
            html.Div(v_for="item in figures", key=("item.name",)),
        ):
            html.Dt("{{ item.name }}")
            html.Dd("{{ item.value }}")
        with html.Ul(classes="warnings", v_show=("warnings.length",), raw_attrs=['aria-label="Warnings"']):
            html.Li("{{ words }}", v_for="words in warnings", key=("words",))

    @staticmethod
    def _legend(html: Any, *, in_space: bool) -> None:
        smooth = [("smooth", "no friction", None)] * in_space
        with html.P(classes="legend soft"):
            for kind, words, when in (
                ("now", "these values", None),
                ("before", "the rig's own numbers", None),
                *smooth,
                ("measured", "{{ measured_title }}", "measured_title !== ''"),
            ):
                with html.Span(**({} if when is None else {"v_show": (when,)})):
                    html.I(classes=kind)
                    html.Span(words)

    def _files(self, html: Any) -> None:
        """Buttons that save the rig and the record, and open a measured one."""
        with html.Div(classes="files", raw_attrs=['role="group"', 'aria-label="Files"']):
            save = "utils.download(stem + '{0}', trigger('{1}'), '{2}')"
            html.Button("Save the rig", type="button", click=save.format(".toml", "rig_file", "text/plain"))
            zipped = save.format("-record.zip", "record_files", "application/zip")
            html.Button("Save the record", type="button", click=zipped)
            with html.Label(classes="open"):
                html.Span("Open a measured record (CSV, and its sidecar)")
                html.Input(
                    type="file",
                    raw_attrs=['accept=".csv,.toml"', "multiple"],
                    change="trigger('open_record', [$event.target.files])",
                )
            html.Button(
                "Close it", type="button", v_show=("measured_title !== ''",), click=lambda: self.put_beside(None)
            )
            html.P("{{ file_message }}", classes="message", v_show=("file_message !== ''",), raw_attrs=['role="alert"'])

    @staticmethod
    def _tube(html: Any, vtk: Any, tendons: Sequence[Tendon]) -> Any:
        """Lay out the tube; give its view."""
        label = "The bent tube, coloured by strain, and its tendons"
        with html.Div(classes="tube", raw_attrs=['role="figure"', f'aria-label="{label}"']):
            view = vtk.VtkView(v_if="backdrop", background=("backdrop",), style="width: 100%; height: 100%")
            with (
                view,
                vtk.VtkGeometryRepresentation(
                    mapper=("{ colorByArrayName: 'colour', scalarMode: 3, colorMode: 0 }",),
                    property=("{ lighting: false }",),
                ),
            ):
                vtk.VtkMesh("tube", state=("tube",))
            with html.Div(classes="scale"):
                html.Span("0")
                html.I(classes="heat")
                html.Span(f"{TOP_STRAIN_PERCENT:g} % strain")
                for name in "abcd"[: len(tendons)]:
                    with html.Span(classes="tendon"):
                        html.I(classes=f"tendon-{name}")
                        html.Span(f"tendon {name}")
        return view

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
