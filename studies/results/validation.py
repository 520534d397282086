"""``validate.json`` as the report reads it; :class:`studies.commands.comparison.Validation` has all of its fields."""

from __future__ import annotations

from dataclasses import dataclass

from studies.results.made import Made
from studies.results.run import CrossCheckRow

WHAT = "the result of `notchbend validate`"


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
    """Every model of a rig beside the reference model ``judge``."""

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
