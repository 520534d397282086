"""Compensation in the mechanical model: the drive from an identified layer, run in the multibody model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fem_models.chain import simulate_chain
from fem_models.load import LoadProgram
from fem_models.rig import Rig, preset
from hysteresis import Fit, Record, identify
from hysteresis.arrays import Floats
from hysteresis.inverse import compensating_drive, uncompensated_drive
from hysteresis.settings import IdentifySettings

Engine = Callable[[Rig, LoadProgram], Record]

AMPLITUDES_MM = (1.8, 1.4, 1.0)
"""Amplitudes of the loops that identify the layer. They cover the references and show how h depends on amplitude."""
STEP_MM = 0.05


@dataclass(frozen=True)
class Tracking:
    """Tracking errors with and without compensation: root mean square over a reference, deg."""

    with_deg: float
    without_deg: float

    @property
    def ratio(self) -> float:
        """Error without compensation over the error with it."""
        return self.without_deg / self.with_deg


@dataclass(frozen=True)
class Trial:
    """Tracking of one reference by one layer; ``loops_of`` is the engine whose loops identified the layer."""

    loops_of: str
    elements: int
    reference: str
    tracking: Tracking


def shrinking_loops(amplitudes_mm: tuple[float, ...] = AMPLITUDES_MM) -> LoadProgram:
    """Drive from rest to +A, then to -A and +A, for each amplitude in turn."""
    reversals = [0.0, *(x for a in amplitudes_mm for x in (a, -a, a))]
    pieces = [np.zeros(1)]
    for start, end in pairwise(reversals):
        pieces.append(np.linspace(start, end, int(np.ceil(abs(end - start) / STEP_MM - 1e-9)) + 1)[1:])
    return LoadProgram(np.concatenate(pieces))


def references() -> dict[str, Floats]:
    """Give reference angles from rest: two cycles of a triangle of +-30 deg, and a sine that decays from 30 deg."""
    k = np.arange(241)
    triangle = 30 * (1 - np.abs((k / 30 + 1) % 4 - 2))
    time = np.linspace(0, 6, 361)
    return {"triangle of +-30 deg": triangle, "decaying sine": 30 * np.exp(-time / 3) * np.sin(2 * np.pi * time)}


def identify_layer(rig: Rig, engine: Engine, elements: int | None = None) -> Fit:
    """Identify f + h on shrinking loops of a rig; f is fitted to the loops, as for a real rig."""
    return identify(engine(rig, shrinking_loops()), settings=IdentifySettings(elements=elements))


def track(fit: Fit, rig: Rig, reference_deg: Floats, engine: Engine) -> Tracking:
    """Run the drives with and without compensation from rest, and compare their angles with the reference."""

    def error(drive: Floats) -> float:
        angle = engine(rig, LoadProgram(np.append(0.0, drive))).angle_deg[1:]
        return float(np.sqrt(np.mean((angle - reference_deg) ** 2)))

    drive, plain = compensating_drive(fit, reference_deg, 0.0), uncompensated_drive(fit, reference_deg)
    return Tracking(error(drive), error(plain))


def trials() -> list[Trial]:
    """Track both references in the multibody model with layers of one and two elements from loops of both engines."""
    from fem_models.multibody import simulate_multibody  # loads Exudyn

    rig, found = preset("du2018", preload_N=20.0), []
    for name, engine in (("multibody model", simulate_multibody), ("chain", simulate_chain)):
        for elements in (1, 2):
            fit = identify_layer(rig, engine, elements)
            for reference, angle_deg in references().items():
                found.append(Trial(name, elements, reference, track(fit, rig, angle_deg, simulate_multibody)))
    return found
