"""What practice records may hide besides: effects that no catalogue has a word for."""

from __future__ import annotations

import numpy as np

from fem_models.load import LoadProgram
from hysteresis.arrays import Floats
from hysteresis.record import Record
from validation.practice.hidden import Draw, Family, Hidden, Rng, either_sign
from validation.practice.protocols import Ground


def _lost_counts(rng: Rng, ground: Ground) -> Family:
    """At a few moments the log of the drive loses counts for good, in two records at least."""
    records = len(ground.runs)
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

    def at(size: float) -> Hidden:
        most = 0.2 * ground.full_mm * size

        def drive(index: int, program: LoadProgram) -> LoadProgram:
            real = program.drive_mm.copy()
            for when, part in events[index]:
                real[int(when * real.size) :] += most * part
            return LoadProgram(real, program.time_s, program.cycle)

        return Hidden({"largest_loss_mm": most, "losses": float(sum(map(len, events)))}, drive=drive)

    return Family(at)


def _intermittent_jumps(rng: Rng, ground: Ground) -> Family:
    """Stuck ropes that let go: the angle falls back by a part, at random moments, and recovers after some samples."""
    events = []
    for run in ground.runs:
        samples = run.record.angle_deg.size
        count = int(rng.integers(3, 9))
        starts, lengths = rng.integers(10, samples - 10, count), rng.integers(3, 20, count)
        events.append(list(zip(starts.tolist(), lengths.tolist(), rng.uniform(0.4, 1.0, count).tolist(), strict=True)))

    def at(size: float) -> Hidden:
        most = 5.0 * size

        def seen(index: int, record: Record, angle_deg: Floats) -> Floats:
            jumped = angle_deg.copy()
            for start, length, part in events[index]:
                healing = np.maximum(1 - np.arange(angle_deg.size - start) / length, 0.0)
                jumped[start:] -= most * part * np.sign(angle_deg[start]) * healing
            return jumped

        return Hidden({"largest_jump_deg": most, "jumps": float(sum(map(len, events)))}, seen=seen)

    return Family(at)


def _out_of_plane(rng: Rng, ground: Ground) -> Family:
    """Plane of bending that turns with the way gone and the tension; a camera sees the bend foreshortened.

    The turn waxes and wanes with the path of the angle, at a period that is no part of a cycle, and with the ropes'
    mean tension.
    """
    period_deg, phase = ground.bend_deg * float(rng.uniform(2.3, 9.7)), float(rng.uniform(0.0, 2 * np.pi))

    def at(size: float) -> Hidden:
        most = np.radians(40.0) * size

        def seen(index: int, record: Record, angle_deg: Floats) -> Floats:
            assert record.tension_a_N is not None
            assert record.tension_b_N is not None
            path = np.cumsum(np.abs(np.diff(angle_deg, prepend=angle_deg[0])))
            mean = (record.tension_a_N + record.tension_b_N) / (record.tension_a_N[0] + record.tension_b_N[0])
            turn = most * np.sin(2 * np.pi * path / period_deg + phase) * mean
            theta = np.radians(angle_deg)
            return np.degrees(np.arctan2(np.sin(theta) * np.cos(turn), np.cos(theta)))

        return Hidden({"largest_turn_deg": float(np.degrees(most)), "period_deg": period_deg}, seen=seen)

    return Family(at)


OUTSIDE: dict[str, Draw] = {
    "lost_counts": _lost_counts,
    "intermittent_jumps": _intermittent_jumps,
    "out_of_plane": _out_of_plane,
}
"""Effects that no catalogue has."""
