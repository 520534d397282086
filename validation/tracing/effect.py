"""What an effect is: a name, its physics, and how it changes a model that lacks it.

An effect is a file in :mod:`validation.tracing.effects` with one value ``EFFECT``. It acts on a rig where the geometry
is known (:class:`RigForm`), and on a curve where it is not (:class:`CurveForm`).
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import Closure
from hysteresis.arrays import Floats, Ints
from validation.tracing.settings import SAME_CYCLES

if TYPE_CHECKING:
    from fem_models.spatial.rig import SpatialRig

Need = Literal[
    "time",
    "cycles",
    "two tendons",
    "one tendon",
    "wheel",
    "force",
    "preloads",
    "one preload",
    "drive in mm",
    "declared plateau",
    "reference",
    "torsion",
]
Values = Mapping[str, float]


Quantity = Literal[
    "1",
    "half stroke",
    "1/half stroke",
    "half range",
    "half range per joint",
    "1/half range",
    "half range/duration",
    "quarter cycle",
    "wheel radius",
]
"""What a range of sense is counted in: half the largest stroke of the drive and range of the angle, the duration of
the shortest record, a quarter of its cycle, the radius of the wheel."""


@dataclass(frozen=True)
class Sensible:
    """Range in which a parameter makes sense, as distinct from the bounds of its fit.

    Parameters
    ----------
    low, high
        In the parameter's unit, or in the quantity ``per``.
    because
        Source or reason.
    name, about
        What words call the parameter, by default its name, and the number that its value counts from: a gain of 0.22 is
        a "camera gain" of 1.22 about 1.
    """

    low: float
    high: float
    because: str
    per: Quantity = "1"
    name: str = ""
    about: float = 0.0


@dataclass(frozen=True)
class FreeParameter:
    """A number that is fitted, within bounds.

    ``scale`` is a change that matters; it makes parameters comparable. A parameter with ``log`` is positive and is
    fitted by its logarithm; its scale is a relative change. A parameter that is ``linear`` has no action at 0 and acts
    nearly in proportion to its value. An ``amount`` has no action at 0, either, but counts as an amount alone: the
    search does not enlarge it. ``sensible`` is where it makes sense; None where there is no such limit.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: float
    log: bool = False
    linear: bool = False
    amount: bool = False
    sensible: Sensible | None = None

    @property
    def acts_from_zero(self) -> bool:
        """Whether the parameter is an amount of the effect: 0 is no action."""
        return self.amount or (self.linear and not self.log)

    def to_unit(self, value: float) -> float:
        """Coordinate of the fit, from a value."""
        return math.log(value) / self.scale if self.log else value / self.scale

    def from_unit(self, x: float) -> float:
        """Value, from a coordinate of the fit."""
        return math.exp(x * self.scale) if self.log else x * self.scale


@dataclass(frozen=True)
class SampleInputs:
    """What is known of every sample of a record besides its angle, shapes (m,).

    ``time_s`` counts from the record's first sample; in a record without times it counts samples. ``cycle`` is 0 on the
    approach.
    """

    drive: Floats
    time_s: Floats
    cycle: Ints
    timed: bool


def cycles_repeat(inputs: Sequence[SampleInputs]) -> bool:
    """Tell whether a record has cycles of one amplitude.

    Where all cycles shrink or grow, the records do not separate the cycle from the amplitude.
    """
    for one in inputs:
        numbers = np.unique(one.cycle[one.cycle >= 1])
        ranges = np.sort([float(np.ptp(one.drive[one.cycle == number])) for number in numbers])
        if (ranges[1:] * (1 - SAME_CYCLES) <= ranges[:-1]).any():
            return True
    return False


@dataclass(frozen=True)
class Scale:
    """Orders of magnitude of the records and of the baseline, from which starting values are derived."""

    drive: float  # half the largest range, in the drive's unit
    angle_deg: float  # half the largest range
    joint_deg: float  # largest angle of a joint
    tip_mm: float  # largest displacement of the tip across the tube
    stress_MPa: float  # largest, at the root of a notch; for measured joints that of an assumed strip
    duration_s: float  # shortest record
    longest_s: float  # longest record
    speed: float  # largest of the drive, its unit per s
    cycles: float  # largest number


