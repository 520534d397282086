"""Separation of the hysteresis loop into friction, tendon elasticity and material; calibration of a known rig."""

from validation.separation.contributions import Contributions, loop_program, separate
from validation.separation.rig_calibration import calibrate_rig

__all__ = ["Contributions", "calibrate_rig", "loop_program", "separate"]
