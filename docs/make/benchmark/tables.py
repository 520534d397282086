"""Puts scores into a page: ``python -m docs.make.benchmark WAY.json ...``.

Each file is a score that ``notchbend practice score --out`` wrote; its name is that of the way, such as tracer.json.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from docs.make.pages import DOCS, put_between_marks, table
from hysteresis.plain import from_plain
from hysteresis.records.record import RecordError
from validation.practice.benchmark.scoring import ALL, BenchmarkScore
from validation.practice.summary import Rate

PAGE = DOCS / "archive" / "practice-2026.md"
COMMAND = "docs.make.benchmark"


def tables(scores: dict[str, BenchmarkScore]) -> str:
    """Markdown of scores by way: a table for each source, with a row for each rate and a column for each way.

    Raises
    ------
    RecordError
        Scores that are not of the same cases.
    """
    cases = {name: tuple((one.case, one.label) for one in score.each) for name, score in scores.items()}
    if len(set(cases.values())) > 1:
        raise RecordError(f"{', '.join(cases)}: scores of different cases: expected those of one benchmark")
    first = next(iter(scores.values()))
    blocks = [", ".join(f"{name}: {score.answered} of {score.cases} answered" for name, score in scores.items()) + "."]
    for source in [*(name for name in first.rates if name != ALL), ALL]:
        counted = sum(one.source == source or source == ALL for one in first.each)
        rows = [
            [name, *(_cell(score.rates[source][name]) for score in scores.values())]
            for name, rate in first.rates[source].items()
            if any(score.rates[source][name].of for score in scores.values())
        ]
        medians = [score.heldout_over_noise[source].median for score in scores.values()]
        rows.append(["held-out error over noise, median", *("" if m is None else f"{m:.2f}" for m in medians)])
        blocks += [f"**{source}**: {counted} cases.", table(["", *scores], rows)]
    return "\n" + "\n\n".join(blocks) + "\n"


def _cell(rate: Rate) -> str:
    return f"{rate.hits}/{rate.of} ({100 * rate.low:.0f} to {100 * rate.high:.0f} %)" if rate.of else ""


def main(arguments: Sequence[str] | None = None) -> None:
    """Read scores and put their tables into the page."""
    parser = argparse.ArgumentParser(prog=f"python -m {COMMAND}", description="Put scores into a page.")
    parser.add_argument("scores", type=Path, nargs="+", help="WAY.json, scores of the same cases")
    parser.add_argument("--page", type=Path, default=PAGE, help="page of the documentation")
    options = parser.parse_args(arguments)
    scores = {
        path.stem: from_plain(BenchmarkScore, json.loads(path.read_text(encoding="utf-8")), str(path))
        for path in options.scores
    }
    put_between_marks(options.page, COMMAND, tables(scores))
