"""Practice cases from which other ways than the tracer learn: other seeds than those of a benchmark.

    python -m validation.practice.benchmark.training --seed 5 --count 200 --out training.json

The command draws cases of the sources that may be learnt from, stores the features of each with its truth, and
what sparse regression answers with several thresholds. It can be interrupted and started again.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from rich.progress import track

from hysteresis.files import read_json, write_files
from hysteresis.plain import from_plain, to_plain
from hysteresis.records.record import RecordError
from validation.practice.benchmark.features import NAMES, features
from validation.practice.benchmark.sources import LEARNT, Drawn, draw_simulated
from validation.practice.benchmark.sparse_regression import Thresholds, judge_terms, named_set
from validation.practice.benchmark.terms import residual_terms

STORED_EVERY = 20
"""Cases after which the file is written."""
KEPT, NOTHING, EXPLAINED = (0.1, 0.2, 0.3, 0.5), (1.2, 1.5, 2.0), (0.2, 0.35, 0.5, 0.7)
GRID = tuple(Thresholds(*values) for values in product(KEPT, NOTHING, EXPLAINED))
"""Thresholds that are tried."""
FALSE_ALARMS = 0.05
"""Part of clean cases that may get a name on practice seeds."""


@dataclass(frozen=True)
class Example:
    """A practice case for learning.

    Parameters
    ----------
    key
        Source and number.
    truth
        The effect; ``none`` or, for what is outside the catalogue, ``unexplained``.
    features
        Those of :mod:`validation.practice.benchmark.features`.
    sparse
        For each of :data:`GRID`, what sparse regression reports: names, or nothing.
    """

    key: str
    truth: str
    features: tuple[float, ...]
    sparse: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Training:
    """What the file holds; ``names`` are those of the features."""

    schema: int
    seed: int
    names: tuple[str, ...]
    examples: tuple[Example, ...]


def example_of(key: str, drawn: Drawn) -> Example:
    """Make the example of a case."""
    found = residual_terms(drawn.records)
    return Example(
        key=key,
        truth=drawn.effects[0] if drawn.effects else "unexplained" if drawn.outside else "none",
        features=tuple(float(value) for value in features(drawn.records, found)),
        sparse=tuple(named_set(judge_terms(found, thresholds)) for thresholds in GRID),
    )


def best_thresholds(examples: Sequence[Example]) -> tuple[Thresholds, float, float]:
    """Thresholds with most effects in the set, at most :data:`FALSE_ALARMS` of the clean cases named; both rates."""
    clean = [one for one in examples if one.truth == "none"]
    effects = [one for one in examples if one.truth not in ("none", "unexplained")]

    def false(k: int) -> float:
        return sum(bool(one.sparse[k]) for one in clean) / max(1, len(clean))

    def right(k: int) -> float:
        return sum(one.truth in one.sparse[k] for one in effects) / max(1, len(effects))

    rates = [(right(k), false(k), k) for k in range(len(GRID))]
    allowed = [rate for rate in rates if rate[1] <= FALSE_ALARMS] or [min(rates, key=lambda rate: rate[1])]
    hits, alarms, k = max(allowed, key=lambda rate: (rate[0], -rate[1], rate[2]))
    return GRID[k], hits, alarms


def read_training(path: Path) -> Training:
    """Read a file of examples.

    Raises
    ------
    RecordError
        A file that is missing or malformed, or that has other features than this version.
    """
    values = read_json(path, "the examples that the training command writes")
    training = from_plain(Training, values, str(path))
    if training.names != NAMES:
        raise RecordError(f"{path}: features of another version: expected examples drawn again")
    return training


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the cases that the file does not have, and print the best thresholds of sparse regression."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.benchmark.training", description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="other than that of any benchmark")
    parser.add_argument("--count", type=int, default=200, help="cases of each source")
    parser.add_argument("--out", type=Path, required=True, help="file of the examples, JSON")
    options = parser.parse_args(arguments)
    stored = read_training(options.out) if options.out.exists() else Training(1, options.seed, NAMES, ())
    if stored.seed != options.seed:
        parser.error(f"{options.out}: seed = {stored.seed}: expected {options.seed}, or another file")
    examples = [*stored.examples]
    there = {one.key for one in examples}
    # every fifth case is simulated with the multibody model, which takes a hundred times as long as the chain
    numbers = [number for number in range(2 * options.count) if number % 5 != 4][: options.count]
    todo = [(source, n) for n in numbers for source in LEARNT if f"{source} {n}" not in there]
    for k, (source, number) in enumerate(track(todo, description="cases"), start=1):
        examples.append(example_of(f"{source} {number}", draw_simulated(source, options.seed, number)))
        if k % STORED_EVERY == 0 or k == len(todo):
            stored = Training(1, options.seed, NAMES, tuple(examples))
            write_files({options.out: json.dumps(to_plain(stored)) + "\n"})
    chosen, hits, alarms = best_thresholds(examples)
    print(f"{len(examples)} cases; {chosen}: in the set {hits:.2f}, clean cases named {alarms:.2f}")  # noqa: T201


if __name__ == "__main__":
    main()
