"""Trace the residual of measured data to the physical effect that the model lacks.

The declared model is fitted to all records together. Where its residual is above the noise, every effect of the
catalogue is added in turn and fitted with it; the best one stays, if it is better than a free function of the same
regressors and explains what is left; then again, for a second and a third effect. Scores are of all samples, those held
out included, with a penalty for constants (:func:`validation.fitting.bic`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student
from threadpoolctl import threadpool_limits

from fem_models.checks import RigError
from fem_models.program import SolverError
from hysteresis.metrics import Errors, errors
from hysteresis.path import branches, cycle_index, require_reversal
from hysteresis.record import Record, RecordError
from hysteresis.uncertainty import Parameter
from validation.curves import curve_problem
from validation.division import divide
from validation.effect import Effect, Values, catalogue
from validation.equivalent import equivalent_problem
from validation.fitting import (
    Division,
    Fitted,
    Model,
    Start,
    bic,
    correlation_of_neighbours,
    fit,
    independent,
    promise,
    promise_together,
    together,
)
from validation.geared import geared_problem
from validation.mechanics import rig_problem
from validation.problem import Added
from validation.residual import Floor, Smooth, floor_of, smooth_functions

Floats = NDArray[np.float64]

STRUCTURE = 1.15
"""Residual over the noise floor from which there is something to explain, for a rig, known or equivalent."""
STILL = 1.3
"""The same for what a first effect leaves, and for a curve and a loop, which meet no rig exactly."""
PAYS = 0.9
"""Of the residual before: an effect that leaves more is not worth naming."""
EXPLAINED = 0.75
"""Part of the residual's excess over the noise, as squares, that effects must explain together to be named."""
AT_FLOOR = 1.5
"""Residual over the noise floor that counts as explained in any case."""
ALIKE = 10.0
"""Difference of the criterion below which effects are not told apart: very strong evidence from there on
(Kass, Raftery 1995, doi 10.1080/01621459.1995.10476572)."""
OF_GAIN = 0.03
"""Of the whole gain, the same where the geometry is unknown: neither a free rig nor a curve meets it exactly."""
MOST_EFFECTS = 3
FOLLOWED, FOLLOWED_LATER = 6, 5
"""Candidates that are fitted in full, of those that promise most: for the first effect, and for further ones."""
_FOLLOWED_FREE = 8  # the same for a first effect of a rig of which all is free, where promises are worth less
_TRIED = 2  # models that a further effect is added to
_FEW_CALLS = 4  # of a fit's steps, to see who is worth the rest
_NEAR = 6.0  # of the least mean square after those: what is further off is not fitted to the end
_OTHER_FORM = 1.5  # of that of the effect's best form
_FINISHED, _FINISHED_FREE = 5, 3  # effects at most that are brought to their end; the same where all of a rig is free
_LOOPED = 3  # of those, the best, which are fitted from other loops of the material, too
_LESSER_FORM = 0.8  # of the promise of an effect's best form: forms that promise less are not fitted
_ALL_CALLS = 40
_LOOP, _OTHER_LOOPS = "loop_angle_deg", (0.5, 2.0)
"""Constant of a rig, and times its value from which it is fitted again: a loop of few slipping elements has an optimum
for each of them at the ends of the smaller records."""
_NEAR_NOISE = 1.05  # times the noise: what is as near needs no other loop
_EARLY = 4  # steps of a declared model of which all is free
_UNLIKE = 0.08  # of half the largest range: a rig that is so far off is not what made the records
_PROMISE = 0.02  # of the residual's square: candidates that promise less are not fitted

Progress = Callable[[str], None]
ModelName = Literal["rig", "equivalent rig", "curve"]
RIG: ModelName = "rig"
EQUIVALENT: ModelName = "equivalent rig"
CURVE: ModelName = "curve"


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

    records: tuple[Record, ...]
    model: ModelName
    verdict: str
    declared: Fitted
    grown: Fitted
    candidates: tuple[Candidate, ...]  # with one more effect than the model before, best first
    confusable: tuple[tuple[str, ...], ...]  # of each effect in the grown model
    floor: Floor
    smooth: Smooth
    samples: float  # that count as independent
    words: tuple[str, ...]
    alike: float  # difference of the criterion below which effects were not told apart

    @property
    def known(self) -> bool:
        """Whether the geometry is."""
        return self.model == RIG

    @property
    def effects(self) -> tuple[Added, ...]:
        """Effects that are named; none where the verdict names none."""
        return self.grown.model.added


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
    tell = progress or (lambda words: None)
    known = [r if r.cycle is not None else replace(r, cycle=cycle_index(r)) for r in records]
    for record in known:
        if record.drive_unit != "N":
            require_reversal(record)
    mechanical = rig_problem(known) or geared_problem(known)
    chosen = effects or catalogue()
    with threadpool_limits(1, user_api="blas"):  # matrices are small: its threads would wait for each other
        if mechanical is None:
            return _of_unknown(known, chosen, threads, tell)
        return _of_known(_Search(tuple(known), mechanical, RIG, chosen, threads, tell))


