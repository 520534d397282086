"""Score of the answers to a benchmark: rates by source, and what was judged of each case."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hysteresis.records.record import RecordError
from validation.practice.benchmark.answers import UNANSWERED, CaseAnswer, NamedEffect, read_answer
from validation.practice.benchmark.sealed import SealedCase, read_sealed
from validation.practice.benchmark.sizes import size_of
from validation.practice.benchmark.sources import SOURCES
from validation.practice.outcome import MOST_REPORTED
from validation.practice.summary import Rate, Spread, rate_of_hits, spread

ALL = "all"
SIZE_WITHIN = 0.25
"""Relative deviation of a size that counts as found."""
GROWN = 0.5
"""Part of a hidden size by which the constant must have grown where the control has the same name."""


@dataclass(frozen=True)
class Judged:
    """A case with its truth and what an answer makes of it.

    Parameters
    ----------
    named
        Names that are claimed, without those of the control and those that describe the sensor.
    reported
        The first of them and those that it may be confused with, at most three.
    size_over_true
        Of the main constant, where both have one.
    heldout_over_noise
        Held-out error that the answer gives, over the noise; for measured records over the residual level.
    """

    case: str
    source: str
    label: str
    truth: tuple[str, ...]
    outside: bool
    verdict: str
    named: tuple[str, ...]
    reported: tuple[str, ...]
    size_over_true: float | None
    heldout_over_noise: float | None

    @property
    def first(self) -> bool:
        """Whether the first name is right."""
        return self.named[:1] != () and self.named[0] in self.truth

    @property
    def within_set(self) -> bool:
        """Whether a right name is in the reported set."""
        return any(name in self.reported for name in self.truth)


@dataclass(frozen=True)
class BenchmarkScore:
    """Score of all answers.

    Parameters
    ----------
    cases, answered
        Numbers of cases that count, and of those with an answer.
    rates
        By source, and ``all``; then by what is counted.
    heldout_over_noise
        By source, of cases whose effect is named first.
    each
        What was judged of each case.
    """

    schema: int
    cases: int
    answered: int
    rates: Mapping[str, Mapping[str, Rate]]
    heldout_over_noise: Mapping[str, Spread]
    each: tuple[Judged, ...]


COUNTED: dict[str, tuple[Callable[[Judged], bool], Callable[[Judged], bool]]] = {
    "first": (lambda one: bool(one.truth), lambda one: one.first),
    "in the set": (lambda one: bool(one.truth), lambda one: one.within_set),
    "wrong name": (lambda one: bool(one.truth), lambda one: bool(one.named) and not one.within_set),
    "missed: none": (lambda one: bool(one.truth), lambda one: not one.named and one.verdict == "none"),
    "undecided": (lambda one: bool(one.truth), lambda one: not one.named and one.verdict != "none"),
    "size within 25 %": (
        lambda one: one.within_set and one.size_over_true is not None,
        lambda one: one.size_over_true is not None and abs(one.size_over_true - 1.0) <= SIZE_WITHIN,
    ),
    "clean: false alarm": (lambda one: not one.truth and not one.outside, lambda one: bool(one.named)),
    "clean: none": (lambda one: not one.truth and not one.outside, lambda one: one.verdict == "none"),
    "outside: abstained": (lambda one: one.outside, lambda one: not one.named),
}
"""What is counted: of which cases, and which of them are hits."""


def score_answers(folder: Path, sealed: Path, answers: Path) -> BenchmarkScore:
    """Score the answers in a folder, ``CASE.json`` each, or ``CASE/trace.json``.

    Raises
    ------
    RecordError
        A case that was changed, answers of other cases, a malformed answer, or no answer at all.
    """
    truth = read_sealed(folder, sealed).cases
    given = {case.name: read_answer(answers, case.name) for case in truth}
    if all(answer.verdict == UNANSWERED for answer in given.values()):
        raise RecordError(f"{answers}: no answer: expected {truth[0].name}.json or {truth[0].name}/trace.json")
    judged = [judge(case, given[case.name], given.get(case.control or "")) for case in truth if case.counts]
    return summarise(judged)


def judge(case: SealedCase, answer: CaseAnswer, control: CaseAnswer | None = None) -> Judged:
    """Judge an answer; what is named in the control counts only if it is right and its constant has grown."""
    named = [one for one in answer.named if one.name not in case.describes]
    before = {one.name: one for one in control.named} if control else {}
    new = [one for one in named if one.name not in before or _grown(case, one, before[one.name])]
    reported: tuple[str, ...] = ()
    if new:
        likewise = [name for name in new[0].confusable_with if name not in before or name in case.effects]
        reported = (new[0].name, *likewise)[:MOST_REPORTED]
    return Judged(
        case=case.name,
        source=case.source,
        label=case.label,
        truth=case.effects,
        outside=case.outside,
        verdict=answer.verdict,
        named=tuple(one.name for one in new),
        reported=reported,
        size_over_true=_size(case, new, before),
        heldout_over_noise=None if answer.heldout_rmse_deg is None else answer.heldout_rmse_deg / case.noise_deg,
    )


def _grown(case: SealedCase, one: NamedEffect, before: NamedEffect) -> bool:
    """Whether a right name of the control has a constant that has grown by a good part of what was hidden."""
    now, then = size_of(one.name, one.parameters, case.rig), size_of(one.name, before.parameters, case.rig)
    if one.name not in case.effects or not case.size or now is None or then is None:
        return False
    return (now - then) / case.size >= GROWN


def _size(case: SealedCase, named: Sequence[NamedEffect], before: Mapping[str, NamedEffect]) -> float | None:
    """Constant that was found over the true one; of hidden changes what the control has is taken off."""
    right = next((one for one in named if one.name in case.effects), None)
    if right is None or not case.size:
        return None
    found = size_of(right.name, right.parameters, case.rig)
    then = size_of(right.name, before[right.name].parameters, case.rig) if right.name in before else 0.0
    return None if found is None or then is None else (found - then) / case.size


def summarise(judged: Sequence[Judged]) -> BenchmarkScore:
    """Count by source and in all."""
    sources = [source for source in SOURCES if any(one.source == source for one in judged)]
    of = {source: [one for one in judged if one.source == source] for source in sources} | {ALL: [*judged]}
    return BenchmarkScore(
        schema=1,
        cases=len(judged),
        answered=sum(one.verdict != UNANSWERED for one in judged),
        rates={source: _rates(some) for source, some in of.items()},
        heldout_over_noise={source: _heldout(some) for source, some in of.items()},
        each=tuple(judged),
    )


def _rates(judged: Iterable[Judged]) -> dict[str, Rate]:
    some = [*judged]
    return {name: rate_of_hits(hit(one) for one in some if counts(one)) for name, (counts, hit) in COUNTED.items()}


def _heldout(judged: Iterable[Judged]) -> Spread:
    return spread(one.heldout_over_noise for one in judged if one.first and one.heldout_over_noise is not None)
