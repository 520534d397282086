"""Sobol indices of the quantities of a study: which varied number decides, alone and with the others.

First-order and total indices by Saltelli's sample and estimators (doi 10.1016/j.cpc.2009.09.018) as in SALib, with
bootstrap intervals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

from hysteresis.arrays import Floats
from studies.sweep.cases import QUANTITIES
from studies.sweep.plan import Spread, cases, on_axes
from studies.sweep.store import Store
from studies.sweep.study_file import Axis, Sensitivity, Study

CONSTANT = 1e-9  # of its size: a quantity that changes by less has no indices


def saltelli_plan(axes: Sequence[Axis], asked: Sensitivity) -> Spread:
    """Draw ``count`` blocks of (axes + 2) points over the ranges of the axes."""
    unit = sampling.sample(_problem(axes), asked.count, calc_second_order=False, seed=asked.seed)
    return Spread(tuple(axis.name for axis in axes), on_axes(axes, unit))


def _problem(axes: Sequence[Axis]) -> dict[str, Any]:
    return {"num_vars": len(axes), "names": [axis.name for axis in axes], "bounds": [[0.0, 1.0]] * len(axes)}


def indices(axes: Sequence[Axis], values: Floats, asked: Sensitivity) -> dict[str, Any] | None:
    """Sobol indices of one quantity.

    A block with a case that failed is left out whole, which keeps the estimators unbiased where failures are few and
    not so where they make up a corner of the ranges: ``blocks`` says how many are left.

    Parameters
    ----------
    values
        Shape (count (axes + 2),), in the order of :func:`saltelli_plan`.

    Returns
    -------
        By axis ``first`` and ``total``, each with ``value``, ``low``, ``high``; None for a quantity that does not
        change, or with fewer than 4 whole blocks.
    """
    blocks = values.reshape(asked.count, len(axes) + 2)
    good = blocks[np.isfinite(blocks).all(axis=1)]
    if len(good) < 4 or np.ptp(good) <= CONSTANT * np.abs(good).max():
        return None
    found = analysis.analyze(
        _problem(axes), good.ravel(), calc_second_order=False, num_resamples=asked.resamples,
        conf_level=asked.confidence, seed=asked.seed,
    )  # fmt: skip
    rows = {
        axis.name: {
            word: {"value": float(v), "low": float(v - half), "high": float(v + half)}
            for word, v, half in (
                ("first", found["S1"][i], found["S1_conf"][i]),
                ("total", found["ST"][i], found["ST_conf"][i]),
            )
        }
        for i, axis in enumerate(axes)
    }
    return {"indices": rows, "blocks": len(good), "variance": float(np.var(good[:, [0, -1]]))}


def sensitivity(study: Study, plan: Spread, store: Store) -> dict[str, Any]:
    """Contents of ``sensitivity.json``: indices of each quantity that changes and is known."""
    assert study.sensitivity is not None
    asked = study.sensitivity
    table = np.full((len(asked.quantities), len(plan)), np.nan)
    for i, case in enumerate(cases(study, plan.points())):
        found = store.find(case.key)
        if found is not None and found.status == "ok":
            table[:, i] = [found.quantities[name] for name in asked.quantities]
    rows = {name: indices(study.axes, row, asked) for name, row in zip(asked.quantities, table, strict=True)}
    return {
        "schema": 1,
        "engine": study.engine,
        "count": asked.count,
        "cases": len(plan),
        "seed": asked.seed,
        "confidence": asked.confidence,
        "resamples": asked.resamples,
        "ranges": {axis.name: [axis.low, axis.high] for axis in study.axes},
        "quantities": {n: {"units": QUANTITIES[n].units} | found for n, found in rows.items() if found is not None},
        "without_indices": [name for name, found in rows.items() if found is None],
    }
