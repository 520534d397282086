"""``validate.json`` and ``six-stiffnesses.json`` as the report reads them.

:class:`studies.commands.comparison.Validation` and, of a rig in space,
:class:`studies.commands.wrist_comparison.WristComparison` have all of their fields.
"""

from __future__ import annotations

from dataclasses import dataclass

from studies.results.made import Made
from studies.results.run import CrossCheckRow

WHAT = "the result of `notchbend validate`"
FILE_IN_SPACE = "six-stiffnesses.json"
WHAT_IN_SPACE = "the result of `notchbend validate` of a rig in space"


@dataclass(frozen=True)
class BentRow:
    """The chain of a model under a tension."""

    tendon_N: float
    angle_deg: float
    angle_percent: float


@dataclass(frozen=True)
class NotchRow:
    """A notch of a rig whose notches differ; percentages are differences from the reference."""

    number: int
    depth_mm: float
    width_mm: float
    bending_Nmm_per_rad: float
    angles_deg: tuple[float, ...]
    bending_percent: float
    angle_percent: float


@dataclass(frozen=True)
class ModelStiffness:
    """A model of one joint, and its bent chains; None where a model does not have a stiffness.

    Where notches differ, ``notches`` has them one by one, and the stiffnesses are harmonic means.
    """

    name: str
    bending_Nmm_per_rad: float
    axial_N_per_mm: float | None
    shear_N_per_mm: float | None
    bending_percent: float | None
    bent: tuple[BentRow, ...]
    notches: tuple[NotchRow, ...] = ()


@dataclass(frozen=True)
class StoredModels:
    """Every model of a rig, compared with the reference model ``judge``."""

    rig: str
    judge: str
    models: tuple[ModelStiffness, ...]


@dataclass(frozen=True)
class StoredValidation:
    """The engines side by side at each preload, and every model of one joint."""

    rigs: tuple[CrossCheckRow, ...]
    models: StoredModels
    options: str | None = None
    made: Made | None = None


@dataclass(frozen=True)
class SixNumbers:
    """Stiffnesses of a notch, Nmm/rad and N/mm, or their ratios."""

    weak: float
    strong: float
    torsion: float
    axial: float
    shear_in: float
    shear_across: float


@dataclass(frozen=True)
class StoredNotch:
    """A notch: its stiffnesses from the section and of the solid, and the first over the second."""

    number: int
    depth_mm: float
    width_mm: float
    section: SixNumbers
    solid: SixNumbers
    ratio: SixNumbers


@dataclass(frozen=True)
class StoredBending:
    """The wrist bent by a model: towards y and z, and the place of its tip."""

    name: str
    bending_deg: tuple[float, float]
    torsion_deg: float
    tip_mm: tuple[float, float, float]


@dataclass(frozen=True)
class StoredSix:
    """Section and solid of every notch, and the wrist bent by each motion of the wheels in every model."""

    schema: int
    rig: str
    notches: tuple[StoredNotch, ...]
    drives_mm: tuple[tuple[float, ...], ...]
    bent: tuple[tuple[StoredBending, ...], ...]
    notes: tuple[str, ...]
    made: Made | None = None
