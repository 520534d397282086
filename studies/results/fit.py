"""``identify.json`` as report and compensation read it; :meth:`hysteresis.fitting.fit.Fit.to_dict` writes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from hysteresis.arrays import Floats
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.laws.elements import LawName
from hysteresis.plain import optional
from hysteresis.records.metrics import Errors
from hysteresis.records.record import DriveUnit
from studies.results.made import Made

WHAT = "the identify.json of `notchbend identify`"


@dataclass(frozen=True)
class Baseline:
    """Errors of the best curve without hysteresis."""

    heldout: Errors


@dataclass(frozen=True)
class NotFixed:
    """Parameters of the paper's form that the data leave open, and a sentence that says so."""

    names: tuple[str, ...]
    words: str


@dataclass(frozen=True)
class StoredFit:
    """A fit as the report shows it; see ``docs/guide/identification.md`` for the fields."""

    kinematics: str
    parameters: Mapping[str, Parameter]
    heldout: Errors
    warnings: tuple[str, ...]
    baseline: Baseline
    heldout_by: str
    noise_floor_deg: float
    records: tuple[str, ...] = ()
    train: Errors | None = None
    layer: Mapping[str, Parameter] = field(default_factory=dict)
    not_fixed: NotFixed | None = None
    notes: tuple[str, ...] = ()
    drive_unit: str = "mm"
    seed: int = 0
    made: Made | None = optional()


@dataclass(frozen=True)
class Curve:
    """f and the best curve without hysteresis at a number of drives, shapes (k,), deg."""

    drive: Floats
    angle_deg: Floats
    without_hysteresis_deg: Floats


@dataclass(frozen=True)
class Angles:
    """f at a number of drives, shapes (k,), deg."""

    drive: Floats
    angle_deg: Floats


@dataclass(frozen=True)
class StoredLaw:
    """The law that was chosen: its elements, for :func:`hysteresis.laws.elements.elements_of`, and its f."""

    name: LawName
    title: str
    sign: float
    values: tuple[tuple[float, ...], ...]
    place: tuple[float, float]
    delay_s: float
    f: Angles
    heldout: Errors
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class StoredModel:
    """A fit as far as the model can be evaluated again from it; ``law`` is absent in files of earlier versions."""

    parameters: Mapping[str, Parameter]
    heldout: Errors
    warnings: tuple[str, ...]
    baseline: Baseline
    elements: int
    f: Curve
    drive_unit: DriveUnit
    first_drive: float
    law: StoredLaw | None = optional()
