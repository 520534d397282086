"""Held-out errors of Bouc-Wen fits and of other hysteresis operators on measured records.

Bounds, starts and forms come from the training samples alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hysteresis import Fit, Record, identify, read_record
from hysteresis.arrays import Floats
from hysteresis.fitting.law_choice import LawChoice
from hysteresis.fitting.samples import join
from hysteresis.fitting.search import polish, with_curve_of
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.records.holdout import Split, hold_out
from hysteresis.records.record import RecordError
from validation.layer.comparators import Kind, fit_operator
from validation.layer.interpolation import between_fits, between_operators, within_fit, within_operator

SLACK = ("catheter-slack-0.1hz", "catheter-slack-0.3hz")
SINGLE = ("surgical-manipulator-0-80", "tee-probe-antero-posterior")
CATHETER_RATES_HZ = (0.1, 0.2, 0.3)
DAVINCI_RATES = ("0.1hz", "0.3hz")
_DELAYED = IdentifySettings(delay=True)
OPERATORS: dict[Kind, str] = {
    "play": "play, f(P[x])",
    "pi": "Prandtl-Ishlinskii of 10, f(x) + sum w P[x]",
    "pi-inside": "Prandtl-Ishlinskii of 10, f(sum w P[x])",
}


@dataclass(frozen=True)
class Score:
    """Held-out and training RMSE of a model over all records, deg.

    ``percents`` has the held-out RMSE of each record in percent of the record's range.
    """

    model: str
    rmse_deg: float
    train_rmse_deg: float | None
    percents: tuple[float, ...]


@dataclass(frozen=True)
class RecordScores:
    """Scores of all models on one record, and how its held-out samples were chosen."""

    record: str
    heldout_by: str
    scores: tuple[Score, ...]


def score(model: str, records: Sequence[Record], predicted: Sequence[Floats], splits: Sequence[Split]) -> Score:
    """Compute the errors of predictions of whole records, shapes (m_i,)."""
    residuals = [angle - record.angle_deg for record, angle in zip(records, predicted, strict=True)]

    def rms(parts: Sequence[Floats]) -> float:
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))

    heldout = [residual[split.heldout] for residual, split in zip(residuals, splits, strict=True)]
    train = [residual[split.train] for residual, split in zip(residuals, splits, strict=True)]
    percents = tuple(
        100 * rms([part]) / float(np.ptp(record.angle_deg)) for part, record in zip(heldout, records, strict=True)
    )
    return Score(model, rms(heldout), rms(train) if sum(map(len, train)) else None, percents)


def form_name(fit: Fit) -> str:
    """Name a fit by its elements and its delay."""
    elements = "one element" if fit.form.elements == 1 else f"{fit.form.elements} elements"
    delay = fit.form.delay_s(fit.point.q)
    return f"Bouc-Wen, {elements}" + (f", delay {1e3 * delay:.0f} ms" if delay else "")


def compare(records: Sequence[Record], splits: Sequence[Split], *, delay: bool) -> tuple[Score, ...]:
    """Fit all models to the same training samples and score them."""
    scores = []
    fits = [
        identify(records, settings=IdentifySettings(elements=elements, delay=delay), splits=splits)
        for elements in (1, None)
    ]
    labels = ["", ", chosen inside the training samples"]
    for fit, label in zip(fits, labels, strict=True):
        predicted = [fit.predict(r.drive, r.time_s, i) for i, r in enumerate(records)]
        scores.append(score(form_name(fit) + label, records, predicted, splits))
    longest = fits[0].form.longest_delay_s
    for kind, label in OPERATORS.items():
        operator = fit_operator(kind, records, splits, longest_delay_s=longest)
        predicted = [operator.predict(record, i) for i, record in enumerate(records)]
        scores.append(score(label, records, predicted, splits))
    return tuple(scores)


def single_records(folder: Path) -> list[RecordScores]:
    """Score each record of :data:`SINGLE`, fitted alone."""
    found = []
    for name in SINGLE:
        record = read_record(folder / f"{name}.csv")
        split = hold_out(record)
        found.append(RecordScores(name, split.by, compare([record], [split], delay=False)))
    return found


def largest_amplitudes(record: Record, rate_Hz: float) -> Split:
    """Train on the first two periods of a decaying sine; the smaller amplitudes are held out."""
    assert record.time_s is not None
    train = record.time_s - record.time_s[0] <= 2 / rate_Hz
    return Split(train, ~train, "the five smaller amplitudes")


def catheter(folder: Path) -> tuple[Score, ...]:
    """Predict the smaller amplitudes of the catheter from the two largest, three rates jointly."""
    records = [read_record(folder / f"catheter-taut-{rate:g}hz.csv") for rate in CATHETER_RATES_HZ]
    splits = [largest_amplitudes(record, rate) for record, rate in zip(records, CATHETER_RATES_HZ, strict=True)]
    return compare(records, splits, delay=True)


def laws(folder: Path) -> list[tuple[str, LawChoice, tuple[str, ...]]]:
    """Fit each law of ``identify`` to the slack catheter: record, choice, and what was left out."""
    found = []
    for name in SLACK:
        fit = identify(read_record(folder / f"{name}.csv"), settings=IdentifySettings(law="auto"))
        if fit.choice is None:
            raise RecordError(f"{name}: no hysteresis: expected a loop")
        found.append((name, fit.choice, fit.notes))
    return found


def davinci(folder: Path) -> list[Score]:
    """Predict the da Vinci tool at 50 % load from fits at 10 and 100 %, all parameters linear in the load."""
    loads = {
        load: [read_record(folder / f"davinci-tool-load{load:03}-{r}.csv") for r in DAVINCI_RATES]
        for load in (10, 50, 100)
    }
    target, share = loads[50], (50 - 10) / (100 - 10)
    splits = [Split(np.zeros(len(r.drive), bool), np.ones(len(r.drive), bool), "all of it") for r in target]
    low, high = (identify(loads[load], settings=_DELAYED) for load in (10, 100))
    pairs = {"each load searched by itself": high, "load 100 continued from load 10": continued(low, high, loads[100])}
    scores = []
    for label, end in pairs.items():
        middle = between_fits(low, end, share)
        predicted = [middle(record.drive, record.time_s, i) for i, record in enumerate(target)]
        scores.append(score(f"Bouc-Wen, {label}", target, predicted, splits))
    everything = [*loads[10], *loads[100]]
    joint = within_fit(identify(everything, settings=_DELAYED, amplitude_by=[10, 10, 100, 100]), share)
    predicted = [joint(record.drive, record.time_s, i) for i, record in enumerate(target)]
    scores.append(score("Bouc-Wen, one f for both loads", target, predicted, splits))
    longest = low.form.longest_delay_s
    for kind, label in OPERATORS.items():
        one = within_operator(
            fit_operator(kind, everything, [hold_out(r) for r in everything], longest_delay_s=longest), share
        )
        predicted = [one.predict(r, i) for i, r in enumerate(target)]
        scores.append(score(f"{label}, one f for both loads", target, predicted, splits))
        ends = [
            fit_operator(kind, loads[load], [hold_out(r) for r in loads[load]], longest_delay_s=longest)
            for load in (10, 100)
        ]
        operator = between_operators(ends[0], ends[1], share)
        scores.append(score(label, target, [operator.predict(r, i) for i, r in enumerate(target)], splits))
    return scores


def continued(start: Fit, like: Fit, records: Sequence[Record]) -> Fit:
    """Fit records from the optimum of another fit, without a search; f has the form of the fit ``like``."""
    samples = join(records, [hold_out(record).train for record in records], timed=True).thinned(2500)
    point, _ = polish(samples, like.form, with_curve_of(like.form, samples, start.form, start.point))
    return replace(like, point=point)
