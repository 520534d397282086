"""Score the tracer on measured records with a hidden change.

    python -m validation.practice.hidden.score --measured DIR --seed 7 --count 40 --out hidden.json

Each case is traced, and so is its control, the untouched records. What is named in the control is not counted for or
against. A change is in the set if it is named or not distinguished from a named effect. Lost counts and leaps are in no
model: there nothing new may be named. Cases that the file of outcomes has already are not traced again.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.progress import track

from hysteresis.files import write_files
from hysteresis.plain import from_plain
from hysteresis.records.record import Record, RecordError
from validation.practice.hidden.changes import OUTSIDE
from validation.practice.hidden.draw import HiddenCase, nth
from validation.practice.outcome import MOST_REPORTED
from validation.tracing import Trace, trace_records

SAME_SIZE = 0.25
"""Relative deviation up to which a size counts as found."""
GROWN = 0.5
"""Part of the hidden size by which a change must have grown that the control shows, too."""


@dataclass(frozen=True)
class HiddenOutcome:
    """What the tracer said of one case, and of its control.

    ``alike`` has the first two effects that are not distinguished from each named one. ``size`` is what was found, less
    what the control has where it names the change, over the true size; None where it was not found.
    """

    name: str
    group: str
    change: str
    ratio: float
    verdict: str
    named: tuple[str, ...]
    alike: tuple[str, ...]
    of_control: tuple[str, ...]
    size: float | None
    before_deg: float
    after_deg: float
    seconds: float
    control_deg: float = math.nan

    @property
    def new(self) -> tuple[str, ...]:
        """Effects that are named in the case alone."""
        return tuple(name for name in self.named if name not in self.of_control)

    @property
    def in_set(self) -> bool:
        """Whether the change is named, or not distinguished from a named effect.

        Where the control names it, too, it must have grown by at least half of what was hidden.
        """
        grown = self.change not in self.of_control or (self.size is not None and self.size >= GROWN)
        return grown and self.change in {*self.named, *self.alike}


def outcome(case: HiddenCase, control: Trace) -> HiddenOutcome:
    """Trace a case and compare it with its truth and with the trace of its control."""
    start = time.perf_counter()
    trace = trace_records(case.case.records, threads=1)
    near = tuple(dict.fromkeys(name for names in trace.confusable for name in names[: MOST_REPORTED - 1]))
    return HiddenOutcome(
        name=case.case.name,
        group=case.group,
        change=case.change,
        ratio=case.case.truth.ratios[0],
        verdict=trace.verdict,
        named=trace.names,
        alike=near,
        of_control=(*control.names, *(name for names in control.confusable for name in names)),
        size=None if case.change in OUTSIDE else _found_over_true(trace, control, case),
        before_deg=trace.baseline.heldout_rmse_deg,
        after_deg=trace.augmented.heldout_rmse_deg,
        seconds=time.perf_counter() - start,
        control_deg=control.baseline.heldout_rmse_deg,
    )


def _found_over_true(trace: Trace, control: Trace, case: HiddenCase) -> float | None:
    """Size of the change that was found, less that of the control, over the true one."""
    true = _size(case.case.truth.numbers[case.change], case.control)
    found = _size_in(trace, case)
    before = _size_in(control, case) if case.change in _reported(control) else 0.0
    return None if found is None or before is None or not true else (found - before) / true


def _reported(trace: Trace) -> set[str]:
    return {*trace.names, *(name for names in trace.confusable for name in names)}


def _size_in(trace: Trace, case: HiddenCase) -> float | None:
    """Size of the change in the model that is named, or else in the best one of those that have it."""
    models = [trace.augmented] if case.change in trace.names else [c.fitted for c in trace.candidates]
    there = [one for one in models if case.change in one.names and math.isfinite(one.heldout_rmse_deg)]
    if not there:
        return None
    best = min(there, key=lambda one: one.heldout_rmse_deg)
    values = dict(zip(best.names, best.model.values(best.x)[1], strict=True))[case.change]
    return _size(values, case.control)


def _size(values: object, records: Sequence[Record]) -> float | None:
    """One number for the size of a change, whatever form it was drawn or fitted in."""
    assert isinstance(values, dict)
    known = {
        name.rsplit("_", 1)[0] if name.endswith(("_mm", "_deg", "_s", "_step")) else name: values[name]
        for name in values
    }
    if "deg_per_s" in values:
        return float(values["deg_per_s"])
    if "size" in known and "time" in known:  # mean rate over the longest record
        longest = max(float(np.ptp(one.time_s)) for one in records if one.time_s is not None)
        return float(-known["size"] * np.expm1(-longest / known["time"]) / longest)
    if "sine" in known:
        return math.hypot(known["sine"], known["cosine"])
    return next((float(known[name]) for name in ("delay", "width", "amplitude") if name in known), None)


def table(outcomes: Sequence[HiddenOutcome]) -> list[str]:
    """Rows of a page: by change, in the set, named first, size within a quarter, and nothing new for those outside."""
    rows = [
        "| hidden change | cases | in the set | first | size within 25 %, of those in the set | something new named |"
    ]
    rows.append("|---|---|---|---|---|---|")
    for change in dict.fromkeys(one.change for one in outcomes):
        rows.append(_row(change.replace("_", " "), [one for one in outcomes if one.change == change]))
    inside = [one for one in outcomes if one.change not in OUTSIDE]
    outside = [one for one in outcomes if one.change in OUTSIDE]
    rows += [_row("all of the catalogue", inside), _row("lost counts and leaps", outside)]
    return rows


def _row(name: str, some: Sequence[HiddenOutcome]) -> str:
    found = [one for one in some if one.in_set]
    sized = sum(one.size is not None and abs(one.size - 1) <= SAME_SIZE for one in found)
    first = sum(one.named[:1] == (one.change,) for one in some)
    outside = bool(some) and some[0].change in OUTSIDE
    own = ("-", "-", "-") if outside else (f"{len(found)}", f"{first}", f"{sized} of {len(found)}")
    new = sum(any(name != one.change and one.change not in one.alike for name in one.new) for one in some)
    return f"| {name} | {len(some)} | {' | '.join(own)} | {new} |"


def _stored(file: Path, seed: int, parser: argparse.ArgumentParser) -> list[HiddenOutcome]:
    """Outcomes of the first cases of a seed that an interrupted run has left."""
    if not file.exists():
        return []
    try:
        stored = json.loads(file.read_text(encoding="utf-8"))
        of, cases = stored["seed"], [from_plain(HiddenOutcome, one, str(file)) for one in stored["cases"]]
    except (ValueError, KeyError, TypeError, RecordError) as error:
        parser.error(f"--out: {file}: expected outcomes of this command: {error}")
    if of != seed:
        parser.error(f"--out: {file}: seed = {of}: expected {seed}")
    return cases


def main(arguments: Sequence[str] | None = None) -> None:
    """Trace cases and their controls, print the table and write all outcomes."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.hidden.score", description=__doc__)
    parser.add_argument("--measured", type=Path, required=True, help="folder of the measured records")
    parser.add_argument("--seed", type=int, required=True, help="of the set")
    parser.add_argument("--count", type=int, default=40, help="cases")
    parser.add_argument("--out", type=Path, required=True, help="JSON")
    options = parser.parse_args(arguments)
    controls: dict[tuple[str, ...], Trace] = {}
    outcomes = _stored(options.out, options.seed, parser)[: options.count]
    for number in track(range(len(outcomes), options.count), description="cases"):
        case = nth(options.measured, options.seed, number)
        key = tuple(record.source for record in case.control)
        if key not in controls:
            controls[key] = trace_records(case.control, threads=1)
        outcomes.append(outcome(case, controls[key]))
        stored = {"seed": options.seed, "cases": [asdict(one) for one in outcomes]}
        write_files({options.out: json.dumps(stored, indent=1) + "\n"})
    print("\n".join(table(outcomes)))  # noqa: T201


if __name__ == "__main__":
    main()
