"""The dataset of a study: one labelled xarray dataset in Zarr, written from the store after the cases have run."""

from __future__ import annotations

import json
import math
import shutil
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr

from hysteresis.arrays import Floats
from hysteresis.files import RecordError
from hysteresis.messages import as_given
from hysteresis.own import MAKER
from hysteresis.plain import to_plain
from studies.results.manifest import KEY, digests, require_complete
from studies.results.study import Extreme, Extremes
from studies.sweep.cases import Outcome
from studies.sweep.code import code_version, versions
from studies.sweep.errors import DiskFullError, StudyError
from studies.sweep.plan import Grid, Plan, cases
from studies.sweep.quantities import QUANTITIES, Quantity, quantity_names
from studies.sweep.store import Store
from studies.sweep.study_file import Study
from studies.units import unit_of

ZARR = "study.zarr"
PENDING = "pending"  # status of a case that an interrupted study has not reached
BLOCK = 4096  # cases that are held in memory at a time; also the size of a chunk of the dataset
REASONS = 20  # of failures that are counted; a message may contain the values of its case

_TEXTS = {
    "status": "ok, failed, or pending where the study was interrupted",
    "message": "why the case failed",
}


@dataclass
class Overview:
    """Summary of a dataset, collected while it is written.

    ``status`` counts the cases, ``messages`` the failed ones by reason, for the first :data:`REASONS` reasons.
    ``extremes`` has the minimum and maximum of each quantity that is known for any case, and the points where they are.
    """

    status: dict[str, int] = field(default_factory=lambda: {"ok": 0, "failed": 0, PENDING: 0})
    messages: dict[str, int] = field(default_factory=dict)
    extremes: dict[str, Extremes] = field(default_factory=dict)

    def count(self, outcome: Outcome | None) -> None:
        """Count a case, None if it has not run."""
        self.status[PENDING if outcome is None else outcome.status] += 1
        if outcome is None or outcome.status != "failed":
            return
        if outcome.message in self.messages or len(self.messages) < REASONS:
            self.messages[outcome.message] = self.messages.get(outcome.message, 0) + 1

    def look(self, name: str, values: Floats, points: Sequence[Mapping[str, float]]) -> None:
        """Look for the ends of a quantity among its values, shape (n,), NaN or infinite where they are not known."""
        known = np.isfinite(values)
        if not known.any():
            return
        low, high = (
            Extreme(float(values[k]), dict(points[k]))
            for k in (int(np.where(known, values, np.inf).argmin()), int(np.where(known, values, -np.inf).argmax()))
        )
        before = self.extremes.get(name)
        self.extremes[name] = Extremes(
            QUANTITIES[name].units,
            low if before is None or low.value < before.min.value else before.min,
            high if before is None or high.value > before.max.value else before.max,
        )


def write_dataset(study: Study, plan: Plan, store: Store, folder: Path) -> Overview:
    """Write the cases of a plan from the store into ``study.zarr``; missing ones are NaN and ``pending``.

    The dataset is written whole or not at all: to a temporary folder, which then replaces the old one. At most
    :data:`BLOCK` cases are held in memory.

    Raises
    ------
    DiskFullError
        No room; the old dataset is kept.
    """
    target, part, old = folder / ZARR, folder / f".{ZARR}.part", folder / f".{ZARR}.old"
    try:
        shutil.rmtree(part, ignore_errors=True)
        group = _empty(study, plan, part)
        overview = _fill(group, study, plan, store)
        group.attrs[KEY] = json.dumps(digests(part))
        _consolidate(part)
        shutil.rmtree(old, ignore_errors=True)
        if target.exists():
            target.rename(old)
        part.rename(target)
        shutil.rmtree(old, ignore_errors=True)
    except OSError as error:
        if not target.exists() and old.exists():
            old.rename(target)
        shutil.rmtree(part, ignore_errors=True)
        raise DiskFullError(f"{target}: {error.strerror or error}: expected room; the cases are in the store") from None
    return overview


def _consolidate(path: Path) -> None:
    """Put the metadata of all arrays into the root, where ``xarray.open_zarr`` looks for them first."""
    with warnings.catch_warnings():  # format 3 of Zarr has no word on them yet; all readers take them
        warnings.filterwarnings("ignore", message="Consolidated metadata is currently not part")
        zarr.consolidate_metadata(path)


def _empty(study: Study, plan: Plan, path: Path) -> zarr.Group:
    """Make the dataset with its coordinates and attributes, and an array for each quantity, in chunks of one block."""
    dims, coords = _coordinates(study, plan)
    xr.Dataset(coords=coords, attrs=_attributes(study)).to_zarr(path, mode="w", zarr_format=3, consolidated=False)
    group = zarr.open_group(path, mode="r+")
    facts = {name: QUANTITIES[name] for name in quantity_names(study.engine, study.groups)}
    for name, quantity in (facts | {"wall_s": Quantity("s", "computing time of the case")}).items():
        group.create_array(
            name, shape=plan.shape, chunks=block_shape(plan.shape, BLOCK), dtype="float64", fill_value=np.nan,
            dimension_names=dims, attributes={"units": quantity.units, "long_name": quantity.long_name},
        )  # fmt: skip
    for name, words in _TEXTS.items():
        group.create_array(
            name, shape=plan.shape, chunks=block_shape(plan.shape, BLOCK), dtype="string", dimension_names=dims,
            attributes={"long_name": words},
        )  # fmt: skip
    return group


