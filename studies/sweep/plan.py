"""The points of a study: every combination of a grid, or a sample over the ranges. Cases are made one at a time."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.stats import qmc

from fem_models.rig import RigError
from hysteresis.arrays import Floats
from studies.results.study import Sample
from studies.sweep.inputs import CaseInputs, key_of, keys_of, with_values
from studies.sweep.study_file import Axis, Study


@dataclass(frozen=True)
class Case:
    """A point of a study; ``key`` is the sha256 of what a worker computes it from."""

    key: str
    values: Mapping[str, float]
    study: Study

    @property
    def inputs(self) -> CaseInputs:
        """Inputs that a worker computes it from, made on demand."""
        return _inputs(self.study, self.values)


@dataclass(frozen=True)
class Grid:
    """Every combination of the values of all axes; the last axis varies fastest."""

    axes: tuple[Axis, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """One dimension an axis."""
        return tuple(len(axis.values) for axis in self.axes)

    def __len__(self) -> int:
        return math.prod(self.shape)

    def points(self) -> Iterator[dict[str, float]]:
        """Give the points, values by name."""
        names = [axis.name for axis in self.axes]
        return (dict(zip(names, values, strict=True)) for values in product(*(axis.values for axis in self.axes)))


@dataclass(frozen=True)
class Spread:
    """Points that were drawn: ``rows`` has shape (n, axes)."""

    names: tuple[str, ...]
    rows: Floats

    @property
    def shape(self) -> tuple[int, ...]:
        """One dimension, the case."""
        return (len(self.rows),)

    def __len__(self) -> int:
        return len(self.rows)

    def points(self) -> Iterator[dict[str, float]]:
        """Give the points, values by name."""
        return (dict(zip(self.names, row.tolist(), strict=True)) for row in self.rows)


Plan = Grid | Spread


def plan_of(study: Study) -> Plan:
    """Give the points of a study's own dataset."""
    if study.sample is None:
        return Grid(study.axes)
    rows = np.empty((study.sample.count, len(study.axes)))
    begin = 0
    for points in _drawn(study.sample, len(study.axes)):
        rows[begin : begin + len(points)] = on_axes(study.axes, points)
        begin += len(points)
    return Spread(tuple(axis.name for axis in study.axes), rows)


def unit_points(sample: Sample, dimensions: int) -> Floats:
    """Draw points of the unit cube, shape (count, dimensions).

    A larger Sobol sample begins with the same points, so that an extended study keeps its cases; a Latin hypercube of
    another count has other points.
    """
    return np.concatenate(list(_drawn(sample, dimensions)))


def _drawn(sample: Sample, dimensions: int) -> Iterator[Floats]:
    """Draw points block by block: a large sample is held once."""
    if sample.method != "sobol":
        yield np.asarray(qmc.LatinHypercube(dimensions, rng=sample.seed).random(sample.count))
        return
    with warnings.catch_warnings():  # about counts that are no power of two: the documentation says it
        warnings.simplefilter("ignore", UserWarning)
        sequence = qmc.Sobol(dimensions, scramble=True, rng=sample.seed)
        for begin in range(0, sample.count, _DRAWN):
            yield np.asarray(sequence.random(min(_DRAWN, sample.count - begin)))


_DRAWN = 2**16


def on_axes(axes: Sequence[Axis], unit: Floats) -> Floats:
    """Scale points of the unit cube to the ranges of the axes; whole numbers are equally frequent."""
    columns = []
    for axis, u in zip(axes, unit.T, strict=True):
        if axis.whole:
            columns.append(np.minimum(axis.low + np.floor(u * (axis.high - axis.low + 1)), axis.high))
        else:
            columns.append(axis.low + u * (axis.high - axis.low))
    return np.column_stack(columns)


def cases(study: Study, points: Iterable[Mapping[str, float]]) -> Iterator[Case]:
    """Make the cases of points, one at a time."""
    names = [axis.name for axis in study.axes]
    quick = keys_of(_inputs(study, {}), names)
    for values in points:
        # a point of a search may have some of the numbers alone
        key = key_of(_inputs(study, values)) if quick is None or len(values) < len(names) else quick(values)
        yield Case(key, values, study)


def _inputs(study: Study, values: Mapping[str, float]) -> CaseInputs:
    seed = study.seed if "bouc-wen" in study.groups else 0  # nothing else in a case is random
    tables, refused = study.tables, None
    try:
        tables = with_values(study.tables, values)
    except RigError:  # a derived number that is not possible: the worker meets the same error and reports it
        refused = dict(values)
    return CaseInputs(tables.rig, tables.program, study.engine, tuple(sorted(study.groups)), seed, refused)
