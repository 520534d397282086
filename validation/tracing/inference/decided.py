"""The verdict of a trace by its test."""

from __future__ import annotations

from dataclasses import replace

from validation.tracing.inference.decision import Decision
from validation.tracing.outcome import Candidate, Trace
from validation.tracing.plausibility import implausible, remarks
from validation.tracing.settings import MOST_ALIKE, POLICIES
from validation.tracing.verdict import depends_on, without_effects


def decided(trace: Trace, decision: Decision) -> Trace:
    """Give a trace the verdict of its test, and its fits in place of those of the search with the same effects."""
    if decision.baseline is not trace.baseline:
        trace = without_effects(POLICIES[trace.model], decision.baseline)
    samples = decision.best.samples
    fits = (*decision.shown, *(one.fitted for one in decision.compared))
    compared = [Candidate(one, trace.baseline.bic(samples) - one.bic(samples)) for one in fits]
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
        decision=replace(decision, decides=True),
    )


def _chance(decision: Decision) -> str:
    """Say how sure the claim is, or how little there is to claim."""
    part, draws = f"{100 * decision.p_none:.2g} %", f"{decision.simulations} draws, alpha {decision.alpha:g}"
    return f"without an effect, chance looks as much like one in {part} of such records (p_none; {draws})"


def _reasons(trace: Trace, decision: Decision) -> list[str]:
    """Say what is left, what it depends on, and what a reader should look at."""
    left = f"{decision.discrepancy_deg:.2g} deg rms is left above the noise of the sensor, more than clean rigs leave"
    more = [left] if decision.leaves_more else []
    match decision.verdict:
        case "none":
            return []
        case "unexplained":
            return [*_not_named(decision), *more, depends_on(trace.smooth)]
    return [*more, *remarks(decision.best)]


def _not_named(decision: Decision) -> list[str]:
    """Say why an effect that is claimed is not named."""
    if not decision.claimed:
        return []
    best, alike = decision.shown[:1], [" + ".join(names) for names in decision.not_distinguished]
    words = [f"{' + '.join(one.names)} would explain the residual, but {'; '.join(implausible(one))}" for one in best]
    if len(alike) > 1 + MOST_ALIKE:
        words.append(f"these records do not tell {len(alike)} effects apart: {', '.join(alike)}")
    elif alike:
        words.append(f"{' or '.join(alike)} explains less than it leaves")
    return words
