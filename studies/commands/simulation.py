"""Commands that need no record: ``run``, ``simulate`` and ``validate``."""
# Imports inside a command are needed by it alone: Exudyn loads the system's libGL, and figures take time to import.

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from rich.table import Table

from fem_models.joint.contact import require_unfolded
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from hysteresis.arrays import Floats
from hysteresis.files import write_files
from hysteresis.own import MAKER
from hysteresis.plain import to_plain
from hysteresis.records.record import Record
from hysteresis.records.record_file import check_target, files_of_record, write_record
from hysteresis.records.sidecar import toml
from studies.commands.options import Common, EnsembleChoice, Out, Overwrite, ProgramChoice, RigChoice
from studies.commands.tables import (
    bent_table,
    engines_table,
    models_table,
    notches_table,
    values_table,
    verdict_lines,
)
from studies.engines import (
    QUASI_STATIC,
    EngineName,
    require_exudyn,
    require_gmsh,
    simulate_by_force,
    simulate_counted,
    simulate_in_time,
    simulate_wheels,
    solver_of,
)
from studies.own_rig.choice import OwnRigChoice, design_lines
from studies.own_rig.jumps import jump_lines
from studies.own_rig.metal import LawOfMetal, law_of_metal
from studies.own_rig.new_record import without_geometry
from studies.own_rig.strain import Strain, drive_to_angle_mm, strain_lines, strain_of, strain_of_record
from studies.own_rig.usual import unusual
from studies.progress import Count, counted, status
from studies.results import write_result
from studies.results.made import made_now
from studies.results.run import loop_summary, space_summary

if TYPE_CHECKING:
    from studies.report.page import Written

PRESET = "du2018"


