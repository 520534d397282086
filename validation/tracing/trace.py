"""Trace the residual of measured data to the physical effect that the model lacks.

The declared model is fitted to all records together. Where its residual is above the noise, every effect of the
catalogue is added in turn and fitted with it; the best one stays, if it is better than a free function of the same
regressors and explains what is left; then again, for a second and a third effect. Scores are of all samples, those held
out included, with a penalty for constants (:func:`validation.tracing.fitting.bic`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fem_models.rig.checks import RigError, SolverError
from fem_models.rig.of_record import rig_of
from hysteresis.path import cycle_index, require_reversal
from hysteresis.record import Record, RecordError
from validation.tracing.baseline.curve import curve_problem
from validation.tracing.baseline.equivalent_rig import equivalent_rig_problem, refined_problem
from validation.tracing.baseline.known_rig import known_rig_problem, rig_under_tendon_force
from validation.tracing.baseline.motor_drive import motor_drive_problem
from validation.tracing.effect import Effect, catalogue
from validation.tracing.fitting import (
    Fitted,
    Holdout,
    Model,
    bic,
    fit,
)
from validation.tracing.holdout import divide_records
from validation.tracing.problem import AddedEffect, Problem
from validation.tracing.refine import refined
from validation.tracing.residual import Floor, Smooth, smooth_functions
from validation.tracing.search import (
    ALIKE,
    ALL_CALLS,
    CURVE,
    EQUIVALENT,
    RIG,
    ModelName,
    Progress,
    Search,
    other_loops,
    samples_of,
    score,
)

STRUCTURE = 1.15
"""Residual over the noise floor from which there is something to explain, for a rig, known or equivalent."""
STILL = 1.3
"""The same for what a first effect leaves, and for a curve and a loop, which meet no rig exactly."""
OF_FEW = 3.0
"""Over the square root of the samples: what the estimated noise may be too small by (97.5 % of white noise in branches
of 16 to 44 samples, by simulation with third differences and five constants fitted)."""
PAYS = 0.9
"""Of the residual before: an effect that leaves more is not worth naming."""
EXPLAINED = 0.75
"""Part of the residual's excess over the noise, as squares, that effects must explain together to be named."""
AT_FLOOR = 1.5
"""Residual over the noise floor that counts as explained in any case."""
OF_GAIN = 0.03
"""Of the whole gain, the same where the geometry is unknown: neither a free rig nor a curve meets it exactly."""
MOST_EFFECTS = 3
FOLLOWED, FOLLOWED_LATER = 6, 5
"""Candidates that are fitted in full, of those that promise most: for the first effect, and for further ones."""
_FOLLOWED_FREE = 8  # the same for a first effect of a rig of which all is free, where promises are worth less
MOST_COMPETITORS = 3
"""Models beside the grown one that are fitted as it is, and between which an experiment is to decide."""
_TRIED = 2  # models that a further effect is added to
_NEAR_FREE = 1.5  # of the mean square: who is as near in the search of a free rig is fitted from other loops, too
_RIVALS = 5  # times the difference of the criterion: who is as near is fitted again from elsewhere, too
_EARLY = 4  # steps of a declared model of which all is free
_UNLIKE = 0.08  # of half the largest range: a rig that is so far off is not what made the records


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model with effects added, and how it compares with the declared model."""

    fitted: Fitted
    delta_bic: float  # how much lower than the declared model's

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that are in it."""
        return self.fitted.names


@dataclass(frozen=True, eq=False)
class Trace:
    """What was found in records: the declared model, the grown one, and all that was tried."""

    model: ModelName
    verdict: str
    baseline: Fitted
    augmented: Fitted
    candidates: tuple[Candidate, ...]  # with one more effect than the model before, best first
    confusable: tuple[tuple[str, ...], ...]  # of each effect in the grown model
    floor: Floor
    smooth: Smooth
    words: tuple[str, ...]
    alike: float  # difference of the criterion below which effects were not told apart

    @property
    def records(self) -> tuple[Record, ...]:
        """The records, each with the number of its cycle for every sample."""
        return tuple(one.record for one in self.baseline.model.problem.records)

    @property
    def known(self) -> bool:
        """Whether the geometry is."""
        return self.model == RIG

    @property
    def effects(self) -> tuple[AddedEffect, ...]:
        """Effects that are named; none where the verdict names none."""
        return self.augmented.model.added