@dataclass(frozen=True)
class RigForm:
    """One way in which an effect acts in the mechanical model.

    Parameters
    ----------
    parameters
        What is fitted.
    starts
        Starting values, one mapping a start, from the orders of magnitude and the declared rig.
    rig
        A rig with the effect, from one without it. **An effect is what the declared rig lacks.** So what it brings
        comes on top of what the rig declares, and no declared value is lost:

        - Amounts add: widths, lengths, forces, dampers, toes; weights and run-outs of a wheel as vectors. Ratios
          multiply. Parts that are lost compound (:func:`compound`).
        - The model has one exponential for two: its rate is the mean of both (:func:`combined_time`). It has one
          contact for two on one side: as stiff as both together, at the mean place weighted by stiffness.
        - What cannot add raises RigError, and the effect is no candidate for that rig: a second superelastic plateau,
          an obstacle on the other side, a run-out with another period.

        On a rig that does not declare the effect, the effect alone remains. A parameter that the baseline fits is not
        declared; see :meth:`validation.tracing.baseline.equivalent_rig.EquivalentRigProblem.rig`.
    observe
        The angle that is read, from the angle of the rig; shape (m,) -> (m,).
    needs
        What the records or the rig must have.
    refines
        The search leaves this form out. An effect that was named is fitted in it at the end, and kept so on very strong
        evidence.
    """

    parameters: tuple[FreeParameter, ...]
    starts: Callable[[Scale, Rig], Sequence[Values]]
    rig: Callable[[Rig, Values], Rig] | None = None
    observe: Callable[[Floats, SampleInputs, Values], Floats] | None = None
    needs: frozenset[Need] = frozenset()
    refines: bool = False


OPEN_NOTCHES = Closure(stiffness_Nmm_per_rad=1.0, angle_deg=1e3)
"""Closure in place of none: notches bend on through each other, and the data say whether they close."""


def compound(declared: float, added: float) -> float:
    """Part that is lost in all, where an effect takes its part of what the declared loss leaves."""
    return 1.0 - (1.0 - declared) * (1.0 - added)


def combined_time(declared: Sequence[float], time: float, added: Sequence[float], added_time: float) -> float:
    """Time constant, or number of cycles, of one exponential in place of two.

    The rates 1/time are averaged, weighted by the amounts that change with them. Then the sum of two amounts of one
    sign has the right limit and the right rate at the start.

    Parameters
    ----------
    declared, added
        Amounts of each kind that change with the declared and with the added time.
    """
    parts = [abs(b) / (abs(a) + abs(b)) for a, b in zip(declared, added, strict=True) if a or b]
    part = sum(parts) / len(parts) if parts else 0.0
    return 1.0 / ((1.0 - part) / time + part / added_time)


@dataclass(frozen=True)
class RelativeParameter:
    """A parameter of an operator on a curve, in units of the records: what fits a drive in mm fits one in motor steps.

    ``unit`` is a product of ``drive`` and ``angle`` (half the largest range), ``time`` (duration of the shortest
    record) and ``-``. The bounds count in it, and so does the scale of one without ``log``. A parameter in ``drive``
    gets the unit's name at its end. ``amount`` and ``sensible`` are as of :class:`FreeParameter`.
    """

    name: str
    unit: Literal["drive", "angle", "time", "-", "1/angle", "angle/time", "drive/time"]
    low: float
    high: float
    scale: float
    log: bool = False
    amount: bool = False
    sensible: Sensible | None = None


@dataclass(frozen=True)
class CurveContext:
    """What operators know of one record.

    ``drive`` of an operator is measured from the middle of the stroke, or from zero where the stroke goes both ways
    about it.
    """

    inputs: SampleInputs
    drive_middle: float  # the drive's value at the middle
    drive_half_range: float  # half the stroke of all records, the drive's unit
    angle_half_range_deg: float  # half the largest range of the angle
    straight_deg: float  # f where the drive is zero; 0, as in the middle, where it never is
    initial_state: float  # where in its loop the record starts, -1..1; 0 is rest
    preload_ratio: float  # over the largest one; 1 where it is not known
    loop_ratio: float  # size of the baseline's loop over that at the largest preload
    toe_ratio: float  # T_toe of the tendons over the largest preload, from the loops at several preloads; else 0
    slope_loss_per_loop: float  # part of the slope of f that the toe costs, per growth of the loop

    @property
    def of_baseline(self) -> tuple[float, ...]:
        """What depends on the parameters of the baseline; the rest is of the records."""
        return self.straight_deg, self.initial_state, self.loop_ratio, self.toe_ratio, self.slope_loss_per_loop

    def softness(self, tension: Floats) -> Floats:
        """Compliance of the tendons at tensions over the largest preload, relative to that at the record's preload."""
        return (1.0 + self.toe_ratio / tension) / (1.0 + self.toe_ratio / self.preload_ratio)


CurveOperator = Callable[[Floats, CurveContext, Values], Floats]


