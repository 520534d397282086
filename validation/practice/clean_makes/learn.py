"""Learn how much clean rigs differ from their models: the prior of the discrepancy for each kind of baseline.

    python -m validation.practice.clean_makes.learn --geometry known --count 10

Each rig gives the likelihood of the scale s of its discrepancy, the most likely noise and smooth functions with it.
Over rigs log s is normal; its mean and standard deviation have the largest product of the rigs' likelihoods, each
integrated over s (empirical Bayes: Robbins 1956; Efron, Morris 1973, doi 10.1080/01621459.1973.10481350). So has the
spread of the effects within a rig, over draws of which each likelihood is averaged. Rigs are of makes that share no law
with the tracer's models, or are not as their sidecar tells; their seeds are of no other set.
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
from validation.tracing.inference.chance import likelihoods
from validation.tracing.inference.discrepancy import linearised
from validation.tracing.inference.leftover import leftover_deg
from validation.tracing.inference.priors import LEARNT, DiscrepancyPrior
from validation.tracing.inference.relevance import Grid, relevant_grid
from validation.tracing.inference.score import Covariance, Reduced, log_likelihood, noise_deg
from validation.tracing.inference.shapes import shapes_beside

SEED = 20_270_301
"""Of the rigs that are learnt from."""
SCALES = np.geomspace(1e-6, 3e-2, 91)
"""Scales of the discrepancy over half the range of the angle."""
TAUS = np.geomspace(1e-3, 10.0, 25)
"""Scales over the noise, at which likelihoods are computed."""
SPREADS_OF_EFFECTS = (0.0, 0.5, 1.0, 1.5)
"""Standard deviations of the logarithm of one effect's scale in a rig that are tried."""
DRAWS = 100
"""Of the scales of all effects, over which a likelihood is averaged."""
SPREADS = np.geomspace(0.2, 3.0, 28)
"""Standard deviations of log s that are tried."""
ANY_SCALE = DiscrepancyPrior(median=1e-3, spread=np.inf, spread_of_effects=0.0, leftover=np.inf)
LEFTOVER_LEVEL = 0.95
"""Part of the clean rigs that leave no more than is stored."""

MAKES: Mapping[str, Callable[[Kind, int], Case]] = {
    "lumped": lambda kind, number: draw_lumped_case(SEED, kind, CLEAN, number),
    "maxwell slip": lambda kind, number: draw_maxwell_slip(SEED, number),
    "uneven notches": lambda kind, number: draw_uneven_notches(SEED, number),
}


@dataclass(frozen=True, eq=False)
class CleanRig:
    """What a clean rig tells: its grid, its sensor's noise, and log-likelihoods of the scales of its discrepancy.

    ``log_likelihoods`` has a row for each of :data:`SPREADS_OF_EFFECTS`, shape (j, k).
    """

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
        return CleanRig(make, trace.model, grid, trace.floor.unrepeated_deg, _log_likelihoods(grid))


def _log_likelihoods(grid: Grid) -> Floats:
    """Log-likelihood of each scale for each spread of the effects, at the most likely noise and pattern, (j, k)."""
    best = likelihoods(grid)[0].covariance
    rows = [_row(grid, best, spread) for spread in SPREADS_OF_EFFECTS]
    return np.array(rows)


def _row(grid: Grid, best: Covariance, spread: float) -> Floats:
    """Log-likelihood of each scale, averaged over draws of the scales of the effects, shape (k,)."""
    linear, rng = grid.linear, np.random.default_rng(SEED)
    space = grid.spaces[best.rho]
    found = []
    for _ in range(DRAWS if spread else 1):
        scales = np.exp(spread * rng.standard_normal(len(linear.names)) - spread**2)
        own = replace(linear, shapes=linear.shapes * np.repeat(scales, linear.counts))
        found.append(_of_scales(Reduced(own, best.rho, space.basis, space.tangent, space.log_determinant), best))
    rows = np.array(found)
    return np.asarray(np.log(np.exp(rows - rows.max()).mean(axis=0) + 1e-300) + rows.max())


