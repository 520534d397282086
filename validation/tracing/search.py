"""Search for effects beside a declared model: starts, steps, and what is fitted to the end.

A run of a known rig takes milliseconds, so that most of the catalogue is left out by what it promises, and most of the
rest after a few steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fem_models.rig.checks import RigError, SolverError
from hysteresis.arrays import Floats
from validation.tracing.effect import Effect, Values
from validation.tracing.fitting import (
    Fitted,
    Model,
    Start,
    bic,
    correlation_of_neighbours,
    fit,
    independent,
    joint_linearised_gain,
    linearised_gain,
    together,
)
from validation.tracing.problem import AddedEffect
from validation.tracing.residual import Floor, floor_of

ALIKE = 10.0
"""Difference of the criterion below which effects are not told apart: very strong evidence from there on
(Kass, Raftery 1995, doi 10.1080/01621459.1995.10476572)."""
FEW_CALLS = 4  # of a fit's steps, to see who is worth the rest
_NEAR, _NEAR_NOISE_TOO, _NEAR_FREE = 6.0, 4.0, 12.0
"""Times the least mean square after those steps, or at an end: what is further off is not fitted to its own end. The
same where an end is noise, of what is near one form is followed then; and where all of a rig is free, whose first steps
tell less: drag and delay, slack and stiffening were three times the noise there and ended at it."""
_OTHER_FORM = 1.5  # of that of the effect's best form
_FINISHED, _FINISHED_FREE = 5, 3  # effects at most that are brought to their end; the same where all of a rig is free
_LEADING, _LEADING_FREE = 3, 1  # of those, the best, which are fitted in richer forms and from other loops, too
_LESSER_FORM = 0.8  # of the promise of an effect's best form: forms that promise less are not fitted
ALL_CALLS = 40
_LOOP, _OTHER_LOOPS, _AT_LAST = "loop_angle_deg", (0.5, 2.0), (0.5, 1.6)
"""Constant of a rig, and times its value from which it is fitted again, in the search and at its end: a loop of few
slipping elements has an optimum for each of them at the ends of the smaller records."""
_ACTS = 1e-6  # of the largest slope: a constant with less does nothing where a model stands
_NEAR_NOISE = 1.05  # times the noise: what is as near needs no other loop
_NOT_FAR = 1.2  # times the error of a fit: one from elsewhere that is as near after a few steps is followed
_RIVAL = 1.5  # of the mean square of what is as near: others beyond it do not, either
_DOUBTFUL = 2.0  # times the noise: a declared model up to which another loop may leave nothing to explain
_PROMISE = 0.02  # of the residual's square: candidates that promise less are not fitted

Progress = Callable[[str], None]
ModelName = Literal["rig", "equivalent rig", "curve"]
RIG: ModelName = "rig"
EQUIVALENT: ModelName = "equivalent rig"
CURVE: ModelName = "curve"


@dataclass(frozen=True, eq=False)
class Search:
    """Records, the declared model of them, and the effects that are looked for."""

    problem: Any
    model: ModelName
    effects: Sequence[Effect]
    threads: int
    report: Progress
    early: Fitted | None = None  # the declared model after a few steps, before it takes an effect for its own
    starts: dict[str, list[tuple[Any, Sequence[Values]]]] = field(default_factory=dict)

    @property
    def costly(self) -> bool:
        """Whether a run of the model takes milliseconds."""
        return self.model != CURVE

    def floor(self, fitted: Fitted) -> Floor:
        """Noise of the records beneath what a model leaves."""
        return floor_of(self.problem.records, fitted.residuals)

    def augment(self, fitted: Fitted, most: int) -> list[Fitted]:
        """Add each effect that is not there yet: those that promise most, fitted in full."""
        calls = FEW_CALLS if self.costly else ALL_CALLS
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
        """Fit the best after a few steps to the end; those that have fallen behind are left as they stand.

        Each base puts one effect forward at least: beside a declared model that has taken the effect for its own,
        others that do nothing stand as near as that model does, and would take all places.
        """
        most = _FINISHED if self.model == RIG else _FINISHED_FREE
        augmented = list[Fitted]()
        best = dict[str, float]()  # mean square after the first steps, of the effects that are followed
        followed = set[tuple[str, int]]()  # with the bases that they have been followed from
        heard = set[int]()  # bases that have put one forward
        noise_too = False
        least, near = few[0][1].square if few else math.inf, _NEAR if self.model == RIG else _NEAR_FREE
        for number, g in few:
            name = g.names[-1]
            if name not in best and (len(best) < most or number not in heard) and g.square < near * least:
                best[name] = g.square
                heard.add(number)
            first = (name, number) not in followed
            on = name in best and (first or (not noise_too and g.square <= _OTHER_FORM * best[name]))
            more = self._fit(fitted, g.model.added[-1], g.x) if on else None
            if on:
                followed.add((name, number))
            augmented.append(more or g)
            if more is not None and more.square < least:
                least, noise_too = more.square, self.is_noise(more)
                if self.model == RIG:
                    near = _NEAR_NOISE_TOO if noise_too else _NEAR
        if not augmented:
            return augmented
        leading = dict[str, Fitted]()  # best forms of the best effects
        for g in sorted(augmented, key=lambda g: g.square):
            if len(leading) < (_LEADING if self.model == RIG else _LEADING_FREE):
                leading.setdefault(g.names[-1], g)
        rest = [g for g in augmented if leading.get(g.names[-1]) is not g]
        best_of_all = min(augmented, key=lambda g: g.square)
        enough = _RIVAL * best_of_all.square if self.is_noise(best_of_all) else math.inf
        return [*(self._led_on(fitted, g) if g.square <= enough else g for g in leading.values()), *rest]

    def _led_on(self, fitted: Fitted, augmented: Fitted) -> Fitted:
        """Fit a leading effect on, in richer forms and from other loops."""
        return self.of_other_loops(self._of_richer_form(fitted, augmented))

    def _of_richer_form(self, fitted: Fitted, augmented: Fitted) -> Fitted:
        """Fit an effect in its forms with more constants, from where it stands, if noise is not all that it leaves."""
        if self.is_noise(augmented):
            return augmented
        *before, last = augmented.model.added
        baseline, more = augmented.model.values(augmented.x)
        few = list[Fitted | None]()
        for form, starts in self._known_starts(last.effect):
            if set(more[-1]) < {c.name for c in form.parameters}:
                added = AddedEffect(last.effect, form)
                model = Model(self.problem, (*before, added))
                rows = [model.row(baseline, [*more[:-1], {**values, **more[-1]}]) for values in starts]
                few += [self._fit(fitted, added, x, FEW_CALLS) for x in np.unique(rows, axis=0)]
        found = [g for g in few if g is not None]
        if not found:
            return augmented
        best = min(found, key=lambda g: g.square)
        best = self._fit(fitted, best.model.added[-1], best.x) or best
        samples = samples_of(best)
        return min((augmented, best), key=lambda g: score(g, samples))

    def _fit(
        self, fitted: Fitted, added: AddedEffect, x: Floats, most_calls: int = 30, known: Floats | None = None
    ) -> Fitted | None:
        """Fit a model with one more effect; None where it cannot follow its records."""
        self.report(" + ".join([*fitted.names, added.effect.name]))
        model = Model(self.problem, (*fitted.model.added, added))
        try:
            return fit(model, fitted.holdout, x, threads=self.threads, most_calls=most_calls, known=known)
        except (SolverError, RigError):
            return None

    def is_noise(self, fitted: Fitted) -> bool:
        """Tell whether a model leaves no more than noise."""
        return math.sqrt(fitted.square) <= _NEAR_NOISE * self.floor(fitted).deg

    def doubtful(self, fitted: Fitted) -> bool:
        """Tell whether a model leaves little more than noise, which an optimum that was missed may account for."""
        return math.sqrt(fitted.square) <= _DOUBTFUL * self.floor(fitted).deg

    def of_other_loops(self, fitted: Fitted) -> Fitted:
        """Fit again from other loops of the material, where noise is not all that is left; the best for all samples.

        The search compares effects by all samples; at its end the fitted ones choose (:meth:`settled`).
        """
        if self.is_noise(fitted):
            return fitted
        found = [fitted]
        for x in other_loops(fitted, _OTHER_LOOPS):
            self.report(f"{' + '.join(fitted.names) or 'the declared model'}, another loop")
            with suppress(SolverError, RigError):
                found.append(fit(fitted.model, fitted.holdout, x, threads=self.threads))
        return min(found, key=lambda other: other.square)

    def settled(self, fitted: Fitted) -> Fitted:
        """Fit a grown model of a rig again from elsewhere; of all fits the one that is best where it was fitted.

        Play and friction at the base stand still alike, until the next sample tells them apart: such a valley ends a
        fit on its way. The flattest way of a rig of which all is free is that of all its forces, which tells nothing.
        """
        if self.model == CURVE or not fitted.names:
            return fitted
        found = [fitted]
        for x in (*other_loops(fitted), *(along_the_valley(fitted) if self.model == RIG else ())):
            self.report(f"{' + '.join(fitted.names)}, another start")
            with suppress(SolverError, RigError):
                there = fit(fitted.model, fitted.holdout, x, threads=self.threads, most_calls=FEW_CALLS)
                if there.train_rmse_deg < _NOT_FAR * fitted.train_rmse_deg:
                    found.append(fit(fitted.model, fitted.holdout, there.x, threads=self.threads))
        return min(found, key=lambda other: other.train_rmse_deg)

    def pruned(self, fitted: Fitted) -> Fitted:
        """Leave out effects that are needless, the first one's fit having found its way only beside the second."""
        for name in fitted.names[::-1]:
            if len(fitted.names) < 2:
                break
            kept = tuple(a for a in fitted.model.added if a.effect.name != name)
            baseline, more = fitted.model.values(fitted.x)
            values = [v for a, v in zip(fitted.model.added, more, strict=True) if a.effect.name != name]
            model = Model(self.problem, kept)
            self.report(" + ".join(a.effect.name for a in kept))
            try:
                without = fit(model, fitted.holdout, model.row(baseline, values), threads=self.threads)
            except (SolverError, RigError):
                continue
            samples = samples_of(fitted)
            if score(without, samples) - score(fitted, samples) < ALIKE:
                fitted = without
        return fitted

    def exchanged(self, fitted: Fitted, most: int) -> list[Fitted]:
        """Exchange each named effect for others, beside what else is named.

        A rival of the first one may never have been beside the second: it fell behind where the first stood alone.
        """
        augmented = list[Fitted]()
        for i, added in enumerate(fitted.model.added):
            others = replace(self, effects=[e for e in self.effects if e.name != added.effect.name])
            with suppress(SolverError, RigError):
                augmented += [_put_in(g, i) for g in others.augment(_without(fitted, i), most)]
        return augmented

    def _known_starts(self, effect: Effect) -> list[tuple[Any, Sequence[Values]]]:
        """Forms of an effect with their starts, which are worked out once."""
        if effect.name not in self.starts:
            known = [f for f in self.problem.forms(effect) if not (self.costly and f.refines)]
            forms = [(form, self.problem.starts(form)) for form in known]
            if self.model == RIG:  # its constants may have taken the effect for their own: from where they were, too
                forms = [(form, [*values, *({**self.problem.start, **v} for v in values)]) for form, values in forms]
            self.starts[effect.name] = forms
        return self.starts[effect.name]

    def _starts(self, fitted: Fitted, effect: Effect) -> list[Start]:
        """Give the best start of an effect; of its other forms, those that promise a good part of that."""
        best = []
        for form, values in self._known_starts(effect):
            added = AddedEffect(effect, form)
            found = [linearised_gain(fitted, added, v) for v in values]
            found += [joint_linearised_gain(fitted, added, v) for v in together(added, values)]
            there = [s for s in found if s is not None and s.gain > _PROMISE]
            if there:
                best.append(max(there, key=lambda s: s.gain))
        best.sort(key=lambda s: -s.gain)
        return [s for s in best[:3] if s.gain > _LESSER_FORM * best[0].gain]


