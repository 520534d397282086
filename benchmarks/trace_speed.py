"""Time of a trace of four records of a known rig: ``python benchmarks/trace_speed.py`` prints Markdown.

The cases are practice cases of the set ``work``. Kernels are compiled, and caches filled, by a clean case before. Every
case is traced by one thread and by two, one after the other, so that their ratio holds on a busy machine, too.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator

from hysteresis.records.record import Record
from validation.practice.draw import draw_case
from validation.tracing import Trace, trace_records

LABELS = (
    "clean",
    "backlash",
    "tendon_slack",
    "preload_loss",
    "guide_friction",
    "time_delay",
    "functional_fatigue",
    "gravity",
    "camera_misalignment",
)


def records_of(label: str) -> tuple[Record, ...]:
    """Four records of a rig that its sidecars describe, with one effect."""
    return tuple(draw_case("work", "known", label, 0).records)


def timed(records: tuple[Record, ...], threads: int) -> tuple[Trace, float]:
    """Trace records; also the seconds that it took."""
    start = time.perf_counter()
    trace = trace_records(records, threads=threads)
    return trace, time.perf_counter() - start


def rows() -> Iterator[str]:
    """Trace all cases; a row of a table after each, and their medians."""
    trace_records(records_of("clean"))
    yield "| case | verdict | named | one thread, s | two threads, s |\n|---|---|---|---|---|"
    seconds: list[tuple[float, float]] = []
    for label in LABELS:
        records = records_of(label)
        (alone, one), (both, two) = timed(records, 1), timed(records, 2)
        assert alone.names == both.names, label
        seconds.append((one, two))
        yield f"| {label} | {both.verdict} | {', '.join(both.names) or '-'} | {one:.1f} | {two:.1f} |"
    one, two = (statistics.median(column) for column in zip(*seconds, strict=True))
    yield f"| median | | | {one:.1f} | {two:.1f} |"


if __name__ == "__main__":
    for row in rows():
        print(row, flush=True)  # noqa: T201
