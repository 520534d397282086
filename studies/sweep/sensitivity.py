"""Sobol indices of the quantities of a study: the influence of each varied number, alone and with the others.

First-order and total indices by Saltelli's sample and estimators (doi 10.1016/j.cpc.2009.09.018) as in SALib, with
bootstrap intervals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypedDict

import numpy as np
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

from hysteresis.arrays import Floats
from studies.results.study import AxisIndices, Index, QuantityIndices, Sensitivities
from studies.sweep.plan import Spread, cases, on_axes
from studies.sweep.quantities import QUANTITIES
from studies.sweep.store import Store
from studies.sweep.study_file import Axis, Sensitivity, Study

CONSTANT = 1e-9  # relative: a quantity that varies by less has no indices


class Problem(TypedDict):
    """What SALib calls a problem: the axes, here all from 0 to 1."""

    num_vars: int
    names: list[str]
    bounds: list[list[float]]


def saltelli_plan(axes: Sequence[Axis], settings: Sensitivity) -> Spread:
    """Draw ``count`` blocks of (axes + 2) points over the ranges of the axes."""
    unit = sampling.sample(_problem(axes), settings.count, calc_second_order=False, seed=settings.seed)
    return Spread(tuple(axis.name for axis in axes), on_axes(axes, unit))


def _problem(axes: Sequence[Axis]) -> Problem:
    return {"num_vars": len(axes), "names": [axis.name for axis in axes], "bounds": [[0.0, 1.0]] * len(axes)}


def indices(axes: Sequence[Axis], values: Floats, settings: Sensitivity, units: str = "") -> QuantityIndices | None:
    """Compute the Sobol indices of one quantity.

    A block with a failed case is left out. The estimators stay unbiased if few cases fail; they are biased if a whole
    corner of the ranges fails. ``blocks`` of the result counts the complete blocks.

    Parameters
    ----------
    values
        Shape (count (axes + 2),), in the order of :func:`saltelli_plan`.
    units
        Of the quantity.

    Returns
    -------
        First-order and total index by axis; None for a constant quantity, or with fewer than 4 complete blocks.
    """
    blocks = values.reshape(settings.count, len(axes) + 2)
    good = blocks[np.isfinite(blocks).all(axis=1)]
    if len(good) < 4 or np.ptp(good) <= CONSTANT * np.abs(good).max():
        return None
    found = analysis.analyze(
        _problem(axes), good.ravel(), calc_second_order=False, num_resamples=settings.resamples,
        conf_level=settings.confidence, seed=settings.seed,
    )  # fmt: skip
    rows = {
        axis.name: AxisIndices(
            _index(found["S1"][i], found["S1_conf"][i]),
            _index(found["ST"][i], found["ST_conf"][i]),
        )
        for i, axis in enumerate(axes)
    }
    return QuantityIndices(units, rows, len(good), float(np.var(good[:, [0, -1]])))


def _index(value: float, half: float) -> Index:
    return Index(float(value), float(value - half), float(value + half))


def sensitivity(study: Study, plan: Spread, store: Store) -> Sensitivities:
    """Compute the indices of every quantity that varies and is known."""
    assert study.sensitivity is not None
    settings = study.sensitivity
    table = np.full((len(settings.quantities), len(plan)), np.nan)
    for i, case in enumerate(cases(study, plan.points())):
        found = store.find(case.key)
        if found is not None and found.status == "ok":
            table[:, i] = [found.quantities[name] for name in settings.quantities]
    rows = {
        name: indices(study.axes, row, settings, QUANTITIES[name].units)
        for name, row in zip(settings.quantities, table, strict=True)
    }
    return Sensitivities(
        engine=study.engine,
        count=settings.count,
        cases=len(plan),
        seed=settings.seed,
        confidence=settings.confidence,
        resamples=settings.resamples,
        ranges={axis.name: (axis.low, axis.high) for axis in study.axes},
        quantities={name: found for name, found in rows.items() if found is not None},
        without_indices=tuple(name for name, found in rows.items() if found is None),
        computed=0,
        from_store=0,
    )
