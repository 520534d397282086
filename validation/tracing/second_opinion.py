"""The multibody model as a second opinion on a trace.

The search runs on the compiled chain. The parameters of its baseline and of its augmented model are put into the
multibody model as they are, without another fit; errors are calculated as in the search. Both engines follow the same
laws, but the multibody model also has shear and the compliance of the rings: they differ by a few hundredths of a
degree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_models.load.program import LoadProgram
from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats
from hysteresis.messages import failure
from hysteresis.records.metrics import Errors, errors
from hysteresis.records.record import Record
from validation.tracing.baseline.in_space import SpaceProblem
from validation.tracing.baseline.known_rig import KnownRigProblem
from validation.tracing.baseline.rig_problem import observed_angle_deg
from validation.tracing.baseline.runs import Run
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.outcome import Trace
from validation.tracing.settings import MULTIBODY_CYCLE_SAMPLES, MULTIBODY_CYCLES

STOPPED = "stopped before the end"
"""Beginning of the words where a run failed."""

Solver = Callable[[Rig, LoadProgram | Floats], Record]


@dataclass(frozen=True)
class SecondOpinion:
    """Errors of the multibody model before and after; None where it could not be run, which ``words`` says."""

    before: Errors | None
    after: Errors | None
    words: str


def second_opinion(trace: Trace, cycles: float = MULTIBODY_CYCLES) -> SecondOpinion:
    """Run the baseline and the augmented model of a trace in the multibody engine.

    Parameters
    ----------
    cycles
        Of the drive, over all records that are run: whole records, the shortest first, at least one.
    """
    problem = trace.baseline.model.problem
    if isinstance(problem, SpaceProblem):
        return SecondOpinion(None, None, "not run: the rig bends in two planes")
    if not trace.known or not isinstance(problem, KnownRigProblem):
        return SecondOpinion(None, None, "not run: the geometry is unknown")
    try:
        from fem_models.multibody.quasi_static import solve_multibody, solve_multibody_by_force
        from fem_models.multibody.stepper import quiet
    except Exception as error:  # also where the system lacks a library that Exudyn loads
        return SecondOpinion(None, None, f"not run: exudyn cannot be imported: {' '.join(str(error).split())}")

    def solver(rig: Rig, program: LoadProgram | Floats) -> Record:
        run = (
            solve_multibody(rig, program)
            if isinstance(program, LoadProgram)
            else solve_multibody_by_force(rig, program)
        )
        return run.record

    chosen = _chosen(problem, cycles)
    try:
        with quiet():
            before = _errors(trace.baseline, problem, chosen, solver)
            after = before if trace.augmented is trace.baseline else _errors(trace.augmented, problem, chosen, solver)
    except Exception as error:  # also of Exudyn, which has many: the verdict does not hang on it
        return SecondOpinion(None, None, f"{STOPPED}: {failure(error)}")
    ran = f"{len(chosen)} of {len(problem.runs)} records, with the parameters fitted on the chain"
    return SecondOpinion(before, after, ran)


def _chosen(problem: KnownRigProblem, cycles: float) -> list[int]:
    """Choose records, the shortest first."""
    cost = [max(float(s.cycle.max()), 1.0, s.drive.size / MULTIBODY_CYCLE_SAMPLES) for s in problem.inputs]
    order = sorted(range(len(cost)), key=lambda i: cost[i])
    total = np.cumsum([cost[i] for i in order])
    return sorted(i for i, t in zip(order, total.tolist(), strict=True) if t <= cycles) or order[:1]


def _errors(fitted: Fitted, problem: KnownRigProblem, chosen: list[int], solver: Solver) -> Errors:
    """Errors over the chosen records, the offset of each taken out as in the search."""
    baseline, more = fitted.model.values(fitted.x)
    added = [(a.form, values) for a, values in zip(fitted.model.added, more, strict=True)]
    predicted = []
    for i in chosen:

        def angle_deg(run: Run) -> Floats:
            program = problem.driven(run, baseline).program
            return solver(problem.rig(run, baseline, added), program).angle_deg[run.skip :]

        angle = observed_angle_deg(
            np.concatenate([angle_deg(run) for run in problem.runs[i]]), problem.inputs[i], added
        )
        predicted.append(angle - fitted.holdout.offset_deg(i, angle - problem.observed[i]))
    return errors(np.concatenate([problem.observed[i] for i in chosen]), np.concatenate(predicted))
