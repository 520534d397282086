"""Files of measured data as their authors published them, read into the columns of a record."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from hysteresis.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class Samples:
    """Columns of a :class:`hysteresis.records.record.Record`, by the names of its fields; (m,) and (m, notches)."""

    drive: Floats
    angle_deg: Floats
    time_s: Floats | None = None
    tension_a_N: Floats | None = None
    notches_deg: Floats | None = None
    cycle: Ints | None = None


def manipulator(path: Path, *, command: int) -> Samples:
    """Read a text table: time (s), reference (deg), ..., angle (deg) in column 5; the drive is column ``command``.

    Of samples at one time the first is kept. All from where the clock begins anew are dropped: the motor stands still
    there.
    """
    table = np.loadtxt(path, delimiter=",")
    steps = np.diff(table[:, 0])
    table = table[: np.append(np.flatnonzero(steps < 0) + 1, len(table))[0]]
    table = table[np.append(True, np.diff(table[:, 0]) > 0)]
    return Samples(time_s=table[:, 0], drive=table[:, command], angle_deg=table[:, 5])


def tool(path: Path) -> Samples:
    """Read encoder counts at 1 kHz and average ten at a time.

    A revolution has 8192 counts on the spindle and 4000 on the jaw (README of the repository).
    """
    table = np.loadtxt(path, delimiter=",", comments="%")
    tens = table[: len(table) // 10 * 10].reshape(-1, 10, table.shape[1])
    mean = tens.mean(axis=1)
    return Samples(time_s=tens[:, 0, 0], drive=mean[:, 1] * 360 / 8192, angle_deg=mean[:, 4] * 360 / 4000)


def catheter(path: Path) -> Samples:
    """Read a table at about 500 Hz: time (s), tendon (mm), ..., bending (deg) in column 6; resample it at 10 ms."""
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    time = np.arange(int(table[-1, 0] / 0.01) + 1) / 100
    drive, angle = (np.interp(time, table[:, 0], table[:, i]) for i in (1, 6))
    return Samples(time_s=time, drive=drive, angle_deg=angle)


def tendon_robot(path: Path) -> Samples:
    """Read markers along the backbone (mm).

    The bending angle is the rotation, since the start, of the line from the 10th to the 12th marker.
    """
    data = loadmat(path, variable_names=["Time", "Stroke", "Tension", "MarkerDataSynced"])
    line = data["MarkerDataSynced"][:, :, 11] - data["MarkerDataSynced"][:, :, 9]
    line /= np.linalg.norm(line, axis=1)[:, None]
    time = data["Time"][:, 0]
    return Samples(
        time_s=time - time[0],
        drive=data["Stroke"][:, 0],
        tension_a_N=data["Tension"][:, 0],
        angle_deg=np.degrees(np.arccos(np.clip(line @ line[0], -1.0, 1.0))),
    )


def wrist(path: Path, *, variable: str) -> Samples:
    """Read a cell array: tendon force (N), angles of the notches and of the tip (deg), ...; a trial starts unloaded."""
    force, angles = loadmat(path, variable_names=[variable], squeeze_me=True)[variable][:2]
    return Samples(
        drive=force,
        angle_deg=angles[:, -1],
        notches_deg=angles[:, :-1],
        cycle=1 + np.cumsum(np.diff(force, prepend=force[0]) < -0.5),
    )


def probe(path: Path) -> Samples:
    """Read a workbook: motor steps, and the orientations of tip and base as quaternions (x, y, z, w).

    The angle is the principal component of the rotation vectors of the tip relative to the base since the first
    sample, less its mean, with the sign that makes it increase with the steps.
    """
    table = _sheet(path)
    tip, base = (Rotation.from_quat(table[:, first : first + 4]) for first in (6, 13))
    relative = base.inv() * tip
    vectors = np.degrees((relative[0].inv() * relative).as_rotvec())
    vectors -= vectors.mean(axis=0)
    angle = vectors @ np.linalg.svd(vectors, full_matrices=False)[2][0]
    steps = table[:, 1]
    return Samples(drive=steps, angle_deg=angle * np.sign((steps - steps.mean()) @ angle))


def _sheet(path: Path) -> Floats:
    """Read the numbers below the header of the first sheet of a workbook whose cells are all filled."""
    space = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
    with zipfile.ZipFile(path) as book:
        rows = ElementTree.fromstring(book.read("xl/worksheets/sheet1.xml")).iter(f"{space}row")
    return np.array([[float(value.text or "nan") for value in row.iter(f"{space}v")] for row in list(rows)[1:]])
