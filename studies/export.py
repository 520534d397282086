"""Command ``export``: a rig or the joint of a log for other simulators, a fit for firmware."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, get_args

import typer

from fem_models.export import guide_table, mujoco_model
from fem_models.export.loop import guide_loop
from fem_models.rig import Rig, RigError
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.of_record import bends_in_space, declared_rig_of
from hysteresis import Fit
from hysteresis.files import RecordError, require_kept, write_files
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.messages import quoted
from hysteresis.own import marked_values
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record
from studies.commands.options import Common, Overwrite, RigChoice
from studies.drawings import DrawingChoice, drawing_files
from studies.drawings.written import Drawing, require_ending
from studies.progress import status
from studies.results.fit import WHAT
from studies.results.made import made_now

Simulator = Literal["mujoco"]
Target = Literal["mujoco", "c", "fmu", "table"]
TARGETS: tuple[Target, ...] = get_args(Target)
AMPLITUDE_MM = 2.2
NAME = "compensator"


@dataclass(frozen=True)
class ModelChoice:
    """What the model of a rig or of a record takes beside it."""

    amplitude: Annotated[
        float | None,
        typer.Option("--amplitude", help=f"Largest drive that the model is meant for, mm; by default {AMPLITUDE_MM}."),
    ] = None
    moment_arm: Annotated[
        float | None,
        typer.Option(
            "--moment-arm", help="Moment arm of the tendon at the axis of a record, mm; by default that of its rig."
        ),
    ] = None
    kerf: Annotated[
        float | None, typer.Option("--kerf", help="Width of the cutting beam of a dxf, mm; by default 0.")
    ] = None
    beam: Annotated[
        str | None,
        typer.Option("--beam", help="Cut of a dxf: plane, or radial for a beam towards the axis; by default plane."),
    ] = None
    seam: Annotated[
        float | None,
        typer.Option("--seam", help="Angle at which a dxf opens the tube, deg; by default where it cuts least."),
    ] = None

    @property
    def of_pattern(self) -> Mapping[str, object]:
        """Options of a flat pattern alone, by their names."""
        return {"--kerf": self.kerf, "--beam": self.beam, "--seam": self.seam}


def export_rig(
    *,
    fit: Annotated[
        Path | None,
        typer.Argument(
            metavar="[FIT|RECORD]",
            help="For c, fmu and table: an identify.json of notchbend or its folder, or a record, CSV, which is "
            "identified first. For mujoco: a record, CSV.",
        ),
    ] = None,
    to: Annotated[
        Literal["mujoco", "c", "fmu", "table", "dxf", "step", "stl", "svg", "pdf"],
        typer.Option(
            "--to",
            help="mujoco: a rig as a model; c, fmu, table: a fit as a compensator; dxf: the flat pattern of a rig's "
            "tube; step, stl: its solid; svg, pdf: its drawing.",
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("--out", help="The model file, .xml, with the table of tensions beside it; for a fit a folder."),
    ],
    rig: RigChoice,
    model: ModelChoice,
    name: Annotated[
        str | None, typer.Option("--name", help=f"Name of the files and functions of a fit; by default {NAME}.")
    ] = None,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Write a rig or the joint of a record for another simulator, or a fit as a compensator in C or as tables."""
    of_rig = {"--amplitude": model.amplitude, "--preset": rig.preset, "--rig": rig.rig, "--preload": rig.preload}
    if to == "dxf" or to == "step" or to == "stl" or to == "svg" or to == "pdf":
        words = f"--to {to}: of a record, a fit or a simulator: expected --rig or --preset alone"
        others = {"FIT": fit, "--name": name, "--amplitude": model.amplitude, "--moment-arm": model.moment_arm}
        _refuse(others, words)
        _export_drawing(rig, out, to, model, replacing, common)
        return
    _refuse(model.of_pattern, f"--to {to}: of a flat pattern: expected --to dxf")
    if to != "mujoco":
        _refuse(of_rig, f"--to {to}: of a rig: expected a fit alone, {WHAT}")
        _refuse({"--moment-arm": model.moment_arm}, f"--to {to}: of a record: expected a fit alone, {WHAT}")
        if fit is None:
            raise RecordError(f"--to {to}: fit missing: expected {WHAT}, or its folder")
        _export_fit(fit, out, to, NAME if name is None else name, replacing, common)
        return
    _refuse({"--name": name}, "--to mujoco: of a fit: expected a record, --rig or --preset alone")
    if fit is not None:
        _refuse(of_rig, f"the record {fit}: of a rig: expected one of the two")
        _export_record(fit, out, model.moment_arm, replacing, common)
        return
    _refuse({"--moment-arm": model.moment_arm}, "a rig, which has its own: expected it with a record alone")
    chosen = rig.read()
    replacing.allow([out, out.with_name(f"{out.stem}-guides.csv")])
    with status(common.shows_progress, f"exporting {chosen.name}"):
        largest = AMPLITUDE_MM if model.amplitude is None else model.amplitude
        written, table = write_model(chosen, out, to=to, amplitude_mm=largest)
    common.show({"model": str(written), "table": str(table)}, f"model: {written}", f"tension at every guide: {table}")


