"""Follow a device over 30 days of records in which one of eight things drifts from day 12 on, or nothing does.

    python benchmarks/followed_series.py --seed 7 --drifting 18 --steady 30 --out scores.jsonl

The records are of the lumped rig, which shares no code with what is fitted to them: a slow and a fast part with strokes
of three sizes, white noise of the angle, and a zero that is set anew every day. What drifts is drawn, how much of it by
day 30 too. A series is right if the cause that is named first is the one that drifts.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import beta

from hysteresis.arrays import Floats, Ints
from hysteresis.records.record import Record
from studies.follow import FollowSettings, follow_loaded
from studies.follow.result import Axis
from validation.practice.lumped.cases import drawn_rig
from validation.practice.lumped.rig import LumpedRig, simulate_lumped

DAYS, FROM_DAY = 30, 12
NOISE_DEG, ZERO_DEG, TENSION_N = 0.05, 0.05, 0.1
STROKE_MM = 1.8
PARTS = ((0.08, (1.0, 0.7, 0.4)), (0.4, (1.0, 0.7)))
"""Rate, Hz, and sizes of the cycles of each part of a record."""
SAMPLES = 48

Drift = Callable[[LumpedRig, float], LumpedRig]
DRIFTS: dict[str, tuple[Drift, tuple[float, float]]] = {
    "preload_loss": (lambda rig, s: replace(rig, preload_N=rig.preload_N * (1 - s)), (0.1, 0.4)),
    "guide_friction": (
        lambda rig, s: replace(rig, coulomb_N=rig.coulomb_N * (1 + s), capstan=rig.capstan * (1 + s)),
        (0.4, 1.2),
    ),
    "backlash": (lambda rig, s: replace(rig, play_mm=s), (0.06, 0.25)),
    "viscous_drag": (lambda rig, s: replace(rig, viscous_N_s_per_mm=s), (0.6, 2.0)),
    "drive_gain": (lambda rig, s: rig, (0.02, 0.06)),
    "zero": (lambda rig, s: rig, (0.4, 1.5)),
    "tendon_slack": (lambda rig, s: replace(rig, slack_mm=s * rig.preload_N / min(rig.tendon_N_per_mm)), (1.3, 1.8)),
    "camera_misalignment": (lambda rig, s: replace(rig, camera=(0.0, s)), (0.05, 0.15)),
}
SIGNED = ("camera_misalignment",)
"""How a rig changes with a size, and the sizes on the last day; gain and zero are of drive and sensor.

