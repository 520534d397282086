"""Baseline of a rig on the compiled chain: parameters of the rig are fitted, effects are added to it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_models.load import LoadProgram
from fem_models.rig import Rig
from hysteresis.arrays import Floats, Ints
from validation.tracing.baseline.runs import Run, RunSetup
from validation.tracing.effect import Effect, FreeParameter, RigForm, SampleInputs, Scale, Values
from validation.tracing.prepared import RecordSet

Added = Sequence[tuple[RigForm, Values]]
"""Forms of effects with the values of their parameters, in the order in which they are added."""


@dataclass(frozen=True, eq=False)
class RigProblem(RecordSet, ABC):
    """Records of a rig, and the parameters of its baseline; see :class:`validation.tracing.problem.Problem`."""

    parameters: tuple[FreeParameter, ...]
    start: Values
    setup: RunSetup

    @property
    def runs(self) -> tuple[tuple[Run, ...], ...]:
        """Runs of each record."""
        return self.setup.runs

    @property
    def scale(self) -> Scale:
        """Orders of magnitude of all records."""
        return self.setup.scale

    @property
    def prior_weight_deg(self) -> float:
        """See :class:`validation.tracing.problem.Problem`: the few parameters of a known rig need no prior."""
        return 0.0

    def forms(self, effect: Effect) -> tuple[RigForm, ...]:
        """Forms whose needs are met."""
        return tuple(form for form in effect.rig_forms if form.needs <= self.setup.needs)

    def starts(self, form: RigForm) -> Sequence[Values]:
        """Give starting values of a form's parameters."""
        return form.starts(self.scale, self.runs[0][0].rig)

    @abstractmethod
    def baseline_rig(self, rig: Rig, values: Values) -> Rig:
        """Give a rig the parameters of the baseline."""

    def driven(self, run: Run, values: Values) -> Run:
        """Run as the wheel is driven in it: as the record says, unless the baseline fits the drive."""
        return run

    def program(self, drive: Floats, time_s: Floats | None, cycle: Ints) -> LoadProgram:
        """Make a load program of a drive in the records' unit."""
        return LoadProgram(drive, time_s, cycle)

    def rig(self, run: Run, values: Values, added: Added) -> Rig:
        """Rig of a run with the parameters of the baseline, and with effects."""
        rig = self.baseline_rig(run.rig, values)
        for form, more in added:
            if form.rig is not None:
                rig = form.rig(rig, more)
        return rig

    def predict(self, values: Values, added: Added) -> list[Floats]:
        """Angles of all records; see :meth:`validation.tracing.problem.Problem.predict`."""
        out = []
        for runs, inputs in zip(self.runs, self.inputs, strict=True):
            parts = [self.driven(run, values).angle_deg(self.rig(run, values, added)) for run in runs]
            out.append(observed_angle_deg(np.concatenate(parts), inputs, added))
        return out

    def predict_series(self, values: Values, added: Added) -> list[Floats]:
        """Angles of all records, then each channel of all records; one run gives all.

        Effects on the reading act on the angle alone.
        """
        of_records = list[Floats]()
        for runs, inputs in zip(self.runs, self.inputs, strict=True):
            parts = [self.driven(run, values).observed(self.rig(run, values, added), self.channels) for run in runs]
            rows = np.concatenate(parts)
            rows[:, 0] = observed_angle_deg(rows[:, 0], inputs, added)
            of_records.append(rows)
        return [rows[:, k] for k in range(1 + len(self.channels)) for rows in of_records]


def observed_angle_deg(angle_deg: Floats, inputs: SampleInputs, added: Added) -> Floats:
    """Angle that is read, from the angle of the rig, by the effects that act on the reading; shapes (m,)."""
    for form, more in added:
        if form.observe is not None:
            angle_deg = form.observe(angle_deg, inputs, more)
    return angle_deg
