"""Compensation in the mechanical model: the drive from an identified layer, run in the multibody model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fem_models.chain import simulate_chain
from fem_models.joint.friction import scaled_friction
from fem_models.load import LoadProgram
from fem_models.rig import Rig, preset
from hysteresis import Fit, Record, identify
from hysteresis.arrays import Floats
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.laws.inverse import compensating_drive, uncompensated_drive

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
class Disturbance:
    """What differs from the ideal case: noise of the loops that identify the layer, and the rig that is then driven."""

    name: str
    noise_deg: float = 0.0
    preload_N: float = 20.0
    friction: float = 1.0  # factor on all dry friction

    def rig(self, preset_name: str = "du2018-full-widths") -> Rig:
        """Rig that is driven."""
        rig = preset(preset_name, preload_N=self.preload_N)
        return replace(rig, friction=scaled_friction(rig.friction, self.friction))


DISTURBANCES = (
    Disturbance("none"),
    *(Disturbance(f"noise of {noise:g} deg", noise_deg=noise) for noise in (0.05, 0.2, 0.5)),
    *(Disturbance(f"preload of {preload:g} N", preload_N=preload) for preload in (18.0, 15.0, 10.0)),
    Disturbance("30 % more friction", friction=1.3),
)
"""The layer is identified at 20 N in each case."""


@dataclass(frozen=True)
class DisturbedTrial:
    """Tracking of one reference by a layer that was identified on a rig or with noise other than is driven."""

    disturbance: str
    reference: str
    tracking: Tracking


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


def noisy(record: Record, noise_deg: float, seed: int = 0) -> Record:
    """Add white noise to the angle of a record."""
    noise = np.random.default_rng(seed).normal(0.0, noise_deg, record.angle_deg.size) if noise_deg else 0.0
    return replace(record, angle_deg=record.angle_deg + noise)


def disturbed_trials(elements: int = 2) -> list[DisturbedTrial]:
    """Track both references beside the ideal case, on the chain: with noise, another preload, and more friction."""
    found, ideal = [], preset("du2018-full-widths", preload_N=20.0)
    for one in DISTURBANCES:

        def noisy_chain(rig: Rig, program: LoadProgram, noise_deg: float = one.noise_deg) -> Record:
            return noisy(simulate_chain(rig, program), noise_deg)

        fit = identify_layer(ideal, noisy_chain, elements)
        for reference, angle_deg in references().items():
            found.append(DisturbedTrial(one.name, reference, track(fit, one.rig(), angle_deg, simulate_chain)))
    return found


def trials() -> list[Trial]:
    """Track both references in the multibody model with layers of one and two elements from loops of both engines."""
    from fem_models.multibody import simulate_multibody  # loads Exudyn

    rig, found = preset("du2018-full-widths", preload_N=20.0), []
    for name, engine in (("multibody model", simulate_multibody), ("chain", simulate_chain)):
        for elements in (1, 2):
            fit = identify_layer(rig, engine, elements)
            for reference, angle_deg in references().items():
                found.append(Trial(name, elements, reference, track(fit, rig, angle_deg, simulate_multibody)))
    return found
