"""Records of a known rig whose drive is in turns of a motor: what a unit of it winds in is one constant more.

The contract of a record: a drive in ``deg`` or ``step`` has a gain that is not known, and is identified.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_models.chain.solve import chain_angle_deg
from fem_models.joint import joint_mechanics
from fem_models.load.program import LoadProgram
from fem_models.rig.of_record import rig_of
from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats
from hysteresis.record import Record, RecordError
from validation.tracing.baseline.curve import mean_slope
from validation.tracing.baseline.known_rig import RigProblem, Run, known_rig_problem
from validation.tracing.effect import FreeParameter, Values
from validation.tracing.problem import require_one_unit

_TIMES = 3.0  # bounds of the gain, either way
_SIZE = 0.01
_HOLD = 5e-4  # of half the largest range of the angle, as of an equivalent rig
_SAMPLES, _TURNS = 20, 4


@dataclass(frozen=True, eq=False)
class MotorDriveProblem(RigProblem):
    """A :class:`RigProblem` of a drive in ``unit``, of which ``mm`` is rope wound in at the gain that is started from.

    Negative gains are of a motor that turns the other way round.
    """

    mm: float
    unit: str

    @property
    def prior_weight_deg(self) -> float:
        """See :class:`validation.tracing.problem.Problem`: one preload does not tell the gain from the ropes' stretch."""
        return _HOLD * self.scale.angle_deg

    @property
    def gain(self) -> str:
        """Name of the constant."""
        return f"drive_mm_per_{self.unit}"

    def driven(self, run: Run, values: Values) -> Run:
        """Run as the wheel sees it, by the gain."""
        ratio = values[self.gain] / self.mm

        def wound(program: LoadProgram) -> LoadProgram:
            return replace(program, drive_mm=program.drive_mm * ratio)

        assert isinstance(run.program, LoadProgram)
        return replace(run, program=wound(run.program), short=None if run.short is None else wound(run.short))

    def program(self, drive: Floats, time_s: Floats | None, cycle: NDArray[np.int64]) -> LoadProgram:
        """Make a load program of a drive in the records' unit."""
        return LoadProgram(drive * self.mm, time_s, cycle)


def motor_drive_problem(records: Sequence[Record]) -> MotorDriveProblem | None:
    """Make the problem of records of known rigs whose drive is in deg or steps; None where it is not so.

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
    mm = _mm_per_unit(records, rigs[0])
    in_mm = known_rig_problem([replace(r, drive=r.drive * mm, drive_unit="mm") for r in records])
    assert in_mm is not None  # all rigs are known
    unit = records[0].drive_unit
    low, high = sorted((mm / _TIMES, mm * _TIMES))
    gain = FreeParameter(f"drive_mm_per_{unit}", f"mm/{unit}", low, high, _SIZE * abs(mm))
    shared = {field.name: getattr(in_mm, field.name) for field in fields(in_mm)}
    own = {
        "records": tuple(
            replace(one, record=record, inputs=replace(one.inputs, drive=one.inputs.drive / mm))
            for one, record in zip(in_mm.records, records, strict=True)
        ),
        "parameters": (*in_mm.parameters, gain),
        "start": {**in_mm.start, gain.name: mm},
    }
    return MotorDriveProblem(**{**shared, **own}, mm=mm, unit=unit)


def _require_one_sense(records: Sequence[Record]) -> None:
    """Refuse records of one motor that bend different ways; which way a motor turns is not known."""
    first = mean_slope([records[0].drive], [records[0].angle_deg])
    for record in records[1:]:
        if first * mean_slope([record.drive], [record.angle_deg]) < 0:
            raise RecordError(
                f"{record.source or 'record'}: angle_deg: its slope over the drive has the other sign than in the "
                "first record: expected one sense of the motor and of the angle in all"
            )


def _mm_per_unit(records: Sequence[Record], rig: Rig) -> float:
    """Guess the gain: that at which the rig, as it is declared, bends by as much as the widest record does."""
    drives, angles = [record.drive for record in records], [record.angle_deg for record in records]
    slope = mean_slope(drives, angles)
    arm = joint_mechanics(rig).arms_mm.a
    mm = math.copysign(math.radians(abs(slope)) * arm, slope)  # all rope that is wound in bends
    half = max(float(np.ptp(drive)) for drive in drives) / 2
    way = np.concatenate([np.linspace(a, b, _SAMPLES) for a, b in pairwise((0.0, half, -half, half))])
    for _ in range(_TURNS):  # stretch of the ropes takes some of it
        bent = chain_angle_deg(rig, LoadProgram(way * mm))[_SAMPLES:]
        mm *= slope / mean_slope([way[_SAMPLES:]], [bent])
    return mm
