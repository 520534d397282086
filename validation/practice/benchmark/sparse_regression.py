"""Another way to trace a residual: sparse regression of it by terms of the field, with PySINDy.

Sequentially thresholded least squares (Brunton, Proctor, Kutz 2016, doi 10.1073/pnas.1517384113) keeps few terms of
:mod:`validation.practice.benchmark.terms`. Each stands for an effect; the effect whose terms explain most is named. The
thresholds were chosen on practice seeds, see ``docs/validation/benchmark.md``. Needs ``notchbend[comparison]``.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from validation.practice.benchmark.answers import CaseAnswer, NamedEffect
from validation.practice.benchmark.terms import ResidualTerms, residual_terms
from validation.practice.outcome import MOST_REPORTED

RIDGE = 1e-6


@dataclass(frozen=True)
class Thresholds:
    """What is chosen on practice seeds.

    Parameters
    ----------
    kept
        Least coefficient of a term of unit rms, over the rms of the residual.
    nothing
        Residual over the noise up to which nothing is missing.
    explained
        Least part of the residual's mean square that the kept terms explain, for an effect to be named.
    alike
        Part of the best effect's gain from which another effect alone is not distinguished.
    """

    kept: float = 0.2
    nothing: float = 1.5
    explained: float = 0.5
    alike: float = 0.9


CHOSEN = Thresholds()


def by_sparse_regression(records: Sequence[Record]) -> CaseAnswer:
    """Answer a case."""
    return judge_terms(residual_terms(records), CHOSEN)


def judge_terms(found: ResidualTerms, thresholds: Thresholds) -> CaseAnswer:
    """Answer from the residual and its terms."""
    if found.over_noise < thresholds.nothing:
        return CaseAnswer(1, "none", (), _heldout(found, found.terms[:, :0]))
    coefficients = sparse_coefficients(found, thresholds.kept)
    gains = group_gains(found)
    kept = sorted({e for e, c in zip(found.effects, coefficients, strict=True) if c}, key=lambda e: -gains[e])
    columns = found.terms[:, coefficients != 0]
    if not kept or _explained(found.residual_deg, columns) < thresholds.explained:
        return CaseAnswer(1, "unexplained", (), _heldout(found, found.terms[:, :0]))
    best = kept[0]
    alike = [
        e for e in sorted(gains, key=lambda e: -gains[e]) if e != best and gains[e] >= thresholds.alike * gains[best]
    ]
    sizes = _sizes(found, coefficients != 0)
    first = NamedEffect(best, tuple(alike), sizes.get(best, {}))
    # a further effect is named if it stands beside the first, and not in its place
    others = [e for e in kept[1:] if e not in alike and _further(found, best, e) >= thresholds.explained]
    named = (first, *(NamedEffect(e, (), sizes.get(e, {})) for e in others[:2]))
    return CaseAnswer(1, "ambiguous" if alike else "effect", named, _heldout(found, columns))


def named_set(answer: CaseAnswer) -> tuple[str, ...]:
    """Give the first name of an answer and those that it may be confused with, at most three; empty without a name."""
    return tuple(name for one in answer.named[:1] for name in (one.name, *one.confusable_with))[:MOST_REPORTED]


def sparse_coefficients(found: ResidualTerms, kept: float) -> Floats:
    """Coefficients of terms of unit rms for a residual of unit rms, most of them 0; shape (k,)."""
    import pysindy  # an extra

    scale = np.sqrt(np.mean(found.terms**2, axis=0))
    unit = found.residual_deg / _rms(found.residual_deg)
    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=kept, alpha=RIDGE, max_iter=50),
        feature_library=pysindy.IdentityLibrary(),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that no term is left is an answer here
        model.fit(found.terms / scale, t=1.0, x_dot=unit[:, None])
    return np.asarray(model.coefficients())[0]


def group_gains(found: ResidualTerms) -> dict[str, float]:
    """Part of the residual's mean square that the terms of each effect explain alone."""
    effects = np.array(found.effects)
    return {str(e): _explained(found.residual_deg, found.terms[:, effects == e]) for e in dict.fromkeys(found.effects)}


def _further(found: ResidualTerms, first: str, other: str) -> float:
    """Part that another effect explains of what the first one leaves."""
    effects = np.array(found.effects)
    own, more = found.terms[:, effects == first], found.terms[:, (effects == first) | (effects == other)]
    left = 1.0 - _explained(found.residual_deg, own)
    return (_explained(found.residual_deg, more) - (1.0 - left)) / max(left, 1e-12)


def _explained(residual: Floats, columns: Floats) -> float:
    if columns.shape[1] == 0:
        return 0.0
    left = residual - columns @ _solved(columns, residual)
    return 1.0 - float(left @ left) / float(residual @ residual)


def _heldout(found: ResidualTerms, columns: Floats) -> float:
    """Error on the last part of the records of baseline and terms that are fitted to the first part."""
    columns = np.column_stack([found.baseline, columns])
    weights = _solved(columns[found.training], found.angle_deg[found.training])
    return _rms((found.angle_deg - columns @ weights)[~found.training])


def _solved(columns: Floats, values: Floats) -> Floats:
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    return np.asarray(np.linalg.lstsq(columns / scale, values, rcond=1e-9)[0] / scale)


def _sizes(found: ResidualTerms, kept: Floats) -> dict[str, dict[str, float]]:
    """Constants that are a coefficient: the delay alone, as the term is the speed of the angle."""
    columns = [k for k, name in enumerate(found.names) if kept[k] or name == "speed of the angle"]
    weights = dict(zip(columns, _solved(found.terms[:, columns], found.residual_deg), strict=True))
    at = [k for k in columns if found.names[k] == "speed of the angle"]
    return {"time_delay": {"delay_s": float(weights[at[0]])}} if at else {}


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
