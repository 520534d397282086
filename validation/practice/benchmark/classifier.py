"""Another way to trace a residual: a classifier of its features, with scikit-learn, trained on other seeds.

A random forest (Breiman 2001, doi 10.1023/A:1010933404324) votes for an effect, for none, or for something outside the
catalogue. It names an effect if enough trees do; how many is chosen on its training cases by the trees that have not
seen them. Needs ``pip install notchbend[comparison]``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from validation.practice.benchmark.answers import CaseAnswer, NamedEffect
from validation.practice.benchmark.features import features
from validation.practice.benchmark.terms import residual_terms
from validation.practice.benchmark.training import FALSE_ALARMS, read_training

TREES = 600
ALIKE = 0.5
"""Part of the votes of the first effect from which another one is not distinguished."""
SEED = 20_261_200
VERDICTS = ("none", "unexplained")


@dataclass(frozen=True, eq=False)
class Forest:
    """A trained forest: ``model`` of scikit-learn, the names it votes for, and the votes that a name needs."""

    model: Any
    names: tuple[str, ...]
    votes_needed: float


@dataclass(frozen=True)
class ClassifierAnswerer:
    """Answers cases with the forest of a file of examples (:mod:`validation.practice.benchmark.training`)."""

    training: Path

    def __call__(self, records: Sequence[Record]) -> CaseAnswer:
        """Answer a case."""
        forest = forest_of(self.training)
        votes = forest.model.predict_proba(features(records, residual_terms(records))[None])[0]
        return answer_of_votes(forest, votes)


@cache
def forest_of(training: Path) -> Forest:
    """Train the forest of a file of examples.

    Raises
    ------
    RecordError
        A file that is missing or malformed.
    """
    from sklearn.ensemble import RandomForestClassifier  # an extra

    examples = read_training(training).examples
    truth = np.array([one.truth for one in examples])
    model = RandomForestClassifier(
        TREES, min_samples_leaf=2, class_weight="balanced_subsample", oob_score=True, random_state=SEED, n_jobs=1
    )
    model.fit(np.array([one.features for one in examples]), truth)
    names = tuple(str(name) for name in model.classes_)
    return Forest(model, names, votes_needed(names, np.nan_to_num(model.oob_decision_function_), truth.tolist()))


def votes_needed(names: Sequence[str], votes: Floats, truth: Sequence[str]) -> float:
    """Least part of the votes at which few enough clean cases get a name, from votes of trees that never saw them."""
    clean = np.array([one == "none" for one in truth])
    effects = np.array([name not in VERDICTS for name in names])
    if not clean.any():
        return 0.0
    strongest = np.where(np.isin(votes.argmax(axis=1), np.flatnonzero(effects)), votes[:, effects].max(axis=1), 0.0)
    return float(np.quantile(strongest[clean], 1.0 - FALSE_ALARMS))


def answer_of_votes(forest: Forest, votes: Floats) -> CaseAnswer:
    """Answer from the part of the trees that vote for each name."""
    order = [int(k) for k in np.argsort(-votes)]
    first = forest.names[order[0]]
    if first in VERDICTS:
        return CaseAnswer(1, first)
    if votes[order[0]] <= forest.votes_needed:
        return CaseAnswer(1, "unexplained")
    alike = [forest.names[k] for k in order[1:] if votes[k] >= ALIKE * votes[order[0]]]
    effects = tuple(name for name in alike if name not in VERDICTS)
    return CaseAnswer(1, "ambiguous" if effects else "effect", (NamedEffect(first, effects, {}),))