def _of_known(search: _Search) -> Trace:
    """Trace records of a rig that is declared."""
    division = divide(search.records, search.problem.sights, search.problem.kept)
    search.tell("the declared model")
    model = Model(search.problem)
    declared = fit(model, division, model.row(search.problem.start, []), threads=search.threads)
    return _verdict(search, search.of_other_loops(declared))


def _of_unknown(records: Sequence[Record], effects: Sequence[Effect], threads: int, tell: Progress) -> Trace:
    """Trace records of unknown geometry: by the simplest rig where one explains them, else by a curve and a loop."""
    found = []
    if records[0].drive_unit != "N":
        with suppress(SolverError, RigError):  # records that no such rig follows
            rig = _Search(tuple(records), equivalent_problem(records), EQUIVALENT, effects, threads, tell)
            rig = replace(rig, early=_declared(rig, _EARLY))
            declared = _declared(rig)
            if math.sqrt(declared.square) < _UNLIKE * rig.problem.scale.angle_deg:
                found.append(_verdict(rig, declared))
    if not (found and _explained(found[0])):
        for elements in (1, 2):  # a run of a curve takes less time than handing it over to a thread
            curve = _Search(tuple(records), curve_problem(records, elements=elements), CURVE, effects, 1, tell)
            found.append(_verdict(curve, _declared(curve)))
    samples = _samples(min((trace.grown for trace in found), key=lambda fitted: fitted.square))
    return _held_out(min(found, key=lambda trace: _worth(trace, samples)), threads, tell)


def _worth(trace: Trace, samples: float) -> float:
    """Criterion of what a trace says; of one without a word for it, that of its free functions, which a name must beat.

    A declared model that needs an effect less than another one does not win by it.
    """
    if trace.verdict == "unexplained":
        return bic(trace.smooth.square, trace.smooth.constants, samples)
    return _score(trace.grown, samples)


def _explained(trace: Trace) -> bool:
    return trace.verdict != "unexplained" and math.sqrt(trace.grown.square) <= STILL * trace.floor.deg


def _declared(search: _Search, most_calls: int = _ALL_CALLS) -> Fitted:
    """Fit the declared model of records of unknown geometry to all samples.

    What is free takes what one amplitude shows for its own; all records together tell effects apart.
    """
    division = divide(search.records, search.problem.sights, search.problem.kept)
    everything = Division(tuple(np.ones_like(mask) for mask in division.train), division.by)
    search.tell(f"the declared model ({search.model})")
    model = Model(search.problem)
    start = model.row(search.problem.start, []) if search.early is None else search.early.x
    return fit(model, everything, start, threads=search.threads, most_calls=most_calls)


def _held_out(whole: Trace, threads: int, tell: Progress) -> Trace:
    """Fit again what was found, without the samples that are held out: errors are of fits that have not seen them."""
    problem = whole.declared.model.problem
    division = divide(whole.records, problem.sights, problem.kept, own_preload=whole.model != CURVE)
    named = (whole.declared, whole.grown)
    home = Model(problem).row(problem.start, [])  # where all data have brought them would tell what is held out

    def again(fitted: Fitted) -> Fitted:
        """Fit again; those that are not named by a step from where they were, whose derivatives are known."""
        tell(f"{' + '.join(fitted.names) or 'the declared model'}, held out")
        brief = whole.model != CURVE and fitted not in named
        calls, known = (3, fitted.jacobian) if brief else (_ALL_CALLS, None)
        return fit(fitted.model, division, fitted.x, threads=threads, most_calls=calls, known=known, home=home)

    refitted = {id(fitted): again(fitted) for fitted in (whole.declared, *(c.fitted for c in whole.candidates))}
    candidates = tuple(replace(c, fitted=refitted[id(c.fitted)]) for c in whole.candidates)
    return replace(
        whole,
        declared=refitted[id(whole.declared)],
        grown=refitted[id(whole.grown)],
        candidates=candidates,
    )


