"""The engines by name, and load programs from a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from fem_models.kinematics import simulate_analytic
from fem_models.multibody import simulate_multibody
from fem_models.program import LoadProgram
from fem_models.rig import Rig, RigError
from hysteresis.record import Record

ENGINES: dict[str, Callable[[Rig, LoadProgram], Record]] = {
    "multibody": simulate_multibody,
    "analytic": simulate_analytic,
}


def program_of_file(path: Path) -> LoadProgram:
    """Read a load program: a CSV with the column drive_mm and, where the rate matters, time_s.

    Raises
    ------
    RigError
        One line with file, line, column, value and what was expected.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise RigError(f"{path}: {error.strerror}: expected a load program in CSV") from None
    header = [name.strip() for name in lines[0].split(",")] if lines else []
    if "drive_mm" not in header:
        raise RigError(f"{path}: columns {', '.join(header) or 'none'}: expected drive_mm")
    columns: dict[str, list[float]] = {name: [] for name in header if name in ("drive_mm", "time_s")}
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        cells = line.split(",")
        if len(cells) != len(header):
            raise RigError(f"{path}:{number}: {len(cells)} fields, expected {len(header)}")
        for name, cell in zip(header, cells, strict=True):
            if name in columns:
                columns[name].append(_number(cell, f"{path}:{number}: {name}"))
    try:
        return LoadProgram(np.array(columns["drive_mm"]), np.array(columns["time_s"]) if "time_s" in columns else None)
    except RigError as error:
        raise RigError(f"{path}: {error}") from None


def _number(cell: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        raise RigError(f"{where} = {cell.strip()!r}: expected a number") from None
    if not np.isfinite(value):
        raise RigError(f"{where} = {cell.strip()}: expected a finite number")
    return value