def run(
    *,
    records: Annotated[
        list[Path] | None, typer.Argument(help="Records of your rig, CSV; with --rig or --preset, optional.")
    ] = None,
    out: Out = Path("results/first-report"),
    own: OwnRigChoice,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Write the design report of your rig and records; without options the main job on the defaults.

    With --rig or --preset: loops at each --preload, strain and limits, cross-checks, the layer and the trace of the
    records, contributions to the loop, and what to do next. Of a rig in space: the loop of each wheel, tensions, the
    path of the tip, its compliance, and the workspace.
    """
    rig = own.read() if own.is_given(records or []) else None
    from studies.report.page import try_report

    made = made_now(common.command)
    if rig is not None and not rig.is_planar:
        from studies.own_rig.wrist_report import files_of_wrist, wrist_report

        design, _ = own.design(rig, records or [])
        replacing.allow(files_of_wrist(out, design))
        wrist = wrist_report(design, out, made=made, progress=common.shows_progress)
        written = try_report(out)
        notes = [f"note: {words}" for words in wrist.notes]
        common.show_with_page(wrist, written, *_verdicts(written), *notes, *_todo(written))
        return
    require_exudyn()
    if rig is not None:
        from studies.own_rig.design_report import design_report, files_of_design

        design, loaded = own.design(rig, records or [])
        replacing.allow(files_of_design(out, design, loaded))
        for words in () if common.quiet else without_geometry(loaded, beside_rig=True):
            typer.echo(f"notchbend: {words}", err=True)
        summary = design_report(design, loaded, out, made=made, seed=common.seed, progress=common.shows_progress)
        written = try_report(out)
        shown: list[str | Table] = [*design_lines(summary), *_todo(written)]
    else:
        from studies.commands.first_report import files_of_run, first_report

        replacing.allow(files_of_run(out))
        summary = first_report(out, seed=common.seed, progress=common.shows_progress, made=made)
        written = try_report(out)
        shown = [*_verdicts(written)]
    common.show_with_page(summary, written, *shown)


def _verdicts(written: Written) -> list[str]:
    return verdict_lines(written.page.verdicts if written.page else ())


def _todo(written: Written) -> list[str]:
    """Give what the page says to do next."""
    if written.page is None:
        return []
    return ["What to do next:", *(f"{i}. {words}" for i, words in enumerate(written.page.advice, start=1))]


RecordOut = Annotated[Path, typer.Option("--out", help="The record to write, CSV, with a sidecar of the same stem.")]

EngineChoice = Annotated[
    EngineName | None,
    typer.Option(
        "--engine",
        help="Model: multibody, the most complete; chain, the fastest. By default multibody, in space chain.",
    ),
]
InTime = Annotated[bool, typer.Option("--dynamic", help="Integrate over time, with inertia; multibody model only.")]


def simulate(
    *,
    out: RecordOut = Path("results/simulated.csv"),
    rig: RigChoice,
    program: ProgramChoice,
    engine: EngineChoice = None,
    dynamic: InTime = False,
    over: EnsembleChoice,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Run one load program on one rig and write a record."""
    check_target(out, [file for file in (rig.rig, program.program) if file is not None])
    bands = out.with_name(f"{out.stem}-ensemble.csv")
    replacing.allow([*files_of_record(out), *([bands] if over.ensemble else [])])
    chosen = rig.read_any()
    if not chosen.is_planar:
        _simulate_in_space(chosen, rig, program, engine, over, dynamic=dynamic, out=out, common=common)
        return
    engine = engine or "multibody"
    force_N, members = program.forces(), over.members(rig)
    if members:
        _require_chain(engine, dynamic, force_N is not None)
    message = f"simulating {chosen.name} with {engine}"
    if force_N is not None:
        _require_by_force(engine, dynamic)
        with status(common.shows_progress, message):
            record, strain = _simulate_by_force(chosen, force_N, engine)
        metal, remarks = LawOfMetal(chosen), list[str]()
    else:
        load = program.read()
        if dynamic:
            _require_dynamic(engine, load)
        metal = _law_of_metal(chosen, load, engine, rig)
        with counted(common.shows_progress, message) as count:
            record, strain = _simulate(metal.rig, load, engine, dynamic, count)
        remarks = [*_only_times(metal.rig, load, engine, dynamic), *metal.notes]
    _write(record, metal, rig, out)
    remarks = [*jump_lines(record), *remarks]
    summary = to_plain(loop_summary(record), finite=False)
    shown = values_table(summary)
    if strain is None:
        remarks = [*remarks, "strain: not known of measured joints, nor of a superelastic rig by this engine"]
    else:
        summary |= to_plain(strain)
        remarks = [*strain_lines(strain, record.drive_unit), *remarks]
    remarks += [f"note: {words}" for words in unusual(chosen)]
    if members:
        from studies.ensemble import run_ensemble

        with status(common.shows_progress, f"simulating {len(members)} members of the ensemble"):
            ranges = run_ensemble(members, load)
        write_files({bands: ranges.csv()})
        over_members = {"ensemble": to_plain(ranges.summary, finite=False)}
        summary, shown = (
            summary | over_members,
            values_table(to_plain(loop_summary(record), finite=False) | over_members),
        )
        remarks = [*remarks, f"ranges along the drive: {bands}"]
    common.show(summary, shown, *remarks, f"record: {out}")


def _law_of_metal(chosen: Rig, load: LoadProgram, engine: EngineName, rig: RigChoice) -> LawOfMetal:
    """Choose the law of the metal of a rig file: a preset states its own, and the analytic model is linear."""
    if rig.rig is None or engine == "analytic":
        return LawOfMetal(chosen)
    return law_of_metal(chosen, float(load.drive_mm.min()), float(load.drive_mm.max()), rig.rig)


def _only_times(rig: Rig, load: LoadProgram, engine: EngineName, dynamic: bool) -> list[str]:
    only = load.time_s is not None and not _rate_matters(rig, engine, dynamic)
    return ["quasi-static: the rate sets the times only"] if only else []


def _write(record: Record, metal: LawOfMetal, rig: RigChoice, out: Path) -> None:
    """Write a record, unless the tube folds over.

    Beside a record with a law that the rig file does not state is the rig with that law, which the record names.
    """
    if record.notches_deg is not None:
        require_unfolded(metal.rig, np.radians(record.notches_deg))
    file = rig.rig
    if metal.by_default:
        file = out.with_suffix(".rig.toml")
        write_files({file: f"# made by {MAKER}\n{toml(metal.rig.to_dict())}"})
    write_record(_of_file(record, replace(rig, rig=file), metal.rig.preload_N), out)


def _of_file(record: Record, rig: RigChoice, preload_N: float) -> Record:
    """Name the rig's file in a record."""
    if rig.rig is None:
        return record
    preload: dict[str, str | float] = {"preload_N": preload_N} if preload_N > 0 else {}
    return replace(record, rig={"file": str(rig.rig.absolute()), **preload})


def _simulate_in_space(
    chosen: Rig,
    rig: RigChoice,
    program: ProgramChoice,
    engine: EngineName | None,
    over: EnsembleChoice,
    *,
    dynamic: bool,
    out: Path,
    common: Common,
) -> None:
    over.require_off(f"rig {chosen.name}, which bends in space")
    load = program.in_space(chosen)
    with status(common.shows_progress, f"simulating {chosen.name} in space"):
        record = simulate_wheels(chosen, load, engine, dynamic=dynamic)
    write_record(_of_file(record, rig, chosen.preload_N), out)
    summary = to_plain(space_summary(record), finite=False)
    remarks = jump_lines(record)
    if load.time_s is not None:
        remarks.append("quasi-static: the rate sets the times only")
    common.show(summary, values_table(summary), *remarks, f"record: {out}")


def _rate_matters(rig: Rig, engine: EngineName, dynamic: bool) -> bool:
    return dynamic or engine not in QUASI_STATIC or rig.depends_on_rate


def _simulate(
    rig: Rig, load: LoadProgram, engine: EngineName, dynamic: bool, count: Count
) -> tuple[Record, Strain | None]:
    """Run a program; the strain comes from the engine where the angles of the notches do not give it."""
    if dynamic:
        record = simulate_in_time(rig, load)
    elif rig.superelastic is not None and engine != "analytic":
        solution = solver_of(engine)(rig, load)
        return solution.record, _known(strain_of(rig, solution.record.drive, solution.peak_strain))
    else:
        record = simulate_counted(rig, load, engine, count)
    return record, strain_of_record(rig, record)


def _simulate_by_force(rig: Rig, force_N: Floats, engine: str) -> tuple[Record, Strain | None]:
    run = simulate_by_force(rig, force_N, engine)
    return run.record, _known(strain_of(rig, run.record.drive, run.peak_strain))


def _known(strain: Strain) -> Strain | None:
    """Give None for the strain of measured joints, which is not a number."""
    return strain if strain.strain_limits else None


def _require_chain(engine: str, dynamic: bool, by_force: bool) -> None:
    if engine != "chain" or dynamic or by_force:
        found = "--dynamic" if dynamic else "tendon_force_N" if by_force else f"--engine {engine}"
        raise RigError(f"--ensemble with {found}: expected --engine chain and a program of drive_mm")


def _require_by_force(engine: str, dynamic: bool) -> None:
    if engine == "analytic":
        raise RigError("--engine analytic with tendon_force_N: expected chain or multibody")
    if dynamic:
        raise RigError("--dynamic with tendon_force_N: expected a program of drive_mm and time_s")


def _require_dynamic(engine: str, program: LoadProgram) -> None:
    if engine != "multibody":
        raise RigError(f"--dynamic with --engine {engine}: expected --engine multibody, the one with inertia")
    if program.time_s is None:
        raise RigError("--dynamic without times: expected --rate, or a --program with time_s")


@dataclass(frozen=True)
class ComparedRig(RigChoice):
    """A rig to compare the models on, by default the preset of the paper."""

    preset: Annotated[
        str | None, typer.Option("--preset", help=f"Rig to compare the models on; by default {PRESET}.")
    ] = None
    preload: Annotated[
        float | None,
        typer.Option("--preload", help="Preload, N; by default that of a rig file, and 10 and 20 N of a preset."),
    ] = None


def validate(
    *,
    out: Out,
    rig: ComparedRig,
    amplitude: Annotated[
        float | None,
        typer.Option("--amplitude", help="Amplitude, mm; by default 2.2, to 45 deg of a rig file, in space to 20 deg."),
    ] = None,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Compare analytic model, solid, reduced bodies, beams, chain and multibody model side by side.

    Of a rig in space: the six stiffnesses of every notch from section and solid, and the wrist bent with either.
    """
    chosen = RigChoice(rig.preset or (None if rig.rig else PRESET), rig.rig, rig.preload).read_any()
    if not chosen.is_planar:
        require_exudyn()
        require_gmsh()
        from studies.commands.wrist_comparison import validate_in_space

        validate_in_space(chosen, amplitude, out, replacing, common)
        return
    target = out / "validate.json"
    replacing.allow([target])
    require_exudyn()
    require_gmsh()
    from studies.commands.comparison import PRELOADS_N, validate_rig

    made = made_now(common.command)
    preloads = PRELOADS_N if rig.rig is None and rig.preload is None else (chosen.preload_N,)
    if amplitude is None and rig.rig is not None:
        amplitude = drive_to_angle_mm(chosen)
    result = validate_rig(chosen, preloads_N=preloads, amplitude_mm=amplitude, progress=common.shows_progress)
    given = {"preset": rig.preset, "rig": rig.rig, "preload": rig.preload, "amplitude": amplitude}
    options = " ".join(f"--{name} {shlex.quote(str(value))}" for name, value in given.items() if value is not None)
    result = replace(result, options=options or f"--preset {PRESET}", made=made)
    write_result(target, result)
    notches = notches_table(result.models)
    common.show(
        result,
        models_table(result.models),
        bent_table(result.models),
        *([notches] if notches is not None else []),
        *([engines_table(result.rigs, of_the_paper=chosen.name == PRESET and rig.rig is None)] if result.rigs else []),
        f"wrote {target}; the page of it: notchbend report {shlex.quote(str(out))}",
    )
