"""What the tracer fits: records, their baseline model, and the forms in which effects are added to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from hysteresis.arrays import Floats
from hysteresis.records.record import Record, RecordError
from validation.tracing.effect import Effect, FreeParameter, SampleInputs, Values
from validation.tracing.prepared import Channel, PreparedRecord


class Form(Protocol):
    """One way in which an effect acts: :class:`validation.tracing.effect.RigForm` or ``CurveForm``."""

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """What is fitted."""


@dataclass(frozen=True)
class AddedEffect:
    """An effect in a model: which one, in what form."""

    effect: Effect
    form: Any


class Problem(Protocol):
    """Records and their baseline model.

    The angle of every record has an unknown offset, so that errors count less their mean.
    """

    @property
    def records(self) -> tuple[PreparedRecord, ...]:
        """The records, with the samples of them that are fitted."""

    @property
    def preloads_N(self) -> list[float]:
        """Preload of each record; empty where one record does not state it."""

    @property
    def observed(self) -> tuple[Floats, ...]:
        """Angles of each record, shapes (m_i,), deg."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What is fitted together with the angle; a problem with channels has ``predict_series``, too."""

    @property
    def inputs(self) -> tuple[SampleInputs, ...]:
        """Drive, time and cycle of their samples."""

    @property
    def prior_weight_deg(self) -> float:
        """Weight of the prior mean: the error that a baseline parameter counts as, one scale from it; 0 for none.

        It keeps parameters near that compensate each other, as all forces of a rig in proportion nearly do (Tikhonov's
        regularisation).
        """

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Parameters of the baseline."""

    @property
    def start(self) -> Values:
        """Starting values of these."""

    def forms(self, effect: Effect) -> tuple[Any, ...]:
        """Forms of an effect whose needs these records meet."""

    def starts(self, form: Any) -> Sequence[Values]:
        """Give starting values of a form's parameters."""

    def predict(self, values: Values, added: Sequence[tuple[Any, Values]]) -> list[Floats]:
        """Angles of all records by the baseline with forms added, shapes (m_i,).

        Raises
        ------
        SolverError, RigError
            Parameters that no rig can have, or with which it cannot follow the records.
        """

    def predict_series(self, values: Values, added: Sequence[tuple[Any, Values]]) -> list[Floats]:
        """Angles of all records, then each channel of all records, by one run; the angles alone without channels."""


@runtime_checkable
class FollowedProblem(Protocol):
    """A problem whose predictions near parameters that were run cost far less than a run: derivatives do."""

    def followed(self, values: Values, added: Sequence[tuple[Any, Values]], threads: int = 1) -> Any:
        """Predict as :meth:`Problem.predict_series`, in ``series`` of what it returns."""

    def moved(
        self, followed: Any, points: Sequence[tuple[Values, Sequence[tuple[Any, Values]]]], threads: int
    ) -> list[list[Floats] | None]:
        """Predict near the parameters that were followed, to first order; None where there is no such rig."""


def require_one_unit(records: Sequence[Record]) -> None:
    """Refuse records whose drives have different units.

    Raises
    ------
    RecordError
        One line with the first record that differs.
    """
    for record in records:
        if record.drive_unit != records[0].drive_unit:
            where, unit = record.source or "record", record.drive_unit
            raise RecordError(f"{where}: drive.unit = {unit}: expected {records[0].drive_unit}, as of the first record")
