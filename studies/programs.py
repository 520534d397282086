"""Load programs from a file: of one wheel, of several wheels, and of tendon forces."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_models.load import LoadProgram
from fem_models.rig import RigError
from fem_models.rig.layout import MOST_TENDONS
from hysteresis.arrays import Floats
from hysteresis.messages import listed
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import column_names, read_columns

if TYPE_CHECKING:
    from fem_models.spatial.drives import WheelProgram

FORCE = "tendon_force_N"
"""Column of a program that prescribes the tension at the wheel, in place of ``drive_mm``."""
DRIVES = tuple(f"drive_{k + 1}_mm" for k in range(MOST_TENDONS))
TENSIONS = tuple(f"tension_{k + 1}_N" for k in range(MOST_TENDONS))
FIRST_OF_RECORD = "drive_mm"
"""Column of the first wheel in a record, which is a program, too."""


def program_of_file(path: Path) -> LoadProgram:
    """Read a load program: a CSV with the column drive_mm and, where the rate matters, time_s.

    Raises
    ------
    RecordError, RigError
        One line with file, line, column, value and what was expected.
    """
    if "drive_mm" not in (names := column_names(path)):
        found = f"column {names[0]!r}" if len(names) == 1 else f"columns {listed(names)}"
        raise RecordError(f"{path}: {found}: expected 'drive_mm', and 'time_s' beside it, or {FORCE!r} alone")
    columns = read_columns(path, ["drive_mm"], optional=["time_s"])
    try:
        return LoadProgram(columns["drive_mm"], columns.get("time_s"))
    except RigError as error:
        raise RigError(f"{path}: {error}") from None


def forces_of_file(path: Path) -> Floats | None:
    """Read the tensions of a program, N: a CSV with the column ``tendon_force_N``, shape (rows,).

    Returns
    -------
    Floats or None
        None for a file without that column: :func:`program_of_file` reads it.

    Raises
    ------
    RecordError
        One line with file, line, column, value and what was expected.
    """
    names = column_names(path)
    if FORCE not in names:
        return None
    for other in ("drive_mm", "time_s"):
        if other in names:
            raise RecordError(
                f"{path}: column {other!r} beside {FORCE!r}: expected {FORCE!r} alone, applied step by step"
            )
    force = read_columns(path, [FORCE])[FORCE]
    if force.size < 2:
        raise RecordError(f"{path}: column {FORCE!r} has {force.size} values: expected at least 2")
    if (negative := np.flatnonzero(force < 0)).size:
        raise RecordError(f"{path}:{negative[0] + 2}: column {FORCE!r} = {force[negative[0]]:g}: expected at least 0")
    return force


def wheels_of_file(path: Path) -> WheelProgram:
    """Read a program: a CSV with drive_1_mm, drive_2_mm, ..., one for each wheel, or tension_1_N, ... for each tendon.

    drive_mm stands for drive_1_mm; time_s may stand beside drives.

    Raises
    ------
    RecordError, RigError
        One line with file, line, column, value and what was expected.
    """
    from fem_models.spatial.drives import WheelProgram  # a second, and planar rigs do without it

    names = column_names(path)
    drives, tensions = _given(names, DRIVES, FIRST_OF_RECORD), _given(names, TENSIONS)
    if not drives and not tensions:
        expected = f"{DRIVES[0]!r}, {DRIVES[1]!r}, ..., or {TENSIONS[0]!r}, ..."
        raise RecordError(f"{path}: columns {listed(names)}: expected {expected}")
    if tensions and (drives or "time_s" in names):
        found = drives[0] if drives else "time_s"
        raise RecordError(f"{path}: column {found!r} beside {tensions[0]!r}: expected tensions alone, step by step")
    wanted = drives or tensions
    columns = read_columns(path, wanted, optional=["time_s"])
    try:
        values = np.column_stack([columns[name] for name in wanted])
        return WheelProgram(values, columns.get("time_s"), by_force=bool(tensions))
    except RigError as error:
        raise RigError(f"{path}: {error}") from None


def _given(names: Sequence[str], wanted: Sequence[str], first: str = "") -> list[str]:
    """Give the columns from the first one on that are there; a RecordError in the caller names what is missing."""
    begin = [first] if first in names and wanted[0] not in names else [wanted[0]]
    out = list[str]()
    for name in [*begin, *wanted[1:]]:
        if name not in names:
            break
        out.append(name)
    return out
