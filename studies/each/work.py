"""Fit many records, each by itself, in processes: the same result whatever their number."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits

from hysteresis import Fit
from hysteresis.fitting.response import is_fixed
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.messages import failure
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_records
from studies.commands.identification import identify_records
from studies.design.workers import crew
from studies.each.result import EachResult, FittedDevice

_PART = 4
"""Records that a worker fits at a time: progress is steady, and a slow record holds up little."""
ENDED = "the process that fitted it was ended: expected a record that can be fitted in the memory of this machine"


@dataclass(frozen=True)
class EachSettings:
    """How every record is fitted: settings, whether the rig of a record is used, and which bending plane it is."""

    identify: IdentifySettings
    use_rig: bool = True
    plane: int = 1


def records_of(folder: Path, leave_out: Sequence[Path] = ()) -> list[Path]:
    """Give the CSV files of a folder in the order of their names, but for theories and for some others.

    Raises
    ------
    RecordError
        No folder, or one without a CSV.
    """
    if not folder.is_dir():
        raise RecordError(f"{folder}: expected a folder of records")
    files = sorted(
        path for path in folder.iterdir() if path.suffix.lower() == ".csv" and (path.is_file() or path.is_symlink())
    )
    others = {path.resolve() for path in leave_out}
    out = [path for path in files if not path.stem.endswith(".kinematics") and path.resolve() not in others]
    if not out:
        raise RecordError(f"{folder}: no CSV in it: expected a folder of records")
    return out


def fit_each(
    records: Sequence[Record | Path],
    settings: EachSettings,
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> EachResult:
    """Fit records, each by itself.

    Parameters
    ----------
    records
        Records, or the paths of their CSV, which are read by the workers.
    workers
        Processes; by default one a core.
    progress
        Called with (records done, records in all).

    Returns
    -------
    EachResult
        In the order of the records. One that cannot be read or fitted has its ``problem``.
    """
    parts = [records[k : k + _PART] for k in range(0, len(records), _PART)]
    found = list[FittedDevice]()
    for part in _done(parts, partial(_fit_part, settings), min(workers or os.cpu_count() or 1, len(parts))):
        found += part
        progress(len(found), len(records))
    return EachResult(tuple(found))


Part = Sequence[Record | Path]


def _done(
    parts: Sequence[Part], work: Callable[[Part], list[FittedDevice]], workers: int
) -> Iterator[list[FittedDevice]]:
    """Give the result of each part in order; where a worker ends, the parts behind are fitted one by one."""
    count = 0
    try:
        with crew(workers) as staff:
            for found in map(work, parts) if staff.pool is None else staff.pool.map(work, parts):
                count += 1
                yield found
    except BrokenExecutor:
        for part in parts[count:]:
            yield [device for one in part for device in _alone(one, work)]


def _alone(one: Record | Path, work: Callable[[Part], list[FittedDevice]]) -> list[FittedDevice]:
    """Fit one record in a process of its own."""
    try:
        with crew(2) as staff:
            assert staff.pool is not None
            return staff.pool.submit(work, [one]).result()
    except BrokenExecutor:
        return [FittedDevice(_name(one), problem=ENDED)]


def _name(one: Record | Path) -> str:
    return one.source or one.title or "record" if isinstance(one, Record) else str(one)


def _fit_part(settings: EachSettings, part: Part) -> list[FittedDevice]:
    with threadpool_limits(1, user_api="blas"):  # sums do not depend on the cores of the machine
        return [_fit_one(settings, one) for one in part]


def _fit_one(settings: EachSettings, one: Record | Path) -> FittedDevice:
    """Fit one record; any error is its problem: hundreds of others stand beside it."""
    try:
        record = one if isinstance(one, Record) else read_records([one], settings.plane)[0]
        return _device(_name(one), identify_records([record], settings=settings.identify, use_rig=settings.use_rig))
    except Exception as error:
        return FittedDevice(_name(one), problem=failure(error).removeprefix(f"{_name(one)}: "))


def _device(name: str, fit: Fit) -> FittedDevice:
    parameters = {"saturation_deg": fit.saturation_deg} | fit.layer | fit.parameters
    return FittedDevice(
        record=name,
        law=fit.form.base_law.name,
        parameters=parameters,
        fixed=tuple(one for one in parameters if fit.point.sign and is_fixed(one, parameters)),
        heldout_rmse_deg=fit.heldout.rmse_deg,
        noise_deg=fit.noise_floor_deg,
        words=(*fit.notes, *fit.warnings),
    )
