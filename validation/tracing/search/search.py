"""What a search for effects works with: a problem, how it is searched, the effects, and the starts of their forms."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.effect import Effect
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import fit
from validation.tracing.fitting.model import Model
from validation.tracing.problem import AddedEffect
from validation.tracing.search.starts import FormStarts
from validation.tracing.settings import (
    COMPETITOR_FAR,
    COMPETITOR_FITTED,
    COMPETITOR_MARGIN,
    COMPETITOR_NOISE,
    MOST_EFFECTS,
    STEPS,
    SearchPolicy,
)

Progress = Callable[[str, int], None]
"""Called before a fit with what is fitted, and with how many fits are known to follow it."""


@dataclass
class FitCount:
    """Count of the fits of a trace: ``said`` is called with what is fitted, and with fits done and expected so far."""

    said: Callable[[str, int, int], None]
    begun: int = 0
    expected: int = 0

    def __call__(self, words: str, ahead: int) -> None:
        """Begin a fit (:data:`Progress`)."""
        self.expected = max(self.expected, self.begun + 1 + ahead)
        self.said(words, self.begun, self.expected)
        self.begun += 1


@dataclass(frozen=True, eq=False)
class Search:
    """A search for effects beside one baseline model.

    Parameters
    ----------
    effects
        The catalogue, or a part of it.
    threads
        For runs of the records and for derivatives.
    report
        Called before every fit.
    early
        The baseline after a few steps, before it has absorbed an effect; effects are started beside it, too.
    competitor_deg
        Held-out error of another kind of baseline, which makes a search give up that does not come near it.
    explained_deg
        The same with the effects that were found beside that baseline.
    noise_deg
        Noise floor of the competitor, which is fitted to more samples: neighbours of thinned ones are further apart,
        and some structure counts as their noise. With the noise that neighbours hide, where that is known.
    most_effects
        Effects that are named together at most.
    """

    problem: Any
    policy: SearchPolicy
    effects: Sequence[Effect]
    threads: int
    report: Progress
    early: Fitted | None = None
    competitor_deg: float = math.inf
    explained_deg: float = math.inf
    noise_deg: float = math.inf
    most_effects: int = MOST_EFFECTS
    _forms: dict[str, list[FormStarts]] = field(default_factory=dict)

    def forms(self, effect: Effect) -> list[FormStarts]:
        """Forms of an effect with their starts, which are computed once."""
        if effect.name not in self._forms:
            forms = [f for f in self.problem.forms(effect) if not (self.policy.screened and f.refines)]
            found = [FormStarts(form, self.problem.starts(form)) for form in forms]
            if self.policy.starts_from_declared:
                declared = self.problem.start
                found = [FormStarts(f.form, [*f.starts, *({**declared, **v} for v in f.starts)]) for f in found]
            self._forms[effect.name] = found
        return self._forms[effect.name]

    def is_far_behind(self, baseline: Fitted) -> bool:
        """Whether the residual of a baseline exceeds a competitor's held-out error, and both are far above the noise.

        Near the noise a competitor may have absorbed an effect that this baseline lacks, and is to be given.
        """
        far = self.competitor_deg > COMPETITOR_FAR * self._noise_deg(baseline)
        return far and baseline.rmse_deg > COMPETITOR_MARGIN * self.competitor_deg

    def is_no_better(self, baseline: Fitted) -> bool:
        """Whether a fitted baseline's residual, far above the noise, is about a competitor's error, or larger."""
        if baseline.rmse_deg > self.competitor_deg:
            return True
        far = self.competitor_deg > COMPETITOR_FAR * self._noise_deg(baseline)
        return far and baseline.rmse_deg > self.competitor_deg / COMPETITOR_FITTED

    def gives_up(self, fitted: Fitted) -> bool:
        """Whether a rig's residual with effects is far above a competitor's without, or no less than with its own."""
        noise_deg = self._noise_deg(fitted)
        if fitted.rmse_deg > max(self.explained_deg / COMPETITOR_MARGIN, COMPETITOR_FAR * noise_deg):
            return True
        return self.policy.screened and fitted.rmse_deg > max(
            self.competitor_deg / COMPETITOR_MARGIN, COMPETITOR_NOISE * noise_deg
        )

    def _noise_deg(self, fitted: Fitted) -> float:
        """Smaller one of two noise floors: that of the more samples, unless those are noisier."""
        return min(fitted.noise.deg, self.noise_deg)

    def with_effect(
        self,
        fitted: Fitted,
        added: AddedEffect,
        x: Floats,
        most_steps: int = STEPS,
        known: Floats | None = None,
        ahead: int = 0,
    ) -> Fitted | None:
        """Fit a model with one more effect from coordinates ``x``; None where it has no solution there.

        Parameters
        ----------
        ahead
            Fits that are known to follow.
        known
            As in :func:`validation.tracing.fitting.least_squares.fit`.
        """
        model = Model(self.problem, (*fitted.model.added, added))
        self.report(" + ".join(model.names), ahead)
        try:
            return fit(model, fitted.holdout, x, threads=self.threads, most_steps=most_steps, known=known)
        except (SolverError, RigError):
            return None
