"""Effects outside the catalogue, for which the right verdict is ``unexplained``."""

from __future__ import annotations

import numpy as np

from fem_models.load import LoadProgram
from hysteresis import Record
from hysteresis.arrays import Floats
from validation.practice.injected import Draw, Family, Injected, Rng, either_sign
from validation.practice.protocols import BaselineRuns


def _lost_counts(rng: Rng, baseline: BaselineRuns) -> Family:
    """Lose counts of the encoder permanently at a few moments, in at least two records."""
    records = len(baseline.runs)
    with_losses = set(rng.permutation(records)[: rng.integers(2, records + 1)].tolist())
    events = [
        [
            (float(rng.uniform(0.15, 0.9)), either_sign(rng) * float(rng.uniform(0.4, 1.0)))
            for _ in range(rng.integers(1, 4))
        ]
        if index in with_losses
        else []
        for index in range(records)
    ]

    def at(size: float) -> Injected:
        most = 0.2 * baseline.full_mm * size

        def drive(index: int, program: LoadProgram) -> LoadProgram:
            true = program.drive_mm.copy()
            for when, part in events[index]:
                true[int(when * true.size) :] += most * part
            return LoadProgram(true, program.time_s, program.cycle)

        return Injected({"largest_loss_mm": most, "losses": float(sum(map(len, events)))}, drive=drive)

    return Family(at)


def _intermittent_jumps(rng: Rng, baseline: BaselineRuns) -> Family:
    """Sticking tendons that release at random moments: the angle drops and recovers within some samples."""
    events = []
    for run in baseline.runs:
        samples = run.record.angle_deg.size
        count = int(rng.integers(3, 9))
        starts, lengths = rng.integers(10, samples - 10, count), rng.integers(3, 20, count)
        events.append(list(zip(starts.tolist(), lengths.tolist(), rng.uniform(0.4, 1.0, count).tolist(), strict=True)))

    def at(size: float) -> Injected:
        most = 5.0 * size

        def observe(index: int, record: Record, angle_deg: Floats) -> Floats:
            jumped = angle_deg.copy()
            for start, length, part in events[index]:
                recovery = np.maximum(1 - np.arange(angle_deg.size - start) / length, 0.0)
                jumped[start:] -= most * part * np.sign(angle_deg[start]) * recovery
            return jumped

        return Injected({"largest_jump_deg": most, "jumps": float(sum(map(len, events)))}, observe=observe)

    return Family(at)


def _out_of_plane(rng: Rng, baseline: BaselineRuns) -> Family:
    """Bending plane that rotates, so that a camera sees the bending foreshortened.

    The rotation varies with the path of the angle, at a period that is no part of a cycle, and with the mean tension of
    the tendons.
    """
    period_deg, phase = baseline.bend_deg * float(rng.uniform(2.3, 9.7)), float(rng.uniform(0.0, 2 * np.pi))

    def at(size: float) -> Injected:
        most = np.radians(40.0) * size

        def observe(index: int, record: Record, angle_deg: Floats) -> Floats:
            assert record.tension_a_N is not None
            assert record.tension_b_N is not None
            path = np.cumsum(np.abs(np.diff(angle_deg, prepend=angle_deg[0])))
            mean = (record.tension_a_N + record.tension_b_N) / (record.tension_a_N[0] + record.tension_b_N[0])
            rotation = most * np.sin(2 * np.pi * path / period_deg + phase) * mean
            theta = np.radians(angle_deg)
            return np.degrees(np.arctan2(np.sin(theta) * np.cos(rotation), np.cos(theta)))

        return Injected({"largest_turn_deg": float(np.degrees(most)), "period_deg": period_deg}, observe=observe)

    return Family(at)


OUTSIDE_CATALOGUE: dict[str, Draw] = {
    "lost_counts": _lost_counts,
    "intermittent_jumps": _intermittent_jumps,
    "out_of_plane": _out_of_plane,
}
"""By name."""
