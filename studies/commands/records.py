"""Commands on records: ``identify``, ``separate``, ``trace``, ``effects`` and ``compensate``."""
# Imports inside a command are needed by it alone.

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.markup import escape

from fem_models.rig import RigError
from fem_models.rig.checks import require
from hysteresis import Fit
from hysteresis.attempts import attempt
from hysteresis.files import require_kept, write_files
from hysteresis.fitting.optimizers import Method
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.laws.elements import LawName
from hysteresis.own import marked_png
from hysteresis.plain import to_plain
from hysteresis.records.planes import Coupling, coupling, not_used
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import check_target, files_of_record, read_records
from hysteresis.records.thinning import thinned
from studies.commands.identification import files_of_fit, identify_records, write_fit
from studies.commands.options import Common, EnsembleChoice, Out, Overwrite, RigChoice
from studies.commands.tables import contributions_table, spaced_table, values_table
from studies.own_rig.new_record import unlike_loops, without_geometry
from studies.progress import steps
from studies.results import write_result
from studies.results.compensation import ENDING
from studies.results.made import Made, made_entry, made_now

LAW = "Law of the hysteresis; auto chooses by folds within the training data."
ELEMENTS = "Number of Bouc-Wen elements, 1 or 2; 0 chooses by validation within the training data."
SEPARATION_MM = 2.2
"""Amplitude of a separation, if none is given."""

Elements = Annotated[int, typer.Option("--elements", min=0, max=2, help=ELEMENTS)]

LawChosen = Annotated[Literal["auto", LawName], typer.Option("--law", help=LAW)]


@dataclass(frozen=True)
class EachChoice:
    """Many devices, each by itself."""

    each: Annotated[
        Path | None, typer.Option("--each", help="Folder of records, CSV: each is fitted by itself; by default none.")
    ] = None
    table: Annotated[Literal["csv", "parquet"], typer.Option("--table", help="Form of the table of --each.")] = "csv"
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Processes of --each; by default one a core.")
    ] = None


Delay = Annotated[bool, typer.Option("--delay", help="Let the angle lag the drive by a time delay.")]


@dataclass(frozen=True)
class SearchChoice:
    """How the parameters of the hysteresis model are searched for, and what the model contains."""

    method: Annotated[
        Method | None,
        typer.Option("--method", help="Method of the global search; by default genetic, with --each least-squares."),
    ] = None
    seeds: Annotated[int, typer.Option("--seeds", min=1, help="Number of searches, with seeds from --seed on.")] = 1
    elements: Elements = 1
    law: Annotated[
        Literal["auto", LawName] | None,
        typer.Option("--law", help=f"{LAW[:-1]}; by default auto, with --each bouc-wen."),
    ] = None
    delay: Delay = False

    def of_one(self, seed: int) -> IdentifySettings:
        """Give the settings for records that are fitted jointly."""
        return self._with(seed, self.law or "auto", self.method or "genetic")

    def of_each(self, seed: int) -> IdentifySettings:
        """Give the settings for records that are fitted each by itself."""
        method = self.method or "least-squares"
        return self._with(seed, self.law or "bouc-wen", method, forward=method == "least-squares")

    def _with(
        self, seed: int, law: Literal["auto", LawName], method: Method, *, forward: bool = False
    ) -> IdentifySettings:
        more = {"seed": seed, "seeds": self.seeds, "delay": self.delay, "forward": forward}
        return _settings(self.elements, law, method=method, **more)


