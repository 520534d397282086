"""All models of a rig side by side: the work of ``notchbend validate``."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fem_models.rig import Rig
from studies.progress import steps
from validation.engines import EngineAgreement, compare_engines
from validation.joints import compare_models
from validation.joints.models import REFERENCE, ModelRow

PRELOADS_N = (10.0, 20.0)


@dataclass(frozen=True)
class Models:
    """Every model of a rig beside the reference model; frequencies are the lowest of one free reduced body."""

    rig: str
    judge: str
    solid_nodes: int
    free_frequencies_Hz: tuple[float, ...]
    models: tuple[ModelRow, ...]


@dataclass(frozen=True)
class Validation:
    """What ``validate.json`` holds: the engines side by side at both preloads, and every model of one joint."""

    schema: int
    rigs: tuple[EngineAgreement, ...]
    models: Models


def validate_rig(rig: Rig, *, progress: bool = True) -> Validation:
    """Compare the engines at both preloads of the paper, and every model of one joint and of the bent chain.

    Raises
    ------
    RigError, SolverError
        From the models.
    """
    models = _models(rig, progress)
    return Validation(1, _engines(rig, progress), models)


def _engines(rig: Rig, progress: bool) -> tuple[EngineAgreement, ...]:
    """Compare the engines; not for a rig with one tendon, which has no preload to vary."""
    if rig.tendon_b is None:
        return ()
    with steps(progress, total=len(PRELOADS_N)) as step:
        out = []
        for preload in PRELOADS_N:
            step(f"{rig.name} at {preload:g} N")
            out.append(compare_engines(replace(rig, preload_N=preload)))
    return tuple(out)


def _models(rig: Rig, progress: bool) -> Models:
    with steps(progress, total=7) as step:
        found = compare_models(rig, progress=step)
    return Models(found.rig, REFERENCE, found.nodes, found.free_frequencies_Hz, found.rows())
