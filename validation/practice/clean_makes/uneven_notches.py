"""Clean rigs whose notches differ in depth, by the multibody model; the sidecar tells the nominal tube."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np

from fem_models.multibody import simulate_multibody
from fem_models.rig.rig import notched_tube, with_notch
from hysteresis.records.record import Record
from validation.practice.draw import Case, Noiseless, Truth, with_white_noise
from validation.practice.protocols import draw_baseline

DEPTH_SPREAD = 0.01
"""Relative standard deviation of a notch's depth: 0.03 mm of 2.7 mm, which a laser cuts."""


def draw_uneven_notches(seed: int, number: int) -> Case:
    """Draw a clean rig and its records; the same arguments give the same records.

    Raises
    ------
    SolverError
        A rig that does not follow its records.
    """
    rng = np.random.default_rng((seed, zlib.crc32(b"uneven notches"), number))
    protocol = draw_baseline(rng, measured_joints=False).protocol
    notch = notched_tube(protocol.rig).notch
    depths = np.asarray(notch.depth_mm) * (1 + DEPTH_SPREAD * rng.standard_normal(notch.count))
    rig = with_notch(protocol.rig, replace(notch, depth_mm=tuple(depths.tolist())))
    records = tuple(
        Record(
            drive=loading.program.drive_mm,
            angle_deg=simulate_multibody(replace(rig, preload_N=loading.preload_N), loading.program).angle_deg,
            time_s=loading.program.time_s,
            cycle=loading.program.cycle,
            title=f"Practice record {i + 1} of a rig with uneven notches, no measurement",
            kind="simulated",
            rig={**protocol.table, "preload_N": loading.preload_N},
        )
        for i, loading in enumerate(protocol.loadings)
    )
    truth = Truth((), {}, (), (), engine="multibody", noise_deg=protocol.noise_deg, rig="uneven notches")
    return with_white_noise(Noiseless(f"clean-{number:02d}", records, protocol.zeros_deg, truth), rng)
