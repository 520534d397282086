"""Strain of a simulated run against the limits of Nitinol, in numbers and in lines for a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_models.joint import joint_row
from fem_models.joint.strain import limits_passed, peak_strain, strain_limits, thrust_of_record_N
from fem_models.rig import Rig
from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from studies.results.run import StrainLimit

FULL_SCALE_DEG = 45.0
"""Angle to which a rig is bent if neither an amplitude nor a record says how far: the full scale of the paper."""


@dataclass(frozen=True)
class Strain:
    """Peak strain of a run, and the drives at which strain limits of Nitinol are exceeded."""

    peak_strain_percent: float
    strain_limits: tuple[StrainLimit, ...]


def strain_of_record(rig: Rig, record: Record) -> Strain | None:
    """Find the strain of a simulated record from the angles of its notches.

    None where they do not give it: measured joints, and superelastic sections, which the tendons' thrust strains too.
    """
    if record.notches_deg is None or rig.superelastic is not None:
        return None
    angles = np.radians(record.notches_deg)
    strain = peak_strain(joint_row(rig), angles, thrust_N=thrust_of_record_N(record))
    found = strain_of(rig, record.drive, strain)
    return found if np.isfinite(found.peak_strain_percent) else None


def strain_of(rig: Rig, drive: Floats, strain: Floats) -> Strain:
    """Find the peak of strains, shape (m, N), over drives, shape (m,), and where they pass the limits."""
    peak = 100 * float(np.abs(strain).max())
    if not np.isfinite(strain).all():
        return Strain(peak, ())
    limits = (
        StrainLimit(
            name=p.limit.name,
            kind=p.limit.kind,
            limit_percent=100 * p.limit.strain,
            largest_percent=100 * p.largest,
            passed_at_mm=p.drive,
            joint=p.joint,
            source=p.limit.source,
        )
        for p in limits_passed(drive, strain, strain_limits(rig))
    )
    return Strain(peak, tuple(limits))


def strain_lines(strain: Strain, unit: str = "mm") -> list[str]:
    """Give the lines of a terminal: the peak strain, and the limits that are passed, with the drive where that is."""
    return [f"peak strain {strain.peak_strain_percent:.3g} %", *limit_lines(strain.strain_limits, unit)]


def limit_lines(limits: Sequence[StrainLimit], unit: str = "mm") -> list[str]:
    """Say of each limit whether it is passed, and at which drive and joint; the lowest limit first."""
    return [f"{row.name} ({row.limit_percent:.3g} %, {row.kind}): {_where_passed(row, unit)}" for row in limits]


def _where_passed(row: StrainLimit, unit: str) -> str:
    most = f"{row.largest_percent:.3g} % at most"
    if row.passed_at_mm is None:
        return f"not passed, {most}"
    return f"passed in this run at {row.passed_at_mm:.3g} {unit}, joint {row.joint}; {most}"


def drive_to_angle_mm(rig: Rig, angle_deg: float = FULL_SCALE_DEG) -> float:
    """Give the drive that bends a rig to an angle if its tendons did not stretch, in steps of 0.1 mm."""
    return max(0.1, round(10 * rig.tendon_a.moment_arm_mm * math.radians(angle_deg)) / 10)