def _of_scales(space: Reduced, best: Covariance) -> Floats:
    """Log-likelihood of each scale at a correlation and pattern, shape (k,)."""
    linear = space.of
    rows = space.rows(linear.residual[:, None])
    modes = space.modes(best.pattern)
    turned = (modes.turn @ rows.inside)[:, 0] ** 2
    squares = [float(rows.outside[0] + modes.weights(float(tau)) @ turned) for tau in TAUS]
    at = [replace(best, tau=float(tau)) for tau in TAUS]
    scores = [float(log_likelihood(space, np.array(s), g, ANY_SCALE)) for g, s in zip(at, squares, strict=True)]
    scales = TAUS * np.array([noise_deg(linear, square) for square in squares]) / linear.half_range_deg
    return np.interp(np.log(SCALES), np.log(np.maximum.accumulate(scales)), scores)


def learnt_prior(rows: Sequence[Floats]) -> tuple[float, float, float]:
    """Median scale over rigs, standard deviation of its logarithm, and the log-likelihood of all rigs with them."""
    logs = np.log(SCALES)
    likely = np.array([np.exp(row - row.max()) for row in rows])
    best, found, most = -np.inf, (0.0, 0.0), sum(float(row.max()) for row in rows)
    for mean in logs:
        for spread in SPREADS:
            density = np.exp(-0.5 * ((logs - mean) / spread) ** 2)
            score = float(np.log(likely @ (density / density.sum()) + 1e-300).sum())
            if score > best:
                best, found = score, (float(np.exp(mean)), float(spread))
    return *found, best + most


def pooled_scale(rows: Sequence[Floats]) -> float:
    """Give the one scale that is most likely for all rigs together."""
    return float(SCALES[int(np.argmax(np.sum(rows, axis=0)))])


def leftover_of(rig: CleanRig, prior: DiscrepancyPrior) -> float:
    """Give what a clean rig leaves above its sensor's noise, over half the range of the angle."""
    grid = Grid(rig.grid.linear, prior, rig.grid.covariances, rig.grid.spaces)
    best = likelihoods(grid)[0]
    return leftover_deg(grid.linear, best.covariance, best.noise_deg, rig.sensor_deg) / grid.linear.half_range_deg


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
    found = traces(options.geometry, options.count)
    rigs = [clean_rig(make, trace) for make, trace in found if trace.baseline.fold_errors is None]
    stored = tomllib.loads(options.out.read_text(encoding="utf-8")) if options.out.exists() else {}
    kinds = dict(stored.get("kinds", {}))
    for kind in dict.fromkeys(rig.kind for rig in rigs):
        own = [rig for rig in rigs if rig.kind == kind]
        kinds[kind] = _learnt(own, f"--geometry {options.geometry} --count {options.count}")
    write_files({options.out: _toml(kinds)})


def _learnt(rigs: Sequence[CleanRig], options: str) -> dict[str, float | str]:
    """Learn the prior of one kind of baseline, and print what each rig says."""
    tried = [learnt_prior([rig.log_likelihoods[j] for rig in rigs]) for j in range(len(SPREADS_OF_EFFECTS))]
    for spread, (_, _, score) in zip(SPREADS_OF_EFFECTS, tried, strict=True):
        print(f"spread of effects {spread:g}: log-likelihood {score - tried[0][2]:+.1f}")  # noqa: T201
    best = int(np.argmax([score for _, _, score in tried]))
    median, spread, _ = tried[best]
    prior = DiscrepancyPrior(median, spread, SPREADS_OF_EFFECTS[best], np.inf)
    left = [leftover_of(rig, prior) for rig in rigs]
    for rig, own in zip(rigs, left, strict=True):
        alone = pooled_scale([rig.log_likelihoods[best]])
        print(f"{rig.kind}, {rig.make}: most likely scale {alone:.2g}, leftover {own:.2g}")  # noqa: T201
    makes = [f"{sum(rig.make == make for rig in rigs)} {make}" for make in MAKES]
    together = pooled_scale([rig.log_likelihoods[best] for rig in rigs])
    return {
        "median": float(f"{median:.3g}"),
        "spread": float(f"{spread:.3g}"),
        "spread_of_effects": SPREADS_OF_EFFECTS[best],
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
