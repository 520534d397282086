"""The verdict: which effects are named, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hysteresis.sensors.readings import LEAPT
from validation.tracing.baseline.known_rig import is_of_measured_joints
from validation.tracing.fitting.evidence import (
    beats_smooth_functions,
    curve_does_as_well,
    is_beyond_chance,
    more_than_noise,
    significant_ratio,
)
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.folds import gain, share
from validation.tracing.fitting.noise import NOT_KNOWN, NoiseFloor, repeatability_deg, sensor_noise_deg
from validation.tracing.fitting.smooth import Smooth, smooth_functions
from validation.tracing.outcome import Candidate, Trace, Verdict
from validation.tracing.plausibility import implausible, remarks
from validation.tracing.prepared import PreparedRecord
from validation.tracing.search.inner_folds import inner_fold_errors
from validation.tracing.search.stepwise import Selection, Stages
from validation.tracing.settings import (
    AT_FLOOR,
    AT_NOISE,
    EQUIVALENT_RIG,
    EXPLAINED_SHARE,
    FAR_ABOVE,
    KNOWN_RIG,
    MISFIT_ALIKE,
    MOST_ALIKE,
    MOST_OF_ERROR,
    NEAR_NOISE,
    PARTIAL_SHARE,
    POLICIES,
    SIGNIFICANT,
    SIGNIFICANT_LOOSE,
    VERY_STRONG_EVIDENCE,
    WORTH_NAMING,
    SearchPolicy,
)


def without_effects(policy: SearchPolicy, baseline: Fitted) -> Trace:
    """Give the trace of a baseline to which no effect has been added yet."""
    smooth = smooth_functions(baseline)
    return Trace(
        model=policy.name,
        verdict="none",
        baseline=baseline,
        augmented=baseline,
        candidates=(),
        confusable=(),
        floor=_floor(baseline, baseline),
        smooth=smooth,
        words=(),
        alike=VERY_STRONG_EVIDENCE,
    )


def _floor(baseline: Fitted, best: Fitted) -> NoiseFloor:
    """Noise floor by the model that leaves less of it."""
    floor = replace(best.noise, local_deg=min(baseline.noise.local_deg, best.noise.local_deg))
    records = baseline.model.problem.records
    repeats = repeatability_deg(records, best.residuals) if all(one.only_loads for one in records) else None
    if repeats is not None:  # trials of few loads: neighbouring samples tell less than one trial from the next
        floor = replace(floor, repeats_deg=repeats, by_repeats=True)
    return floor


def judge(policy: SearchPolicy, baseline: Fitted, smooth: Smooth, selection: Selection) -> Trace:
    """Judge what the selected effects explain.

    Parameters
    ----------
    smooth
        Smooth functions of the baseline's residual.
    """
    best, stages = selection.best, selection.stages
    samples = best.samples
    floor = _floor(baseline, best)
    candidates = [Candidate(g, baseline.bic(samples) - g.bic(samples)) for stage in stages for g in stage]
    alike = max(VERY_STRONG_EVIDENCE, policy.distinct_share * (baseline.bic(samples) - best.bic(samples)))
    verdict, words = _verdict(policy, baseline, best, smooth, floor)
    named = best if verdict == "effect" else baseline
    if verdict != "none" and (reason := _is_noise(policy, baseline, named, floor)) is not None:
        verdict, (floor, words) = "none", reason
    if verdict == "effect" and (senseless := implausible(best)):
        words.append(f"{' + '.join(best.names)} would explain the residual, but {'; '.join(senseless)}")
        sensible = [g for g in _as_good(best, stages, alike, floor) if not implausible(g)]
        best = min(sensible, key=lambda g: g.bic(samples), default=best)
        verdict = _verdict(policy, baseline, best, smooth, floor)[0] if sensible else "unexplained"
        if not sensible and (reason := _is_noise(policy, baseline, baseline, floor)) is not None:
            verdict, (floor, words) = "none", reason
    best = baseline if verdict == "none" else best
    confusable = _confusable(best, stages, alike, floor) if verdict == "effect" else ()
    if any(confusable):
        verdict = "ambiguous"
    if verdict == "unexplained":
        words.append(depends_on(smooth))
        best = baseline
    elif best is not baseline:
        words += remarks(best)
    return Trace(
        model=policy.name,
        verdict=verdict,
        baseline=baseline,
        augmented=best,
        candidates=tuple(candidates),
        confusable=confusable,
        floor=floor,
        smooth=smooth,
        words=tuple(words),
        alike=alike,
    )


def _verdict(
    policy: SearchPolicy, baseline: Fitted, best: Fitted, smooth: Smooth, floor: NoiseFloor
) -> tuple[Verdict, list[str]]:
    """Verdict before competitors are looked at, and its reasons."""
    names = " + ".join(best.names)
    excess = max(baseline.rmse_deg**2 - floor.deg**2, 1e-300)
    explained = (baseline.rmse_deg**2 - best.rmse_deg**2) / excess
    near = baseline.rmse_deg <= significant_ratio(baseline, policy) * floor.deg
    if near and not is_beyond_chance(baseline, best, policy):
        return "none", []
    if best is baseline:
        return "unexplained", []
    if not beats_smooth_functions(best, smooth):
        against = smooth.competitor or smooth
        return "unexplained", [f"smooth functions of {', '.join(against.names)} fit better than {names}"]
    if best.rmse_deg > AT_FLOOR * floor.deg and explained < EXPLAINED_SHARE:
        return "unexplained", [f"{names} explains {100 * explained:.0f} % of the mean square above the noise"]
    if curve_does_as_well(best, smooth):
        return "effect", [f"a free curve ({', '.join(smooth.names)}) does as well as {names}, and names no cause"]
    return "effect", []


def _is_noise(
    policy: SearchPolicy, baseline: Fitted, named: Fitted, floor: NoiseFloor
) -> tuple[NoiseFloor, list[str]] | None:
    """Floor and reasons where the baseline's error is noise that neighbouring samples do not show; None otherwise.

    With a ``named`` effect that changes from cycle to cycle, cycles differ less.
    """
    records, error = baseline.model.problem.records, baseline.rmse_deg
    if error <= significant_ratio(baseline, policy) * floor.deg and is_beyond_chance(baseline, named, policy):
        return None
    found = [sensor_noise_deg(records, fitted.residuals) for fitted in (baseline, named)]
    noise = min((size for size in found if size is not None), default=0.0)
    if error <= significant_ratio(baseline, policy) * noise:
        by_repeats = floor.repeats_deg is not None
        how = "what one cycle differs from the next" if by_repeats else "correlated noise of the sensor"
        raised = replace(floor, repeats_deg=noise) if by_repeats else replace(floor, local_deg=noise)
        raised = replace(raised, by_repeats=True)
        return raised, [f"the error of {error:.2g} deg is {how}, {noise:.2g} deg"]
    unnamed = named is baseline or is_of_measured_joints(baseline.model.problem)
    if policy is KNOWN_RIG and unnamed and error <= NEAR_NOISE * floor.deg:
        return floor, [_too_little(error, floor)]
    return None


def _too_little(error_deg: float, floor: NoiseFloor) -> str:
    times = f"{error_deg / floor.deg:.2g} times the noise"
    return f"the error of {error_deg:.2g} deg is {times}: too little to be named"


def depends_on(smooth: Smooth, what: str = "the residual") -> str:
    """Say on which quantities a residual depends by its smooth functions."""
    if not smooth.names:
        subject = "it" if what == "it" else "the remaining residual"
        return f"{subject} follows none of the quantities that were tested"
    return f"{what} depends on {', '.join(smooth.names)}"


def _confusable(best: Fitted, stages: Stages, alike: float, floor: NoiseFloor) -> tuple[tuple[str, ...], ...]:
    """For each effect of the best model, those that explain the records as well in its place, and make sense."""
    as_good = [g for g in _as_good(best, stages, alike, floor) if not implausible(g)]
    out: list[tuple[str, ...]] = []
    for name in best.names:
        others = set(best.names) - {name}
        found = [n for g in as_good if others <= set(g.names) for n in g.names if n not in best.names]
        out.append(tuple(dict.fromkeys(found)))
    return tuple(out)


def _as_good(best: Fitted, stages: Stages, alike: float, floor: NoiseFloor) -> list[Fitted]:
    """Models of no more effects that explain the records as well."""
    samples = best.samples
    return [
        g for stage in stages for g in stage
        if g is not best and len(g.names) <= len(best.names)
        and (g.bic(samples) - best.bic(samples) < alike or is_as_good(g, best, floor))
    ]  # fmt: skip


def is_as_good(fitted: Fitted, best: Fitted, floor: NoiseFloor) -> bool:
    """Whether the residual of a model above the noise is at most twice that of the best model, and not far larger.

    That is the misfit of the best model, which may not be the right one: the baseline of both is not.
    """
    return _leaves_as_little(fitted.mean_square, best.mean_square, floor)


def _leaves_as_little(square: float, least: float, floor: NoiseFloor) -> bool:
    """Whether a mean square, deg^2, is above the ``least`` by no more than that is above the noise, nor far more."""
    misfit = max(0.0, least - (AT_NOISE * floor.deg) ** 2)
    return square - least < min(misfit, (MISFIT_ALIKE**2 - 1.0) * least)


def is_explained(trace: Trace) -> bool:
    """Whether the residual of a trace is small enough for a first effect."""
    return trace.verdict != "unexplained" and trace.augmented.rmse_deg <= SIGNIFICANT_LOOSE * trace.floor.deg


def ended_above_noise(trace: Trace, policy: SearchPolicy) -> bool:
    """Whether the search may have ended early, at a candidate whose residual is small enough for a first effect."""
    limit = max(SIGNIFICANT_LOOSE, significant_ratio(trace.baseline, policy))
    return any(c.fitted.rmse_deg <= limit * c.fitted.noise.deg for c in trace.candidates)


def best_of(traces: list[Trace]) -> Trace:
    """Choose the trace with the lowest BIC; one that names nothing has the BIC of its smooth functions.

    A named effect must be better than smooth functions beside any baseline. A baseline does not win by needing one
    effect less.
    """
    samples = min((trace.augmented for trace in traces), key=lambda g: g.mean_square).samples

    def cost(trace: Trace) -> float:
        return trace.smooth.bic(samples) if trace.verdict == "unexplained" else trace.augmented.bic(samples)

    return min(traces, key=cost)


def predicts_better(by_folds: Trace, other: Trace) -> bool:
    """Whether a cross-validated trace predicts better, with its effects or without, than one whose model was chosen."""
    return by_folds.augmented.heldout_rmse_deg < other.augmented.heldout_rmse_deg


def confirmed_on_heldout(trace: Trace) -> Trace:
    """Drop effects with which the held-out error stays far above the noise, and no lower than it was.

    A baseline that meets the held-out samples at the noise by chance does not speak against an effect that does, too.
    """
    before, after = trace.baseline.heldout_rmse_deg, trace.augmented.heldout_rmse_deg
    if not trace.effects or after <= max(AT_FLOOR * trace.floor.deg, WORTH_NAMING * before):
        return trace
    error = f"with {' + '.join(trace.augmented.names)} the held-out error is {after:.3g} deg"
    return taken_back(trace, f"{error}, that of the baseline model is {before:.3g} deg")


def is_too_little(trace: Trace) -> bool:
    """Whether the residual of an equivalent rig is little more than noise, and with no effect becomes noise.

    A rig that is not declared may be of another make, whose friction and flexures follow other laws. Several effects
    explain part of that residual, and seldom one all of it.
    """
    if trace.model != EQUIVALENT_RIG.name or trace.baseline.rmse_deg > NEAR_NOISE * trace.floor.deg:
        return False
    at_noise = significant_ratio(trace.augmented, EQUIVALENT_RIG) * trace.floor.deg
    return not trace.effects or trace.augmented.rmse_deg > at_noise


def left_near_noise(trace: Trace) -> Trace:
    """Drop effects of a known rig whose baseline is near the noise, if the residual with them exceeds the noise.

    The residual of a rig of another make is up to :data:`FAR_ABOVE` times the noise without any effect, and effects
    may explain part of that. Measured joints are given no effect up to :data:`NEAR_NOISE` of the fitted samples, since
    their own error is as large.
    """
    baseline, floor = trace.baseline, trace.floor.deg
    fitted = baseline.train_rmse_deg
    if not (trace.known and trace.effects and trace.floor.known and fitted < FAR_ABOVE * floor):
        return trace
    reason = more_than_noise(trace.augmented, floor)
    if fitted <= NEAR_NOISE * floor and is_of_measured_joints(baseline.model.problem):
        reason = f"of the fitted samples {_too_little(fitted, trace.floor)}"
    if not reason:
        return trace
    far = max(fitted, baseline.heldout_rmse_deg) > NEAR_NOISE * floor
    return taken_back(trace, reason) if far else _none(trace, reason)


def above_noise(trace: Trace) -> Trace:
    """Find nothing missing where the baseline, fitted to its end, has a residual of noise.

    Without an effect to name, that is the residual allowed for a first effect. Of a rig that is not declared more may
    be left (:func:`is_too_little`).
    """
    error, over = trace.baseline.rmse_deg, SIGNIFICANT if trace.effects else SIGNIFICANT_LOOSE
    if trace.verdict != "none" and is_too_little(trace):
        return _none(trace, _too_little(error, trace.floor))
    if trace.verdict == "none" or error > over * trace.floor.deg or _is_beyond_noise(trace):
        return trace
    without = f"{' + '.join(trace.augmented.names)} is not needed: without it, " if trace.effects else ""
    return _none(trace, f"{without}the error is {error:.2g} deg, {error / trace.floor.deg:.2g} times the noise")


def _none(trace: Trace, reason: str) -> Trace:
    return replace(trace, verdict="none", augmented=trace.baseline, confusable=(), words=(reason,))


def _is_beyond_noise(trace: Trace) -> bool:
    """Whether effects beside a baseline whose residual is noise are beyond chance, and predict better."""
    predicts = trace.augmented.heldout_rmse_deg < trace.baseline.heldout_rmse_deg
    return predicts and is_beyond_chance(trace.baseline, trace.augmented, POLICIES[trace.model])


def doubted_without_noise(trace: Trace) -> Trace:
    """Claim nothing, not even that no effect is missing, where the noise is not known."""
    if trace.verdict != "none" or trace.floor.known:
        return trace
    return replace(trace, verdict="unexplained", words=(NOT_KNOWN, *trace.words))


def doubted_on_heldout(trace: Trace) -> Trace:
    """Claim nothing where the baseline of an unknown rig meets the samples it was fitted to, and not those held out.

    It may take an effect over the programs that it has seen.
    """
    error, noise = trace.baseline.heldout_rmse_deg, trace.floor.deg
    if trace.known or trace.verdict != "none" or error <= FAR_ABOVE * max(noise, trace.baseline.train_rmse_deg):
        return trace
    words = f"the held-out error of the baseline model is {error:.2g} deg, {error / noise:.2g} times the noise"
    return replace(trace, verdict="unexplained", words=(words, *trace.words))


def doubted_with_leap(trace: Trace, *, lost: bool = False) -> Trace:
    """Say that something is wrong where a leap was taken out of a record, or ``lost`` counts: no effect explains it."""
    leaps = lost or any(one.readings is not None and one.readings.leap_deg is not None for one in _traced(trace))
    if trace.verdict != "none" or not leaps:
        return trace
    return replace(trace, verdict="unexplained", words=(LEAPT, *trace.words))


def _traced(trace: Trace) -> Sequence[PreparedRecord]:
    """Give the records that are traced, without those of a reference."""
    records = trace.baseline.model.problem.records
    return records[: len(records) - trace.reference]


def named_in_part(trace: Trace, threads: int = 2) -> Trace:
    """Name the effect that explains most of an error, if inner folds confirm it, where no model reaches the noise.

    The best single effect must take :data:`MOST_OF_ERROR` of the mean square above the noise, beyond its interval, from
    fitted samples that each inner fold has not seen, and few others may do as well; the held-out ones choose nothing.
    Without such an effect a trace that names none stays as it is; what was named is dropped up to :data:`FAR_ABOVE`
    times the noise. Further effects make up for a baseline that is not right, and are not named.
    """
    single = [c.fitted for c in trace.candidates if len(c.names) == 1 and not implausible(c.fitted)]
    near = trace.baseline.train_rmse_deg < FAR_ABOVE * trace.floor.deg
    if not single or (near and not trace.effects):
        return trace
    samples = min(single, key=lambda g: g.train_square).samples
    best = min(single, key=lambda g: g.train_bic(samples))
    before, after = inner_fold_errors(trace.baseline, threads), inner_fold_errors(best, threads)
    taken, names = share(before, after, trace.floor.deg).value, " + ".join(best.names)
    others = _alike_alone(best, single, trace.floor)
    if taken < MOST_OF_ERROR or not gain(before, after).is_positive:
        return taken_back(trace, f"{names} takes {100 * taken:.0f} % of the error above the noise") if near else trace
    if len(others) > MOST_ALIKE:
        reason = f"{names} takes {100 * taken:.0f} % of the error above the noise, and {len(others)} others do as well"
        return taken_back(trace, reason)
    partial = best.heldout_rmse_deg > AT_FLOOR * trace.floor.deg
    verdict: Verdict = "partial" if partial else "ambiguous" if others else "effect"
    return replace(trace, verdict=verdict, augmented=best, confusable=(others,), words=tuple(remarks(best)))


def _alike_alone(best: Fitted, single: Sequence[Fitted], floor: NoiseFloor) -> tuple[str, ...]:
    """Other effects that fit about as well by themselves, the nearest first."""
    left = best.train_rmse_deg**2
    alike = [g for g in single if g is not best and _leaves_as_little(g.train_rmse_deg**2, left, floor)]
    names = dict.fromkeys(g.names[0] for g in sorted(alike, key=lambda g: g.train_rmse_deg))
    return tuple(name for name in names if name not in best.names)


def taken_back(trace: Trace, reason: str) -> Trace:
    """Name nothing, for a reason."""
    words = (reason, depends_on(trace.smooth))
    return replace(trace, verdict="unexplained", augmented=trace.baseline, confusable=(), words=words)


def with_remaining_error(trace: Trace) -> Trace:
    """Say how large the residual with the named effects is where it exceeds the noise: of the fit that is reported."""
    best, noise = trace.augmented, trace.floor.deg
    if best is trace.baseline or best.fold_errors is not None or best.rmse_deg <= AT_FLOOR * noise:
        return trace
    remaining = f"the remaining error is {best.rmse_deg:.2g} deg rms, {best.rmse_deg / noise:.2g} times the noise"
    return replace(trace, words=(*trace.words, f"{remaining}; {depends_on(smooth_functions(best), 'it')}"))


def partial_above_floor(trace: Trace) -> Trace:
    """Say that effects explain a part only, where the held-out error with them is far above the noise.

    They must take :data:`PARTIAL_SHARE` of the mean square above the noise from it, or nothing is named; of a known rig
    within :data:`FAR_ABOVE` times the noise they must not raise it. Several effects of an unknown rig are not named so:
    they make up for what its model lacks. Nor is what more than :data:`MOST_ALIKE` others explain as well; a first
    effect of a known rig stays, if it explains most by itself.
    """
    if trace.verdict not in ("effect", "ambiguous", "partial"):
        return trace
    before, after = trace.baseline, trace.augmented
    if after.heldout_rmse_deg <= AT_FLOOR * trace.floor.deg:
        return trace
    taken = share(before.heldout_errors, after.heldout_errors, trace.floor.deg).value
    names = " + ".join(after.names)
    if not trace.known and len(after.names) > 1:
        left = after.heldout_rmse_deg / trace.floor.deg
        return taken_back(trace, f"{names} leave {left:.2g} times the noise of an unknown rig: too much for several")
    off = min(before.heldout_rmse_deg, FAR_ABOVE * trace.floor.deg) if trace.known else 0.0
    alike = max((len(others) for others in trace.confusable), default=0)
    if alike > MOST_ALIKE:
        first = _first_alone(trace)
        if first is None:
            return taken_back(trace, f"{names} explains a part, and {alike} others do as well")
        return partial_above_floor(first)
    if taken < PARTIAL_SHARE and after.heldout_rmse_deg > off:
        return taken_back(trace, f"{names} takes {100 * taken:.0f} % of the held-out error above the noise")
    return replace(trace, verdict="partial")


def _first_alone(trace: Trace) -> Trace | None:
    """Keep the first effect of a known rig alone, where it explains :data:`MOST_OF_ERROR` of what is fitted.

    A further effect that explains little, and is not distinguished from several others, is no reason against the first.
    """
    single = [c.fitted for c in trace.candidates if len(c.names) == 1 and not implausible(c.fitted)]
    first = min((g for g in single if g.names == trace.names[:1]), key=lambda g: g.train_square, default=None)
    if len(trace.names) < 2 or first is None or len(trace.confusable[0]) > MOST_ALIKE:
        return None
    noise, left = trace.floor.deg**2, first.train_rmse_deg**2
    before = trace.baseline.train_rmse_deg**2
    if before - left < MOST_OF_ERROR * (before - noise):
        return None
    others = _alike_alone(first, single, trace.floor)
    return replace(trace, augmented=first, confusable=(others,), words=tuple(remarks(first)))
