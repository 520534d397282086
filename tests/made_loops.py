"""A loop, its records and a backbone that tests of fits make by hand."""

import numpy as np

from hysteresis.fitting.samples import join
from hysteresis.laws.backbone import given_backbone
from hysteresis.records.record import Record

UP = np.linspace(-1.0, 1.0, 21)
LOOP = np.concatenate([UP, UP[::-1][1:]])


def line(slope=10.0):
    return given_backbone(lambda x: slope * x, UP, slope * UP, "mm")


def of_records(*angles, train=None):
    records = [Record(LOOP, angle) for angle in angles]
    masks = [np.ones(LOOP.size, dtype=bool) if train is None else train for _ in records]
    return join(records, masks)
