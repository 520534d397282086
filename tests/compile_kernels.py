"""Compile the kernels of the chains before the tests: the workers of the tests would compile the same ones at once.

PYTHONPATH=. python tests/compile_kernels.py kernels           # joints that are alike; the chain in space
PYTHONPATH=. python tests/compile_kernels.py kernels-heated    # sections that heat themselves; joints that differ
"""

import sys
from dataclasses import replace

import numpy as np

from fem_models.chain.along import line_along, moved_along, moved_run, taped_run
from fem_models.load import sine
from fem_models.rig import Rig, preset
from fem_models.rig.effects import Superelastic
from fem_models.rig.rig import notched_tube, with_notch
from fem_models.spatial import solve_spatial, spatial_rig, wheel_drives
from fem_models.spatial.motion.steps import at_rest, moved_to

DU2018 = preset("du2018")


def compile_chain(rig: Rig) -> None:
    """Follow a rig through a few samples, and one beside it: kernels are compiled for a kind of section and of row."""
    program = sine(0.5, 0.1, samples_per_cycle=12)
    run = taped_run(rig, program)
    moved_along(line_along(run), moved_run(run, replace(rig, preload_N=1.0001 * rig.preload_N), program))


def compile_alike() -> None:
    """Compile what most tests need."""
    compile_chain(DU2018)
    solve_spatial(spatial_rig(DU2018), wheel_drives([[0.0], [0.1]]))
    moved_to(at_rest(spatial_rig(DU2018)), np.array([0.1, -0.1]))


def compile_others() -> None:
    """Compile the other kinds of rig."""
    notch = notched_tube(DU2018).notch
    compile_chain(replace(DU2018, superelastic=Superelastic(heating_time_s=1.0)))
    compile_chain(with_notch(DU2018, replace(notch, depth_mm=tuple(2.8 + 0.002 * k for k in range(notch.count)))))


if __name__ == "__main__":
    {"kernels": compile_alike, "kernels-heated": compile_others}[sys.argv[1]]()