@dataclass(frozen=True)
class CurveForm:
    """One way in which an effect acts where the geometry is unknown: operators on theta = f(x) + h, shape (m,) each.

    Parameters
    ----------
    parameters, starts
        What is fitted, and from where; relative to the scale of the records.
    drive
        The drive x that acts, from x, in the drive's unit from the middle of the stroke.
    backbone
        The f that acts, from f, deg; h follows it.
    loop_size
        The factor on the size of h, from f.
    angle
        The angle that results, from f + h, deg from the middle of the stroke.
    observe
        As in :class:`RigForm`.
    needs
        What the records must have.
    still_over
        Name of a parameter, a width of the drive over which nothing moves after a reversal
        (:mod:`validation.tracing.search.still_zone`).
    """

    parameters: tuple[RelativeParameter, ...]
    starts: tuple[Values, ...]
    drive: CurveOperator | None = None
    backbone: CurveOperator | None = None
    loop_size: CurveOperator | None = None
    angle: CurveOperator | None = None
    observe: Callable[[Floats, SampleInputs, Values], Floats] | None = None
    needs: frozenset[Need] = frozenset()
    still_over: str = ""


@dataclass(frozen=True)
class SpaceForm:
    """One way in which an effect acts on a known rig that bends in space.

    Parameters
    ----------
    parameters, needs
        As of :class:`RigForm`.
    starts
        Starting values, one mapping a start, from the orders of magnitude.
    chain
        The chain in space with the effect, from the one without it.
    wheels
        What the wheels wind in, from what is logged; shape (m, wheels), mm.
    sensor
        Components across the tube as a sensor reads them, from those towards y and z: of the bending angles, and of
        the place of the tip; shape (m, 2) -> (m, 2). It acts before ``observe``.
    observe
        The angle that is read, from that of the rig; shape (m,) -> (m,).
    angles
        The angles that ``observe`` acts on: ``angle``, ``angle_2``, ``torsion``.
    """

    parameters: tuple[FreeParameter, ...]
    starts: Callable[[Scale], Sequence[Values]]
    chain: Callable[[SpatialRig, Values], SpatialRig] | None = None
    wheels: Callable[[Floats, Values], Floats] | None = None
    sensor: Callable[[Floats, Values], Floats] | None = None
    observe: Callable[[Floats, SampleInputs, Values], Floats] | None = None
    angles: tuple[str, ...] = ("angle", "angle_2", "torsion")
    needs: frozenset[Need] = frozenset()
    refines: bool = False


def read_in_planes(
    parameters: tuple[FreeParameter, ...],
    starts: Callable[[Scale], Sequence[Values]],
    observe: Callable[[Floats, SampleInputs, Values], Floats],
    needs: frozenset[Need] = frozenset(),
) -> tuple[SpaceForm, SpaceForm]:
    """Make two forms of an effect on the reading: on the first bending angle, and on the second one.

    Parameters of the second one end in ``_2``.
    """

    def starts_of_second(scale: Scale) -> list[Values]:
        return [{f"{name}_2": value for name, value in one.items()} for one in starts(scale)]

    def observe_second(angle_deg: Floats, inputs: SampleInputs, values: Values) -> Floats:
        own = {name.removesuffix("_2"): value for name, value in values.items()}
        return observe(angle_deg, inputs, own)

    second = tuple(replace(one, name=f"{one.name}_2") for one in parameters)
    return (
        SpaceForm(parameters, starts, observe=observe, angles=("angle",), needs=needs),
        SpaceForm(second, starts_of_second, observe=observe_second, angles=("angle_2",), needs=needs),
    )


@dataclass(frozen=True)
class Effect:
    """An effect of the catalogue.

    ``seen`` is what a record shows, in a few words. ``physics`` is one paragraph with its source. ``distinguished_by``
    begins with the record that separates the effect from those that look like it, which the next sentences name.
    ``space_forms`` act on a known rig in space, the others on all other rigs.
    """

    name: str
    seen: str
    physics: str
    distinguished_by: str
    rig_forms: tuple[RigForm, ...] = ()
    curve_forms: tuple[CurveForm, ...] = ()
    space_forms: tuple[SpaceForm, ...] = ()


def acting(effects: Sequence[Effect], *, in_space: bool) -> tuple[Effect, ...]:
    """Effects that have a form for a known rig in space, or for all other rigs."""
    return tuple(one for one in effects if (one.space_forms if in_space else one.rig_forms or one.curve_forms))


@cache
def catalogue() -> tuple[Effect, ...]:
    """All effects by name, one a file of :mod:`validation.tracing.effects`."""
    package = importlib.import_module("validation.tracing.effects")
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    return tuple(importlib.import_module(f"validation.tracing.effects.{name}").EFFECT for name in names)
