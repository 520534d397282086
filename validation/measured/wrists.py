"""Measured notched wrists as judge: the model stage by stage, fitted to one tube, scored on trials it has not seen.

``python -m validation.measured.wrists`` writes the tables into ``docs/validation/wrists.md`` and draws
``docs/images/wrists.png``. The records are not part of the project: ``notchbend data fetch`` gets them, and the variable
NOTCHBEND_MEASURED names their folder.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fem_models.joint import joint_mechanics
from fem_models.joint.strain import limits_passed, strain_limits
from fem_models.load_control import run_load_control
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Closure, Superelastic
from fem_models.rig.presets import preset
from fem_models.rig.rig import Friction, Rig, notched_tube
from hysteresis.arrays import Floats
from hysteresis.record import Record
from hysteresis.record_file import read_record

TUBES = ("90", "150")
TRAINING: Mapping[str, tuple[int, ...]] = {"90": (1, 2, 3), "150": (1, 2)}
"""Trials that constants are fitted to; the others of the same tube are held out."""
START: Mapping[str, tuple[float, float, float]] = {
    "E_GPa": (5.0, 20.0, 90.0),
    "depth_mm": (1.36, 1.44, 1.55),
    "plateau_MPa": (50.0, 250.0, 900.0),
    "plateau_modulus_GPa": (0.0, 3.0, 15.0),
    "mu": (0.0, 0.1, 0.6),
}
"""Least value, start and greatest value of a constant."""
YOUNG_GPA = 50.0
"""Of the metal: 40 to 60 GPa are reported for such tubes (nepacheco/MastersThesis, commit 4f920c7)."""
UNLOADED_N = 0.01  # below it a sample shows the shape at rest
TARGET_DEG = 4.0
HEADING = "## Tables"


@dataclass(frozen=True)
class Stage:
    """A model: its name, the constants that are fitted, and whether notches close."""

    name: str
    constants: tuple[str, ...]
    closes: bool = False
    hinge: bool = False  # closure of a hinge at mid-notch, in place of that of an arc
    roots: bool = False  # rings elastic where flexures are rooted in them


STAGES = (
    Stage("linear", ("E_GPa",)),
    Stage("+ superelastic", ("E_GPa", "plateau_MPa", "plateau_modulus_GPa")),
    Stage("+ capstan friction", ("E_GPa", "plateau_MPa", "plateau_modulus_GPa", "mu")),
    Stage("+ notch closure", ("E_GPa", "plateau_MPa", "plateau_modulus_GPa", "mu"), closes=True),
)
FULL = STAGES[-1]
ROOTED = Stage("all, elastic roots", ("depth_mm", "plateau_MPa", "plateau_modulus_GPa", "mu"), closes=True, roots=True)
"""The metal's own modulus with the roots' compliance; what is not known then is how deep the notches came out."""
ALTERNATIVES = (
    FULL,
    Stage("flat plateau", ("E_GPa", "plateau_MPa", "mu"), closes=True),
    Stage("no friction", ("E_GPa", "plateau_MPa", "plateau_modulus_GPa"), closes=True),
    Stage("linear, friction, closure", ("E_GPa", "mu"), closes=True),
    Stage("notches close as a hinge", FULL.constants, closes=True, hinge=True),
)
"""Structures that were weighed, by leaving out one training trial at a time."""


@dataclass(frozen=True)
class Trials:
    """Samples of some trials of one tube: forces (m,), notch angles (m, 5) and tip (m,), trial of each (m,)."""

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
        """Trials that are in it."""
        return tuple(np.unique(self.trial).tolist())


@dataclass(frozen=True)
class Error:
    """Root mean square errors, deg: of the tip, and of all notches."""

    tip_deg: float
    notches_deg: float


@dataclass(frozen=True)
class Fit:
    """Constants of a stage from one tube, their range over fits to one training trial each, and their errors."""

    stage: Stage
    tube: str
    values: dict[str, float]
    ranges: dict[str, tuple[float, float]]
    training: Error
    heldout: Error
    other_tube: Error


def measured_folder() -> Path:
    """Where the records are: NOTCHBEND_MEASURED, or beside the project."""
    return Path(os.environ.get("NOTCHBEND_MEASURED", Path(__file__).parents[3] / "shared" / "measured"))


def read_trials(folder: Path, tube: str) -> Trials:
    """Read all trials of a tube.

    Raises
    ------
    RecordError
        As :func:`hysteresis.record_file.read_record`.
    """
    record: Record = read_record(folder / f"notched-wrist-{tube}.csv")
    assert record.notches_deg is not None
    assert record.cycle is not None
    force = np.maximum(record.drive, 0.0)  # the load cell's zero wanders by a few mN
    return Trials(tube, force, record.notches_deg, record.angle_deg, record.cycle)


def rest_deg(trials: Trials) -> float:
    """Precurvature of a notch: the mean of all notches without load."""
    return float(trials.notches_deg[trials.force_N < UNLOADED_N].mean())


def wrist(tube: str, stage: Stage, values: Mapping[str, float], precurvature_deg: float) -> Rig:
    """Make the rig of a tube at a stage; geometry and all that is assumed come from the preset."""
    rig = preset(f"notched-wrist-{tube}")
    assert rig.closure is not None
    assert rig.superelastic is not None
    joint = notched_tube(rig)
    depth_mm = values.get("depth_mm", joint.notch.depth_mm)
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
    """Closure of a notch that bends in its middle alone: 2 atan(w/2 / lever), where an arc has w / lever."""
    half = 0.5 * joint_mechanics(rig).closure_angle_rad  # w/2 over the lever
    return float(np.degrees(2 * np.arctan(half)))


def predict(rig: Rig, force_N: Floats) -> Floats:
    """Notch angles, deg, shape (m, 5), at forces of loading trials, shape (m,): every one is gone up to from rest."""
    levels, which = np.unique(force_N, return_inverse=True)
    return run_load_control(rig, levels).notches_deg[which]


def error(rig: Rig, trials: Trials) -> Error:
    """RMSE of a rig against trials; NaN where it finds no equilibrium."""
    try:
        model = predict(rig, trials.force_N)
    except SolverError:
        return Error(float("nan"), float("nan"))
    return Error(
        float(np.sqrt(np.mean((model.sum(axis=1) - trials.tip_deg) ** 2))),
        float(np.sqrt(np.mean((model - trials.notches_deg) ** 2))),
    )


def fit_constants(stage: Stage, trials: Trials, precurvature_deg: float) -> dict[str, float]:
    """Least squares of the notch angles over the constants of a stage."""
    low, start, high = np.array([START[name] for name in stage.constants]).T

    def misfit(x: Floats) -> Floats:
        values = dict(zip(stage.constants, (x * start).tolist(), strict=True))
        try:
            model = predict(wrist(trials.tube, stage, values, precurvature_deg), trials.force_N)
        except SolverError:
            return np.full(trials.notches_deg.size, 90.0)
        return np.asarray((model - trials.notches_deg).ravel())

    found = least_squares(misfit, np.ones(low.size), bounds=(low / start, high / start), diff_step=1e-4, xtol=1e-6)
    return dict(zip(stage.constants, (found.x * start).tolist(), strict=True))


def fit(stage: Stage, own: Trials, other: Trials) -> Fit:
    """Fit a stage to the training trials of one tube and score it there, on the trials held out, and on another tube.

    Of the other tube only geometry and precurvature are known.
    """
    training = own.only(TRAINING[own.tube])
    heldout = own.only(tuple(set(own.numbers) - set(TRAINING[own.tube])))
    rest, other_rest = rest_deg(training), rest_deg(other.only(TRAINING[other.tube]))
    values = fit_constants(stage, training, rest)
    alone = [fit_constants(stage, training.only((k,)), rest) for k in training.numbers]
    rig = wrist(own.tube, stage, values, rest)
    return Fit(
        stage=stage,
        tube=own.tube,
        values=values,
        ranges={name: (min(v[name] for v in alone), max(v[name] for v in alone)) for name in stage.constants},
        training=error(rig, training),
        heldout=error(rig, heldout),
        other_tube=error(wrist(other.tube, stage, values, other_rest), other),
    )


def left_out(stage: Stage, own: Trials) -> Error:
    """Error of a structure on training trials, each left out of the fit in its turn: what structures are chosen by."""
    numbers = TRAINING[own.tube]
    errors = []
    for k in numbers:
        rest = own.only(tuple(n for n in numbers if n != k))
        angle = rest_deg(rest)
        values = fit_constants(stage, rest, angle)
        errors.append(error(wrist(own.tube, stage, values, angle), own.only((k,))))
    tip, notches = np.sqrt(np.mean([[e.tip_deg**2, e.notches_deg**2] for e in errors], axis=0)).tolist()
    return Error(tip, notches)


def repeatability(trials: Trials) -> Error:
    """RMSE of each trial against the mean of the tube's others at its forces: what no model can go far below."""
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


