"""What a design report is of: a rig at its preloads; its numbers with their sources, and the files that it replaces."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.presets import PRESETS
from fem_models.rig.presets_in_space import PRESETS_IN_SPACE
from fem_models.rig.rig import numeric_fields
from fem_models.rig.rig_file import read_any_rig
from hysteresis.records.record import Record
from studies.own_rig.numbers import numbers_of_file, with_preloads
from studies.own_rig.strain import drive_to_angle_mm
from studies.results.run import RigNumber


@dataclass(frozen=True)
class Design:
    """A rig at each of its preloads, and how it is named: ``option`` on a command line, ``name`` in files.

    ``file`` is the rig file, None of a preset. ``members`` are the rigs of the preset's ensemble, at any preload; none
    without one.
    """

    name: str
    option: str
    rigs: tuple[Rig, ...]
    amplitude_mm: float
    preset: str | None = None
    file: Path | None = None
    members: tuple[Rig, ...] = ()


def amplitude_of(rig: Rig, records: Sequence[Record]) -> float:
    """Give the drive of a report: that of the records in mm, else the one that bends one plane of the rig to 45 deg."""
    drives = [float(np.abs(record.drive).max()) for record in records if record.drive_unit == "mm"]
    return max(drives) if drives else drive_to_angle_mm(rig.in_plane)


def numbers_of_preset(name: str) -> tuple[RigNumber, ...]:
    """Give every number of a preset with its source."""
    known = PRESETS[name] if name in PRESETS else PRESETS_IN_SPACE[name]
    return tuple(
        RigNumber(field, value, known.sources[field].kind, known.sources[field].note)
        for field, value in numeric_fields(known.rig).items()
    )


def numbers_of_design(design: Design) -> tuple[RigNumber, ...]:
    """Give every number of the rig with its source: that of the preset, the rig file, or a default.

    The preload is the file's or the preset's, too; a note says where the loops have others.
    """
    rig = design.rigs[-1]
    if design.preset is not None:
        rows = numbers_of_preset(design.preset)
    elif design.file is not None:
        own = replace(rig, preload_N=read_any_rig(design.file).preload_N)
        rows = numbers_of_file(numeric_fields(own), design.file)
    else:
        rows = tuple(RigNumber(name, value, "given", "") for name, value in numeric_fields(rig).items())
    return with_preloads(rows, [one.preload_N for one in design.rigs])


def files_replaced(out: Path, patterns: Iterable[str], records: Iterable[str], known: Mapping[str, str]) -> list[Path]:
    """Give the files of a folder that a report may replace.

    ``records`` are patterns of names; ``known`` has the records of an earlier report, which are its own.
    """
    found = [path for pattern in patterns for path in sorted(out.glob(pattern))]
    of_records = [path for name in records for end in ("csv", "toml") for path in out.glob(f"records/{name}.{end}")]
    return [*found, *(path for path in of_records if path.stem not in known)]


def remove_earlier(out: Path, names: Iterable[str]) -> None:
    """Remove what the page would show of an earlier report as that of this one: by name, traces and separations."""
    for path in [*(out / name for name in names), *out.glob("trace*.json"), *out.glob("separate*.json")]:
        path.unlink(missing_ok=True)
