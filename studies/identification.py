"""Identification of the hysteresis layer on a record, with the best base that the record allows."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem_models.bench import rig_of
from fem_models.checks import RigError
from fem_models.kinematics import theory_curve
from hysteresis.backbone import Kinematics
from hysteresis.files import write_files
from hysteresis.holdout import hold_out
from hysteresis.identify import Fit, identify
from hysteresis.path import require_reversal
from hysteresis.record import Record, RecordError
from studies.progress import bar

STANDSTILL_DEG = 1e-9  # no sensor tells such angles apart


def identify_record(record: Record, *, seed: int = 0, use_rig: bool = True, progress: bool = False) -> Fit:
    """Identify the layer with the best base that the record allows: user's theory, analytic rig, or a fitted f.

    Raises
    ------
    RecordError, RigError
        A record that makes no loop, or a rig that cannot be or cannot follow its drive; one line with the file.
    """
    base = _analytic(record) if use_rig else None
    _require_moving(record)
    with bar(progress) as shown:
        task = shown.add_task("searching", total=None)
        return identify(
            record, base, seed=seed, progress=lambda done, total: shown.update(task, completed=done, total=total)
        )


def _require_moving(record: Record) -> None:
    """Refuse a record whose angle stands still in all that is fitted, or in all that judges the fit."""
    require_reversal(record)
    split = hold_out(record)
    for name, mask in (("to fit", split.train), ("held out", split.heldout)):
        angle = record.angle_deg[mask]
        if angle.size and np.ptp(angle) < STANDSTILL_DEG:
            found = f"angle = {angle[0]:g} deg in all {angle.size} samples {name}"
            raise RecordError(f"{record.source or record.title}: {found}: expected an angle that changes")


def _analytic(record: Record) -> Kinematics | None:
    rig = rig_of(record)  # checks the sidecar's geometry even where the user's own theory is taken
    if rig is None or record.kinematics is not None:
        return None

    def angle_deg(drive: NDArray[np.float64]) -> NDArray[np.float64]:
        try:
            return theory_curve(rig, drive).angle_deg
        except RigError as error:
            if record.drive_unit != "mm":  # the gain is searched for: one that drives the rig too far is no candidate
                return np.full(drive.shape, np.nan)
            raise RigError(f"{record.source or record.title}: {error}") from None

    return angle_deg


def write_fit(fit: Fit, record: Record, out: Path, stem: str) -> None:
    """Write ``STEM.json`` (the contract's identify.json) and ``STEM.csv`` (sample by sample, f alone and with h)."""
    columns = (
        record.drive, record.angle_deg, fit.plain(record.drive), fit.predict(record.drive), fit.heldout_mask.astype(int)
    )  # fmt: skip
    rows = zip(*(column.tolist() for column in columns), strict=True)
    lines = ["drive,angle_deg,f_alone_deg,predicted_deg,heldout", *(",".join(map(repr, row)) for row in rows)]
    text = json.dumps(fit.to_dict(), indent=2) + "\n"
    write_files({out / f"{stem}.json": text, out / f"{stem}.csv": "\n".join(lines) + "\n"})