def _fill(group: zarr.Group, study: Study, plan: Plan, store: Store) -> Overview:
    overview, names = Overview(), quantity_names(study.engine, study.groups)
    rest = cases(study, plan.points())
    for region in blocks(plan.shape, BLOCK):
        shape = tuple(part.stop - part.start for part in region)
        numbers = {name: np.full(math.prod(shape), np.nan) for name in (*names, "wall_s")}
        texts = {name: np.empty(math.prod(shape), dtype=np.dtypes.StringDType()) for name in _TEXTS}
        texts["status"][:] = PENDING
        block = list(islice(rest, math.prod(shape)))
        for i, case in enumerate(block):
            found = store.find(case.key)
            overview.count(found)
            if found is None:
                continue
            for name in names:
                numbers[name][i] = found.quantities.get(name, math.nan)
            numbers["wall_s"][i] = found.wall_s
            texts["status"][i], texts["message"][i] = found.status, found.message
        for name in names:
            overview.look(name, numbers[name], [case.values for case in block])
        for name, values in (numbers | texts).items():
            group[name][region] = values.reshape(shape)  # type: ignore[index]
    return overview


def block_shape(shape: tuple[int, ...], most: int) -> tuple[int, ...]:
    """Give the shape of the largest blocks of at most ``most`` cases that are consecutive in the order of the cases."""
    out, inner = list[int](), 1
    for size in reversed(shape):
        out.append(max(1, min(size, most // inner)))
        inner *= out[-1]
    return tuple(reversed(out))


def blocks(shape: tuple[int, ...], most: int) -> Iterator[tuple[slice, ...]]:
    """Divide a shape into regions of :func:`block_shape`, in the order of the cases."""
    sides = (range(0, n, k) for n, k in zip(shape, block_shape(shape, most), strict=True))
    for start in product(*sides):
        yield tuple(
            slice(a, min(a + k, n)) for a, n, k in zip(start, shape, block_shape(shape, most), strict=True)
        )  # fmt: skip


def _coordinates(study: Study, plan: Plan) -> tuple[list[str], dict[str, Any]]:
    """Give dimensions, and coordinates with their units: one dimension an axis in a grid, ``case`` in a sample."""
    facts = {axis.name: {"units": unit_of(axis.name) or "1", "long_name": axis.name} for axis in study.axes}
    if isinstance(plan, Grid):
        dims = [axis.name for axis in plan.axes]
        return dims, {axis.name: (axis.name, np.array(axis.values), facts[axis.name]) for axis in plan.axes}
    coords: dict[str, Any] = {"case": np.arange(len(plan))}
    return ["case"], coords | {
        name: ("case", column, facts[name]) for name, column in zip(plan.names, plan.rows.T, strict=True)
    }


def _attributes(study: Study) -> dict[str, int | str | list[str]]:
    """Give everything that the numbers depend on; no times of day, so that a repeated study is identical."""
    program = replace(study.tables.program, drive_mm=None, time_s=None)  # those of a file are in its copy
    bounds = {one.quantity: {"min": one.low, "max": one.high} for one in study.require}
    return {
        "maker": MAKER,
        "schema": 1,
        "title": study.title,
        "engine": study.engine,
        "groups": list(study.groups),
        "seed": study.seed if study.sample is None else study.sample.seed,
        "study": study.text,
        "rig": json.dumps(study.tables.rig, sort_keys=True),
        "program": json.dumps(to_plain(program)),
        "versions": json.dumps(versions(study.engine)),
        "code_sha256": code_version(study.engine),
        "inputs_sha256": json.dumps({path.name: digest for path, digest in study.inputs.items()}),
        **({"require": json.dumps(bounds)} if bounds else {}),
    }


def open_study(folder: Path) -> xr.Dataset:
    """Open the dataset in a study's folder; numbers are read when they are used.

    Raises
    ------
    StudyError
        A folder without one, or one with a chunk that is missing or changed.
    """
    path = folder / ZARR
    if not path.exists():  # the process was killed between the two renames
        path = folder / f".{ZARR}.old"
    if not path.exists():
        raise StudyError(f"{folder / ZARR}: no such file or directory: expected the dataset of `notchbend study`")
    try:
        require_complete(path)
        data = xr.open_zarr(path, consolidated=False, chunks=None)  # plain arrays: Dask would not pay here
        # Python's strings: numpy's string type has no NaN, which `where` fills with
        data.attrs.pop(KEY, None)  # of the files, not of the study
        return data.assign({name: data[name].astype(object) for name in ("status", "message")})
    except RecordError as error:
        raise StudyError(str(error)) from None
    except Exception as error:  # a broken store raises errors of many kinds
        raise StudyError(f"{path}: {as_given(str(error), 120)}: expected the dataset of `notchbend study`") from None
