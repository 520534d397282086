"""Real measured records of others, fetched from where they stand, checked, and written as records.

Nothing of them is part of this project. A file is taken at a fixed commit and must have the sha256 of the catalogue,
so that the same name gives the same record for everybody.
"""

from __future__ import annotations

import difflib
import logging
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit
from xml.etree import ElementTree

import numpy as np
import platformdirs
import pooch
import requests
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from hysteresis.arrays import Floats
from hysteresis.record import DriveUnit, Record
from hysteresis.record_file import write_record

Arrays = dict[str, Any]  # fields of a Record, each an array

RAW = "https://raw.githubusercontent.com"
TIMEOUT_S = 10.0
NO_LICENCE = "none came with it; ask its authors before you pass it on"


class FetchError(RuntimeError):
    """A record that cannot be fetched; one line with its name, its place, what failed, its source and licence."""


@dataclass(frozen=True)
class Repository:
    """A public GitHub repository at one commit. ``owner_name`` is "owner/name", ``commit`` has 40 hex digits."""

    owner_name: str
    commit: str
    citation: str
    licence: str = NO_LICENCE


@dataclass(frozen=True)
class Entry:
    """One measured record: the file it is made of, and how.

    ``convert`` reads the upstream file and returns the arrays of a Record by field name; ``sha256`` is that of the
    upstream file; ``geometry`` holds the record's tables ``tube`` and ``notch`` where they are known.
    """

    name: str
    title: str
    repository: Repository
    path: str
    sha256: str
    drive_unit: DriveUnit
    convert: Callable[[Path], Arrays]
    geometry: Mapping[str, Any] = field(default_factory=dict)

    @property
    def citation(self) -> str:
        """What to cite, in words."""
        return self.repository.citation

    @property
    def licence(self) -> str:
        """What is known of the licence of the data."""
        return self.repository.licence

    @property
    def url(self) -> str:
        """Address of the upstream file at the fixed commit."""
        return f"{RAW}/{self.repository.owner_name}/{self.repository.commit}/{quote(self.path)}"


def fetch_record(name: str, folder: Path, *, cache: Path | None = None) -> Path:
    """Fetch a measured record and write it as CSV with its sidecar.

    Parameters
    ----------
    name
        A key of ``CATALOGUE``.
    folder
        Where ``<name>.csv`` and ``<name>.toml`` go; made if it is not there.
    cache
        Where upstream files are kept; by default the user's cache folder. A file that is there is not fetched again.

    Returns
    -------
    Path
        The CSV.

    Raises
    ------
    FetchError
        An unknown name, no connection, a file that is not what the catalogue says.
    RecordError
        A folder that cannot be written to.
    """
    if name not in CATALOGUE:
        raise FetchError(_no_such(name))
    entry = CATALOGUE[name]
    upstream = _download(entry, cache or platformdirs.user_cache_path("notchbend", appauthor=False))
    record = Record(**entry.convert(upstream), title=entry.title, drive_unit=entry.drive_unit, **entry.geometry)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FetchError(f"{folder}: {error.strerror}: expected a folder that can be made") from None
    path = folder / f"{name}.csv"
    write_record(record, path)
    return path


def _no_such(name: str) -> str:
    if name in SOURCES_ONLY:
        return f"{name}: not fetched, it is no bending record; source: {SOURCES_ONLY[name]}"
    near = difflib.get_close_matches(name, CATALOGUE, n=3, cutoff=0.5) or list(CATALOGUE)
    return f"{name}: no such record: expected one of {', '.join(near)}"


def _download(entry: Entry, cache: Path) -> Path:
    pooch.get_logger().setLevel(logging.WARNING)  # it announces every download on standard error
    try:
        return Path(
            pooch.retrieve(
                entry.url,
                known_hash=f"sha256:{entry.sha256}",
                fname=f"{entry.sha256[:12]}-{Path(entry.path).name}",
                path=cache,
                downloader=pooch.HTTPDownloader(timeout=TIMEOUT_S),
            )
        )
    except (OSError, ValueError) as error:
        where = f"{entry.path} of github.com/{entry.repository.owner_name} at {entry.repository.commit[:7]}"
        raise FetchError(
            f"{entry.name}: {_reason(error, entry)}; wanted {where}; source: {entry.citation}; licence: {entry.licence}"
        ) from None


