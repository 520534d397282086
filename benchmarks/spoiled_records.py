"""Score of spoiled records in all commands: ``python -m benchmarks.spoiled_records 1000 SEED OUT.jsonl [COMMAND...]``.

Records of a pair-notched tube whose parameters are drawn, each spoiled in one way, or clean. A result is silent where
it is further from the right one than its interval says, and no word warns of the record. Each row says how many were
silent, and how many clean records were warned of. A trace is ended after ``LIMIT_S``, and counted so. A line a case is
kept in the file, so that a score that was ended goes on where it stood.
"""

from __future__ import annotations

import json
import multiprocessing
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from fem_models.analytic import theory_curve
from fem_models.chain import simulate_chain
from fem_models.load import triangle
from fem_models.rig import Rig, RigError, preset
from fem_models.rig.checks import SolverError
from hysteresis import Fit, Record, identify
from hysteresis.arrays import Floats
from hysteresis.laws.inverse import compensating_drive
from hysteresis.records.record import RecordError
from validation.practice.kept_lines import whole_lines

PROCESSES = 2
LIMIT_S = 60.0
"""Time of a trace. Where no effect explains a spoiled record, its search may try every one for minutes."""
ENDED = "ended after"
NOISE_DEG = 0.05
STEP_MM = 0.1
NO_WARNING = (
    "not separated by these records",
    "of the width remains with inextensible tendons",
    "the record does not show the saturation",
    "in the file of the rig",
)
"""Words that say what records allow, or which value of the rig's file they do not show, and nothing of what is wrong
with them: the drawn rigs differ from the declared one."""
TOLERANCE = 0.02
"""Difference from the right value, over it, that no user would call wrong, whatever the interval is."""

Rng = np.random.Generator
Loop = tuple[Floats, Floats]
"""Drive, mm, and angle, deg."""


@dataclass(frozen=True)
class Case:
    """Records of one rig, how the first one is spoiled, and the same records as they were."""

    kind: str
    rig: Rig
    records: tuple[Record, ...]
    clean: tuple[Record, ...]


def _spikes(loop: Loop, rng: Rng) -> Loop:
    drive, angle = loop[0], loop[1].copy()
    hit = rng.choice(angle.size, int(rng.integers(1, 6)), replace=False)
    angle[hit] = rng.choice([180.0, 999.0, -999.0, 0.0, 1e4])
    return drive, angle


def _lost(loop: Loop, rng: Rng) -> Loop:
    drive, angle = loop[0], loop[1].copy()
    first, count = int(rng.integers(5, angle.size - 10)), int(rng.integers(2, 5))
    angle[first : first + count] = rng.choice([0.0, -1.0, 999.0])
    return drive, angle


def _late(loop: Loop, rng: Rng) -> Loop:
    samples = int(rng.integers(2, 6))
    return loop[0], np.concatenate([np.full(samples, loop[1][0]), loop[1][:-samples]])


def _shuffled(loop: Loop, rng: Rng) -> Loop:
    order = rng.permutation(loop[0].size)
    return loop[0][order], loop[1][order]


def _radians(loop: Loop, rng: Rng) -> Loop:
    return loop[0], np.radians(loop[1])


def _wrapped(loop: Loop, rng: Rng) -> Loop:
    return loop[0], loop[1] % 360.0


