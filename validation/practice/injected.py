"""Injected effects: how an effect of a given size changes the rig, the true drive or the observed angle."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fem_models.chain import simulate_chain
from fem_models.load import LoadProgram
from fem_models.rig import Rig
from hysteresis import Record
from hysteresis.arrays import Floats
from validation.practice.protocols import BaselineRuns, Protocol

Engine = Callable[[Rig, LoadProgram], Record]


def _unchanged(rig: Rig) -> Rig:
    return rig


def _as_logged(index: int, program: LoadProgram) -> LoadProgram:
    return program


def _as_simulated(index: int, record: Record, angle_deg: Floats) -> Floats:
    return angle_deg


@dataclass(frozen=True)
class Injected:
    """An effect of a given size.

    Parameters
    ----------
    numbers
        Parameters of the effect, with units in the names.
    rig
        Adds the effect to a rig.
    drive
        True drive of the wheel, from the index of the record and the logged program.
    observe
        Observed angle, from the index of the record, the run and the angle before this effect; shape (m,) -> (m,).
    """

    numbers: Mapping[str, float]
    rig: Callable[[Rig], Rig] = _unchanged
    drive: Callable[[int, LoadProgram], LoadProgram] = _as_logged
    observe: Callable[[int, Record, Floats], Floats] = _as_simulated


@dataclass(frozen=True)
class Family:
    """An effect with random character: ``at(size)`` for plausible sizes, from ``least`` to 1."""

    at: Callable[[float], Injected]
    least: float = field(default=1e-4)


Rng = np.random.Generator
Draw = Callable[[Rng, BaselineRuns], Family]


def either_sign(rng: Rng) -> float:
    """Draw 1 or -1."""
    return float(rng.choice([-1.0, 1.0]))


def observed(protocol: Protocol, injected: Sequence[Injected], engine: Engine = simulate_chain) -> list[Floats]:
    """Angles with effects in the given order, without noise and zero, deg, one array per record."""
    angles = []
    for index, loading in enumerate(protocol.loadings):
        rig, program = protocol.rig_at(loading.preload_N), loading.program
        for one in injected:
            rig, program = one.rig(rig), one.drive(index, program)
        run = engine(rig, program)
        angle = run.angle_deg
        for one in injected:
            angle = one.observe(index, run, angle)
        angles.append(angle)
    return angles
