"""What the tracer fits: records, the declared model of them, and the forms in which effects are added to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from hysteresis.arrays import Floats
from hysteresis.record import Record, RecordError
from validation.tracing.effect import Effect, FreeParameter, SampleInputs, Values
from validation.tracing.prepared import PreparedRecord


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
    """Records and the declared model.

    Every record has a zero of its angle that is free: errors are those of angles less their mean error.
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
    def inputs(self) -> tuple[SampleInputs, ...]:
        """What else is known of their samples."""

    @property
    def prior_weight_deg(self) -> float:
        """Error that a declared constant counts as that is one size away from where a fit began; 0 leaves all free.

        Constants that make good for each other, as all forces of a rig in proportion nearly do, then stay near,
        in place of wandering (Tikhonov's regularisation).
        """

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Those of the declared model."""

    @property
    def start(self) -> Values:
        """Values of those to start from."""

    def forms(self, effect: Effect) -> tuple[Any, ...]:
        """Forms of an effect that these records can have."""

    def starts(self, form: Any) -> Sequence[Values]:
        """Values to start the constants of a form from."""

    def predict(self, values: Values, added: Sequence[tuple[Any, Values]]) -> list[Floats]:
        """Angles of all records by the declared model with forms added, shapes (m_i,).

        Raises
        ------
        SolverError, RigError
            Constants that no rig can have, or that it cannot follow.
        """


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
