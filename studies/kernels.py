"""Compile kernels before their first use, on all cores: ``python -m studies.kernels [PART...]``.

Parts are those of :data:`PARTS`; by default what ``notchbend run`` of a rig in the plane needs, and the chain in space.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace

import numpy as np

from fem_models.chain.along import line_along, moved_along, moved_run, taped_run
from fem_models.load import sine, triangle
from fem_models.rig import Rig, preset
from fem_models.rig.effects import Superelastic
from fem_models.rig.rig import notched_tube, with_notch
from fem_models.spatial import solve_spatial, spatial_rig, wheel_drives
from fem_models.spatial.motion.steps import at_rest, moved_to
from hysteresis import Record, identify
from hysteresis.laws.inverse import compensating_drive
from studies.progress import bar

DU2018 = "du2018"


def compile_chain(rig: Rig) -> None:
    """Follow a rig through a few samples, and one beside it: kernels are compiled for a kind of section and of row."""
    program = sine(0.5, 0.1, samples_per_cycle=12)
    run = taped_run(rig, program)
    moved_along(line_along(run), moved_run(run, replace(rig, preload_N=1.0001 * rig.preload_N), program))


def compile_alike() -> None:
    """Compile the chain of joints that are alike."""
    compile_chain(preset(DU2018))


def compile_heated() -> None:
    """Compile the chain of sections that heat themselves."""
    compile_chain(replace(preset(DU2018), superelastic=Superelastic(heating_time_s=1.0)))


def compile_differing() -> None:
    """Compile the chain of joints that differ."""
    rig = preset(DU2018)
    notch = notched_tube(rig).notch
    depths = tuple(2.8 + 0.002 * k for k in range(notch.count))
    compile_chain(with_notch(rig, replace(notch, depth_mm=depths)))


def compile_in_space() -> None:
    """Compile the chain in space."""
    rig = spatial_rig(preset(DU2018))
    solve_spatial(rig, wheel_drives([[0.0], [0.1]]))
    moved_to(at_rest(rig), np.array([0.1, -0.1]))


def compile_laws() -> None:
    """Compile what identifies a loop and inverts it."""
    drive = triangle(1.0, step_mm=0.1, cycles=2).drive_mm
    noise = np.random.default_rng(0).normal(0.0, 0.05, drive.size)
    fit = identify(Record(drive, 10.0 * drive - np.sign(np.gradient(drive)) + noise))
    compensating_drive(fit, np.linspace(0.0, 1.0, 5), 0.0)


PARTS: dict[str, Callable[[], None]] = {
    "alike": compile_alike,
    "in_space": compile_in_space,
    "laws": compile_laws,
    "heated": compile_heated,
    "differing": compile_differing,
}
BY_DEFAULT = ("alike", "in_space", "laws")


def compile_part(name: str) -> None:
    """Compile one of :data:`PARTS`."""
    PARTS[name]()


def main(parts: Sequence[str]) -> None:
    """Compile parts, each in a process of its own."""
    unknown = set(parts) - set(PARTS)
    if unknown:
        sys.exit(f"{min(unknown)}: expected one of {', '.join(PARTS)}")
    chosen = parts or BY_DEFAULT
    with bar(True) as shown, ProcessPoolExecutor(min(len(chosen), os.cpu_count() or 1)) as pool:
        task = shown.add_task("compiling kernels, once", total=len(chosen))
        for done in as_completed([pool.submit(compile_part, name) for name in chosen]):
            done.result()
            shown.update(task, advance=1)


if __name__ == "__main__":
    main(sys.argv[1:])