def _export_drawing(
    rig: RigChoice, out: Path, to: Drawing, model: ModelChoice, replacing: Overwrite, common: Common
) -> None:
    """Write a drawing of a rig, of one plane or in space."""
    if to != "dxf":
        _refuse(model.of_pattern, f"--to {to}: of a flat pattern: expected --to dxf")
    require_ending(out, to)
    chosen = rig.read_any()
    replacing.allow([out])
    with status(common.shows_progress, f"drawing {chosen.name}"):
        choice = DrawingChoice(model.kerf, model.beam, model.seam)
        write_files(drawing_files(chosen, out, to, choice))
    common.show({"drawing": str(out)}, f"drawing: {out}")


def _refuse(given: Mapping[str, object], expected: str) -> None:
    """Refuse options that belong to what is not exported.

    Raises
    ------
    RecordError
        One of them was given.
    """
    for option, value in given.items():
        if value is not None:
            raise RecordError(f"{option} {value}: with {expected}")


def _export_fit(
    fit: Path, out: Path, to: Literal["c", "fmu", "table"], name: str, replacing: Overwrite, common: Common
) -> None:
    if out.exists() and not out.is_dir():
        raise RecordError(f"{out}: is a file: expected a folder")
    if fit.suffix.lower() == ".csv":
        fit = _identified(fit, out, replacing, common)
    with status(common.shows_progress, f"exporting {fit}"):
        made = files_of_compensator(fit, out, to=to, name=name, seed=common.seed)
    replacing.allow(made)
    write_files(made)
    if (words := lacking_compiler(to)) is not None:
        typer.echo(f"notchbend: {words}", err=True)
    common.show({"files": [str(path) for path in made]}, *(f"{path.suffix[1:]}: {path}" for path in made))


def files_of_compensator(
    fit: Path, out: Path, *, to: Literal["c", "fmu", "table"], name: str = NAME, seed: int = 0
) -> dict[Path, str | bytes]:
    """Make the files of a compensator, by their paths in a folder, from an identify.json or its folder.

    Raises
    ------
    RecordError
        A name of another form, a file that is none of a fit, or a fit that has no compensator; one line.
    """
    from studies.firmware import compensator_files, read_compensator, table_files, unit_files

    compensator = read_compensator(fit, name)
    made: dict[Path, str | bytes] = {}
    match to:
        case "c":
            made |= compensator_files(compensator, out, seed=seed)
        case "fmu":
            made |= unit_files(compensator, out, seed=seed)
        case "table":
            made |= table_files(compensator, out)
    return made


def write_compensator(
    fit: Fit, out: Path, *, to: Literal["c", "fmu", "table"], name: str, seed: int
) -> tuple[Path, ...]:
    """Write the compensator of a fit into a folder, and its identify.json with the tables of its records."""
    from studies.commands.identification import files_of_fit, write_fit

    write_fit(fit, fit.observed, out, "identify")
    made = files_of_compensator(out / "identify.json", out, to=to, name=name, seed=seed)
    write_files(made)
    return (*made, *files_of_fit(out, "identify", len(fit.observed)))


