"""``wrist.json``: the design report of a rig that bends in space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hysteresis.plain import optional
from hysteresis.records.record import RecordError
from studies.results.files import read_result
from studies.results.made import Made
from studies.results.run import Picture, RigNumber, RunLoop
from studies.results.workspace import ComplianceAt

FILE = "wrist.json"
WHAT = "the design report of a rig in space, of `notchbend run --rig`"


@dataclass(frozen=True)
class NotchInSpace:
    """A notch: middle from the base, its turn about the tube axis from y towards z, and its stiffnesses, Nmm/rad."""

    middle_mm: float
    turn_deg: float
    depth_mm: float
    width_mm: float
    weak_Nmm_per_rad: float
    strong_Nmm_per_rad: float
    torsion_Nmm_per_rad: float
    closes_at_deg: float


@dataclass(frozen=True)
class TendonInSpace:
    """A tendon: its angle round the tube, its wheel, and whether a positive drive winds it in."""

    angle_deg: float
    wheel: int
    wound_in: bool
    moment_arm_mm: float
    EA_N: float
    free_length_mm: float


@dataclass(frozen=True, kw_only=True)
class WheelLoop(RunLoop):
    """The loop of one wheel at one preload, the others standing still; ``theory`` is without friction and loop.

    ``moves`` says what moves, and ``unit`` has the drives of all wheels for 1 mm of the loop's: three wheels or four
    move together, towards y and towards z. ``one_way`` is a wheel with one tendon, from rest to the amplitude.
    Angles of the loop are in the plane in which the tip bends most, ``direction_deg`` from y towards z; ``across_deg``
    is the largest bending out of it. ``lost_motion_mm`` is the largest width of the loop along the drive, None
    where nothing bends. Strains are those of the weak bending of the notches.
    """

    moves: str
    unit: tuple[float, ...]
    one_way: bool
    direction_deg: float
    across_deg: float
    lost_motion_mm: float | None
    largest_torsion_deg: float
    least_tension_N: float
    largest_tension_N: float

    @property
    def both_ways(self) -> bool:
        """Whether cycles go from -x to x."""
        return not self.one_way


@dataclass(frozen=True)
class TipPath:
    """The way of the tip while all wheels bend it once round, with friction and without; of one wheel its loop.

    ``record`` and ``smooth`` are the files. ``apart`` is the distance of both tips at the same drives.
    """

    record: str
    smooth: str
    preload_N: float
    circle: bool
    largest_bending_deg: float
    largest_apart_mm: float
    mean_apart_mm: float
    least_tension_N: float
    largest_tension_N: float


@dataclass(frozen=True, kw_only=True)
class WristSummary:
    """What ``wrist.json`` holds; ``sha256`` has the checksums of the records by name.

    ``option`` names the rig on a command line, ``notes`` say what was left out, and why.
    """

    schema: int = 1
    name: str
    option: str
    amplitude_mm: float
    versions: Mapping[str, str]
    rig: tuple[RigNumber, ...]
    notches: tuple[NotchInSpace, ...]
    tendons: tuple[TendonInSpace, ...]
    loops: tuple[WheelLoop, ...]
    paths: tuple[TipPath, ...]
    compliance: tuple[ComplianceAt, ...]
    picture: Picture
    notes: tuple[str, ...]
    sha256: Mapping[str, str]
    made: Made | None = optional()


def read_wrist(folder: Path) -> WristSummary:
    """Read the summary from its folder.

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    path = folder / FILE
    found = read_result(WristSummary, path, WHAT)
    for name in ("notches", "tendons", "loops"):
        if not getattr(found, name):
            raise RecordError(f"{path}: {name}: empty: expected {WHAT}")
    return found
