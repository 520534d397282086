"""Compare the verdict by rules with the verdict by the test, on the same fresh cases, row by row.

    python -m validation.practice.gate --seed 7 --count 8 --out gate.jsonl

A line is appended to the file for every
case, and cases that have a line are not traced again. A seed is used once, after the last change.
"""

from __future__ import annotations

import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import binomtest

from validation.practice.clean_makes.maxwell_slip import draw_maxwell_slip
from validation.practice.clean_makes.uneven_notches import draw_uneven_notches
from validation.practice.draw import CLEAN, Case, drawn_labels
from validation.practice.kept_lines import Score, run
from validation.practice.lumped.cases import LABELS as LUMPED_LABELS
from validation.practice.lumped.cases import draw_lumped_case
from validation.practice.outcome import Answer, Outcome
from validation.practice.outside_catalogue import OUTSIDE_CATALOGUE
from validation.practice.protocols import Kind
from validation.practice.score import outcome_of
from validation.practice.series.effects import labels_of
from validation.practice.spoiled.draw import SOURCES, Source, draw_labelled
from validation.practice.summary import exact_interval
from validation.tracing import trace_records
from validation.tracing.inference import ALPHA
from validation.tracing.outcome import Trace

MOST_LEADING = 3
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
    test_seconds: float

    @property
    def decided(self) -> Outcome:
        """Answer with the test where it decides, of the rules elsewhere."""
        return self.test or self.rules


def line_of(asked: Asked, alpha: float = ALPHA) -> Line:
    """Draw a case, and trace it by the rules and by the test."""
    case, describes = asked.case()
    by_rules, seconds = traced(case, None)
    by_test, test_seconds = traced(case, alpha)
    rules, decision = outcome(asked, case, by_rules, seconds, describes), by_test.decision
    if decision is None:
        return Line(asked.row, asked.seed, asked.number, rules, None, None, (), (), seconds, test_seconds)
    return Line(
        row=asked.row,
        seed=asked.seed,
        number=asked.number,
        rules=rules,
        test=outcome(asked, case, by_test, test_seconds, describes),
        p_none=decision.p_none,
        leading=tuple(sorted(decision.statistics, key=lambda name: -decision.statistics[name])[:MOST_LEADING]),
        fitted=tuple(" + ".join(one.names) for one in decision.compared),
        seconds=seconds,
        test_seconds=test_seconds,
    )


def traced(case: Case, alpha: float | None) -> tuple[Trace, float]:
    """Trace a case; the other number is seconds of one core."""
    start = time.process_time()
    trace = trace_records(case.records, threads=1, alpha=alpha)
    return trace, round(time.process_time() - start, 2)


def outcome(asked: Asked, case: Case, trace: Trace, seconds: float, describes: tuple[str, ...]) -> Outcome:
    """Give what was injected with what a trace answered."""
    answer = Answer(
        verdict=trace.verdict,
        named=trace.names,
        confusable=trace.confusable[0] if trace.confusable else (),
        noise_floor_deg=trace.floor.deg,
        before_deg=trace.baseline.heldout_rmse_deg,
        after_deg=trace.augmented.heldout_rmse_deg,
    )
    return replace(outcome_of(asked.label, case, answer, seconds), describes=describes)


def table(lines: Sequence[Line]) -> list[str]:
    """Rows of a Markdown table: counts with exact 95 % intervals, by the rules and by the test, and McNemar's p."""
    out = [
        "| row | cases | what | rules | test | only rules, only test | p (McNemar, exact) |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in dict.fromkeys(one.row for one in lines):
        own = [one for one in lines if one.row == row]
        effects = [one for one in own if one.rules.truth]
        if effects:
            out.append(_counts(row, "in the set", effects, lambda one: one.within_set))
            out.append(_counts(row, "named first", effects, lambda one: one.first_right))
            out.append(_counts(row, "nothing else named", effects, lambda one: {*one.counted} == {*one.truth}))
        out.append(_counts(row, "a false name", own, lambda one: one.names_falsely))
    return out


def _counts(row: str, what: str, lines: Sequence[Line], hit: Callable[[Outcome], bool]) -> str:
    rules, test = [hit(one.rules) for one in lines], [hit(one.decided) for one in lines]
    lost = sum(old and not new for old, new in zip(rules, test, strict=True))
    won = sum(new and not old for old, new in zip(rules, test, strict=True))
    p = binomtest(won, won + lost).pvalue if won + lost else 1.0
    cells = [row, str(len(lines)), what, rate(sum(rules), len(lines)), rate(sum(test), len(lines))]
    return f"| {' | '.join(cells)} | {lost}, {won} | {p:.2g} |"


def rate(hits: int, of: int) -> str:
    """Format a rate with its exact 95 % interval."""
    low, high = exact_interval(hits, of)
    return f"{hits} of {of} ({100 * low:.0f} to {100 * high:.0f} %)"


def main(arguments: Sequence[str] | None = None) -> None:
    """Trace the cases that have no line yet, and print the table of all."""
    run(Score("validation.practice.gate", [*ROWS], 8, Asked, line_of, Line, table), arguments)


if __name__ == "__main__":
    main()
