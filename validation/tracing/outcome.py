"""What a trace finds: the verdict, the models behind it, and all candidates that were compared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from hysteresis.display import html_table, on_screen
from hysteresis.records.record import Record
from validation.tracing.fitting.channel_errors import ChannelFit
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.noise import NoiseFloor
from validation.tracing.fitting.smooth import Smooth
from validation.tracing.problem import AddedEffect
from validation.tracing.result import in_words, trace_report
from validation.tracing.settings import KNOWN_RIG, MOST_COMPETITORS, BaselineName

if TYPE_CHECKING:
    from validation.tracing.inference.decision import Decision

Verdict = Literal["none", "effect", "partial", "ambiguous", "unexplained"]
"""Nothing is missing; effects are named; effects are named, and much is unexplained; effects are named that others
explain as well; none is named."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An augmented model, and how much lower its BIC is than the baseline's."""

    fitted: Fitted
    delta_bic: float

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that it has beside the baseline."""
        return self.fitted.names


@dataclass(frozen=True, eq=False, repr=False)
class Trace:
    """What was found in the records of one rig.

    Parameters
    ----------
    model
        Kind of baseline: a known rig, an equivalent rig, or a curve with a loop.
    baseline
        The fitted model without effects.
    augmented
        The model with the effects that are named; the baseline itself where none is.
    candidates
        All augmented models that were fitted, by the number of their effects and best first.
    confusable
        For each effect of the augmented model, those that explain the records as well in its place.
    floor
        Noise of the angle.
    smooth
        Smooth functions of the baseline's residual, which an effect must be better than.
    words
        Reasons for the verdict.
    alike
        BIC difference below which effects are not distinguished.
    reference
        Number of the last records that are a reference: the others are compared with them.
    channel_fits
        Channels beside the angle that were fitted by themselves.
    decision
        What the test says; None where the kind of baseline has none, or it was not asked.
    """

    model: BaselineName
    verdict: Verdict
    baseline: Fitted
    augmented: Fitted
    candidates: tuple[Candidate, ...]
    confusable: tuple[tuple[str, ...], ...]
    floor: NoiseFloor
    smooth: Smooth
    words: tuple[str, ...]
    alike: float
    reference: int = 0
    channel_fits: tuple[ChannelFit, ...] = ()
    decision: Decision | None = None

    @property
    def records(self) -> tuple[Record, ...]:
        """The records, each with the cycle of every sample."""
        return tuple(one.record for one in self.baseline.model.problem.records)

    @property
    def known(self) -> bool:
        """Whether the geometry of the rig is known."""
        return self.model == KNOWN_RIG.name

    @property
    def effects(self) -> tuple[AddedEffect, ...]:
        """Effects that are named; of records with a reference, those that the reference does not have."""
        return self.augmented.model.added[len(self.baseline.names) :]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of these."""
        return tuple(added.effect.name for added in self.effects)

    def __repr__(self) -> str:
        """One line: verdict, effects, held-out error before and after, noise."""
        names = " + ".join(self.names)
        errors = f"{self.baseline.heldout_rmse_deg:.3g}"
        if names:
            errors += f" -> {self.augmented.heldout_rmse_deg:.3g}"
        found = f"{self.verdict}: {names}" if names else self.verdict
        return f"Trace({found}; held-out error {errors} deg, noise {self.floor.deg:.3g} deg; {self.model})"

    def __str__(self) -> str:
        """Show a screen of it: the verdict in sentences, and the parameters of the effects."""
        report = trace_report(self)
        rows = [f"  {effect.name}: {name} = {p}" for effect in report.effects for name, p in effect.parameters.items()]
        return on_screen([*in_words(report), *rows])

    def _repr_html_(self) -> str:
        """Show the verdict in sentences and the parameters of the effects, for a notebook."""
        report = trace_report(self)
        first, *others = in_words(report)
        rows = [
            (f"{effect.name}: {name}", *(f"{x:.4g}" if x is not None else "" for x in (p.value, p.low, p.high)), p.unit)
            for effect in report.effects
            for name, p in effect.parameters.items()
        ]
        head = ("parameter", "value", "low (95 %)", "high (95 %)", "unit")
        return html_table(first, rows, head if rows else (), others)

    def to_dict(self) -> dict[str, Any]:
        """Plain values as in trace.json, without a second opinion and without a proposed experiment."""
        return trace_report(self).to_dict()


def competitors_of(trace: Trace) -> list[Fitted]:
    """Give the augmented model, then the best model with each effect it may be confused with, or else the runner-up.

    Models of no more effects count, however they were found to be alike: by the criterion, by misfit, or by folds.
    """
    own = set(trace.augmented.names)
    others = [c for c in trace.candidates if not own <= set(c.names) and not set(c.names) <= own]
    others.sort(key=lambda c: -c.delta_bic)
    confusable = {name for names in trace.confusable for name in names}
    alike = [c for c in others if len(c.names) <= len(own)]
    first = {name: next((c for c in alike if name in c.names), None) for name in confusable}
    near = [c for c in alike if any(c is one for one in first.values())] or others[:1]
    return [trace.augmented, *(c.fitted for c in near[:MOST_COMPETITORS])]


def turns_are_alike(trace: Trace) -> bool:
    """Whether turned tendons and a turned sensor explain records of a rig in space alike."""
    turns, others = {"plane_coupling", "turned_sensor"}, {name for names in trace.confusable for name in names}
    return bool(turns & set(trace.names)) and turns <= {*trace.names, *others}
