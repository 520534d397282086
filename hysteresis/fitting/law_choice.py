"""The law of h, chosen by folds within the training samples; the held-out samples report and take no part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hysteresis.arrays import Floats, Ints
from hysteresis.fitting.form import Form, rmse
from hysteresis.fitting.model_choice import find_model
from hysteresis.fitting.samples import join
from hysteresis.fitting.search import COARSE, Effort, Found, polish
from hysteresis.laws.backbone import Kinematics
from hysteresis.laws.elements import LAWS, LawName
from hysteresis.records.folds import inner_folds
from hysteresis.records.holdout import Split
from hysteresis.records.path import branches
from hysteresis.records.record import Record

_FOLD_SAMPLES = 500  # of a record, in the fit of a fold
CONTAINED: dict[LawName, LawName] = {
    "asymmetric-bouc-wen": "bouc-wen",
    "generalised-prandtl-ishlinskii": "prandtl-ishlinskii",
}
"""Law -> the law with fewer constants that it contains."""


@dataclass(frozen=True)
class Candidate:
    """One law, fitted: its errors in the folds that choose, and in the samples that report.

    ``excess`` is the mean squared error in the folds above that of the best law, deg^2, and ``excess_error`` its
    standard error, from pairs of branches.
    """

    law: LawName
    title: str
    constants: int
    inner_rmse_deg: float
    train_rmse_deg: float
    heldout_rmse_deg: float
    excess: float
    excess_error: float
    found: Found


_ERRORS = ". rmse in "  # begins the second sentence of a reason


@dataclass(frozen=True)
class LawChoice:
    """The candidates in the order of their constants, the chosen one, how the folds are made, and the reason."""

    candidates: tuple[Candidate, ...]
    chosen: Candidate
    by: str
    reason: str

    @property
    def why(self) -> str:
        """The reason without the errors of the candidates."""
        return self.reason.partition(_ERRORS)[0]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        names = ("title", "constants", "inner_rmse_deg", "train_rmse_deg", "heldout_rmse_deg")
        rows = [{"law": c.law} | {name: getattr(c, name) for name in names} for c in self.candidates]
        return {"chosen": self.chosen.title, "by": self.by, "reason": self.reason, "candidates": rows}


def searches(wanted: str) -> int:
    """Count the global searches that :func:`fit_laws` makes in addition to that of the Bouc-Wen element."""
    return {"auto": 2, "bouc-wen": 0, "asymmetric-bouc-wen": 0}.get(wanted, 1)


def fit_laws(
    records: Sequence[Record],
    splits: Sequence[Split],
    bases: Sequence[Kinematics] | None,
    bouc_wen: Found,
    efforts: Sequence[Effort],
    wanted: LawName | None,
) -> dict[str, Found]:
    """Fit the laws to the training samples.

    Parameters
    ----------
    records, splits, bases, efforts
        As :func:`hysteresis.fitting.model_choice.find_model`.
    bouc_wen
        The Bouc-Wen model of the records, with hysteresis.
    wanted
        The one law that is needed (and the one that it contains); None for all, and for two Bouc-Wen elements.

    Returns
    -------
    dict
        Title -> model.
    """
    found = {LAWS["bouc-wen"].title: bouc_wen}
    needed = set(LAWS) if wanted is None else {wanted, CONTAINED.get(wanted, wanted)}
    form = Form(
        (), groups=bouc_wen.form.groups, longest_delay_s=bouc_wen.form.longest_delay_s, place=bouc_wen.form.place
    )
    for name, law in LAWS.items():
        if name == "bouc-wen" or name not in needed:
            continue
        inner = found[LAWS[CONTAINED[name]].title] if name in CONTAINED else None
        if inner is not None and (inner.point.sign == 0 or inner.form.elements > 1):
            continue
        one = find_model(records, splits, bases, replace(form, base_law=law), efforts, 1, inner, bouc_wen.form)
        found[law.title] = one
    if wanted is None and bouc_wen.form.elements == 1:
        found[_title(2)] = find_model(records, splits, bases, form, efforts, 2, near=bouc_wen.form)
    return found


def _title(elements: int) -> str:
    return LAWS["bouc-wen"].title if elements == 1 else f"{elements} Bouc-Wen elements"


def choose_law(records: Sequence[Record], splits: Sequence[Split], found: dict[str, Found]) -> LawChoice:
    """Choose the law of the fewest constants whose error in inner folds is within one standard error of the best.

    The rule is that of Breiman, Friedman, Olshen and Stone (Classification and Regression Trees, 1984, section 3.4.3);
    among laws of as many constants, the least error counts. In each fold, all unknowns are refitted without its angles.
    Differences are paired by branch, and the standard error is that of their mean.
    """
    folds = [inner_folds(record, split) for record, split in zip(records, splits, strict=True)]
    squares = {title: _fold_squares(records, splits, folds, one) for title, one in found.items()}
    weights = next(iter(squares.values()))[1]
    means = {title: float(of_units.sum() / weights.sum()) for title, (of_units, _) in squares.items()}
    best = min(means, key=lambda title: means[title])
    outer = [join(records, [getattr(s, part) for s in splits], timed=_timed(found)) for part in ("train", "heldout")]
    candidates = []
    for title, one in found.items():
        difference = squares[title][0] - squares[best][0]
        train, heldout = (rmse(samples, one.form, one.point) for samples in outer)
        candidates.append(
            Candidate(
                law=one.form.base_law.name,
                title=title,
                constants=one.form.base_law.size * one.form.elements,
                inner_rmse_deg=float(np.sqrt(means[title])),
                train_rmse_deg=train,
                heldout_rmse_deg=heldout,
                excess=float(difference.sum() / weights.sum()),
                excess_error=_standard_error(difference, weights),
                found=one,
            )
        )
    candidates.sort(key=lambda c: (c.constants, c.inner_rmse_deg))
    chosen = next(c for c in candidates if c.excess <= c.excess_error)
    by = "; ".join(dict.fromkeys(split.by for of_record in folds for split in of_record[:1]))
    return LawChoice(tuple(candidates), chosen, by, _reason(candidates, chosen, by))


def _timed(found: dict[str, Found]) -> bool:
    return next(iter(found.values())).form.longest_delay_s > 0


def _standard_error(difference: Floats, weights: Floats) -> float:
    """Return the standard error of a ratio of sums over units: sum of d over sum of w."""
    used = weights > 0
    d, w = difference[used], weights[used]
    ratio, k = d.sum() / w.sum(), len(d)
    return float(np.sqrt(k / max(1, k - 1) * np.sum((d - ratio * w) ** 2)) / w.sum())


def _fold_squares(
    records: Sequence[Record], splits: Sequence[Split], folds: Sequence[Sequence[Split]], found: Found
) -> tuple[Floats, Floats]:
    """Sum the squared errors in the folds for each branch of each record, and count their samples."""
    timed = found.form.longest_delay_s > 0
    units = _units(records)
    squares, counts = np.zeros(units.max() + 1), np.zeros(units.max() + 1)
    for k in range(max(len(of_record) for of_record in folds)):
        pairs = [
            (one[k].train, one[k].heldout) if k < len(one) else (split.train, np.zeros_like(split.train))
            for one, split in zip(folds, splits, strict=True)
        ]
        few = join(records, [train for train, _ in pairs], timed=timed).thinned(_FOLD_SAMPLES * len(records))
        point = polish(few, found.form, found.point, tolerance=COARSE)[0] if found.point.sign else found.point
        mask = np.concatenate([heldout for _, heldout in pairs])
        whole = join(records, [train | heldout for train, heldout in pairs], timed=timed)
        error = (found.form.angle(whole, point) - whole.angle_deg)[mask]
        squares += np.bincount(units[mask], error**2, len(squares))
        counts += np.bincount(units[mask], minlength=len(counts))
    return squares, counts


def _units(records: Sequence[Record]) -> Ints:
    """Give each sample the number of its branch, over all records, shape (m,)."""
    numbers, first = [], 0
    for record in records:
        of_record = np.zeros(len(record.drive), dtype=np.int64)
        parts = branches(record.drive)
        for i, branch in enumerate(parts):
            of_record[branch] = first + i
        numbers.append(of_record)
        first += len(parts)
    return np.concatenate(numbers)


def _reason(candidates: Sequence[Candidate], chosen: Candidate, by: str) -> str:
    rows = ", ".join(f"{c.title} ({c.constants} constants) {c.inner_rmse_deg:.3g}" for c in candidates)
    alike = [c.title for c in candidates if c is not chosen and c.excess <= c.excess_error]
    why = "it predicts best"
    if chosen.excess > 0:
        why = "it has the fewest constants of those within one standard error of the best"
    if alike:
        why += f"; not distinguished from it: {', '.join(alike)}"
    return f"{chosen.title}: {why}{_ERRORS}{by} within the training samples, deg: {rows}"
