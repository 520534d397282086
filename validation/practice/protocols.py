"""Protocol of a practice case: a rig near the nominal one, and four records of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fem_models.chain import solve_chain
from fem_models.chain.solve import ChainSolution
from fem_models.load import LoadProgram, sine
from fem_models.rig import Rig, preset
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material, Tendon, Wheel
from hysteresis.arrays import Floats
from validation.practice.planned import PlanChange, Planned, program_of

Kind = Literal["known", "unknown"]
KINDS: tuple[Kind, ...] = ("known", "unknown")

PRELOADS_N = (20.0, 10.0)
BEND_DEG = (25.0, 45.0)
"""Range of the bending at full amplitude."""
NOISE_DEG = (0.02, 0.06)
SLOW_HZ = (0.05, 0.2)
FAST_OVER_SLOW = (5.0, 15.0)
"""Range of the ratio of the two rates."""
ZERO_DEG = 0.1
"""Standard deviation of a record's zero: the camera is set up again for each record."""
SPREAD = 0.3
"""Largest relative deviation of the rig's parameters from the nominal ones."""
SAMPLES_PER_CYCLE = 88


@dataclass(frozen=True)
class Loading:
    """Preload and load program of one record."""

    preload_N: float
    program: LoadProgram


@dataclass(frozen=True)
class Protocol:
    """A rig without injected effects, and the records to make of it.

    Parameters
    ----------
    rig
        True rig without injected effects, at 20 N.
    table
        ``[rig]`` of the sidecar except for the preload: nominal parameters, not the true ones.
    loadings
        Usually four records with two preloads, two rates and two amplitudes; the first is slow, at 20 N and full
        amplitude.
    noise_deg
        Standard deviation of the white noise of the angle.
    zeros_deg
        Zero of the angle, one per record.
    counted
        Whether the records contain the number of the cycle.
    """

    rig: Rig
    table: Mapping[str, float | str]
    loadings: tuple[Loading, ...]
    noise_deg: float
    zeros_deg: tuple[float, ...]
    counted: bool

    def rig_at(self, preload_N: float) -> Rig:
        """Rig at another preload."""
        return replace(self.rig, preload_N=preload_N)


@dataclass(frozen=True)
class BaselineRuns:
    """A protocol with its runs by the chain, one per record, without injected effects."""

    protocol: Protocol
    runs: tuple[ChainSolution, ...]

    @property
    def full_mm(self) -> float:
        """Largest drive."""
        return float(np.abs(self.protocol.loadings[0].program.drive_mm).max())

    @property
    def bend_deg(self) -> float:
        """Largest bending."""
        return float(np.abs(self.runs[0].record.angle_deg).max())

    @property
    def longest_s(self) -> float:
        """Duration of the longest record."""
        return max(float(times(loading.program)[-1]) for loading in self.protocol.loadings)

    @property
    def cycle_s(self) -> float:
        """Duration of a cycle of the slowest record; a quarter of one is before the first."""
        return max(_cycle_s(loading.program) for loading in self.protocol.loadings)


def times(program: LoadProgram) -> Floats:
    """Give the times of a program that has times, shape (m,)."""
    assert program.time_s is not None
    return program.time_s


def _cycle_s(program: LoadProgram) -> float:
    """Mean duration of a cycle (s)."""
    assert program.cycle is not None
    return float(times(program)[-1]) / (int(program.cycle.max()) + 0.25)


def draw_baseline(rng: np.random.Generator, *, measured_joints: bool, change: PlanChange | None = None) -> BaselineRuns:
    """Draw a rig near the preset, or one with measured joints, and its records; run it without injected effects.

    ``change`` makes other plans of the usual ones, which are four sines.

    Raises
    ------
    SolverError
        From :func:`fem_models.chain.solve.solve_chain`.
    """
    rig, table = _measured_rig(rng) if measured_joints else _preset_rig(rng)
    bend = rng.uniform(*BEND_DEG)
    full = _amplitude_mm(rig, bend)
    slow = float(rng.uniform(*np.log(SLOW_HZ)))
    slow_Hz = round(float(np.exp(slow)), 3)
    fast_Hz = round(slow_Hz * float(rng.uniform(*FAST_OVER_SLOW)), 3)
    cycles = int(rng.integers(3, 6))
    high, low = PRELOADS_N
    last = ((high, slow_Hz), (low, fast_Hz))[int(rng.integers(2))]
    wanted = [(high, slow_Hz, full), (low, slow_Hz, full), (high, fast_Hz, full), (*last, round(full / 2, 2))]
    if change is None:
        loadings = tuple(Loading(preload, _program(amplitude, rate, cycles)) for preload, rate, amplitude in wanted)
    else:
        usual = [Planned(preload, size, rate, cycles, SAMPLES_PER_CYCLE) for preload, rate, size in wanted]
        loadings = tuple(Loading(plan.preload_N, program_of(plan)) for plan in change(usual, rng))
    protocol = Protocol(
        rig=rig,
        table=table,
        loadings=loadings,
        noise_deg=round(float(rng.uniform(*NOISE_DEG)), 4),
        zeros_deg=tuple(float(z) for z in rng.normal(0.0, ZERO_DEG, len(loadings))),
        counted=bool(rng.integers(2)),
    )
    runs = tuple(solve_chain(protocol.rig_at(one.preload_N), one.program) for one in protocol.loadings)
    return BaselineRuns(protocol, runs)


