"""Writes the tables and the figure of ``docs/validation/wrists.md``: ``python -m docs.make.wrists``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from docs.make.pages import DOCS, IMAGES, png, put_after_heading, table
from fem_models.joint.strain import limits_passed, strain_limits
from fem_models.load_control import run_load_control
from hysteresis.files import write_files
from validation.measured import measured_folder
from validation.measured.wrist_folds import LeftOutTrial, leave_trials_out, pooled_deg
from validation.measured.wrists import (
    FULL,
    START,
    TRAINING,
    TUBES,
    Error,
    Fit,
    Trials,
    WristStudy,
    closure_by_geometry_deg,
    measured_closure_deg,
    rest_deg,
    study,
    wrist,
)

PAGE = DOCS / "validation" / "wrists.md"
PICTURE = IMAGES / "wrists.png"
HEADING = "## Tables"
_COLOURS = ("C1", "C2", "C4", "C0")


LeftOut = Mapping[str, Sequence[LeftOutTrial]]
"""By tube."""


def tables(found: WristStudy, left_out: LeftOut) -> str:
    """Format everything after the heading of the tables."""
    fits = [*found.fits, *found.rooted]
    spread = [f"'{tube}' {_error(error)}" for tube, error in found.repeatability.items()]
    rest = [f"'{tube}' {found.rigs[tube].precurvature_deg:.2f} deg" for tube in TUBES]
    parts = [
        ("Traced without help: RMSE in deg on the held-out trials", trace_table(found)),
        (
            "Traced without each trial in turn, which is then predicted: RMSE of the tip in deg",
            left_out_table(left_out),
        ),
        ("Closure of a notch, traced, by geometry and measured, deg", closure_table(found)),
        ("RMSE in deg after each stage", error_table(fits)),
        ("One trial against the mean of the tube's others, RMSE in deg of tip / notches", ", ".join(spread)),
        ("Precurvature of a notch", ", ".join(rest)),
        ("Parameters and their ranges over fits to single training trials", parameter_table(fits)),
        ("RMSE in deg by leave-one-out cross-validation over the training trials", structure_table(found.structures)),
        ("Peak strain under load, with the parameters of the tube itself", load_table(found)),
        ("Limits, and the force at which they are exceeded", strain_table(found)),
    ]
    return "\n\n".join(f"### {title}\n\n{text}" for title, text in parts)


def trace_table(found: WristStudy) -> str:
    """Format what the tracer names in the record of each tube, and the errors of tip and notches before and after."""
    rows = []
    for tube, report in found.traced.items():
        names = " + ".join(f"`{effect.name}`" for effect in report.effects) or "none"
        errors = [
            f"{own['before']['heldout']['rmse_deg']:.2f} -> {own['after']['heldout']['rmse_deg']:.2f}"
            for own in report.channels.values()
        ]
        rows.append([f"'{tube}'", f"{report.verdict}: {names}", f"{report.noise_floor_deg:.2f}", *errors])
    heads = [name.replace("_", " ").replace("angle", "tip") for name in next(iter(found.traced.values())).channels]
    return table(["tube", "verdict", "trials repeat to", *heads], rows)


def left_out_table(left_out: LeftOut) -> str:
    """Format what the other trials name, and how well they predict each trial."""
    rows = []
    for tube, trials in left_out.items():
        for one in trials:
            names = " + ".join(f"`{name}`" for name in one.named) or "none"
            closure = "-" if one.closure_deg is None else f"{one.closure_deg:.1f}"
            rows.append([f"'{tube}'", f"{one.trial}", names, closure, f"{one.before_deg:.2f} -> {one.after_deg:.2f}"])
        before, after = pooled_deg(trials)
        rows.append([f"'{tube}'", "all", "", "", f"{before:.2f} -> {after:.2f}"])
    return table(["tube", "trial left out", "named by the others", "closure, deg", "tip"], rows)


def closure_table(found: WristStudy) -> str:
    """Format the closure angle of one notch: as traced, by geometry without a free parameter, and as measured."""
    rows = []
    for tube, report in found.traced.items():
        angles = [e.parameters["angle_deg"] for e in report.effects if e.name == "notch_closure"]
        traced = "not named" if not angles else f"{angles[0].value:.1f} ({angles[0].low:.1f} to {angles[0].high:.1f})"
        by_geometry, measured = closure_by_geometry_deg(tube), measured_closure_deg(found.data[tube])
        rows.append([f"'{tube}'", traced, f"{by_geometry:.1f}", f"{measured:.1f}"])
    return table(["tube", "traced (95 %)", "w/(R_o + offset)", "mean of the largest angles"], rows)


def error_table(fits: Sequence[Fit]) -> str:
    """Errors after each stage."""
    rows = [[f.stage.name, f"'{f.tube}'", *(_error(e) for e in (f.training, f.heldout, f.other_tube))] for f in fits]
    head = ["training tip / notches", "held-out tip / notches", "other tube tip / notches"]
    return table(["stage", "fitted to", *head], rows)


def parameter_table(fits: Sequence[Fit]) -> str:
    """Parameters with their ranges from trial to trial."""
    rows = []
    for f in fits:
        cells = [
            f"{f.values[name]:.3g} ({f.ranges[name][0]:.3g} to {f.ranges[name][1]:.3g})" if name in f.values else ""
            for name in START
        ]
        rows.append([f.stage.name, f"'{f.tube}'", *cells])
    return table(["stage", "fitted to", *START], rows)


def structure_table(structures: Mapping[str, Mapping[str, Error]]) -> str:
    """Structures by their cross-validation."""
    rows = [
        ["all four stages" if name == FULL.name else name, *(_error(errors[tube]) for tube in TUBES)]
        for name, errors in structures.items()
    ]
    return table(["structure", *(f"'{tube}' tip / notches" for tube in TUBES)], rows)


def load_table(found: WristStudy) -> str:
    """Tip angle and peak strain of the first and the last notch over the force."""
    rows = []
    for tube in TUBES:
        run = found.loaded(tube, 9)
        for force, tip, strain in zip(run.force_N, run.angle_deg, 100 * run.peak_strain, strict=True):
            rows.append([f"'{tube}'", f"{force:.2f}", f"{tip:.1f}", f"{strain[0]:.2f}", f"{strain[-1]:.2f}"])
    return table(["tube", "force, N", "tip, deg", "peak strain, first notch, %", "last notch, %"], rows)


def strain_table(found: WristStudy) -> str:
    """Limits of Nitinol, and where they are exceeded."""
    rows = []
    for tube in TUBES:
        run = found.loaded(tube, 201)
        for p in limits_passed(run.force_N, run.peak_strain, strain_limits(found.rigs[tube])):
            rows.append(
                [
                    f"'{tube}'",
                    f"{p.limit.name} ({p.limit.kind})",
                    f"{100 * p.limit.strain:.2f}",
                    "never" if p.drive is None else f"{p.drive:.2f}",
                    str(p.joint or ""),
                    f"{100 * p.largest:.1f}",
                    p.limit.source,
                ]
            )
    return table(["tube", "limit", "strain, %", "exceeded at, N", "notch", "largest in the run, %", "source"], rows)


def _error(error: Error) -> str:
    return f"{error.tip_deg:.2f} / {error.notches_deg:.2f}"


def figure(data: Mapping[str, Trials], fits: Sequence[Fit]) -> bytes:
    """PNG of tip and notches over the force: measured, each stage, and the parameters of the other tube."""
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(9.0, 6.4), layout="constrained")
    axes = drawing.subplots(2, 2, squeeze=False)
    for column, tube in enumerate(TUBES):
        trials, rest = data[tube], rest_deg(data[tube].only(TRAINING[tube]))
        force = np.linspace(0.0, float(trials.force_N.max()), 200)
        top, bottom = axes[0, column], axes[1, column]
        training = np.isin(trials.trial, TRAINING[tube])
        top.plot(trials.force_N[training], trials.tip_deg[training], ".", color="0.6", label="training trials")
        top.plot(trials.force_N[~training], trials.tip_deg[~training], "x", color="k", ms=4, label="held out")
        for f, colour in zip((f for f in fits if f.tube == tube), _COLOURS, strict=True):
            run = run_load_control(wrist(tube, f.stage, f.values, rest), force)
            top.plot(force, run.angle_deg, color=colour, lw=1.2, label=f.stage.name)
        crossed = next(f for f in fits if f.tube != tube and f.stage is FULL)
        run = run_load_control(wrist(tube, FULL, crossed.values, rest), force)
        top.plot(force, run.angle_deg, "--", color="C3", label=f"parameters of '{crossed.tube}'")
        for notch in range(trials.notches_deg.shape[1]):
            bottom.plot(trials.force_N, trials.notches_deg[:, notch], ".", ms=3, color=f"C{notch}")
            bottom.plot(force, run.notches_deg[:, notch], color=f"C{notch}", lw=1.0, label=f"notch {notch + 1}")
        top.set(title=f"'{tube}' tube", ylabel="tip, deg", ylim=(0, 1.3 * trials.tip_deg.max()))
        bottom.set(xlabel="tendon force, N", ylabel=f"notch, deg; lines: parameters of '{crossed.tube}'")
        top.legend(fontsize=7)
        bottom.legend(fontsize=7)
    return png(drawing)


def main() -> None:
    """Run the study, and write tables and figure."""
    found = study(measured_folder())
    left_out = {tube: leave_trials_out(measured_folder(), tube) for tube in TUBES}
    put_after_heading(PAGE, HEADING, tables(found, left_out))
    write_files({PICTURE: figure(found.data, found.fits)})


if __name__ == "__main__":
    main()
