"""The result of a trace as it is stored in trace.json, and the sentences that say it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import t as student

from hysteresis.fitting.uncertainty import Parameter
from hysteresis.plain import from_plain, to_plain
from hysteresis.records.metrics import Errors, errors, leap_between_cycles
from hysteresis.sensors.readings import LEAPT
from validation.tracing.declared import differing_words, stated_values
from validation.tracing.fitting.channel_errors import ChannelTable, channel_table, channel_words, with_channel_fits
from validation.tracing.fitting.dependence import Dependence, dependences
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.folds import Estimate, share
from validation.tracing.fitting.noise import NOT_KNOWN
from validation.tracing.fitting.ranking import RankedModel, ranked_models
from validation.tracing.fitting.uncertainty import covariance
from validation.tracing.plausibility import zero_words
from validation.tracing.sensors.protocol import NOT_AS_RECORDED, OTHER_AMPLITUDE, OTHER_RATE

if TYPE_CHECKING:  # a trace makes its own report
    from validation.tracing.inference.decision import Decision
    from validation.tracing.next_experiment import Experiment
    from validation.tracing.outcome import Candidate, Trace
    from validation.tracing.second_opinion import SecondOpinion

NONE_FOUND = "These records show no missing effect."
UNNAMED = ("none", "unexplained")
"""Verdicts that name no effect."""


@dataclass(frozen=True)
class FoldErrors:
    """Errors of one model over the fitted samples and over the held-out ones, the zero of each record taken out."""

    train: Errors
    heldout: Errors


@dataclass(frozen=True)
class MultibodyErrors:
    """Errors of the multibody model with the parameters of the baseline and of the augmented model."""

    before: Errors
    after: Errors


@dataclass(frozen=True)
class EffectReport:
    """An effect that is named: its parameters with 95 % intervals, and what it brought when it was added.

    ``delta_bic`` is how much lower the criterion is than before the effect was added; ``confusable_with`` has the
    effects that explain the records as well in its place. ``p`` is its own test against the other fits with one
    effect (:mod:`validation.tracing.inference.front_runners`); None where it was not compared.
    """

    name: str
    parameters: Mapping[str, Parameter]
    confusable_with: tuple[str, ...]
    delta_bic: float
    heldout_rmse_deg: float | None
    p: float | None = None


@dataclass(frozen=True)
class FrontRunnerReport:
    """A model with effects: how often a record of it would be as far behind the best model, and what it explains."""

    name: str
    p: float
    explained_share: Estimate


@dataclass(frozen=True)
class DecisionReport:
    """What the test of :mod:`validation.tracing.inference` says by itself, beside the verdict by rules or behind it.

    ``not_distinguished`` are the models that the records do not tell apart, the best first.
    """

    verdict: str
    not_distinguished: tuple[str, ...]
    front_runners: tuple[FrontRunnerReport, ...]


@dataclass(frozen=True)
class CandidateReport:
    """An augmented model that was fitted; ``delta_bic`` is how much lower its criterion is than the baseline's.

    The held-out error is None where the model finds no equilibrium on the held-out samples.
    """

    name: str
    heldout_rmse_deg: float | None
    delta_bic: float


@dataclass(frozen=True)
class SmoothReport:
    """Free functions fitted to the residual of the baseline: of what, and the error with them over all samples."""

    names: tuple[str, ...]
    rmse_deg: float


@dataclass(frozen=True)
class ResidualReport:
    """Tests of the residual for dependence, of the baseline and of the augmented model; None where there is none."""

    before: tuple[Dependence, ...]
    after: tuple[Dependence, ...] | None


@dataclass(frozen=True)
class SampleCount:
    """Samples that were used, and how many independent ones they are worth."""

    all: int
    independent: float


@dataclass(frozen=True)
class NoiseReport:
    """Repeatability of the rig, sensor noise, and what the floor is from.

    Repeatability is of cycles or trials that repeat each other; None where there are none. Sensor noise is that of
    neighbouring samples; None where these do not tell it.
    """

    repeatability_deg: float | None
    sensor_deg: float | None
    how: str


@dataclass(frozen=True)
class LeapReport:
    """A record that is off from one sample on, against its own other cycles; a sudden leap was taken out."""

    name: str
    size_deg: float
    taken_out: bool


@dataclass(frozen=True)
class DetectionLimit:
    """Smallest size of an effect that records would have shown in nine of ten repetitions."""

    name: str
    parameter: str
    size: float
    unit: str


@dataclass(frozen=True)
class NextProgram:
    """File with the drive of the proposed record, and its preload; None where the records do not tell theirs."""

    file: str
    preload_N: float | None


@dataclass(frozen=True)
class FigureFile:
    """A figure beside the result, with its caption."""

    file: str
    caption: str


@dataclass(frozen=True)
class TraceReport:
    """What trace.json holds, field by field in its order.

    ``explained_share`` is the part of the mean square held-out error above the noise floor that the named effects take,
    or that the nearest candidate would take where none is named. ``detection_limits`` has the smallest size of each
    effect that the records would have shown, ``absorbed`` the effects that they show at no size. ``reference`` are the
    records that were compared with.
    ``declared`` has what the file of the rig states for parameters of the baseline, and ``baseline`` these as
    fitted together with the effects. ``alike`` is the difference of the criterion below which candidates are not
    distinguished. ``words`` are reasons for the verdict. ``samples_file`` has the records and models sample by sample;
    ``held_out`` says which records, then references, are held out. ``p_none`` is how often the baseline with its
    discrepancy and noise would look as much like an effect by chance, of so many ``simulations``; at ``alpha`` or below
    there is an effect. ``discrepancy_deg`` is what no effect explains, rms. They are None where ``by_test`` is.
    """

    schema: int
    records: tuple[str, ...]
    noise_floor_deg: float
    before: FoldErrors
    verdict: str
    explained_share: Estimate | None
    noise: NoiseReport
    reference: tuple[str, ...]
    effects: tuple[EffectReport, ...]
    after: FoldErrors
    detection_limits: tuple[DetectionLimit, ...]
    multibody: MultibodyErrors | None
    candidates: tuple[CandidateReport, ...]
    next_experiment: str
    rig_known: bool
    model: str
    heldout_by: str
    declared: Mapping[str, Parameter]
    words: tuple[str, ...]
    smooth: SmoothReport
    residual: ResidualReport
    samples: SampleCount
    multibody_words: str
    alike: float
    seconds: float | None
    seed: int
    next_program: NextProgram | None = None
    figures: tuple[FigureFile, ...] = ()
    channels: ChannelTable = field(default_factory=dict)
    leaps: tuple[LeapReport, ...] = ()
    samples_file: str | None = None
    held_out: tuple[bool, ...] = ()
    ranking: tuple[RankedModel, ...] = ()
    baseline: Mapping[str, Parameter] = field(default_factory=dict)
    alpha: float | None = None
    p_none: float | None = None
    discrepancy_deg: float | None = None
    simulations: int | None = None
    by_test: DecisionReport | None = None
    absorbed: tuple[str, ...] = ()

    @property
    def named(self) -> str:
        """Effects that are named, joined by a plus; empty where there is none."""
        return " + ".join(effect.name for effect in self.effects)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; a number that is not finite becomes None."""
        return dict(to_plain(self))

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], where: str = "trace.json") -> TraceReport:
        """Read a result that was stored.

        Raises
        ------
        RecordError
            One line with the field that is missing or malformed.
        """
        return from_plain(cls, values, where)


