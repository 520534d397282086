"""The catalogue of measured records that can be fetched: where each file stands, its checksum, how it is read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from urllib.parse import quote

from hysteresis.records.record import DriveUnit
from studies.fetch.upstream import Samples, catheter, manipulator, probe, tendon_robot, tool, wrist

NO_LICENCE = "none came with it; ask its authors before you pass it on"

Table = Mapping[str, float | str]


@dataclass(frozen=True)
class Repository:
    """A public GitHub repository at one commit. ``owner_name`` is "owner/name", ``commit`` has 40 hex digits."""

    owner_name: str
    commit: str
    citation: str
    licence: str = NO_LICENCE


@dataclass(frozen=True)
class Entry:
    """One measured record: the file that it is made from, and how.

    ``read`` reads the upstream file; ``sha256`` is the checksum of that file; ``tube`` and ``notch`` are
    the record's tables of these names, empty where the geometry is not known.
    """

    name: str
    title: str
    repository: Repository
    path: str
    sha256: str
    drive_unit: DriveUnit
    read: Callable[[Path], Samples]
    tube: Table = field(default_factory=dict)
    notch: Table = field(default_factory=dict)

    @property
    def citation(self) -> str:
        """What to cite."""
        return self.repository.citation

    @property
    def licence(self) -> str:
        """Licence of the data, as far as it is known."""
        return self.repository.licence

    @property
    def place(self) -> str:
        """Path of the upstream file at the fixed commit, below the address of the host."""
        return f"{self.repository.owner_name}/{self.repository.commit}/{quote(self.path)}"


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
    return Entry(name, title, _TOOL, f"data/Tool_4_Maryland_L_4/{file}.TXT", sha256, "deg", tool)


def _manipulator(file: str, configuration: int, name: str, sha256: str) -> Entry:
    title = f"Surgical manipulator, configuration {configuration}, sine of {name.partition('deg')[0]} deg"
    title += ", taken again" if name.endswith("-b") else ""
    path = f"optimization/selected/{file}.txt"
    read = partial(manipulator, command=1)
    return Entry(f"surgical-manipulator-conf{configuration}-{name}", title, _MANIPULATOR, path, sha256, "deg", read)


def _decaying(file: str, kind: str, rate: str, sha256: str) -> Entry:
    course = {"taut": "about a mean", "slack": "back to zero"}[kind]
    title = f"Tendon catheter, decaying sine, {course}, {rate} Hz"
    path = f"tendon_data/20230928/all_data/data_{file}.txt"
    return Entry(f"catheter-{kind}-{rate}hz", title, _CATHETER, path, sha256, "mm", catheter)


def _load_cell(file: str, course: str, sha256: str) -> Entry:
    title = f"Tendon robot with load cell, {course}"
    path = f"tendon_data/Frequency_Trials/{file}.mat"
    return Entry(f"tendon-robot-{course}", title, _CATHETER, path, sha256, "mm", tendon_robot)


def _notched(tube: str, width_mm: float, spacing_mm: float) -> Entry:
    notch: Table = {
        "shape": "rectangular",
        "count": 5,
        "depth_mm": 1.40,
        "width_mm": width_mm,
        "spacing_mm": spacing_mm,
    }
    return Entry(
        f"notched-wrist-{tube}",
        f"Notched NiTi wrist, {tube} degree tube",
        _WRIST,
        "matlab.mat",
        "78e4d3c09eb50ee96003b3f57c72ece71bb3c26ac4e1461ce8c421d7130c439b",
        "N",
        partial(wrist, variable=f"experimentData{tube}"),
        tube={"outer_diameter_mm": 1.62, "inner_diameter_mm": 1.40},
        notch=notch,
    )


_ENTRIES = (
    Entry(
        "tee-probe-antero-posterior",
        "TEE probe, antero-posterior",
        _PROBE,
        "matlab/Calibration/motor2_current60.xlsx",
        "398d0c64e14d1476f88dac8808dc08166cdd8d79cdb94d8d76ff2fd441f2f3fb",
        "step",
        probe,
    ),
    Entry(
        "surgical-manipulator-0-80",
        "Surgical manipulator, sine 0-80 deg",
        _MANIPULATOR,
        "operation/optimizer_input/test0224.txt",
        "e80e95d319053cbe4ac49a995aeb6fb44313d40b8885ccbfe1b921c3d233b9a8",
        "deg",
        partial(manipulator, command=1),
    ),
    Entry(
        "surgical-manipulator-feedforward",
        "Surgical manipulator, feed-forward compensated command",
        _MANIPULATOR,
        "operation/optimizer_input/aurora_ff.txt",
        "322f94c7c96289c1afccd2728fc9e273903cc3a64f4d8f4f1e2dd0b2401ec889",
        "deg",
        partial(manipulator, command=6),
    ),
    _manipulator("conf0_50", 0, "50deg", "da5254a42ce526f0b4295010037ddfd2eff5dd01cedbe1a0e8afe00bdad7d25e"),
    _manipulator("conf0_60", 0, "60deg", "a061877ad2feea69ca110f83fc604a6581738753c5203c19954a8d1b7088582d"),
    _manipulator("conf0_60_", 0, "60deg-b", "699056007b2e37ca22122f7157b477409c6c08e580f65786e05e8ff5428a6458"),
    _manipulator("conf0_70", 0, "70deg", "4b27650b85d07eec7f2d27c6380fc5f0c496a36c4cb72e97531c320e945a967f"),
    _manipulator("conf90_50", 90, "50deg", "69850822ff6a20c94305d6c2c502f3a99cf75b8de7deda73f03d24827a6b531c"),
    _manipulator("conf90_60", 90, "60deg", "5a3152e1a2afdbfa8e1d157ce097ab94aa7a7a77c5f0b98c121d9bbfab284b3c"),
    _manipulator("conf90_70", 90, "70deg", "5ef9009d4a95a05d304122c034d3a098a8b6f1b2aee787d98167f1ffccae871a"),
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
