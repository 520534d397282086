"""Tables that are stored as arrays: ``.parquet`` and ``.mat``.

They are read in a process of their own: a broken file can end the one that reads it, since the libraries that do are
compiled and trust the lengths in it.
"""

from __future__ import annotations

import io
import json
import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hysteresis.arrays import Floats
from hysteresis.extras import require_extra
from hysteresis.files import MB, MOST_BYTES, RecordError
from hysteresis.messages import as_given
from hysteresis.records.record_file import MOST_COLUMNS
from studies.own_rig.tables.table import BenchTable, Column, require_size

_MOST_LEVELS = 6
_MOST_S = 300.0
_CODE = (
    "import json, os, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from studies.own_rig.tables.arrays import read_here; read_here(sys.argv[2], sys.argv[3]); "
    "sys.stdout.flush(); os._exit(0)"  # threads of pyarrow may abort a process that ends in the usual way
)


@dataclass(frozen=True, eq=False)
class Arrays:
    """Columns by name, numbers or texts, and notes on what was left out."""

    columns: dict[str, Floats | list[str | None]]
    notes: tuple[str, ...] = ()


def read_arrays(path: Path, kind: str) -> BenchTable:
    """Read a file of the kind "parquet" or "mat".

    Of parquet, fields of structures are columns with the names ``outer.inner``. Of ``.mat`` up to version 7, the
    vectors that are as long as most of them are: fields of structures as well, and columns of a matrix as ``M(1)``,
    ``M(2)`` ...

    Raises
    ------
    RecordError
        A file that is not whole or is too large, or has no two columns of one length.
    MissingError
        A parquet file without pyarrow.
    """
    if kind == "parquet":
        require_extra("tables", "tables in .xlsx and .parquet")
    command = [sys.executable, "-c", _CODE, json.dumps(sys.path), str(path), kind]
    expected = "a parquet file" if kind == "parquet" else "a file of save('x.mat', '-v7')"
    try:
        done = subprocess.run(command, capture_output=True, check=False, timeout=_MOST_S)
    except subprocess.TimeoutExpired:
        raise RecordError(f"{path}: not read within {_MOST_S:g} s: expected {expected}") from None
    if done.returncode != 0:
        raise RecordError(f"{path}: it ends the program that reads it: expected {expected}")
    with np.load(io.BytesIO(done.stdout)) as stored:
        said = json.loads(str(stored["said"]))
        if "error" in said:
            raise RecordError(f"{path}: {said['error']}")
        columns = {
            one["name"]: Column(one.get("texts") or stored[f"column {k}"]) for k, one in enumerate(said["columns"])
        }
    rows = max((len(column.cells) for column in columns.values()), default=0)
    if rows == 0 or len(columns) < 2:
        raise RecordError(f"{path}: {len(columns)} columns, {rows} rows: expected a table with drive and angle")
    lines, notes = tuple(range(1, rows + 1)), tuple(said["notes"])
    return BenchTable(path=path, columns=columns, lines=lines, kind=kind, notes=notes)


def read_here(path: str, kind: str) -> None:
    """Read a file in this process, and write what is in it to standard output, as :func:`numpy.savez` does."""
    numbers: dict[str, Any] = {}
    try:
        content = Path(path).read_bytes()
        found = _of_parquet(content) if kind == "parquet" else _of_mat(content)
        said: dict[str, Any] = {"notes": found.notes, "columns": []}
        for k, (name, column) in enumerate(found.columns.items()):
            said["columns"].append({"name": name} | ({"texts": column} if isinstance(column, list) else {}))
            if not isinstance(column, list):
                numbers[f"column {k}"] = column
    except RecordError as error:
        said = {"error": str(error)}
    except Exception as error:  # of lengths, types and compression: whatever a broken file makes a library raise
        said = {"error": f"not read: {as_given(f'{type(error).__name__}: {error}', 120)}: expected a whole file"}
        numbers = {}
    np.savez(sys.stdout.buffer, said=json.dumps(said), **numbers)


def _of_parquet(content: bytes) -> Arrays:
    from pyarrow import parquet

    file: Any = parquet.ParquetFile(io.BytesIO(content))
    groups = [file.metadata.row_group(k) for k in range(file.metadata.num_row_groups)]
    if (size := sum(group.total_byte_size for group in groups)) > MOST_BYTES:
        raise RecordError(f"unpacked {size / MB:,.0f} MB: expected at most {MOST_BYTES / MB:,.0f} MB")
    require_size("table", file.metadata.num_columns, file.metadata.num_rows)
    table: Any = file.read()
    for _ in range(_MOST_LEVELS):
        table = table.flatten()
    columns = {str(name): _column_of_arrow(table.column(k)) for k, name in enumerate(table.column_names)}
    return Arrays({name: column for name, column in columns.items() if column is not None})


def _column_of_arrow(column: Any) -> Floats | list[str | None] | None:
    kind = str(column.type)
    if kind.startswith(("timestamp", "date", "time", "duration")):
        return _seconds(column.to_numpy())
    if kind.startswith(("int", "uint", "float", "double", "halffloat", "decimal")):
        return np.array([np.nan if one is None else float(one) for one in column.to_pylist()])
    if kind.startswith(("string", "large_string", "dictionary")):
        return [one if one is None else str(one) for one in column.to_pylist()]
    return None


def _seconds(values: NDArray[Any]) -> Floats:
    """Give dates as seconds from the first one."""
    if values.dtype.kind not in "mM":
        return np.full(values.size, np.nan)
    there = ~np.isnat(values)
    if not there.any():
        return np.full(values.size, np.nan)
    return np.asarray((values - values[there][0]) / np.timedelta64(1, "ns") * 1e-9, dtype=float)


def _of_mat(content: bytes) -> Arrays:
    import scipy.io

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        values = scipy.io.loadmat(io.BytesIO(content), simplify_cells=True)
    vectors = {name: vector for key, value in values.items() if not key.startswith("__")
               for name, vector in _vectors(key, value)}  # fmt: skip
    lengths = Counter(vector.size for vector in vectors.values() if vector.size > 2)
    best = max(lengths, key=lambda one: (lengths[one], one), default=0)
    columns: dict[str, Floats | list[str | None]] = {name: one for name, one in vectors.items() if one.size == best}
    if len(columns) < 2:
        there = "tables and timetables, which MATLAB alone reads" if "None" in values else f"{len(columns)} vectors"
        raise RecordError(f"{there}: expected drive and angle as vectors of one length, or writetable to CSV")
    require_size("table", len(columns), best)
    left = len(vectors) - len(columns)
    return Arrays(columns, (f"{left} variable{'s' * (left > 1)} of another length left out",) if left else ())


def _vectors(name: str, value: Any, level: int = 0) -> Iterator[tuple[str, Floats]]:
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