def _program(amplitude_mm: float, rate_Hz: float, cycles: int) -> LoadProgram:
    """Sine as a data logger writes it: to 0.1 um and 1 us."""
    exact = sine(amplitude_mm, rate_Hz, cycles=cycles, samples_per_cycle=SAMPLES_PER_CYCLE)
    return LoadProgram(np.round(exact.drive_mm, 4), np.round(times(exact), 6), exact.cycle)


def _near(rng: np.random.Generator, nominal: float) -> float:
    return nominal * float(rng.uniform(1 - SPREAD, 1 + SPREAD))


def _preset_rig(rng: np.random.Generator) -> tuple[Rig, dict[str, float | str]]:
    rig = preset("du2018-full-widths", preload_N=PRELOADS_N[0])
    dry, nitinol = rig.friction, rig.material
    tendon = replace(rig.tendon_a, EA_N=_near(rng, rig.tendon_a.EA_N))
    true = replace(
        rig,
        name="practice",
        material=replace(
            nitinol,
            loop_share=_near(rng, nitinol.loop_share),
            loop_angle_deg=_near(rng, nitinol.loop_angle_deg),
        ),
        friction=replace(
            dry, sheath_N=_near(rng, dry.sheath_N), capstan_coefficient=_near(rng, dry.capstan_coefficient)
        ),
        tendon_a=tendon,
        tendon_b=tendon,
    )
    return true, {"preset": rig.name}


def _measured_rig(rng: np.random.Generator) -> tuple[Rig, dict[str, float | str]]:
    """Rig with measured joints; friction and material loop are unknown, the stiffness of the tendons is inexact."""
    joints = int(rng.integers(7, 21))
    arm, pitch = round(float(rng.uniform(1.8, 3.2)), 2), round(float(rng.uniform(2.0, 3.5)), 1)
    stiffness, free = round(float(rng.uniform(25.0, 45.0)) * joints), round(float(rng.uniform(100.0, 220.0)))
    nominal_EA = round(float(rng.uniform(8_000.0, 20_000.0)), -2)
    tendon = Tendon(_near(rng, nominal_EA), moment_arm_mm=arm, free_length_mm=free)
    joint_deg = np.mean(BEND_DEG) / joints
    true = Rig(
        name="practice",
        material=Material(
            youngs_modulus_GPa=60.0,
            poissons_ratio=0.33,
            loop_share=float(rng.uniform(0.1, 0.5)),
            loop_angle_deg=float(joint_deg * rng.uniform(0.4, 0.9)),
        ),
        tendon_a=tendon,
        tendon_b=tendon,
        wheel=Wheel(radius_mm=10.0),
        preload_N=PRELOADS_N[0],
        friction=Friction(
            capstan_coefficient=float(rng.uniform(0.02, 0.1)), guide_N=0.0, sheath_N=float(rng.uniform(0.4, 1.8))
        ),
        joint=MeasuredJoint(joints, pitch, stiffness),
    )
    table: dict[str, float | str] = {
        "joints": joints,
        "moment_arm_mm": arm,
        "flexure_stiffness_Nmm_per_rad": stiffness,
        "tendon_EA_N": nominal_EA,
        "tendon_free_length_mm": free,
        "pitch_mm": pitch,
    }
    return true, table


def _amplitude_mm(rig: Rig, bend_deg: float) -> float:
    """Drive for a bending, rounded to 0.01 mm; two corrections suffice, because bending is nearly proportional."""
    amplitude = float(np.radians(bend_deg)) * rig.tendon_a.moment_arm_mm
    for _ in range(2):
        ramp = LoadProgram(np.linspace(0.0, amplitude, 30))
        amplitude *= bend_deg / float(solve_chain(rig, ramp).record.angle_deg[-1])
    return round(amplitude, 2)
