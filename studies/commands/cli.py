"""The command ``notchbend``. Bad input: one line on standard error and exit 2, nothing half-written."""
# Imports inside a command are of what it alone needs: Exudyn wants the system's libGL, figures take their time.

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fem_models.load.program import LoadProgram, sine, triangle
from fem_models.rig.checks import RigError, SolverError, require
from fem_models.rig.presets import PRESETS, preset
from fem_models.rig.rig import Rig
from fem_models.rig.rig_file import read_rig
from hysteresis.optimizers import METHODS, Method
from hysteresis.record import RecordError
from hysteresis.record_file import check_target, read_record, write_record
from hysteresis.settings import IdentifySettings
from studies.commands.identification import identify_records, write_fit, written
from studies.engines import (
    ENGINES,
    QUASI_STATIC,
    MissingError,
    program_of_file,
    require_exudyn,
    require_gmsh,
    simulate_in_time,
)
from studies.fetch import CATALOGUE, SOURCES_ONLY, FetchError, fetch_record
from studies.progress import status
from studies.results import flat, loop_summary, require_unchanged, write_json
from studies.sweep.cases import StudyError
from studies.sweep.study_file import read_study

Engine = StrEnum("Engine", {name: name for name in ENGINES})  # type: ignore[misc]
Mechanics = StrEnum("Mechanics", {"chain": "chain", "multibody": "multibody"})
Search = StrEnum("Search", {name: name for name in METHODS})  # type: ignore[misc]

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
    require_exudyn()
    from studies.commands.first_report import first_report
    from studies.report.page import write_report

    summary = first_report(out, seed=seed, progress=not quiet and not as_json)
    report = write_report(out)
    _show(summary, quiet, as_json, _table(summary), f"report: {report}")