def trace_records(
    records: Sequence[Record],
    *,
    threads: int = 2,
    progress: Progress | None = None,
    effects: Sequence[Effect] | None = None,
) -> Trace:
    """Trace the residual of records of one rig.

    Parameters
    ----------
    records
        At least one; they share the constants of the rig.
    threads
        For derivatives.
    progress
        Called with what is being done.
    effects
        The catalogue, by default all of it.

    Raises
    ------
    RecordError, RigError, SolverError
        Records that cannot be divided, or a rig that cannot be.
    """
    if not records:
        raise RecordError("no record: expected at least one")
    report = progress or (lambda words: None)
    known = [r if r.cycle is not None else replace(r, cycle=cycle_index(r)) for r in records]
    for record in known:
        if record.drive_unit != "N":
            require_reversal(record)
    mechanical = known_rig_problem(known) or motor_drive_problem(known)
    words = () if mechanical else _rigs_not_used(known)
    chosen = catalogue() if effects is None else effects
    with threadpool_limits(1, user_api="blas"):  # matrices are small: its threads would wait for each other
        if mechanical is None:
            trace = _of_unknown(known, chosen, threads, report)
        else:
            trace = _of_known(Search(mechanical, RIG, chosen, threads, report))
    trace = _believed(trace)
    return replace(trace, words=(*trace.words, *words))


def _believed(trace: Trace) -> Trace:
    """Take back what leaves the error that is held out where it was, far above the noise: that is not what is missing.

    A declared model that meets held-out samples by chance is no witness against an effect that meets them, too.
    """
    before, after = trace.baseline.heldout_rmse_deg, trace.augmented.heldout_rmse_deg
    if not trace.effects or after <= max(AT_FLOOR * trace.floor.deg, PAYS * before):
        return trace
    names = " + ".join(trace.augmented.names)
    said = f"{names} leaves {after:.3g} deg held out, where the declared model leaves {before:.3g}"
    return replace(
        trace,
        verdict="unexplained",
        augmented=trace.baseline,
        confusable=(),
        words=(said, f"the residual goes with {_names(trace.smooth)}"),
    )


def _rigs_not_used(records: Sequence[Record]) -> tuple[str, ...]:
    """Say so where some records name their rig and others do not: what is shared by all can be neither."""
    without = [r for r in records if (rig_under_tendon_force(r) if r.drive_unit == "N" else rig_of(r)) is None]
    if not 0 < len(without) < len(records):
        return ()
    return (f"{Path(without[0].source).name or 'a record'} names no rig: those of the other records were not used",)


def _of_known(search: Search) -> Trace:
    """Trace records of a rig that is declared."""
    holdout = divide_records(search.problem.records)
    search.report("the declared model")
    model = Model(search.problem)
    baseline = fit(model, holdout, model.row(search.problem.start, []), threads=search.threads)
    if search.doubtful(baseline):
        baseline = search.of_other_loops(baseline)
    trace = _verdict(search, baseline)
    return _of_better_start(search, trace) if trace.effects else trace


