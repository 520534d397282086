"""Model of the measured notched wrists, extended stage by stage and tested on held-out trials and on the other tube."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fem_models.joint import joint_mechanics
from fem_models.load_control import LoadControlRun, run_load_control
from fem_models.rig import Rig, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Closure, Superelastic
from fem_models.rig.rig import Friction, notched_tube
from hysteresis import Record, read_record
from hysteresis.arrays import Floats
from validation.tracing import trace_records
from validation.tracing.result import TraceReport, trace_report

TUBES = ("90", "150")
TRAINING: Mapping[str, tuple[int, ...]] = {"90": (1, 2, 3), "150": (1, 2)}
"""Trials of the fit; the other trials of the same tube are held out."""
START: Mapping[str, tuple[float, float, float]] = {
    "E_GPa": (5.0, 20.0, 90.0),
    "depth_mm": (1.36, 1.44, 1.55),
    "plateau_MPa": (50.0, 250.0, 900.0),
    "plateau_modulus_GPa": (0.0, 3.0, 15.0),
    "mu": (0.0, 0.1, 0.6),
}
"""Lower bound, starting value and upper bound of a parameter."""
YOUNG_GPA = 50.0
"""Young's modulus of the metal: 40 to 60 GPa are reported for such tubes (nepacheco/MastersThesis, commit 4f920c7)."""
UNLOADED_N = 0.01
"""Force below which a sample shows the shape at rest."""


@dataclass(frozen=True)
class Stage:
    """A stage of the model.

    Parameters
    ----------
    parameters
        Names of the fitted parameters, of :data:`START`.
    closes
        Notches close.
    hinge
        They close as a hinge at mid-notch, not as an arc.
    roots
        The rings are elastic at the roots of the flexures.
    """

    name: str
    parameters: tuple[str, ...]
    closes: bool = False
    hinge: bool = False
    roots: bool = False


STAGES = (
    Stage("linear", ("E_GPa",)),
    Stage("+ superelastic", ("E_GPa", "plateau_MPa", "plateau_modulus_GPa")),
    Stage("+ capstan friction", ("E_GPa", "plateau_MPa", "plateau_modulus_GPa", "mu")),
    Stage("+ notch closure", ("E_GPa", "plateau_MPa", "plateau_modulus_GPa", "mu"), closes=True),
)
FULL = STAGES[-1]
ROOTED = Stage("all, elastic roots", ("depth_mm", "plateau_MPa", "plateau_modulus_GPa", "mu"), closes=True, roots=True)
"""The metal's modulus with compliant roots; the actual depth of the notches is then the unknown parameter."""
ALTERNATIVES = (
    FULL,
    Stage("flat plateau", ("E_GPa", "plateau_MPa", "mu"), closes=True),
    Stage("no friction", ("E_GPa", "plateau_MPa", "plateau_modulus_GPa"), closes=True),
    Stage("linear, friction, closure", ("E_GPa", "mu"), closes=True),
    Stage("notches close as a hinge", FULL.parameters, closes=True, hinge=True),
)
"""Structures compared by leave-one-out cross-validation over the training trials."""


