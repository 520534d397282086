"""Records as the tracer uses them: the samples that are fitted, and what is derived from them, once."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from hysteresis.arrays import Floats, Ints
from hysteresis.records.path import branches, cycle_index
from hysteresis.records.record import Record
from hysteresis.sensors.readings import Readings, filled, kept_readings, readings_of
from validation.tracing.effect import SampleInputs, Values, cycles_repeat
from validation.tracing.sensors.drive_steps import drive_step_deg


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """One record, thinned to the samples that are fitted.

    Parameters
    ----------
    record
        As it was read.
    kept
        Indices of the samples that are used, shape (m,).
    inputs
        What is known of those samples besides the angle. Its drive may be converted (a motor's turns to tendon
        length and back), so that it agrees with the record's drive up to rounding only.
    readings
        Which samples of the record are readings; None: all.
    """

    record: Record
    kept: Ints
    inputs: SampleInputs
    readings: Readings | None = None

    @cached_property
    def angle_deg(self) -> Floats:
        """Measured angle of the samples that are used, shape (m,); between readings where a sample is none.

        A sudden leap is taken out.
        """
        leap = None if self.readings is None else self.readings.leap_deg
        measured = self.record.angle_deg if leap is None else self.record.angle_deg - leap
        return self.filled(measured[self.kept])

    def filled(self, values: Floats) -> Floats:
        """Values of the samples that are used, with those that are no readings from the readings about them."""
        return values if self.readings is None else filled(values, self.readings.read[self.kept])

    @cached_property
    def drive(self) -> Floats:
        """Drive of the samples that are used, as recorded, shape (m,)."""
        return self.record.drive[self.kept]

    @property
    def preload_N(self) -> float:
        """Preload of the tendons; NaN where the record does not state it."""
        return float(self.record.rig.get("preload_N", math.nan))

    @cached_property
    def branches(self) -> list[slice]:
        """Monotonic branches of the drive."""
        return branches(self.drive)

    @cached_property
    def cycles_repeat(self) -> bool:
        """Whether several cycles have the same amplitude."""
        samples = np.arange(self.kept.size, dtype=float)
        return cycles_repeat([SampleInputs(self.drive, samples, self.inputs.cycle, timed=False)])

    @cached_property
    def branch_count(self) -> int:
        """Number of branches, counted in each trial of a record that the drive is reset in."""
        return sum(len(branches(trial)) for trial in self._trials)

    @cached_property
    def only_loads(self) -> bool:
        """Whether no trial of the record has a reversal: all that it shows is a function of the drive."""
        return self.branch_count == len(self._trials)

    @cached_property
    def _trials(self) -> list[Floats]:
        """Drive of each trial; one where the drive is never reset."""
        drive, cycle = self.inputs.drive, self.inputs.cycle
        resets = np.flatnonzero((np.diff(cycle) != 0) & (np.abs(np.diff(drive)) > 0.5 * np.ptp(drive))) + 1
        return np.split(drive, resets)

    @cached_property
    def rounding_deg(self) -> float:
        """Standard deviation of the error that rounding to the record's digits makes: 1/sqrt(12) of a digit."""
        steps = np.diff(np.unique(np.round(self.record.angle_deg, 9)))
        return float(np.quantile(steps, 0.1)) / math.sqrt(12) if steps.size else 0.0

    @cached_property
    def drive_step_deg(self) -> float:
        """See :func:`validation.tracing.sensors.drive_steps.drive_step_deg`."""
        return drive_step_deg(self.record)


TIP = ("tip_along", "tip_across")
"""Channels of the tip's place: along the straight tube, and across it."""
TIP_IN_SPACE = ("tip_x", "tip_y", "tip_z")
"""The same of a rig in space."""


class Read(Protocol):
    """What sensors read, in a record or a run; None where they do not."""

    @property
    def notches_deg(self) -> Floats | None:
        """Shape (m, N)."""

    @property
    def tension_a_N(self) -> Floats | None:
        """Shape (m,)."""

    @property
    def tension_b_N(self) -> Floats | None:
        """Shape (m,)."""

    @property
    def tip_mm(self) -> Floats | None:
        """Shape (m, 2)."""


