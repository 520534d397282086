"""Learn how much clean rigs differ from their models: the prior of the discrepancy for each kind of baseline.

    python -m validation.practice.clean_makes.learn --geometry known --count 10

Each rig gives the likelihood of the scale s of its discrepancy, the most likely noise and smooth functions with it.
Over rigs log s is normal; its mean and standard deviation have the largest product of the rigs' likelihoods, each
integrated over s (empirical Bayes: Robbins 1956; Efron, Morris 1973, doi 10.1080/01621459.1973.10481350). Rigs are of
makes that share no law with the tracer's models, or are not as their sidecar tells; their seeds are of no other set.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.progress import track
from threadpoolctl import threadpool_limits

from hysteresis.arrays import Floats
from hysteresis.files import write_files
from hysteresis.records.record import Record
from validation.practice.clean_makes.maxwell_slip import draw_maxwell_slip
from validation.practice.clean_makes.uneven_notches import draw_uneven_notches
from validation.practice.draw import CLEAN, Case
from validation.practice.lumped.cases import draw_lumped_case
from validation.practice.protocols import KINDS, Kind
from validation.tracing import Trace, catalogue, trace_records
from validation.tracing.effect import acting
from validation.tracing.inference.chance import most_likely
from validation.tracing.inference.discrepancy import linearised
from validation.tracing.inference.leftover import leftover_deg
from validation.tracing.inference.priors import LEARNT, DiscrepancyPrior
from validation.tracing.inference.relevance import Grid, relevant_grid
from validation.tracing.inference.score import Covariance, log_likelihood, noise_deg, plain_square
from validation.tracing.inference.shapes import shapes_beside

SEED = 20_270_301
"""Of the rigs that are learnt from."""
SCALES = np.geomspace(1e-6, 3e-2, 91)
"""Scales of the discrepancy over half the range of the angle."""
TAUS = np.geomspace(1e-3, 30.0, 61)
"""Scales over the noise, at which likelihoods are computed."""
SPREADS = np.geomspace(0.2, 3.0, 28)
"""Standard deviations of log s that are tried."""
ANY_SCALE = DiscrepancyPrior(median=1e-3, spread=np.inf, leftover=np.inf)
LEFTOVER_LEVEL = 0.95
"""Part of the clean rigs that leave no more than is stored."""

MAKES: Mapping[str, Callable[[Kind, int], Case]] = {
    "lumped": lambda kind, number: draw_lumped_case(SEED, kind, CLEAN, number),
    "maxwell slip": lambda kind, number: draw_maxwell_slip(SEED, number),
    "uneven notches": lambda kind, number: draw_uneven_notches(SEED, number),
}


@dataclass(frozen=True, eq=False)
class CleanRig:
    """What a clean rig tells: log-likelihoods of :data:`SCALES`, shape (k,), by its grid, and its sensor's noise."""

    make: str
    kind: str
    grid: Grid
    sensor_deg: float | None
    log_likelihoods: Floats


def clean_rig(make: str, trace: Trace) -> CleanRig:
    """Measure how likely each scale of the discrepancy is in the records of a clean rig, beside its baseline."""
    baseline = trace.baseline
    with threadpool_limits(1, user_api="blas"):
        shapes = shapes_beside(baseline, acting(catalogue(), in_space=False))
        grid = relevant_grid(linearised(baseline, shapes), ANY_SCALE)
        return CleanRig(make, trace.model, grid, trace.floor.sensor_deg, _log_likelihoods(grid))


def _log_likelihoods(grid: Grid) -> Floats:
    """Log-likelihood of each scale, the largest over correlations and patterns, shape (k,)."""
    linear, best = grid.linear, np.full(SCALES.size, -np.inf)
    for rho, pattern in dict.fromkeys((g.rho, g.pattern) for g in grid.covariances):
        space = grid.spaces[rho]
        rows = space.rows(linear.residual[:, None])
        at = [Covariance(rho, pattern, float(tau)) for tau in TAUS]
        squares = [plain_square(space, rows, g) for g in at]
        scores = [float(log_likelihood(space, s, g, ANY_SCALE)[0]) for g, s in zip(at, squares, strict=True)]
        noises = [noise_deg(linear, float(square[0])) for square in squares]
        scales = TAUS * np.array(noises) / linear.half_range_deg
        order = np.argsort(scales)
        best = np.maximum(best, np.interp(np.log(SCALES), np.log(scales[order]), np.array(scores)[order]))
    return best


