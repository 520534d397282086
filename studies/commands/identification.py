"""Identification of the hysteresis layer on the best kinematics that the records allow, and the files of a fit."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fem_models.analytic import theory_curve
from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.of_record import bends_in_space, rig_in_space_of, rig_of
from hysteresis import Fit, identify
from hysteresis.arrays import Floats
from hysteresis.files import write_files
from hysteresis.fitting.settings import DEFAULTS, IdentifySettings
from hysteresis.laws.backbone import Kinematics
from hysteresis.own import marked_values
from hysteresis.records.holdout import hold_out
from hysteresis.records.path import require_reversal
from hysteresis.records.planes import require_one_wheel
from hysteresis.records.record import Record, RecordError
from studies.progress import bar
from studies.results.made import Made, made_entry

STANDSTILL_DEG = 1e-9  # below the resolution of any sensor


def identify_records(
    records: Sequence[Record],
    *,
    settings: IdentifySettings = DEFAULTS,
    use_rig: bool = True,
    progress: bool = False,
) -> Fit:
    """Identify the hysteresis of records on the best kinematics that they allow.

    That is the user's own theory, the analytic model of the rig, of a rig in space its chain without friction and loop,
    or a curve that is fitted. Several records are fitted jointly; if one of them has neither rig nor theory, the curve
    is fitted. With ``use_rig`` False the rig is ignored.

    Raises
    ------
    RecordError, RigError
        A record that makes no loop, or a rig that is not possible or cannot follow the drive; one line with the file.
    """
    models = [_analytic(record) if use_rig else None for record in records]
    known = [model for model in models if model is not None]
    in_space = use_rig and any(map(bends_in_space, records))
    for record in records:
        _require_moving(record)
    with bar(progress) as shown:
        task = shown.add_task("searching", total=None)
        return identify(
            records,
            known if len(known) == len(records) else None,
            kinematics="chain" if in_space else "analytic",
            settings=settings,
            progress=lambda done, total: shown.update(task, completed=done, total=total),
        )


def _require_moving(record: Record) -> None:
    """Refuse a record whose angle is constant over all fitted samples, or over all held-out ones."""
    require_reversal(record)
    split = hold_out(record)
    for name, mask in (("to fit", split.train), ("held out", split.heldout)):
        angle = record.angle_deg[mask]
        if angle.size and np.ptp(angle) < STANDSTILL_DEG:
            found = f"angle = {angle[0]:g} deg in all {angle.size} samples {name}"
            raise RecordError(f"{record.source or record.title}: {found}: expected an angle that changes")


def _analytic(record: Record) -> Kinematics | None:
    """Give the kinematics of a record's rig; None without a rig, or with a theory of the user's own."""
    if bends_in_space(record):
        return _in_space(record)
    rig = rig_of(record)  # checks the geometry in the sidecar even if the user's own theory is used
    if rig is None or record.kinematics is not None:
        return None

    def angle_deg(drive: Floats) -> Floats:
        try:
            return theory_curve(rig, drive).angle_deg
        except RigError as error:
            if record.drive_unit != "mm":  # the gain is unknown: one that drives the rig too far is no candidate
                return np.full(drive.shape, np.nan)
            raise RigError(f"{record.source or record.title}: {error}") from None

    return angle_deg


def _in_space(record: Record) -> Kinematics | None:
    """Give the chain in space without friction; None of a drive whose gain is unknown, or of a force."""
    rig = rig_in_space_of(record)
    if record.kinematics is not None or record.drive_unit != "mm":
        return None
    if record.plane == 1:
        require_one_wheel(record)
    from fem_models.spatial.motion.backbone import plane_backbone  # compiled kernels

    where = record.source or record.title
    others = [record.drive_2, record.drive_3, record.drive_4]  # each stands still
    places = [0.0, *(0.0 if drive is None else float(drive[0]) for drive in others)]
    if record.plane == 2:
        places[:2] = places[1::-1]
    moved = sum(drive is not None for drive in others) + 1
    if moved > rig.wheel_count:
        raise RigError(f"{where}: {moved} wheels: expected the {rig.wheel_count} of rig {rig.name}")
    try:
        backbone = plane_backbone(rig, record.plane, places[: rig.wheel_count])
    except RigError as error:
        raise RigError(f"{where}: {error}") from None

    def angle_deg(drive: Floats) -> Floats:
        try:
            return backbone(drive)
        except (RigError, SolverError) as error:
            raise RigError(f"{where}: {error}") from None

    return angle_deg


def files_of_fit(out: Path, stem: str, records: int) -> list[Path]:
    """Give the files of :func:`write_fit`: ``STEM.json``, ``STEM.csv``, and ``STEM-2.csv`` on for further records."""
    return [out / f"{stem}.json", *(out / f"{stem}{f'-{i + 1}' if i else ''}.csv" for i in range(records))]


def write_fit(
    fit: Fit,
    records: Sequence[Record],
    out: Path,
    stem: str,
    *,
    made: Made | None = None,
) -> None:
    """Write the JSON file of a fit, and for each record a CSV with f alone and with h at every sample; all or none.

    ``predicted_deg`` is by the Bouc-Wen layer. If the fit has another law, ``predicted_by_law_deg`` is by that law.
    """
    texts = [json.dumps(marked_values(fit.to_dict() | made_entry(made)), indent=2) + "\n"]
    layer = fit.bouc_wen or fit
    for i, record in enumerate(records):
        columns = {
            "drive": record.drive,
            "angle_deg": record.angle_deg,
            "f_alone_deg": layer.plain(record.drive, i),
            "predicted_deg": layer.predict(record.drive, record.time_s, i),
            "heldout": fit.heldout_masks[i].astype(int),
        }
        if fit.bouc_wen is not None:
            columns["predicted_by_law_deg"] = fit.predict(record.drive, record.time_s, i)
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
        texts.append("\n".join(lines) + "\n")
    write_files(dict(zip(files_of_fit(out, stem, len(records)), texts, strict=True)))
