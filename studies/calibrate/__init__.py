"""The shortest motion of a rig that fixes what its compensator needs, within limits of strain and tension."""

from studies.calibrate.excitation import Calibration, Demands, calibration

__all__ = ["Calibration", "Demands", "calibration"]