@app.command()
def simulate(
    out: Annotated[Path, typer.Option("--out", help="The record to write, a CSV; its sidecar goes beside it.")],
    preset_name: Annotated[str | None, typer.Option("--preset", help=f"One of {', '.join(PRESETS)}.")] = None,
    rig_file: Annotated[Path | None, typer.Option("--rig", help="A rig file, TOML.")] = None,
    preload: Annotated[float | None, typer.Option("--preload", help="N; the rig's own if not given.")] = None,
    amplitude: Annotated[float | None, typer.Option("--amplitude", help="Of the drive, mm.")] = None,
    cycles: Annotated[int | None, typer.Option("--cycles", help="Closed loops after the way out; else 1.")] = None,
    step: Annotated[float | None, typer.Option("--step", help="Of a point-by-point program, mm; else 0.1.")] = None,
    rate: Annotated[float | None, typer.Option("--rate", help="Hz: a sine in place of point by point.")] = None,
    program_file: Annotated[
        Path | None, typer.Option("--program", help="CSV with drive_mm and, if wanted, time_s.")
    ] = None,
    engine: Annotated[Engine, typer.Option("--engine", help="Model.")] = Engine.multibody,  # type: ignore[attr-defined]
    dynamic: Annotated[bool, typer.Option("--dynamic", help="In time, with inertia; of the multibody model.")] = False,
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Run one load program on one rig and write a record."""
    check_target(out, [file for file in (rig_file, program_file) if file is not None])
    rig = _rig(preset_name, rig_file, preload)
    program = _program(program_file, {"--amplitude": amplitude, "--rate": rate, "--step": step, "--cycles": cycles})
    if dynamic:
        _require_dynamic(engine, program)
    with status(not quiet and not as_json, f"simulating {rig.name} with {engine}"):
        record = (simulate_in_time if dynamic else ENGINES[engine])(rig, program)
    if rig_file is not None:
        record = replace(record, rig={"file": str(rig_file.absolute()), "preload_N": rig.preload_N})
    write_record(record, out)
    summary, lines = loop_summary(record), [f"record: {out}"]
    rate_matters = dynamic or engine not in QUASI_STATIC or rig.creep is not None or rig.drag is not None
    if program.time_s is not None and not rate_matters:
        lines.append("quasi-static: the rate sets the times only")
    _show(summary, quiet, as_json, _table(summary), *lines)


@app.command()
def validate(
    out: Out,
    preset_name: Annotated[str, typer.Option("--preset", help="Rig to compare the models on.")] = "du2018",
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Compare analytic model, solid, reduced bodies, beams, chain and multibody model side by side."""
    rig = preset(preset_name)
    require_exudyn()
    require_gmsh()
    from studies.commands.first_report import crosschecks, model_comparison

    progress = not quiet and not as_json
    models = model_comparison(rig, progress=progress)
    checks = {"schema": 1, "rigs": crosschecks(rig, progress=progress)}
    write_json(out / "validate.json", checks | {"models": models})
    parts = (_models_table(models), _table(checks), f"wrote {out / 'validate.json'}")
    _show(checks | {"models": models}, quiet, as_json, *parts)


@app.command()
def identify(
    records: Annotated[list[Path], typer.Argument(help="The records to fit, CSV; several are fitted jointly.")],
    out: Out,
    method: Annotated[Search, typer.Option("--method", help="Of the global search.")] = Search.genetic,  # type: ignore[attr-defined]
    seeds: Annotated[int, typer.Option("--seeds", min=1, help="Searches, from --seed on.")] = 1,
    elements: Annotated[
        int, typer.Option("--elements", min=0, max=2, help="Of h; 0 chooses 1 or 2 within the training data.")
    ] = 1,
    delay: Annotated[bool, typer.Option("--delay", help="The angle may be behind the drive in time.")] = False,
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Identify the Bouc-Wen layer on records, with the error on data that the fit has not seen."""
    targets = {path.resolve() for path in written(out, "identify", len(records))}
    for path in records:
        if path.resolve() in targets:
            raise RecordError(f"{path}: --out {out} would replace it: expected another folder")
    loaded = [read_record(path) for path in records]
    settings = IdentifySettings(
        method=cast("Method", method.value), seed=seed, seeds=seeds, elements=elements or None, delay=delay
    )
    fit = identify_records(loaded, settings=settings, progress=not quiet and not as_json)
    write_fit(fit, loaded, out, "identify")
    _show(fit.to_dict(), quiet, as_json, str(fit), f"wrote {out / 'identify.json'}")


@app.command()
def separate(
    out: Out,
    records: Annotated[list[Path] | None, typer.Argument(help="Records of a known rig, in place of --preset.")] = None,
    preset_name: Annotated[str | None, typer.Option("--preset", help=f"One of {', '.join(PRESETS)}.")] = None,
    rig_file: Annotated[Path | None, typer.Option("--rig", help="A rig file, TOML.")] = None,
    preload: Annotated[float | None, typer.Option("--preload", help="N; the rig's own if not given.")] = None,
    amplitude: Annotated[float | None, typer.Option("--amplitude", help="Of the drive, mm; else 2.2.")] = None,
    engine: Annotated[Mechanics, typer.Option("--engine", help="Model; records take the chain.")] = Mechanics.chain,
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Divide the loop among friction, elasticity of the tendons and material, by switching them in the mechanics."""
    from studies.commands.separation import separate_records, separate_rig, summary

    given = {"--preset": preset_name, "--rig": rig_file, "--preload": preload, "--amplitude": amplitude}
    target = out / "separate.json"
    with status(not quiet and not as_json, "separating"):
        if records:
            clash = next((f"{name} {value}" for name, value in given.items() if value is not None), None)
            if clash is not None or engine != "chain":
                raise RigError(f"{clash or f'--engine {engine}'}: beside records: expected one of the two")
            result = separate_records([read_record(path) for path in records], seed=seed)
        else:
            size = 2.2 if amplitude is None else amplitude
            require(size > 0, "--amplitude", size, "above 0")
            result = separate_rig(_rig(preset_name, rig_file, preload), size, engine=engine, seed=seed)
    write_json(target, result)
    _show(result, quiet, as_json, _parts_table(result), *summary(result), f"wrote {target}")


@app.command()
def trace(
    records: Annotated[list[Path], typer.Argument(help="Records of one rig, CSV; they share its constants.")],
    out: Out,
    threads: Annotated[int, typer.Option("--threads", min=1, help="Of the derivatives.")] = 2,
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Trace what the model leaves of records to the effect that it lacks, with the error before and after."""
    from studies.commands.tracing import require_kept, summary, trace_files, write_trace

    require_kept(out, records)
    found = trace_files(records, seed=seed, threads=threads, progress=not quiet and not as_json)
    write_trace(found, out)
    _show(found.report.to_dict(), quiet, as_json, *summary(found.report), f"report: {out / 'report.html'}")


@app.command()
def effects(seed: Seed = 0, quiet: Quiet = False, as_json: AsJson = False) -> None:
    """List the effects that `trace` knows: what they are, and what tells them apart; with --quiet the names alone."""
    from validation.tracing.effect import catalogue

    if quiet and not as_json:
        typer.echo("\n".join(effect.name for effect in catalogue()))
        return
    table = Table("effect", "physics", "told apart by", show_lines=True)
    for effect in catalogue():
        table.add_row(effect.name, escape(effect.physics), escape(effect.distinguished_by))
    rows = [{"name": e.name, "physics": e.physics, "tell_apart": e.distinguished_by} for e in catalogue()]
    _show({"schema": 1, "effects": rows}, quiet, as_json, table)


@app.command()
def compensate(
    record: Annotated[Path, typer.Argument(help="The record to identify, CSV, or an identify.json.")],
    reference: Annotated[Path, typer.Option("--reference", help="CSV with angle_deg and, if wanted, time_s.")],
    out: Annotated[Path, typer.Option("--out", help="The drive to write, CSV.")],
    elements: Annotated[
        int, typer.Option("--elements", min=0, max=2, help="Of h; 0 chooses 1 or 2 within the training data.")
    ] = 0,
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Find the drive that makes the angle follow a reference, from the record of a rig or its identify.json."""
    from studies.commands.compensation import compensated, known_layer, read_reference, write_columns

    check_target(out, [record, reference])
    wanted = read_reference(reference)
    layer = known_layer(record, elements=elements or None, seed=seed, progress=not quiet and not as_json)
    columns, facts = compensated(layer, wanted, str(reference))
    write_columns(columns, out)
    _show(facts, quiet, as_json, _table(facts), f"drive: {out}")


@app.command()
def study(
    file: Annotated[Path, typer.Argument(help="A study file, TOML, or the name of a ready study.")],
    out: Out,
    workers: Annotated[
        int | None, typer.Option("--workers", help="Processes of this machine; else one a core.")
    ] = None,
    scheduler: Annotated[str | None, typer.Option("--scheduler", help="Of a Dask cluster, tcp://...")] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Run cases again that failed.")] = False,
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="In place of the seeds of the file.")] = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Run a parametric study; one that was stopped goes on where it was, a widened one runs what is new."""
    asked = read_study(file, seed=seed)
    from studies.sweep.run import run_study

    progress = not quiet and not as_json
    summary = run_study(asked, out, workers=workers, scheduler=scheduler, retry=retry, progress=progress)
    from studies.report.page import write_report

    page = write_report(out)
    _show(summary, quiet, as_json, _study_table(summary), f"wrote {out / summary['dataset']}", f"report: {page}")


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(help="A folder of results: of run, study, separate or trace.")],
    pdf: Annotated[bool, typer.Option("--pdf", help="On paper, too: by a headless Chromium, else WeasyPrint.")] = False,
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Write the report again from stored results."""
    from studies.report.page import stands_alone, write_report
    from studies.report.pdf import write_pdf

    if not stands_alone(folder):
        require_unchanged(folder)
    written = {"report": write_report(folder)}
    if pdf:
        with status(not quiet and not as_json, "printing"):
            written["pdf"] = write_pdf(written["report"])
    result = {"schema": 1, **{name: str(path) for name, path in written.items()}}
    _show(result, quiet, as_json, *(f"{name}: {path}" for name, path in written.items()))


@app.command("app")
def app_command(
    preset_name: Annotated[str | None, typer.Option("--preset", help="Rig to play with; else du2018.")] = None,
    rig_file: Annotated[Path | None, typer.Option("--rig", help="A rig file, TOML.")] = None,
    preload: Annotated[float | None, typer.Option("--preload", help="N; the rig's own if not given.")] = None,
    amplitude: Annotated[float, typer.Option("--amplitude", help="Of the drive to begin with, mm.")] = 2.2,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="Of 127.0.0.1; 0 is any that is free.")] = 8765,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Open no browser.")] = False,
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Serve a local page with sliders: the loop and the tube follow at once, by the compiled chain. Ctrl-C ends it."""
    from studies.app.page import serve

    require(amplitude > 0, "--amplitude", amplitude, "above 0")
    rig = _rig(preset_name or (None if rig_file else "du2018"), rig_file, preload)

    def ready(address: str) -> None:
        _show({"schema": 1, "address": address}, quiet, as_json, f"{rig.name}: {address}")
        sys.stdout.flush()

    serve(rig, amplitude, port=port, browser=not no_browser, ready=ready)


@data_app.command("list")
def data_list(seed: Seed = 0, quiet: Quiet = False, as_json: AsJson = False) -> None:
    """List the measured records that can be fetched, and their sources; with --quiet the names alone."""
    if quiet and not as_json:
        typer.echo("\n".join(CATALOGUE))
        return
    table = Table("name", "what", "source")
    for entry in CATALOGUE.values():
        table.add_row(entry.name, entry.title, entry.citation)
    for name, citation in SOURCES_ONLY.items():
        table.add_row(name, "source only", citation)
    records = [{"name": e.name, "title": e.title, "source": e.citation} for e in CATALOGUE.values()]
    sources = [{"name": name, "source": citation} for name, citation in SOURCES_ONLY.items()]
    _show({"schema": 1, "records": records, "sources_only": sources}, quiet, as_json, table)


@data_app.command("fetch")
def data_fetch(
    name: Annotated[str, typer.Argument(help="A name of `notchbend data list`.")],
    out: Out = Path("measured"),
    seed: Seed = 0,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Fetch a measured record from its public repository, checksum verified, and write it as a record."""
    with status(not quiet and not as_json, f"fetching {name}"):
        path = fetch_record(name, out)
    entry = CATALOGUE[name]
    result = {"schema": 1, "record": str(path), "cite": entry.citation, "licence": entry.licence}
    _show(result, quiet, as_json, *(f"{key}: {value}" for key, value in result.items() if key != "schema"))


def _rig(name: str | None, file: Path | None, preload_N: float | None) -> Rig:
    if (name is None) == (file is None):
        raise RigError("expected either --preset or --rig")
    if name is not None:
        return preset(name, preload_N=preload_N)
    assert file is not None
    rig = read_rig(file)
    return rig if preload_N is None else replace(rig, preload_N=preload_N)


def _program(file: Path | None, given: Mapping[str, Any]) -> LoadProgram:
    """Read or make the load program; ``given`` are the options that make one, None where absent."""
    amplitude, rate, step = given["--amplitude"], given["--rate"], given["--step"]
    cycles = 1 if given["--cycles"] is None else given["--cycles"]
    if file is not None:
        for name, value in given.items():
            if value is not None:
                raise RigError(f"{name} {value}: --program {file} has the whole program: expected one of the two")
        return program_of_file(file)
    if amplitude is None:
        raise RigError("expected either --amplitude or --program")
    if rate is None:
        return triangle(amplitude, step_mm=0.1 if step is None else step, cycles=cycles)
    if step is not None:
        raise RigError(
            f"--step {step}: of a point-by-point program, --rate {rate} makes a sine: expected one of the two"
        )
    return sine(amplitude, rate, cycles=cycles)


def _require_dynamic(engine: str, program: LoadProgram) -> None:
    if engine != "multibody":
        raise RigError(f"--dynamic with --engine {engine}: expected --engine multibody, the one with inertia")
    if program.time_s is None:
        raise RigError("--dynamic without times: expected --rate, or a --program with time_s")


def _show(result: Mapping[str, Any], quiet: bool, as_json: bool, *parts: str | Table) -> None:
    """Print the result as JSON, or tables and lines for a reader, or nothing."""
    if as_json:
        typer.echo(json.dumps(result, indent=2))
    elif not quiet:
        console = Console()
        for part in parts:
            console.print(part, soft_wrap=isinstance(part, str), highlight=False, markup=False)


def _table(result: Mapping[str, Any]) -> Table:
    table = Table(show_header=False)
    for key, value in flat(result).items():
        table.add_row(key, f"{value:.6g}" if isinstance(value, float | np.floating) else escape(str(value)))
    return table


def _models_table(models: Mapping[str, Any]) -> Table:
    """One row a model, with what it differs by from the judge."""
    judge = next(row for row in models["models"] if row["name"] == models["judge"])
    at = [f"deg at {bent['tendon_N']:.3g} N" for bent in judge["bent"]]
    table = Table("model", "bending, Nmm/rad", "axial, N/mm", "shear, N/mm", *at, "tip at the last, mm", "s")
    for row in models["models"]:
        last = row["bent"][-1]
        table.add_row(
            row["name"],
            _against(row["bending_Nmm_per_rad"], row["bending_percent"]),
            _against(row["axial_N_per_mm"], row["axial_percent"]),
            _against(row["shear_N_per_mm"], row["shear_percent"]),
            *(_against(bent["angle_deg"], bent["angle_percent"]) for bent in row["bent"]),
            f"{last['tip_mm'][0]:.2f}, {last['tip_mm'][1]:.2f}",
            f"{row['seconds']:.2g}",
        )
    return table


def _parts_table(result: Mapping[str, Any]) -> Table:
    """One row a part of the loop; intervals where the rig is calibrated."""
    table = Table("part", "share of energy", "mJ a cycle", "share of width", "deg")
    for name, row in result["contributions"].items():
        table.add_row(
            name,
            _interval(row, "share"),
            f"{row['dissipated_mJ']:.4g}",
            _interval(row, "width_share"),
            f"{row['width_deg']:.4g}",
        )
    return table


def _study_table(summary: Mapping[str, Any]) -> Table:
    """One row a quantity: where it is least and largest."""
    failed, cases = summary["failures"]["count"], summary["cases"]
    title = f"{summary['title']}: {cases} cases, {summary['computed']} computed now, {failed} failed"
    table = Table("quantity", "unit", "least", "at", "largest", "at", title=title)
    for name, row in summary["quantities"].items():
        ends = [(f"{row[end]['value']:.4g}", _place(row[end]["at"])) for end in ("min", "max")]
        table.add_row(name, row["units"], *(cell for pair in ends for cell in pair))
    return table


def _place(point: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in point.items())


def _interval(row: Mapping[str, Any], key: str) -> str:
    if row[key] is None:
        return "-"
    limits = row.get("intervals", {}).get(key)
    return f"{row[key]:.3f}" + (f" ({limits[0]:.3f} to {limits[1]:.3f})" if limits else "")


def _against(value: float | None, percent: float | None) -> str:
    if value is None or percent is None:
        return "-"
    return f"{value:.4g} ({percent:+.1f} %)"


INTERRUPTED = 130  # 128 + SIGINT, as shells have it
BAD_INPUT = (RecordError, StudyError, RigError, SolverError, FetchError, MissingError, OSError)


def call(arguments: Sequence[str]) -> int:
    """Run a command line and return the exit code; bad input and usage errors are one line and 2, Ctrl-C is 130."""
    try:
        code = app(args=list(arguments), standalone_mode=False, prog_name="notchbend")
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except BAD_INPUT as error:
        if isinstance(error, OSError) and error.strerror:
            return _complain(f"{error.filename}: {error.strerror}")
        return _complain(str(error))
    except Exception as error:
        usage = getattr(error, "format_message", None)  # errors of the command line library
        if usage is None:
            raise
        return _complain(_with_value(str(usage()), arguments))
    if code == INTERRUPTED:  # the library turns KeyboardInterrupt into this exit code, without a word
        return _complain("interrupted", INTERRUPTED)
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
