"""The rig of a record, as its sidecar describes it."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_models.rig.checks import RigError
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from fem_models.rig.presets import NAMES_IN_SPACE, preset
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import Material, Rig, Tendon, Wheel
from fem_models.rig.rig_file import build, read_any_rig, read_rig, rig_and_space_of_file
from hysteresis.records.metrics import noise_floor
from hysteresis.records.record import MEASURED_KEYS, Record, RecordError
from hysteresis.sensors.readings import cleaned

# A rig with measured joints needs a material for its loop only; the modulus is not used.
_NITINOL = Material(youngs_modulus_GPa=60.0, poissons_ratio=0.33)


def rig_of(record: Record) -> Rig | None:
    """Return the rig that the sidecar describes, or None if the geometry is unknown or the drive is a force.

    The rig is known from ``preset``, ``file`` or all of :data:`hysteresis.records.record.MEASURED_KEYS` with
    ``preload_N``. ``[tube]`` and ``[notch]`` tables alone do not describe the tendons: they are checked, and None is
    returned.

    Raises
    ------
    RigError
        One line with the record's file, the field, its value and what was expected.
    """
    rig = declared_rig_of(record)
    return None if record.drive_unit == "N" else rig


def require_the_rigs_sense(record: Record) -> None:
    """Refuse an angle that falls as the drive rises: to reverse it would silently exchange the two tendons.

    Readings that a sensor lost do not count. A fall of the least-squares line, over the range of the drive, within the
    noise says nothing of the sense: the rig is stuck.

    Raises
    ------
    RecordError
        One line with the record.
    """
    read = cleaned(record).record
    moved = record.drive - record.drive.mean()
    slope = float(moved @ read.angle_deg) / max(float(moved @ moved), sys.float_info.min)
    if slope < 0 and -slope * float(np.ptp(record.drive)) > noise_floor(read):
        raise RecordError(
            f"{_where(record)}: angle_deg: falls as drive_mm rises: expected the signs of the rig: "
            "a positive drive pulls tendon a and bends to positive angles"
        )


def declared_rig_of(record: Record) -> Rig | None:
    """Return the rig that the sidecar describes, whatever its drive; None if the geometry is unknown.

    Raises
    ------
    RigError
        As :func:`rig_of`.
    """
    notched_tube_of(record)
    try:
        return _from_table(record.rig, Path(record.source).parent)
    except RigError as error:
        raise RigError(f"{_where(record)}: {error}") from None


def bends_in_space(record: Record) -> bool:
    """Tell whether the rig that the sidecar names bends in space: its geometry is then unknown to a model of one plane.

    Raises
    ------
    RigError
        A rig file that cannot be read.
    """
    if "file" in record.rig:
        return rig_and_space_of_file(Path(record.source).parent / str(record.rig["file"]))[1] is not None
    return record.rig.get("preset") in NAMES_IN_SPACE


def rig_in_space_of(record: Record) -> Rig:
    """Return the rig in space that the sidecar names (:func:`bends_in_space`), at the preload of the record.

    Raises
    ------
    RigError
        As :func:`rig_of`.
    """
    preload = record.rig.get("preload_N")
    if "file" in record.rig:
        rig = read_any_rig(Path(record.source).parent / str(record.rig["file"]))
    else:
        rig = any_preset(str(record.rig.get("preset")))
    if rig.is_planar:
        raise RigError(f"{_where(record)}: rig: of one plane: expected a rig in space")
    try:
        return rig.with_preload(preload)
    except RigError as error:
        raise RigError(f"{_where(record)}: {error}") from None


def notched_tube_of(record: Record) -> NotchedTube | None:
    """Return tube and notches of the sidecar, or None if it has no such tables. A V without a root width is sharp.

    Numbers of notches that differ are lists, one a notch from base to tip.

    Raises
    ------
    RigError
        As :func:`rig_of`; one of the two tables alone.
    """
    where, tube, notch = _where(record), record.tube, record.notch
    if notch.get("shape") == "v_pair":
        notch = {"root_width_mm": 0.0, **notch}
    parts = {name: build(name, table, where) for name, table in (("tube", tube), ("notch", notch)) if table}
    if len(parts) == 1:
        raise RigError(f"{where}: [{next(iter(parts))}] alone: expected [tube] and [notch]")
    try:
        return NotchedTube(**parts) if parts else None
    except RigError as error:
        raise RigError(f"{where}: {error}") from None


def _where(record: Record) -> str:
    return record.source or record.title or "record"


def _from_table(table: Mapping[str, Any], folder: Path) -> Rig | None:
    preload = table.get("preload_N")
    given = [k for k in MEASURED_KEYS if k in table]
    sources = [k for k in ("preset", "file") if k in table] + (["measured quantities"] if given else [])
    if len(sources) > 1:
        raise RigError(f"[rig] has {' and '.join(sources)}: expected one of them")
    if "preset" in table:
        return preset(str(table["preset"]), preload_N=preload)
    if "file" in table:
        rig = read_rig(folder / str(table["file"]))
        return rig if preload is None else replace(rig, preload_N=preload)
    if not given:
        return None
    missing = [k for k in (*MEASURED_KEYS, "preload_N") if k not in table]
    if missing:
        raise RigError(f"rig.{missing[0]}: missing, expected beside {given[0]}")
    tendon = Tendon(table["tendon_EA_N"], table["moment_arm_mm"], table["tendon_free_length_mm"])
    return Rig(
        name="bench",
        material=_NITINOL,
        tendon_a=tendon,
        tendon_b=tendon,
        wheel=Wheel(radius_mm=10.0),
        preload_N=table["preload_N"],
        joint=MeasuredJoint(table["joints"], table["pitch_mm"], table["flexure_stiffness_Nmm_per_rad"]),
    )
