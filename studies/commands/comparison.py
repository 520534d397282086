"""All models of a rig side by side: the work of ``notchbend validate``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fem_models.rig import Rig
from hysteresis.plain import optional
from studies.progress import steps
from studies.results.made import Made
from validation.engines import EngineAgreement, compare_engines
from validation.joints import compare_models
from validation.joints.models import REFERENCE, ModelRow

PRELOADS_N = (10.0, 20.0)
AMPLITUDE_MM = 2.2


@dataclass(frozen=True)
class Models:
    """Every model of a rig against the reference model; frequencies are the lowest of one free reduced body, if any."""

    rig: str
    judge: str
    solid_nodes: int
    free_frequencies_Hz: tuple[float, ...]
    models: tuple[ModelRow, ...]


@dataclass(frozen=True)
class Validation:
    """What ``validate.json`` holds: the engines side by side at the preloads, and every model of one joint.

    ``options`` are the options of the command that name the rig and its drive.
    """

    schema: int
    rigs: tuple[EngineAgreement, ...]
    models: Models
    options: str | None = optional()
    made: Made | None = optional()


def validate_rig(
    rig: Rig, *, preloads_N: Sequence[float], amplitude_mm: float | None = None, progress: bool = True
) -> Validation:
    """Compare the engines at some preloads, and every model of one joint and of the bent chain.

    Parameters
    ----------
    preloads_N
        Preloads at which the engines are compared, N.
    amplitude_mm
        Amplitude of the drive there; by default that of the paper.

    Raises
    ------
    RigError, SolverError
        From the models.
    """
    models = _models(rig, progress)
    amplitude = AMPLITUDE_MM if amplitude_mm is None else amplitude_mm
    return Validation(1, _engines(rig, preloads_N, amplitude, progress), models)


def _engines(rig: Rig, preloads_N: Sequence[float], amplitude_mm: float, progress: bool) -> tuple[EngineAgreement, ...]:
    """Compare the engines; not for a rig with one tendon, which has no preload to vary."""
    if rig.tendon_b is None:
        return ()
    with steps(progress, total=len(preloads_N)) as step:
        out = []
        for preload in preloads_N:
            step(f"{rig.name} at {preload:g} N")
            out.append(compare_engines(replace(rig, preload_N=preload), amplitude_mm=amplitude_mm))
    return tuple(out)


def _models(rig: Rig, progress: bool) -> Models:
    with steps(progress, total=7 if rig.joint.alike else rig.joints + 4) as step:
        found = compare_models(rig, progress=step)
    return Models(found.rig, REFERENCE, found.nodes, found.free_frequencies_Hz, found.rows())
