"""Random rigs with everything that both engines know: ``python -m validation.engines.checks.random_rigs 500 60``.

The command runs as many in the chain, and some of them in the multibody model, and prints those that fail or differ.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from fem_models.chain.solve import simulate_chain
from fem_models.load import LoadProgram, triangle
from fem_models.multibody.quasi_static import simulate_multibody
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Backlash, Closure, Stribeck, Superelastic, TipLoad, TipMass
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, NotchShape, Tube
from fem_models.rig.rig import Friction, Material, Tendon, Wheel
from hysteresis.arrays import Floats
from hysteresis.records.record import Record


def random_rigs(count: int, seed: int) -> Iterator[tuple[Rig, LoadProgram]]:
    """Tubes of two plausible shapes, bent by up to some 60 deg: superelastic sections, stiff guides, plays, loads."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        outer = rng.uniform(1.5, 8.0)
        wall, joints = rng.uniform(0.04, 0.12) * outer, int(rng.integers(3, 30))
        width, arm = rng.uniform(0.1, 0.3) * outer, (outer - wall) / 2
        shapes: tuple[NotchShape, ...] = ("v_pair", "rectangular_pair")
        shape = shapes[int(rng.integers(2))]
        root = rng.uniform(0.3, 0.7) * width if shape == "v_pair" else None
        notch = Notch(shape, joints, rng.uniform(0.75, 0.93) * outer / 2, width, rng.uniform(0.1, 0.5) * outer, root)
        tendons = [
            Tendon(10 ** rng.uniform(3, 4.7), arm, rng.uniform(50, 800), rng.choice([0.0, rng.uniform(1, 60)]))
            for _ in range(2)
        ]
        direction = rng.uniform(-180, 180)
        plateau = rng.uniform(350, 650)
        rig = Rig(
            name="random",
            joint=NotchedTube(Tube(outer, outer - 2 * wall), notch),
            material=Material(rng.uniform(40, 80), 0.33),
            tendon_a=tendons[0],
            tendon_b=tendons[1],
            wheel=Wheel(rng.uniform(4, 20)),
            preload_N=min(10 ** rng.uniform(0, 1.6), 3e-3 * min(tendon.EA_N for tendon in tendons)),  # 0.3 % of strain
            friction=Friction(rng.uniform(0, 0.3), rng.uniform(0, 0.1), rng.uniform(0, 3), rng.uniform(0, 180)),
            closure=Closure(10 ** rng.uniform(2, 4)),
            superelastic=Superelastic(
                plateau, rng.uniform(0.3, 0.8) * plateau, rng.uniform(0.03, 0.06), rng.choice([0.0, rng.uniform(0, 2)])
            ),
            backlash=Backlash(rng.uniform(0, 0.2) * arm, 10 ** rng.uniform(0, 1.5)),
            stribeck=Stribeck(rng.uniform(0, 2), 10 ** rng.uniform(-2, 1)),
            tip_load=TipLoad(10 ** rng.uniform(-3, 0) * arm / joints, direction),
            tip_mass=TipMass(10 ** rng.uniform(-1, 1.3) * arm / joints, rng.uniform(-180, 180)),
        )
        most = arm * min(np.radians(60), 0.6 * joints * np.arctan(width / outer))
        steps = triangle(most, step_mm=most / 11)
        yield (
            rig,
            replace(steps, time_s=float(10 ** rng.uniform(-2, 0.5)) * np.arange(steps.drive_mm.size, dtype=float)),
        )


def random_wrists(count: int, seed: int) -> Iterator[tuple[Rig, LoadProgram]]:
    """Chains of measured joints, some soft, some with friction, which the preload of a single tendon bends at rest."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        arm = rng.uniform(0.5, 3.0)
        joint = MeasuredJoint(int(rng.choice([5, 8, 10, 14])), 2 * arm, 10 ** rng.uniform(0.5, 2.7) * arm)
        yield (
            Rig(
                name="random wrist",
                joint=joint,
                material=Material(),
                tendon_a=Tendon(10 ** rng.uniform(3.3, 4.3), arm, rng.uniform(50, 300)),
                tendon_b=None,
                wheel=Wheel(10.0),
                preload_N=float(rng.choice([1, 2, 5, 10, 20])),
                friction=Friction(capstan_coefficient=float(rng.choice([0.0, 0.1, 0.3]))),
            ),
            triangle(0.2 * arm, step_mm=0.1 * arm),
        )


def angles(rig: Rig, steps: LoadProgram, simulate: Callable[[Rig, LoadProgram], Record]) -> Floats | str:
    """Angle of the tip, or what the engine says."""
    try:
        return simulate(rig, steps).angle_deg
    except SolverError as error:
        return str(error)


def main() -> None:
    """Run as many rigs in the chain, and some of them in the multibody model, all with one tendon; print what fails."""
    many, few = (int(text) for text in sys.argv[1:3])
    for k, (rig, steps) in enumerate([*random_rigs(many, 24), *random_wrists(few, 24)]):
        chain = angles(rig, steps, simulate_chain)
        if isinstance(chain, str):
            sys.stdout.write(f"{k} chain: {chain}\n")
        if k >= many or k % max(1, many // few) == 0:
            multibody = angles(rig, steps, simulate_multibody)
            if isinstance(multibody, str):
                sys.stdout.write(f"{k} multibody: {multibody}\n")
            elif not isinstance(chain, str):
                off = np.abs(chain - multibody).max()
                sys.stdout.write(f"{k} {off:.3f} deg of {np.abs(chain).max():.1f}\n" if off > 0.1 else "")


if __name__ == "__main__":
    main()
