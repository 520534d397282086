"""Trace the residual of measured data to the physical effect that the model lacks.

1. A baseline model is fitted to all records together: the known rig, or an equivalent rig where the geometry is
   unknown.
2. Where its residual is above the noise, every effect of the catalogue is added in turn and fitted with it. The best
   one stays if it pays for its parameters, then a second and a third one (:mod:`validation.tracing.search`).
3. Effects are named if they explain most of the residual, and better than smooth functions of the same quantities
   (:mod:`validation.tracing.verdict`). Models are compared by the BIC over all samples.
4. Effects that leave the error on held-out data where it was are taken back.

The curve model is fitted where no equivalent rig explains the records, or only with an effect.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.of_record import bends_in_space, declared_rig_of, rig_of
from hysteresis.records.path import cycle_index, require_reversal
from hysteresis.records.planes import Coupling, coupling
from hysteresis.records.record import Record, RecordError
from hysteresis.records.thinning import thinned
from hysteresis.sensors.lateness import late_words
from hysteresis.sensors.lone_steps import without_lost_counts
from hysteresis.sensors.readings import require_rows
from validation.tracing.baseline.curve import curve_problem
from validation.tracing.baseline.equivalent_rig import equivalent_rig_problem
from validation.tracing.baseline.first_state import with_first_states
from validation.tracing.baseline.in_space import SpaceProblem, space_problem, with_reference
from validation.tracing.baseline.known_rig import (
    KnownRigProblem,
    known_rig_problem,
    rig_under_tendon_force,
    with_varied_flexures,
)
from validation.tracing.baseline.motor_drive import MotorDriveProblem, motor_drive_problem
from validation.tracing.baseline.rig_problem import RigProblem
from validation.tracing.cross_validated import play_baselines, trace_by_folds, trace_change
from validation.tracing.effect import Effect, acting, catalogue
from validation.tracing.fitting import Fitted, Model, fit
from validation.tracing.fitting.evidence import (
    beats_smooth_functions,
    is_noise,
    is_worth_adding,
    nothing_to_explain,
    rests_early,
)
from validation.tracing.fitting.fitted import rms
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.fitting.noise import sensor_noise_deg
from validation.tracing.fitting.smooth import smooth_functions
from validation.tracing.inference.decided import decided
from validation.tracing.inference.decision import decide
from validation.tracing.outcome import Trace, turns_are_alike
from validation.tracing.search import Search, best_of_other_loops, refit_without_heldout, select_effects
from validation.tracing.search.exchanged_preloads import exchanged_words
from validation.tracing.search.refine import refined
from validation.tracing.search.search import FitCount, Progress
from validation.tracing.search.stepwise import Selection
from validation.tracing.sensors.drive_steps import sensor_words
from validation.tracing.sensors.protocol import NOT_AS_RECORDED
from validation.tracing.settings import (
    AS_DECLARED,
    COMPETITOR_NOISE,
    CURVE,
    EARLY_STEPS,
    EQUIVALENT_RIG,
    FAR_ABOVE,
    KNOWN_RIG,
    LEAST_ABSORBED,
    MOST_STEPS,
    NOT_ALIKE,
    POLICIES,
    REFERENCE_MOST,
    SIGNIFICANT,
)
from validation.tracing.verdict import (
    above_noise,
    best_of,
    confirmed_on_heldout,
    doubted_on_heldout,
    doubted_with_leap,
    doubted_without_noise,
    ended_above_noise,
    is_as_good,
    is_explained,
    is_too_little,
    judge,
    left_near_noise,
    named_in_part,
    partial_above_floor,
    predicts_better,
    with_remaining_error,
    without_effects,
)

ONE_SENSE = 0.5
"""Correlation of angle and drive from which its sign is the sense of the rig."""
ALIKE_TURNS = (
    "the records do not show which is turned about the tube axis, the tendons (plane_coupling) or the sensor "
    "(turned_sensor): a wrist that is as stiff in both planes reads nearly the same"
)
TURN_OF = {
    "plane_coupling": "the tendons are turned against the notches; a sensor that is turned by as much fits worse here",
    "turned_sensor": "the sensor is turned against the rig, or the tube with its tendons in its mounting; tendons that "
    "are turned by as much fit worse here",
}


def trace_records(
    records: Sequence[Record],
    *,
    reference: Sequence[Record] = (),
    threads: int = 2,
    progress: Callable[[str, int, int], None] | None = None,
    effects: Sequence[Effect] | None = None,
    alpha: float | None = None,
    seed: int = 0,
) -> Trace:
    """Trace the residual of the records of one rig.

    Parameters
    ----------
    records
        At least one; they share the parameters of the rig.
    reference
        Records of the same rig before a change: then only what changed since is traced.
    threads
        For runs of the records and for derivatives.
    progress
        Called before every fit with what is fitted, and with how many fits are done and expected so far.
    effects
        Effects that are tried; by default the whole catalogue.
    alpha, seed
        Probability with which the verdict may claim an effect that is not there, where the kind of baseline has a test
        (:func:`validation.tracing.inference.decide`), and of its draws. By default, None, rules decide.

    Raises
    ------
    RecordError, RigError, SolverError
        Records that cannot be used or divided, whose rows are in no order, or a rig that cannot exist.
    """
    if not records:
        raise RecordError("no record: expected at least one")
    records, reference = [_usable(one) for one in records], [_usable(one) for one in reference]
    report = FitCount(progress or (lambda words, done, expected: None))
    every = catalogue() if effects is None else effects
    if any(bends_in_space(record) for record in (*records, *reference)):
        return _trace_in_space(records, reference, acting(every, in_space=True), threads, report)
    tried = acting(every, in_space=False)
    (records, lost), (reference, lost_before) = _with_all_counts(records), _with_all_counts(reference)
    numbered, old = _numbered(records), _numbered(reference)
    if old:
        trace = _traced_change(numbered, old, tried, report)
        trace = doubted_with_leap(trace, lost=bool(lost))
        notes = (*lost, *lost_before, *map(_out_of_plane, filter(None, map(coupling, numbered))))
        return replace(trace, words=(*trace.words, *notes, *sensor_words(trace.records, trace.floor.deg)))
    problem = known_rig_problem(numbered) or motor_drive_problem(numbered)
    notes = problem.channel_words if problem else _rigs_not_used(numbered)
    with threadpool_limits(1, user_api="blas"):  # matrices are small: its threads would wait for each other
        if problem is None:
            trace = _by_rules(_trace_unknown_geometry(numbered, tried, threads, report), threads, known=False)
        else:
            search = Search(problem, KNOWN_RIG, tried, threads, report)
            tested = None if alpha is None else _by_test(search, alpha, seed)
            trace = tested or _by_rules(_trace_known_rig(search), threads, known=True)
    trace = doubted_with_leap(doubted_on_heldout(doubted_without_noise(trace)), lost=bool(lost))
    notes = (*lost, *notes, *map(_out_of_plane, filter(None, map(coupling, numbered))))
    return replace(trace, words=(*trace.words, *notes, *sensor_words(trace.records, trace.floor.deg)))


def _usable(record: Record) -> Record:
    """Thin a long record; refuse one whose rows are in no order."""
    require_rows(record)
    return thinned(record)


def _by_rules(trace: Trace, threads: int, *, known: bool) -> Trace:
    """Give a trace of records of one plane the verdict that its held-out samples leave."""
    if trace.baseline.fold_errors is not None:
        return trace
    trace = _confirmed(trace)
    if trace.verdict == "unexplained" and known:
        trace = partial_above_floor(named_in_part(trace, threads))
    return with_remaining_error(left_near_noise(trace))


def _trace_in_space(
    records: Sequence[Record],
    reference: Sequence[Record],
    effects: Sequence[Effect],
    threads: int,
    report: Progress,
) -> Trace:
    """Trace records of a known rig in space."""
    problem, shared = space_problem((*records, *reference)), list[str]()
    assert problem is not None  # one of the rigs bends in space
    with threadpool_limits(1, user_api="blas"):
        if reference:
            report("the reference alone", 0)
            before = _trace_in_space(reference, (), effects, threads, report)
            own = before.augmented.model.values(before.augmented.x)[1]
            forms = [(one.form, values) for one, values in zip(before.effects, own, strict=True)]
            problem = with_reference(problem, len(reference), forms)
            if forms:
                shared = [f"the reference itself shows {' + '.join(before.names)}, which all records are given"]
        trace = _trace_as_declared(Search(problem, KNOWN_RIG, effects, threads, report))
    trace = replace(trace, reference=len(reference) * len(problem.angles))
    trace = with_remaining_error(_confirmed(trace))
    trace = doubted_with_leap(doubted_without_noise(_left_by_reference(trace)))
    notes = (*shared, *_turn_words(trace), *problem.channel_words, *sensor_words(trace.records, trace.floor.deg))
    return replace(trace, words=(*trace.words, *notes))


def _left_by_reference(trace: Trace) -> Trace:
    """Find no change where nothing is named, and the model leaves as much on the reference as on the new records."""
    errors = trace.baseline.errors
    if not trace.reference or trace.verdict != "unexplained":
        return trace
    left, before = (rms(np.concatenate(part)) for part in (errors[: -trace.reference], errors[-trace.reference :]))
    if left > REFERENCE_MOST * before:
        return trace
    words = f"the model leaves {left:.2g} deg on the new records and {before:.2g} deg on the reference"
    return replace(trace, verdict="none", floor=replace(trace.floor, reference_deg=before), words=(words,))


def _turn_words(trace: Trace) -> tuple[str, ...]:
    """Say which turn about the tube axis mixes the two planes, or that the records do not show which."""
    if turns_are_alike(trace):
        return (ALIKE_TURNS,)
    found, tried = set(TURN_OF) & set(trace.names), {name for one in trace.candidates for name in one.names}
    return tuple(TURN_OF[name] for name in found) if len(found) == 1 and tried >= set(TURN_OF) else ()


def _out_of_plane(one: Coupling) -> str:
    """Word on the second angle of a record whose rig, as far as it is known, bends in one plane."""
    return (
        f"{Path(one.record).name or 'a record'}: angle_2 moves by up to {one.largest_deg:.2g} deg, "
        f"{100 * one.share:.2g} % of angle: bending out of the plane, which no model of one plane explains"
    )


def _with_all_counts(records: Sequence[Record]) -> tuple[list[Record], tuple[str, ...]]:
    """Let the drive of each record go on where counts were lost, and say where."""
    pairs = [without_lost_counts(record) for record in records]
    return [record for record, _ in pairs], tuple(words for _, words in pairs if words)


def _numbered(records: Sequence[Record]) -> list[Record]:
    """Give every sample its cycle; refuse records that never reverse."""
    numbered = [r if r.cycle is not None else replace(r, cycle=cycle_index(r)) for r in records]
    for record in numbered:
        if record.drive_unit != "N":
            require_reversal(record)
    return numbered


def _traced_change(
    records: Sequence[Record], reference: Sequence[Record], effects: Sequence[Effect], report: Progress
) -> Trace:
    """Trace what changed since a reference."""
    for record in (*records, *reference):
        if record.drive_unit == "N":
            where = record.source or "record"
            raise RecordError(f"{where}: drive.unit = N: expected a drive that reverses, to compare with a reference")
    _require_one_sense(records, reference)
    with threadpool_limits(1, user_api="blas"):
        return doubted_with_leap(trace_change(records, reference, effects, report))


def _require_one_sense(records: Sequence[Record], reference: Sequence[Record]) -> None:
    """Refuse an angle of another sign than the reference: a camera that was set up anew is no change of the rig."""
    senses = [float(np.corrcoef(one.drive, one.angle_deg)[0, 1]) for one in (*reference, *records)]
    first = senses[0]
    for one, sense in zip((*reference, *records), senses, strict=True):
        if sense * first < 0 and min(abs(sense), abs(first)) > ONE_SENSE:
            how = ("falls", "rises") if sense < 0 else ("rises", "falls")
            first_name = Path(reference[0].source).name or "its first record"
            raise RecordError(
                f"{one.source or 'record'}: angle_deg: {how[0]} as the drive rises: expected the sign of the "
                f"reference, {first_name}, where it {how[1]}"
            )


def find_effects(search: Search, baseline: Fitted, *, down_to_noise: bool = False) -> Trace:
    """Add effects to a fitted baseline as long as they pay, and judge what they explain."""
    smooth = smooth_functions(baseline)
    selection = select_effects(search, baseline, smooth, down_to_noise=down_to_noise)
    return judge(search.policy, baseline, smooth, selection)


def _by_test(search: Search, alpha: float, seed: int) -> Trace | None:
    """Trace records of a known rig by the test of its baseline; None where the kind of baseline has none.

    The stiffness of measured joints is taken as declared first, beside one effect. Where that leaves more than clean
    rigs do, it may vary along the bend (:data:`validation.tracing.baseline.known_rig.VARIED_FLEXURES`).
    """
    varied = with_varied_flexures(search.problem) if isinstance(search.problem, KnownRigProblem) else None
    found = _tested(search if varied is None else replace(search, most_effects=1), alpha, seed)
    if varied is None or found is None or found.verdict not in ("partial", "unexplained"):
        return found
    other = _tested(replace(search, problem=varied, _forms={}), alpha, seed)
    samples = found.augmented.samples
    traces = [found, *([other] if other else [])]
    return min(traces, key=lambda one: (one.verdict in ("partial", "unexplained"), one.augmented.bic(samples)))


def _tested(search: Search, alpha: float, seed: int) -> Trace | None:
    """Test one baseline of a known rig."""
    search.report("the baseline model", len(search.effects))
    search, baseline = _from_first_states(search, best_of_other_loops(search, _baseline_of_known_rig(search)))
    trace = without_effects(search.policy, baseline)
    if words := _as_recorded(search, baseline):
        return replace(trace, verdict="unexplained", words=(NOT_AS_RECORDED, words))
    decision = decide(
        trace,
        effects=search.effects,
        alpha=alpha,
        seed=seed,
        threads=search.threads,
        most_effects=search.most_effects,
        report=search.report,
    )
    if decision is None:
        return None
    found = decided(trace, decision)
    fine = refined(found.augmented, search.report, threads=search.threads) if found.effects else found.augmented
    return replace(found, augmented=fine)


# --- known rig -------------------------------------------------------------------------------------------------------


def _trace_known_rig(search: Search) -> Trace:
    """Trace records whose rig is known; the held-out samples are never fitted.

    The stiffness of measured joints is taken as declared first, beside at most one effect. Where that leaves more than
    noise, it may vary along the bend (:data:`validation.tracing.baseline.known_rig.VARIED_FLEXURES`).
    """
    problem = search.problem
    varied = with_varied_flexures(problem) if isinstance(problem, KnownRigProblem) else None
    if varied is None:
        return _trace_as_declared(search)
    declared = left_near_noise(_trace_as_declared(replace(search, most_effects=1)))
    if declared.verdict == "none" or declared.augmented.rmse_deg <= AS_DECLARED * declared.floor.deg:
        return declared
    beside = Search(varied, KNOWN_RIG, search.effects, search.threads, search.report, most_effects=2)
    other = _trace_as_declared(beside)
    near = other.baseline.train_rmse_deg < FAR_ABOVE * other.floor.deg
    if (len(other.effects) > 1 or near) and other.augmented.rmse_deg > AS_DECLARED * other.floor.deg:
        other = named_in_part(other, search.threads)
    other = left_near_noise(other)
    if is_explained(declared) and is_as_good(declared.augmented, other.augmented, declared.floor):
        return declared
    samples = min((declared.augmented, other.augmented), key=lambda g: g.mean_square).samples
    return min([declared, other], key=lambda one: (not is_explained(one), one.augmented.bic(samples)))


def _trace_as_declared(search: Search) -> Trace:
    """Trace records beside one baseline of a known rig."""
    search.report("the baseline model", len(search.effects))
    baseline = _baseline_of_known_rig(search)
    baseline = best_of_other_loops(search, baseline)
    search, baseline = _from_first_states(search, baseline)
    if words := _as_recorded(search, baseline):
        return replace(without_effects(search.policy, baseline), verdict="unexplained", words=(NOT_AS_RECORDED, words))
    if rests_early(baseline) and not isinstance(search.problem, SpaceProblem):  # whose runs take far longer
        search = replace(search, early=_declared(search, baseline))
    return _with_better_baseline(search, find_effects(search, baseline))


def _from_first_states(search: Search, baseline: Fitted) -> tuple[Search, Fitted]:
    """Fit the baseline again where records do not begin at rest (:mod:`validation.tracing.baseline.first_state`)."""
    if not isinstance(search.problem, RigProblem) or is_noise(baseline):
        return search, baseline
    train, values = baseline.holdout.train, baseline.model.values(baseline.x)[0]
    problem = with_first_states(search.problem, values, train)
    if problem is search.problem:
        return search, baseline
    with suppress(SolverError, RigError):
        found = fit(Model(problem), baseline.holdout, baseline.x, threads=search.threads)
        if found.square < baseline.square:
            return replace(search, problem=problem, _forms={}), found
    return search, baseline


def _as_recorded(search: Search, baseline: Fitted) -> str | None:
    """Say what is wrong with the records of a known rig, where no effect can tell; None where nothing is."""
    if not isinstance(search.problem, RigProblem) or nothing_to_explain(baseline, search.policy):
        return None
    for one in search.problem.records:
        if words := late_words(one.record):
            name = Path(one.record.source).name or "a record"
            return f"{name}: {words}, and without times (t_s) no delay can be traced"
    return exchanged_words(search, baseline)


def _declared(search: Search, baseline: Fitted) -> Fitted | None:
    """Give the baseline of the declared parameters as they are; None where that rig does not follow the records."""
    model = Model(search.problem)
    start = model.coordinates(search.problem.start, [])
    with suppress(SolverError, RigError):
        return fit(model, baseline.holdout, start, threads=search.threads, most_steps=1)
    return None


def _baseline_of_known_rig(search: Search) -> Fitted:
    """Fit the baseline; behind a motor once more, from the declared tendons and the gain that they need.

    Records hardly separate gain and stretch. On the way to its friction a fit may go along that valley, in which the
    prior is too weak to bring it back.
    """
    problem = search.problem
    model = Model(problem)
    holdout = problem.divided() if isinstance(problem, SpaceProblem) else divide_records(problem.records)
    start = model.coordinates(problem.start, [])
    found = fit(model, holdout, start, threads=search.threads)
    if not isinstance(problem, MotorDriveProblem):
        return found
    declared = {name: problem.start[name] for name in ("EA_N", problem.gain) if name in problem.start}
    there = model.coordinates({**model.values(found.x)[0], **declared}, [])
    again = fit(model, holdout, there, threads=search.threads, prior_mean=start)

    def cost(fitted: Fitted) -> float:
        prior = problem.prior_weight_deg * (fitted.x - start)
        errors = fitted.rows.errors[fitted.rows.train]
        return float(errors @ errors + prior @ prior)

    return min(found, again, key=cost)


def _with_better_baseline(search: Search, trace: Trace) -> Trace:
    """Fit the baseline again, from its parameters beside the named effects, in case the first fit missed the optimum.

    The search is repeated where the effects do not pay beside the better baseline, or where smooth functions of its
    residual fit better than they do.
    """
    if not trace.effects:
        return trace
    before, augmented, model = trace.baseline, trace.augmented, Model(search.problem)
    try:
        baseline = fit(model, before.holdout, augmented.x[: model.baseline_size], threads=search.threads)
    except (SolverError, RigError):  # parameters that the rig can only have with its effects
        return trace
    if baseline.square >= before.square:
        return trace
    smooth = smooth_functions(baseline)
    pays = is_worth_adding(baseline, augmented, len(search.effects)) and beats_smooth_functions(augmented, smooth)
    if nothing_to_explain(baseline, search.policy) or not pays:
        return find_effects(search, baseline)
    return judge(search.policy, baseline, smooth, Selection(augmented, [[c.fitted for c in trace.candidates]]))


# --- unknown geometry ------------------------------------------------------------------------------------------------


def _trace_unknown_geometry(
    records: Sequence[Record], effects: Sequence[Effect], threads: int, report: Progress
) -> Trace:
    """Trace records by the simplest rig that explains them, or else by a curve with a loop or by play operators.

    The curve model is also fitted when the equivalent rig needs effects to explain the records. It then counts if it
    explains them without an effect, or if the rig needs several. Where neither comes near the noise, play operators are
    chosen if they predict better; a search that is far behind their held-out error is given up.
    """
    report("the baseline model (play operators)", len(effects))
    plays = play_baselines(records)
    by_folds, competitors = None, (math.inf, math.inf, math.inf)
    if plays is not None:
        fitted = plays.fitted[0]
        if plays.heldout_deg > COMPETITOR_NOISE * fitted.noise.deg:
            by_folds = trace_by_folds(plays, effects, report)
        explained_deg = by_folds.augmented.heldout_rmse_deg if by_folds else math.inf
        competitors = plays.heldout_deg, explained_deg, _noise_of_competitor(fitted)
    rig, by_rig = _trace_equivalent_rig(records, effects, threads, report, competitors)
    traces = [by_rig] if by_rig else []
    explained = by_rig is not None and (is_explained(by_rig) or is_too_little(by_rig))
    if by_rig is None or not explained or by_rig.effects:
        for elements in (1, 2):  # a run of a curve takes less time than handing it over to a thread
            problem = curve_problem(records, elements=elements)
            search = _beside(Search(problem, CURVE, effects, 1, report), competitors)
            baseline = _baseline_of_all_samples(search)
            if by_rig is None or not explained:
                if not search.is_no_better(baseline):
                    traces.append(find_effects(search, baseline))
            elif nothing_to_explain(baseline, CURVE) or (len(by_rig.effects) > 1 and not is_too_little(by_rig)):
                traces += [one for one in [find_effects(search, baseline)] if one.verdict != "unexplained"]
    unexplained = not explained and all(trace.verdict == "unexplained" for trace in traces)
    if rig and by_rig and unexplained and ended_above_noise(by_rig, rig.policy):
        traces.append(_with_better_baseline(rig, find_effects(rig, by_rig.baseline, down_to_noise=True)))
    best = best_of(traces) if traces else None
    if best is not None and (is_explained(best) or is_too_little(best)):
        by_folds = None
    elif plays is not None and by_folds is None:
        by_folds = trace_by_folds(plays, effects, report)
    if best is None or (by_folds is not None and by_folds.augmented.heldout_rmse_deg < best.augmented.rmse_deg):
        assert by_folds is not None
        return by_folds
    try:
        best = refit_without_heldout(best, POLICIES[best.model], threads, report)
    except SolverError:  # play operators need no equilibrium
        if plays is None:
            raise
        return by_folds or trace_by_folds(plays, effects, report)
    if by_folds is None:
        return best
    return by_folds if predicts_better(by_folds, _confirmed(best)) else best


def _confirmed(trace: Trace) -> Trace:
    """Give a trace whose model was chosen by all samples the verdict that its held-out samples leave.

    Effects that predict no better than the baseline are not named, whatever their fit.
    """
    return partial_above_floor(confirmed_on_heldout(above_noise(trace)))


def _noise_of_competitor(fitted: Fitted) -> float:
    """Noise floor of play operators, deg; what neighbours hide counts where it is all that is left."""
    hidden_deg = sensor_noise_deg(fitted.model.problem.records, fitted.residuals) or 0.0
    return max(fitted.noise.deg, hidden_deg if fitted.rmse_deg <= SIGNIFICANT * hidden_deg else 0.0)


def _trace_equivalent_rig(
    records: Sequence[Record],
    effects: Sequence[Effect],
    threads: int,
    report: Progress,
    competitors: tuple[float, float, float],
) -> tuple[Search | None, Trace | None]:
    """Trace records by an equivalent rig; None where no such rig follows them."""
    if records[0].drive_unit == "N":
        return None, None
    with suppress(SolverError, RigError):
        problem = equivalent_rig_problem(records)
        search = _beside(Search(problem, EQUIVALENT_RIG, effects, threads, report), competitors)
        early = _baseline_of_all_samples(search, EARLY_STEPS)
        baseline = _baseline_of_all_samples(replace(search, early=early))
        at_rest = search
        search, baseline = _from_first_states(search, baseline)
        if search is not at_rest:
            early = _baseline_of_all_samples(search, EARLY_STEPS)
        if early.square > LEAST_ABSORBED * baseline.square:
            search = replace(search, early=early)
        if baseline.rmse_deg < NOT_ALIKE * search.problem.scale.angle_deg and not search.is_far_behind(baseline):
            return search, _with_better_baseline(search, find_effects(search, baseline))
    return None, None


def _beside(search: Search, competitors: tuple[float, float, float]) -> Search:
    """Give a search the held-out errors of play operators, without effects and with them, and their noise floor."""
    competitor_deg, explained_deg, noise_deg = competitors
    return replace(search, competitor_deg=competitor_deg, explained_deg=explained_deg, noise_deg=noise_deg)


def _baseline_of_all_samples(search: Search, most_steps: int = MOST_STEPS) -> Fitted:
    """Fit the baseline of records of unknown geometry to all samples (:mod:`validation.tracing.search.final_fit`)."""
    search.report(f"the baseline model ({search.policy.name})", len(search.effects))
    model, holdout = Model(search.problem), divide_records(search.problem.records).everything()
    start = model.coordinates(search.problem.start, []) if search.early is None else search.early.x
    return fit(model, holdout, start, threads=search.threads, most_steps=most_steps)


def _rigs_not_used(records: Sequence[Record]) -> tuple[str, ...]:
    """Say so where some records name their rig and others do not: all records share one baseline."""
    forces = [record for record in records if record.drive_unit == "N"]
    pulled = [record for record in forces if rig_under_tendon_force(record) is None and declared_rig_of(record)]
    if pulled:
        name = Path(pulled[0].source).name or "a record"
        return (f"{name}: its rig has two tendons and is not used under a tendon force: expected a rig of one tendon",)
    without = [r for r in records if (rig_under_tendon_force(r) if r.drive_unit == "N" else rig_of(r)) is None]
    if not 0 < len(without) < len(records):
        return ()
    return (f"{Path(without[0].source).name or 'a record'} names no rig: those of the other records were not used",)