@dataclass(frozen=True, eq=False)
class Channel:
    """What was measured beside the angle, and is fitted together with it.

    Parameters
    ----------
    name
        ``notch_1``, counted from the base, ``tension_a`` to ``tension_d``, or ``tip_along``, ``tip_across``; in space
        ``tip_x``, ``tip_y``, ``tip_z``.
    unit
        ``deg``, ``N`` or ``mm``.
    weight
        Degrees of the angle that one unit counts as in the fit.
    measured
        Values of each record, shapes (m_i,); in space of each run, whose angles stand as records.
    """

    name: str
    unit: str
    weight: float
    measured: tuple[Floats, ...]

    def of(self, read: Read) -> Floats:
        """Values in what a rig gives, shape (m,)."""
        return channel_values(read)[self.name]


@dataclass(frozen=True, eq=False)
class RecordSet(ABC):
    """All records of a problem; base class of the problems in :mod:`validation.tracing.baseline`.

    ``channels`` are what a model of the rig gives beside the angle, and ``channel_words`` say which it does not give.
    """

    records: tuple[PreparedRecord, ...]
    channels: tuple[Channel, ...] = field(default=(), kw_only=True)
    channel_words: tuple[str, ...] = field(default=(), kw_only=True)

    @cached_property
    def observed(self) -> tuple[Floats, ...]:
        """Measured angles of each record, shapes (m_i,), deg."""
        return tuple(one.angle_deg for one in self.records)

    @cached_property
    def inputs(self) -> tuple[SampleInputs, ...]:
        """Drive, time and cycle of each record."""
        return tuple(one.inputs for one in self.records)

    @property
    def preloads_N(self) -> list[float]:
        """Preload of each record; empty where one record does not state it."""
        preloads = [one.preload_N for one in self.records]
        return [] if any(map(math.isnan, preloads)) else preloads

    @abstractmethod
    def predict(self, values: Values, added: Any) -> list[Floats]:
        """See :meth:`validation.tracing.problem.Problem.predict`."""

    def predict_series(self, values: Values, added: Any) -> list[Floats]:
        """Angles of all records, then each channel of all records, by one run; the angles alone without channels."""
        return self.predict(values, added)


def channel_values(record: Read) -> dict[str, Floats]:
    """Values of a record beside its angle by the names of the channels, shapes (m,)."""
    out = {}
    if record.notches_deg is not None:
        out = {f"notch_{k + 1}": column for k, column in enumerate(record.notches_deg.T)}
    tensions = {"tension_a": record.tension_a_N, "tension_b": record.tension_b_N}
    out |= {name: values for name, values in tensions.items() if values is not None}
    return out if record.tip_mm is None else out | dict(zip(TIP, record.tip_mm.T[:2], strict=True))


def channel_unit(name: str) -> str:
    """Give the unit of a channel."""
    return "deg" if name.startswith("notch") else "mm" if name in (*TIP, *TIP_IN_SPACE) else "N"


def prepared(record: Record, kept: Ints) -> PreparedRecord:
    """Thin a record to some of its samples, or to the readings of a sensor that holds its values.

    Times count from its first sample, samples where there are no times.
    """
    readings = readings_of(record)
    if readings.held > 1:
        kept = kept_readings(record, readings, kept)
    time = np.arange(record.drive.size, dtype=float) if record.time_s is None else record.time_s - record.time_s[0]
    inputs = SampleInputs(record.drive[kept], time[kept], cycle_index(record)[kept], timed=record.time_s is not None)
    every = readings.read.all() and readings.leap_deg is None
    return PreparedRecord(record, kept, inputs, None if every else readings)


def prepare(records: Sequence[Record], kept: Sequence[Ints]) -> tuple[PreparedRecord, ...]:
    """Thin all records, each to the samples named for it."""
    return tuple(prepared(record, samples) for record, samples in zip(records, kept, strict=True))
