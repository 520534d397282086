"""The criterion that models are compared by, and how many independent samples it counts."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hysteresis.arrays import Floats
from validation.tracing.settings import MOST_CORRELATION, SAMPLES_OF_BRANCH


def bic(mean_square: float, parameters: int, samples: float) -> float:
    """Bayesian information criterion of a mean square error (Schwarz 1978, doi 10.1214/aos/1176344136)."""
    return samples * math.log(max(mean_square, 1e-300)) + parameters * math.log(samples)


def lag_one_correlation(errors: Sequence[Floats]) -> float:
    """First-order autocorrelation of the errors along all records together, between 0 and 0.99."""
    covariance = sum(float(e[1:] @ e[:-1]) for e in errors)
    variance = sum(float(e @ e) for e in errors)
    return min(max(covariance / variance if variance > 0 else 0.0, 0.0), MOST_CORRELATION)


def independent_samples(samples: int, correlation: float, branches: int) -> float:
    """Count the independent samples that correlated ones are worth: m (1 - r)/(1 + r), as of an AR(1) process.

    Every branch of the path counts for eight at least, but for no more samples than there are.
    """
    return max(min(samples, SAMPLES_OF_BRANCH * branches), samples * (1 - correlation) / (1 + correlation))
