"""Score the tracer on practice cases: how often it is right.

``python -m validation.practice.score --set score --kind known --count 10 --workers 2 --out DIR`` traces every case,
writes one JSON file per case, and ``DIR/score.json``. Cases with a stored outcome are not traced again, except for
those on which the tracer stopped with an error: after a change of the tracer, use another DIR.
``docs.make.practice`` puts the score into the documentation. ``--source`` takes other cases: of the lumped rig, of
rigs in series, or clean ones whose sensors or protocols are spoiled. Printed intervals are exact (Clopper-Pearson).
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import time
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from hysteresis import Record
from hysteresis.files import write_files
from hysteresis.plain import from_plain, to_plain
from validation.practice.draw import CLEAN, PAIR, SETS, Case, SetName, drawn_labels
from validation.practice.outcome import Answer, Outcome
from validation.practice.outside_catalogue import OUTSIDE_CATALOGUE
from validation.practice.protocols import KINDS, Kind
from validation.practice.series.effects import labels_of
from validation.practice.spoiled.draw import SOURCES, Source, draw_labelled
from validation.practice.summary import exact_interval, summary

Tracer = Callable[[Sequence[Record], int], Answer]
"""From records and a seed to an answer."""

COUNT = 10
TWICE = frozenset({CLEAN, PAIR})
"""Labels with twice as many cases."""
SLOW = frozenset({PAIR, *OUTSIDE_CATALOGUE})
"""Labels whose cases take longest: the search tries up to three effects before it ends. They are scored separately."""


@dataclass(frozen=True)
class Request:
    """Command line of a score; ``count``, ``others`` and ``effects`` are None at their defaults.

    ``score.json`` has its fields, then those of :class:`validation.practice.summary.Summary`.
    """

    schema: int
    set: str
    kind: str
    count: int | None
    others: int | None
    effects: str | None
    source: Source = "own"


@dataclass(frozen=True)
class Job:
    """A case to trace, and the file of its outcome."""

    set_name: SetName
    kind: Kind
    label: str
    number: int
    file: Path
    source: Source = "own"


def trace(records: Sequence[Record], seed: int) -> Answer:
    """Run the tracer of the package."""
    from validation.tracing import trace_records  # late: workers that only read outcomes do not need it
    from validation.tracing.result import trace_report

    report = trace_report(trace_records(records, threads=1))
    return Answer(
        verdict=report.verdict,
        named=tuple(effect.name for effect in report.effects),
        confusable=tuple(report.effects[0].confusable_with) if report.effects else (),
        noise_floor_deg=report.noise_floor_deg,
        before_deg=report.before.heldout.rmse_deg,
        after_deg=report.after.heldout.rmse_deg,
    )


def jobs(
    set_name: SetName,
    kind: Kind,
    count: int,
    labels: Sequence[str],
    folder: Path,
    others: int | None = None,
    source: Source = "own",
) -> list[Job]:
    """List all cases of a score: ``count`` of each label, twice as many clean ones and pairs.

    ``others`` is the count of pairs and of effects outside the catalogue, if it differs.
    """

    def count_of(label: str) -> int:
        if source in ("sensors", "protocols"):
            return count
        number = count if others is None or label not in SLOW else others
        return 2 * number if label in TWICE else number

    name = set_name if source == "own" else f"{set_name}-{source}"
    return [
        Job(set_name, kind, label, number, folder / "cases" / f"{name}-{kind}-{label}-{number:02d}.json", source)
        for label in labels
        for number in range(count_of(label))
    ]


def source_labels(source: Source, kind: Kind) -> list[str]:
    """Labels of a source that are drawn: a rig of unknown geometry takes some effects whole."""
    drawn = {"own": drawn_labels(kind), "series": labels_of(kind)}.get(source, SOURCES[source])
    return [label for label in SOURCES[source] if label in drawn]


def run_job(job: Job, tracer: Tracer = trace) -> None:
    """Draw a case, trace it and write the outcome; an error of the tracer is an outcome, too."""
    case, describes = draw_labelled(job.source, SETS[job.set_name], job.kind, job.label, job.number)
    started = time.perf_counter()
    try:
        answer = tracer(case.records, 0)
    except Exception as error:  # an error of the tracer counts as a miss and does not end the score
        where = traceback.extract_tb(error.__traceback__)[-1]
        answer = Answer("error", f"{type(error).__name__} at {where.name}: {error}")
    outcome = outcome_of(job.label, case, answer, time.perf_counter() - started)
    write_files({job.file: json.dumps(to_plain(replace(outcome, describes=describes))) + "\n"})


def outcome_of(label: str, case: Case, answer: Answer, seconds: float) -> Outcome:
    """Combine a case and the tracer's answer."""
    truth = case.truth
    return Outcome(
        label=label,
        name=case.name,
        truth=truth.effects,
        numbers=truth.numbers,
        ratios=truth.ratios,
        beyond_curve=truth.beyond_curve,
        engine=truth.engine,
        rig=truth.rig,
        noise_deg=truth.noise_deg,
        verdict=answer.verdict,
        message=answer.message,
        named=answer.named,
        confusable=answer.confusable,
        noise_floor_deg=answer.noise_floor_deg,
        before_deg=answer.before_deg,
        after_deg=answer.after_deg,
        seconds=round(seconds, 2),
    )


