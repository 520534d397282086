"""What ``notchbend identify --each`` found: a row for each parameter of each record."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hysteresis.display import on_screen
from hysteresis.extras import require_extra
from hysteresis.fitting.uncertainty import Parameter
from studies.results.made import Made

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    "record",
    "law",
    "parameter",
    "value",
    "low",
    "high",
    "unit",
    "heldout_rmse_deg",
    "noise_deg",
    "fixed",
    "words",
)
"""Columns of the table; ``low`` and ``high`` are the ends of the 95 % interval, empty where there is none."""
_NUMBERS = ("value", "low", "high", "heldout_rmse_deg", "noise_deg")


@dataclass(frozen=True)
class FittedDevice:
    """One record: its law and parameters, those that its samples fix, errors in deg, and notes and warnings.

    ``problem`` is the one line that says why there is no fit; the rest is then empty.
    """

    record: str
    law: str = ""
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    fixed: tuple[str, ...] = ()
    heldout_rmse_deg: float = math.nan
    noise_deg: float = math.nan
    words: tuple[str, ...] = ()
    problem: str = ""

    def rows(self) -> list[tuple[Any, ...]]:
        """Rows of the table, in the order of :data:`COLUMNS`; one without a parameter where there is no fit."""
        if self.problem:
            return [(self.record, "", "", *[math.nan] * 3, "", *[math.nan] * 2, False, self.problem)]
        errors, words = (self.heldout_rmse_deg, self.noise_deg), "; ".join(self.words)
        return [
            (self.record, self.law, name, one.value, _end(one.low), _end(one.high), one.unit, *errors, own, words)
            for name, one in self.parameters.items()
            for own in (name in self.fixed,)
        ]


def _end(value: float | None) -> float:
    return math.nan if value is None else value


@dataclass(frozen=True)
class Spread:
    """A parameter over the devices whose records fix it: how many, median, 5th and 95th percentile, median half width.

    ``half_width`` is that of the 95 % interval of one device.
    """

    name: str
    unit: str
    devices: int
    median: float
    low: float
    high: float
    half_width: float


@dataclass(frozen=True)
class EachSummary:
    """What each.json holds: counts, name of the table, spread of each parameter, records without a fit and why."""

    schema: int
    records: int
    fitted: int
    table: str
    spreads: tuple[Spread, ...]
    problems: Mapping[str, str]
    made: Made | None = None


@dataclass(frozen=True, repr=False)
class EachResult:
    """Many devices, each fitted by itself, in the order of their records."""

    devices: tuple[FittedDevice, ...]
    made: Made | None = None

    @property
    def fitted(self) -> list[FittedDevice]:
        """Devices with a fit."""
        return [one for one in self.devices if not one.problem]

    @property
    def failed(self) -> list[FittedDevice]:
        """Records without a fit."""
        return [one for one in self.devices if one.problem]

    def spreads(self) -> list[Spread]:
        """Describe each parameter over the devices whose records fix it."""
        out = []
        for name in dict.fromkeys(name for one in self.fitted for name in one.parameters):
            known = [one.parameters[name] for one in self.fitted if name in one.fixed]
            if known:
                values = np.array([one.value for one in known])
                halves = np.array([0.5 * (_end(one.high) - _end(one.low)) for one in known])
                low, median, high = np.quantile(values, [0.05, 0.5, 0.95]).tolist()
                width = float(np.median(halves))
                out.append(Spread(name, known[0].unit, len(known), median, low, high, width))
        return out

    def columns(self) -> dict[str, list[Any]]:
        """Columns of the table by name, :data:`COLUMNS`, each with a value for every row."""
        rows = [row for one in self.devices for row in one.rows()]
        return {name: [row[k] for row in rows] for k, name in enumerate(COLUMNS)}

    def to_dataframe(self) -> pd.DataFrame:
        """Return the table, a row for each parameter of each record."""
        require_extra("study", "to_dataframe")
        import pandas as pd

        return pd.DataFrame(self.columns())

    def summary(self, table: str = "") -> EachSummary:
        """Give what each.json holds; ``table`` is the name of the file with the rows."""
        problems = {one.record: one.problem for one in self.failed}
        spreads = tuple(self.spreads())
        return EachSummary(1, len(self.devices), len(self.fitted), table, spreads, problems, self.made)

    def lines(self) -> list[str]:
        """Say it in a few lines: counts, parameters, and up to five of the records without a fit."""
        names = [Path(one.record).name for one in self.failed]
        out = [f"{len(self.fitted)} of {len(self.devices)} records fitted, each by itself"]
        for one in self.spreads():
            unit = "" if one.unit == "1" else f" {one.unit}"
            out.append(
                f"  {one.name:<22} median {one.median:.4g}{unit}, nine tenths from {one.low:.4g} to {one.high:.4g}, "
                f"95 % of one device +- {one.half_width:.2g} ({one.devices} devices)"
            )
        out += [f"  {name}: {one.problem}" for name, one in zip(names[:5], self.failed, strict=False)]
        return out if len(names) <= 5 else [*out, f"  and {len(names) - 5} more without a fit: rows of the table"]

    def __str__(self) -> str:
        return on_screen(self.lines())

    def __repr__(self) -> str:
        return f"EachResult({len(self.fitted)} of {len(self.devices)} records fitted)"


def csv_table(result: EachResult) -> str:
    """Write the table as CSV; a number that is not known is an empty cell."""
    columns = result.columns()
    lines = [",".join(COLUMNS)]
    for row in zip(*(columns[name] for name in COLUMNS), strict=True):
        lines.append(",".join(_cell(value) for value in row))
    return "\n".join(lines) + "\n"


def _cell(value: object) -> str:
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else ""
    text = str(value)
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\n\r') else text


def parquet_table(result: EachResult) -> bytes:
    """Write the table as Parquet; a number that is not known is null.

    Raises
    ------
    MissingError
        pyarrow is not installed.
    """
    require_extra("tables", "a table in Parquet")
    import pyarrow as pa
    from pyarrow import parquet

    columns = result.columns()
    arrays = {name: pa.array(_known(name, values), _kind(pa, name)) for name, values in columns.items()}
    buffer = io.BytesIO()
    parquet.write_table(pa.table(arrays), buffer, version="2.6")
    return buffer.getvalue()


def _known(name: str, values: Sequence[Any]) -> list[Any]:
    return [None if name in _NUMBERS and not math.isfinite(value) else value for value in values]


def _kind(pa: Any, name: str) -> Any:
    return pa.float64() if name in _NUMBERS else pa.bool_() if name == "fixed" else pa.string()
