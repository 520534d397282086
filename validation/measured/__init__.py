"""Studies of measured records: wrists, a tendon robot, the calibration of the preset, and traces."""

from validation.measured.folder import measured_folder

__all__ = ["measured_folder"]
