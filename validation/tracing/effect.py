"""What an effect is: a name, its physics, and how it changes a model that lacks it.

An effect is a file in :mod:`validation.tracing.effects` with one value ``EFFECT``. It says what the effect does to a rig
(:class:`RigForm`: the geometry is known) and to a curve (:class:`CurveForm`: it is not).
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

from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats

Need = Literal["time", "cycles", "two tendons", "wheel", "force", "preloads"]
Values = Mapping[str, float]
_SAME = 0.03  # amplitudes of cycles that repeat each other


@dataclass(frozen=True)
class FreeParameter:
    """A number that is fitted.

    ``size`` is a change that matters, which makes constants comparable. A constant with ``log`` is positive and fitted
    by its logarithm; its size is a part of it. A constant that is ``linear`` is nothing at 0 and acts in proportion to
    its size, nearly.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: float
    log: bool = False
    linear: bool = False

    def to_unit(self, value: float) -> float:
        """Coordinate of the fit."""
        return math.log(value) / self.scale if self.log else value / self.scale

    def from_unit(self, x: float) -> float:
        """Value of a coordinate."""
        return math.exp(x * self.scale) if self.log else x * self.scale


@dataclass(frozen=True)
class SampleInputs:
    """What is known of every sample of a record besides its angle, shapes (m,).

    ``time_s`` counts from the record's first sample; without times it counts samples. ``cycle`` is 0 on the approach.
    """

    drive: Floats
    time_s: Floats
    cycle: NDArray[np.int64]
    timed: bool


def cycles_repeat(inputs: Sequence[SampleInputs]) -> bool:
    """Tell whether a record has cycles of one amplitude: where all shrink, what goes with the cycle goes with that."""
    for record_inputs in inputs:
        numbers = np.unique(record_inputs.cycle[record_inputs.cycle >= 1])
        ranges = np.sort([float(np.ptp(record_inputs.drive[record_inputs.cycle == number])) for number in numbers])
        if (ranges[1:] * (1 - _SAME) <= ranges[:-1]).any():
            return True
    return False


@dataclass(frozen=True)
class Scale:
    """Orders of magnitude of the records and of the declared model, which starting values are taken from."""

    drive: float  # half the largest range, in the drive's unit
    angle_deg: float  # half the largest range
    joint_deg: float  # largest angle of a joint
    tip_mm: float  # largest way of the tip across
    stress_MPa: float  # largest, at the root of a notch; of measured joints that of an assumed strip
    duration_s: float  # shortest record
    longest_s: float  # longest record
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
    observe
        The angle that is observed, from the angle there is; shape (m,) -> (m,).
    needs
        What the records or the rig must have.
    refines
        Not looked for: what is named is fitted in it at the end, and left so on very strong evidence.
    """

    parameters: tuple[FreeParameter, ...]
    starts: Callable[[Scale, Rig], Sequence[Values]]
    rig: Callable[[Rig, Values], Rig] | None = None
    observe: Callable[[Floats, SampleInputs, Values], Floats] | None = None
    needs: frozenset[Need] = frozenset()
    refines: bool = False


@dataclass(frozen=True)
class RelativeParameter:
    """A constant of a curve's operator, in units of the records: what fits a drive of mm fits one of motor steps.

    ``unit`` is a product of ``drive`` and ``angle`` (half the largest range), ``time`` (duration of the shortest
    record) and ``-``; bounds, and the size of one without ``log``, count in it. A constant in ``drive`` gets the unit's
    name at its end.
    """

    name: str
    unit: Literal["drive", "angle", "time", "-", "1/angle", "angle/time"]
    low: float
    high: float
    scale: float
    log: bool = False


@dataclass(frozen=True)
class CurveContext:
    """One record as operators see it.

    ``drive`` is measured from the middle of the stroke, or from zero where the stroke goes both ways about it.
    """

    inputs: SampleInputs
    drive_middle: float  # the drive's value at the middle
    drive_half_range: float  # half the stroke of all records, the drive's unit
    angle_half_range_deg: float  # half the largest range of the angle, deg
    straight_deg: float  # f where the drive is zero; 0, as in the middle, where it never is
    initial_state: float  # where in its loop the record starts, -1..1; 0 is rest
    preload_ratio: float  # over the largest one; 1 where it is not known
    loop_ratio: float  # size of the declared loop over that at the largest preload
    toe_ratio: float  # T_toe of the ropes over the largest preload, as the loops at several preloads tell; else 0
    slope_loss_per_loop: float  # what that costs the slope of f, per growth of the loop

    def softness(self, tension: Floats) -> Floats:
        """Compliance of the ropes at tensions over the largest preload, over that at the record's preload."""
        return (1.0 + self.toe_ratio / tension) / (1.0 + self.toe_ratio / self.preload_ratio)


CurveOperator = Callable[[Floats, CurveContext, Values], Floats]


@dataclass(frozen=True)
class CurveForm:
    """One way in which an effect acts where the geometry is unknown: operators on theta = f(x) + h, shape (m,) each.

    Parameters
    ----------
    constants, starts
        What is fitted, and from where; relative to the scale of the records.
    drive
        x in place of x, in the drive's unit from the middle of the stroke.
    backbone
        f in place of f, deg; h follows it.
    loop_size
        From f, the factor on the size of h.
    angle
        theta in place of theta, deg from the middle of the stroke.
    observe
        As in :class:`RigForm`.
    needs
        What the records must have.
    """

    parameters: tuple[RelativeParameter, ...]
    starts: tuple[Values, ...]
    drive: CurveOperator | None = None
    backbone: CurveOperator | None = None
    loop_size: CurveOperator | None = None
    angle: CurveOperator | None = None
    observe: Callable[[Floats, SampleInputs, Values], Floats] | None = None
    needs: frozenset[Need] = frozenset()


@dataclass(frozen=True)
class Effect:
    """An effect of the catalogue.

    ``physics`` is one paragraph with its source; ``tell_apart`` says what it is taken for, and what record tells.
    """

    name: str
    physics: str
    distinguished_by: str
    rig_forms: tuple[RigForm, ...]
    curve_forms: tuple[CurveForm, ...] = ()


@cache
def catalogue() -> tuple[Effect, ...]:
    """All effects, one a file of :mod:`validation.tracing.effects`, by name."""
    package = importlib.import_module("validation.tracing.effects")
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    return tuple(importlib.import_module(f"validation.tracing.effects.{name}").EFFECT for name in names)
