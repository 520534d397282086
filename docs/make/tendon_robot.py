"""Writes the tables and the figure of ``docs/validation/tendon-robot.md``: ``python -m docs.make.tendon_robot``."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from docs.make.pages import DOCS, IMAGES, png, put_after_heading, table
from hysteresis.files import write_files
from validation.measured import measured_folder
from validation.measured.tendon_fit import NAMES, PARAMETERS, RELATIONS, correlations, experiments
from validation.measured.tendon_parts import TendonContributions
from validation.measured.tendon_robot import (
    BASELINE,
    HELD_OUT,
    KINDS,
    TOP_DEG,
    TRAINING,
    RobotStudy,
    contributions,
    heldout_errors,
    operator_errors,
    study,
    tension_ratios,
    training_error,
)
from validation.separation.contributions import PARTS
from validation.separation.rig_calibration import CORRELATED

PAGE = DOCS / "validation" / "tendon-robot.md"
PICTURE = IMAGES / "tendon-robot.png"
HEADING = "## Tables"


def tables(found: RobotStudy) -> str:
    """Format everything after the heading of the tables."""
    (whole,) = contributions([found.rig])
    drawn, others = contributions(found.drawn), contributions(list(found.equivalent.values()))
    energy = (
        f"Loop from rest to {TOP_DEG:g} deg and back: width {whole.width_deg:.1f} deg over tension, "
        f"{whole.energy_mJ:.2f} mJ; the losses close the energy balance to {abs(whole.closure_percent):.1g} %."
    )
    blocks = [
        ("Errors, % of range", error_table(found)),
        ("Structures", structure_table(found)),
        ("Parameters", parameter_table(found)),
        ("Capstan coefficient from the tension ratio", ratio_table(found)),
        ("Shares", f"{energy}\n\n{share_table(whole, drawn, others)}"),
        ("What the records do not identify", identifiability(found)),
        ("Information gain of a further record", experiment_table(found)),
    ]
    return "\n\n".join(f"### {title}\n\n{text}" for title, text in blocks)


def error_table(found: RobotStudy) -> str:
    """Errors of the rig and of operators for each relation: training, and each held-out record."""
    evaluated, trained = [*found.training, *found.heldout], len(found.training)
    rows = []
    for i, relation in enumerate(RELATIONS):
        entries = {"one rig for all three": [r.errors(found.rig)[i] for r in evaluated]}
        entries |= {name: operator_errors(kind, i, found.training, evaluated) for kind, name in KINDS.items()}
        for name, errors in entries.items():
            rms = float(np.sqrt(np.mean(np.square(errors[:trained]))))
            rows.append([relation, name, f"{rms:.2f}", *(f"{e:.2f}" for e in errors[trained:])])
    return table(["relation", "model", "training", *HELD_OUT], rows)


def structure_table(found: RobotStudy) -> str:
    """Structures: training and held-out errors, shares, and the parameters in which they differ."""
    rows = []
    for (name, rig), parts in zip(found.fits.items(), contributions(list(found.fits.values())), strict=True):
        shares = [f"{parts.tension_width[k]:.2f} / {parts.energy[k]:.2f}" for k in PARTS[:3]]
        cells = [f"{v:.3g}" for v in (rig.entry, rig.capstan, rig.zero_N, rig.stretch_mm_per_N, rig.arm_mm)]
        errors = [training_error(rig, found.training), *heldout_errors(rig, found.heldout)]
        rows.append([name, *(f"{e:.2f}" for e in errors), *shares, *cells])
    head = ["structure", "training", *(f"held out, {r}" for r in RELATIONS), "friction", "elasticity", "material"]
    return table([*head, "phi", "mu, 1/rad", "zero, N", "stretch, mm/N", "arm, mm"], rows)


def share_table(
    best: TendonContributions, drawn: Sequence[TendonContributions], others: Sequence[TendonContributions]
) -> str:
    """Shares, 95 % intervals of the bootstrap, and ranges over the structures that the records do not distinguish."""
    rows = []
    for name in best.energy:
        row = [name.replace("_", " ")]
        for measure in ("tension_width", "energy", "stroke_width"):
            low, high = np.quantile([getattr(p, measure)[name] for p in drawn], [0.025, 0.975])
            ends = [getattr(p, measure)[name] for p in (best, *others)]
            value = getattr(best, measure)[name]
            row.append(f"{value:.3f} ({low:.3f} to {high:.3f}); {min(ends):.3f} to {max(ends):.3f}")
        rows.append(row)
    return table(["part", "width, tension to bending", "energy", "width, stroke to bending"], rows)


def parameter_table(found: RobotStudy) -> str:
    """Values, intervals of the bootstrap, and ranges over equivalent structures."""
    best = found.equivalent[BASELINE]
    low, high = np.quantile([rig.row() for rig in found.drawn], [0.025, 0.975], axis=0)
    rows = []
    for i, name in enumerate(NAMES):
        each = [rig.row()[i] for rig in found.equivalent.values()]
        value = f"{best.row()[i]:.3g} ({low[i]:.3g} to {high[i]:.3g})"
        rows.append([name, value, f"{min(each):.3g} to {max(each):.3g}", PARAMETERS[name].unit])
    return table(["parameter", "value, interval by loops", "over equivalent structures", "unit"], rows)


def ratio_table(found: RobotStudy) -> str:
    """Regression of the logarithm of the tension ratio."""
    rows = []
    for name, ratio in tension_ratios(found).items():
        cells = [f"{v:.3f} ({a:.3f} to {b:.3f})" for v, a, b in (ratio.slope_per_rad, ratio.wrap)]
        rows.append([name, *cells, f"{ratio.least:.2f} to {ratio.largest:.2f}", str(ratio.loops)])
    head = ["tension", "capstan coefficient, 1/rad", "wrap before the robot", "ratio on the line", "loops"]
    return table(head, rows)


def identifiability(found: RobotStudy) -> str:
    """Pairs of strongly correlated parameters, and the direction that the records identify least."""
    correlation, weakest = correlations(found.rig, found.training)
    pairs = sorted(combinations(range(len(NAMES)), 2), key=lambda ij: -abs(correlation[ij]))
    lines = [
        f"* {NAMES[i]} and {NAMES[j]}: correlation {correlation[i, j]:+.3f}"
        for i, j in pairs
        if abs(correlation[i, j]) > CORRELATED
    ]
    large = [f"{v * PARAMETERS[n].scale:+.3g} {n}" for n, v in zip(NAMES, weakest, strict=True) if abs(v) > 0.1]
    return "\n".join([*lines, f"* least identified direction: {', '.join(large)}"])


def experiment_table(found: RobotStudy) -> str:
    """Information gain of further, simulated records."""
    rows = []
    for e in experiments(found.rig, found.training):
        narrowed = ", ".join(f"{name} {factor:.1f}" for name, factor in e.narrower.items() if factor >= 1.5)
        rows.append([e.what, f"{e.gain:.1f}", narrowed or "none"])
    return table(["record", "gain, nats", "intervals narrower by a factor of at least 1.5"], rows)


def figure(found: RobotStudy) -> bytes:
    """PNG of the three relations, measured and of the rig, for one training record and two held-out records."""
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(9.0, 8.0), layout="constrained")
    axes = drawing.subplots(3, 3, squeeze=False)
    labels = (("stroke, mm", "tension, N"), ("tension, N", "bending, deg"), ("stroke, mm", "bending, deg"))
    for row, name in enumerate((TRAINING[0], HELD_OUT[1], HELD_OUT[2])):
        record = found.data[name]
        for column, predicted in enumerate(record.predictions(found.rig)):
            x = record.tension_N if column == 1 else record.stroke_mm
            ax = axes[row, column]
            ax.plot(x, record.measured()[column], color="0.6", lw=1.2, label="measured")
            ax.plot(x, predicted, color="C0", lw=0.8, label="rig")
            ax.set(xlabel=labels[column][0], ylabel=labels[column][1])
        axes[row, 0].set_title(f"{name}, {'fitted' if name in TRAINING else 'held out'}", fontsize=9, loc="left")
    axes[0, 0].legend(fontsize=7)
    return png(drawing)


def main() -> None:
    """Run the study, and write tables and figure."""
    found = study(measured_folder())
    put_after_heading(PAGE, HEADING, tables(found))
    write_files({PICTURE: figure(found)})


if __name__ == "__main__":
    main()
