"""``trace.json`` as the report reads it; :class:`validation.tracing.result.TraceReport` has all of its fields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from hysteresis.fitting.uncertainty import Parameter
from hysteresis.plain import optional
from hysteresis.records.metrics import Errors
from studies.results.made import Made
from validation.tracing.fitting.ranking import RankedModel

WHAT = "the result of `notchbend trace`"


@dataclass(frozen=True)
class FoldErrors:
    """Errors of a model over the fitted and over the held-out samples."""

    train: Errors | None = None
    heldout: Errors | None = None


@dataclass(frozen=True)
class MultibodyErrors:
    """Errors of the multibody model before and after the effects."""

    before: Errors | None = None
    after: Errors | None = None


@dataclass(frozen=True)
class NamedEffect:
    """An effect that the residual is traced to."""

    name: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    confusable_with: tuple[str, ...] = ()


@dataclass(frozen=True)
class TriedModel:
    """A candidate that was fitted."""

    name: str
    heldout_rmse_deg: float | None = None
    delta_bic: float | None = None


@dataclass(frozen=True)
class FigureFile:
    """A figure beside the result, PNG or CSV, with its caption."""

    file: str
    caption: str = ""


@dataclass(frozen=True)
class StoredTrace:
    """A trace as the report shows it; ``samples_file`` has what its charts show, ``figures`` are without one."""

    verdict: str
    records: tuple[str, ...] = ()
    noise_floor_deg: float | None = None
    before: FoldErrors = FoldErrors()
    after: FoldErrors = FoldErrors()
    effects: tuple[NamedEffect, ...] = ()
    multibody: MultibodyErrors | None = None
    candidates: tuple[TriedModel, ...] = ()
    next_experiment: str = ""
    figures: tuple[FigureFile, ...] = ()
    reference: tuple[str, ...] = ()
    alike: float | None = None
    samples_file: str | None = None
    held_out: tuple[bool, ...] = ()
    ranking: tuple[RankedModel, ...] = ()
    made: Made | None = optional()
