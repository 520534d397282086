"""Trace records of unknown geometry by prediction: play operators as the baseline, folds that choose and report.

Also what changed since a reference: both share one baseline with all that it cannot explain, and only the new records
may have a further effect.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hysteresis.records.record import Record, RecordError
from validation.tracing.baseline.play_operators import PlayProblem, play_problem
from validation.tracing.effect import CurveForm, Effect, Values
from validation.tracing.fitting import Fitted, Model
from validation.tracing.fitting.channel_errors import ChannelFit
from validation.tracing.fitting.fitted import rms
from validation.tracing.fitting.folds import folds_of, has_folds, share
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.noise import NoiseFloor, repeatability_deg
from validation.tracing.fitting.smooth import smooth_functions
from validation.tracing.outcome import Candidate, Trace, Verdict
from validation.tracing.plausibility import remarks
from validation.tracing.prepared import PreparedRecord, channel_unit, channel_values
from validation.tracing.problem import AddedEffect
from validation.tracing.search.by_folds import FoldFits, FoundByFolds, find_by_folds, fit_all
from validation.tracing.search.search import Progress
from validation.tracing.search.still_zone import SAME_STILL, StillZone, find_still_zone
from validation.tracing.sensors.protocol import OTHER_AMPLITUDE, OTHER_RATE, amplitude_words, rate_words
from validation.tracing.settings import (
    AT_FLOOR,
    EXPLAINED_SHARE,
    FOLD_ALIKE,
    LEAST_NEW_SAMPLES,
    LEAST_PLAY_SAMPLES,
    MOST_ALIKE,
    PARTIAL_SHARE,
    PLAY_SHAPES,
    REFERENCE_MOST,
    SAME_PRELOAD,
    SIGNIFICANT,
    VERY_STRONG_EVIDENCE,
)
from validation.tracing.verdict import depends_on, taken_back

TOO_FEW_READINGS = (
    f"too few readings or cycles that change: expected {LEAST_PLAY_SAMPLES} or more, in parts that can be held out"
)
FIRST_STROKE = "the first stroke of each record, which starts from an unknown state, is left out"


@dataclass(frozen=True, eq=False)
class PlayBaselines:
    """Play operators of constant and of position-dependent width, fitted to all samples, and the folds of the records.

    ``heldout_deg`` is the rms error on samples that a fit has not seen, where inner folds chose between the two.
    """

    fitted: tuple[Fitted, ...]
    fits: FoldFits
    heldout_deg: float


def play_baselines(records: Sequence[Record]) -> PlayBaselines | None:
    """Fit play operators to records; None where they have no parts that can predict each other."""
    if records[0].drive_unit == "N":
        return None
    problems = [play_problem(records, powers=powers, curve=curve) for powers, curve in PLAY_SHAPES]
    prepared = problems[0].records
    if not has_folds(prepared) or sum(one.kept.size for one in prepared) < LEAST_PLAY_SAMPLES:
        return None
    if all(np.ptp(one.angle_deg) == 0 for one in prepared):  # a channel that stands still after the first stroke
        return None
    fitted = tuple(fit_all(Model(problem)) for problem in problems)
    fits = FoldFits(folds_of(prepared))
    return PlayBaselines(fitted, fits, rms(np.concatenate(fits.heldout(fits.chosen(fitted)))))


def trace_by_folds(
    baselines: PlayBaselines, effects: Sequence[Effect], report: Progress, *, still: bool = True
) -> Trace:
    """Trace records by play operators; ``still`` also tests whether the angle stands still after reversals."""
    found = find_by_folds(baselines.fitted, effects, baselines.fits, report)
    words = [FIRST_STROKE, *_preload_words(found.best)]
    trace = judge_by_folds(found, words, floor=_floor(found.best))
    zone = None
    if still and trace.verdict in ("unexplained", "partial"):
        report("still zone after reversals", 0)
        zone = find_still_zone(trace.augmented, effects, baselines.fits)
        trace = trace if zone is None else with_still_zone(trace, zone)
    trace = _reported(trace, AGAINST_OTHER_MODELS + ("" if zone is None else BY_STILL_ZONE))
    fits = tuple(_channel_fits(trace.records))
    few = set(_common_channels(trace.records)) - {one.name for one in fits}
    notes = [f"{name} is not fitted: {TOO_FEW_READINGS}" for name in sorted(few)]
    return replace(trace, channel_fits=fits, words=(*trace.words, *notes))


def _common_channels(records: Sequence[Record]) -> list[str]:
    """Names of what all records have beside the angle, and what moves."""
    values = [channel_values(record) for record in records]
    return [name for name in values[0] if all(name in own and np.ptp(own[name]) > 0 for own in values)]


def _channel_fits(records: Sequence[Record]) -> Iterator[ChannelFit]:
    """Fit play operators to every channel that all records have beside the angle, by the same folds.

    A channel that is logged slower than the angle may have too few readings.
    """
    for name in _common_channels(records):
        as_angle = [replace(record, angle_deg=channel_values(record)[name]) for record in records]
        plays = play_baselines(as_angle)
        if plays is not None:
            best, chosen = plays.fits.best(plays.fitted), plays.fits.chosen(plays.fitted)
            yield ChannelFit(name, channel_unit(name), plays.fits.with_fold_errors(best, chosen))


def trace_change(
    records: Sequence[Record], reference: Sequence[Record], effects: Sequence[Effect], report: Progress
) -> Trace:
    """Trace what changed between a reference and records of the same rig.

    Effects that the reference shows act on all records. The error that is left on the reference is the floor: of a rig
    that has not changed it is as large on the new records. A named effect that predicts the new records as well where
    it acts on all of them is no change: a fast record shows a delay that slow ones of the same rig hide.

    Raises
    ------
    RecordError
        Records of different units of the drive.
    """
    _require_parts(play_problem(records).records)
    old = play_baselines(reference)
    before = None if old is None else trace_by_folds(old, effects, report, still=False)  # a change of it is a change
    shared = () if before is None else before.effects
    values = [] if before is None or not shared else before.augmented.model.values(before.augmented.x)[1]
    words = [FIRST_STROKE]
    if shared:
        words.append(f"the reference itself shows {_names(shared)}, which all records are given")
    while True:
        baselines = [_shared_baseline(records, reference, shared, values, shape) for shape in PLAY_SHAPES]
        fits = FoldFits(folds_of(baselines[0].model.problem.records, len(records)))
        known = {one.effect.name for one in shared}
        found = find_by_folds(baselines, [e for e in effects if e.name not in known], fits, report)
        new = found.best.model.added[len(shared) :]
        more, values = (*shared, *new), found.best.model.values(found.best.x)[1]
        if not new or not _predicts_as_well(found, records, reference, more, values):
            break
        shared = more
        words.append(f"{_names(new)} predicts as well where it acts on the reference, too: no change")
    words += [*_preload_words(found.best), *amplitude_words(records, reference), *rate_words(records, reference)]
    left = REFERENCE_MOST * _left_of_reference(found.baseline, len(records))
    if before is not None:  # blocks of one short record are hard to predict: no floor for others
        left = min(left, before.augmented.heldout_rmse_deg)
    floor = replace(_floor(found.best), reference_deg=left)
    trace = judge_by_folds(found, words, reference=len(reference), floor=floor)
    return _reported(_without_change(trace, words))


def _require_parts(records: Sequence[PreparedRecord]) -> None:
    """Refuse new records that are too short to be divided: a few samples would decide whether the rig has changed."""
    count = sum(one.kept.size for one in records)
    if count < LEAST_NEW_SAMPLES:
        where = records[0].record.source or "record"
        whose = "" if len(records) == 1 else f" of {len(records)} records"
        raise RecordError(
            f"{where}: {count} samples{whose} behind the first stroke: expected at least {LEAST_NEW_SAMPLES}, to "
            "compare with a reference"
        )


def _preload_words(fitted: Fitted) -> list[str]:
    """Say so where records differ in preload, which changes a loop: this baseline gives all the same one."""
    preloads = sorted({one.preload_N for one in fitted.model.problem.records if not math.isnan(one.preload_N)})
    if not preloads or preloads[-1] <= (1 + SAME_PRELOAD) * preloads[0]:
        return []
    return [
        f"the preloads of {preloads[0]:g} to {preloads[-1]:g} N are not used: all records share one loop, and a loop "
        "that differs may be that of another preload"
    ]


def _without_change(trace: Trace, words: Sequence[str]) -> Trace:
    """Name no change that may be of another amplitude or rate of every new record; ``words`` of the records stay.

    Another rate alone may look like an effect, and several effects may explain most of it. A change is named there that
    explains most, with a residual small enough to count as explained, and that is confused with few.
    """
    if not trace.effects or not {OTHER_AMPLITUDE, OTHER_RATE} & {*words}:
        return trace
    before, after, names = trace.baseline, trace.augmented, _names(trace.effects)
    if OTHER_AMPLITUDE in words:
        part = share(before.heldout_errors, after.heldout_errors, trace.floor.deg).value
        reason = f"{names} takes {100 * part:.0f} % of the error above the noise"
    else:
        whole = 1 - (after.heldout_rmse_deg / before.heldout_rmse_deg) ** 2
        alike = max((len(others) for others in trace.confusable), default=0)
        reason = f"{names} takes {100 * whole:.0f} % of the squared error"
        if whole >= EXPLAINED_SHARE and trace.verdict != "partial" and alike <= MOST_ALIKE:
            return replace(trace, words=(*trace.words, f"{reason}, more than a rate has made of rigs without a change"))
        if whole >= EXPLAINED_SHARE:
            left = f"leaves {after.heldout_rmse_deg / trace.floor.deg:.2g} times the floor"
            reason += f" and {left}" if trace.verdict == "partial" else f", and {alike} others do as well"
        reason += ": a rate may make as much"
    taken = taken_back(trace, reason)
    return replace(taken, words=(*taken.words, *words))


def _names(effects: Sequence[AddedEffect]) -> str:
    return " + ".join(one.effect.name for one in effects)


def _predicts_as_well(
    found: FoundByFolds,
    records: Sequence[Record],
    reference: Sequence[Record],
    shared: Sequence[AddedEffect],
    values: Sequence[Values],
) -> bool:
    """Whether new records are predicted as well by effects that act on the reference, too."""
    problem = found.best.model.problem
    assert isinstance(problem, PlayProblem)
    everywhere = _shared_baseline(records, reference, shared, values, (problem.powers, problem.curve))
    fits = FoldFits(folds_of(everywhere.model.problem.records, len(records)))
    return rms(np.concatenate(fits.everywhere(everywhere))) <= FOLD_ALIKE * found.best.heldout_rmse_deg


def _shared_baseline(
    records: Sequence[Record],
    reference: Sequence[Record],
    shared: Sequence[AddedEffect],
    values: Sequence[Values],
    shape: tuple[int, int],
) -> Fitted:
    """Fit one baseline to the records and their reference, with the effects that both have, from their values."""
    forms: list[CurveForm] = [one.form.form for one in shared]
    powers, curve = shape
    problem = play_problem(records, powers=powers, curve=curve, reference=reference, shared=forms)
    added = tuple(AddedEffect(one.effect, problem.placed(form)) for one, form in zip(shared, forms, strict=True))
    return fit_all(Model(problem, added), values)


def _left_of_reference(baseline: Fitted, records: int) -> float:
    """Give the error of the shared baseline on the reference, deg rms."""
    return rms(np.concatenate(baseline.errors[records:]))


def _floor(fitted: Fitted) -> NoiseFloor:
    """Give the floor of a fit: what one cycle differs from the next, drift taken out, where cycles repeat."""
    repeats = repeatability_deg(fitted.model.problem.records, fitted.residuals)
    return replace(fitted.noise, repeats_deg=repeats, by_repeats=True)


AGAINST_OTHER_MODELS = ", and whether play operators are used"
BY_STILL_ZONE = (
    "; the still zone is an exception: its width was found on all samples, and these errors decided to name it, so "
    "that the error after it is not of samples that chose nothing"
)


def _reported(trace: Trace, also: str = "") -> Trace:
    """Say how samples were held out, and what was chosen by the very errors that are reported, ``also`` what more."""
    by = (
        "each part in turn, by a fit without it (its zero is its own); inner folds chose the baseline and the effects, "
        f"and these errors whether an effect is named{also}"
    )

    def named(fitted: Fitted) -> Fitted:
        return replace(fitted, holdout=Holdout(fitted.holdout.train, by))

    baseline = named(trace.baseline)
    augmented = baseline if trace.augmented is trace.baseline else named(trace.augmented)
    return replace(trace, baseline=baseline, augmented=augmented)


def judge_by_folds(found: FoundByFolds, words: Sequence[str], *, reference: int = 0, floor: NoiseFloor) -> Trace:
    """Judge what folds have found: their held-out errors decide.

    A change must take :data:`PARTIAL_SHARE` of the whole mean square: the residual of a reference is
    no noise. Records of an unchanged rig may exceed it, and an effect soon explains much of a small residual.

    Parameters
    ----------
    words
        Remarks on the records, which are passed on.
    reference
        Number of the last records that are a reference.
    """
    baseline, best = found.baseline, found.best
    samples, smooth = best.samples, smooth_functions(baseline)
    candidates = tuple(Candidate(g, baseline.bic(samples) - g.bic(samples)) for g in found.candidates)
    before, after = baseline.heldout_rmse_deg, best.heldout_rmse_deg
    explained = share(baseline.heldout_errors, best.heldout_errors, floor.deg)
    reasons = list(words)
    verdict: Verdict = "effect"
    near = before <= SIGNIFICANT * floor.deg
    of_floor = bool(reference) and before**2 - after**2 < PARTIAL_SHARE * before**2
    if best is baseline or near or of_floor or explained.value < PARTIAL_SHARE:
        verdict = "none" if before <= AT_FLOOR * floor.deg else "unexplained"
        if best is not baseline and not near:
            whole, part = 1 - (after / before) ** 2, f"{100 * explained.value:.0f} % of the error above the noise"
            if explained.value >= PARTIAL_SHARE:
                part = f"{100 * whole:.0f} % of the error, too little of what the reference leaves"
            reasons.insert(0, f"{' + '.join(best.names)} takes {part}")
        best = baseline
        if verdict == "unexplained":
            reasons.insert(0, depends_on(smooth))
    elif after > AT_FLOOR * floor.deg:
        verdict = "partial"
        reasons.insert(0, depends_on(smooth_functions(best), "the remaining residual"))
    alike = found.alike if best is not baseline else ()
    reasons += remarks(best) if best is not baseline else []
    if verdict == "effect" and any(alike):
        verdict = "ambiguous"
    others = {name for names in alike for name in names}
    gains = [c.delta_bic for c in candidates if set(c.names) & others]
    own = max((c.delta_bic for c in candidates if c.names == best.names), default=0.0)
    least = own - min(gains, default=own)
    return Trace(
        model="play operators",
        verdict=verdict,
        baseline=baseline,
        augmented=best,
        candidates=candidates,
        confusable=alike,
        floor=floor,
        smooth=smooth,
        words=tuple(reasons),
        alike=max(VERY_STRONG_EVIDENCE, 1.0 + least),
        reference=reference,
    )


def with_still_zone(trace: Trace, zone: StillZone) -> Trace:
    """Name what stands still after reversals beside the effects that lower the error.

    It is never told from friction between wheel and base, and its share of the error is that of the residual of play
    operators: little, if anything.
    """
    best, unit = zone.fitted, trace.records[0].drive_unit
    words = (
        f"after every reversal the angle stands still for {zone.width:.3g} {unit} of the drive; a model that does so "
        f"for twice as far leaves {zone.refuted_deg:.3g} deg. This is a play, or friction between wheel and base. Play "
        "operators follow either, so the error falls little where it is named"
    )
    candidate = Candidate(best, trace.baseline.bic(best.samples) - best.bic(best.samples))
    return replace(
        trace,
        verdict="partial" if best.heldout_rmse_deg > AT_FLOOR * trace.floor.deg else "ambiguous",
        augmented=best,
        candidates=(*trace.candidates, candidate),
        confusable=(*trace.confusable, tuple(name for name in SAME_STILL if name not in trace.names)),
        words=(words, *trace.words),
    )
