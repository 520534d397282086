"""Search for the smallest size of an effect that is found in nine cases of ten.

Sizes are those of :mod:`validation.practice.size`: what an effect adds to the angle beyond what the parameters of a
known rig can absorb, root mean square over the noise. They are tried on a ladder with steps of the square root of two.
The records are shorter than those of the other scores: four of two cycles, 40 samples a cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_models.rig.checks import SolverError
from validation.practice.benchmark.sizes import size_of
from validation.practice.draw import CLEAN, Case, draw_noiseless, with_white_noise
from validation.practice.outcome import Answer, Outcome
from validation.practice.planned import Planned
from validation.practice.protocols import Kind
from validation.practice.score import outcome_of

LADDER = tuple(round(0.5 * 2 ** (k / 2), 2) for k in range(9))
"""Sizes that are tried, over the noise: 0.5 to 8."""
FIRST = LADDER.index(1.0)
CASES, NEEDED = 10, 9
CYCLES, SAMPLES = 2, 40

Tracer = Callable[[Case], Answer]


@dataclass(frozen=True)
class Tried:
    """Cases of one size: how many were traced before it was decided, how many of these were found, named first.

    ``sizes`` has the effect's main constant in each, ``left`` what the baseline alone leaves on held-out data, over the
    noise. An equivalent rig may leave little of a large size: its parameters absorb an effect beyond first order, too.
    """

    ratio: float
    cases: int
    found: int
    first: int
    sizes: tuple[float, ...]
    left: tuple[float, ...] = ()

    @property
    def is_found(self) -> bool:
        """Whether nine of ten cases were found."""
        return self.found >= NEEDED

    @property
    def is_missed(self) -> bool:
        """Whether two cases were missed; neither, where the bounds of the effect do not reach the size."""
        return self.cases - self.found > CASES - NEEDED


@dataclass(frozen=True)
class Smallest:
    """The smallest size of an effect that is found, and all that were tried.

    Parameters
    ----------
    effect, kind
        Its name; whether the sidecar describes the rig.
    ratio
        Size over the noise; None where not even the largest one that the bounds of the effect reach is found.
    constant
        Median of the effect's main constant at that size (:func:`validation.practice.benchmark.sizes.size_of`); None
        where the effect has none.
    tried
        In the order in which they were tried.
    """

    effect: str
    kind: Kind
    ratio: float | None
    constant: float | None
    tried: tuple[Tried, ...]


def find_smallest(effect: str, kind: Kind, seed: int, tracer: Tracer) -> Smallest:
    """Go up the ladder from the size of the noise until a size is found; halve what is below the first one, if found.

    Most effects are found there or a rung above, and sizes that are missed take few cases. A size above one that is
    found is taken for found, one below one that is missed for missed. Above a size that the bounds of the effect do not
    reach, none is tried.
    """
    tried: dict[int, Tried] = {}
    missed, least, middle = -1, len(LADDER), FIRST
    while missed + 1 < least:
        tried[middle] = one = _try(effect, kind, seed, LADDER[middle], tracer)
        if one.is_missed:
            missed = middle
        else:
            least = middle
        middle = (missed + least + 1) // 2 if missed < FIRST else missed + 1
    if least not in tried or not tried[least].is_found:
        return Smallest(effect, kind, None, None, tuple(tried.values()))
    sizes = tried[least].sizes
    constant = float(np.median(np.abs(sizes))) if sizes else None
    return Smallest(effect, kind, LADDER[least], constant, tuple(tried.values()))


def false_alarms(kind: Kind, seed: int, cases: int, tracer: Tracer) -> tuple[int, int]:
    """Count clean cases of the same protocol in which an effect is named, and all of them."""
    outcomes = [_outcome(CLEAN, kind, seed, number, None, tracer) for number in range(cases)]
    return sum(one.names_falsely for one in outcomes if one), sum(one is not None for one in outcomes)


def short(usual: Sequence[Planned], rng: np.random.Generator) -> Sequence[Planned]:
    """Plan the usual four records with fewer cycles and samples."""
    return [replace(plan, cycles=CYCLES, samples_per_cycle=SAMPLES) for plan in usual]


def _try(effect: str, kind: Kind, seed: int, ratio: float, tracer: Tracer) -> Tried:
    """Trace cases of one size until it is decided whether nine of ten are found.

    Where the bounds of an effect do not reach a size, the case is none; with two such the size is not decided.
    """
    cases = found = first = beyond = 0
    sizes: list[float] = []
    left: list[float] = []
    for number in range(CASES):
        one = _outcome(effect, kind, seed, number, ratio, tracer)
        if one is None:
            beyond += 1
            if beyond > CASES - NEEDED:
                break
            continue
        cases += 1
        found += one.within_set
        first += one.first_right
        numbers: Mapping[str, float] = one.numbers.get(effect, {})
        size = size_of(effect, numbers, kind)
        sizes += [] if size is None else [size]
        left += [] if one.before_deg is None else [one.before_deg / one.noise_deg]
        if found >= NEEDED or cases - found > CASES - NEEDED:
            break
    return Tried(ratio, cases, found, first, tuple(sizes), tuple(left))


def _outcome(label: str, kind: Kind, seed: int, number: int, ratio: float | None, tracer: Tracer) -> Outcome | None:
    try:
        noiseless, rng = draw_noiseless(seed, kind, label, number, short, ratio)
    except SolverError:
        return None
    case = with_white_noise(noiseless, rng)
    return outcome_of(label, case, tracer(case), 0.0)
