"""Scores with a line a case: a file that a score appends to, and goes on from where it was ended."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from rich.progress import track

from hysteresis.plain import from_plain, to_plain


class _Of(Protocol):
    """Which case a line is of."""

    @property
    def row(self) -> str:
        """Kind of the case."""

    @property
    def seed(self) -> int:
        """Of the set."""

    @property
    def number(self) -> int:
        """Of the case in its row."""


Case = TypeVar("Case")
Line = TypeVar("Line", bound=_Of)


@dataclass(frozen=True)
class Score(Generic[Case, Line]):
    """A command that scores ``count`` cases of each row: what a case is, its line, and the table of all lines."""

    module: str
    rows: Sequence[str]
    count: int
    case: Callable[[int, str, int], Case]
    line_of: Callable[[Case], Line]
    kind: type[Line]
    table: Callable[[Sequence[Line]], list[str]]


def read_lines(path: Path, kind: type[Line]) -> list[Line]:
    """Read the cases that have a line."""
    return [from_plain(kind, json.loads(one), f"{path}:{at}") for at, one in enumerate(whole_lines(path), start=1)]


def whole_lines(path: Path) -> list[str]:
    """Lines of the file of a score, none where there is no file.

    A last line without its end, of a score that was stopped while it wrote, is taken off the file.
    """
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        path.write_text(whole, encoding="utf-8")
    return whole.splitlines()


def append(path: Path, line: object) -> None:
    """Append the line of a case."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(to_plain(line)) + "\n")


def run(score: Score[Case, Line], arguments: Sequence[str] | None = None) -> None:
    """Trace the cases that have no line yet, and print the table of all."""
    parser = argparse.ArgumentParser(prog=f"python -m {score.module}")
    parser.add_argument("--seed", type=int, required=True, help="of the set")
    parser.add_argument("--rows", nargs="+", choices=[*score.rows], default=[*score.rows], help="rows; by default all")
    parser.add_argument("--count", type=int, default=score.count, help=f"cases of each row; {score.count} by default")
    parser.add_argument("--workers", type=int, default=1, help="processes; 1 by default")
    parser.add_argument("--out", type=Path, required=True, help="file of the lines")
    options = parser.parse_args(arguments)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    there = {(one.row, one.seed, one.number) for one in read_lines(options.out, score.kind)}
    every = [(options.seed, row, number) for number in range(options.count) for row in options.rows]
    todo = [score.case(*one) for one in every if (one[1], one[0], one[2]) not in there]
    with ProcessPoolExecutor(options.workers, mp_context=get_context("spawn")) as pool:
        futures = [pool.submit(score.line_of, one) for one in todo]
        for future in track(as_completed(futures), total=len(futures), description="cases"):
            append(options.out, future.result())
    lines = [one for one in read_lines(options.out, score.kind) if one.row in options.rows]
    print("\n".join(score.table(lines)))  # noqa: T201
