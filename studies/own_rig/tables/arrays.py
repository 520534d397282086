"""Tables that are stored as arrays: ``.parquet`` and ``.mat``."""

from __future__ import annotations

import io
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hysteresis.extras import require_extra
from hysteresis.files import MB, MOST_BYTES, RecordError
from hysteresis.messages import as_given
from hysteresis.records.record_file import MOST_COLUMNS
from studies.own_rig.tables.table import BenchTable, Column, require_size

_MOST_LEVELS = 6


def read_parquet(path: Path, content: bytes) -> BenchTable:
    """Read a parquet file; fields of structures are columns with the names ``outer.inner``.

    Raises
    ------
    RecordError
        A file that is not whole, or too large.
    MissingError
        Without pyarrow.
    """
    require_extra("tables", "tables in .xlsx and .parquet")
    from pyarrow import parquet

    try:
        file: Any = parquet.ParquetFile(io.BytesIO(content))
        groups = [file.metadata.row_group(k) for k in range(file.metadata.num_row_groups)]
        if (size := sum(group.total_byte_size for group in groups)) > MOST_BYTES:
            raise RecordError(f"{path}: unpacked {size / MB:,.0f} MB: expected at most {MOST_BYTES / MB:,.0f} MB")
        require_size(path, file.metadata.num_columns, file.metadata.num_rows)
        table: Any = file.read()
        for _ in range(_MOST_LEVELS):
            table = table.flatten()
        columns = {name: _column_of_arrow(table.column(k)) for k, name in enumerate(table.column_names)}
    except RecordError:
        raise
    except Exception as error:
        raise RecordError(f"{path}: not read: {as_given(str(error), 120)}: expected a parquet file") from None
    return _table(path, "parquet", {name: column for name, column in columns.items() if column is not None}, ())


def _column_of_arrow(column: Any) -> Column | None:
    kind = str(column.type)
    if kind.startswith(("timestamp", "date", "time", "duration")):
        return Column(_seconds(column.to_numpy()))
    if kind.startswith(("int", "uint", "float", "double", "halffloat", "decimal")):
        return Column(np.array([np.nan if one is None else float(one) for one in column.to_pylist()]))
    if kind.startswith(("string", "large_string", "dictionary")):
        return Column([one if one is None else str(one) for one in column.to_pylist()])
    return None


def _seconds(values: NDArray[Any]) -> NDArray[np.float64]:
    """Give dates as seconds from the first one."""
    if values.dtype.kind not in "mM":
        return np.full(values.size, np.nan)
    there = ~np.isnat(values)
    if not there.any():
        return np.full(values.size, np.nan)
    return np.asarray((values - values[there][0]) / np.timedelta64(1, "ns") * 1e-9, dtype=float)


def read_mat(path: Path, content: bytes) -> BenchTable:
    """Read the vectors of a ``.mat`` file up to version 7 that are as long as most of them are.

    Fields of structures are columns with the names ``outer.inner``; columns of a matrix are ``M(1)``, ``M(2)`` ...

    Raises
    ------
    RecordError
        A file that is not whole, or has no two vectors of one length.
    """
    import scipy.io

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            values = scipy.io.loadmat(io.BytesIO(content), simplify_cells=True)
        found = {name: vector for key, value in values.items() if not key.startswith("__")
                 for name, vector in _vectors(key, value)}  # fmt: skip
    except Exception as error:  # of lengths, types and compression: whatever a broken file makes the library raise
        words = as_given(f"{type(error).__name__}: {error}", 120)
        raise RecordError(f"{path}: not read: {words}: expected a file of save('x.mat', '-v7')") from None
    lengths = Counter(vector.size for vector in found.values() if vector.size > 2)
    best = max(lengths, key=lambda one: (lengths[one], one), default=0)
    columns = {name: Column(vector) for name, vector in found.items() if vector.size == best}
    if len(columns) < 2:
        there = "tables and timetables, which MATLAB alone reads" if "None" in values else f"{len(columns)} vectors"
        raise RecordError(f"{path}: {there}: expected drive and angle as vectors of one length, or writetable to CSV")
    left = len(found) - len(columns)
    notes = (f"{left} variable{'s' * (left > 1)} of another length left out",) if left else ()
    return _table(path, "mat", columns, notes)


def _vectors(name: str, value: Any, level: int = 0) -> Iterator[tuple[str, NDArray[np.float64]]]:
    if isinstance(value, Mapping) and level < _MOST_LEVELS:
        for key, inner in value.items():
            yield from _vectors(f"{name}.{key}", inner, level + 1)
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "fiu":
        return
    if value.ndim == 1 or (value.ndim == 2 and min(value.shape) == 1):
        yield name, np.asarray(value, dtype=float).ravel()
    elif value.ndim == 2:
        table = value if value.shape[0] >= value.shape[1] else value.T
        for k in range(min(table.shape[1], MOST_COLUMNS)):
            yield f"{name}({k + 1})", np.asarray(table[:, k], dtype=float)


def _table(path: Path, kind: str, columns: dict[str, Column], notes: tuple[str, ...]) -> BenchTable:
    rows = max((len(column.cells) for column in columns.values()), default=0)
    require_size(path, len(columns), rows)
    if rows == 0 or len(columns) < 2:
        raise RecordError(f"{path}: {len(columns)} columns, {rows} rows: expected a table with drive and angle")
    return BenchTable(path=path, columns=columns, lines=tuple(range(1, rows + 1)), kind=kind, notes=notes)
