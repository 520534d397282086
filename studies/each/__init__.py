"""Many devices, each by itself: one fit with intervals a record, one table of all."""

from studies.each.result import EachResult, FittedDevice
from studies.each.work import EachSettings, fit_each

__all__ = ["EachResult", "EachSettings", "FittedDevice", "fit_each"]
