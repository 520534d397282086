"""Forward selection of effects, and a second look at the best model and its competitors."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from validation.tracing.fitting.evidence import (
    beats_smooth_functions,
    is_beyond_chance,
    is_worth_adding,
    nothing_to_explain,
    ranked_models,
    significant_ratio,
)
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import fit
from validation.tracing.fitting.smooth import Smooth, smooth_functions
from validation.tracing.plausibility import implausible
from validation.tracing.search.candidates import candidates_with_one_more
from validation.tracing.search.exchange import exchanged, from_every_start, pruned
from validation.tracing.search.nested import no_worse_than_contained
from validation.tracing.search.refine import refined
from validation.tracing.search.restarts import best_from_start, best_of_restarts
from validation.tracing.search.search import Search
from validation.tracing.settings import (
    AT_FLOOR,
    COMPETITOR_BIC,
    COMPETITOR_SQUARE,
    EXTENDED_MODELS,
    MOST_COMPETITORS,
    SIGNIFICANT_LOOSE,
    SearchPolicy,
)

READ_ALIKE = (
    ("gravity", "tip_load"),
    ("backlash", "guide_friction", "preloaded_play"),
    ("tendon_slack", "tendon_stiffening"),
    ("camera_misalignment", "drive_gain"),
    ("tendon_creep", "thermal_drift"),
    ("time_delay", "viscous_drag"),
    ("functional_fatigue", "preload_loss"),
    ("notch_closure", "tip_contact"),
)
"""Effects that records may not distinguish; docs/guide/effects-catalogue.md has by what they are distinguished."""
Stages = list[list[Fitted]]
"""Models with one effect more in every stage, best first."""


@dataclass(frozen=True, eq=False)
class Selection:
    """The best model that was found, which may be the baseline, and all models by stage."""

    best: Fitted
    stages: Stages


def select_effects(search: Search, baseline: Fitted, smooth: Smooth, *, down_to_noise: bool = False) -> Selection:
    """Add effects to a baseline as long as they pay.

    Parameters
    ----------
    smooth
        Smooth functions of the baseline's residual.
    down_to_noise
        Whether the search goes on until the residual is noise, in place of ending where the residual of a first effect
        has little structure.
    """
    best, stages = _forward(search, baseline, smooth, down_to_noise=down_to_noise)
    several = search.policy.absorbs_effects and len(best.names) > 1
    if several and best.rmse_deg <= AT_FLOOR * baseline.noise.deg:
        place = len(best.names) - 1
        others = exchanged(search, best, search.policy.later_candidates)
        stages[place] = ranked_models([*stages[place], *others])
        best = stages[place][0]
    best, stages = _restarted(search, pruned(search, best), stages)
    if others := _from_there(search, best, stages):
        first = ranked_models([*(stages[0] if stages else []), best, *others])
        found, best, stages = best, first[0], [first, *stages[1:]]
        if best is not found and not search.policy.absorbs_effects:
            best, stages = _restarted(search, best, stages)
    best, stages = _with_second_near_noise(search, best, stages)
    stages = _with_restarted_competitors(search, best, stages)
    if best is not baseline and all(best is not g for stage in stages for g in stage):
        stages = [[g for g in stage if set(g.names) != set(best.names)] for stage in stages]
        stages.append([best])
    best, stages = _best_after_restarts(search, best, stages)
    return Selection(best, _with_sensible(search, best, _nested(search, baseline, best, stages)))


def _from_there(search: Search, best: Fitted, stages: Stages) -> list[Fitted]:
    """Fit other effects in the place of the one that was found, from the baseline beside it.

    That baseline is nearer to the rig's own than one that has absorbed the effect, from which a competitor may end in
    another optimum.

    Of a known rig these are all others where the residual is near the noise and has structure, since the residual of
    the right effect has none. Else they are those that are hard to distinguish from it (:data:`READ_ALIKE`) and whose
    fit is not as good yet.
    """
    policy = search.policy
    if not policy.screened or len(best.names) != 1:
        return []
    if policy.absorbs_effects:
        return exchanged(replace(search, early=None), best, None)
    if best.rmse_deg <= AT_FLOOR * best.noise.deg and smooth_functions(best).names:
        beside = replace(policy, starts_from_declared=False, leading=1)
        return exchanged(replace(search, early=None, policy=beside, _forms={}), best, None)
    good = {g.names for stage in stages for g in stage if g.bic(best.samples) - best.bic(best.samples) < COMPETITOR_BIC}
    alike = {name for names in READ_ALIKE if best.names[0] in names for name in names}
    others = [e for e in search.effects if e.name in alike and e.name not in best.names and (e.name,) not in good]
    return [g for effect in others for g in from_every_start(search, best, effect)]


def _with_sensible(search: Search, best: Fitted, stages: Stages) -> Stages:
    """Fit the nearest models to convergence where the best one makes no sense: one of them is to be named for it."""
    if not (search.policy.screened and best.names and implausible(best)):
        return stages
    near = [
        g for stage in stages for g in stage
        if g is not best and len(g.names) == len(best.names) and g.square < search.policy.near * best.square
    ]  # fmt: skip
    again = dict[int, Fitted]()
    for g in sorted(near, key=lambda g: g.square)[:MOST_COMPETITORS]:
        search.report(" + ".join(g.names), 0)
        with suppress(SolverError, RigError):
            further = fit(g.model, g.holdout, g.x, threads=search.threads)
            again[id(g)] = further if further.square < g.square else g
    return [sorted((again.get(id(g), g) for g in stage), key=lambda g: g.bic(best.samples)) for stage in stages]


def _best_after_restarts(search: Search, best: Fitted, stages: Stages) -> tuple[Fitted, Stages]:
    """Give the best model with as many effects; on a known rig competitors were fitted again from other starts.

    Another one than before is refined as that was.
    """
    if not (search.policy.along_valley and best.names):
        return best, stages
    alike = [g for stage in stages for g in stage if len(g.names) == len(best.names)]
    found = min((best, *alike), key=lambda g: g.bic(best.samples))
    if found is best or not search.policy.refined:
        return found, stages
    fine = refined(found, search.report, threads=search.threads)
    return fine, [[fine if g is found else g for g in stage] for stage in stages]


def _nested(search: Search, baseline: Fitted, best: Fitted, stages: Stages) -> Stages:
    """Fit models again that are worse than one that they contain and that was improved after them."""
    out: Stages = []
    smaller = [baseline]
    for stage in stages:
        rest = no_worse_than_contained(search, [g for g in stage if g is not best], smaller)
        smaller = sorted([*rest, *(g for g in stage if g is best)], key=lambda g: g.bic(best.samples))
        out.append(smaller)
    return out


def _forward(search: Search, baseline: Fitted, smooth: Smooth, *, down_to_noise: bool) -> tuple[Fitted, Stages]:
    """Add one effect after the other to the best models.

    The residual of a first effect may have some structure, because few models are exact. A baseline that absorbs
    effects hides a good part of a second one, so that it is followed to the noise once its effect is better than smooth
    functions.
    """
    policy = search.policy
    if policy.absorbs_effects and nothing_to_explain(baseline, policy):
        return _beside_noise(search, baseline)
    stages: Stages = []
    front, best = [baseline], baseline
    significant = limit = significant_ratio(baseline, policy)
    while len(stages) < search.most_effects and best.rmse_deg > limit * best.noise.deg:
        models = _with_one_more(search, front, stages[-1] if stages else [baseline])
        if not models:
            break
        stages.append(models)
        if search.gives_up(models[0]) or not is_worth_adding(best, models[0], len(search.effects)):
            break
        front, best = _extended(models, policy), models[0]
        follow = down_to_noise or (policy.absorbs_effects and beats_smooth_functions(best, smooth))
        limit = significant if follow else max(SIGNIFICANT_LOOSE, significant)
    return best, stages


def _with_one_more(search: Search, front: Sequence[Fitted], smaller: Sequence[Fitted]) -> list[Fitted]:
    """Add each further effect to the models of ``front``; all of them, best first.

    Of an equivalent rig the best three with each model of ``front`` are fitted beside the start of the baseline, too.
    The model with one effect had absorbed the other: from it slack with a play came to 1.33 times the noise, from that
    start to 1.01.
    """
    policy, later = search.policy, bool(front[0].names)
    most = policy.later_candidates if later else policy.first_candidates
    found = [g for model in front for g in candidates_with_one_more(search, model, most)]
    models = ranked_models(no_worse_than_contained(search, found, [*smaller]))
    if not (policy.absorbs_effects and later):
        return models
    own = [[g for g in models if set(one.names) <= set(g.names)] for one in front]
    best = {id(g): g for with_one in own for g in with_one[:MOST_COMPETITORS]}
    return ranked_models([*(best_from_start(search, g) for g in best.values()), *models])


def _extended(models: Sequence[Fitted], policy: SearchPolicy) -> list[Fitted]:
    """Models to which a further effect is added: the best ones.

    Of an equivalent rig, where the best ones are hard to distinguish (:data:`READ_ALIKE`), the best that differs from
    all of them is another one: the further effect may suit it alone.
    """
    front = [*models[:EXTENDED_MODELS]]
    if policy.absorbs_effects and any(_read_alike(front[0], other) for other in front[1:]):
        front += [g for g in models[EXTENDED_MODELS:] if not any(_read_alike(g, one) for one in front)][:1]
    return front


def _read_alike(one: Fitted, other: Fitted) -> bool:
    """Whether two models differ by one effect, for which the other one has one that is hard to distinguish from it."""
    changed = [set(a.names) - set(b.names) for a, b in ((one, other), (other, one))]
    return all(len(names) == 1 for names in changed) and any(set.union(*changed) <= set(n) for n in READ_ALIKE)


def _beside_noise(search: Search, baseline: Fitted) -> tuple[Fitted, Stages]:
    """Add one effect to a baseline whose residual is noise, if it explains far more than chance would."""
    models = _with_one_more(search, [baseline], [baseline])
    if models and is_beyond_chance(baseline, models[0], search.policy):
        return models[0], [models]
    return baseline, []


def _with_second_near_noise(search: Search, best: Fitted, stages: Stages) -> tuple[Fitted, Stages]:
    """Add a second effect where the residual of the first is near the noise, with structure, if it is beyond chance.

    An equivalent rig with one effect absorbs much of another one, so that the residual may be near the noise. What is
    found must make sense, and its residual must have no structure.
    """
    policy = search.policy
    at_noise = best.rmse_deg <= significant_ratio(best, policy) * best.noise.deg
    if not (policy.absorbs_effects and len(best.names) == 1 < search.most_effects and at_noise):
        return best, stages
    if not smooth_functions(best).names:
        return best, stages
    first = [g for g in (stages[0] if stages else []) if set(g.names) != set(best.names)]
    near = [g for g in first if g.square < COMPETITOR_SQUARE * best.square]
    front = [best, *sorted(near, key=lambda g: g.bic(best.samples))[: EXTENDED_MODELS - 1]]
    models = [g for g in _with_one_more(search, front, front) if not implausible(g)]
    if not models or not is_beyond_chance(best, models[0], policy):
        return best, stages
    others = [*exchanged(search, models[0], policy.later_candidates), *(g for stage in stages[1:2] for g in stage)]
    second = ranked_models([*models, *others])
    found, stages_found = _restarted(search, pruned(search, models[0]), [*stages[:1], second])
    if implausible(found) or smooth_functions(found).names:
        return best, stages
    return found, stages_found


def _restarted(search: Search, best: Fitted, stages: Stages) -> tuple[Fitted, Stages]:
    """Fit the best model again from other starting points, and in finer forms where the policy says so."""
    if search.policy.absorbs_effects and best.names:
        return _best_of_restarted(search, best, stages)
    best = best_of_restarts(search, best)
    return (refined(best, search.report, threads=search.threads) if search.policy.refined else best), stages


def _best_of_restarted(search: Search, best: Fitted, stages: Stages) -> tuple[Fitted, Stages]:
    """Fit the best model and its competitors again from other loops, and give the best of those fits.

    An optimum from another loop may be further below than one effect is below another, so that all of them are fitted
    again.
    """
    competitors = [
        g for stage in stages for g in stage
        if len(g.names) == len(best.names) and g.names != best.names
        and g.square < COMPETITOR_SQUARE * best.square
    ]  # fmt: skip
    samples = best.samples
    competitors = sorted(competitors, key=lambda g: g.bic(samples))[:MOST_COMPETITORS]
    again = {id(g): best_of_restarts(search, g) for g in (best, *competitors)}
    stages = [[again.get(id(g), g) for g in stage] for stage in stages]
    found = min(again.values(), key=lambda g: g.bic(samples))
    return (found if found is again[id(best)] else pruned(search, found)), stages


def _with_restarted_competitors(search: Search, best: Fitted, stages: Stages) -> Stages:
    """Fit models that are nearly as good as the best again from other starting points, where the rig is known.

    The nearest ones by their squares are, too, since a fit of the right effect may have ended in another optimum.
    """
    if not search.policy.along_valley:
        return stages
    samples = best.samples
    limit = best.bic(samples) + COMPETITOR_BIC
    others = [g for stage in stages for g in stage if g.names != best.names and len(g.names) == len(best.names)]
    others.sort(key=lambda g: g.square)
    near = {id(g) for g in others[:MOST_COMPETITORS] if g.square < COMPETITOR_SQUARE * best.square}

    def again(g: Fitted) -> Fitted:
        is_near = g.names != best.names and (g.bic(samples) < limit or id(g) in near)
        return best_of_restarts(search, g) if is_near else g

    return [[again(g) for g in stage] for stage in stages]
