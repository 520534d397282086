"""``notchbend trace``: read records, trace their residual, write the verdict with its page and figures."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from fem_models.rig.of_record import bends_in_space
from hysteresis.attempts import attempt
from hysteresis.files import place, write_files
from hysteresis.own import marked_page, marked_png, marked_values
from hysteresis.records.planes import require_one_wheel
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_whole_records
from studies.commands.identification import STANDSTILL_DEG
from studies.progress import UNSEEN, Stages, stages
from studies.report.trace_page import trace_page
from studies.results.made import Made, made_entry
from studies.results.trace_samples import SAMPLES, TraceSamples, samples_csv, samples_of
from validation.tracing import catalogue, trace_records
from validation.tracing.baseline.in_space import SpaceProblem
from validation.tracing.effect import Effect, acting
from validation.tracing.figures import figures
from validation.tracing.inference import decide, learnt_prior, times_needed
from validation.tracing.next_experiment import Experiment, next_experiment
from validation.tracing.outcome import Trace
from validation.tracing.result import DetectionLimit, FigureFile, NextProgram, TraceReport, in_words, trace_report
from validation.tracing.search.detection import absorbed_effects, detection_limits
from validation.tracing.second_opinion import STOPPED, second_opinion
from validation.tracing.sensors.protocol import OTHER_AMPLITUDE, OTHER_RATE

NEXT = "next-experiment.csv"
PICTURES = ("trace-residual.png", "trace-loops.png", "trace-candidates.png")
PAGE = "report.html"
FITS = "fits"
"""What the first stage of a trace counts."""
FILES = ("trace.json", PAGE, NEXT, SAMPLES, *PICTURES)
"""Names that a trace may write."""


@dataclass(frozen=True, eq=False)
class Traced:
    """A trace as it is stored: the report in trace.json, figures as PNG by file, samples and next program as CSV.

    ``in_space`` is whether the rig bends in two planes.
    """

    report: TraceReport
    figures: dict[str, bytes]
    program: str | None
    samples: TraceSamples
    in_space: bool = False


def trace_files(
    paths: Sequence[Path],
    *,
    reference: Sequence[Path] = (),
    seed: int = 0,
    threads: int = 2,
    alpha: float | None = None,
    progress: bool = False,
) -> Traced:
    """Read records and trace them (:func:`trace_loaded`).

    Raises
    ------
    RecordError, RigError, SolverError
        Records that cannot be used, a rig that cannot exist, or one that cannot follow its drive.
    """
    require_different(paths, reference)
    new, old = read_for_trace(paths), read_for_trace(reference)
    with stages(progress, "tracing", total=5, unit=FITS) as stage:
        return trace_loaded(new, reference=old, seed=seed, threads=threads, alpha=alpha, stage=stage)


def require_different(paths: Sequence[Path], reference: Sequence[Path]) -> None:
    """Refuse a file that is given as a record and as its own reference: no change can be found in it.

    Raises
    ------
    RecordError
        One line with the file.
    """
    old = {place(path) for path in reference}
    for path in paths:
        if place(path) in old:
            raise RecordError(f"{path}: given as a record and as --reference: expected different records")


def read_for_trace(paths: Sequence[Path]) -> list[Record]:
    """Read records; those of a rig that does not bend in space for a model of one plane.

    Raises
    ------
    RecordError, RigError
        As :func:`hysteresis.records.record_file.read_records`; a rig file that cannot be read.
    """
    records = read_whole_records(paths)
    if not any(map(bends_in_space, records)):
        for record in records:
            require_one_wheel(record)
    return records


def trace_loaded(
    records: Sequence[Record],
    *,
    reference: Sequence[Record] = (),
    seed: int = 0,
    threads: int = 2,
    alpha: float | None = None,
    stage: Stages = UNSEEN,
) -> Traced:
    """Trace records, propose the next experiment, and run the multibody model for a second opinion.

    What comes after the verdict may fail: its ``words`` say so.

    Parameters
    ----------
    reference
        Records before a change; see :func:`validation.tracing.trace_records`.
    seed
        Of the draws of the test, and stored with the result; the search has nothing random.
    threads
        For runs and derivatives; see :func:`validation.tracing.trace_records`.
    alpha
        Probability with which the test may claim an effect that is not there; by default rules decide, and the test
        stands beside them, at 0.05.
    stage
        Told what is being computed, in five stages; the first one counts fits (:data:`FITS`).
    """
    for record in (*records, *reference):
        _require_moving(record)
    start, failed = time.perf_counter(), list[str]()
    trace = trace_records(records, reference=reference, threads=threads, progress=stage.count, alpha=alpha, seed=seed)
    if alpha is None:
        beside = attempt("no test", lambda: decide(trace, seed=seed, threads=threads, race=False), None, failed)
        trace = replace(trace, decision=beside)
    stage.begin("detection limits")
    limits = attempt("no detection limits", lambda: limits_of(trace), [], failed)
    absorbed = absorbed_effects(trace.augmented, _effects(trace), limits) if limits else ()
    stage.begin("the next experiment")
    experiment = attempt("no next experiment", lambda: next_experiment(trace), Experiment("not known"), failed)
    stage.begin("the multibody model")
    opinion = second_opinion(trace)
    stage.begin("figures")
    drawn = figures(trace, failed)
    spent = time.perf_counter() - start
    shown = partial(trace_report, limits=limits, absorbed=absorbed)
    found = shown(trace, experiment=experiment, opinion=opinion, seconds=spent, seed=seed)
    program = experiment.csv()
    found = replace(
        found,
        next_program=None if program is None else NextProgram(NEXT, experiment.preload_N),
        figures=tuple(FigureFile(name, caption) for name, (_, caption) in drawn.items()),
        samples_file=SAMPLES,
        words=(*found.words, *failed),
    )
    pictures = {name: png for name, (png, _) in drawn.items()}
    return Traced(found, pictures, program, samples_of(trace), _is_in_space(trace))


def with_ending(traced: Traced, ending: str) -> tuple[TraceReport, dict[str, str | bytes]]:
    """Give the report and the files beside it for a trace stored as ``trace<ending>.json``; the next program is not.

    Where a folder holds several traces, their files have different endings.
    """

    def named(name: str) -> str:
        return name.replace("trace", f"trace{ending}", 1)

    figures = tuple(replace(figure, file=named(figure.file)) for figure in traced.report.figures)
    files: dict[str, str | bytes] = {named(name): marked_png(png) for name, png in traced.figures.items()}
    files[named(SAMPLES)] = samples_csv(traced.samples)
    return replace(traced.report, figures=figures, samples_file=named(SAMPLES)), files


def limits_of(trace: Trace) -> list[DetectionLimit]:
    """Give the detection limits of the records; none where the named effects have no residual, or nothing is named.

    Nor where a reference lacks the amplitude or the rate of the new records, which hides a change.
    """
    hidden = {OTHER_AMPLITUDE, OTHER_RATE} & {*trace.words}
    if trace.verdict not in ("none", "partial", "unexplained") or hidden:
        return []
    effects, prior = _effects(trace), learnt_prior(trace)
    needed = None
    if trace.decision is not None and trace.decision.decides and prior is not None:
        needed = times_needed(trace.augmented, effects, prior, trace.decision.alpha)
    return detection_limits(trace.augmented, effects, trace.floor.deg, needed)


def _effects(trace: Trace) -> Sequence[Effect]:
    return acting(catalogue(), in_space=_is_in_space(trace))


def _is_in_space(trace: Trace) -> bool:
    return isinstance(trace.baseline.model.problem, SpaceProblem)


def write_trace(traced: Traced, out: Path, *, made: Made | None = None) -> TraceReport:
    """Write trace.json, samples, figures and the next program, all or none, then report.html; remove older files.

    Returns
    -------
    TraceReport
        As it is stored: its ``words`` also say why there is no page, where it cannot be drawn.

    Raises
    ------
    RecordError
        A folder that cannot be written to.
    """
    report, failed = traced.report, list[str]()
    files = with_ending(traced, "")[1] | {"trace.json": _stored(report, made)}
    if traced.program is not None:
        files[NEXT] = traced.program
    write_files({out / name: content for name, content in files.items()})
    (out / PAGE).unlink(missing_ok=True)  # of an older trace, whose verdict it would show
    page = attempt(f"no {PAGE}", lambda: marked_page(trace_page(report, traced.samples, made)), None, failed)
    if page is None:
        report = replace(report, words=(*report.words, *failed))
        write_files({out / "trace.json": _stored(report, made)})
    else:
        files[PAGE] = page
        write_files({out / PAGE: page})
    for name in FILES:
        if name not in files:
            (out / name).unlink(missing_ok=True)
    return report


def _stored(report: TraceReport, made: Made | None) -> str:
    return json.dumps(marked_values(report.to_dict() | made_entry(made)), indent=2, allow_nan=False) + "\n"


def summary(report: TraceReport) -> list[str]:
    """Lines for a terminal: the verdict in words, parameters of the effects, what to measure next."""
    failed = [f"Multibody model: {report.multibody_words}."] * report.multibody_words.startswith(STOPPED)
    parameters = [f"{effect.name}: {name} = {p}" for effect in report.effects for name, p in effect.parameters.items()]
    return [*in_words(report), *failed, *parameters, f"Measure next: {report.next_experiment}."]


def _require_moving(record: Record) -> None:
    second = np.ptp(record.angle_2_deg) if record.angle_2_deg is not None and bends_in_space(record) else 0.0
    if max(np.ptp(record.angle_deg), second) < STANDSTILL_DEG:
        found = f"angle = {record.angle_deg[0]:g} deg in all {record.angle_deg.size} samples"
        raise RecordError(f"{record.source or record.title}: {found}: expected an angle that changes")
    if record.drive_unit == "N" and np.ptp(record.drive) == 0.0:
        found = f"tendon force = {record.drive[0]:g} N in all {record.drive.size} samples"
        raise RecordError(f"{record.source or record.title}: {found}: expected a force that changes")
