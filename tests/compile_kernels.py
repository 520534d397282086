"""Compile the kernels of the chain before the tests: the workers of the tests would compile the same ones at once."""

from dataclasses import replace

from fem_models.chain.along import line_along, moved_along, moved_run, taped_run
from fem_models.load import sine
from fem_models.rig import preset
from fem_models.rig.effects import Superelastic

SECTIONS = (None, Superelastic(heating_time_s=1.0))
"""Kernels are compiled for sections that do not heat themselves, and for those that do."""


def compile_chain() -> None:
    """Follow rigs with each kind of section through a few samples, and a rig beside each."""
    program = sine(0.5, 0.1, samples_per_cycle=12)
    for section in SECTIONS:
        rig = replace(preset("du2018"), superelastic=section)
        run = taped_run(rig, program)
        moved_along(line_along(run), moved_run(run, replace(rig, preload_N=1.0001 * rig.preload_N), program))


if __name__ == "__main__":
    compile_chain()
