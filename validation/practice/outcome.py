"""Outcome of a practice case: what was injected, and what the tracer answered."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

MOST_REPORTED = 3
"""Names of the reported set that count."""
CLAIMS = ("effect", "partial", "ambiguous")
"""Verdicts that name an effect."""


@dataclass(frozen=True)
class Answer:
    """Answer of the tracer; ``message`` has the error that it stopped with.

    Errors are those of held-out data, deg, None if there is none. ``confusable`` has the effects that are reported as
    indistinguishable from the first named one.
    """

    verdict: str
    message: str = ""
    named: tuple[str, ...] = ()
    confusable: tuple[str, ...] = ()
    noise_floor_deg: float | None = None
    before_deg: float | None = None
    after_deg: float | None = None


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A case with the tracer's answer, in the order of the stored file.

    The fields are those of :class:`validation.practice.draw.Truth` and of :class:`Answer`; ``truth`` has the injected
    effects, ``describes`` the effects that count neither way because they describe what a sensor does, or what
    every rig of a make has undeclared.
    """

    label: str
    name: str = ""
    truth: tuple[str, ...]
    numbers: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    ratios: tuple[float, ...] = ()
    beyond_curve: tuple[float, ...] = ()
    engine: str = ""
    rig: str = ""
    noise_deg: float
    verdict: str
    message: str = ""
    named: tuple[str, ...]
    confusable: tuple[str, ...]
    noise_floor_deg: float | None = None
    before_deg: float | None
    after_deg: float | None
    seconds: float
    describes: tuple[str, ...] = ()

    @property
    def names_falsely(self) -> bool:
        """Whether an effect is named that was not injected and does not describe the sensor."""
        return self.verdict in CLAIMS and bool({*self.named} - {*self.truth, *self.describes})

    @property
    def column(self) -> str:
        """First effect that was claimed, or the verdict if none was."""
        return self.named[0] if self.verdict in CLAIMS and self.named else self.verdict

    @property
    def counted(self) -> tuple[str, ...]:
        """Claimed effects without those that count neither way."""
        return tuple(name for name in self.named if name not in self.describes) if self.verdict in CLAIMS else ()

    @property
    def reported(self) -> tuple[str, ...]:
        """The first claimed effect that counts and those it may be confused with, at most three in all."""
        confusable = (name for name in self.confusable if name not in self.describes)
        return (*self.counted[:1], *confusable)[:MOST_REPORTED] if self.verdict in CLAIMS else ()

    @property
    def first_right(self) -> bool:
        """Whether an injected effect was named first, of those that count."""
        return self.counted[:1] != () and self.counted[0] in self.truth

    @property
    def within_set(self) -> bool:
        """Whether an injected effect is in the reported set."""
        return any(effect in self.reported for effect in self.truth)

    @property
    def both_named(self) -> bool:
        """Whether all injected effects were named."""
        return self.verdict in CLAIMS and set(self.truth) <= set(self.named)