def _of_better_start(search: Search, trace: Trace) -> Trace:
    """Fit the declared model again from where it stands in the grown one: an effect may not pay for an optimum missed.

    Where it does not pay beside that fit, or free functions of what that leaves do better, all is looked for anew.
    """
    was, augmented, model = trace.baseline, trace.augmented, Model(search.problem)
    try:
        baseline = fit(model, was.holdout, augmented.x[: model.own], threads=search.threads)
    except (SolverError, RigError):  # constants that the rig has beside its effect alone
        return trace
    if baseline.square >= was.square:
        return trace
    samples = samples_of(augmented)
    smooth = smooth_functions(baseline, samples_of(baseline))
    nothing = math.sqrt(baseline.square) <= _limit(search, baseline) * search.floor(baseline).deg
    if nothing or not (
        _pays(baseline, augmented, len(search.effects)) and _better_than_free(augmented, smooth, samples)
    ):
        return _verdict(search, baseline)
    less = score(was, samples) - score(baseline, samples)
    candidates = tuple(replace(c, delta_bic=c.delta_bic - less) for c in trace.candidates)
    return replace(trace, baseline=baseline, smooth=smooth, candidates=candidates)


def _of_unknown(records: Sequence[Record], effects: Sequence[Effect], threads: int, report: Progress) -> Trace:
    """Trace records of unknown geometry: by the simplest rig where one explains them, else by a curve and a loop."""
    found = []
    if records[0].drive_unit != "N":
        with suppress(SolverError, RigError):  # records that no such rig follows
            rig = Search(equivalent_rig_problem(records), EQUIVALENT, effects, threads, report)
            rig = replace(rig, early=_declared(rig, _EARLY))
            baseline = _declared(rig)
            if math.sqrt(baseline.square) < _UNLIKE * rig.problem.scale.angle_deg:
                found.append(_verdict(rig, baseline))
    told = bool(found) and _explained(found[0])
    if not told or found[0].effects:
        for elements in (1, 2):  # a run of a curve takes less time than handing it over to a thread
            curve = Search(curve_problem(records, elements=elements), CURVE, effects, 1, report)
            simple = _declared(curve)
            if not told:
                found.append(_verdict(curve, simple))
            elif len(found[0].effects) > 1 or _is_all(curve, simple):  # which may know better, not know nothing
                found += [one for one in [_verdict(curve, simple)] if one.verdict != "unexplained"]
    if not told:
        unexplained = all(trace.verdict == "unexplained" for trace in found)
        if unexplained and found[0].model == EQUIVALENT and _let_pass(rig, found[0]):
            found.append(_verdict(rig, baseline, to_the_noise=True))
    samples = samples_of(min((trace.augmented for trace in found), key=lambda fitted: fitted.square))
    return _held_out(min(found, key=lambda trace: _worth(trace, samples)), threads, report)


def _is_all(search: Search, baseline: Fitted) -> bool:
    """Tell whether a declared model leaves nothing to explain: an effect of another one must be better than that."""
    return math.sqrt(baseline.square) <= _limit(search, baseline) * search.floor(baseline).deg


def _let_pass(search: Search, trace: Trace) -> bool:
    """Tell whether a search may have ended with structure left beside an effect (:data:`STILL`)."""
    limit = max(STILL, _limit(search, trace.baseline))
    return any(math.sqrt(c.fitted.square) <= limit * search.floor(c.fitted).deg for c in trace.candidates)


def _worth(trace: Trace, samples: float) -> float:
    """Criterion of what a trace says; of one without a word for it, that of its free functions, which a name must beat.

    A declared model that needs an effect less than another one does not win by it.
    """
    if trace.verdict == "unexplained":
        return bic(trace.smooth.square, trace.smooth.parameters, samples)
    return score(trace.augmented, samples)


def _explained(trace: Trace) -> bool:
    return trace.verdict != "unexplained" and math.sqrt(trace.augmented.square) <= STILL * trace.floor.deg


def _declared(search: Search, most_calls: int = ALL_CALLS) -> Fitted:
    """Fit the declared model of records of unknown geometry to all samples.

    What is free takes what one amplitude shows for its own; all records together tell effects apart.
    """
    holdout = divide_records(search.problem.records)
    everything = Holdout(tuple(np.ones_like(mask) for mask in holdout.train), holdout.by)
    search.report(f"the declared model ({search.model})")
    model = Model(search.problem)
    start = model.row(search.problem.start, []) if search.early is None else search.early.x
    return fit(model, everything, start, threads=search.threads, most_calls=most_calls)


