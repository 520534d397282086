"""Compare the verdict by rules with the verdict by the test, on the same fresh cases, row by row.

    python -m validation.practice.gate --seed 7 --count 8 --out gate.jsonl

Each case is drawn and traced once; both verdicts are of that one search. A line is appended to the file for every
case, and cases that have a line are not traced again. A seed is used once: look at no case of it before the last change.
"""

from __future__ import annotations

import argparse
import json
import time
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from rich.progress import track
from scipy.stats import binomtest

from hysteresis.plain import from_plain, to_plain
from validation.practice.clean_makes.maxwell_slip import draw_maxwell_slip
from validation.practice.clean_makes.uneven_notches import draw_uneven_notches
from validation.practice.draw import CLEAN, Case, drawn_labels
from validation.practice.lumped.cases import LABELS as LUMPED_LABELS
from validation.practice.lumped.cases import draw_lumped_case
from validation.practice.outcome import CLAIMS, Answer, Outcome
from validation.practice.outside_catalogue import OUTSIDE_CATALOGUE
from validation.practice.protocols import KINDS, Kind
from validation.practice.score import outcome_of
from validation.practice.series.effects import labels_of
from validation.practice.spoiled.draw import SOURCES, Source, draw_labelled
from validation.practice.summary import exact_interval
from validation.tracing import trace_records
from validation.tracing.inference import ALPHA, decide
from validation.tracing.outcome import Trace

MAKES: Mapping[str, Callable[[int, int], Case]] = {
    "lumped": lambda seed, number: draw_lumped_case(seed, "known", CLEAN, number),
    "maxwell slip": draw_maxwell_slip,
    "uneven notches": draw_uneven_notches,
}
"""Clean rigs of three makes."""


@dataclass(frozen=True)
class Row:
    """Cases of one kind: where they come from, whether the rig is declared, and their labels."""

    source: Source | None
    kind: Kind
    labels: tuple[str, ...]


def _of_own(kind: Kind) -> tuple[str, ...]:
    return tuple(label for label in drawn_labels(kind) if label not in OUTSIDE_CATALOGUE)


ROWS: Mapping[str, Row] = {
    "own": Row("own", "known", _of_own("known")),
    "lumped": Row("lumped", "known", LUMPED_LABELS),
    "series": Row("series", "known", labels_of("known")),
    "clean": Row(None, "known", tuple(MAKES)),
    "sensors": Row("sensors", "known", SOURCES["sensors"]),
    "unknown": Row("own", "unknown", _of_own("unknown")),
}


@dataclass(frozen=True)
class Asked:
    """A case: the seed of its set, its row and its number, from 0."""

    seed: int
    row: str
    number: int

    @property
    def label(self) -> str:
        """Labels follow each other in an order that is drawn for the set."""
        labels = ROWS[self.row].labels
        order = np.random.default_rng((self.seed, zlib.crc32(self.row.encode()))).permutation(len(labels))
        return labels[order[self.number % len(labels)]]

    def case(self) -> tuple[Case, tuple[str, ...]]:
        """Draw the case, with the effects that count neither way."""
        row, number = ROWS[self.row], self.number // len(ROWS[self.row].labels)
        if row.source is None:
            return MAKES[self.label](self.seed, number), ()
        return draw_labelled(row.source, self.seed, row.kind, self.label, number)


@dataclass(frozen=True)
class Line:
    """A case with the answers of the rules and of the test.

    ``test`` is None where the test does not decide for this kind of baseline. ``leading`` has the effects with the
    largest statistics, ``fitted`` those whose fits were compared, the best first.
    """

    row: str
    seed: int
    number: int
    rules: Outcome
    test: Outcome | None
    p_none: float | None
    leading: tuple[str, ...]
    fitted: tuple[str, ...]
    seconds: float
    decision_seconds: float

    @property
    def decided(self) -> Outcome:
        """Answer with the test where it decides, of the rules elsewhere."""
        return self.test or self.rules


def traced(asked: Asked) -> tuple[Case, tuple[str, ...], Trace, float]:
    """Draw and trace a case; the last is seconds of one core."""
    case, describes = asked.case()
    start = time.process_time()
    trace = trace_records(case.records, threads=1)
    return case, describes, trace, time.process_time() - start
