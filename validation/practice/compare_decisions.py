"""Compare the verdict of the tracer with what its test says by itself, on practice cases of the set ``work``.

    python -m validation.practice.compare_decisions --cases own:clean:8 lumped:clean:8 own:backlash:2 --out DIR

A case is a source, a label and a count. Cases with a stored outcome are not run again. The set is for development: no
scored set can be asked for.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.progress import track

from hysteresis.files import write_files
from hysteresis.plain import from_plain, to_plain
from validation.practice.draw import SETS
from validation.practice.outcome import CLAIMS
from validation.practice.protocols import KINDS, Kind
from validation.practice.spoiled.draw import SOURCES, Source, draw_labelled
from validation.tracing import trace_records
from validation.tracing.inference import ALPHA, Decision, decide

MOST_LEADING = 3


@dataclass(frozen=True)
class Asked:
    """Cases of one label; ``count`` from the first on."""

    source: Source
    label: str
    count: int


@dataclass(frozen=True)
class Compared:
    """What was hidden in a case, the verdict of today, and what the test says.

    Parameters
    ----------
    named, confusable
        Effects that today's verdict names, and those that it does not tell from the first.
    by_test
        Verdict of the test; empty where it does not decide for this kind of baseline.
    p_none
        See :class:`validation.tracing.inference.decision.Decision`.
    first
        Effect of the best fit; empty without any.
    not_distinguished
        Effects in the set of the test.
    leading
        Effects with the largest statistics, whether they were fitted or not.
    seconds, decision_seconds
        Of the trace, and of the test with the runs of the model that it makes.
    """

    source: str
    kind: str
    label: str
    number: int
    truth: tuple[str, ...]
    verdict: str
    named: tuple[str, ...]
    confusable: tuple[str, ...]
    by_test: str
    p_none: float
    first: str
    not_distinguished: tuple[str, ...]
    leading: tuple[str, ...]
    seconds: float
    decision_seconds: float

    @property
    def claims(self) -> bool:
        """Whether today's verdict names an effect."""
        return self.verdict in CLAIMS

    def claims_by_test(self, alpha: float) -> bool:
        """Whether the test finds an effect."""
        return self.p_none <= alpha


def compared(source: Source, kind: Kind, label: str, number: int, alpha: float) -> Compared:
    """Trace a case, and decide it by the test."""
    case, _ = draw_labelled(source, SETS["work"], kind, label, number)
    start = time.perf_counter()
    trace = trace_records(case.records, threads=1)
    traced = time.perf_counter()
    decision = decide(trace, alpha=alpha)
    ended = time.perf_counter()
    return Compared(
        source=source,
        kind=kind,
        label=label,
        number=number,
        truth=case.truth.effects,
        verdict=trace.verdict,
        named=trace.names,
        confusable=trace.confusable[0] if trace.confusable else (),
        by_test=decision.verdict if decision else "",
        p_none=decision.p_none if decision else 1.0,
        first=decision.compared[0].names[0] if decision and decision.compared else "",
        not_distinguished=tuple(name for names in decision.not_distinguished for name in names) if decision else (),
        leading=tuple(leading(decision)) if decision else (),
        seconds=round(traced - start, 2),
        decision_seconds=round(ended - traced, 2),
    )


def leading(decision: Decision) -> list[str]:
    """Give the effects with the largest statistics, the largest first."""
    return sorted(decision.statistics, key=lambda name: -decision.statistics[name])[:MOST_LEADING]


def table(rows: Sequence[Compared], alpha: float) -> list[str]:
    """Lines of the agreement: clean cases that are claimed, and cases with effects by what is right, old and new."""
    clean = [one for one in rows if not one.truth]
    with_effect = [one for one in rows if one.truth]
    lines = []
    for source in dict.fromkeys(one.source for one in clean):
        own = [one for one in clean if one.source == source]
        old, new = sum(one.claims for one in own), sum(one.claims_by_test(alpha) for one in own)
        lines.append(f"clean, {source}: claimed today {old} of {len(own)}, by the test {new} of {len(own)}")
    for source in dict.fromkeys(one.source for one in with_effect):
        own = [one for one in with_effect if one.source == source]
        count = len(own)
        lines += [
            f"with an effect, {source}: claimed today {sum(one.claims for one in own)} of {count}, "
            f"by the test {sum(one.claims_by_test(alpha) for one in own)} of {count}",
            f"  first: today {sum(one.claims and {*one.named[:1]} <= {*one.truth} for one in own)}, "
            f"by the test {sum(one.first in one.truth and one.claims_by_test(alpha) for one in own)}",
            f"  in the set: today {sum(bool({*one.truth} & {*one.named, *one.confusable}) for one in own)}, "
            f"by the test {sum(bool({*one.truth} & {*one.not_distinguished}) for one in own)}",
        ]
        sizes = [len(one.not_distinguished) for one in own if one.not_distinguished]
        if sizes:
            lines.append(f"  size of the set by the test: 1 in {sizes.count(1)}, at most {max(sizes)}")
    if rows:
        seconds = [one.decision_seconds for one in rows]
        lines.append(f"seconds of the test: median {statistics.median(seconds):.1f}, largest {max(seconds):.1f}")
        lines.append(f"seconds of the trace: median {statistics.median(one.seconds for one in rows):.1f}")
    return lines


def asked(text: str) -> Asked:
    """Read SOURCE:LABEL:COUNT."""
    source, label, count = (*text.split(":"), "", "")[:3]
    known = next((own for own in SOURCES if own == source), None)
    if known is None or label not in SOURCES[known] or not count.isdigit():
        raise argparse.ArgumentTypeError(f"{text}: expected SOURCE:LABEL:COUNT, such as own:clean:8")
    return Asked(known, label, int(count))


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare all cases, store each, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.compare_decisions")
    parser.add_argument("--cases", nargs="+", type=asked, required=True, help="SOURCE:LABEL:COUNT each")
    parser.add_argument("--kind", choices=KINDS, default="known", help="whether the sidecar describes the rig")
    parser.add_argument("--alpha", type=float, default=ALPHA, help="how often the test may claim what is not there")
    parser.add_argument("--out", type=Path, required=True, help="folder of the outcomes")
    options = parser.parse_args(arguments)
    rows = []
    every = [(one, number) for one in options.cases for number in range(one.count)]
    for one, number in track(every, description="cases"):
        path = options.out / f"{one.source}-{options.kind}-{one.label}-{number:02d}.json"
        if not path.exists():
            found = compared(one.source, options.kind, one.label, number, options.alpha)
            write_files({path: json.dumps(to_plain(found)) + "\n"})
        rows.append(from_plain(Compared, json.loads(path.read_text(encoding="utf-8")), str(path)))
    print("\n".join(table(rows, options.alpha)))  # noqa: T201


if __name__ == "__main__":
    main()
