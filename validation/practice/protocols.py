"""What is recorded on a practice rig: a rig near the declared one, and four records of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fem_models.chain.solve import ChainSolution, solve_chain
from fem_models.load import LoadProgram, sine
from fem_models.rig import Rig, preset
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material, Tendon, Wheel
from hysteresis.arrays import Floats

Kind = Literal["known", "unknown"]
KINDS: tuple[Kind, ...] = ("known", "unknown")

PRELOADS_N = (20.0, 10.0)
BEND_DEG = (25.0, 45.0)  # of the full amplitude
NOISE_DEG = (0.02, 0.06)
SLOW_HZ = (0.05, 0.2)
FASTER = (5.0, 15.0)  # the fast rate over the slow one
ZERO_DEG = 0.1  # standard deviation of a record's zero: the camera is set up anew
SPREAD = 0.3  # of the rig's constants about what is declared
SAMPLES_PER_CYCLE = 88


@dataclass(frozen=True)
class Loading:
    """One record to make: preload and load program."""

    preload_N: float
    program: LoadProgram


@dataclass(frozen=True)
class Protocol:
    """A rig without any hidden effect, and what is recorded on it.

    Parameters
    ----------
    rig
        The truth but for hidden effects, at 20 N.
    table
        What the sidecar's ``[rig]`` says besides the preload: nominal constants, not the true ones.
    loadings
        Two preloads, two rates, two amplitudes in four records; the first is of 20 N, slow and full.
    noise_deg
        Standard deviation of the angle's white noise.
    zeros_deg
        Zero of the angle, one a record.
    counted
        Whether the records tell the number of the cycle.
    """

    rig: Rig
    table: Mapping[str, float | str]
    loadings: tuple[Loading, ...]
    noise_deg: float
    zeros_deg: tuple[float, ...]
    counted: bool

    def rig_at(self, preload_N: float) -> Rig:
        """Give the rig at another preload."""
        return replace(self.rig, preload_N=preload_N)


@dataclass(frozen=True)
class Ground:
    """A protocol with what the chain makes of it, one solution a record: the ground that effects are judged from."""

    protocol: Protocol
    runs: tuple[ChainSolution, ...]

    @property
    def full_mm(self) -> float:
        """Largest drive."""
        return float(np.abs(self.protocol.loadings[0].program.drive_mm).max())

    @property
    def bend_deg(self) -> float:
        """Largest bend."""
        return float(np.abs(self.runs[0].record.angle_deg).max())

    @property
    def longest_s(self) -> float:
        """Duration of the longest record."""
        return max(float(times(loading.program)[-1]) for loading in self.protocol.loadings)


def times(program: LoadProgram) -> Floats:
    """Give the times of a program that has them, shape (m,)."""
    assert program.time_s is not None
    return program.time_s


def draw_ground(rng: np.random.Generator, *, measured_joints: bool) -> Ground:
    """Draw a rig near the preset, or one of measured joints, and its records; run it without hidden effects.

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
    fast_Hz = round(slow_Hz * float(rng.uniform(*FASTER)), 3)
    cycles = int(rng.integers(3, 6))
    high, low = PRELOADS_N
    last = ((high, slow_Hz), (low, fast_Hz))[int(rng.integers(2))]
    wanted = [(high, slow_Hz, full), (low, slow_Hz, full), (high, fast_Hz, full), (*last, round(full / 2, 2))]
    protocol = Protocol(
        rig=rig,
        table=table,
        loadings=tuple(Loading(preload, _program(amplitude, rate, cycles)) for preload, rate, amplitude in wanted),
        noise_deg=round(float(rng.uniform(*NOISE_DEG)), 4),
        zeros_deg=tuple(float(z) for z in rng.normal(0.0, ZERO_DEG, len(wanted))),
        counted=bool(rng.integers(2)),
    )
    runs = tuple(solve_chain(protocol.rig_at(one.preload_N), one.program) for one in protocol.loadings)
    return Ground(protocol, runs)


def _program(amplitude_mm: float, rate_Hz: float, cycles: int) -> LoadProgram:
    """Make a sine as a logger writes it: to 0.1 um and 1 us."""
    exact = sine(amplitude_mm, rate_Hz, cycles=cycles, samples_per_cycle=SAMPLES_PER_CYCLE)
    return LoadProgram(np.round(exact.drive_mm, 4), np.round(times(exact), 6), exact.cycle)


def _near(rng: np.random.Generator, nominal: float) -> float:
    return nominal * float(rng.uniform(1 - SPREAD, 1 + SPREAD))


def _preset_rig(rng: np.random.Generator) -> tuple[Rig, dict[str, float | str]]:
    rig = preset("du2018", preload_N=PRELOADS_N[0])
    dry, nitinol = rig.friction, rig.material
    rope = replace(rig.tendon_a, EA_N=_near(rng, rig.tendon_a.EA_N))
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
        tendon_a=rope,
        tendon_b=rope,
    )
    return true, {"preset": rig.name}


def _measured_rig(rng: np.random.Generator) -> tuple[Rig, dict[str, float | str]]:
    """Joints measured on a bench: friction and material loop are not, nor is the rope's stiffness exactly."""
    joints = int(rng.integers(7, 21))
    arm, pitch = round(float(rng.uniform(1.8, 3.2)), 2), round(float(rng.uniform(2.0, 3.5)), 1)
    stiffness, free = round(float(rng.uniform(25.0, 45.0)) * joints), round(float(rng.uniform(100.0, 220.0)))
    nominal_EA = round(float(rng.uniform(8_000.0, 20_000.0)), -2)
    rope = Tendon(_near(rng, nominal_EA), moment_arm_mm=arm, free_length_mm=free)
    joint_deg = np.mean(BEND_DEG) / joints
    true = Rig(
        name="practice",
        material=Material(
            youngs_modulus_GPa=60.0,
            poissons_ratio=0.33,
            loop_share=float(rng.uniform(0.1, 0.5)),
            loop_angle_deg=float(joint_deg * rng.uniform(0.4, 0.9)),
        ),
        tendon_a=rope,
        tendon_b=rope,
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
    """Drive that bends the rig so far, to 0.01 mm: bending is nearly proportional, two corrections do."""
    amplitude = float(np.radians(bend_deg)) * rig.tendon_a.moment_arm_mm
    for _ in range(2):
        way = LoadProgram(np.linspace(0.0, amplitude, 30))
        amplitude *= bend_deg / float(solve_chain(rig, way).record.angle_deg[-1])
    return round(amplitude, 2)
