"""The drive that makes an angle follow a reference: the work of ``notchbend compensate``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from hysteresis import Fit
from hysteresis.arrays import Floats
from hysteresis.files import write_files
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.laws.elements import Element, elements_of
from hysteresis.laws.inverse import UnreachableError, compensating_drive, uncompensated_drive
from hysteresis.own import MAKER
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_columns, read_records
from hysteresis.records.sidecar import toml
from studies.commands.identification import identify_records
from studies.own_rig.new_record import unlike_loops
from studies.results import read_result
from studies.results.compensation import CompensationSummary as CompensationSummary
from studies.results.fit import WHAT, StoredModel


def read_reference(path: Path) -> dict[str, Floats]:
    """Read the angles to follow: a CSV with angle_deg and, optionally, time_s.

    Raises
    ------
    RecordError
        One line with file, line, column, value and what was expected.
    """
    columns = read_columns(path, ["angle_deg"], optional=["time_s"])
    if not columns["angle_deg"].size:
        raise RecordError(f"{path}: no row below the header: expected the angles to follow")
    times = columns.get("time_s")
    if times is not None and (steps := np.diff(times) <= 0).any():
        line = int(np.argmax(steps)) + 3
        raise RecordError(f"{path}:{line}: column 'time_s' = {times[line - 2]:g}: expected times that increase")
    return columns


@dataclass(frozen=True, eq=False)
class Layer:
    """An identified hysteresis layer, with what the summary says of it."""

    source: str
    elements: Sequence[Element]
    f: Callable[[Floats], Floats]
    plain: Callable[[Floats], Floats]
    drive_range: tuple[float, float]
    drive_unit: str
    first_drive: float
    delay_s: float
    heldout_rmse_deg: float
    without_hysteresis_rmse_deg: float
    warnings: tuple[str, ...]


def known_layer(source: Path, *, settings: IdentifySettings, progress: bool) -> Layer:
    """Identify a record, with f fitted to it, or read an ``identify.json`` (any name that ends in .json).

    Raises
    ------
    RecordError
        A record that makes no loop, or a file that is neither; one line.
    """
    if source.suffix.lower() == ".json":
        return read_layer(source)
    record = read_records([source])[0]
    layer = layer_of(identify_records([record], settings=settings, use_rig=False, progress=progress))
    return replace(layer, warnings=(*layer.warnings, *unlike_loops([record])))


def layer_of(fit: Fit) -> Layer:
    """Make the layer of the first record of a fit."""
    return Layer(
        source=f"the record {fit.records[0]}",
        elements=fit.elements,
        f=fit.f,
        plain=fit.plain,
        drive_range=fit.drive_range,
        drive_unit=fit.drive_unit,
        first_drive=fit.first_drive,
        delay_s=fit.delay_s,
        heldout_rmse_deg=fit.heldout.rmse_deg,
        without_hysteresis_rmse_deg=fit.baseline_heldout.rmse_deg,
        warnings=(*fit.notes, *fit.warnings),
    )


def read_layer(path: Path) -> Layer:
    """Read an identify.json; between its samples f is interpolated by a monotone cubic (PCHIP).

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    stored = read_result(StoredModel, path, WHAT)
    if not 1 <= stored.elements <= 2:
        raise RecordError(f"{path}: elements = {stored.elements}: expected 1 or 2")
    law, curves = stored.law, stored.f if stored.law is None else stored.law.f
    try:
        return Layer(
            source=str(path),
            elements=_bouc_wen(stored) if law is None else elements_of(law.name, law.sign, law.values, law.place),
            f=PchipInterpolator(curves.drive, curves.angle_deg),
            plain=PchipInterpolator(stored.f.drive, stored.f.without_hysteresis_deg),
            drive_range=(float(curves.drive[0]), float(curves.drive[-1])),
            drive_unit=stored.drive_unit,
            first_drive=stored.first_drive,
            delay_s=_delay_s(stored),
            heldout_rmse_deg=(stored if law is None else law).heldout.rmse_deg,
            without_hysteresis_rmse_deg=stored.baseline.heldout.rmse_deg,
            warnings=(stored if law is None else law).warnings,
        )
    except KeyError as error:
        raise RecordError(f"{path}: parameters: {error.args[0]}: missing: expected {WHAT}") from None
    except (ValueError, IndexError, OverflowError) as error:
        raise RecordError(f"{path}: {error}: expected {WHAT}") from None


