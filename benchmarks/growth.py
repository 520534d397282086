"""How the cost of this package's engines grows with joints, samples and designs: ``python -m benchmarks.growth``.

The default rig with friction, toe region and material loop. For another number of joints the drive and its step are
scaled with it, so that the joints bend equally and there are always 88 steps. Times are medians, warm.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_models.chain.solve import ChainSettings, solve_batch, solve_chain
from fem_models.load import LoadProgram, triangle
from fem_models.multibody.quasi_static import MultibodySettings, solve_multibody
from fem_models.rig import Rig, preset
from fem_models.rig.rig import Friction, notched_tube, with_notch
from fem_models.spatial.drives import wheel_drives
from fem_models.spatial.parameters import SpatialSettings
from fem_models.spatial.rig import spatial_rig
from fem_models.spatial.solve import solve_spatial

JOINTS = 14
SIZES = (7, 14, 28, 56, 112)
LARGEST_MULTIBODY = 56
CYCLES = (1, 10, 100, 1_000)
DESIGNS = (1, 10, 100, 1_000)
SECONDS, ROUNDS = 2.0, (3, 15)
"""Time for the runs of a median, and how many of them."""


@dataclass(frozen=True)
class Growth:
    """Cost of one engine over sizes: ``seconds`` of a run of each, and the exponent of their fit, log by log."""

    of: str
    sizes: tuple[int, ...]
    seconds: tuple[float, ...]

    @property
    def exponent(self) -> float:
        """Slope of log cost over log size, least squares."""
        return float(np.polyfit(np.log(self.sizes), np.log(self.seconds), 1)[0])


def rig_of(joints: int, *, scaled_tendon: bool = False) -> Rig:
    """Rig of the default preset (friction, toe region and material loop included) with another number of notches.

    With ``scaled_tendon`` the free length of the tendons grows with the tube, so that a step of the drive, which grows
    too, changes the tensions as in the default rig.
    """
    rig = preset("du2018")
    rig = with_notch(rig, replace(notched_tube(rig).notch, count=joints))
    if not scaled_tendon:
        return rig
    tendon = replace(rig.tendon_a, free_length_mm=rig.tendon_a.free_length_mm * joints / JOINTS)
    return replace(rig, tendon_a=tendon, tendon_b=tendon)


def cycle_of(joints: int, cycles: int = 1) -> LoadProgram:
    """Cycles 0, +A, -A, 0 of 88 steps; A is 2.2 mm for 14 joints and proportional to their number."""
    scale = joints / JOINTS
    return LoadProgram(np.tile(triangle(2.2 * scale, step_mm=0.1 * scale).drive_mm[1:89], cycles))


def step_of(joints: int) -> float:
    """Largest step of the drive: one sample for any number of joints."""
    return 0.1 * joints / JOINTS


def batch(count: int, seed: int = 0) -> list[Rig]:
    """Rigs around the default one: preload, modulus, tendon, friction and material loop vary."""
    rng, rig = np.random.default_rng(seed), rig_of(JOINTS)
    low = np.array([10.0, 45.0, 1.0e4, 0.0, 0.0, 0.0, 0.0])
    high = np.array([30.0, 75.0, 3.0e4, 60.0, 0.05, 2.5, 0.5])
    rigs = []
    for preload, young, ea, toe, mu, sheath, share in rng.uniform(low, high, (count, low.size)):
        tendon = replace(rig.tendon_a, EA_N=ea, toe_N=toe)
        material = replace(rig.material, youngs_modulus_GPa=young, loop_share=share)
        friction = Friction(capstan_coefficient=mu, guide_N=0.01, sheath_N=sheath)
        rigs.append(
            replace(rig, preload_N=preload, tendon_a=tendon, tendon_b=tendon, material=material, friction=friction)
        )
    return rigs


def median_s(run: Callable[[], object]) -> float:
    """Time a run, after one that warms it."""
    run()
    times: list[float] = []
    while len(times) < ROUNDS[0] or (sum(times) < SECONDS and len(times) < ROUNDS[1]):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def _in_space(joints: int) -> Callable[[], object]:
    rig, drives = spatial_rig(rig_of(joints)), wheel_drives(cycle_of(joints).drive_mm)
    return lambda: solve_spatial(rig, drives, SpatialSettings(max_step_mm=step_of(joints)))


def _chain(joints: int) -> Callable[[], object]:
    rig, program, settings = rig_of(joints), cycle_of(joints), ChainSettings(max_step_mm=step_of(joints))
    return lambda: solve_chain(rig, program, settings)


def _multibody(joints: int) -> Callable[[], object]:
    rig, program, settings = rig_of(joints), cycle_of(joints), MultibodySettings(max_step_mm=step_of(joints))
    return lambda: solve_multibody(rig, program, settings)


def with_joints() -> list[Growth]:
    """Cost of a cycle of 88 steps over the number of joints."""
    engines = {"chain": _chain, "chain in space": _in_space, "multibody": _multibody}
    return [
        Growth(name, sizes, tuple(median_s(prepared(n)) for n in sizes))
        for name, prepared in engines.items()
        for sizes in [tuple(n for n in SIZES if name != "multibody" or n <= LARGEST_MULTIBODY)]
    ]


def with_samples() -> Growth:
    """Cost of the chain over the number of samples, 88 a cycle."""
    rig, programs = rig_of(JOINTS), [cycle_of(JOINTS, cycles) for cycles in CYCLES]
    samples = tuple(program.drive_mm.size for program in programs)
    return Growth("chain", samples, tuple(median_s(lambda p=program: solve_chain(rig, p)) for program in programs))


def with_designs() -> Growth:
    """Cost of the chain over the number of designs in one call."""
    rigs, program = batch(max(DESIGNS)), cycle_of(JOINTS)
    return Growth("chain", DESIGNS, tuple(median_s(lambda n=n: solve_batch(rigs[:n], program)) for n in DESIGNS))


def rows(found: Sequence[Growth]) -> list[list[str]]:
    """Format growths of the same sizes, a row each; the exponent stands last."""
    most = max((one.sizes for one in found), key=len)
    return [
        [
            one.of,
            *(_ms(one.seconds[one.sizes.index(n)]) if n in one.sizes else "-" for n in most),
            f"{one.exponent:.2f}",
        ]
        for one in found
    ]


def _ms(seconds: float) -> str:
    digits = max(0, 1 - math.floor(math.log10(1e3 * seconds)))
    return f"{1e3 * seconds:,.{digits}f}"


if __name__ == "__main__":
    for found in ([*with_joints()], [with_samples()], [with_designs()]):
        sys.stdout.write(f"sizes {max((one.sizes for one in found), key=len)}, ms, exponent\n")
        sys.stdout.writelines("  " + ", ".join(row) + "\n" for row in rows(found))
