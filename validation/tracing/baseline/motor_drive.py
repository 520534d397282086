"""Baseline of a known rig whose drive is in turns of a motor: the gain from motor to tendon is one parameter more.

A drive in ``deg`` or ``step`` has a gain that a record does not tell; it is identified.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fem_models.chain.solve import chain_angle_deg
from fem_models.joint import joint_row
from fem_models.load.program import LoadProgram
from fem_models.rig.of_record import rig_of
from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats, Ints
from hysteresis.records.record import Record, RecordError
from validation.tracing.baseline.known_rig import KnownRigProblem, known_rig_problem
from validation.tracing.baseline.runs import Run
from validation.tracing.baseline.samples import mean_slope
from validation.tracing.effect import FreeParameter, Values
from validation.tracing.problem import require_one_unit
from validation.tracing.settings import GAIN_BRANCH_SAMPLES, GAIN_CORRECTIONS, GAIN_FACTOR, GAIN_SCALE, PRIOR_WEIGHT


@dataclass(frozen=True, eq=False)
class MotorDriveProblem(KnownRigProblem):
    """Records of a known rig with a drive in ``unit``; see :class:`validation.tracing.problem.Problem`.

    ``mm_per_unit`` is the gain that is started from; it is negative where the motor turns the other way round. The
    runs of the records are in mm at that gain.
    """

    mm_per_unit: float
    unit: str

    @property
    def prior_weight_deg(self) -> float:
        """See :class:`validation.tracing.problem.Problem`: one preload does not separate gain and tendon stretch."""
        return PRIOR_WEIGHT * self.scale.angle_deg

    @property
    def gain(self) -> str:
        """Name of the parameter."""
        return f"drive_mm_per_{self.unit}"

    def driven(self, run: Run, values: Values) -> Run:
        """Run as the wheel is driven in it, by the gain."""
        ratio = values[self.gain] / self.mm_per_unit

        def wound(program: LoadProgram) -> LoadProgram:
            return replace(program, drive_mm=program.drive_mm * ratio)

        assert isinstance(run.program, LoadProgram)
        return replace(run, program=wound(run.program), short=None if run.short is None else wound(run.short))

    def program(self, drive: Floats, time_s: Floats | None, cycle: Ints) -> LoadProgram:
        """Make a load program of a drive in the records' unit."""
        return LoadProgram(drive * self.mm_per_unit, time_s, cycle)


def motor_drive_problem(records: Sequence[Record]) -> MotorDriveProblem | None:
    """Make the problem of records of known rigs whose drive is in deg or steps; None where one is otherwise.

    Raises
    ------
    RigError
        A rig that cannot be, or that its record breaks from the start.
    RecordError
        Drives of different units, or of different sense.
    SolverError
        A rig that does not follow the records' drive at any gain.
    """
    rigs = [rig for record in records if record.drive_unit in ("deg", "step") and (rig := rig_of(record)) is not None]
    if len(rigs) < len(records):
        return None
    require_one_unit(records)
    _require_one_sense(records)
    gain = _guessed_gain(records, rigs[0])
    in_mm = known_rig_problem([replace(r, drive=r.drive * gain, drive_unit="mm") for r in records])
    assert in_mm is not None  # all rigs are known
    unit = records[0].drive_unit
    low, high = sorted((gain / GAIN_FACTOR, gain * GAIN_FACTOR))
    parameter = FreeParameter(f"drive_mm_per_{unit}", f"mm/{unit}", low, high, GAIN_SCALE * abs(gain))
    return MotorDriveProblem(
        records=tuple(
            replace(one, record=record, inputs=replace(one.inputs, drive=one.inputs.drive / gain))
            for one, record in zip(in_mm.records, records, strict=True)
        ),
        channels=in_mm.channels,
        channel_words=in_mm.channel_words,
        setup=replace(in_mm.setup, needs=in_mm.setup.needs - {"drive in mm"}),  # the gain is a parameter
        parameters=(*in_mm.parameters, parameter),
        start={**in_mm.start, parameter.name: gain},
        mm_per_unit=gain,
        unit=unit,
    )


def _require_one_sense(records: Sequence[Record]) -> None:
    """Refuse records of one motor that bend in different directions; which one is positive is not known."""
    first = mean_slope([records[0].drive], [records[0].angle_deg])
    for record in records[1:]:
        if first * mean_slope([record.drive], [record.angle_deg]) < 0:
            raise RecordError(
                f"{record.source or 'record'}: angle_deg: its slope over the drive has the other sign than in the "
                "first record: expected one sense of the motor and of the angle in all"
            )


def _guessed_gain(records: Sequence[Record], rig: Rig) -> float:
    """Guess the gain, mm per unit: that at which the declared rig has the mean slope of the records."""
    drives, angles = [record.drive for record in records], [record.angle_deg for record in records]
    slope = mean_slope(drives, angles)
    gain = math.copysign(
        math.radians(abs(slope)) * float(joint_row(rig).of("arms_mm")[:, 0].mean()), slope
    )  # of tendons that do not stretch
    half = max(float(np.ptp(drive)) for drive in drives) / 2
    path = np.concatenate([np.linspace(a, b, GAIN_BRANCH_SAMPLES) for a, b in pairwise((0.0, half, -half, half))])
    for _ in range(GAIN_CORRECTIONS):  # the stretch of the tendons takes some of the drive
        bent = chain_angle_deg(rig, LoadProgram(path * gain))[GAIN_BRANCH_SAMPLES:]
        gain *= slope / mean_slope([path[GAIN_BRANCH_SAMPLES:]], [bent])
    return gain
