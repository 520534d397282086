"""The design report of a user's own rig and records: the work of ``notchbend run --rig mine.toml``.

Loops at the preloads with their strain, cross-checks, the hysteresis layer of each record, contributions to the loop,
and the trace of the records, in the same files as the main run (:mod:`studies.commands.first_report`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_models.chain import simulate_chain
from fem_models.joint.law_of_curve import without_law
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.of_record import rig_of
from fem_models.rig.rig import EFFECT_TABLES
from hysteresis.attempts import attempt
from hysteresis.files import write_files
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.own import is_own
from hysteresis.records.metrics import errors, loop_width, noise_floor
from hysteresis.records.path import cycle_index
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import write_record
from studies.commands.first_report import versions_found
from studies.commands.identification import identify_records, write_fit
from studies.commands.separation import separate_records, separate_rig
from studies.commands.tracing import FITS, NEXT, trace_loaded, with_ending
from studies.ensemble import run_ensemble
from studies.own_rig.design import Design, files_replaced, numbers_of_design, remove_earlier
from studies.own_rig.jumps import jump_lines
from studies.own_rig.key_numbers import write_page_one
from studies.own_rig.loops import draw_rig, write_loop
from studies.own_rig.metal import law_of_metal
from studies.own_rig.new_record import without_geometry
from studies.own_rig.numbers import derived_numbers, fitted_numbers
from studies.own_rig.programs import programs_of_report
from studies.own_rig.usual import unusual
from studies.progress import Steps, steps
from studies.results import write_result
from studies.results.ensemble import EnsembleRanges
from studies.results.files import without_folders
from studies.results.made import Made
from studies.results.page_one import DRAWING
from studies.results.page_one import FILE as PAGE_ONE
from studies.results.run import (
    NOT_DRAWN,
    CrossCheckRow,
    FitEntry,
    OwnRig,
    Prediction,
    RigNumber,
    RunLoop,
    RunSummary,
    SeparationEntry,
    TraceEntry,
    checksums,
    read_run,
)
from studies.results.wrist import FILE as WRIST
from validation.engines import compare_engines

UNKNOWN = "-unknown-geometry"
_CYCLE_S = 20.0  # of a rig whose loop depends on the rate
_REFUSED = (RecordError, RigError, SolverError)


@dataclass
class _Found:
    """What a report has collected so far."""

    records: dict[str, Record] = field(default_factory=dict)
    loops: list[RunLoop] = field(default_factory=list)
    checks: list[CrossCheckRow] = field(default_factory=list)
    fits: list[FitEntry] = field(default_factory=list)
    separations: list[SeparationEntry] = field(default_factory=list)
    predictions: list[Prediction] = field(default_factory=list)
    ranges: dict[str, EnsembleRanges] = field(default_factory=dict)
    fitted: list[RigNumber] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def files_of_design(out: Path, design: Design, records: Sequence[Record]) -> list[Path]:
    """Give the files of a folder that :func:`design_report` may replace, but the records of an earlier report."""
    patterns = (
        WRIST,
        "report.html",
        "tube.*",
        "identify-*.*",
        "separate*.json",
        "trace*.json",
        "trace*.png",
        "trace*-samples.csv",
        NEXT,
        PAGE_ONE,
        DRAWING,
    )
    known = read_run(out).sha256 if is_own(out / "run.json") else {}
    names = [*_named(design, records), f"{without_folders(design.name)}-*"]
    stems = [stem for name in names for stem in (name, f"{name}-predicted")]
    return [out / "run.json", *files_replaced(out, patterns, stems, known)]


def design_report(
    design: Design, records: Sequence[Record], out: Path, *, made: Made | None, seed: int = 0, progress: bool = True
) -> RunSummary:
    """Write the results of a report into ``out`` and return the summary that is stored as ``run.json``.

    ``run.json`` and the page of an earlier run are removed first, and ``run.json`` is written last, before the picture.
    What cannot be computed for a rig or a record is left out, and a note says why; a rig that cannot follow its drive
    is an error.

    Raises
    ------
    SolverError, RigError, RecordError
        From the simulation of the loops, or records with the same name.
    """
    named = _named(design, records)
    remove_earlier(out, ("run.json", WRIST, "report.html", PAGE_ONE, DRAWING))
    design, found = _begun(design, records)
    total = (2 + bool(design.members)) * len(design.rigs) + len(records) + max(1, len(design.rigs)) + 4
    with steps(progress, total=total) as step:
        for rig in design.rigs:
            _loop(design, rig, out, found, step)
        for name, record in named.items():
            step(f"identifying {name}")
            _record(name, record, out, found, seed)
        _separate(design, list(named.values()), out, found, seed, step)
        traced = _traces(named, out, found, seed, step)
        own = OwnRig(
            name=design.name,
            option=design.option,
            amplitude_mm=design.amplitude_mm,
            predictions=tuple(found.predictions),
            ranges=found.ranges,
            notes=tuple(found.notes),
        )
        step("drawing and numbers of the first page")
        write_page_one(design.rigs[-1], design.amplitude_mm, found.loops[-1], out, found.notes)
        summary = RunSummary(
            seed=seed,
            versions=versions_found(),
            rig=(*numbers_of_design(design), *derived_numbers(design.rigs[-1]), *found.fitted),
            peak_strain_percent=max(loop.peak_strain_percent for loop in found.loops),
            loops=tuple(found.loops),
            crosscheck=tuple(found.checks),
            fits=tuple(found.fits),
            separations=tuple(found.separations),
            trace=traced,
            picture=NOT_DRAWN,
            sha256=checksums(
                out,
                [*found.records, *(loop.theory for loop in found.loops), *(one.predicted for one in found.predictions)],
            ),
            own=own,
            made=made,
        )
        write_result(out / "run.json", summary)
        step("drawing the tube")
        last = found.records[found.loops[-1].record]
        summary = replace(summary, picture=draw_rig(design.rigs[-1], last, out))
    write_result(out / "run.json", summary)
    return summary


def _named(design: Design, records: Sequence[Record]) -> dict[str, Record]:
    """Name the records by their files; names that clash with each other or with a loop are refused."""
    named = dict[str, Record]()
    taken = {_loop_name(design, rig) for rig in design.rigs}
    for record in records:
        name = Path(record.source).stem
        if name in taken or name in named:
            raise RecordError(f"{record.source}: another record or loop of the report is named {name}: expected one")
        named[name] = record
    return named


def _loop_name(design: Design, rig: Rig) -> str:
    return f"{without_folders(design.name)}-{rig.preload_N:g}N"


def _begun(design: Design, records: Sequence[Record]) -> tuple[Design, _Found]:
    """Give the design with the law of the metal that its drive asks for, and what is to be noted of it."""
    low = 0.0 if design.rigs[0].tendon_b is None else -design.amplitude_mm
    found = [law_of_metal(rig, low, design.amplitude_mm, design.file) for rig in design.rigs]
    if any(one.by_default for one in found):  # one metal at all preloads
        with_flag = next(one.rig for one in found if one.by_default)
        rigs = tuple(replace(with_flag, preload_N=rig.preload_N) for rig in design.rigs)
        design = replace(design, rigs=rigs)
    laws = [f"preload {one.rig.preload_N:g} N: {one.words}" for one in found if one.words]
    return design, _Found(notes=[*unusual(design.rigs[0]), *laws, *without_geometry(records, beside_rig=True)])


# --- simulation ---------------------------------------------------------------------------------------------------


def _programs(rig: Rig, amplitude_mm: float) -> tuple[LoadProgram, LoadProgram]:
    """Give the program of a loop and that of the analytic curve; one tendon is driven from rest to the amplitude."""
    loop, theory = programs_of_report(amplitude_mm, both_ways=rig.tendon_b is not None)
    if not rig.depends_on_rate:
        return loop, theory
    assert loop.cycle is not None
    per_sample = _CYCLE_S / int((loop.cycle == 1).sum())
    return replace(loop, time_s=np.arange(loop.drive_mm.size, dtype=np.float64) * per_sample), theory


def without_effects(rig: Rig) -> Rig:
    """Return the rig without the tables and the law of its joints that the analytic model does not have."""
    none: dict[str, Any] = dict.fromkeys(EFFECT_TABLES)
    if isinstance(rig.joint, MeasuredJoint):
        none["joint"] = without_law(rig.joint)
    return replace(rig, **none)


def _loop(design: Design, rig: Rig, out: Path, found: _Found, step: Steps) -> None:
    """Simulate the loop at one preload, cross-check it, and run the ensemble."""
    name, amplitude = _loop_name(design, rig), design.amplitude_mm
    step(f"simulating {name}")
    program, theory = _programs(rig, amplitude)
    plain = without_effects(rig)
    solution, loop = write_loop(rig, program, theory, out, name, plain)
    found.records[name] = solution.record
    found.loops.append(loop)
    found.notes += [f"{name}: {words}" for words in jump_lines(solution.record)]
    first = len(found.loops) == 1
    left_out = [table for table in EFFECT_TABLES if getattr(rig, table) is not None]
    if left_out and first:
        tables = ", ".join(f"[{table}]" for table in left_out)
        found.notes.append(f"the analytic curve and the cross-checks are those of the rig without {tables}")
    if rig.depends_on_rate and first:
        found.notes.append(f"the loop depends on the rate: it is simulated with one cycle in {_CYCLE_S:g} s")
    step(f"cross-checking {name}")
    if rig.tendon_b is None:
        found.notes.append(f"{name}: no cross-checks: they need two tendons")
    else:
        engines = attempt(
            f"{name}: no cross-checks", lambda: compare_engines(plain, amplitude_mm=amplitude), None, found.notes
        )
        found.checks += [] if engines is None else [CrossCheckRow(**vars(engines))]
    if design.members:
        step(f"{len(design.members)} members of the ensemble, {name}")
        members = [replace(member, preload_N=rig.preload_N) for member in design.members]
        found.ranges[name] = run_ensemble(members, program).summary


# --- records ------------------------------------------------------------------------------------------------------


def _record(name: str, record: Record, out: Path, found: _Found, seed: int) -> None:
    """Store a record, the loop that its rig predicts, and its fit."""
    write_record(record, out / "records" / f"{name}.csv")
    found.records[name] = record
    rig = rig_of(record)
    if rig is not None and record.drive_unit == "mm":
        try:
            found.predictions.append(_prediction(name, record, rig, out))
        except _REFUSED as error:
            found.notes.append(f"{name}: the rig predicts no loop for this drive: {error}")
    try:
        fit = identify_records([record], settings=IdentifySettings(seed=seed))
    except _REFUSED as error:
        found.notes.append(f"{name}: no fit: {error}")
        return
    write_fit(fit, [record], out, f"identify-{name}")
    found.fits.append(FitEntry(name, name, record.title))


def _prediction(name: str, record: Record, rig: Rig, out: Path) -> Prediction:
    """Run the chain along the drive of a record, and compare the two with their mean difference taken out."""
    time = record.time_s
    if time is None and rig.depends_on_rate:
        time = np.arange(record.drive.size, dtype=np.float64)
    predicted = simulate_chain(rig, LoadProgram(record.drive, time))
    zero = float(np.mean(record.angle_deg - predicted.angle_deg))
    shifted = replace(predicted, angle_deg=predicted.angle_deg + zero)
    file = f"{name}-predicted"
    write_record(shifted, out / "records" / f"{file}.csv")
    off = errors(record.angle_deg, shifted.angle_deg)
    cycle = cycle_index(record)
    widths = [_width(replace(one, cycle=cycle)) for one in (record, shifted)]
    return Prediction(name, file, off.rmse_deg, off.max_abs_deg, noise_floor(record), *widths)


def _width(record: Record) -> float | None:
    try:
        return loop_width(record.drive, record.angle_deg, record.cycle).max_deg
    except ValueError:  # no closed cycle
        return None


def _separate(design: Design, records: Sequence[Record], out: Path, found: _Found, seed: int, step: Steps) -> None:
    """Divide the loop of the rig calibrated on its records, else that of the rig as it is, at each preload."""
    known = [record for record in records if rig_of(record) is not None and record.drive_unit == "mm"]
    if known:
        step("separating the records")
        names = " + ".join(Path(record.source).stem for record in known)
        files = " ".join(record.source for record in known)
        try:
            calibrated = separate_records(known, seed=seed)
            write_result(out / "separate-records.json", calibrated)
        except _REFUSED as error:
            found.notes.append(f"the loop of {names} is not divided: {error}")
        else:
            label = f"{design.name}, calibrated on {names}"
            command = f"notchbend separate {files} --seed {seed} --out DIR"
            found.separations.append(SeparationEntry("separate-records.json", label, command))
            found.fitted += fitted_numbers(calibrated, names)
            return
    for rig in design.rigs:
        name = _loop_name(design, rig)
        step(f"separating {name}")
        members = [replace(member, preload_N=rig.preload_N) for member in design.members]
        result = None
        for over in (members, []) if members else ([],):
            try:
                result = separate_rig(rig, design.amplitude_mm, seed=seed, members=over)
            except _REFUSED as error:
                what = "has no ranges over the ensemble" if over else "is not divided"
                found.notes.append(f"the loop of {name} {what}: {error}")
            else:
                break
        if result is None:
            continue
        write_result(out / f"separate-{name}.json", result)
        options = f"{design.option} --preload {rig.preload_N:g} --amplitude {design.amplitude_mm:g} --seed {seed}"
        ranges = " --ensemble" if result.ensemble is not None else ""
        label = f"{design.name}, {rig.preload_N:g} N, {design.amplitude_mm:g} mm"
        command = f"notchbend separate {options}{ranges} --out DIR"
        found.separations.append(SeparationEntry(f"separate-{name}.json", label, command))


def _traces(named: dict[str, Record], out: Path, found: _Found, seed: int, step: Steps) -> TraceEntry | None:
    """Trace the records of known geometry together, and the others together; give the verdict of the first."""
    groups = {
        ending: [record for record in named.values() if (rig_of(record) is None) == unknown]
        for ending, unknown in (("", False), (UNKNOWN, True))
    }
    entries = list[TraceEntry]()
    for ending, records in groups.items():
        if not records:
            continue
        step(f"tracing {' + '.join(Path(record.source).stem for record in records)}")
        try:
            traced = trace_loaded(records, seed=seed, stage=step.within(FITS))
        except _REFUSED as error:
            found.notes.append(f"no trace: {error}")
            continue
        report, files = with_ending(traced, ending)
        if traced.program is None or ending:
            report = replace(report, next_program=None)
        else:
            files[NEXT] = traced.program
        write_files({out / name: content for name, content in files.items()})
        write_result(out / f"trace{ending}.json", report.to_dict())
        entries.append(TraceEntry(traced.report.verdict, tuple(effect.name for effect in traced.report.effects)))
    return entries[0] if entries else None
