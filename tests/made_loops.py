"""A loop, its records and a backbone that tests of fits make by hand."""

import math

import numpy as np

from hysteresis.fitting.samples import join
from hysteresis.laws.backbone import given_backbone
from hysteresis.laws.elements import LAWS
from hysteresis.records.record import Record

UP = np.linspace(-1.0, 1.0, 21)
LOOP = np.concatenate([UP, UP[::-1][1:]])


def line(slope=10.0):
    return given_backbone(lambda x: slope * x, UP, slope * UP, "mm")


def of_records(*angles, train=None):
    records = [Record(LOOP, angle) for angle in angles]
    masks = [np.ones(LOOP.size, dtype=bool) if train is None else train for _ in records]
    return join(records, masks)


def values_of(name, *constants, A=0.5, saturation=2.0, state=0.0):
    """Coordinates of a law of the given name."""
    assert len(constants) == LAWS[name].size - 2
    return np.array([math.log(A), math.log(saturation), *constants, state])
