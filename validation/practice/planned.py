"""Plan of a practice record: preload, amplitude, rate and shape of the drive, and the load program that it makes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fem_models.load import LoadProgram

Shape = Literal["sine", "triangle", "chirp", "shrinking", "growing"]

CHIRP_FACTOR = 4.0
"""Rate at the end of a chirp over the one at its beginning."""
LEAST_ENVELOPE = 0.2
"""Amplitude at the small end of a shrinking or growing sine, over the full one."""


@dataclass(frozen=True)
class Planned:
    """One record to make. ``rate_Hz`` of a chirp is that at its beginning."""

    preload_N: float
    amplitude_mm: float
    rate_Hz: float
    cycles: int
    samples_per_cycle: int
    shape: Shape = "sine"


PlanChange = Callable[[Sequence[Planned], np.random.Generator], Sequence[Planned]]
"""Makes other plans of the usual ones of a rig."""


def program_of(plan: Planned) -> LoadProgram:
    """Make the load program of a plan, as a data logger writes it: to 0.1 um and 1 us.

    It starts at zero drive. A quarter of a cycle, which is cycle 0, is followed by the cycles. The phase p of a chirp,
    in cycles, is f t + (k - 1) f t^2 / 2 T, whose rate grows from f to k f in the time T.
    """
    in_all = plan.cycles + 0.25
    count = round(in_all * plan.samples_per_cycle)
    steps = np.arange(count + 1) / count
    if plan.shape == "chirp":
        mean_rate = 0.5 * (1.0 + CHIRP_FACTOR)
        time = steps * in_all / (mean_rate * plan.rate_Hz)
        phase = in_all * steps * (1.0 + 0.5 * (CHIRP_FACTOR - 1.0) * steps) / mean_rate
    else:
        phase = in_all * steps
        time = phase / plan.rate_Hz
    wave = np.sin(2 * np.pi * phase)
    if plan.shape == "triangle":
        wave = 2 / np.pi * np.arcsin(wave)
    elif plan.shape in ("shrinking", "growing"):
        along = steps if plan.shape == "shrinking" else 1.0 - steps
        wave = wave * (1.0 - (1.0 - LEAST_ENVELOPE) * along)
    cycle = np.maximum(np.ceil(phase - 0.25 - 1e-9), 0).astype(np.int64)
    return LoadProgram(np.round(plan.amplitude_mm * wave, 4), np.round(time, 6), cycle)
