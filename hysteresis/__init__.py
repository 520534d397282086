"""Hysteresis curves: records, metrics, Bouc-Wen laws and their identification. No tube, no solver."""

from hysteresis.fit import Fit
from hysteresis.identification import identify
from hysteresis.record import Record
from hysteresis.record_file import read_record

__all__ = ["Fit", "Record", "identify", "read_record"]