@dataclass(frozen=True)
class Trials:
    """Samples of trials of one tube: forces (m,), notch angles (m, 5), tip angles (m,) and trial numbers (m,)."""

    tube: str
    force_N: Floats
    notches_deg: Floats
    tip_deg: Floats
    trial: NDArray[np.int64]

    def only(self, trials: tuple[int, ...]) -> Trials:
        """Keep the samples of these trials."""
        keep = np.isin(self.trial, trials)
        return Trials(self.tube, self.force_N[keep], self.notches_deg[keep], self.tip_deg[keep], self.trial[keep])

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the trials."""
        return tuple(np.unique(self.trial).tolist())


@dataclass(frozen=True)
class Error:
    """Root mean square errors, deg: of the tip, and of all notches."""

    tip_deg: float
    notches_deg: float


@dataclass(frozen=True)
class Fit:
    """Parameters of a stage fitted to one tube, their ranges over fits to single training trials, and errors."""

    stage: Stage
    tube: str
    values: dict[str, float]
    ranges: dict[str, tuple[float, float]]
    training: Error
    heldout: Error
    other_tube: Error


def read_trials(folder: Path, tube: str) -> Trials:
    """Read all trials of a tube.

    Raises
    ------
    RecordError
        As :func:`hysteresis.records.record_file.read_record`.
    """
    record: Record = read_record(folder / f"notched-wrist-{tube}.csv")
    assert record.notches_deg is not None
    assert record.cycle is not None
    force = np.maximum(record.drive, 0.0)  # the zero of the load cell drifts by a few mN
    return Trials(tube, force, record.notches_deg, record.angle_deg, record.cycle)


def rest_deg(trials: Trials) -> float:
    """Precurvature of a notch: mean angle of all notches without load."""
    return float(trials.notches_deg[trials.force_N < UNLOADED_N].mean())


def wrist(tube: str, stage: Stage, values: Mapping[str, float], precurvature_deg: float) -> Rig:
    """Rig of a tube at a stage; geometry and assumed values are those of the preset."""
    rig = preset(f"notched-wrist-{tube}")
    assert rig.closure is not None
    assert rig.superelastic is not None
    joint = notched_tube(rig)
    depth_mm = values.get("depth_mm", joint.cut.depth_mm)
    young = values.get("E_GPa", YOUNG_GPA)
    law: Superelastic | None = None
    if "plateau_MPa" in values:
        plateau = values["plateau_MPa"]
        law = replace(
            rig.superelastic,
            plateau_MPa=plateau,
            unloading_plateau_MPa=0.5 * plateau,
            plateau_modulus_GPa=min(values.get("plateau_modulus_GPa", 0.0), 0.9 * young),
        )
    never, closure = 1e3, rig.closure
    if stage.hinge:
        closure = replace(closure, angle_deg=_hinge_angle_deg(rig))
    elif not stage.closes:
        closure = Closure(closure.stiffness_Nmm_per_rad, angle_deg=never)
    return replace(
        rig,
        joint=replace(joint, notch=replace(joint.notch, depth_mm=depth_mm, rigid_roots=not stage.roots)),
        material=replace(rig.material, youngs_modulus_GPa=young),
        superelastic=law,
        friction=Friction(capstan_coefficient=values.get("mu", 0.0)),
        closure=closure,
        precurvature_deg=precurvature_deg,
    )


def _hinge_angle_deg(rig: Rig) -> float:
    """Closure angle of a notch that bends only in its middle, 2 atan(w/2 / lever); an arc has w / lever."""
    half = 0.5 * joint_mechanics(rig).closure_angle_rad  # w/2 over the lever
    return float(np.degrees(2 * np.arctan(half)))


def predict(rig: Rig, force_N: Floats) -> Floats:
    """Predict the notch angles, deg, shape (m, 5), at forces, shape (m,), each reached from rest by loading."""
    levels, which = np.unique(force_N, return_inverse=True)
    return run_load_control(rig, levels).notches_deg[which]


def error(rig: Rig, trials: Trials) -> Error:
    """RMSE of a rig against trials; NaN if it finds no equilibrium."""
    try:
        model = predict(rig, trials.force_N)
    except SolverError:
        return Error(float("nan"), float("nan"))
    return Error(
        float(np.sqrt(np.mean((model.sum(axis=1) - trials.tip_deg) ** 2))),
        float(np.sqrt(np.mean((model - trials.notches_deg) ** 2))),
    )


def fit_parameters(stage: Stage, trials: Trials, precurvature_deg: float) -> dict[str, float]:
    """Fit the parameters of a stage to the notch angles by least squares."""
    low, start, high = np.array([START[name] for name in stage.parameters]).T

    def residual(x: Floats) -> Floats:
        values = dict(zip(stage.parameters, (x * start).tolist(), strict=True))
        try:
            model = predict(wrist(trials.tube, stage, values, precurvature_deg), trials.force_N)
        except SolverError:
            return np.full(trials.notches_deg.size, 90.0)
        return np.asarray((model - trials.notches_deg).ravel())

    found = least_squares(residual, np.ones(low.size), bounds=(low / start, high / start), diff_step=1e-4, xtol=1e-6)
    return dict(zip(stage.parameters, (found.x * start).tolist(), strict=True))


def fit(stage: Stage, own: Trials, other: Trials) -> Fit:
    """Fit a stage to the training trials of one tube; errors there, on held-out trials and on the other tube.

    The prediction of the other tube uses only its geometry and its precurvature.
    """
    training = own.only(TRAINING[own.tube])
    heldout = own.only(tuple(set(own.numbers) - set(TRAINING[own.tube])))
    rest, other_rest = rest_deg(training), rest_deg(other.only(TRAINING[other.tube]))
    values = fit_parameters(stage, training, rest)
    single = [fit_parameters(stage, training.only((k,)), rest) for k in training.numbers]
    rig = wrist(own.tube, stage, values, rest)
    return Fit(
        stage=stage,
        tube=own.tube,
        values=values,
        ranges={name: (min(v[name] for v in single), max(v[name] for v in single)) for name in stage.parameters},
        training=error(rig, training),
        heldout=error(rig, heldout),
        other_tube=error(wrist(other.tube, stage, values, other_rest), other),
    )


def cross_validation(stage: Stage, own: Trials) -> Error:
    """Error of a structure by leave-one-out cross-validation over the training trials."""
    numbers = TRAINING[own.tube]
    errors = []
    for k in numbers:
        rest = own.only(tuple(n for n in numbers if n != k))
        angle = rest_deg(rest)
        values = fit_parameters(stage, rest, angle)
        errors.append(error(wrist(own.tube, stage, values, angle), own.only((k,))))
    tip, notches = np.sqrt(np.mean([[e.tip_deg**2, e.notches_deg**2] for e in errors], axis=0)).tolist()
    return Error(tip, notches)


def repeatability(trials: Trials) -> Error:
    """RMSE of each trial against the mean of the tube's other trials at its forces: a floor for any model."""
    tip, notches = [], []
    for k in trials.numbers:
        own, others = trials.only((k,)), [trials.only((n,)) for n in trials.numbers if n != k]
        inside = own.force_N <= min(o.force_N.max() for o in others)
        force = own.force_N[inside]
        mean = np.mean(
            [[np.interp(force, o.force_N, column) for column in (*o.notches_deg.T, o.tip_deg)] for o in others], axis=0
        )
        tip.append((mean[-1] - own.tip_deg[inside]) ** 2)
        notches.append((mean[:-1].T - own.notches_deg[inside]).ravel() ** 2)
    return Error(float(np.sqrt(np.concatenate(tip).mean())), float(np.sqrt(np.concatenate(notches).mean())))


