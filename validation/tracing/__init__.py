"""Trace the residual of measured records to the physical effect that the model lacks."""

from validation.tracing.effect import Effect, catalogue
from validation.tracing.outcome import Trace
from validation.tracing.trace import trace_records

__all__ = ["Effect", "Trace", "catalogue", "trace_records"]