def _without(fitted: Fitted, place: int) -> Fitted:
    """Take an effect out of a model and leave all else as it stands."""
    kept = [i for i in range(len(fitted.model.added)) if i != place]
    model, columns = _of_effects(fitted.model, kept)
    x = fitted.x[columns]
    errors = tuple(fitted.holdout.centred(model.errors(x)))
    return Fitted(model, fitted.holdout, x, errors, fitted.jacobian[:, columns], 1)


def _put_in(fitted: Fitted, place: int) -> Fitted:
    """Give the last effect of a model another place: that of the one that it was exchanged for."""
    last = len(fitted.model.added) - 1
    model, columns = _of_effects(fitted.model, [*range(place), last, *range(place, last)])
    return replace(fitted, model=model, x=fitted.x[columns], jacobian=fitted.jacobian[:, columns])


def _of_effects(model: Model, which: Sequence[int]) -> tuple[Model, NDArray[np.int64]]:
    """Give the model with some of its effects, in that order, and where their coordinates are in the whole one's."""
    ends = np.cumsum([model.own, *(len(a.form.parameters) for a in model.added)])
    columns = [np.arange(model.own), *(np.arange(ends[i], ends[i + 1]) for i in which)]
    return Model(model.problem, tuple(model.added[i] for i in which)), np.concatenate(columns)


