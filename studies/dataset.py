"""The dataset of a study: one labelled xarray dataset in Zarr, put together from the store when the cases are there."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from studies.cases import QUANTITIES, StudyError, quantity_names
from studies.inputs import code_version, versions
from studies.plan import Grid, Plan, cases
from studies.store import DiskFullError, Store
from studies.study_file import Study

ZARR = "study.zarr"
PENDING = "pending"  # status of a case that an interrupted study has not reached

_UNITS = {
    "N": "N", "mm": "mm", "deg": "deg", "GPa": "GPa", "MPa": "MPa", "g": "g", "s": "s", "Hz": "Hz",
    "Nmm_per_rad": "N mm/rad", "N_per_mm": "N/mm", "N_s_per_mm": "N s/mm", "Nmm_s_per_rad": "N mm s/rad",
}  # fmt: skip


def units_of(name: str) -> str:
    """Units of a field by its name, the longest ending that is known; 1 for a pure number."""
    for ending in sorted(_UNITS, key=len, reverse=True):
        if name.endswith("_" + ending):
            return _UNITS[ending]
    return "1"


def assemble(study: Study, plan: Plan, store: Store) -> xr.Dataset:
    """Read the cases of a plan from the store into a dataset; those that are not there are NaN and ``pending``.

    It takes 8 bytes a number and a case; nothing else of the cases is held.
    """
    count, names = len(plan), quantity_names(study.engine, study.groups)
    numbers = {name: np.full(count, np.nan) for name in (*names, "wall_s")}
    texts = {name: np.empty(count, dtype=np.dtypes.StringDType()) for name in ("status", "message")}
    texts["status"][:] = PENDING
    for i, case in enumerate(cases(study, plan.points())):
        found = store.find(case.key)
        if found is None:
            continue
        for name in names:
            numbers[name][i] = found.quantities[name]
        numbers["wall_s"][i] = found.wall_s
        texts["status"][i], texts["message"][i] = found.status, found.message
    dims, coords = _coordinates(study, plan)
    data = {name: (dims, values.reshape(plan.shape)) for name, values in (numbers | texts).items()}
    dataset = xr.Dataset(data, coords, _attributes(study))
    for name in names:
        dataset[name].attrs = {"units": QUANTITIES[name].units, "long_name": QUANTITIES[name].long_name}
    dataset["wall_s"].attrs = {"units": "s", "long_name": "time that the case took"}
    dataset["status"].attrs = {"long_name": "ok, failed, or pending where the study was interrupted"}
    dataset["message"].attrs = {"long_name": "why the case failed"}
    return dataset


def _coordinates(study: Study, plan: Plan) -> tuple[list[str], dict[str, Any]]:
    """Dims, and coordinates with their units: an axis each in a grid, all along ``case`` in a sample."""
    facts = {axis.name: {"units": units_of(axis.name), "long_name": axis.name} for axis in study.axes}
    if isinstance(plan, Grid):
        dims = [axis.name for axis in plan.axes]
        return dims, {axis.name: (axis.name, np.array(axis.values), facts[axis.name]) for axis in plan.axes}
    coords: dict[str, Any] = {"case": np.arange(len(plan))}
    return ["case"], coords | {
        name: ("case", column, facts[name]) for name, column in zip(plan.names, plan.rows.T, strict=True)
    }


def _attributes(study: Study) -> dict[str, Any]:
    """Everything that the numbers depend on; times of day are left out, so that a study made again is the same."""
    return {
        "schema": 1,
        "title": study.title,
        "engine": study.engine,
        "groups": list(study.groups),
        "seed": study.seed if study.sample is None else study.sample.seed,
        "study": study.text,
        "rig": json.dumps(study.rig, sort_keys=True),
        "program": json.dumps({k: v for k, v in study.program.items() if k not in ("drive_mm", "time_s")}),
        "versions": json.dumps(versions(study.engine)),
        "code_sha256": code_version(study.engine),
        "inputs_sha256": json.dumps({path.name: digest for path, digest in study.inputs.items()}),
    }


def write_dataset(dataset: xr.Dataset, folder: Path) -> Path:
    """Write ``study.zarr`` whole or not at all: beside its place first, then renamed. What was there is replaced.

    Raises
    ------
    DiskFullError
        No room; the dataset that was there stays.
    """
    target, part, old = folder / ZARR, folder / f".{ZARR}.part", folder / f".{ZARR}.old"
    try:
        shutil.rmtree(part, ignore_errors=True)
        dataset.to_zarr(part, mode="w", zarr_format=3, consolidated=False)
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
    return target


def open_study(folder: Path) -> xr.Dataset:
    """Open the dataset of a study's folder; numbers are read when they are used.

    Raises
    ------
    StudyError
        A folder without one.
    """
    path = folder / ZARR
    if not path.exists():  # killed between the two renames
        path = folder / f".{ZARR}.old"
    if not path.exists():
        raise StudyError(f"{folder / ZARR}: no such file or directory: expected the dataset of `notchbend study`")
    data = xr.open_zarr(path, consolidated=False, chunks=None)  # plain arrays: there is little to be had by Dask here
    # texts as Python's: numpy's own text type knows no NaN, which `where` fills with
    return data.assign({name: data[name].astype(object) for name in ("status", "message")})


def ranges(dataset: xr.Dataset, names: tuple[str, ...]) -> dict[str, Mapping[str, Any]]:
    """Give the smallest and largest value of each quantity that is known anywhere, with the point where it is."""
    out: dict[str, Mapping[str, Any]] = {}
    for name in names:
        flat = dataset[name].values.ravel()
        flat = np.where(np.isfinite(flat), flat, np.nan)
        if np.isnan(flat).all():
            continue
        out[name] = {"units": QUANTITIES[name].units}
        for word, place in (("min", np.nanargmin(flat)), ("max", np.nanargmax(flat))):
            out[name][word] = {"value": float(flat[place]), "at": _point(dataset, int(place))}  # type: ignore[index]
    return out


def _point(dataset: xr.Dataset, place: int) -> dict[str, float]:
    if list(dataset.status.dims) == ["case"]:
        return {str(n): float(c.values[place]) for n, c in dataset.coords.items() if n != "case"}
    index = np.unravel_index(place, dataset.status.shape)
    return {str(d): float(dataset[d].values[i]) for d, i in zip(dataset.status.dims, index, strict=True)}
