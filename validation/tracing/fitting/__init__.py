"""Least-squares fits of a baseline with effects, and what they are compared by: noise floor, BIC, held-out error."""

from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.least_squares import fit
from validation.tracing.fitting.model import Model

__all__ = ["Fitted", "Holdout", "Model", "fit"]