def identify(
    *,
    records: Annotated[
        list[Path] | None, typer.Argument(help="The records to fit, CSV; several are fitted jointly. Or --each.")
    ] = None,
    out: Out,
    many: EachChoice,
    search: SearchChoice,
    plane: Annotated[
        int, typer.Option("--plane", min=1, max=2, help="Bending plane; 2 is the second wheel and the second angle.")
    ] = 1,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Identify the Bouc-Wen model, and the law that predicts best, on records, with the error on held-out data.

    With --each: of every record of a folder by itself, one device each, in one table with intervals.
    """
    if many.each is not None:
        from studies.each.command import identify_folder

        identify_folder(many, records or [], out, search.of_each(common.seed), plane, (replacing, common))
        return
    if not records:
        raise RecordError("no record: expected one or more, or --each FOLDER")
    figure = out / "identify.png"
    files = [*files_of_fit(out, "identify", len(records)), figure]
    require_kept(out, files, records)
    replacing.allow(files)
    loaded = [thinned(one) for one in read_records(records, plane)]
    made, settings = made_now(common.command), search.of_one(common.seed)
    fit = identify_records(loaded, settings=settings, progress=common.shows_progress)
    fit = _write_identified(fit, loaded, out, figure, made)
    _warn_of_geometry(loaded, common)
    coupled = [one for one in map(coupling, loaded) if one is not None]
    beside = {"coupling": [to_plain(one) for one in coupled]} if coupled else {}
    words = [_coupling_line(one) for one in coupled]
    drawn = figure.exists()
    wrote = f"wrote {out / 'identify.json'}" + (f" and {figure}" if drawn else f"; {fit.notes[-1]}")
    common.show(fit.to_dict() | beside | made_entry(made), str(fit), *words, wrote, _page_of(out))


def _write_identified(fit: Fit, records: Sequence[Record], out: Path, figure: Path, made: Made | None) -> Fit:
    """Write the files of a fit, then its figure; a figure that cannot be drawn is a note of the fit."""
    write_fit(fit, records, out, "identify", made=made)
    figure.unlink(missing_ok=True)  # of an earlier fit
    failed = list[str]()

    def drawn() -> bytes:
        from studies.report.parts.fits import figure_of_fit  # Matplotlib

        return marked_png(figure_of_fit(fit))

    png = attempt(f"no {figure.name}", drawn, None, failed)
    if png is not None:
        write_files({figure: png})
        return fit
    noted = replace(fit, notes=(*fit.notes, *failed))
    write_fit(noted, records, out, "identify", made=made)
    return noted


def _coupling_line(one: Coupling) -> str:
    moves = f"the other plane moves with {100 * one.share:.2g} % of this one"
    return f"{one.record}: {moves}, at most {one.largest_deg:.2g} deg"


def _warn_of_geometry(records: Sequence[Record], common: Common) -> None:
    """Say on standard error whose geometry is unknown, what is no loop or in another unit, and what is not used."""
    if not common.quiet:
        for words in [*without_geometry(records), *unlike_loops(records), *filter(None, map(not_used, records))]:
            typer.echo(f"notchbend: {words}", err=True)


def _page_of(out: Path) -> str:
    return f"the page of it: notchbend report {shlex.quote(str(out))}"


def _settings(elements: int, law: Literal["auto", LawName], **more: Any) -> IdentifySettings:
    if law not in ("auto", "bouc-wen") and elements != 1:
        raise RecordError(f"--elements {elements}: with --law {law}: expected 1")
    return IdentifySettings(elements=elements or None, law=law, **more)


def separate(
    *,
    out: Out,
    records: Annotated[list[Path] | None, typer.Argument(help="Records of a known rig, in place of --preset.")] = None,
    rig: RigChoice,
    amplitude: Annotated[
        float | None, typer.Option("--amplitude", help=f"Amplitude of the drive, mm; by default {SEPARATION_MM:g}.")
    ] = None,
    engine: Annotated[
        Literal["chain", "multibody"],
        typer.Option("--engine", help="Model that divides the loop; of records always the chain."),
    ] = "chain",
    over: EnsembleChoice,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Divide the loop into friction, tendon elasticity and material, by switching each of them in the model."""
    from studies.commands.separation import STEPS_OF_RECORDS, STEPS_OF_RIG, separate_records, separate_rig, summary
    from studies.own_rig.metal import LawOfMetal, law_of_metal

    target = out / "separate.json"
    replacing.allow([target])
    made = made_now(common.command)
    with steps(common.shows_progress, STEPS_OF_RECORDS if records else STEPS_OF_RIG) as step:
        if records:
            _require_records_alone(rig, amplitude, engine)
            over.require_off("records")
            result = separate_records(read_records(records), seed=common.seed, report=step)
        else:
            size = SEPARATION_MM if amplitude is None else amplitude
            require(size > 0, "--amplitude", size, "above 0")
            members = over.members(rig)
            chosen = rig.read()
            low_mm = 0.0 if chosen.tendon_b is None else -size
            metal = LawOfMetal(chosen) if rig.rig is None else law_of_metal(chosen, low_mm, size, rig.rig)
            result = separate_rig(metal.rig, size, engine=engine, seed=common.seed, members=members, report=step)
            result = replace(result, warnings=(*result.warnings, *filter(None, [metal.words])))
    result = replace(result, made=made)
    write_result(target, result)
    common.show(result, contributions_table(result), *summary(result), f"wrote {target}", _page_of(out))


def _require_records_alone(rig: RigChoice, amplitude: float | None, engine: str) -> None:
    """Refuse options that the records decide: the rig, the amplitude and the engine."""
    given = {"--preset": rig.preset, "--rig": rig.rig, "--preload": rig.preload, "--amplitude": amplitude}
    clash = next((f"{name} {value}" for name, value in given.items() if value is not None), None)
    if clash is not None or engine != "chain":
        raise RigError(f"{clash or f'--engine {engine}'}: with records: expected one of the two")


def trace(
    *,
    records: Annotated[list[Path], typer.Argument(help="Records of one rig, CSV; they share its parameters.")],
    out: Out,
    reference: Annotated[
        list[Path] | None,
        typer.Option("--reference", help="Records before a change, CSV: traces what changed since; by default all."),
    ] = None,
    threads: Annotated[int, typer.Option("--threads", min=1, help="Threads for runs and derivatives.")] = 2,
    alpha: Annotated[
        float | None,
        typer.Option(
            "--alpha",
            min=0.001,
            max=0.5,
            help="Let the test decide; how often it may claim an effect that is not there. By default rules decide.",
        ),
    ] = None,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Trace the residual of records to the effect that the model lacks, with the error before and after.

    With --reference: what changed between the reference and the records.
    """
    from studies.commands.tracing import FILES, read_for_trace, summary, trace_files, write_trace

    old = reference or []
    require_kept(out, [out / name for name in FILES], [*records, *old])
    replacing.allow(out / name for name in FILES)
    made, loaded = made_now(common.command), read_for_trace(records)
    found = trace_files(
        records, reference=old, seed=common.seed, threads=threads, alpha=alpha, progress=common.shows_progress
    )
    report = write_trace(found, out, made=made)
    if not found.in_space:
        _warn_of_geometry(loaded, common)
    page = out / "report.html"
    shown = f"report: {page}" if page.exists() else f"the page of it could not be drawn: {out / 'trace.json'}"
    common.show(report.to_dict() | made_entry(made), *summary(report), shown)


def effects(*, common: Common) -> None:
    """List the effects that `trace` knows, and what distinguishes them; with --quiet the names alone."""
    from validation.tracing import catalogue

    if common.quiet and not common.json:
        typer.echo("\n".join(effect.name for effect in catalogue()))
        return
    table = spaced_table("effect", "physics", "distinguished by")
    for effect in catalogue():
        table.add_row(effect.name, escape(effect.physics), escape(effect.distinguished_by), end_section=True)
    rows = [
        {"name": e.name, "seen": e.seen, "physics": e.physics, "tell_apart": e.distinguished_by} for e in catalogue()
    ]
    common.show({"schema": 1, "effects": rows}, table)


def compensate(
    *,
    record: Annotated[
        Path,
        typer.Argument(help="The record to identify, CSV, or an identify.json; or the file of a rig in space, TOML."),
    ],
    reference: Annotated[
        Path,
        typer.Option(
            "--reference", help="Angles to follow, CSV: angle_deg, of a rig in space angle_2_deg, and, if any, time_s."
        ),
    ],
    out: Annotated[Path, typer.Option("--out", help="The drive to write, CSV.")],
    elements: Elements = 0,
    law: LawChosen = "bouc-wen",
    delay: Delay = False,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Find the drive that makes the angle follow a reference, from a record of the rig or its identify.json.

    Of a rig in space, from its file: the motion of both wheels, with the chain in space as the model.
    """
    if record.suffix.lower() == ".toml":
        from studies.commands.wrist_compensation import compensate_rig

        compensate_rig(record, reference, out, replacing, common)
        return
    from studies.commands.compensation import compensated, known_layer, read_reference, write_columns

    check_target(out, [record, reference])
    target = out.with_name(out.stem + ENDING)
    replacing.allow([*files_of_record(out), target])
    wanted, made = read_reference(reference), made_now(common.command)
    of_law = elements if law in ("auto", "bouc-wen") else elements or 1
    settings = _settings(of_law, law, seed=common.seed, delay=delay)
    layer = known_layer(record, settings=settings, progress=common.shows_progress)
    columns, found = compensated(layer, wanted, str(reference))
    write_columns(columns, out)
    summary = replace(found, record=str(record), reference=str(reference), drive=out.name, made=made)
    write_result(target, summary)
    common.show(summary, values_table(summary), f"drive: {out}")