@dataclass(frozen=True, eq=False)
class _Search:
    records: tuple[Record, ...]
    problem: Any
    model: ModelName
    effects: Sequence[Effect]
    threads: int
    tell: Progress
    early: Fitted | None = None  # the declared model after a few steps, before it takes an effect for its own
    starts: dict[str, list[tuple[Any, Sequence[Values]]]] = field(default_factory=dict)

    @property
    def costly(self) -> bool:
        """Whether a run of the model takes milliseconds."""
        return self.model != CURVE

    def floor(self, fitted: Fitted) -> Floor:
        return floor_of(self.records, self.problem.kept, fitted.residuals)

    def grow(self, fitted: Fitted, most: int) -> list[Fitted]:
        """Add each effect that is not there yet: those that promise most, fitted in full."""
        calls = _FEW_CALLS if self.costly else _ALL_CALLS
        bases = [fitted] if fitted.names or self.early is None else [fitted, self.early]
        few: list[tuple[int, Fitted]] = []  # with the number of the base that it started from
        for number, base in enumerate(bases):
            found = [starts for e in self.effects if e.name not in fitted.names and (starts := self._starts(base, e))]
            found.sort(key=lambda starts: -starts[0].gain)
            known = base.jacobian if self.costly else None
            for start in [s for starts in found[: most if self.costly else None] for s in starts]:
                if (there := self._fit(fitted, start.added, start.x, calls, known)) is not None:
                    few.append((number, there))
        few.sort(key=lambda one: one[1].square)
        return self._finished(fitted, few) if self.costly else [g for _, g in few]

    def _finished(self, fitted: Fitted, few: Sequence[tuple[int, Fitted]]) -> list[Fitted]:
        """Fit the best after a few steps to the end; those that have fallen behind are left as they stand."""
        most = _FINISHED if self.model == RIG else _FINISHED_FREE
        grown = list[Fitted]()
        best = dict[str, float]()  # mean square after the first steps, of the effects that are followed
        followed = set[tuple[str, int]]()  # with the bases that they have been followed from
        for number, g in few:
            name = g.names[-1]
            if name not in best and len(best) < most and g.square < _NEAR * few[0][1].square:
                best[name] = g.square
            first = (name, number) not in followed
            near = name in best and (first or g.square <= _OTHER_FORM * best[name])
            more = self._fit(fitted, g.model.added[-1], g.x) if near else None
            if near:
                followed.add((name, number))
            grown.append(min((h for h in (g, more) if h is not None), key=lambda h: h.square))
        if self.model != RIG:
            return grown
        leading = dict[str, Fitted]()  # best forms of the best effects
        for g in sorted(grown, key=lambda g: g.square):
            if len(leading) < _LOOPED:
                leading.setdefault(g.names[-1], g)
        return [*map(self.of_other_loops, leading.values()), *(g for g in grown if leading.get(g.names[-1]) is not g)]

    def _fit(
        self, fitted: Fitted, added: Added, x: Floats, most_calls: int = 30, known: Floats | None = None
    ) -> Fitted | None:
        """Fit a model with one more effect; None where it cannot follow its records."""
        self.tell(" + ".join([*fitted.names, added.effect.name]))
        model = Model(self.problem, (*fitted.model.added, added))
        try:
            return fit(model, fitted.division, x, threads=self.threads, most_calls=most_calls, known=known)
        except (SolverError, RigError):
            return None

    def of_other_loops(self, fitted: Fitted) -> Fitted:
        """Fit again from other loops of the material, where noise is not all that is left."""
        if _LOOP not in self.problem.start or math.sqrt(fitted.square) <= _NEAR_NOISE * self.floor(fitted).deg:
            return fitted
        declared, more = fitted.model.values(fitted.x)
        found = [fitted]
        for times in _OTHER_LOOPS:
            self.tell(f"{' + '.join(fitted.names) or 'the declared model'}, another loop")
            x = fitted.model.row({**declared, _LOOP: times * declared[_LOOP]}, more)
            with suppress(SolverError, RigError):
                found.append(fit(fitted.model, fitted.division, x, threads=self.threads))
        return min(found, key=lambda other: other.square)

    def pruned(self, fitted: Fitted) -> Fitted:
        """Leave out effects that are needless, the first one's fit having found its way only beside the second."""
        for name in fitted.names[::-1]:
            if len(fitted.names) < 2:
                break
            kept = tuple(a for a in fitted.model.added if a.effect.name != name)
            declared, more = fitted.model.values(fitted.x)
            values = [v for a, v in zip(fitted.model.added, more, strict=True) if a.effect.name != name]
            model = Model(self.problem, kept)
            self.tell(" + ".join(a.effect.name for a in kept))
            try:
                without = fit(model, fitted.division, model.row(declared, values), threads=self.threads)
            except (SolverError, RigError):
                continue
            samples = _samples(fitted)
            if _score(without, samples) - _score(fitted, samples) < ALIKE:
                fitted = without
        return fitted

    def _known_starts(self, effect: Effect) -> list[tuple[Any, Sequence[Values]]]:
        """Forms of an effect with their starts, which are worked out once."""
        if effect.name not in self.starts:
            forms = [(form, self.problem.starts(form)) for form in self.problem.forms(effect)]
            if self.model == RIG:  # its constants may have taken the effect for their own: from where they were, too
                forms = [(form, [*values, *({**self.problem.start, **v} for v in values)]) for form, values in forms]
            self.starts[effect.name] = forms
        return self.starts[effect.name]

    def _starts(self, fitted: Fitted, effect: Effect) -> list[Start]:
        """Give the best start of an effect; of its other forms, those that promise a good part of that."""
        best = []
        for form, values in self._known_starts(effect):
            added = Added(effect, form)
            found = [promise(fitted, added, v) for v in values]
            found += [promise_together(fitted, added, v) for v in together(added, values)]
            there = [s for s in found if s is not None and s.gain > _PROMISE]
            if there:
                best.append(max(there, key=lambda s: s.gain))
        best.sort(key=lambda s: -s.gain)
        return [s for s in best[:3] if s.gain > _LESSER_FORM * best[0].gain]


