"""Make the ensemble of du2018 and the files that keep it: ``python -m docs.make.calibration.sample`` calls it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.ensemble import MODEL
from validation.measured.ensemble.draws import Draws, draw
from validation.measured.ensemble.facts import PAPER, Facts
from validation.measured.ensemble.members import Member, extend
from validation.measured.ensemble.priors import Model
from validation.measured.preset_du2018 import READING

LIBRARIES = ("notchbend", "numpy", "scipy", "numba", "emcee")
LEAST_EFFECTIVE = 5.0
"""Effective draws of a model below which it has no members: walkers that start from one draw stay copies of it."""
_DIGITS = 10  # of a constant: widths are steeper in it than a hundredth of their resolution


@dataclass(frozen=True)
class ModelResult:
    """What the facts say of one model.

    ``solved`` is the share of the draws that show the three numbers, ``evidence`` their density with its standard
    error, ``place`` the probability of the place of the widest point given the numbers, with its standard error,
    ``odds`` the probability of the model among all, each as likely beforehand. ``moved`` is the share of the steps of
    the sampler that were taken, NaN where it made no member. ``widest_at_mm`` are the 5, 50 and 95 % quantiles of the
    drive's magnitude where the loops of 10 and 20 N are widest, given the three numbers alone. ``effective`` is the
    number of independent draws that the members start from, ``effective_of_numbers`` that of the draws that show the
    three numbers.
    """

    draws: int
    solved: float
    evidence: tuple[float, float]
    place: tuple[float, float]
    widest_at_mm: tuple[tuple[float, ...], tuple[float, ...]]
    odds: float
    effective: float
    effective_of_numbers: float
    moved: float
    members: tuple[Member, ...]


@dataclass(frozen=True)
class Settings:
    """Seed, number of draws of a model, a power of two, and number of members of the ensemble."""

    seed: int
    draws: int
    members: int


def make_ensemble(
    base: Rig,
    models: Mapping[str, Model],
    settings: Settings,
    *,
    goal: Facts = PAPER,
    pool: Executor | None = None,
    keep: Path | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> dict[str, ModelResult]:
    """Draw for all models, and give each members in proportion to its odds; repeatable whatever the ``pool``.

    A model with fewer effective draws than :data:`LEAST_EFFECTIVE` has odds, but no members. Draws are stored in the
    folder ``keep``, if there is one, and taken from there: a run that was stopped goes on.

    Raises
    ------
    ValueError
        No model has enough effective draws.
    """
    mapper = map if pool is None else partial(pool.map, chunksize=8)
    drawn: dict[str, Draws] = {}
    for k, (name, model) in enumerate(models.items()):
        drawn[name] = _kept(
            keep,
            name,
            partial(draw, base, model, int(model.part * settings.draws), settings.seed + k, goal=goal, mapper=mapper),
            settings,
        )
        tell(f"{name}: evidence {drawn[name].evidence[0]:.3g}, place {drawn[name].place_share[0]:.3g}")
    weight = np.array([one.evidence[0] * one.place_share[0] for one in drawn.values()])
    odds = weight / weight.sum()
    enough = np.array([one.effective >= LEAST_EFFECTIVE for one in drawn.values()])
    if not enough.any():
        raise ValueError(f"no model has {LEAST_EFFECTIVE:g} effective draws: expected more draws")
    counts = dict(zip(models, apportioned(weight * enough / (weight @ enough), settings.members), strict=True))
    found = {}
    for k, (name, model) in enumerate(models.items()):
        members: list[Member] = []
        moved = float("nan")
        if counts[name]:
            seed = settings.seed + len(models) + k
            members, moved = extend(base, model, drawn[name], counts[name], seed, goal=goal, pool=pool)
            tell(f"{name}: {len(members)} members, {100 * moved:.0f} % of the steps moved")
        one, share = drawn[name], float(odds[k])
        solved = float((one.weight > 0).mean())
        found[name] = ModelResult(
            one.rows.shape[0],
            solved,
            one.evidence,
            one.place_share,
            one.places_mm,
            share,
            one.effective,
            one.effective_of_numbers,
            moved,
            tuple(members),
        )
    return found


def _kept(folder: Path | None, name: str, make: Callable[[], Draws], settings: Settings) -> Draws:
    """Take draws of the same model, seed and number from a folder, or make them and put them there."""
    if folder is None:
        return make()
    path = folder / f"{name.replace(', ', '-').replace(' ', '_')}-{settings.seed}-{settings.draws}.npz"
    if path.exists():
        with np.load(path) as data:
            return Draws(data["quantiles"], data["rows"], tuple(data["columns"].tolist()))
    found = make()
    folder.mkdir(parents=True, exist_ok=True)
    np.savez(path, quantiles=found.quantiles, rows=found.rows, columns=np.array(found.columns))
    return found


def apportioned(odds: Sequence[float] | np.ndarray, members: int) -> list[int]:
    """Whole numbers in proportion to the odds that add up to ``members``, by largest remainders."""
    exact = np.asarray(odds) * members
    counts = np.floor(exact).astype(int)
    most = np.argsort(counts - exact, kind="stable")[: members - int(counts.sum())]
    counts[most] += 1
    return [int(count) for count in counts]


def ensemble_files(
    folder: Path, name: str, found: Mapping[str, ModelResult], models: Mapping[str, Model], settings: Settings
) -> dict[Path, str]:
    """Give the text of ``NAME-ensemble.csv`` and of its sidecar, by path."""
    columns = sorted({key for one in found.values() for member in one.members for key in member.constants})
    lines = [",".join([MODEL, *columns])]
    for title, one in found.items():
        for member in one.members:
            cells = (member.constants.get(key) for key in columns)
            lines.append(",".join([f'"{title}"', *("" if c is None else f"{c:.{_DIGITS}g}" for c in cells)]))
    path = folder / f"{name}-ensemble.csv"
    return {path: "\n".join(lines) + "\n", path.with_suffix(".toml"): _sidecar(found, models, settings)}


def _sidecar(found: Mapping[str, ModelResult], models: Mapping[str, Model], settings: Settings) -> str:
    """How the members were made, what the models met, and all priors with their sources, as TOML."""
    lines = [
        "schema = 1",
        'command = "python -m docs.make.calibration.sample"',
        f"reading = {json.dumps(f'{READING} widths')}",
        *(f"{key} = {value}" for key, value in vars(settings).items()),
        "[versions]",
        *(f"{library} = {json.dumps(version(library))}" for library in LIBRARIES),
    ]
    for title, one in found.items():
        lines += [
            f"[models.{json.dumps(title)}]",
            f"draws = {one.draws}",
            f"solved_share = {one.solved:.4g}",
            f"evidence = [{one.evidence[0]:.4g}, {one.evidence[1]:.2g}]",
            f"place_probability = [{one.place[0]:.4g}, {one.place[1]:.2g}]",
            *(
                f"widest_at_{preload}N_mm = [{', '.join(f'{x:.1f}' for x in at)}]"
                for preload, at in zip((10, 20), one.widest_at_mm, strict=True)
            ),
            f"odds = {one.odds:.4g}",
            f"effective_draws = {one.effective:.1f}",
            f"effective_draws_of_numbers = {one.effective_of_numbers:.1f}",
            f"members = {len(one.members)}",
            *([f"moved_share = {one.moved:.4g}"] if one.members else []),
        ]
    priors = {key: prior for model in models.values() for key, prior in model.priors.items()}
    for key, prior in priors.items():
        lines += [
            f"[priors.{json.dumps(key)}]",
            f"low = {prior.low!r}",
            f"high = {prior.high!r}",
            f"uniform_in = {json.dumps('logarithm' if prior.log else 'value')}",
            f"source = {json.dumps(prior.source)}",
        ]
    return "\n".join(lines) + "\n"
