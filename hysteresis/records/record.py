"""The record of one test, measured or simulated: drive and bending angle, sample by sample, with the known metadata.

:mod:`hysteresis.records.record_file` reads and writes records; the file format is documented in
``docs/guide/records.md``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from hysteresis.arguments import checked_class
from hysteresis.arrays import Floats, Ints, Mask
from hysteresis.display import from_to, html_table
from hysteresis.extras import require_extra
from hysteresis.files import RecordError as RecordError
from hysteresis.messages import quoted
from hysteresis.records.metrics import loop_width

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

DriveUnit = Literal["mm", "deg", "step", "N"]
DRIVE_UNITS: tuple[str, ...] = ("mm", "deg", "step", "N")
Kind = Literal["measured", "simulated"]
KINDS: tuple[str, ...] = ("measured", "simulated")
MAX_MAGNITUDE = 1e9
"""Largest magnitude of a value in mm, deg, steps or N. More is a wrong unit or a broken log, and squares overflow."""
MAX_COUNT = 2.0**53
"""Largest magnitude of a time, which may be that of a clock, and of a cycle number: a float holds it exactly."""

FIELDS: dict[str, str] = {
    "time": "time_s",
    "cycle": "cycle",
    "drive": "drive",  # in a bare CSV: drive_mm
    "force": "drive",  # the drive of load-controlled data
    "angle": "angle_deg",
    "tension_a": "tension_a_N",
    "tension_b": "tension_b_N",
    "tension_c": "tension_c_N",
    "tension_d": "tension_d_N",
    "angle_2": "angle_2_deg",
    "torsion": "torsion_deg",
    "drive_2": "drive_2",
    "drive_3": "drive_3",
    "drive_4": "drive_4",
    "jump": "jump",
}
"""Key of the sidecar's ``[columns]`` -> field of :class:`Record`; a bare CSV names its columns as these fields."""
FURTHER_DRIVES = ("drive_2", "drive_3", "drive_4")
"""Keys of the wheels after the first one, in the unit of the drive."""
LIST_FIELDS: dict[str, str] = {"notches": "notches_deg", "tip": "tip_mm"}
"""Keys of ``[columns]`` that name a list of columns, with the field of :class:`Record` that they fill."""
MEASURED_KEYS = (
    "joints",
    "moment_arm_mm",
    "flexure_stiffness_Nmm_per_rad",
    "tendon_EA_N",
    "tendon_free_length_mm",
    "pitch_mm",
)
"""Measured quantities of ``[rig]`` that replace a preset or a rig file; all of them are given, or none."""


