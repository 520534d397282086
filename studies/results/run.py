"""``run.json``: the summary of the main job, and whether its records are still the ones that it was made from."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hysteresis.files import inside, present, read_bytes
from hysteresis.plain import optional
from hysteresis.records.metrics import dissipated_area, loop_width
from hysteresis.records.record import Record, RecordError
from studies.results.ensemble import EnsembleRanges
from studies.results.files import read_result
from studies.results.made import Made

WHAT = "the summary of `notchbend run`"
OF_RUNS = ("run.json", "wrist.json")
"""Summaries of runs, of a planar rig and of one in space, which say which records they were made from."""


@dataclass(frozen=True)
class FullScale:
    """Title of a record and its largest bending angle, in either direction."""

    title: str
    full_scale_deg: float


@dataclass(frozen=True)
class LoopSummary(FullScale):
    """A record that closes a loop: largest width and where it is, width at zero drive, area."""

    loop_width_deg: float
    widest_at_drive_mm: float
    loop_width_at_zero_deg: float | None
    loop_area_deg_mm: float


@dataclass(frozen=True)
class ForceLoopSummary(FullScale):
    """A record under a tendon force that closes a loop."""

    loop_width_deg: float
    widest_at_force_N: float
    loop_area_deg_N: float


def loop_summary(record: Record) -> FullScale:
    """Measure a record; a :class:`LoopSummary`, or a :class:`ForceLoopSummary`, if the record closes a loop."""
    full = float(np.abs(record.angle_deg).max())
    try:
        width = loop_width(record.drive, record.angle_deg, record.cycle)
        area = dissipated_area(record.drive, record.angle_deg, record.cycle)
    except ValueError:  # a program from a file need not close a loop
        return FullScale(record.title, full)
    if record.drive_unit == "N":
        return ForceLoopSummary(record.title, full, width.max_deg, width.at_drive, area)
    return LoopSummary(record.title, full, width.max_deg, width.at_drive, width.at_zero_deg, area)


@dataclass(frozen=True)
class SpaceSummary:
    """Largest values of a run in space; the bending is the angle between base and tip in any direction."""

    title: str
    samples: int
    largest_bending_deg: float
    largest_angle_deg: float
    largest_angle_2_deg: float
    largest_torsion_deg: float
    largest_tension_N: float
    slack_samples: int
    largest_notch_deg: float


def space_summary(record: Record) -> SpaceSummary:
    """Summarise a run in space."""
    assert record.angle_2_deg is not None
    assert record.torsion_deg is not None
    assert record.notches_deg is not None
    named = (record.tension_a_N, record.tension_b_N, record.tension_c_N, record.tension_d_N)
    tensions = np.array([one for one in named if one is not None])
    return SpaceSummary(
        title=record.title,
        samples=record.drive.size,
        largest_bending_deg=float(np.hypot(record.angle_deg, record.angle_2_deg).max()),
        largest_angle_deg=float(np.abs(record.angle_deg).max()),
        largest_angle_2_deg=float(np.abs(record.angle_2_deg).max()),
        largest_torsion_deg=float(np.abs(record.torsion_deg).max()),
        largest_tension_N=float(tensions.max()),
        slack_samples=int((tensions <= 0).any(axis=0).sum()),
        largest_notch_deg=float(np.abs(record.notches_deg).max()),
    )


@dataclass(frozen=True)
class StrainLimit:
    """A strain limit of Nitinol in a run; ``passed_at_mm`` is the drive at which it is exceeded, None if it is not."""

    name: str
    kind: str
    limit_percent: float
    largest_percent: float
    passed_at_mm: float | None
    joint: int | None
    source: str


@dataclass(frozen=True)
class RunLoop:
    """The loop of one preload: the files of the record and of the analytic curve, loop, energy balance and strain.

    Energies are those of the last cycle, mJ; ``energy_gap_percent`` is the error of the energy balance. A tendon is
    slack from the drive ``slack_from_mm`` on, None where none is. Cycles beyond ``fatigue_amplitude_mm`` (from -x to x,
    of one tendon from 0 to x) pass the limit of alternating strain; None where this loop does not. That amplitude is
    smaller than the drive at which the run, coming from rest, first passes the limit (``strain_limits``).
    """

    record: str
    theory: str
    title: str
    full_scale_deg: float
    loop_width_deg: float
    widest_at_drive_mm: float
    loop_width_at_zero_deg: float | None
    loop_area_deg_mm: float
    wheel_work_mJ: float
    friction_loss_mJ: float
    material_loss_mJ: float
    viscous_loss_mJ: float
    energy_gap_percent: float
    peak_strain_percent: float
    strain_limits: tuple[StrainLimit, ...]
    preload_N: float | None = optional()
    slack_from_mm: float | None = optional()
    fatigue_amplitude_mm: float | None = optional()

    @property
    def both_ways(self) -> bool:
        """Whether cycles go from -x to x; those of one tendon, which has no preload, from 0 to x."""
        return bool(self.preload_N)


@dataclass(frozen=True)
class RigNumber:
    """A number of the rig and its source: stated in the paper, taken from another source, fitted, or assumed."""

    name: str
    value: float
    source: str
    note: str


@dataclass(frozen=True)
class CrossCheckRow:
    """Differences between the models at one preload; fields as in :class:`validation.engines.agreement.CrossCheck`."""

    rig: str
    preload_N: float
    amplitude_mm: float
    bending_stiffness_Nmm_per_rad: float
    element_error_percent: float
    full_scale_analytic_deg: float
    full_scale_frictionless_deg: float
    full_scale_deg: float
    frictionless_max_deg: float
    frictionless_rmse_deg: float
    frictionless_tension_max_N: float
    tip_pose_max_mm: float
    chain_max_deg: float
    friction_shift_rmse_deg: float


@dataclass(frozen=True)
class FitEntry:
    """An identification of the run: stem of its files after ``identify-``, its record, and the record's title."""

    name: str
    record: str
    title: str


