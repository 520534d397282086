"""Baseline of a rig on the compiled chain: parameters of the rig are fitted, effects are added to it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fem_models.chain.along import MovedRun, TapedRun, line_along, moved_along, moved_run, moved_series, taped_run
from fem_models.chain.solve import ChainCase, chain_case
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats, Ints
from validation.tracing.baseline.runs import Run, RunSetup
from validation.tracing.effect import Effect, FreeParameter, RigForm, SampleInputs, Scale, Values
from validation.tracing.prepared import Channel, RecordSet
from validation.tracing.threads import in_threads


@dataclass(frozen=True, eq=False)
class FollowedRun:
    """A run as it is declared and as it is driven, and what the rig did in it."""

    run: Run
    driven: Run
    base: TapedRun

    def rows(self, channels: Sequence[Channel]) -> Floats:
        """Angle and channels, shape (m, 1 + channels)."""
        return self.driven.rows(self.base.series, channels)


@dataclass(frozen=True, eq=False)
class Followed:
    """What a rig with effects predicts, as of ``predict_series``, and the steps of its runs."""

    series: list[Floats]
    runs: tuple[FollowedRun, ...]


@dataclass(frozen=True, eq=False)
class _Moved:
    """A run of a moved rig, as it is driven; "same" where the rig does not differ, "none" where it cannot be."""

    of: FollowedRun
    driven: Run
    run: MovedRun | Literal["same", "none"]


@dataclass(frozen=True, eq=False)
class _ToRun:
    """A run of a rig with the parameters of a model, ready for the kernel."""

    run: Run
    driven: Run
    rig: Rig
    load: LoadProgram | Floats
    case: ChainCase


def _followed(one: _ToRun) -> FollowedRun:
    return FollowedRun(one.run, one.driven, taped_run(one.rig, one.load, one.case))


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
        return self.followed(values, added).series

    def followed(self, values: Values, added: Added, threads: int = 1) -> Followed:
        """Predict as ``predict_series``, and keep the steps of the runs for :meth:`moved`; records run in threads."""
        todo, known = list[_ToRun](), dict[int, _ToRun]()  # by the declared rig, which most records share
        for run in (run for of_record in self.runs for run in of_record):
            driven, same = self.driven(run, values), known.get(id(run.rig))
            rig = same.rig if same else self.rig(run, values, added)
            load = driven.load(rig)
            one = _ToRun(run, driven, rig, load, chain_case(rig, load, like=same.case if same else None))
            known[id(run.rig)] = one
            todo.append(one)
        runs = in_threads(_followed, todo, threads)
        return Followed(self._series([one.rows(self.channels) for one in runs], added), tuple(runs))

    def moved(
        self, followed: Followed, points: Sequence[tuple[Values, Added]], threads: int
    ) -> list[list[Floats] | None]:
        """Predict near parameters that were run, to first order in the difference; None where there is no such rig.

        A rig is not run where only what is read of it differs. Threads do no more than the kernels, which release the
        interpreter's lock.
        """

        def along(one: Sequence[_Moved]) -> list[float]:
            line = line_along(one[0].of.base)
            return [moved_along(line, moved.run) if isinstance(moved.run, MovedRun) else 0.0 for moved in one]

        if not points:
            return []
        by_point = [self._moved(followed.runs, values, added) for values, added in points]
        by_run = list(zip(*by_point, strict=True))
        differences = in_threads(along, by_run, threads)
        out = list[list[Floats] | None]()
        for point, (_, added) in enumerate(points):
            rows = [
                self._moved_rows(one[point], difference[point])
                for one, difference in zip(by_run, differences, strict=True)
            ]
            given = [one for one in rows if one is not None]
            out.append(self._series(given, added) if len(given) == len(rows) else None)
        return out

    def _moved(self, runs: Sequence[FollowedRun], values: Values, added: Added) -> list[_Moved]:
        """Move the rig of each run; records of one declared rig share what is derived of it."""
        out, rigs, cases = list[_Moved](), dict[int, Rig](), dict[int, ChainCase]()
        for one in runs:
            declared = id(one.run.rig)
            try:
                rig = rigs.get(declared) or self.rig(one.run, values, added)
                rigs[declared], run = rig, self.driven(one.run, values)
                load = run.load(rig)
                if rig == one.base.rig and _same_load(load, one.driven.load(rig)):
                    out.append(_Moved(one, one.driven, "same"))
                    continue
                moved = moved_run(one.base, rig, load, cases.get(declared))
                cases[declared] = moved.case
                out.append(_Moved(one, run, moved))
            except RigError:
                out.append(_Moved(one, one.driven, "none"))
        return out

    def _moved_rows(self, moved: _Moved, difference_rad: float) -> Floats | None:
        match moved.run:
            case "same":
                return moved.of.rows(self.channels)
            case "none":
                return None
            case run:
                try:
                    return moved.driven.rows(moved_series(moved.of.base, run, difference_rad), self.channels)
                except (SolverError, RigError):
                    return None

    def _series(self, rows: Sequence[Floats], added: Added) -> list[Floats]:
        """Put the rows of all runs, as of :meth:`Run.rows`, together: angles as they are read, and channels."""
        of_records, at = list[Floats](), 0
        for runs, inputs in zip(self.runs, self.inputs, strict=True):
            own = np.concatenate(rows[at : at + len(runs)])
            at += len(runs)
            own[:, 0] = observed_angle_deg(own[:, 0], inputs, added)
            of_records.append(own)
        return [own[:, k] for k in range(1 + len(self.channels)) for own in of_records]


def _same_load(one: LoadProgram | Floats, other: LoadProgram | Floats) -> bool:
    if isinstance(one, LoadProgram) and isinstance(other, LoadProgram):
        return one is other or np.array_equal(one.drive_mm, other.drive_mm)
    return one is other


def observed_angle_deg(angle_deg: Floats, inputs: SampleInputs, added: Added) -> Floats:
    """Angle that is read, from the angle of the rig, by the effects that act on the reading; shapes (m,)."""
    for form, more in added:
        if form.observe is not None:
            angle_deg = form.observe(angle_deg, inputs, more)
    return angle_deg