@checked_class(RecordError)
@dataclass(frozen=True, eq=False, repr=False)
class Record:
    """One test of one rig, sample by sample. All arrays have the same length m.

    ``drive_unit`` is N for load-controlled data (the drive is then the tendon force). ``rig``, ``tube`` and
    ``notch`` hold the sidecar's tables unchanged; the mechanical model interprets them (``rig["file"]`` is absolute
    in a record that was read). ``kinematics`` is the user's own theory f(x), rows (drive_mm, angle_deg), shape (k, 2),
    by increasing drive. ``loop_width_deg`` and ``full_scale_deg`` are measured on the samples.

    Arrays are copied and read-only. Two records are equal when all values are equal; ``source``, ``drive_column``,
    ``left_out`` and ``plane`` (the origin of the data, see :func:`hysteresis.records.planes.second_plane`) are not
    compared.

    Raises
    ------
    RecordError
        A field of another type, an array of another shape, a value that is not finite or beyond 1e9 (times may be
        larger), time that does not increase, a cycle that is not a whole number or decreases, an unknown kind or unit.
    """

    drive: Floats
    angle_deg: Floats
    drive_unit: DriveUnit = "mm"
    title: str = ""
    kind: Kind = "measured"
    time_s: Floats | None = None
    cycle: Ints | None = None
    tension_a_N: Floats | None = None
    tension_b_N: Floats | None = None
    notches_deg: Floats | None = None  # shape (m, notches), base to tip
    tip_mm: Floats | None = None  # shape (m, 2) or (m, 3): along the straight tube, across it in the bending plane, and
    # across that plane
    tension_c_N: Floats | None = None
    tension_d_N: Floats | None = None
    angle_2_deg: Floats | None = None  # bending in the second plane
    torsion_deg: Floats | None = None
    drive_2: Floats | None = None  # of further wheels, in the unit of the drive
    drive_3: Floats | None = None
    drive_4: Floats | None = None
    jump: Ints | None = (
        None  # 1 at samples of a simulated record at which the tube jumps to another equilibrium, else 0
    )
    rig: Mapping[str, Any] = field(default_factory=dict)
    tube: Mapping[str, Any] = field(default_factory=dict)
    notch: Mapping[str, Any] = field(default_factory=dict)
    kinematics: Floats | None = None
    source: str = field(default="", compare=False)  # the file it was read from, for messages; "" if made in memory
    drive_column: str = field(default="drive", compare=False)  # name of the drive's column in that file
    left_out: str = field(default="", compare=False)  # words on samples that hysteresis.records.thinning left out
    plane: int = field(default=1, compare=False)  # 2 where the second plane of a record stands as its first one

    def __post_init__(self) -> None:
        self._require(self.drive_unit in DRIVE_UNITS, "drive_unit", repr(self.drive_unit), "one of mm, deg, step, N")
        self._require(self.kind in KINDS, "kind", repr(self.kind), "measured or simulated")
        self._require(len(_shape(self.drive)) == 1 and len(self.drive) > 0, "drive", "no samples", "a row of numbers")
        m = len(self.drive)
        # None stands for any number of columns or rows.
        shapes: dict[str, tuple[int | None, ...]] = {
            **dict.fromkeys(FIELDS.values(), (m,)),
            "notches_deg": (m, None),
            "tip_mm": (m, 3 if _shape(self.tip_mm)[1:] == (3,) else 2),
            "kinematics": (None, 2),
        }
        for name, shape in shapes.items():
            if getattr(self, name) is not None or name == "angle_deg":
                object.__setattr__(self, name, self._checked(name, shape))
        for name in ("rig", "tube", "notch"):
            object.__setattr__(self, name, dict(getattr(self, name)))

    def _checked(self, name: str, shape: tuple[int | None, ...]) -> NDArray[Any]:
        """Return a read-only copy of an array; raise if it violates the contract of the class."""
        given = getattr(self, name)
        try:
            self._require(not np.ma.getmaskarray(given).any(), name, "masked values", "a number in every row")
            self._require(np.asarray(given).dtype.kind not in "mM", name, "dates", "numbers, such as seconds")
            array = np.array(given, dtype=float)
        except RecordError:
            raise
        except (TypeError, ValueError, OverflowError):
            raise RecordError(f"{self.source or 'record'}: {name}: {quoted(given, 40)}: expected numbers") from None
        fits = array.shape == shape or (
            array.ndim == len(shape) and all(want in (None, n) for want, n in zip(shape, array.shape, strict=True))
        )
        if not fits or array.size == 0:
            expected = str(shape).replace("None", "any")
            self._require(False, name, f"shape {array.shape}", f"shape {expected}")
        largest = float(np.abs(array).max())
        limit = MAX_COUNT if name in ("time_s", "cycle") else MAX_MAGNITUDE
        if not largest <= limit:
            self._require(math.isfinite(largest), name, "NaN or infinite", "finite numbers")
            self._require(False, name, f"magnitude {largest:g}", f"at most {limit:g}")
        if name == "cycle":
            self._require(not bad_cycles(array).any(), name, "not a count", "whole numbers that never fall")
            array = array.astype(np.int64)
        elif name == "jump":
            self._require(bool(np.isin(array, (0.0, 1.0)).all()), name, "another number", "0 or 1")
            array = array.astype(np.int64)
        elif name in ("time_s", "kinematics"):
            increasing = array if name == "time_s" else array[:, 0]
            self._require(bool((np.diff(increasing) > 0).all()), name, "not increasing", "increasing values")
        array.flags.writeable = False
        return array

    def _require(self, condition: bool, name: str, value: str, expected: str) -> None:
        if not condition:
            raise RecordError(f"{self.source or 'record'}: {name}: {value}: expected {expected}")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Record):
            return NotImplemented
        pairs = [(getattr(self, f.name), getattr(other, f.name)) for f in fields(self) if f.compare]
        return all(
            np.array_equal(a, b) if isinstance(a, np.ndarray) else type(a) is type(b) and a == b for a, b in pairs
        )

    @property
    def full_scale_deg(self) -> float:
        """Largest magnitude of the angle, deg."""
        return float(np.abs(self.angle_deg).max())

    @property
    def loop_width_deg(self) -> float:
        """Largest width of the loop, deg, at equal drive: :func:`hysteresis.records.metrics.loop_width`.

        Raises
        ------
        RecordError
            A record without a complete cycle.
        """
        try:
            return loop_width(self.drive, self.angle_deg, self.cycle).max_deg
        except ValueError as error:
            raise RecordError(f"{self.source or 'record'}: no loop width: {error}") from None

    def column_names(self) -> dict[str, str | list[str]]:
        """Return the ``[columns]`` table of the record's file: key -> column, or list of columns, of the CSV."""
        load = self.drive_unit == "N"
        names = {**FIELDS, "drive": f"drive_{self.drive_unit}", "force": "force_N"}
        names |= {key: f"{key}_{self.drive_unit}" for key in FURTHER_DRIVES}
        del names["drive" if load else "force"]
        columns: dict[str, str | list[str]] = {
            key: name for key, name in names.items() if getattr(self, FIELDS[key]) is not None
        }
        if self.notches_deg is not None:
            columns["notches"] = [f"notch_{i + 1}_deg" for i in range(self.notches_deg.shape[1])]
        if self.tip_mm is not None:
            columns["tip"] = ["tip_x_mm", "tip_y_mm", "tip_z_mm"][: self.tip_mm.shape[1]]
        return columns

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns of the CSV by name, each of shape (m,)."""
        data: dict[str, NDArray[Any]] = {}
        for key, names in self.column_names().items():
            if isinstance(names, str):
                data[names] = getattr(self, FIELDS[key])
            else:
                data |= dict(zip(names, getattr(self, LIST_FIELDS[key]).T, strict=True))
        return data

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: the columns of the CSV as lists, and what the sidecar holds."""
        tables = {"rig": dict(self.rig), "tube": dict(self.tube), "notch": dict(self.notch)}
        theory = {} if self.kinematics is None else {"kinematics": self.kinematics.tolist()}
        columns = {name: column.tolist() for name, column in self.columns().items()}
        head = {"title": self.title, "kind": self.kind, "drive_unit": self.drive_unit}
        return head | {name: table for name, table in tables.items() if table} | theory | {"columns": columns}

    def to_dataframe(self) -> pd.DataFrame:
        """Return the samples as a table with the columns of the CSV.

        ``attrs`` holds title, kind, and the tables of the sidecar that describe the rig: a function that takes a record
        takes this table, too.
        """
        require_extra("study", "to_dataframe")
        import pandas as pd  # takes a quarter of a second, and only this needs it

        frame = pd.DataFrame(self.columns())
        tables = {"rig": dict(self.rig), "tube": dict(self.tube), "notch": dict(self.notch)}
        frame.attrs = {"title": self.title, "kind": self.kind, **{key: one for key, one in tables.items() if one}}
        return frame

    def to_xarray(self) -> xr.Dataset:
        """Return the samples as a labelled dataset with units.

        Variables are named as the columns of the CSV, with dimension ``sample``; ``time_s`` and ``cycle`` are
        coordinates. Notch angles are one variable (sample, notch), numbered from 1 at the base, and the tip is one
        variable (sample, axis). Each variable has the attribute ``units``.
        """
        require_extra("study", "to_xarray")
        import xarray as xr

        columns, names = self.columns(), self.column_names().values()
        variables: dict[str, Any] = {name: ("sample", columns[name]) for name in names if isinstance(name, str)}
        coordinates: dict[str, Any] = {name: variables.pop(name) for name in ("time_s", "cycle") if name in variables}
        if self.notches_deg is not None:
            variables["notches_deg"] = (("sample", "notch"), self.notches_deg)
            coordinates["notch"] = np.arange(1, self.notches_deg.shape[1] + 1)
        if self.tip_mm is not None:
            variables["tip_mm"] = (("sample", "axis"), self.tip_mm)
            coordinates["axis"] = ["along", "across", "out_of_plane"][: self.tip_mm.shape[1]]
        dataset = xr.Dataset(variables, coordinates, {"title": self.title, "kind": self.kind})
        for table in ("rig", "tube", "notch"):
            for key, value in getattr(self, table).items():
                flat = value if isinstance(value, Mapping) else {"": value}
                dataset.attrs |= {f"{table}_{key}{inner and '_'}{inner}": one for inner, one in flat.items()}
        for name in (*variables, *(n for n in ("time_s", "cycle") if n in coordinates)):
            dataset[name].attrs["units"] = "1" if name == "cycle" else name.rsplit("_", 1)[-1]
        return dataset

    def __repr__(self) -> str:
        drive, angle = from_to(self.drive, self.drive_unit), from_to(self.angle_deg, "deg")
        return f"Record({self.title!r}, {self.kind}, {self.drive.size} samples, drive {drive}, angle {angle})"

    def _repr_html_(self) -> str:
        rows = [
            ("kind", self.kind),
            ("samples", str(self.drive.size)),
            ("drive", from_to(self.drive, self.drive_unit)),
            ("angle", from_to(self.angle_deg, "deg")),
        ]
        if self.time_s is not None:
            rows.append(("time", from_to(self.time_s, "s")))
        if self.cycle is not None:
            rows.append(("cycles", f"{self.cycle.min()} to {self.cycle.max()}"))
        rows.append(("columns", ", ".join(self.columns())))
        tables = {"rig": self.rig, "tube": self.tube, "notch": self.notch}
        rows += [(name, ", ".join(f"{k} = {v}" for k, v in table.items())) for name, table in tables.items() if table]
        if self.source:
            rows.append(("file", self.source))
        return html_table(self.title or "record", rows)


def _shape(given: Any) -> tuple[int, ...]:
    try:
        return np.shape(given)
    except ValueError:  # rows of different lengths
        return ()


def bad_cycles(cycle: Floats) -> Mask:
    """Mark the cycle numbers that are not whole or are below their predecessor, shape (m,) -> (m,)."""
    whole = (cycle == np.rint(cycle)) & (np.abs(cycle) < 2**53)
    return ~whole | (np.diff(cycle, prepend=-np.inf) < 0)
