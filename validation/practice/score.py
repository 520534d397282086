"""How often the tracer is right on practice records.

``python -m validation.practice.score --set score --kind known --count 10 --workers 2 --out DIR`` traces every case and
writes one JSON a case, ``DIR/score.json`` and ``DIR/score.md``. Cases that are there are not traced again, but for
those on which the tracer broke; a tracer that was changed needs another DIR. ``--page`` puts the tables into a page
of the documentation, in the section of their kind.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from docs.make.practice import SLOW, put_section, tables
from hysteresis.files import write_files
from hysteresis.record import Record
from validation.practice.cases import CLEAN, LABELS, PAIR, SETS, SetName, draw_case, labels
from validation.practice.hidden import CATALOGUE
from validation.practice.outcome import Outcome, summary
from validation.practice.outside import OUTSIDE
from validation.practice.protocols import KINDS, Kind

Tracer = Callable[[Sequence[Record], int], Mapping[str, Any]]
"""Records and a seed to what ``trace.json`` holds."""

COUNT = 10
TWICE = frozenset({CLEAN, PAIR})  # of these there are two times as many cases


@dataclass(frozen=True)
class Job:
    """A case to trace, and the file of its outcome."""

    set_name: SetName
    kind: Kind
    label: str
    number: int
    file: Path


def trace(records: Sequence[Record], seed: int) -> Mapping[str, Any]:
    """Run the tracer of the package."""
    from validation.tracing import trace_records  # late: a worker that reads outcomes alone does not need it
    from validation.tracing.result import trace_report

    return trace_report(trace_records(records, threads=1)).to_dict()


def jobs(
    set_name: SetName, kind: Kind, count: int, labels: Sequence[str], folder: Path, others: int | None = None
) -> list[Job]:
    """All cases of a score: ``count`` of each label, twice as many clean ones and pairs.

    ``others`` is the count for pairs and what is outside the catalogue, where it is another one.
    """

    def count_of(label: str) -> int:
        number = count if others is None or label not in SLOW else others
        return 2 * number if label in TWICE else number

    return [
        Job(set_name, kind, label, number, folder / "cases" / f"{set_name}-{kind}-{label}-{number:02d}.json")
        for label in labels
        for number in range(count_of(label))
    ]


def run_job(job: Job, tracer: Tracer = trace) -> None:
    """Draw a case, trace it and write the outcome. An error of the tracer is an outcome, too."""
    case = draw_case(job.set_name, job.kind, job.label, job.number)
    started = time.perf_counter()
    try:
        found: Mapping[str, Any] = tracer(case.records, 0)
    except Exception as error:  # whatever a tracer breaks on is a miss, not the end of the score
        where = traceback.extract_tb(error.__traceback__)[-1]
        found = {"verdict": "error", "message": f"{type(error).__name__} at {where.name}: {error}"}
    outcome = outcome_of(job.label, case.name, case.truth, found, time.perf_counter() - started)
    write_files({job.file: json.dumps(outcome) + "\n"})


def outcome_of(label: str, name: str, truth: Any, found: Mapping[str, Any], seconds: float) -> dict[str, Any]:
    """Keep what a score needs of a case and its trace, as plain values."""

    def heldout(which: str) -> float | None:
        error = (found.get(which) or {}).get("heldout") or {}
        return error.get("rmse_deg")

    effects = found.get("effects") or []
    return {
        "label": label,
        "name": name,
        "truth": list(truth.effects),
        "numbers": truth.numbers,
        "ratios": list(truth.ratios),
        "beyond_curve": list(truth.beyond_curve),
        "engine": truth.engine,
        "rig": truth.rig,
        "noise_deg": truth.noise_deg,
        "verdict": found["verdict"],
        "message": found.get("message", ""),
        "named": [effect["name"] for effect in effects],
        "confusable": list(effects[0].get("confusable_with") or []) if effects else [],
        "noise_floor_deg": found.get("noise_floor_deg"),
        "before_deg": heldout("before"),
        "after_deg": heldout("after"),
        "seconds": round(seconds, 2),
    }


def finished(job: Job) -> bool:
    """Tell whether a case has its outcome; one on which the tracer broke has not."""
    return job.file.exists() and json.loads(job.file.read_text(encoding="utf-8"))["verdict"] != "error"


def run_all(todo: Sequence[Job], workers: int, *, quiet: bool = False) -> None:
    """Trace the cases whose outcome is not there yet, in processes."""
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
    """Outcomes of cases that were traced."""
    return [Outcome.of(json.loads(job.file.read_text(encoding="utf-8"))) for job in todo]


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.score", description=__doc__)
    parser.add_argument("--set", choices=[*SETS], default="work", help="tune on work, report score")
    parser.add_argument("--kind", choices=KINDS, default="known", help="whether the sidecar tells the rig")
    parser.add_argument("--count", type=int, default=COUNT, help="cases of each effect; twice as many clean and pairs")
    parser.add_argument("--others", type=int, help="the same of pairs and of effects outside the catalogue")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--effects", type=labels, default=[*LABELS], help=f"comma between, of {', '.join(LABELS)}")
    parser.add_argument("--out", type=Path, default=Path("practice"), help="folder of the outcomes")
    parser.add_argument("--page", type=Path, help="page of the documentation that gets the tables")
    parser.add_argument("--quiet", action="store_true", help="no progress and no tables")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Trace, count and write."""
    options = parse(arguments)
    todo = jobs(options.set, options.kind, options.count, options.effects, options.out, options.others)
    run_all(todo, options.workers, quiet=options.quiet)
    result = {
        "schema": 1,
        "set": options.set,
        "kind": options.kind,
        "count": None if options.count == COUNT else options.count,
        "others": options.others,
        "effects": None if options.effects == [*LABELS] else ",".join(options.effects),
        **summary(read_outcomes(todo), [*CATALOGUE], [*OUTSIDE]),
    }
    text = tables(result)
    write_files({options.out / "score.json": json.dumps(result, indent=1) + "\n", options.out / "score.md": text})
    if options.page:
        put_section(options.page, result, text)
    if not options.quiet:
        Console().print(text, markup=False, highlight=False, soft_wrap=True)


if __name__ == "__main__":
    main()