def _bouc_wen(stored: StoredModel) -> list[Element]:
    suffixes = ["", *(f"_{i}" for i in range(2, stored.elements + 1))]
    names = ("A", "beta", "gamma", "n", "h0_deg")
    return [BoucWen(*(stored.parameters[name + suffix].value for name in names)) for suffix in suffixes]


def _delay_s(stored: StoredModel) -> float:
    if stored.law is not None:
        return stored.law.delay_s
    return stored.parameters["delay_s"].value if "delay_s" in stored.parameters else 0.0


def compensated(
    layer: Layer, reference: Mapping[str, Floats], where: str
) -> tuple[dict[str, Floats], CompensationSummary]:
    """Invert a layer.

    Returns
    -------
    columns
        Of the file to write: the drive in the unit of the record, the angle to follow, and the times, if any. Where the
        angle lags the drive by a delay, the times are that much earlier, and the angles those of these times.
    summary
        Errors of the layer, and how much it changes the drive.

    Raises
    ------
    RecordError
        A reference beyond the range of the layer, one without times where the layer has a delay, or a layer that has no
        inverse; one line.
    """
    wanted = reference["angle_deg"]
    if layer.delay_s > 0 and "time_s" not in reference:
        found = f"the angle is {layer.delay_s:.3g} s behind the drive by {layer.source}"
        raise RecordError(f"{where}: column 'time_s': missing: {found}: expected the times of the angles")
    try:
        drive = compensating_drive(layer, wanted, layer.first_drive)
        plain = uncompensated_drive(layer, np.clip(wanted, *np.sort(layer.plain(np.array(layer.drive_range)))))
    except UnreachableError as error:
        reach = sum(model.saturation_deg for model in layer.elements)
        low, high = np.sort(layer.f(np.array(layer.drive_range))) + np.array([1, -1]) * reach
        found = f"column 'angle_deg' = {wanted[error.sample]:g}"
        raise RecordError(
            f"{where}:{error.sample + 2}: {found}: beyond {layer.source}: "
            f"expected within about {low:.3g} to {high:.3g} deg"
        ) from None
    except ValueError as error:
        raise RecordError(f"{where}: by {layer.source}: {error}") from None
    times, angle = {}, wanted
    if "time_s" in reference:
        times = {"time_s": reference["time_s"] - layer.delay_s}
        angle = np.interp(times["time_s"], reference["time_s"], wanted)
    summary = CompensationSummary(
        schema=1,
        samples=int(wanted.size),
        heldout_rmse_deg=layer.heldout_rmse_deg,
        without_hysteresis_rmse_deg=layer.without_hysteresis_rmse_deg,
        largest_correction=float(np.abs(drive - plain).max()),
        drive_unit=layer.drive_unit,
        warnings=layer.warnings,
        delay_s=layer.delay_s,
    )
    return times | {f"drive_{layer.drive_unit}": drive, "angle_deg": angle}, summary


def write_columns(columns: Mapping[str, Floats], path: Path) -> None:
    """Write columns of numbers as a CSV with its sidecar, a record of what the layer predicts; all or none."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    text = "\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows)]) + "\n"
    drive = next(name for name in columns if name.startswith("drive_"))
    unit = drive.removeprefix("drive_")
    key, table = ("force", {}) if unit == "N" else ("drive", {"drive": {"unit": unit}})
    roles = {key: drive, "angle": "angle_deg"} | ({"time": "time_s"} if "time_s" in columns else {})
    head = {"schema": 1, "title": f"Drive that compensates: {path.stem}", "kind": "simulated", "maker": MAKER}
    write_files({path.with_suffix(".toml"): toml({**head, "columns": roles, **table}), path: text})