def lacking_compiler(to: str) -> str | None:
    """Say that a unit of co-simulation has no binary, for want of a compiler; None where there is one, or no unit."""
    from studies.firmware.unit import COMPILERS, compiler_here

    if to != "fmu" or compiler_here() is not None:
        return None
    return f"no C compiler found ({', '.join(COMPILERS)}): the units hold their source, without a binary"


def _identified(path: Path, out: Path, replacing: Overwrite, common: Common) -> Path:
    """Identify a record, with f fitted to it and the law that folds choose, and give its identify.json in a folder."""
    from studies.commands.identification import files_of_fit, identify_records, write_fit

    files = files_of_fit(out, "identify", 1)
    require_kept(out, files, [path])
    replacing.allow(files)
    record = read_record(path)
    settings = IdentifySettings(law="auto", seed=common.seed)
    fit = identify_records([record], settings=settings, use_rig=False, progress=common.shows_progress)
    write_fit(fit, [record], out, "identify", made=made_now(common.command))
    return files[0]


def _export_record(path: Path, out: Path, moment_arm_mm: float | None, replacing: Overwrite, common: Common) -> None:
    from fem_models.export.log_joint import joint_of_log
    from fem_models.export.log_mujoco import log_model

    if path.is_dir() or path.suffix.lower() == ".json":
        raise RecordError(f"FIT {path}: with --to mujoco: of a fit: expected a record, CSV, or --rig or --preset alone")
    if moment_arm_mm is not None and not (math.isfinite(moment_arm_mm) and moment_arm_mm > 0):
        raise RecordError(f"--moment-arm {moment_arm_mm:g}: expected a number above 0, mm")
    _require_xml(out)
    table = out.with_name(f"{out.stem}-values.json")
    replacing.allow([out, table])
    record = read_record(path)
    arm = moment_arm_mm if moment_arm_mm is not None else _moment_arm_mm(record)
    with status(common.shows_progress, f"exporting {path}"):
        joint = joint_of_log(record, arm, seed=common.seed)
    result = {
        "schema": 1,
        "record": joint.record.source or joint.name,
        "moment_arm_mm": joint.moment_arm_mm,
        "values": {name: value.to_dict() for name, value in joint.values.items()},
        "missing": dict(joint.missing),
        "rmse_deg": joint.rmse_deg,
        "noise_floor_deg": joint.noise_deg,
        "blocks": joint.blocks,
    }
    write_files({table: json.dumps(marked_values(result), indent=2) + "\n", out: log_model(joint)})
    lines = [f"{name}: {value}" for name, value in joint.values.items()]
    lines += [f"{name}: left out: {why}" for name, why in joint.missing.items()]
    common.show(result, *lines, f"model: {out}", f"values: {table}")


def _moment_arm_mm(record: Record) -> float | None:
    """Give the moment arm of the sidecar's rig; None if it has none, or a rig that bends in space."""
    if "moment_arm_mm" in record.rig:
        return float(record.rig["moment_arm_mm"])
    rig = None if bends_in_space(record) else declared_rig_of(record)
    return None if rig is None else rig.tendon_a.moment_arm_mm


def _require_xml(out: Path) -> None:
    if out.suffix.lower() != ".xml":
        raise RecordError(f"{out}: expected a name that ends in .xml")


def write_model(rig: Rig, out: Path, *, to: Simulator, amplitude_mm: float) -> tuple[Path, Path]:
    """Write a rig for another simulator.

    Returns
    -------
    The model file and the table of tensions, ``<stem>-guides.csv``.

    Raises
    ------
    ValueError
        An unknown simulator.
    RecordError
        A name that does not end in .xml, or a folder that cannot be written to.
    RigError, SolverError
        An amplitude that is not above 0, or that the rig cannot follow.
    """
    if not isinstance(to, str) or to != "mujoco":
        raise ValueError(f"to = {quoted(to)}: expected 'mujoco'")
    _require_xml(out)
    if isinstance(rig.joint, MeasuredJoint) and rig.joint.has_law:
        raise RigError(f"rig {rig.name}: law_share: no spring of MuJoCo: expected joints without a law of their own")
    loop = guide_loop(rig, amplitude_mm)
    table = out.with_name(f"{out.stem}-guides.csv")
    write_files({table: guide_table(loop), out: mujoco_model(rig, loop)})
    return out, table