def _samples(fitted: Fitted) -> float:
    sights = fitted.model.problem.sights
    turns = sum(len(branches(part)) for s in sights for part in _loads(s.drive, s.cycle))
    return independent(fitted.row.size, correlation_of_neighbours(fitted.errors), turns)


def _loads(drive: Floats, cycle: NDArray[np.int64]) -> list[Floats]:
    """Cut a record where its drive jumps back between trials."""
    jumps = np.flatnonzero((np.diff(cycle) != 0) & (np.abs(np.diff(drive)) > 0.5 * np.ptp(drive))) + 1
    return np.split(drive, jumps)


def _score(fitted: Fitted, samples: float) -> float:
    return bic(fitted.square, fitted.x.size, samples)


def _verdict(search: _Search, declared: Fitted) -> Trace:
    """Add effects as long as they pay, then judge what they explain."""
    floor = search.floor(declared)
    before = math.sqrt(declared.square)
    smooth = smooth_functions(declared, search.records, search.problem.sights, _samples(declared))
    stages: list[list[Fitted]] = []
    front, best = [declared], declared
    structure = STRUCTURE if search.costly else STILL
    while len(stages) < MOST_EFFECTS and (
        math.sqrt(best.square) > (STILL if stages else structure) * search.floor(best).deg
    ):
        most = (_FOLLOWED_FREE if search.model == EQUIVALENT else FOLLOWED) if not stages else FOLLOWED_LATER
        grown = _distinct([g for model in front for g in search.grow(model, most)])
        if not grown:
            break
        stages.append(grown)
        if not _pays(best, grown[0], len(search.effects)):
            break
        front, best = grown[:_TRIED], grown[0]
    best = search.pruned(best)
    samples = _samples(best)
    if all(best is not g for stage in stages for g in stage) and best is not declared:
        stages = [[g for g in stage if set(g.names) != set(best.names)] for stage in stages]
        stages.append([best])
    candidates = tuple(Candidate(g, _score(declared, samples) - _score(g, samples)) for stage in stages for g in stage)
    floor = Floor(min(floor.local_deg, search.floor(best).local_deg), search.floor(best).repeats_deg)
    after, excess = math.sqrt(best.square), max(declared.square - floor.deg**2, 1e-300)
    explained = (declared.square - best.square) / excess
    words = []
    if before <= structure * floor.deg:
        verdict, best = "none", declared
    elif best is declared:
        verdict = "unexplained"
    elif not _better_than_free(best, smooth, samples):
        verdict = "unexplained"
        words.append(f"free functions of {', '.join(smooth.names)} do better than {' + '.join(best.names)}")
    elif after > AT_FLOOR * floor.deg and explained < EXPLAINED:
        verdict = "unexplained"
        words.append(f"{' + '.join(best.names)} explains {100 * explained:.0f} % of what is above the noise")
    else:
        verdict = "effect"
    alike = ALIKE if search.model == RIG else max(ALIKE, OF_GAIN * (_score(declared, samples) - _score(best, samples)))
    confusable = _confusable(best, stages, samples, alike) if verdict == "effect" else ()
    if any(confusable):
        verdict = "ambiguous"
    if verdict == "unexplained":
        words.append(f"the residual goes with {_names(smooth)}")
        best = declared
    elif best is not declared and after > AT_FLOOR * floor.deg:
        rest = smooth_functions(best, search.records, search.problem.sights, samples)
        words.append(f"{after:.2g} deg is left, {after / floor.deg:.2g} times the noise; it goes with {_names(rest)}")
    return Trace(
        search.records,
        search.model,
        verdict,
        declared,
        best,
        candidates,
        confusable,
        floor,
        smooth,
        samples,
        tuple(words),
        alike,
    )