def other_loops(fitted: Fitted, at: Sequence[float] = _AT_LAST) -> list[Floats]:
    """Give the coordinates of a fitted model with other loops of the material; none of a model without one."""
    baseline, more = fitted.model.values(fitted.x)
    if _LOOP not in baseline:
        return []
    return [fitted.model.row({**baseline, _LOOP: times * baseline[_LOOP]}, more) for times in at]


def along_the_valley(fitted: Fitted) -> list[Floats]:
    """Give the coordinates a size away, either way, along what the fitted samples tell least."""
    slopes = fitted.jacobian[fitted.holdout.seen]
    lengths = np.linalg.norm(slopes, axis=0)
    acts = lengths > _ACTS * lengths.max()
    *_, directions = np.linalg.svd(slopes[:, acts], full_matrices=False)
    flattest = np.zeros(acts.size)
    flattest[acts] = directions[-1] / np.abs(directions[-1]).max()
    return [fitted.x + flattest, fitted.x - flattest]


def samples_of(fitted: Fitted, *, held_out: bool = True) -> float:
    """Count the samples that are as good as independent, by what a model leaves; of the fitted ones alone if asked."""
    turns = sum(one.branch_count for one in fitted.model.problem.records)
    if held_out:
        return independent(fitted.row.size, correlation_of_neighbours(fitted.errors), turns)
    seen = [error[train] for error, train in zip(fitted.errors, fitted.holdout.train, strict=True)]
    part = fitted.train.size / fitted.row.size
    return independent(fitted.train.size, correlation_of_neighbours(seen), round(part * turns))


def score(fitted: Fitted, samples: float) -> float:
    """Criterion of a fitted model, the less the better."""
    return bic(fitted.square, fitted.x.size, samples)
