"""The compensator that an ``identify.json`` describes: its law, its f, and what its head says of it."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from hysteresis.arrays import Floats
from hysteresis.files import RecordError, read_bytes
from hysteresis.laws.inverse import UnreachableError, compensating_drive, inverse_curve
from hysteresis.messages import quoted
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record
from studies.commands.compensation import Layer, read_layer
from studies.results import read_result
from studies.results.fit import WHAT, StoredFit, StoredModel

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,29}")


@dataclass(frozen=True, eq=False)
class Compensator:
    """An identified law whose f has an inverse.

    ``drive`` and ``angle_deg``, shapes (k,), are the places of f, and ``slope`` is that of the monotone cubic there,
    deg for each unit of the drive. ``checksum`` is the SHA-256 of the file. ``seen`` are those of the records that
    still lie where the file says.
    """

    name: str
    layer: Layer
    fit: StoredFit
    drive: Floats
    angle_deg: Floats
    slope: Floats
    checksum: str
    seen: tuple[Record, ...]

    @property
    def unit(self) -> str:
        """Unit of the drive: mm, deg, step or N."""
        return self.layer.drive_unit

    @property
    def saturation_deg(self) -> float:
        """Largest sum of abs(h)."""
        return sum(element.saturation_deg for element in self.layer.elements)


def read_compensator(fit: Path, name: str) -> Compensator:
    """Read an ``identify.json``, or that of a folder.

    Parameters
    ----------
    fit
        The file or its folder.
    name
        What files and functions are called: a letter, then up to 29 letters, digits and underscores.

    Raises
    ------
    RecordError
        A name of another form, a file that is none of a fit, or an f without inverse; one line.
    """
    if not _NAME.fullmatch(name):
        expected = "a letter, then up to 29 letters, digits and underscores"
        raise RecordError(f"--name {quoted(name, 40)}: expected {expected}")
    path = fit / "identify.json" if fit.is_dir() else fit
    stored, layer = read_result(StoredFit, path, WHAT), read_layer(path)
    model = read_result(StoredModel, path, WHAT)
    places = model.f if model.law is None else model.law.f
    if not layer.elements:
        raise RecordError(f"{path}: law: values = []: expected a row for each element")
    _require_inverse(path, layer)
    return Compensator(
        name=name,
        layer=layer,
        fit=stored,
        drive=places.drive,
        angle_deg=places.angle_deg,
        slope=PchipInterpolator(places.drive, places.angle_deg).derivative()(places.drive),
        checksum=hashlib.sha256(read_bytes(path, WHAT)).hexdigest(),
        seen=tuple(_seen(stored.records, path.parent, layer.drive_range)),
    )


def _require_inverse(path: Path, layer: Layer) -> None:
    """Refuse an f that is not monotone over the drives, or a law that is not admissible."""
    low, high = layer.drive_range
    if not low <= layer.first_drive <= high:
        raise RecordError(f"{path}: first_drive = {layer.first_drive:g}: expected within f, {low:g} to {high:g}")
    try:
        start = layer.f(np.array([layer.first_drive]))
        inverse_curve(layer.f, start, layer.drive_range)
        if any(element.saturation_deg for element in layer.elements):
            compensating_drive(layer, start + sum(one.along(start) for one in layer.elements), layer.first_drive)
    except UnreachableError as error:
        raise RecordError(f"{path}: f: {error}") from None
    except ValueError as error:
        raise RecordError(f"{path}: {error}") from None


def _seen(names: tuple[str, ...], folder: Path, drive_range: tuple[float, float]) -> list[Record]:
    """Read those of the records that still lie where they were, or beside the file, and whose drives are those of f."""
    found = []
    for name in names:
        path = next((one for one in (Path(name), folder / name) if "\0" not in name and one.is_file()), None)
        if path is None:
            continue
        try:
            record = read_record(path)
        except RecordError:  # a file of another content by now
            continue
        slack = 1e-6 * (drive_range[1] - drive_range[0])
        if record.drive.min() >= drive_range[0] - slack and record.drive.max() <= drive_range[1] + slack:
            found.append(record)
    return found