Slack is in parts of the stretch of a tendon at rest, so that both are loose at the centre at last."""


def program() -> tuple[Floats, Floats, Ints]:
    """Drive, mm, time, s, and cycle of a record."""
    drive, clock, cycle, now = [], [], [], 0.0
    for rate, sizes in PARTS:
        for size in sizes:
            k = np.arange(1, SAMPLES + 1)
            drive.append(STROKE_MM * size * np.sin(2 * np.pi * k / SAMPLES))
            clock.append(now + k / SAMPLES / rate)
            cycle.append(np.full(SAMPLES, len(cycle)))
            now += 1 / rate
    return np.concatenate(drive), np.concatenate(clock), np.concatenate(cycle)


def series(label: str, rng: np.random.Generator) -> list[Record]:
    """Draw a rig and its records; ``label`` is what drifts, or ``steady``."""
    rig, (drive, clock, cycle) = drawn_rig(rng), program()
    changed, sizes = DRIFTS.get(label, (lambda rig, s: rig, (0.0, 0.0)))
    last, side = float(rng.uniform(*sizes)), float(rng.choice([-1.0, 1.0]))
    records = []
    for day in range(1, DAYS + 1):
        size = last * max(0, day - FROM_DAY + 1) / (DAYS - FROM_DAY + 1)
        gain = 1 + side * size if label == "drive_gain" else 1.0
        angle, tension = simulate_lumped(
            changed(rig, side * size if label in SIGNED else size), gain * drive, clock, cycle
        )
        zero = rng.normal(0.0, ZERO_DEG) + (side * size if label == "zero" else 0.0)
        records.append(
            Record(
                drive=drive,
                angle_deg=angle + zero + rng.normal(0.0, NOISE_DEG, angle.size),
                time_s=clock,
                cycle=cycle,
                tension_a_N=tension[:, 0] + rng.normal(0.0, TENSION_N, angle.size),
                tension_b_N=tension[:, 1] + rng.normal(0.0, TENSION_N, angle.size),
                kind="simulated",
                title=f"day {day}",
            )
        )
    return records


def main(arguments: Sequence[str] | None = None) -> None:
    """Follow series, a line of JSON each, and sum up."""
    parser = argparse.ArgumentParser(prog="python benchmarks/followed_series.py", description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of what drifts, of rigs and of noise")
    parser.add_argument("--drifting", type=int, default=18, help="series in which something drifts")
    parser.add_argument("--steady", type=int, default=30, help="series in which nothing does")
    parser.add_argument("--out", type=Path, required=True, help="lines of JSON, appended")
    options = parser.parse_args(arguments)
    order = np.random.default_rng((options.seed, 99))
    labels = ["steady"] * options.steady + [str(one) for one in order.choice([*DRIFTS], options.drifting)]
    axis = Axis("day", tuple(map(float, range(1, DAYS + 1))))
    for number, label in enumerate(labels):
        began, rng = time.perf_counter(), np.random.default_rng((options.seed, number))
        found = follow_loaded(series(label, rng), axis, FollowSettings(trace=label != "steady"))
        first = min((one.first for one in found.changes), default=None)
        names, alike = (list(found.cause.effects), list(found.cause.alike)) if found.cause else ([], [])
        row = {"seed": options.seed, "number": number, "label": label, "verdict": found.verdict, "first": first}
        row |= {"named": names, "alike": alike, "alarms": [o.name for o in found.parameters if o.alarm is not None]}
        row |= {"how": found.cause.how if found.cause else None}
        row |= {"p": [one.p for one in found.changes], "seconds": round(time.perf_counter() - began, 1)}
        with options.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
    sys.stdout.write(summary([json.loads(line) for line in options.out.read_text().splitlines()]))


def summary(rows: Sequence[dict[str, object]]) -> str:
    """Count false alarms, changes that were found, and causes, with exact 95 % intervals (Clopper and Pearson 1934)."""
    steady = [row for row in rows if row["label"] == "steady"]
    drifting = [row for row in rows if row["label"] != "steady"]
    found = [row for row in drifting if row["verdict"] == "changed"]
    first = [row for row in drifting if row["named"][:1] == [row["label"]]]  # type: ignore[index]
    alone = [row for row in drifting if row["named"] == [row["label"]]]
    within = [row for row in drifting if row["label"] in [*row["named"], *row["alike"]]]  # type: ignore[misc]
    lines = [
        f"false alarms  {share([r for r in steady if r['verdict'] != 'steady'], steady)}",
        f"found         {share(found, drifting)}",
        f"named first   {share(first, drifting)}",
        f"nothing else  {share(alone, drifting)}",
        f"in the set    {share(within, drifting)}",
    ]
    for label in DRIFTS:
        mine = [row for row in drifting if row["label"] == label]
        lines.append(f"{label:16s} {sum(row in first for row in mine)} of {len(mine)} named first")
    return "\n".join(lines) + "\n"


def share(part: Sequence[object], whole: Sequence[object]) -> str:
    """Give a share with its exact 95 % interval."""
    k, n = len(part), len(whole)
    if not n:
        return "none"
    low = beta.ppf(0.025, k, n - k + 1) if k else 0.0
    high = beta.ppf(0.975, k + 1, n - k) if k < n else 1.0
    return f"{k} of {n} ({100 * k / n:.0f} %, {100 * low:.0f} to {100 * high:.0f})"


if __name__ == "__main__":
    main()
