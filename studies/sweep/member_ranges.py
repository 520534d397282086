"""Ranges of a study's quantities over the members of an ensemble, at every point of its other axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hysteresis.files import write_files
from studies.sweep.dataset import open_study
from studies.sweep.errors import StudyError
from studies.sweep.inputs import MEMBER
from studies.sweep.quantities import QUANTITIES
from validation.separation.ensemble import LEVEL

RANGES = "ensemble.csv"
_ENDS = {"low": 0.5 - LEVEL / 2, "median": 0.5, "high": 0.5 + LEVEL / 2}


def write_ranges(folder: Path) -> Path:
    """Write ``ensemble.csv`` beside the dataset of a grid: a row a point, low, median and high of every quantity.

    Cases that failed do not count; a quantity that is known of no member is empty.

    Raises
    ------
    StudyError
        A dataset whose members are not an axis of a grid.
    """
    data = open_study(folder)
    if MEMBER not in data.dims:
        raise StudyError(f"{folder}: members are sampled: expected a grid for ranges over them")
    names = [name for name in QUANTITIES if name in data]
    others = [name for name in data[names[0]].dims if name != MEMBER]
    head = [*map(str, others), *(f"{name}_{end}" for name in names for end in _ENDS)]
    ranges = data[names].quantile(list(_ENDS.values()), dim=MEMBER, skipna=True)
    points = np.array(np.meshgrid(*(data[name].values for name in others), indexing="ij")).reshape(len(others), -1)
    columns = [*points]
    for name in names:
        columns += list(ranges[name].transpose("quantile", *others).values.reshape(len(_ENDS), -1))
    rows = (",".join("" if np.isnan(value) else f"{value:.8g}" for value in row) for row in zip(*columns, strict=True))
    path = folder / RANGES
    write_files({path: "\n".join([",".join(head), *rows]) + "\n"})
    return path
