"""A baseline model with effects added, as a function of one vector of coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from hysteresis.arrays import Floats
from validation.tracing.effect import FreeParameter, Values
from validation.tracing.problem import AddedEffect, FollowedProblem, Problem


@dataclass(frozen=True, eq=False)
class Model:
    """The baseline model of a problem with effects added.

    Its coordinates are all free parameters over their scales in one vector, shape (p,), those of the baseline first.
    """

    problem: Problem
    added: tuple[AddedEffect, ...] = ()

    @cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """All free parameters, p of them."""
        return (*self.problem.parameters, *(p for effect in self.added for p in effect.form.parameters))

    @property
    def baseline_size(self) -> int:
        """Number of parameters of the baseline."""
        return len(self.problem.parameters)

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that were added."""
        return tuple(added.effect.name for added in self.added)

    def coordinates(self, baseline: Values, effects: Sequence[Values]) -> Floats:
        """Coordinates of the parameters of the baseline and of each effect, shape (p,)."""
        values = [baseline[p.name] for p in self.problem.parameters]
        for added, own in zip(self.added, effects, strict=True):
            values += [own[p.name] for p in added.form.parameters]
        return np.array([p.to_unit(v) for p, v in zip(self.parameters, values, strict=True)])

    def values(self, x: Floats) -> tuple[Values, list[Values]]:
        """Parameters of the baseline and of each effect, from coordinates."""
        values = [p.from_unit(v) for p, v in zip(self.parameters, x.tolist(), strict=True)]
        at, effects = self.baseline_size, list[Values]()
        for added in self.added:
            names = [p.name for p in added.form.parameters]
            effects.append(dict(zip(names, values[at : at + len(names)], strict=True)))
            at += len(names)
        baseline = [p.name for p in self.problem.parameters]
        return dict(zip(baseline, values[: self.baseline_size], strict=True)), effects

    def bounds(self) -> tuple[Floats, Floats]:
        """Bounds of the coordinates, shapes (p,)."""
        low, high = zip(*((p.to_unit(p.low), p.to_unit(p.high)) for p in self.parameters), strict=True)
        return np.array(low), np.array(high)

    def errors(self, x: Floats, threads: int = 1) -> list[Floats]:
        """Predicted less measured angle of each record, deg; then each channel of each record, times its weight.

        Errors of the angle between readings are those of the readings about them. Records of a rig run in threads.

        Raises
        ------
        SolverError, RigError
            Parameters that no rig can have, or with which it has no equilibrium.
        """
        if threads > 1 and isinstance(self.problem, FollowedProblem):
            return self.followed(x, threads)[0]
        return self._errors_of(self.problem.predict_series(*self._point(x)))

    def followed(self, x: Floats, threads: int = 1) -> tuple[list[Floats], Any]:
        """Errors, as of :meth:`errors`, and what :meth:`moved_errors` goes on from; None where the problem has none.

        Raises
        ------
        SolverError, RigError
            As :meth:`errors`.
        """
        if not isinstance(self.problem, FollowedProblem):
            return self.errors(x), None
        followed = self.problem.followed(*self._point(x), threads)
        return self._errors_of(followed.series), followed

    def moved_errors(self, followed: Any, near: Sequence[Floats], threads: int) -> list[list[Floats] | None]:
        """Errors at coordinates near those that were followed, to first order; None where there is no solution."""
        assert isinstance(self.problem, FollowedProblem)
        predicted = self.problem.moved(followed, [self._point(x) for x in near], threads)
        return [None if one is None else self._errors_of(one) for one in predicted]

    def _point(self, x: Floats) -> tuple[Values, list[tuple[Any, Values]]]:
        baseline, effects = self.values(x)
        return baseline, [(added.form, own) for added, own in zip(self.added, effects, strict=True)]

    def _errors_of(self, predicted: Sequence[Floats]) -> list[Floats]:
        problem = self.problem
        series = [(1.0, measured) for measured in problem.observed]
        series += [(channel.weight, measured) for channel in problem.channels for measured in channel.measured]
        errors = [w * (own - measured) for own, (w, measured) in zip(predicted, series, strict=True)]
        angle = [one.filled(error) for one, error in zip(problem.records, errors, strict=False)]
        return [*angle, *errors[len(angle) :]]
