"""What ``notchbend follow`` found, as it is stored in ``follow.json``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from hysteresis.display import on_screen
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.plain import optional
from studies.results.made import Made

WHAT = "the result of `notchbend follow`"

Verdict = Literal["steady", "changed"]


@dataclass(frozen=True)
class Axis:
    """What the records stand over: its name, and a place for each of them."""

    name: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class FollowedNumber:
    """A number over the records, with the 95 % interval of each and its control chart; ``average`` is None at first.

    ``alarm`` is the first record outside the limits, from 1, None without one.
    """

    name: str
    unit: str
    words: str
    values: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    average: tuple[float | None, ...]
    chart_mean: float
    chart_low: float
    chart_high: float
    alarm: int | None


@dataclass(frozen=True)
class ChartFacts:
    """How the control charts were made.

    ``limit_deviations`` is the distance of the limits from the mean, in standard deviations of the reference, and
    ``run_length`` the median number of records of a steady device to an alarm of one of the charts; None if longer than
    can be simulated.
    """

    kind: str
    weight: float
    reference: int
    limit_deviations: float
    false_alarm: float
    run_length: float | None
    source: str


@dataclass(frozen=True)
class Change:
    """A change: its first record, from 1, with the ends of the 95 % set, all also as places on the axis.

    ``parameters`` are the changes of the numbers that differ: by a step, or to the last record by a ramp.
    """

    first: int
    first_low: int
    first_high: int
    at: float
    at_low: float
    at_high: float
    shape: Literal["step", "ramp"]
    p: float
    parameters: Mapping[str, Parameter]


@dataclass(frozen=True)
class NamedCause:
    """What explains the change; ``how`` it was found, ``alike`` what is not distinguished. No effects: not named."""

    effects: tuple[str, ...]
    alike: tuple[str, ...]
    how: Literal["trace", "parameters", "not traced"]
    verdict: str
    words: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)


@dataclass(frozen=True)
class LimitPassed:
    """When a number passes a limit, on the axis, with its 95 % interval; None beyond ``horizon``."""

    name: str
    limit: float
    at: float | None
    low: float | None
    high: float | None
    passed: bool
    horizon: float
    words: str


@dataclass(frozen=True, repr=False)
class FollowReport:
    """One device over its records."""

    schema: int
    records: tuple[str, ...]
    axis: Axis
    verdict: Verdict
    words: tuple[str, ...]
    law: str
    heldout_rmse_deg: float
    parameters: tuple[FollowedNumber, ...]
    chart: ChartFacts
    changes: tuple[Change, ...]
    cause: NamedCause | None
    limits: tuple[LimitPassed, ...]
    seed: int
    made: Made | None = optional()

    def __repr__(self) -> str:
        return f"FollowReport({len(self.records)} records: {self.verdict}; {self.words[0]})"

    def __str__(self) -> str:
        return on_screen(list(self.words))
