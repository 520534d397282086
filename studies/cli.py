"""The command ``notchbend``. Bad input: one line on standard error and exit 2, nothing half-written."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from fem_models.presets import PRESETS, preset
from fem_models.program import LoadProgram, SolverError, sine, triangle
from fem_models.rig import Rig, RigError
from fem_models.rig_file import read_rig
from hysteresis.record import RecordError, read_record, write_record
from studies import run as first
from studies.engines import ENGINES, program_of_file
from studies.fetch import CATALOGUE, SOURCES_ONLY, FetchError, fetch_record
from studies.report.page import write_report

Engine = StrEnum("Engine", {name: name for name in ENGINES})  # type: ignore[misc]

app = typer.Typer(
    no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False, help=__doc__
)
data_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Measured records from public repositories.")
app.add_typer(data_app, name="data")

Out = Annotated[Path, typer.Option("--out", help="Folder for the results; made if it is not there.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress and no summary.")]
AsJson = Annotated[bool, typer.Option("--json", help="The result as JSON on standard output.")]


@app.command("run")
def run_command(
    out: Out = Path("results/first-report"), seed: Seed = 0, quiet: Quiet = False, as_json: AsJson = False
) -> None:
    """Simulate at 10 and 20 N, cross-check, identify, and write the report: the main job on the defaults."""
    summary = first.first_report(out, seed=seed, progress=not quiet and not as_json)
    report = write_report(out)
    _show(summary, quiet, as_json, [f"report: {report}"])


@app.command()
def simulate(
    out: Annotated[Path, typer.Option("--out", help="The record to write, a CSV; its sidecar goes beside it.")],
    preset_name: Annotated[str | None, typer.Option("--preset", help=f"One of {', '.join(PRESETS)}.")] = None,
    rig_file: Annotated[Path | None, typer.Option("--rig", help="A rig file, TOML.")] = None,
    preload: Annotated[float | None, typer.Option("--preload", help="N; the rig's own if not given.")] = None,
    amplitude: Annotated[float | None, typer.Option("--amplitude", help="Of the drive, mm.")] = None,
    cycles: Annotated[int, typer.Option("--cycles", help="Closed loops after the way out to the amplitude.")] = 1,
    step: Annotated[float, typer.Option("--step", help="Of a point-by-point program, mm.")] = 0.1,
    rate: Annotated[float | None, typer.Option("--rate", help="Hz: a sine in place of point by point.")] = None,
    program_file: Annotated[
        Path | None, typer.Option("--program", help="CSV with drive_mm and, if wanted, time_s.")
    ] = None,
    engine: Annotated[Engine, typer.Option("--engine", help="Model.")] = Engine.multibody,  # type: ignore[attr-defined]
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Run one load program on one rig and write a record."""
    del seed  # nothing here is random
    if out.suffix.lower() != ".csv":
        raise RigError(f"--out {out}: expected a file name that ends in .csv")
    rig = _rig(preset_name, rig_file, preload)
    program = _program(program_file, amplitude, step, rate, cycles)
    record = ENGINES[engine](rig, program)
    if rig_file is not None:
        record = replace(record, rig={"file": str(rig_file.absolute()), "preload_N": rig.preload_N})
    write_record(record, out)
    _show(first.loop_summary(record), quiet, as_json, [f"record: {out}"])


