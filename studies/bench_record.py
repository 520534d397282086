"""Make the record that ships with the package: a multibody run with an effect that the default rig lacks.

``python -m studies.bench_record`` writes it again; the same seed gives the same file. The effect is unequal
tendons, the paper's explanation of its residual (section 4.4): tendon b has a smaller moment arm and a longer, hence
more compliant, free length. The angle has the noise of a camera.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_models.load import triangle
from fem_models.multibody import simulate_multibody
from fem_models.rig import preset
from hysteresis import Record
from hysteresis.records.record_file import write_record

SHIPPED = Path(__file__).parent / "records" / "bench-like-20N.csv"
SEED = 20181
NOISE_DEG = 0.05
ARM_RATIO = 0.95
FREE_LENGTH_RATIO = 1.2


def bench_like_record(seed: int = SEED) -> Record:
    """Simulate three cycles at 20 N of the rig du2018 with unequal tendons, with noise of the angle."""
    rig = preset("du2018", preload_N=20.0)
    b = rig.tendon_b
    assert b is not None
    unequal = replace(
        rig,
        tendon_b=replace(
            b, moment_arm_mm=ARM_RATIO * b.moment_arm_mm, free_length_mm=FREE_LENGTH_RATIO * b.free_length_mm
        ),
    )
    clean = simulate_multibody(unequal, triangle(2.2, step_mm=0.1, cycles=3))
    noise = np.random.default_rng(seed).normal(0.0, NOISE_DEG, clean.angle_deg.size)
    return Record(
        drive=clean.drive,
        angle_deg=np.round(clean.angle_deg + noise, 4),
        cycle=clean.cycle,
        title=(
            f"Not a measurement: made by studies/bench_record.py, seed {seed}. du2018 at 20 N with an "
            f"effect that the default rig lacks: tendon b has {ARM_RATIO:g} of the moment arm and "
            f"{FREE_LENGTH_RATIO:g} of the free length; noise {NOISE_DEG:g} deg"
        ),
        kind="simulated",
        rig={"preset": "du2018", "preload_N": 20.0},
    )


if __name__ == "__main__":
    write_record(bench_like_record(), SHIPPED)
