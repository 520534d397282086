"""A third generator of practice records: joints, flexures and segments of the tendons in series."""

from validation.practice.series.rig import SeriesRig, SeriesRun, simulate_series

__all__ = ["SeriesRig", "SeriesRun", "simulate_series"]