def _reason(error: Exception, entry: Entry) -> str:
    host = urlsplit(entry.url).netloc
    match error:
        case requests.Timeout():
            return f"no answer from {host} within {TIMEOUT_S:g} s"
        case requests.ConnectionError():
            return f"no connection to {host}"
        case requests.HTTPError(response=response) if response is not None:
            return f"{host} answered {response.status_code} {response.reason}"
        case requests.RequestException():
            return f"{type(error).__name__} from {host}"
        case OSError():
            return f"{error.filename}: {error.strerror}"
        case _:  # pooch: the hash differs
            return f"not the file of the catalogue, expected sha256 {entry.sha256[:12]}..."


# --- upstream file -> arrays of a Record -------------------------------------------------------------------------


def _manipulator(path: Path, *, command: int) -> Arrays:
    """Text table: time (s), reference (deg), ..., angle in column 5; some samples were logged twice, time and all."""
    table = np.loadtxt(path, delimiter=",")
    table = table[np.append(True, (np.diff(table, axis=0) != 0).any(axis=1))]
    return {"time_s": table[:, 0], "drive": table[:, command], "angle_deg": table[:, 5]}


def _tool(path: Path) -> Arrays:
    """Table of encoder counts at 1 kHz, averaged by tens: spindle 8192, jaw 4000 a turn (README of the repository)."""
    table = np.loadtxt(path, delimiter=",", comments="%")
    tens = table[: len(table) // 10 * 10].reshape(-1, 10, table.shape[1])
    mean = tens.mean(axis=1)
    return {"time_s": tens[:, 0, 0], "drive": mean[:, 1] * 360 / 8192, "angle_deg": mean[:, 4] * 360 / 4000}


def _catheter(path: Path) -> Arrays:
    """Table of about 500 Hz: time (s), tendon (mm), ..., bending (deg) in column 6; taken to an even 10 ms."""
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    time = np.arange(int(table[-1, 0] / 0.01) + 1) / 100
    drive, angle = (np.interp(time, table[:, 0], table[:, i]) for i in (1, 6))
    return {"time_s": time, "drive": drive, "angle_deg": angle}


def _tendon_robot(path: Path) -> Arrays:
    """Markers along the backbone (mm): bending is the turn of the line from the 10th to the 12th since the start."""
    data = loadmat(path, variable_names=["Time", "Stroke", "Tension", "MarkerDataSynced"])
    line = data["MarkerDataSynced"][:, :, 11] - data["MarkerDataSynced"][:, :, 9]
    line /= np.linalg.norm(line, axis=1)[:, None]
    time = data["Time"][:, 0]
    return {
        "time_s": time - time[0],
        "drive": data["Stroke"][:, 0],
        "tension_a_N": data["Tension"][:, 0],
        "angle_deg": np.degrees(np.arccos(np.clip(line @ line[0], -1.0, 1.0))),
    }


def _wrist(path: Path, *, variable: str) -> Arrays:
    """Cell array (tendon force in N, angles of the notches and of the tip in deg, ...); each trial unloads first."""
    force, angles = loadmat(path, variable_names=[variable], squeeze_me=True)[variable][:2]
    return {
        "drive": force,
        "angle_deg": angles[:, -1],
        "notches_deg": angles[:, :-1],
        "cycle": 1 + np.cumsum(np.diff(force, prepend=force[0]) < -0.5),
    }


def _probe(path: Path) -> Arrays:
    """Workbook: motor steps, and the orientations of tip and base as quaternions (x, y, z, w).

    The angle is the principal component of the rotation vectors of the tip against the base since the first sample,
    less its mean, growing with the steps.
    """
    table = _sheet(path)
    tip, base = (Rotation.from_quat(table[:, first : first + 4]) for first in (6, 13))
    relative = base.inv() * tip
    vectors = np.degrees((relative[0].inv() * relative).as_rotvec())
    vectors -= vectors.mean(axis=0)
    angle = vectors @ np.linalg.svd(vectors, full_matrices=False)[2][0]
    steps = table[:, 1]
    return {"drive": steps, "angle_deg": angle * np.sign((steps - steps.mean()) @ angle)}


def _sheet(path: Path) -> Floats:
    """Numbers below the header of the first sheet of a workbook whose cells are all filled."""
    space = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
    with zipfile.ZipFile(path) as book:
        rows = ElementTree.fromstring(book.read("xl/worksheets/sheet1.xml")).iter(f"{space}row")
    return np.array([[float(value.text or "nan") for value in row.iter(f"{space}v")] for row in list(rows)[1:]])


# --- the catalogue ------------------------------------------------------------------------------------------------

_PROBE = Repository(
    "bfortuno/TEE-Probe_hysteresis_id",
    "dba400e6781bcd12a9f02a19bebc2f0610c4793c",
    "B. Fortuno, TEE-Probe_hysteresis_id, GitHub bfortuno/TEE-Probe_hysteresis_id, commit dba400e",
)
_MANIPULATOR = Repository(
    "nhoyh/hysteresis_compensation_ROS",
    "7c00843fba4d03cbe67da9244237019a9057799e",
    "ViO-Com: Feed-forward compensation using vision-based optimization for high-precision surgical manipulation, "
    "IEEE RA-L 2021, document 9591437; GitHub nhoyh/hysteresis_compensation_ROS, commit 7c00843",
)
_TOOL = Repository(
    "MRDLab/mis-tool-characterization",
    "03658b2ccefef9adceebc38dd4a17bd6e190cd2e",
    "J. J. O'Neill, T. K. Stephens, T. M. Kowalewski, IEEE RA-L 3(4), 3027-3034, 2018, "
    "doi 10.1109/LRA.2018.2849862; GitHub MRDLab/mis-tool-characterization, commit 03658b2",
    "Open Database License 1.0, contents under the Database Contents License",
)
_CATHETER = Repository(
    "wy-yuan/hysteresis-fnn-lstm",
    "2277c2f90430f71104a3c29eec108d9a7b996742",
    "Wang et al., arXiv 2404.07168; GitHub wy-yuan/hysteresis-fnn-lstm, commit 2277c2f",
)
_WRIST = Repository(
    "nepacheco/MastersThesis",
    "4f920c7f87d5a0e1d06ea6b91ac30d3dc4ee5eef",
    "GitHub nepacheco/MastersThesis, commit 4f920c7",
)


def _davinci(file: str, load: int, rate: str, sha256: str) -> Entry:
    name = f"davinci-tool-load{load:03d}-{rate}hz"
    title = f"da Vinci Maryland tool, jaw load {load} %, {rate} Hz"
    return Entry(name, title, _TOOL, f"data/Tool_4_Maryland_L_4/{file}.TXT", sha256, "deg", _tool)


def _decaying(file: str, kind: str, rate: str, sha256: str) -> Entry:
    course = {"taut": "about a mean", "slack": "back to zero"}[kind]
    title = f"Tendon catheter, decaying sine, {course}, {rate} Hz"
    path = f"tendon_data/20230928/all_data/data_{file}.txt"
    return Entry(f"catheter-{kind}-{rate}hz", title, _CATHETER, path, sha256, "mm", _catheter)


def _load_cell(file: str, course: str, sha256: str) -> Entry:
    title = f"Tendon robot with load cell, {course}"
    path = f"tendon_data/Frequency_Trials/{file}.mat"
    return Entry(f"tendon-robot-{course}", title, _CATHETER, path, sha256, "mm", _tendon_robot)


def _notched(tube: str, width_mm: float, spacing_mm: float) -> Entry:
    notch = {"shape": "rectangular", "count": 5, "depth_mm": 1.40, "width_mm": width_mm, "spacing_mm": spacing_mm}
    return Entry(
        f"notched-wrist-{tube}",
        f"Notched NiTi wrist, {tube} degree tube",
        _WRIST,
        "matlab.mat",
        "78e4d3c09eb50ee96003b3f57c72ece71bb3c26ac4e1461ce8c421d7130c439b",
        "N",
        partial(_wrist, variable=f"experimentData{tube}"),
        {"tube": {"outer_diameter_mm": 1.62, "inner_diameter_mm": 1.40}, "notch": notch},
    )


_ENTRIES = (
    Entry(
        "tee-probe-antero-posterior",
        "TEE probe, antero-posterior",
        _PROBE,
        "matlab/Calibration/motor2_current60.xlsx",
        "398d0c64e14d1476f88dac8808dc08166cdd8d79cdb94d8d76ff2fd441f2f3fb",
        "step",
        _probe,
    ),
    Entry(
        "surgical-manipulator-0-80",
        "Surgical manipulator, sine 0-80 deg",
        _MANIPULATOR,
        "operation/optimizer_input/test0224.txt",
        "e80e95d319053cbe4ac49a995aeb6fb44313d40b8885ccbfe1b921c3d233b9a8",
        "deg",
        partial(_manipulator, command=1),
    ),
    Entry(
        "surgical-manipulator-feedforward",
        "Surgical manipulator, feed-forward compensated command",
        _MANIPULATOR,
        "operation/optimizer_input/aurora_ff.txt",
        "322f94c7c96289c1afccd2728fc9e273903cc3a64f4d8f4f1e2dd0b2401ec889",
        "deg",
        partial(_manipulator, command=6),
    ),
    _davinci("00", 10, "0.1", "796f89cb5e4469d590ae78db7a2a504ca0673f939c0255c00b1421b70d05ce62"),
    _davinci("20", 10, "0.3", "d0aa041646c41814486609407f853889a57738f782c102c26cb7dd0da6970cec"),
    _davinci("04", 50, "0.1", "48cbd949a66420f20ce3f000c3be2d4cfc97c1c77535317746aa161683ee4736"),
    _davinci("24", 50, "0.3", "2edc7e3f81f9d41c291fd7c262f0e7b9a28c344b21f73d89b9c82e562aa3317e"),
    _davinci("09", 100, "0.1", "741b6c4986201b6cbf8c84748288685e38b6768079bcbe72f934ba67774b472b"),
    _davinci("29", 100, "0.3", "5c4990a390589ca5d548364cb87d1e8acb7770e99cc028d1a4869692f5dd4610"),
    _decaying("1_1", "taut", "0.1", "d3f32271e32143708373a56894009cd392361157f422f84d900c6c83f5be453b"),
    _decaying("1_2", "taut", "0.2", "48fa4255c878874126acdced2d07a913802c20090bde44c5a66608eff602c558"),
    _decaying("1_3", "taut", "0.3", "0ebfb2e9d66c27fcbcc653e8a9b336fd1d9cd00b70c5ecb67d282a5981557054"),
    _decaying("1_5", "taut", "0.5", "e45ed9ed3e44a4ca3559ef1bac6a00e6854c9cf9a12cefb6cee9d7cb4b9b7d74"),
    _decaying("2_1", "slack", "0.1", "3a4a22e019f399cfd54671cef6a799b3fb77c4fa8a63ebd100e16b7822de99ab"),
    _decaying("2_3", "slack", "0.3", "cd420a8437b37e502a53ad6847ec90ac6a12a1fd6f7d75c3c08a02516bda2121"),
    _load_cell("f002_data_2", "mean-0.02hz", "1250338ea7eac9bc9f9a5be6badfc23a1fdf629d58e84bf222d3c13a1819f98d"),
    _load_cell("f010_data", "zero-0.10hz", "c9400d2491f60faa3b874999164412b02166c983b9ba8570326a33aed24a3f10"),
    _load_cell("f015_data", "zero-0.15hz", "f899d81e4ad9cf92c3fe527b601e4ab0da10bb0e451292adc9870544af3ab942"),
    _load_cell("f020_data", "zero-0.20hz", "37a95f42823abeb269c4aeb7283ace816e7d65a08fdac1ad7b0cff82a5410395"),
    _load_cell("f030_data", "zero-0.30hz", "3177a506d8b528a7238e5fe11b3e51693a7181c354c211db7a3a621b4c6d925c"),
    _notched("90", 0.5, 1.5),
    _notched("150", 0.8, 1.2),
)
CATALOGUE: dict[str, Entry] = {entry.name: entry for entry in _ENTRIES}

# Measured data worth knowing that make no bending record.
SOURCES_ONLY: dict[str, str] = {
    "niti-diamond": "superelastic NiTi specimen, extension against force: GitHub confluentmedical/nitinol-bayes-cal, "
    "commit e233ba6, Apache-2.0; doi 10.1016/j.commatsci.2021.110357",
}
