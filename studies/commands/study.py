"""Commands that show many cases and whole folders: ``study``, ``report`` and ``app``."""
# Imports inside a command are needed by it alone.

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from fem_models.rig.checks import require
from hysteresis.extras import require_extra
from studies.commands.options import Common, EnsembleChoice, Out, Output, Overwrite, RigChoice
from studies.commands.tables import study_table
from studies.own_rig.strain import drive_to_angle_mm
from studies.progress import status
from studies.results.made import made_now
from studies.results.run import require_unchanged

PRESET = "du2018"
AMPLITUDE_MM = 2.2


@dataclass(frozen=True)
class WorkerChoice:
    """Where the cases of a study run."""

    workers: Annotated[
        int | None, typer.Option("--workers", help="Number of worker processes; by default one a core.")
    ] = None
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Address of a Dask scheduler, tcp://..., in place of --workers.")
    ] = None
    retry: Annotated[bool, typer.Option("--retry", help="Run the cases that failed again.")] = False


def study(
    *,
    file: Annotated[Path, typer.Argument(help="A study file, TOML, or the name of a ready study.")],
    out: Out,
    where: WorkerChoice,
    over: EnsembleChoice,
    seed: Annotated[
        int | None, typer.Option("--seed", min=0, help="Seed in place of all seeds of the study file.")
    ] = None,
    replacing: Overwrite,
    output: Output,
) -> None:
    """Run a parametric study; a study that was stopped or extended runs only the cases that are missing."""
    require_extra("study", "notchbend study")
    from studies.sweep import over_ensemble, read_study
    from studies.sweep.forks import begin_forking
    from studies.sweep.study_file import files_of_study

    definition = read_study(file, seed=seed)
    if over.ensemble:
        definition = over_ensemble(definition)
    replacing.allow(files_of_study(definition, out))
    if where.scheduler is None:
        begin_forking()
    from studies.sweep import run_study  # Dask takes a second

    summary = run_study(
        definition,
        out,
        workers=where.workers,
        scheduler=where.scheduler,
        retry=where.retry,
        progress=output.shows_progress,
        made=made_now(output.command),
    )
    ranges = list[str]()
    if over.ensemble and definition.sample is None:
        from studies.sweep.member_ranges import write_ranges

        ranges = [f"ranges over the ensemble: {write_ranges(out)}"]
    from studies.report.page import try_report

    output.show_with_page(summary, try_report(out), study_table(summary), f"wrote {out / summary.dataset}", *ranges)


def report(
    *,
    folder: Annotated[
        Path, typer.Argument(help="A folder of results: of run, study, identify, separate, trace and others.")
    ],
    pdf: Annotated[bool, typer.Option("--pdf", help="Also print it as PDF, with Chromium, else WeasyPrint.")] = False,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Write the report again from stored results."""
    from studies.report import write_pdf, write_report
    from studies.report.page import stands_alone

    if (folder / "study.zarr").exists():
        require_extra("study", "the report of a study")
    replacing.allow(folder / f"report.{end}" for end in (["html", "pdf"] if pdf else ["html"]))
    if not stands_alone(folder):
        require_unchanged(folder)
    written = {"report": write_report(folder)}
    if pdf:
        with status(common.shows_progress, "printing"):
            written["pdf"] = write_pdf(written["report"])
    result = {"schema": 1, **{name: str(path) for name, path in written.items()}}
    common.show(result, *(f"{name}: {path}" for name, path in written.items()))


@dataclass(frozen=True)
class AppRig(RigChoice):
    """A rig, by default the preset of the paper."""

    preset: Annotated[str | None, typer.Option("--preset", help=f"Rig to start with; by default {PRESET}.")] = None


def serve_app(
    *,
    rig: AppRig,
    amplitude: Annotated[
        float | None,
        typer.Option(
            "--amplitude",
            help=f"Amplitude of the drive to start with, mm; by default {AMPLITUDE_MM:g}, in space the one to 45 deg.",
        ),
    ] = None,
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, help="Port on 127.0.0.1; 0 takes any free port.")
    ] = 8765,
    record: Annotated[
        Path | None, typer.Option("--record", help="A measured record, CSV, to show beside; by default none.")
    ] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Open no browser.")] = False,
    common: Common,
) -> None:
    """Serve a local page with sliders; the chain computes loop and tube at once. Ctrl-C stops it.

    Only the printed address opens the page: it ends in a token of this run.
    """
    require_extra("app", "notchbend app")
    require_extra("view", "notchbend app")
    from hysteresis.records.record_file import read_record
    from studies.app import serve
    from studies.app.files import shown

    if amplitude is not None:
        require(amplitude > 0, "--amplitude", amplitude, "above 0")
    chosen = RigChoice(rig.preset or (None if rig.rig else PRESET), rig.rig, rig.preload).read_any()
    if amplitude is None:
        amplitude = AMPLITUDE_MM if chosen.is_planar else drive_to_angle_mm(chosen.in_plane)
    measured = None if record is None else shown(read_record(record), str(record))

    def ready(address: str) -> None:
        common.show({"schema": 1, "address": address}, f"{chosen.name}: {address}")
        sys.stdout.flush()

    serve(chosen, amplitude, port=port, browser=not no_browser, measured=measured, ready=ready)