def traced(folder: Path, tube: str) -> TraceReport:
    """Trace the record of a tube as ``notchbend trace`` does.

    Raises
    ------
    RecordError
        As :func:`hysteresis.records.record_file.read_record`.
    """
    return trace_report(trace_records([read_record(folder / f"notched-wrist-{tube}.csv")]))


def measured_closure_deg(trials: Trials) -> float:
    """Angle at which the notches of a tube are shut: mean over the notches of the largest angle of each."""
    return float(trials.notches_deg.max(axis=0).mean())


def closure_by_geometry_deg(tube: str) -> float:
    """Angle at which the edges of a notch meet: width over the lever, of an arc."""
    return float(np.degrees(joint_mechanics(preset(f"notched-wrist-{tube}")).closure_angle_rad))


@dataclass(frozen=True)
class WristStudy:
    """Everything that the page about the wrists shows.

    Parameters
    ----------
    data
        All trials, by tube.
    fits, rooted
        Fits of :data:`STAGES`, the tubes alternating, and of :data:`ROOTED`.
    rigs
        Rig of each tube at the last stage, with the parameters fitted to the tube itself.
    repeatability
        By tube, of :func:`repeatability`.
    structures
        Errors of :data:`ALTERNATIVES` in cross-validation, by name and tube.
    traced
        What :func:`validation.tracing.trace_records` finds in the record of each tube.
    """

    data: Mapping[str, Trials]
    fits: tuple[Fit, ...]
    rooted: tuple[Fit, ...]
    rigs: Mapping[str, Rig]
    repeatability: Mapping[str, Error]
    structures: Mapping[str, Mapping[str, Error]]
    traced: Mapping[str, TraceReport]

    def loaded(self, tube: str, steps: int) -> LoadControlRun:
        """Run the rig of a tube from rest to its largest measured force in equal steps."""
        return run_load_control(self.rigs[tube], np.linspace(0.0, float(self.data[tube].force_N.max()), steps))


def study(folder: Path) -> WristStudy:
    """Fit all stages to the records of both tubes.

    Raises
    ------
    RecordError
        As :func:`hysteresis.records.record_file.read_record`.
    """
    data = {tube: read_trials(folder, tube) for tube in TUBES}
    pairs = list(zip(TUBES, TUBES[::-1], strict=True))
    fits = tuple(fit(stage, data[own], data[other]) for stage in STAGES for own, other in pairs)
    return WristStudy(
        data=data,
        fits=fits,
        rooted=tuple(fit(ROOTED, data[own], data[other]) for own, other in pairs),
        rigs={
            f.tube: wrist(f.tube, FULL, f.values, rest_deg(data[f.tube].only(TRAINING[f.tube])))
            for f in fits
            if f.stage is FULL
        },
        repeatability={tube: repeatability(data[tube]) for tube in TUBES},
        structures={
            stage.name: {tube: cross_validation(stage, data[tube]) for tube in TUBES} for stage in ALTERNATIVES
        },
        traced={tube: traced(folder, tube) for tube in TUBES},
    )