def read_outcome(path: Path) -> Outcome:
    """Read a stored outcome."""
    return from_plain(Outcome, json.loads(path.read_text(encoding="utf-8")), str(path))


def finished(job: Job) -> bool:
    """Whether a case has a stored outcome other than an error of the tracer."""
    return job.file.exists() and read_outcome(job.file).verdict != "error"


def run_all(todo: Sequence[Job], workers: int, *, quiet: bool = False) -> None:
    """Trace the cases without a stored outcome in worker processes."""
    missing = [job for job in todo if not finished(job)]
    context = multiprocessing.get_context("spawn")
    with (
        Progress(console=Console(stderr=True), disable=quiet) as progress,
        ProcessPoolExecutor(workers, mp_context=context) as pool,
    ):
        task = progress.add_task("cases", total=len(todo), completed=len(todo) - len(missing))
        futures = [pool.submit(run_job, job) for job in missing]
        try:
            for future in as_completed(futures):
                future.result()
                progress.advance(task)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def read_outcomes(todo: Sequence[Job]) -> list[Outcome]:
    """Read the outcomes of traced cases."""
    return [read_outcome(job.file) for job in todo]


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.score", description=__doc__)
    parser.add_argument("--set", choices=[*SETS], default="work", help="set of seeds; develop on work, report score")
    parser.add_argument("--kind", choices=KINDS, default="known", help="whether the sidecar describes the rig")
    parser.add_argument("--count", type=int, default=COUNT, help="cases of each effect; twice as many clean and pairs")
    parser.add_argument("--others", type=int, help="the same for pairs and for effects outside the catalogue")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--source", choices=[*SOURCES], default="own", help="where the cases come from")
    parser.add_argument("--effects", help="labels by commas; all of the source by default")
    parser.add_argument("--out", type=Path, default=Path("practice"), help="folder of the outcomes")
    parser.add_argument("--quiet", action="store_true", help="no progress and no rates")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Trace, summarise and write."""
    options = parse(arguments)
    known = source_labels(options.source, options.kind)
    chosen = [*known] if options.effects is None else options.effects.split(",")
    for label in chosen:
        if label not in known:
            raise SystemExit(f"--effects: {label!r}: expected some of {', '.join(known)}")
    todo = jobs(options.set, options.kind, options.count, chosen, options.out, options.others, options.source)
    run_all(todo, options.workers, quiet=options.quiet)
    request = Request(
        schema=1,
        set=options.set,
        kind=options.kind,
        count=None if options.count == COUNT else options.count,
        others=options.others,
        effects=options.effects,
        source=options.source,
    )
    found = summary(read_outcomes(todo))
    contents = {**to_plain(request), **to_plain(found)}
    write_files({options.out / "score.json": json.dumps(contents, indent=1) + "\n"})
    if not options.quiet:
        for name, rate in found.rates.items():
            if rate.of:
                low, high = exact_interval(rate.hits, rate.of)
                print(f"{name}: {rate.hits} of {rate.of} ({100 * low:.0f} to {100 * high:.0f} %)")  # noqa: T201


if __name__ == "__main__":
    main()
