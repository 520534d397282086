"""How large an effect must be for the test to claim it in nine of ten records.

A change c of the angle beyond the tangent of the fit makes T = n log(1 + q/n), where the root of q is that of c'P c
over the noise, less 1.28 at most in nine of ten draws. T must be as large as chance makes it in a part alpha of the
draws. P is that of the most likely covariance, with shapes and smooth functions at least as large as clean rigs have
them: the smooth functions take most of an effect that is a function of the drive alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from threadpoolctl import threadpool_limits

from hysteresis.arrays import Floats
from validation.tracing.effect import Effect
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.inference.chance import chance_of, likelihoods
from validation.tracing.inference.discrepancy import linearised
from validation.tracing.inference.priors import TWO_SIDED_95, DiscrepancyPrior
from validation.tracing.inference.relevance import relevant_grid
from validation.tracing.inference.shapes import shapes_beside
from validation.tracing.settings import NINE_OF_TEN


def times_needed(
    fitted: Fitted, effects: Sequence[Effect], prior: DiscrepancyPrior, alpha: float, seed: int = 0
) -> Callable[[Floats], float]:
    """Give a function of a change of all samples, shape (m,), deg: how many times larger it must be to be claimed."""
    with threadpool_limits(1, user_api="blas"):
        linear = linearised(fitted, shapes_beside(fitted, effects))
        grid = relevant_grid(linear, prior)
        critical = chance_of(grid, seed=seed, levels=(alpha,)).critical[alpha]
    likely = likelihoods(grid)[0]
    space, noise = grid.spaces[likely.covariance.rho], likely.noise_deg
    each = prior.leftover * linear.half_range_deg / TWO_SIDED_95 / noise / math.sqrt(max(len(linear.smooth), 1))
    own = dict(likely.covariance.pattern)
    pattern = tuple((name, max(own.get(name, 0.0), each)) for name in linear.smooth)
    modes = space.modes(pattern)
    weights = modes.weights(max(likely.covariance.tau, prior.median * linear.half_range_deg / noise))
    count = linear.freedom
    needed = noise * (math.sqrt(count * math.expm1(min(critical / count, 50.0))) + NINE_OF_TEN)

    def times(change: Floats) -> float:
        column = change[fitted.rows.train][:, None]
        rows = space.rows(column)
        square = float(rows.outside[0] + weights @ (modes.turn @ rows.inside)[:, 0] ** 2)
        return needed / math.sqrt(square) if square > 0 else math.inf

    return times