def trace_report(
    trace: Trace,
    *,
    experiment: Experiment | None = None,
    opinion: SecondOpinion | None = None,
    limits: Sequence[DetectionLimit] = (),
    absorbed: tuple[str, ...] = (),
    seconds: float | None = None,
    seed: int = 0,
) -> TraceReport:
    """Make the report of a trace; ``seconds`` and ``seed`` are passed through."""
    baseline, *parameters = fitted_parameters(trace.augmented)
    stated = stated_values(trace.records[0], baseline) if trace.known else {}
    before = errors_of(trace.baseline)
    own = len(trace.baseline.names)
    count = len(trace.records) - trace.reference
    names = tuple(record_name(record.source, i) for i, record in enumerate(trace.records))
    named = trace.verdict not in UNNAMED
    report = TraceReport(
        schema=1,
        records=names[:count],
        noise_floor_deg=trace.floor.deg,
        before=before,
        verdict=trace.verdict,
        explained_share=_explained_share(trace),
        noise=NoiseReport(trace.floor.repeats_deg, trace.floor.sensor_deg, trace.floor.how),
        reference=names[count:],
        effects=_effects(trace, parameters) if named else (),
        after=errors_of(trace.augmented) if named else before,
        detection_limits=tuple(limits),
        absorbed=absorbed,
        multibody=_multibody(opinion),
        candidates=tuple(_candidate(candidate, own) for candidate in ranked(trace.candidates)),
        next_experiment=experiment.words if experiment else "",
        rig_known=trace.known,
        model=trace.model,
        heldout_by=_heldout_by(trace),
        declared=stated,
        words=(*trace.words, *(zero_words(trace.augmented) if named else ()), *differing_words(baseline, stated)),
        smooth=SmoothReport(trace.smooth.names, math.sqrt(trace.smooth.square)),
        residual=ResidualReport(
            dependences(trace.baseline),
            dependences(trace.augmented) if named else None,
        ),
        samples=SampleCount(int(trace.baseline.error_deg.size), trace.augmented.angle_samples),
        multibody_words=opinion.words if opinion else "not run",
        alike=trace.alike,
        seconds=seconds,
        seed=seed,
        channels=with_channel_fits(
            channel_table(trace.baseline, trace.augmented if named else trace.baseline), trace.channel_fits
        ),
        leaps=tuple(_leaps(trace, names[:count])),
        held_out=tuple(trace.baseline.holdout.is_held_out(i) for i in range(len(names))),
        ranking=ranked_models(trace),
        baseline=baseline,
    )
    return report if trace.decision is None else _with_test(report, trace.decision)