def _names(smooth: Smooth) -> str:
    return ", ".join(smooth.names) or "nothing that was looked at"


def _distinct(grown: list[Fitted]) -> list[Fitted]:
    """Sort by score, and keep the best form of each set of effects."""
    if not grown:
        return []
    samples = _samples(min(grown, key=lambda g: g.square))
    out: dict[frozenset[str], Fitted] = {}
    for g in sorted(grown, key=lambda g: _score(g, samples)):
        out.setdefault(frozenset(g.names), g)
    return list(out.values())


def _pays(before: Fitted, after: Fitted, tried: int) -> bool:
    """Tell whether a further effect is worth its constants, after that many were tried, and matters."""
    samples = _samples(after)
    gain = _score(before, samples) - _score(after, samples)
    return gain > ALIKE + 2 * math.log(tried) and after.square < PAYS**2 * before.square


def _better_than_free(best: Fitted, smooth: Smooth, samples: float) -> bool:
    return _score(best, samples) < bic(smooth.square, smooth.constants, samples)


def _confusable(best: Fitted, stages: list[list[Fitted]], samples: float, near: float) -> tuple[tuple[str, ...], ...]:
    """Give for each effect those that explain the records as well in its place."""
    out: list[tuple[str, ...]] = []
    alike = [
        g for stage in stages for g in stage
        if g is not best and len(g.names) <= len(best.names) and _score(g, samples) - _score(best, samples) < near
    ]  # fmt: skip
    for name in best.names:
        others = set(best.names) - {name}
        found = [n for g in alike if others <= set(g.names) for n in g.names if n not in best.names]
        out.append(tuple(dict.fromkeys(found)))
    return tuple(out)


def parameters(fitted: Fitted, samples: float) -> list[dict[str, Parameter]]:
    """Values of the declared model's constants and of each effect's, with 95 % intervals from the Jacobian."""
    J, seen = fitted.jacobian[fitted.division.seen], int(fitted.division.seen.sum())
    count = max(2.0, samples * seen / fitted.row.size)
    variance = float(fitted.train @ fitted.train) / max(1, seen - J.shape[1]) * seen / count
    scale = np.maximum(np.linalg.norm(J, axis=0), 1e-12)
    _, singular, basis = np.linalg.svd(J / scale, full_matrices=False)
    singular = np.maximum(singular, 1e-9 * singular[0])
    deviation = np.sqrt(variance * ((basis.T / singular) ** 2).sum(axis=1)) / scale
    half = float(student.ppf(0.975, max(1.0, count - J.shape[1]))) * deviation
    shown = [
        (
            c.name,
            Parameter(
                c.outer(x),
                max(c.low, c.outer(max(x - h, c.inner(c.low)))),
                min(c.high, c.outer(min(x + h, c.inner(c.high)))),
                c.unit,
            ),
        )
        for c, x, h in zip(fitted.model.constants, fitted.x.tolist(), half.tolist(), strict=True)
    ]
    out, at = [dict(shown[: fitted.model.own])], fitted.model.own
    for added in fitted.model.added:
        out.append(dict(shown[at : at + len(added.form.constants)]))
        at += len(added.form.constants)
    return out


def errors_of(fitted: Fitted) -> tuple[Errors, Errors]:
    """Errors of the fitted samples, and of those held out."""
    observed, seen = np.concatenate(fitted.model.problem.observed), fitted.division.seen
    predicted = observed + fitted.row
    return errors(observed[seen], predicted[seen]), errors(observed[~seen], predicted[~seen])