def _held_out(whole: Trace, threads: int, report: Progress) -> Trace:
    """Fit again what was found, without the samples that are held out: errors are of fits that have not seen them.

    What is named is fitted to more samples than the search needs, and from other loops, the one that fits best.
    """
    problem = whole.baseline.model.problem
    rig = whole.model == EQUIVALENT
    holdout = divide_records(problem.records, own_preload=rig)
    at_last = refined_problem(problem) if rig else problem
    divided = divide_records(at_last.records, own_preload=rig)

    def again(fitted: Fitted, problem: Problem, holdout: Holdout, *, of_loops: bool = True) -> Fitted | None:
        """Fit what is named, declared or a rival from where it was and from other loops."""
        report(f"{' + '.join(fitted.names) or 'the declared model'}, held out")
        model, found = Model(problem, fitted.model.added), list[Fitted]()
        prior_mean = Model(problem).row(
            problem.start, []
        )  # where all data have brought them would tell what is held out
        for x in (fitted.x, *(other_loops(fitted) if of_loops else ())):
            baseline, more = fitted.model.values(x)
            there = model.row({**problem.start, **baseline}, more)
            with suppress(SolverError, RigError):
                found.append(fit(model, holdout, there, threads=threads, most_calls=ALL_CALLS, prior_mean=prior_mean))
        best = min(found, key=lambda one: one.train_rmse_deg, default=None)
        return best and refined(best, report, threads=threads, prior_mean=prior_mean)

    def briefly(fitted: Fitted) -> Fitted:
        """Fit another candidate by a step from where it was, where the derivatives of a rig are known."""
        report(f"{' + '.join(fitted.names)}, held out")
        calls, known = (3, fitted.jacobian) if rig else (ALL_CALLS, None)
        prior_mean = Model(problem).row(problem.start, [])
        try:
            return fit(
                fitted.model, holdout, fitted.x, threads=threads, most_calls=calls, known=known, prior_mean=prior_mean
            )
        except (SolverError, RigError):  # it stood where an equilibrium hangs on the last digit: no error is known
            return replace(fitted, holdout=holdout, errors=tuple(np.full(e.size, np.nan) for e in fitted.errors))

    named = [whole.baseline, *([whole.augmented] if whole.augmented is not whole.baseline else [])]
    last = (at_last, divided)
    found = [one for fitted in named if (one := again(fitted, *last)) is not None]
    if len(found) < len(named):  # of one problem both, whose errors are compared sample by sample
        last = (problem, holdout)
        found = [one for fitted in named if (one := again(fitted, *last)) is not None]
    if len(found) < len(named):
        raise SolverError("no equilibrium without the samples that are held out")
    refitted = {id(fitted): one for fitted, one in zip(named, found, strict=True)}
    for rival in competitors_of(whole)[1:] if rig and whole.effects else ():  # which an experiment is to tell from it
        if (one := again(rival, *last, of_loops=False)) is not None:
            refitted[id(rival)] = one
    for candidate in whole.candidates:
        if id(candidate.fitted) not in refitted:
            refitted[id(candidate.fitted)] = briefly(candidate.fitted)
    candidates = tuple(replace(c, fitted=refitted[id(c.fitted)]) for c in whole.candidates)
    return replace(whole, baseline=found[0], augmented=found[-1], candidates=candidates)


def competitors_of(trace: Trace) -> list[Fitted]:
    """Give the grown model, then those that explain the records alike, or else the runner-up."""
    mine = set(trace.augmented.names)
    others = [c for c in trace.candidates if not mine <= set(c.names) and not set(c.names) <= mine]
    others.sort(key=lambda c: -c.delta_bic)
    confusable = {name for names in trace.confusable for name in names}
    best = max((c.delta_bic for c in trace.candidates if c.fitted is trace.augmented), default=math.inf)

    def alike(c: Candidate) -> bool:
        return len(c.names) <= len(mine) and best - c.delta_bic < trace.alike and bool(set(c.names) & confusable)

    near = [c for c in others if alike(c)] or others[:1]
    return [trace.augmented, *(c.fitted for c in near[:MOST_COMPETITORS])]