def _leap(loop: Loop, rng: Rng) -> Loop:
    at = int(rng.integers(loop[0].size // 3, 2 * loop[0].size // 3))
    return loop[0], loop[1] + rng.choice([-1.0, 1.0]) * rng.uniform(2.0, 8.0) * (np.arange(loop[0].size) >= at)


def _held(loop: Loop, rng: Rng) -> Loop:
    every = int(rng.integers(3, 6))
    return loop[0], loop[1][np.arange(loop[1].size) // every * every]


def _reversed(loop: Loop, rng: Rng) -> Loop:
    return loop[0], -loop[1]


def _as_it_is(loop: Loop, rng: Rng) -> Loop:
    return loop


KINDS: dict[str, Callable[[Loop, Rng], Loop]] = {
    "clean": _as_it_is,
    "spikes": _spikes,
    "lost readings": _lost,
    "late angle": _late,
    "order": _shuffled,
    "radians": _radians,
    "wrapped": _wrapped,
    "leap": _leap,
    "held": _held,
    "sense": _reversed,
    "preloads exchanged": _as_it_is,
}


def drawn(seed: int, number: int) -> Case:
    """Draw the rig and its two records, and spoil the first of them; every fourth case is clean."""
    rng = np.random.default_rng((seed, number))
    names = list(KINDS)
    kind = "clean" if number % 4 == 0 else names[1 + int(rng.integers(len(names) - 1))]
    declared = preset("du2018-full-widths")
    rig = replace(
        declared,
        friction=replace(
            declared.friction,
            capstan_coefficient=float(rng.uniform(0.01, 0.08)),
            sheath_N=float(rng.uniform(0.5, 3.0)),
        ),
        material=replace(declared.material, loop_share=float(rng.uniform(0.2, 0.6))),
    )
    reach, preloads = float(rng.uniform(1.2, 2.0)), (float(rng.uniform(14, 30)), float(rng.uniform(5, 11)))
    loops = []
    for preload_N in preloads:
        found = simulate_chain(replace(rig, preload_N=preload_N), triangle(reach, step_mm=STEP_MM, cycles=2))
        loops.append((found.drive, found.angle_deg + rng.normal(0.0, NOISE_DEG, found.drive.size)))
    stated = preloads[::-1] if kind == "preloads exchanged" else preloads
    spoiled = [KINDS[kind](loops[0], rng), loops[1]]
    return Case(kind, rig, tuple(map(_record, spoiled, stated, "ab")), tuple(map(_record, loops, preloads, "ab")))


def _record(loop: Loop, preload_N: float, name: str) -> Record:
    return Record(*loop, rig={"preset": "du2018-full-widths", "preload_N": preload_N}, source=f"{name}.csv")


def _is_off(value: float, right: float, low: float | None, high: float | None) -> bool:
    """Whether a value is further from the right one than its interval says, twice over for chance; None is open."""
    if low is None or high is None or not np.isfinite([low, high]).all():
        return False
    return abs(value - right) > max(high - low, TOLERANCE * abs(right))


def _warnings(words: Sequence[str]) -> list[str]:
    return [one for one in words if not one.startswith(NO_WARNING) and not any(part in one for part in NO_WARNING)]


def _fit(records: Sequence[Record]) -> Fit:
    rigs = [replace(preset("du2018-full-widths"), preload_N=float(record.rig["preload_N"])) for record in records]
    return identify(records, [partial(_angle_of, rig) for rig in rigs])


def _angle_of(rig: Rig, drive: Floats) -> Floats:
    return theory_curve(rig, drive).angle_deg


def run_identify(case: Case) -> tuple[bool, list[str]]:
    """Compare the saturation with that of the clean record; one record alone does not tell its preload."""
    taken = slice(None) if case.kind == "preloads exchanged" else slice(1)
    fit, right = _fit(case.records[taken]), _fit(case.clean[taken]).saturation_deg.value
    found = fit.saturation_deg
    return _is_off(found.value, right, found.low, found.high), [*fit.notes, *fit.warnings]


def run_compensate(case: Case) -> tuple[bool, list[str]]:
    """Compare the drive that makes the angle follow a sine with that of the clean record; off by a twentieth."""
    from studies.own_rig.new_record import unlike_loops

    reference = 0.3 * float(np.ptp(case.clean[0].angle_deg)) * np.sin(np.linspace(0, 2 * np.pi, 60))
    fit = identify(case.records[0])
    drive, right = (compensating_drive(one, reference, 0.0) for one in (fit, identify(case.clean[0])))
    words = [*fit.notes, *fit.warnings, *unlike_loops(case.records[:1])]
    return float(np.abs(drive - right).max()) > 0.05 * float(np.ptp(right)), words


def run_separate(case: Case) -> tuple[bool, list[str]]:
    """Compare the energy of friction with that of the rig that made the records."""
    from studies.commands.separation import separate_records
    from validation.separation import loop_program, separate

    found = separate_records(case.records)
    friction = found.contributions["friction"]
    drive = case.clean[0].drive
    rig = replace(case.rig, preload_N=float(case.clean[0].rig["preload_N"]))
    right = separate(rig, loop_program(float(drive.min()), float(drive.max()))).parts("dissipated_mJ")["friction"]
    low, high = (friction.intervals or {}).get("dissipated_mJ") or (None, None)
    assert friction.dissipated_mJ is not None
    return _is_off(friction.dissipated_mJ, right, low, high), list(found.warnings)


def run_trace(case: Case) -> tuple[bool, list[str]]:
    """Whether an effect is named: the rig has none that is missing."""
    from validation.tracing import trace_records
    from validation.tracing.result import trace_report

    report = trace_report(trace_records(case.records))
    return bool(report.effects), list(report.words)


COMMANDS = {"identify": run_identify, "separate": run_separate, "compensate": run_compensate, "trace": run_trace}


@dataclass(frozen=True)
class Seen:
    """What a command made of a case: whether its result is off, what it warned of, or how it refused."""

    command: str
    seed: int
    number: int
    kind: str
    off: bool
    words: tuple[str, ...]
    refused: str
    seconds: float


def seen(job: tuple[str, int, int]) -> Seen:
    """Draw a case and give it to a command."""
    command, case, began = job[0], drawn(*job[1:]), time.perf_counter()
    off, words, refused = False, list[str](), ""
    try:
        off, words = COMMANDS[command](case)
    except (RecordError, RigError, SolverError, ValueError) as error:
        refused = str(error)
    return Seen(*job, case.kind, bool(off), tuple(_warnings(words)), refused, round(time.perf_counter() - began, 2))


def seen_in_time(job: tuple[str, int, int]) -> Seen:
    """As ``seen``; a trace runs in a process of its own, which is ended after ``LIMIT_S``."""
    if job[0] != "trace":
        return seen(job)
    import validation.tracing  # noqa: F401 - once, before the process is copied

    with multiprocessing.get_context("fork").Pool(1) as one:
        try:
            return one.apply_async(seen, (job,)).get(LIMIT_S)
        except multiprocessing.TimeoutError:
            return Seen(*job, drawn(*job[1:]).kind, False, (), f"{ENDED} {LIMIT_S:g} s", LIMIT_S)


def kept(path: Path) -> list[Seen]:
    """Read the cases of an earlier score; none where there is no file."""
    return [Seen(**json.loads(line)) for line in whole_lines(path)]


def main() -> None:
    """Score so many cases of a seed, those that the file does not hold yet, and print the table."""
    count, seed, path = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    commands = sys.argv[4:] or list(COMMANDS)
    known = {(one.command, one.seed, one.number) for one in kept(path)}
    jobs = [(command, seed, number) for command in commands for number in range(count)]
    with ProcessPoolExecutor(PROCESSES) as pool, path.open("a") as out:
        for one in pool.map(seen_in_time, [job for job in jobs if job not in known]):
            out.write(json.dumps(asdict(one)) + "\n")
            out.flush()
    for command in commands:
        own = [one for one in kept(path) if (one.command, one.seed) == (command, seed) and one.number < count]
        sys.stdout.write(f"{command}, {sum(one.seconds for one in own):.0f} s\n")
        for kind in KINDS:
            sys.stdout.write(f"  {kind}: {_counts([one for one in own if one.kind == kind])}\n")


def _counts(found: Sequence[Seen]) -> str:
    off, silent = sum(one.off for one in found), sum(one.off and not one.words for one in found)
    warned, ended = sum(bool(one.words) for one in found), sum(one.refused.startswith(ENDED) for one in found)
    refused = sum(bool(one.refused) for one in found) - ended
    counts = f"{len(found)}, off {off}, off without a word {silent}, warned of {warned}, refused {refused}"
    return f"{counts}, ended {ended}" if ended else counts


if __name__ == "__main__":
    main()