def _with_test(report: TraceReport, decision: Decision) -> TraceReport:
    front_runners = tuple(FrontRunnerReport(" + ".join(one.names), one.p, one.explained) for one in decision.compared)
    not_distinguished = tuple(" + ".join(names) for names in decision.not_distinguished)
    return replace(
        report,
        alpha=decision.alpha,
        p_none=decision.p_none,
        discrepancy_deg=decision.discrepancy_deg,
        simulations=decision.simulations,
        by_test=DecisionReport(decision.verdict, not_distinguished, front_runners),
    )


def _leaps(trace: Trace, names: Sequence[str]) -> Iterator[LeapReport]:
    """Leaps of the records that are larger than the noise."""
    for name, record in zip(names, trace.records, strict=False):
        leap = leap_between_cycles(record) if record.drive_unit != "N" else None
        if leap is not None and abs(leap.size_deg) > trace.floor.deg:
            yield LeapReport(name, abs(leap.size_deg), leap.sudden)


def record_name(source: str, index: int) -> str:
    """Name of a record: its file, or its place among the records."""
    return Path(source).name or f"record {index + 1}"


def ranked(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Candidates by the criterion, best first."""
    return sorted(candidates, key=lambda c: -c.delta_bic)


def in_words(report: TraceReport) -> list[str]:
    """Sentences that say what a trace found: the verdict, how sure it is and how much it explains, then reasons."""
    before, after = report.before.heldout, report.after.heldout
    names = " and ".join(effect.name for effect in report.effects)
    what = "What changed" if report.reference else "The residual"
    baseline = f"The baseline model has an error of {before.rmse_deg:.3g} deg rms on held-out data"
    noise = f"the noise floor is {report.noise_floor_deg:.3g} deg, from {report.noise.how}"
    share = share_words(report.explained_share)
    explains = f"; {'they explain' if len(report.effects) > 1 else 'it explains'} {share}" if share else ""
    falls = f"With {names} in the model it falls to {after.rmse_deg:.3g} deg{explains}. {noise[:1].upper()}{noise[1:]}."
    reasons = [*channel_words(report.channels), *(_sentence(text, report) for text in report.words)]
    others = [f"{e.name} or {' or '.join(e.confusable_with)}" for e in report.effects if e.confusable_with]
    alone = [e.name for e in report.effects if not e.confusable_with]
    alike = [f"These records do not distinguish {'; '.join(others)}."] if others else []
    match report.verdict:
        case "none":
            nothing = "Nothing has changed since the reference." if report.reference else NONE_FOUND
            return [f"{nothing} {baseline}; {noise}.", *_limit_words(report), *reasons]
        case "effect":
            return [f"{_leap_words(report)}{what} is traced to {names}.", f"{baseline}.", falls, *reasons]
        case "partial":
            part = f"{_leap_words(report)}{what} is traced in part to {names}."
            left = (
                f"The error that is left is {after.rmse_deg / max(report.noise_floor_deg, 1e-12):.2g} times the noise."
            )
            return [part, *alike, f"{baseline}.", falls, left, *reasons]
        case "ambiguous":
            return [
                f"{_leap_words(report)}{what} is traced to one of several effects: {', with '.join(others + alone)}.",
                *alike,
                f"{baseline}.",
                falls,
                *reasons,
            ]
    nearest = min(
        (c for c in report.candidates if c.heldout_rmse_deg is not None),
        key=lambda c: c.heldout_rmse_deg or 0.0,
        default=None,
    )
    near = [] if nearest is None else [_nearest_words(nearest, report)]
    something = "Something has changed since the reference" if report.reference else "The residual has structure"
    first = f"{something}, but no effect of the catalogue explains enough of it."
    if NOT_KNOWN in report.words:
        return [f"Whether an effect is missing cannot be said: the noise is not known. {baseline}.", *near, *reasons]
    if NOT_AS_RECORDED in report.words:
        return [f"{something}. {baseline}; {noise}.", *reasons]
    if OTHER_AMPLITUDE in report.words or OTHER_RATE in report.words:
        return [f"Whether the rig has changed cannot be said. {baseline}; {noise}.", *near, *reasons]
    if LEAPT in report.words:
        of_change = "nothing has changed since the reference"
        nothing = of_change if report.reference else "these records show no missing effect"
        return [f"Beside a leap, which was taken out, {nothing}. {baseline}; {noise}.", *reasons]
    return [first, f"{baseline}; {noise}.", *near, *reasons]


def _sentence(text: str, report: TraceReport) -> str:
    """Make a sentence of a reason; names of files and effects stay as they are."""
    is_name = text.startswith((*report.records, *report.reference)) or "_" in text.split(" ", 1)[0]
    return f"{text if is_name else text[:1].upper() + text[1:]}."


def _leap_words(report: TraceReport) -> str:
    """Warn of a named effect that may be a leap; empty without a leap."""
    which = "this effect" if len(report.effects) == 1 else "these effects"
    names = " and in ".join(leap.name for leap in report.leaps if not leap.taken_out)
    return f"A leap in {names} may have been taken for {which}. " if names else ""


def _nearest_words(nearest: CandidateReport, report: TraceReport) -> str:
    part = report.explained_share
    better = (nearest.heldout_rmse_deg or 0.0) < report.before.heldout.rmse_deg
    if not better or (part is not None and part.value <= 0.0):
        return "No candidate predicts better than the baseline model."
    share = share_words(part)
    explains = f"; it explains {share}" if share else ""
    return f"The nearest candidate is {nearest.name}, with an error of {nearest.heldout_rmse_deg:.3g} deg{explains}."


def _limit_words(report: TraceReport) -> list[str]:
    """Say from what size on effects would have been seen, and which at no size."""
    shown = ", ".join(
        f"{one.name} from {one.size:.2g}{'' if one.unit == '-' else f' {one.unit}'}" for one in report.detection_limits
    )
    words = [f"In nine of ten such records these would have been found: {shown}."] if shown else []
    if report.absorbed:
        words.append(f"The fit absorbs these at every size, so they may be there: {', '.join(report.absorbed)}.")
    return words


def share_words(share: Estimate | None) -> str:
    """Say a share with its interval."""
    if share is None:
        return ""
    of = "the squared held-out error above the noise"
    if share.value >= 1.0 and share.low >= 1.0:
        return f"all of {of}"
    return f"{_percent(share.value)} % ({_percent(share.low)} to {_percent(share.high)} %) of {of}"


def _percent(part: float) -> str:
    """Round a part to percent, with as many digits as keep it below 100 where it is."""
    digits = next((d for d in range(6) if part >= 1.0 or round(100 * part, d) < 100), 6)
    return f"{100 * part:.{digits}f}"


def _multibody(opinion: SecondOpinion | None) -> MultibodyErrors | None:
    if opinion is None or opinion.before is None or opinion.after is None:
        return None
    return MultibodyErrors(opinion.before, opinion.after)


def _heldout_by(trace: Trace) -> str:
    """Say how samples were held out, and whether the choice between effects has seen them."""
    by = trace.baseline.holdout.by
    if trace.baseline.fold_errors is not None:
        return by
    return f"{by}; no fit that is reported has seen them, but the choice between effects has"


def _explained_share(trace: Trace) -> Estimate | None:
    """Share of the named effects, or of the nearest candidate; None where there is nothing to explain."""
    best = trace.augmented
    if trace.verdict == "none":
        return None
    if trace.verdict == "unexplained":
        nearest = nearest_candidate(trace.candidates)
        if nearest is None:
            return None
        best = nearest.fitted
    before, after = trace.baseline.heldout_errors, best.heldout_errors
    if [e.size for e in before] != [e.size for e in after]:
        return None
    return share(before, after, trace.floor.deg)


def nearest_candidate(candidates: Sequence[Candidate]) -> Candidate | None:
    """Candidate with the least held-out error; None where none has one."""
    there = [c for c in candidates if math.isfinite(c.fitted.heldout_rmse_deg)]
    return min(there, key=lambda c: c.fitted.heldout_rmse_deg, default=None)


def _effects(trace: Trace, parameters: Sequence[Mapping[str, Parameter]]) -> tuple[EffectReport, ...]:
    """Effects that are named in the order in which they were added."""
    own = len(trace.baseline.names)
    parameters = parameters[own:]
    stages = [_stage(trace, k) for k in range(len(trace.effects) + 1)]
    return tuple(
        EffectReport(
            name=added.effect.name,
            parameters=values,
            confusable_with=confusable,
            delta_bic=stages[k + 1][1] - stages[k][1],
            heldout_rmse_deg=_finite(stages[k + 1][0].heldout_rmse_deg),
            p=None if trace.decision is None else trace.decision.p_of(added.effect.name),
        )
        for k, (added, values, confusable) in enumerate(zip(trace.effects, parameters, trace.confusable, strict=True))
    )


def _stage(trace: Trace, k: int) -> tuple[Fitted, float]:
    """Model with the first k effects, and how much lower its criterion is than the baseline's."""
    if k == 0:
        return trace.baseline, 0.0
    own = len(trace.baseline.names)
    there = [c for c in trace.candidates if set(c.names) == set(trace.augmented.names[: own + k])]
    if not there:  # an effect between was left out as needless
        return _stage(trace, k - 1)
    best = max(there, key=lambda c: c.delta_bic)
    return best.fitted, best.delta_bic


def _candidate(candidate: Candidate, own: int) -> CandidateReport:
    return CandidateReport(
        " + ".join(candidate.names[own:]), _finite(candidate.fitted.heldout_rmse_deg), float(candidate.delta_bic)
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def fitted_parameters(fitted: Fitted) -> list[dict[str, Parameter]]:
    """Values of the baseline's parameters and of each effect's, with 95 % intervals from the Jacobian."""
    found = covariance(fitted)
    half = float(student.ppf(0.975, found.freedom)) * np.sqrt(np.diag(found.matrix))
    shown = [
        (
            p.name,
            Parameter(
                p.from_unit(x),
                max(p.low, p.from_unit(max(x - h, p.to_unit(p.low)))),
                min(p.high, p.from_unit(min(x + h, p.to_unit(p.high)))),
                p.unit,
            ),
        )
        for p, x, h in zip(fitted.model.parameters, fitted.x.tolist(), half.tolist(), strict=True)
    ]
    out, at = [dict(shown[: fitted.model.baseline_size])], fitted.model.baseline_size
    for added in fitted.model.added:
        out.append(dict(shown[at : at + len(added.form.parameters)]))
        at += len(added.form.parameters)
    return out


def errors_of(fitted: Fitted) -> FoldErrors:
    """Errors over the fitted samples, and over the held-out ones."""
    observed, train = np.concatenate(fitted.model.problem.observed), fitted.holdout.train_mask
    predicted = observed + fitted.error_deg
    heldout, unseen = ~train, predicted
    if fitted.fold_errors is not None:
        unseen = observed + np.concatenate(fitted.fold_errors)
        heldout = ~np.isnan(unseen)
    return FoldErrors(errors(observed[train], predicted[train]), errors(observed[heldout], unseen[heldout]))