def learnt_prior(rows: Sequence[Floats]) -> tuple[float, float]:
    """Median scale over rigs and standard deviation of its logarithm, from the log-likelihoods of each rig."""
    logs = np.log(SCALES)
    likely = np.array([np.exp(row - row.max()) for row in rows])
    best, found = -np.inf, (0.0, 0.0)
    for mean in logs:
        for spread in SPREADS:
            density = np.exp(-0.5 * ((logs - mean) / spread) ** 2)
            score = float(np.log(likely @ (density / density.sum()) + 1e-300).sum())
            if score > best:
                best, found = score, (float(np.exp(mean)), float(spread))
    return found


def pooled_scale(rows: Sequence[Floats]) -> float:
    """Give the one scale that is most likely for all rigs together."""
    return float(SCALES[int(np.argmax(np.sum(rows, axis=0)))])


def leftover_of(rig: CleanRig, prior: DiscrepancyPrior) -> float:
    """Give what a clean rig leaves above its sensor's noise, over half the range of the angle."""
    grid = Grid(rig.grid.linear, prior, rig.grid.covariances, rig.grid.spaces)
    covariance, noise = most_likely(grid)
    return leftover_deg(grid.linear, covariance, noise, rig.sensor_deg) / grid.linear.half_range_deg


def traces(geometry: Kind, count: int) -> Iterator[tuple[str, Trace]]:
    """Fit the baseline to ``count`` rigs of each make; of unknown geometry the sidecars tell the preload alone."""
    every = [(make, number) for make in MAKES for number in range(count)]
    for make, number in track(every, description="clean rigs"):
        records = MAKES[make](geometry, number).records
        yield make, trace_records([_told(one, geometry) for one in records], effects=(), threads=1)


def _told(record: Record, geometry: Kind) -> Record:
    return record if geometry == "known" else replace(record, rig={"preload_N": record.rig["preload_N"]})


def main(arguments: Sequence[str] | None = None) -> None:
    """Learn, print each rig, and store the priors of the kinds of baseline that were seen."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.clean_makes.learn")
    parser.add_argument("--geometry", choices=KINDS, default="known", help="whether the sidecars describe the rigs")
    parser.add_argument("--count", type=int, default=10, help="rigs of each make")
    parser.add_argument("--out", type=Path, default=LEARNT, help="file of the priors")
    options = parser.parse_args(arguments)
    rigs = [clean_rig(make, trace) for make, trace in traces(options.geometry, options.count)]
    stored = tomllib.loads(options.out.read_text(encoding="utf-8")) if options.out.exists() else {}
    kinds = dict(stored.get("kinds", {}))
    for kind in dict.fromkeys(rig.kind for rig in rigs):
        own = [rig for rig in rigs if rig.kind == kind]
        kinds[kind] = _learnt(own, f"--geometry {options.geometry} --count {options.count}")
    write_files({options.out: _toml(kinds)})


def _learnt(rigs: Sequence[CleanRig], options: str) -> dict[str, float | str]:
    """Learn the prior of one kind of baseline, and print what each rig says."""
    median, spread = learnt_prior([rig.log_likelihoods for rig in rigs])
    prior = DiscrepancyPrior(median, spread, np.inf)
    left = [leftover_of(rig, prior) for rig in rigs]
    for rig, own in zip(rigs, left, strict=True):
        alone = pooled_scale([rig.log_likelihoods])
        print(f"{rig.kind}, {rig.make}: most likely scale {alone:.2g}, leftover {own:.2g}")  # noqa: T201
    makes = [f"{sum(rig.make == make for rig in rigs)} {make}" for make in MAKES]
    together = pooled_scale([rig.log_likelihoods for rig in rigs])
    return {
        "median": float(f"{median:.3g}"),
        "spread": float(f"{spread:.3g}"),
        "leftover": float(f"{np.quantile(left, LEFTOVER_LEVEL):.3g}"),
        "one_scale": float(f"{together:.3g}"),
        "learnt": f"{len(rigs)} clean rigs ({', '.join(makes)}) by clean_makes.learn {options}, seed {SEED}",
    }


def _toml(kinds: Mapping[str, Mapping[str, float | str]]) -> str:
    lines = ["# Written by python -m validation.practice.clean_makes.learn; see priors.py beside it."]
    for kind, own in kinds.items():
        lines += ["", f'[kinds."{kind}"]', *(f"{key} = {value!r}".replace("'", '"') for key, value in own.items())]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
