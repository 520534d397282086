"""``identify.json`` as the report and the compensation read it; :meth:`hysteresis.fit.Fit.to_dict` writes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hysteresis.arrays import Floats
from hysteresis.metrics import Errors
from hysteresis.uncertainty import Parameter

WHAT = "the identify.json of `notchbend identify`"


@dataclass(frozen=True)
class Baseline:
    """Errors of the best curve without hysteresis."""

    heldout: Errors


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


@dataclass(frozen=True)
class Curve:
    """f and the best curve without hysteresis at a number of drives, shapes (k,), deg."""

    drive: Floats
    angle_deg: Floats
    without_hysteresis_deg: Floats


@dataclass(frozen=True)
class StoredModel:
    """A fit as far as the model can be evaluated again from it."""

    parameters: Mapping[str, Parameter]
    heldout: Errors
    warnings: tuple[str, ...]
    baseline: Baseline
    elements: int
    f: Curve
    drive_unit: str
    first_drive: float
