"""What an effect is: a name, its physics, and how it changes a model that lacks it.

An effect is a file in :mod:`validation.effects` with one value ``EFFECT``. It says what the effect does to a rig
(:class:`RigForm`: the geometry is known) and to a curve (:class:`validation.curves.CurveForm`: it is not).
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fem_models.rig import Rig

Floats = NDArray[np.float64]
Need = Literal["time", "cycles", "two tendons", "wheel", "force"]
Values = Mapping[str, float]


@dataclass(frozen=True)
class Constant:
    """A number that is fitted.

    ``size`` is a change that matters, which makes constants comparable. A constant with ``log`` is positive and fitted
    by its logarithm; its size is a part of it.
    """

    name: str
    unit: str
    low: float
    high: float
    size: float
    log: bool = False

    def inner(self, value: float) -> float:
        """Coordinate of the fit."""
        return math.log(value) / self.size if self.log else value / self.size

    def outer(self, x: float) -> float:
        """Value of a coordinate."""
        return math.exp(x * self.size) if self.log else x * self.size


@dataclass(frozen=True)
class Sight:
    """What is known of every sample of a record besides its angle, shapes (m,).

    ``time_s`` counts from the record's first sample; without times it counts samples. ``cycle`` is 0 on the approach.
    """

    drive: Floats
    time_s: Floats
    cycle: NDArray[np.int64]
    timed: bool


@dataclass(frozen=True)
class Scale:
    """Orders of magnitude of the records and of the declared model, which starting values are taken from."""

    drive: float  # half the largest range, in the drive's unit
    angle_deg: float  # half the largest range
    joint_deg: float  # largest angle of a joint
    tip_mm: float  # largest way of the tip across
    stress_MPa: float  # largest, at the root of a notch; of measured joints that of an assumed strip
    duration_s: float  # shortest record
    speed: float  # largest of the drive, its unit per s
    cycles: float  # largest number


@dataclass(frozen=True)
class RigForm:
    """One way in which an effect acts in the mechanical model.

    Parameters
    ----------
    constants
        What is fitted.
    starts
        Starting values, one mapping a start, from the scale of the problem.
    rig
        A rig with the effect.
    seen
        The angle that is observed, from the angle there is; shape (m,) -> (m,).
    needs
        What the records or the rig must have.
    """

    constants: tuple[Constant, ...]
    starts: Callable[[Scale, Rig], Sequence[Values]]
    rig: Callable[[Rig, Values], Rig] | None = None
    seen: Callable[[Floats, Sight, Values], Floats] | None = None
    needs: frozenset[Need] = frozenset()


@dataclass(frozen=True)
class Effect:
    """An effect of the catalogue.

    ``physics`` is one paragraph with its source; ``tell_apart`` says what it is taken for, and what record tells.
    """

    name: str
    physics: str
    tell_apart: str
    rig_forms: tuple[RigForm, ...]


@cache
def catalogue() -> tuple[Effect, ...]:
    """All effects, one a file of :mod:`validation.effects`, by name."""
    package = importlib.import_module("validation.effects")
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    return tuple(importlib.import_module(f"validation.effects.{name}").EFFECT for name in names)