def _limit(search: Search, baseline: Fitted) -> float:
    """Residual over the noise floor from which there is something to explain."""
    return max(STRUCTURE if search.costly else STILL, 1.0 + OF_FEW / math.sqrt(baseline.row.size))


def _verdict(search: Search, baseline: Fitted, *, to_the_noise: bool = False) -> Trace:
    """Add effects as long as they pay, then judge what they explain.

    Some structure may be left beside a first effect (:data:`STILL`), unless it is wanted down to the noise or a free
    rig's effect is better than free functions: such a rig hides a good part of a second one.
    """
    floor = search.floor(baseline)
    before = math.sqrt(baseline.square)
    smooth = smooth_functions(baseline, samples_of(baseline))
    stages: list[list[Fitted]] = []
    front, best = [baseline], baseline
    structure = limit = _limit(search, baseline)
    while len(stages) < MOST_EFFECTS and math.sqrt(best.square) > limit * search.floor(best).deg:
        most = (_FOLLOWED_FREE if search.model == EQUIVALENT else FOLLOWED) if not stages else FOLLOWED_LATER
        augmented = _distinct([g for model in front for g in search.augment(model, most)])
        if not augmented:
            break
        stages.append(augmented)
        if not _pays(best, augmented[0], len(search.effects)):
            break
        front, best = augmented[:_TRIED], augmented[0]
        sure = search.model == EQUIVALENT and _better_than_free(best, smooth, samples_of(best))
        limit = structure if sure or to_the_noise else max(STILL, structure)
    if search.model == EQUIVALENT and len(best.names) > 1 and math.sqrt(best.square) <= AT_FLOOR * floor.deg:
        best = _exchanged(search, best, stages)
    best = _at_its_end(search, search.pruned(best), stages)
    samples = samples_of(best)
    stages = _settled_competitors(search, best, stages)
    if all(best is not g for stage in stages for g in stage) and best is not baseline:
        stages = [[g for g in stage if set(g.names) != set(best.names)] for stage in stages]
        stages.append([best])
    candidates = tuple(Candidate(g, score(baseline, samples) - score(g, samples)) for stage in stages for g in stage)
    floor = Floor(min(floor.local_deg, search.floor(best).local_deg), search.floor(best).repeats_deg)
    after, excess = math.sqrt(best.square), max(baseline.square - floor.deg**2, 1e-300)
    explained = (baseline.square - best.square) / excess
    words = []
    if before <= structure * floor.deg:
        verdict, best = "none", baseline
    elif best is baseline:
        verdict = "unexplained"
    elif not _better_than_free(best, smooth, samples):
        verdict = "unexplained"
        words.append(f"free functions of {', '.join(smooth.names)} do better than {' + '.join(best.names)}")
    elif after > AT_FLOOR * floor.deg and explained < EXPLAINED:
        verdict = "unexplained"
        words.append(f"{' + '.join(best.names)} explains {100 * explained:.0f} % of what is above the noise")
    else:
        verdict = "effect"
    alike = ALIKE if search.model == RIG else max(ALIKE, OF_GAIN * (score(baseline, samples) - score(best, samples)))
    confusable = _confusable(best, stages, samples, alike) if verdict == "effect" else ()
    if any(confusable):
        verdict = "ambiguous"
    if verdict == "unexplained":
        words.append(f"the residual goes with {_names(smooth)}")
        best = baseline
    elif best is not baseline and after > AT_FLOOR * floor.deg:
        rest = smooth_functions(best, samples)
        words.append(f"{after:.2g} deg is left, {after / floor.deg:.2g} times the noise; it goes with {_names(rest)}")
    return Trace(
        search.model,
        verdict,
        baseline,
        best,
        candidates,
        confusable,
        floor,
        smooth,
        tuple(words),
        alike,
    )


