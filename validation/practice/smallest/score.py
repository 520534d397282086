"""Find the smallest size of each effect that the tracer finds in nine cases of ten, and the false-alarm rate.

    python -m validation.practice.smallest.score --seed 7 --kind known --workers 2 --out DIR

Each effect is a file in DIR when it is done, and is not tried again. ``docs.make.benchmark.smallest`` makes the table
and the figure.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from hysteresis.files import write_files
from hysteresis.plain import to_plain
from validation.practice.catalogue import ABSORBED, CATALOGUE
from validation.practice.draw import CLEAN, Case
from validation.practice.outcome import Answer
from validation.practice.protocols import KINDS, Kind
from validation.practice.score import trace
from validation.practice.smallest.search import false_alarms, find_smallest

CLEAN_CASES = 40


@dataclass(frozen=True)
class FalseAlarms:
    """Clean cases in which an effect is named, of all clean cases."""

    kind: Kind
    seed: int
    named: int
    of: int


def effects_of(kind: Kind) -> list[str]:
    """Effects that are searched: an equivalent rig takes some of them whole."""
    return [name for name in CATALOGUE if kind == "known" or name not in ABSORBED]


def run(label: str, kind: Kind, seed: int, file: Path) -> None:
    """Search for one effect, or count false alarms, and write the result."""
    if label == CLEAN:
        named, of = false_alarms(kind, seed, CLEAN_CASES, _tracer)
        found: object = FalseAlarms(kind, seed, named, of)
    else:
        found = find_smallest(label, kind, seed, _tracer)
    write_files({file: json.dumps(to_plain(found), indent=1) + "\n"})


def _tracer(case: Case) -> Answer:
    try:
        return trace(case.records, 0)
    except Exception as error:  # counts as a miss and does not end the score
        return Answer("error", f"{type(error).__name__}: {error}")


def main(arguments: Sequence[str] | None = None) -> None:
    """Search for all effects in worker processes."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.smallest.score", description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of the set")
    parser.add_argument("--kind", choices=KINDS, default="known", help="whether the sidecar describes the rig")
    parser.add_argument("--effects", help="names by commas, also clean; all by default")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    options = parser.parse_args(arguments)
    known = [CLEAN, *effects_of(options.kind)]
    labels = known if options.effects is None else options.effects.split(",")
    for label in labels:
        if label not in known:
            parser.error(f"--effects: {label!r}: expected some of {', '.join(known)}")
    files = {label: options.out / f"{options.kind}-{label}.json" for label in labels}
    todo = [label for label, file in files.items() if not file.exists()]
    context = multiprocessing.get_context("spawn")
    with (
        Progress(console=Console(stderr=True)) as progress,
        ProcessPoolExecutor(options.workers, mp_context=context) as pool,
    ):
        task = progress.add_task("effects", total=len(labels), completed=len(labels) - len(todo))
        jobs = [pool.submit(run, label, options.kind, options.seed, files[label]) for label in todo]
        for job in as_completed(jobs):
            job.result()
            progress.advance(task)


if __name__ == "__main__":
    main()
