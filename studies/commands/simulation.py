"""Commands that need no record: ``run``, ``simulate`` and ``validate``."""
# Imports inside a command are needed by it alone: Exudyn loads the system's libGL, and figures take time to import.

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from fem_models.load import LoadProgram
from fem_models.rig import RigError, preset
from hysteresis.files import write_files
from hysteresis.plain import to_plain
from hysteresis.record_file import check_target, files_of_record, write_record
from studies.commands.options import Common, EnsembleChoice, Out, Overwrite, ProgramChoice, RigChoice
from studies.commands.tables import models_table, values_table
from studies.engines import (
    ENGINES,
    QUASI_STATIC,
    EngineName,
    require_exudyn,
    require_gmsh,
    simulate_by_force,
    simulate_in_time,
)
from studies.ensemble import run_ensemble
from studies.progress import status
from studies.results import write_result
from studies.results.run import loop_summary


def run(*, out: Out = Path("results/first-report"), replacing: Overwrite, common: Common) -> None:
    """Run the main job on the defaults: simulate at 10 and 20 N, cross-check, identify, and write the report."""
    require_exudyn()
    from studies.commands.first_report import files_of_run, first_report
    from studies.report import write_report

    replacing.allow(files_of_run(out))
    summary = first_report(out, seed=common.seed, progress=common.shows_progress)
    report = write_report(out)
    common.show(summary, values_table(summary), f"report: {report}")


def simulate(
    *,
    out: Annotated[Path, typer.Option("--out", help="The record to write, CSV, with a sidecar of the same stem.")],
    rig: RigChoice,
    program: ProgramChoice,
    engine: Annotated[EngineName, typer.Option("--engine", help="Model.")] = "multibody",
    dynamic: Annotated[
        bool, typer.Option("--dynamic", help="Integrate over time, with inertia; multibody model only.")
    ] = False,
    over: EnsembleChoice,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Run one load program on one rig and write a record."""
    check_target(out, [file for file in (rig.rig, program.program) if file is not None])
    bands = out.with_name(f"{out.stem}-ensemble.csv")
    replacing.allow([*files_of_record(out), *([bands] if over.ensemble else [])])
    chosen, force_N, members = rig.read(), program.forces(), over.members(rig)
    if members:
        _require_chain(engine, dynamic, force_N is not None)
    message = f"simulating {chosen.name} with {engine}"
    if force_N is not None:
        _require_by_force(engine, dynamic)
        with status(common.shows_progress, message):
            record, remarks = simulate_by_force(chosen, force_N, engine), list[str]()
    else:
        load = program.read()
        if dynamic:
            _require_dynamic(engine, load)
        with status(common.shows_progress, message):
            record = (simulate_in_time if dynamic else ENGINES[engine])(chosen, load)
        heats = chosen.superelastic is not None and chosen.superelastic.heating_time_s is not None
        by_rate = heats or any(part is not None for part in (chosen.creep, chosen.drag, chosen.stribeck))
        rate_matters = dynamic or engine not in QUASI_STATIC or by_rate
        only_times = load.time_s is not None and not rate_matters
        remarks = ["quasi-static: the rate sets the times only"] if only_times else []
    if rig.rig is not None:
        preload: dict[str, str | float] = {"preload_N": chosen.preload_N} if chosen.preload_N > 0 else {}
        record = replace(record, rig={"file": str(rig.rig.absolute()), **preload})
    write_record(record, out)
    summary = to_plain(loop_summary(record), finite=False)
    if members:
        with status(common.shows_progress, f"simulating {len(members)} members of the ensemble"):
            ranges = run_ensemble(members, load)
        write_files({bands: ranges.csv()})
        summary |= {"ensemble": to_plain(ranges.summary, finite=False)}
        remarks = [*remarks, f"ranges along the drive: {bands}"]
    common.show(summary, values_table(summary), f"record: {out}", *remarks)


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


def validate(
    *,
    out: Out,
    preset_name: Annotated[str, typer.Option("--preset", help="Rig to compare the models on.")] = "du2018",
    replacing: Overwrite,
    common: Common,
) -> None:
    """Compare analytic model, solid, reduced bodies, beams, chain and multibody model side by side."""
    rig = preset(preset_name)
    target = out / "validate.json"
    replacing.allow([target])
    require_exudyn()
    require_gmsh()
    from studies.commands.comparison import validate_rig

    result = validate_rig(rig, progress=common.shows_progress)
    write_result(target, result)
    common.show(
        result,
        models_table(result.models),
        values_table({"schema": result.schema, "rigs": result.rigs}),
        f"wrote {target}",
    )
