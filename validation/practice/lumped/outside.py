"""Records of the lumped rig with a fault that no catalogue has: the right verdict is ``unexplained``.

Only labels of clean records change, as in :mod:`validation.practice.hidden.labels`; sizes are those of the effects.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from validation.practice.draw import Case, with_white_noise
from validation.practice.hidden.labels import leapt, lost
from validation.practice.lumped.cases import CLEAN, SIZES, Rng, draw_lumped_noiseless

AT = (0.25, 0.75)
"""Instants of a fault, over the duration of a record."""
JUMPS, JUMP_SAMPLES = (3, 9), (3, 20)
"""Number of passing jumps in a record, and samples after which the angle is back; from and below."""

Fault = Callable[[Record, float, Rng], Record]
"""From a clean record and the root mean square change of its angle, deg."""


def _leap(record: Record, size_deg: float, rng: Rng) -> Record:
    at = float(rng.uniform(*AT))
    return leapt(record, at, float(rng.choice([-1.0, 1.0])) * size_deg / np.sqrt(at * (1 - at)))


def _lost_counts(record: Record, size_deg: float, rng: Rng) -> Record:
    at = float(rng.uniform(*AT))
    slope = float(np.polyfit(record.drive, record.angle_deg, 1)[0])
    return lost(record, at, float(rng.choice([-1.0, 1.0])) * size_deg / abs(slope) / np.sqrt(at * (1 - at)))


def _jumps(record: Record, size_deg: float, rng: Rng) -> Record:
    """Tendons stick and release: the angle falls back at random moments, and recovers."""
    count, shape = record.angle_deg.size, np.zeros(record.angle_deg.size)
    for _ in range(int(rng.integers(*JUMPS))):
        start, length = int(rng.integers(10, count - 10)), int(rng.integers(*JUMP_SAMPLES))
        part = float(rng.uniform(0.4, 1.0)) * float(np.sign(record.angle_deg[start]))
        shape[start:] -= part * np.maximum(1 - np.arange(count - start) / length, 0.0)
    jumped: Floats = record.angle_deg + size_deg * shape / max(float(np.std(shape)), 1e-12)
    return replace(record, angle_deg=jumped)


LUMPED_OUTSIDE: Mapping[str, Fault] = {"lost_counts": _lost_counts, "leap": _leap, "intermittent_jumps": _jumps}
"""By name."""


def draw_lumped_outside(seed: int, kind: str, label: str, number: int) -> Case:
    """Draw a case with a fault in each record; the same arguments give the same records."""
    noiseless, noise = draw_lumped_noiseless(seed, kind, CLEAN, number)
    rng = np.random.default_rng((seed, zlib.crc32(f"{kind} {label}".encode()), number))
    ratio = float(rng.uniform(*SIZES))
    records: Sequence[Record] = [
        LUMPED_OUTSIDE[label](one, ratio * noiseless.truth.noise_deg, rng) for one in noiseless.records
    ]
    truth = replace(noiseless.truth, effects=(label,), ratios=(ratio,))
    return with_white_noise(
        replace(noiseless, name=f"{label}-{number:02d}", records=tuple(records), truth=truth), noise
    )
