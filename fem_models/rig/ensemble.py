"""Ensembles of presets: rigs that agree with the same statements, with different values of what these do not fix.

An ensemble is a file next to this module, ``NAME-ensemble.csv``: one row a rig, one column a constant by its name in a
rig file (``tendon.`` stands for both tendons). An empty cell keeps the value of the preset. ``model`` names
the laws of a row. ``NAME-ensemble.toml`` says which command made the file, with its seed, versions and priors.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from fem_models.rig.checks import RigError
from fem_models.rig.presets import PRESETS, preset
from fem_models.rig.rig import Rig
from fem_models.rig.rig_file import rig_of_tables
from hysteresis.arguments import checked

MODEL = "model"
"""Column with the laws of a row; all others are constants."""


def ensemble_file(name: str) -> Path:
    """Where the ensemble of a preset is kept, or would be."""
    return Path(__file__).with_name(f"{name}-ensemble.csv")


def presets_with_ensemble() -> tuple[str, ...]:
    """Names of the presets that have an ensemble."""
    return tuple(name for name in PRESETS if ensemble_file(name).exists())


def with_constants(rig: Rig, values: Mapping[str, float]) -> Rig:
    """Return the rig with constants changed, by their dotted names in a rig file; ``tendon.`` stands for both tendons.

    A table that the rig does not have is added.

    Raises
    ------
    RigError
        An unknown name, or an impossible value.
    """
    tables = rig.to_dict()
    for name, value in values.items():
        part, _, key = name.rpartition(".")
        if not part:
            tables[key] = value
            continue
        for table in [f"tendon_{side}" for side in "ab"[: len(rig.tendons)]] if part == "tendon" else [part]:
            tables[table] = {**tables.get(table, {}), key: value}
    return rig_of_tables(tables, f"rig {rig.name}")


@lru_cache
def member_constants(name: str) -> tuple[Mapping[str, float], ...]:
    """Constants of every member of a preset's ensemble, by their names in a rig file.

    Raises
    ------
    RigError
        A preset without an ensemble.
    """
    if name not in presets_with_ensemble():
        known = ", ".join(presets_with_ensemble())
        raise RigError(f"ensemble of {name}: expected a preset that has one: {known}")
    with ensemble_file(name).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return tuple({key: float(value) for key, value in row.items() if key != MODEL and value} for row in rows)


@lru_cache
def _rigs(name: str) -> tuple[Rig, ...]:
    constants = member_constants(name)
    base = preset(name)
    return tuple(with_constants(base, one) for one in constants)


@checked
def ensemble(name: str, *, preload_N: float | None = None) -> tuple[Rig, ...]:
    """Return the rigs of a preset's ensemble, at another preload if one is given.

    They are drawn from what the paper says of its loops, with its errors; what they say about anything else is a range.
    Those of ``"du2018"`` take the printed widths as half widths, those of ``"du2018-full-widths"`` as full ones, as the
    presets do.

    Parameters
    ----------
    name
        A preset that has one: ``"du2018"`` or ``"du2018-full-widths"``.
    preload_N
        Tension of the tendons at rest, N; by default that of the preset.

    Raises
    ------
    RigError
        A preset without an ensemble, or an impossible preload.

    Examples
    --------
    >>> len(nb.ensemble("du2018", preload_N=10.0))
    200
    """
    rigs = _rigs(name)
    return rigs if preload_N is None else tuple(replace(rig, preload_N=preload_N) for rig in rigs)