def error_table(fits: list[Fit]) -> str:
    """Errors after each stage, as Markdown."""
    lines = [
        "| stage | fitted to | training tip / notches | held out tip / notches | other tube tip / notches |",
        "|---|---|---|---|---|",
    ]
    for f in fits:
        cells = [f"{e.tip_deg:.2f} / {e.notches_deg:.2f}" for e in (f.training, f.heldout, f.other_tube)]
        lines.append(f"| {f.stage.name} | '{f.tube}' | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def constants_table(fits: list[Fit]) -> str:
    """Constants with their ranges from trial to trial, as Markdown."""
    lines = ["| stage | fitted to | " + " | ".join(START) + " |", "|---" * (2 + len(START)) + "|"]
    for f in fits:
        cells = [
            f"{f.values[name]:.3g} ({f.ranges[name][0]:.3g} to {f.ranges[name][1]:.3g})" if name in f.values else ""
            for name in START
        ]
        lines.append(f"| {f.stage.name} | '{f.tube}' | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def structure_table(data: Mapping[str, Trials]) -> str:
    """Structures weighed by training trials left out, as Markdown."""
    lines = ["| structure | '90' tip / notches | '150' tip / notches |", "|---|---|---|"]
    for stage in ALTERNATIVES:
        found = [left_out(stage, data[tube]) for tube in TUBES]
        name = "all four stages" if stage is FULL else stage.name
        lines.append(f"| {name} | " + " | ".join(f"{e.tip_deg:.2f} / {e.notches_deg:.2f}" for e in found) + " |")
    return "\n".join(lines)


def strain_table(rigs: Mapping[str, Rig], largest_N: Mapping[str, float]) -> str:
    """Peak strain per load and where limits are passed, as Markdown."""
    lines = ["| tube | limit | strain, % | passed at, N | notch | largest in the run, % | source |", "|---" * 7 + "|"]
    for tube, rig in rigs.items():
        run = run_load_control(rig, np.linspace(0.0, largest_N[tube], 201))
        for p in limits_passed(run.force_N, run.peak_strain, strain_limits(rig)):
            at = "not" if p.drive is None else f"{p.drive:.2f}"
            lines.append(
                f"| '{tube}' | {p.limit.name} ({p.limit.kind}) | {100 * p.limit.strain:.2f} | {at} | {p.joint or ''} | "
                f"{100 * p.largest:.1f} | {p.limit.source} |"
            )
    return "\n".join(lines)


def load_table(rigs: Mapping[str, Rig], largest_N: Mapping[str, float]) -> str:
    """Tip angle and peak strain of the first and the last notch over the force, as Markdown."""
    lines = ["| tube | force, N | tip, deg | peak strain, first notch, % | last notch, % |", "|---|---|---|---|---|"]
    for tube, rig in rigs.items():
        run = run_load_control(rig, np.linspace(0.0, largest_N[tube], 9))
        for force, tip, strain in zip(run.force_N, run.angle_deg, 100 * run.peak_strain, strict=True):
            lines.append(f"| '{tube}' | {force:.2f} | {tip:.1f} | {strain[0]:.2f} | {strain[-1]:.2f} |")
    return "\n".join(lines)


def figure(data: Mapping[str, Trials], fits: list[Fit], path: Path) -> None:
    """Draw tip and notches over the force: measured, each stage, and constants of the other tube."""
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(9.0, 6.4), layout="constrained")
    axes = drawing.subplots(2, 2, squeeze=False)
    for column, tube in enumerate(TUBES):
        trials, rest = data[tube], rest_deg(data[tube].only(TRAINING[tube]))
        force = np.linspace(0.0, float(trials.force_N.max()), 200)
        top, bottom = axes[0, column], axes[1, column]
        seen = np.isin(trials.trial, TRAINING[tube])
        top.plot(trials.force_N[seen], trials.tip_deg[seen], ".", color="0.6", label="training trials")
        top.plot(trials.force_N[~seen], trials.tip_deg[~seen], "x", color="k", ms=4, label="held out")
        for f, colour in zip((f for f in fits if f.tube == tube), ("C1", "C2", "C4", "C0"), strict=True):
            run = run_load_control(wrist(tube, f.stage, f.values, rest), force)
            top.plot(force, run.angle_deg, color=colour, lw=1.2, label=f.stage.name)
        crossed = next(f for f in fits if f.tube != tube and f.stage is FULL)
        run = run_load_control(wrist(tube, FULL, crossed.values, rest), force)
        top.plot(force, run.angle_deg, "--", color="C3", label=f"constants of '{crossed.tube}'")
        for notch in range(trials.notches_deg.shape[1]):
            bottom.plot(trials.force_N, trials.notches_deg[:, notch], ".", ms=3, color=f"C{notch}")
            bottom.plot(force, run.notches_deg[:, notch], color=f"C{notch}", lw=1.0, label=f"notch {notch + 1}")
        top.set(title=f"'{tube}' tube", ylabel="tip, deg", ylim=(0, 1.3 * trials.tip_deg.max()))
        bottom.set(xlabel="tendon force, N", ylabel=f"notch, deg; lines: constants of '{crossed.tube}'")
        top.legend(fontsize=7)
        bottom.legend(fontsize=7)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part.png")
    drawing.savefig(part, dpi=130)
    part.replace(path)


def tables(folder: Path, picture: Path) -> str:
    """Run everything; return the tables and draw the figure."""
    data = {tube: read_trials(folder, tube) for tube in TUBES}
    fits = [
        fit(stage, data[own], data[other]) for stage in STAGES for own, other in zip(TUBES, TUBES[::-1], strict=True)
    ]
    figure(data, fits, picture)
    rooted = [fit(ROOTED, data[own], data[other]) for own, other in zip(TUBES, TUBES[::-1], strict=True)]
    rigs = {
        f.tube: wrist(f.tube, FULL, f.values, rest_deg(data[f.tube].only(TRAINING[f.tube])))
        for f in fits
        if f.stage is FULL
    }
    largest = {tube: float(trials.force_N.max()) for tube, trials in data.items()}
    spread = [f"'{t}' {e.tip_deg:.2f} / {e.notches_deg:.2f}" for t in TUBES if (e := repeatability(data[t]))]
    rest = [f"'{tube}' {rigs[tube].precurvature_deg:.2f} deg" for tube in TUBES]
    parts = [
        ("RMSE in deg after each stage", error_table(fits + rooted)),
        ("One trial against the mean of the tube's others, RMSE in deg of tip / notches", ", ".join(spread)),
        ("Precurvature of a notch", ", ".join(rest)),
        ("Constants, and their range over fits to one training trial each", constants_table(fits + rooted)),
        ("RMSE in deg of training trials left out of the fit one at a time", structure_table(data)),
        ("Peak strain per load, with the constants of the tube itself", load_table(rigs, largest)),
        ("Limits, and the force at which they are passed", strain_table(rigs, largest)),
    ]
    return "\n\n".join(f"### {title}\n\n{table}" for title, table in parts)


def write_page(page: Path, text: str) -> None:
    """Put the tables in place of those that stand after the heading :data:`HEADING` of a page."""
    prose = page.read_text(encoding="utf-8").split(HEADING)[0]
    part = page.with_suffix(".part")
    part.write_text(f"{prose}{HEADING}\n\n{text}\n", encoding="utf-8")
    part.replace(page)


if __name__ == "__main__":
    docs = Path(__file__).parents[2] / "docs"
    write_page(docs / "validation" / "wrists.md", tables(measured_folder(), docs / "images" / "wrists.png"))