def _exchanged(search: Search, best: Fitted, stages: list[list[Fitted]]) -> Fitted:
    """Exchange each effect for others, put those models into their stage, and give the best one of it."""
    place = len(best.names) - 1
    stages[place] = _distinct([*stages[place], *search.exchanged(best, FOLLOWED_LATER)])
    return stages[place][0]


def _at_its_end(search: Search, best: Fitted, stages: list[list[Fitted]]) -> Fitted:
    """Fit what won from elsewhere; of a known rig in finer forms, too, which the last fit does of an equivalent one."""
    if search.model == EQUIVALENT and best.names:
        return _best_of_settled(search, best, stages)
    best = search.settled(best)
    return refined(best, search.report, threads=search.threads) if search.model == RIG else best


def _best_of_settled(search: Search, best: Fitted, stages: list[list[Fitted]]) -> Fitted:
    """Fit the best and who is near it again from other loops, put those fits in their stages, and give the best one.

    Of a free rig an optimum of another loop may be further below than one effect is below another: slack and stiffening
    stood alike before, and far apart once one of them alone had been settled.
    """
    competitors = [
        g for stage in stages for g in stage
        if len(g.names) == len(best.names) and g.names != best.names and g.square < _NEAR_FREE * best.square
    ]  # fmt: skip
    samples = samples_of(best)
    competitors = sorted(competitors, key=lambda g: score(g, samples))[:MOST_COMPETITORS]
    again = {id(g): search.settled(g) for g in (best, *competitors)}
    stages[:] = [[again.get(id(g), g) for g in stage] for stage in stages]
    found = min(again.values(), key=lambda g: score(g, samples))
    return found if found is again[id(best)] else search.pruned(found)


def _settled_competitors(search: Search, best: Fitted, stages: list[list[Fitted]]) -> list[list[Fitted]]:
    """Fit who is near the best again from elsewhere, where the rig is known: rivals may stand in a valley, too."""
    if search.model != RIG:
        return stages
    samples = samples_of(best)
    near = score(best, samples) + _RIVALS * ALIKE

    def again(g: Fitted) -> Fitted:
        return search.settled(g) if g.names != best.names and score(g, samples) < near else g

    return [[again(g) for g in stage] for stage in stages]


def _names(smooth: Smooth) -> str:
    return ", ".join(smooth.names) or "nothing that was looked at"


def _distinct(augmented: list[Fitted]) -> list[Fitted]:
    """Sort by score, and keep the best form of each set of effects."""
    if not augmented:
        return []
    samples = samples_of(min(augmented, key=lambda g: g.square))
    out: dict[frozenset[str], Fitted] = {}
    for g in sorted(augmented, key=lambda g: score(g, samples)):
        out.setdefault(frozenset(g.names), g)
    return list(out.values())


def _pays(before: Fitted, after: Fitted, tried: int) -> bool:
    """Tell whether a further effect is worth its constants, after that many were tried, and matters."""
    samples = samples_of(after)
    gain = score(before, samples) - score(after, samples)
    return gain > ALIKE + 2 * math.log(tried) and after.square < PAYS**2 * before.square


def _better_than_free(best: Fitted, smooth: Smooth, samples: float) -> bool:
    return score(best, samples) < bic(smooth.square, smooth.parameters, samples)


def _confusable(best: Fitted, stages: list[list[Fitted]], samples: float, near: float) -> tuple[tuple[str, ...], ...]:
    """Give for each effect those that explain the records as well in its place."""
    out: list[tuple[str, ...]] = []
    alike = [
        g for stage in stages for g in stage
        if g is not best and len(g.names) <= len(best.names) and score(g, samples) - score(best, samples) < near
    ]  # fmt: skip
    for name in best.names:
        others = set(best.names) - {name}
        found = [n for g in alike if others <= set(g.names) for n in g.names if n not in best.names]
        out.append(tuple(dict.fromkeys(found)))
    return tuple(out)
