"""Make the ensemble of a preset and the files that keep it: ``python -m docs.make.calibration.sample`` calls it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.ensemble import MODEL, with_constants
from validation.measured.ensemble.posterior import LogLikelihood, Posterior, r_hat, sample
from validation.measured.ensemble.priors import MechanismSet
from validation.measured.readings.loops import loops_of
from validation.measured.readings.statements import STATEMENTS, judge, met_but_peak

LIBRARIES = ("notchbend", "numpy", "scipy", "numba", "nautilus-sampler")
RUNS = 2
"""Independent runs of a model: R-hat compares them."""
_DIGITS = 8


@dataclass(frozen=True)
class Settings:
    """Seed, live points and effective draws of a run of nautilus, and number of members of the ensemble."""

    seed: int = 0
    live: int = 300
    effective: int = 1000
    members: int = 200


@dataclass(frozen=True)
class ModelResult:
    """What the static statements say of one model.

    ``odds`` is the probability of the model among all, each as likely beforehand; ``r_hat`` compares the runs.
    ``met`` has how many members meet each statement, ``meeting`` how many meet all but the peak at 1 Hz.
    """

    runs: tuple[Posterior, ...]
    odds: float
    r_hat: float
    members: tuple[Mapping[str, float], ...]
    met: Mapping[str, int]
    meeting: int


def make_ensemble(
    base: Rig,
    models: Mapping[str, MechanismSet],
    reading: str,
    settings: Settings,
    *,
    pool: Executor | None = None,
    keep: Path | None = None,
) -> dict[str, ModelResult]:
    """Draw for all models, and give each members in proportion to its odds; repeatable whatever the ``pool``.

    Runs are stored in the folder ``keep``, if there is one, and taken from there: a command that was stopped goes on.
    """
    asked = [
        (LogLikelihood(base, model, reading), settings, RUNS * k + run, _kept_at(keep, f"{name}-{reading}-{run}"))
        for k, (name, model) in enumerate(models.items())
        for run in range(RUNS)
    ]
    found = iter((map if pool is None else pool.map)(_run, asked))
    runs = {name: tuple(next(found) for _ in range(RUNS)) for name in models}
    evidence = np.array([np.logaddexp.reduce([one.log_evidence for one in own]) for own in runs.values()])
    odds = np.exp(evidence - np.logaddexp.reduce(evidence))
    counts = apportioned(odds, settings.members)
    return {
        name: _result(base, models[name], reading, own, float(share), count)
        for (name, own), share, count in zip(runs.items(), odds, counts, strict=True)
    }


def _kept_at(folder: Path | None, name: str) -> Path | None:
    return None if folder is None else folder / f"{name.replace(', ', '-').replace(' ', '_')}.npz"


def _run(asked: tuple[LogLikelihood, Settings, int, Path | None]) -> Posterior:
    """Take a run from its file, or make it and put it there."""
    likelihood, settings, number, path = asked
    seed = settings.seed + number
    same = np.array([settings.live, settings.effective, seed])
    if path is not None and path.exists():
        with np.load(path) as data:
            if (data["asked"] == same).all():
                return Posterior(data["quantiles"], data["weight"], float(data["log_evidence"]), int(data["runs"]))
    found = sample(likelihood, live=settings.live, effective=settings.effective, seed=seed)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(path, asked=same, **vars(found))
    return found


def _result(
    base: Rig, model: MechanismSet, reading: str, runs: tuple[Posterior, ...], odds: float, count: int
) -> ModelResult:
    least = int(min(one.effective for one in runs))
    rows = np.concatenate([one.resampled(-(-count // RUNS), k) for k, one in enumerate(runs)])[:count]
    members = tuple(model.chosen(row) for row in rows)
    judged = [judge(loops_of(with_constants(base, one)), reading) for one in members]
    met = {name: sum(one.met[name] for one in judged) for name in STATEMENTS}
    meeting = sum(met_but_peak(one) for one in judged)
    return ModelResult(runs, odds, r_hat([one.resampled(least, 0) for one in runs]), members, met, meeting)


def apportioned(odds: Sequence[float] | np.ndarray, members: int) -> list[int]:
    """Whole numbers in proportion to the odds that add up to ``members``, by largest remainders."""
    exact = np.asarray(odds) * members
    counts = np.floor(exact).astype(int)
    most = np.argsort(counts - exact, kind="stable")[: members - int(counts.sum())]
    counts[most] += 1
    return [int(count) for count in counts]


def ensemble_files(
    folder: Path,
    name: str,
    found: Mapping[str, ModelResult],
    models: Mapping[str, MechanismSet],
    made: Mapping[str, object],
) -> dict[Path, str]:
    """Give the text of ``NAME-ensemble.csv`` and of its sidecar, by path; ``made`` says how they were made."""
    columns = sorted({key for one in found.values() for member in one.members for key in member})
    lines = [",".join([MODEL, *columns])]
    for title, one in found.items():
        for member in one.members:
            cells = (member.get(key) for key in columns)
            lines.append(",".join([f'"{title}"', *("" if c is None else f"{c:.{_DIGITS}g}" for c in cells)]))
    path = folder / f"{name}-ensemble.csv"
    return {path: "\n".join(lines) + "\n", path.with_suffix(".toml"): _sidecar(found, models, made)}


def _sidecar(found: Mapping[str, ModelResult], models: Mapping[str, MechanismSet], made: Mapping[str, object]) -> str:
    """How the members were made, what the models met, and all priors with their sources, as TOML."""
    lines = [
        "schema = 2",
        'command = "python -m docs.make.calibration.sample"',
        *(f"{key} = {json.dumps(value)}" for key, value in made.items()),
        "[versions]",
        *(f"{library} = {json.dumps(version(library))}" for library in LIBRARIES),
    ]
    for title, one in found.items():
        lines += [
            f"[models.{json.dumps(title)}]",
            f"log_evidence = [{', '.join(f'{run.log_evidence:.3f}' for run in one.runs)}]",
            f"odds = {one.odds:.4g}",
            f"effective_draws = [{', '.join(f'{run.effective:.0f}' for run in one.runs)}]",
            f"r_hat = {one.r_hat:.4f}",
            f"rigs_run = {sum(run.runs for run in one.runs)}",
            f"members = {len(one.members)}",
            f"meet_all = {one.meeting}",
            f"meet = {{ {', '.join(f'{json.dumps(key)} = {count}' for key, count in one.met.items())} }}",
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
