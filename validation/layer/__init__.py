"""The Bouc-Wen layer on the model: held-out errors, other operators, recovery of parameters, compensation."""

from validation.layer.comparators import Operator, fit_operator
from validation.layer.compensation import Tracking, track

__all__ = ["Operator", "Tracking", "fit_operator", "track"]