@dataclass(frozen=True)
class SeparationEntry:
    """A separation of the run: its file, what it is of, and the command that makes it again."""

    file: str
    label: str
    command: str


@dataclass(frozen=True)
class TraceEntry:
    """The trace of the run: verdict and effects that it names."""

    verdict: str
    effects: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """The bent tube: its mesh, a caption, and a still image or the reason why there is none."""

    tube: str | None = optional()
    caption: str
    missing: str | None = optional()
    file: str | None = optional()


NOT_DRAWN = Picture(caption="the rig", missing="the command ended before it was drawn")
"""Picture of results that are stored before it is drawn."""


@dataclass(frozen=True)
class Prediction:
    """A record and the loop that its rig predicts with nothing fitted but the record's zero.

    ``predicted`` is the file of that loop; widths are None where a record does not close.
    """

    record: str
    predicted: str
    rmse_deg: float
    max_abs_deg: float
    noise_floor_deg: float
    width_deg: float | None
    predicted_width_deg: float | None


@dataclass(frozen=True)
class OwnRig:
    """What only the report of a user's own rig has.

    ``option`` names the rig on a command line. ``predictions`` are of the records of a known rig, ``ranges`` of the
    loops by their records, over the ensemble of a preset. ``notes`` say what was left out, and why.
    """

    name: str
    option: str
    amplitude_mm: float
    predictions: tuple[Prediction, ...] = ()
    ranges: Mapping[str, EnsembleRanges] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RunSummary:
    """What ``run.json`` holds; ``sha256`` has the checksums of the records by name.

    ``own`` is there for a user's own rig.
    """

    schema: int = 1
    seed: int
    versions: Mapping[str, str]
    rig: tuple[RigNumber, ...]
    peak_strain_percent: float
    loops: tuple[RunLoop, ...]
    crosscheck: tuple[CrossCheckRow, ...]
    fits: tuple[FitEntry, ...]
    separations: tuple[SeparationEntry, ...] = ()
    trace: TraceEntry | None = optional()
    picture: Picture
    sha256: Mapping[str, str]
    own: OwnRig | None = optional()
    made: Made | None = optional()


@dataclass(frozen=True)
class _Checksums:
    """The one field of a summary that says which records it belongs to."""

    sha256: Mapping[str, str]


def record_of_run(folder: Path, name: str, summary: str = "run.json") -> Path:
    """Give the file of a record of a run by its name, which the file ``summary`` of the folder has.

    Raises
    ------
    RecordError
        A name that leads out of the folder.
    """
    return inside(folder / summary, "record", f"records/{name}.csv", [".csv"])


def checksums(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Compute the sha256 of records in a folder of results, by name.

    Raises
    ------
    RecordError
        A record that cannot be read.
    """
    digests = {}
    for name in names:
        path = record_of_run(folder, name)
        digests[name] = hashlib.sha256(read_bytes(path, "a record of `notchbend run`")).hexdigest()
    return digests


def read_run(folder: Path) -> RunSummary:
    """Read the summary of a main run from its folder.

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    path = folder / "run.json"
    run = read_result(RunSummary, path, WHAT)
    loops, rows = len(run.loops), len(run.crosscheck)
    # a rig of the user's own may have none: cross-checks need two tendons, and a rig that all models can follow
    if not loops or rows > loops or (rows < loops and run.own is None):
        found = f"{loops} loops, {rows} rows of crosscheck"
        raise RecordError(f"{path}: {found}: expected one row for each loop, and at least one")
    return run


def require_unchanged(folder: Path) -> None:
    """Refuse a folder whose records are not the ones that its results were made from.

    Raises
    ------
    RecordError
        One line with the file: a record that is missing or has changed, or none of :data:`OF_RUNS`.
    """
    summaries = [folder / name for name in OF_RUNS if present(folder / name)] or [folder / OF_RUNS[0]]
    for summary in summaries:
        expected = read_result(_Checksums, summary, WHAT).sha256
        for name, found in checksums(folder, expected).items():
            if found != expected[name]:
                file = folder / "records" / f"{name}.csv"
                raise RecordError(
                    f"{file}: sha256 {found[:12]}...: expected {expected[name][:12]}... of the run; "
                    "run `notchbend run` again"
                )