@app.command()
def validate(
    out: Out,
    preset_name: Annotated[str, typer.Option("--preset", help="Rig to compare the models on.")] = "du2018",
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Compare the analytic model and the multibody model."""
    del seed
    summary = {"schema": 1, "rigs": first.crosschecks(preset(preset_name), progress=not quiet and not as_json)}
    first.write_json(out / "validate.json", summary)
    _show(summary, quiet, as_json, [f"wrote {out / 'validate.json'}"])


@app.command()
def identify(
    records: Annotated[list[Path], typer.Argument(help="The record to fit, a CSV.")],
    out: Out,
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Identify the Bouc-Wen layer on a record, with the error on data that the fit has not seen."""
    if len(records) > 1:
        raise RecordError(f"{records[1]}: identify takes one record, expected a call for each")
    record = read_record(records[0])
    fit = first.identify_record(record, seed=seed, progress=not quiet and not as_json)
    first.write_fit(fit, record, out, "identify")
    _show(fit.to_dict(), quiet, as_json, [f"wrote {out / 'identify.json'}"])


@app.command()
def report(folder: Annotated[Path, typer.Argument(help="A folder written by `notchbend run`.")]) -> None:
    """Write the report again from stored results."""
    typer.echo(f"report: {write_report(folder)}")


@data_app.command("list")
def data_list() -> None:
    """List the measured records that can be fetched, and their sources."""
    table = Table("name", "what", "source")
    for entry in CATALOGUE.values():
        table.add_row(entry.name, entry.title, entry.citation)
    for name, citation in SOURCES_ONLY.items():
        table.add_row(name, "source only", citation)
    Console().print(table)


@data_app.command("fetch")
def data_fetch(
    name: Annotated[str, typer.Argument(help="A name of `notchbend data list`.")],
    out: Out = Path("measured"),
    quiet: Quiet = False,
) -> None:
    """Fetch a measured record from its public repository, checksum verified, and write it as a record."""
    path = fetch_record(name, out)
    if not quiet:
        typer.echo(f"record: {path}\ncite: {CATALOGUE[name].citation}\nlicence: {CATALOGUE[name].licence}")


def _rig(name: str | None, file: Path | None, preload_N: float | None) -> Rig:
    if (name is None) == (file is None):
        raise RigError("expected either --preset or --rig")
    if name is not None:
        return preset(name, preload_N=preload_N)
    assert file is not None
    rig = read_rig(file)
    return rig if preload_N is None else replace(rig, preload_N=preload_N)


def _program(file: Path | None, amplitude: float | None, step: float, rate: float | None, cycles: int) -> LoadProgram:
    if (file is None) == (amplitude is None):
        raise RigError("expected either --amplitude or --program")
    if file is not None:
        return program_of_file(file)
    assert amplitude is not None
    if rate is not None:
        return sine(amplitude, rate, cycles=cycles)
    return triangle(amplitude, step_mm=step, cycles=cycles)


def _show(result: dict[str, Any], quiet: bool, as_json: bool, lines: Sequence[str]) -> None:
    if as_json:
        typer.echo(json.dumps(result, indent=2))
    elif not quiet:
        table = Table(show_header=False)
        for key, value in first.flat(result).items():
            table.add_row(key, f"{value:.6g}" if isinstance(value, float | np.floating) else str(value))
        console = Console()
        console.print(table)
        for line in lines:
            console.print(line, soft_wrap=True, highlight=False)


BAD_INPUT = (RecordError, RigError, SolverError, FetchError, ValueError, OSError)


def call(arguments: Sequence[str]) -> int:
    """Run a command line and return the exit code; bad input and usage errors are one line and 2."""
    try:
        code = app(args=list(arguments), standalone_mode=False, prog_name="notchbend")
    except KeyboardInterrupt:
        return _complain("interrupted", 130)
    except BAD_INPUT as error:
        if isinstance(error, OSError) and error.strerror:
            return _complain(f"{error.filename}: {error.strerror}")
        return _complain(str(error))
    except Exception as error:
        usage = getattr(error, "format_message", None)  # errors of the command line library
        if usage is None:
            raise
        return _complain(_with_value(str(usage()), arguments))
    return code if isinstance(code, int) else 0


def _with_value(message: str, arguments: Sequence[str]) -> str:
    """Add the value that was given, which the library's message leaves out."""
    for option, value in pairwise(arguments):
        if option.startswith("--") and f"'{option}'" in message and value not in message:
            return f"{message.rstrip('.')}: {option} {value}"
    return message


def _complain(message: str, code: int = 2) -> int:
    print("notchbend: " + " ".join(message.split()), file=sys.stderr)  # noqa: T201
    return code


def main() -> None:
    """Entry point."""
    sys.exit(call(sys.argv[1:]))
