"""The verdict of a trace by its test."""

from __future__ import annotations

from dataclasses import replace

from validation.tracing.inference.decision import Decision
from validation.tracing.outcome import Candidate, Trace
from validation.tracing.plausibility import remarks
from validation.tracing.settings import POLICIES
from validation.tracing.verdict import depends_on, without_effects


def decided(trace: Trace, decision: Decision) -> Trace:
    """Give a trace the verdict of its test, and its fits in place of those of the search with the same effects."""
    if decision.baseline is not trace.baseline:
        trace = without_effects(POLICIES[trace.model], decision.baseline)
    samples = decision.best.samples
    compared = [
        Candidate(one.fitted, trace.baseline.bic(samples) - one.fitted.bic(samples)) for one in decision.compared
    ]
    again = {frozenset(one.names) for one in compared}
    others = [one for one in trace.candidates if frozenset(one.names) not in again]
    named = decision.verdict not in ("none", "unexplained")
    return replace(
        trace,
        verdict=decision.verdict,
        augmented=decision.best if named else trace.baseline,
        candidates=(*compared, *others),
        confusable=decision.confusable if named else (),
        words=(_chance(decision), *_reasons(trace, decision)),
        decision=decision,
    )


def _chance(decision: Decision) -> str:
    """Say how sure the claim is, or how little there is to claim."""
    part, draws = f"{100 * decision.p_none:.2g} %", f"{decision.simulations} draws, alpha {decision.alpha:g}"
    return f"without an effect, chance looks as much like one in {part} of such records (p_none; {draws})"


def _reasons(trace: Trace, decision: Decision) -> list[str]:
    """Say what is left, what it depends on, and what a reader should look at."""
    left = f"{decision.discrepancy_deg:.2g} deg rms is left above the noise of the sensor, more than clean rigs leave"
    match decision.verdict:
        case "none":
            return []
        case "unexplained" if decision.claimed:
            return [f"no effect with parameters that make sense explains it; {left}", depends_on(trace.smooth)]
        case "unexplained":
            return [left, depends_on(trace.smooth)]
        case "partial":
            return [left, *remarks(decision.best)]
    return remarks(decision.best)
