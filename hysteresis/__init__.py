"""Hysteresis curves: records, metrics, Bouc-Wen laws and their identification. No tube, no solver."""

from hysteresis.fitting.fit import Fit
from hysteresis.fitting.identification import identify
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record

__all__ = ["Fit", "Record", "identify", "read_record"]
