"""How often the intervals of a fitted :class:`TendonRig` hold the parameters of a simulated rig."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from functools import partial

import numpy as np

from hysteresis.arrays import Floats
from validation.measured.tendon_fit import NAMES, TendonRecord, bias_of_noise, bootstrap, fit
from validation.measured.tendon_rig import TendonRig, run_of_stroke

RIG = TendonRig(
    entry=0.18, constant_N=0.03, capstan=0.12, bias_N=0.55, compliance_deg_per_N=19.0, loop_share=0.2,
    loop_angle_deg=9.0, stretch_mm_per_N=0.3, slack_mm=0.9, slack_N=0.17, cell_side=0.8, arm_mm=5.3, start_mm=0.6,
)  # fmt: skip
"""Near the fit to the measured robot; ``zero_N`` is fixed at 0, as there."""
TOPS_MM = (8.5, 6.0)
_FIRST_N = 0.45
_LOOPS, _SAMPLES, _DECAY = 5, 60, 0.75
_DRAWS, _REFITS = 200, 8


def stroke_mm(top_mm: float) -> Floats:
    """Five loops of decaying amplitude from zero and back, as the measured records have them, shape (301,)."""
    once = 0.5 - 0.5 * np.cos(np.linspace(0, 2 * np.pi, _SAMPLES + 1))
    return np.concatenate([[0.0], *[top_mm * _DECAY**k * once[1:] for k in range(_LOOPS)]])


def noisy_pair(seed: int, tension_noise: float, bending_noise: float) -> list[TendonRecord]:
    """Simulate two records of :data:`RIG` with white noise, as shares of the ranges."""
    rng, out = np.random.default_rng(seed), []
    for top in TOPS_MM:
        run = run_of_stroke(RIG, stroke_mm(top), _FIRST_N)
        tension, bending = (
            clean + share * np.ptp(clean) * rng.standard_normal(clean.size)
            for clean, share in ((run.tension_N, tension_noise), (run.bending_deg, bending_noise))
        )
        out.append(TendonRecord(f"pair {seed}", run.stroke_mm, tension, bending))
    return out


def _within(seed: int, tension_noise: float, bending_noise: float, fixed: Mapping[str, float]) -> Floats:
    records = noisy_pair(seed, tension_noise, bending_noise)
    found = fit(records, RIG, fixed)
    bias = bias_of_noise(found, records, _REFITS, seed, fixed)
    rows = np.array([rig.row() for rig in bootstrap(found, records, _DRAWS, seed, fixed, bias)])
    low, high = np.quantile(rows, [0.025, 0.975], axis=0)
    return np.asarray((low <= RIG.row()) & (RIG.row() <= high), dtype=float)


def coverage(
    pairs: int, tension_noise: float, bending_noise: float, fixed: Mapping[str, float], pool: Executor | None = None
) -> dict[str, float]:
    """Share of the 95 % intervals that hold the true value, by parameter that is not ``fixed``.

    Repeatable, whatever the ``pool``.
    """
    mapper = map if pool is None else pool.map
    one = partial(_within, tension_noise=tension_noise, bending_noise=bending_noise, fixed=dict(fixed))
    share = np.mean(list(mapper(one, range(pairs))), axis=0)
    return {name: float(value) for name, value in zip(NAMES, share, strict=True) if name not in fixed}
