"""Baseline models that effects are added to: a known rig, also behind a motor, an equivalent rig, a curve."""

from validation.tracing.baseline.curve import curve_problem
from validation.tracing.baseline.equivalent_rig import equivalent_rig_problem
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.baseline.motor_drive import motor_drive_problem

__all__ = ["curve_problem", "equivalent_rig_problem", "known_rig_problem", "motor_drive_problem"]
