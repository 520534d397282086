"""Protocols that tell less than the usual four records, or that have another shape than a sine of one amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from validation.practice.planned import PlanChange, Planned, Shape

SAMPLES_PER_CYCLE = (40, 500)
"""From a camera's stills to a fast logger."""

Rng = np.random.Generator


def _one_record(usual: Sequence[Planned], rng: Rng) -> Sequence[Planned]:
    return usual[:1]


def _one_cycle(usual: Sequence[Planned], rng: Rng) -> Sequence[Planned]:
    return [replace(plan, cycles=1) for plan in usual]


def _one_preload(usual: Sequence[Planned], rng: Rng) -> Sequence[Planned]:
    return [replace(plan, preload_N=usual[0].preload_N) for plan in usual]


def _two_rates(usual: Sequence[Planned], rng: Rng) -> Sequence[Planned]:
    """Keep the first record, and one of the same preload and amplitude at another rate."""
    first = usual[0]
    other = next(plan for plan in usual if plan.rate_Hz != first.rate_Hz)
    return [first, replace(first, rate_Hz=other.rate_Hz)]


def _sampling(usual: Sequence[Planned], rng: Rng) -> Sequence[Planned]:
    low, high = np.log(SAMPLES_PER_CYCLE)
    return [replace(plan, samples_per_cycle=round(float(np.exp(rng.uniform(low, high))))) for plan in usual]


def _of_shape(shape: Shape) -> PlanChange:
    def change(usual: Sequence[Planned], rng: Rng) -> Sequence[Planned]:
        return [replace(plan, shape=shape) for plan in usual]

    return change


PLANS: dict[str, PlanChange] = {
    "one_record": _one_record,
    "one_cycle": _one_cycle,
    "one_preload": _one_preload,
    "two_rates": _two_rates,
    "sampling": _sampling,
    "triangle": _of_shape("triangle"),
    "chirp": _of_shape("chirp"),
    "shrinking": _of_shape("shrinking"),
    "growing": _of_shape("growing"),
}
"""By name."""
