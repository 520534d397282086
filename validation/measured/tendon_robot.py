"""A measured tendon robot with a load cell: stroke, tension and bending explained by one rig.

``python -m validation.measured.tendon_robot`` writes the tables into ``docs/validation/tendon-robot.md`` and draws
``docs/images/tendon-robot.png``. The records are not part of the project: ``notchbend data fetch`` gets them, and the
variable NOTCHBEND_MEASURED names their folder.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.holdout import Split
from hysteresis.record import Record
from hysteresis.record_file import read_record
from validation.layer.comparators import Kind, fit_operator
from validation.measured.folder import measured_folder
from validation.separation.tendon_fit import (
    LIMITS,
    NAMES,
    RELATIONS,
    Trace,
    correlations,
    draws,
    experiments,
    fit,
    misses,
    trace,
)
from validation.separation.tendon_parts import Parts, parts
from validation.separation.tendon_rig import TendonRig

TRAINING = ("zero-0.10hz", "zero-0.20hz")
HELD_OUT = ("zero-0.15hz", "zero-0.30hz", "mean-0.02hz")
KINDS: Mapping[Kind, str] = {
    "curve": "curve f(x)",
    "play": "play, f(P[x])",
    "pi": "Prandtl-Ishlinskii of 10, f(x) + sum w P[x]",
    "pi-inside": "Prandtl-Ishlinskii of 10, f(sum w P[x])",
    "pi-leading": "Prandtl-Ishlinskii of 10, f(x) - sum w P[x]",
}
DECLARED: Mapping[str, float] = {"zero_N": 0.0}
"""What the first structure takes as known: the cell shows nothing without load."""
STRUCTURES: Mapping[str, Mapping[str, float]] = {
    "as declared": {},
    "cell shows 0.2 N without load": {"zero_N": 0.2},
    "cell shows 0.4 N without load": {"zero_N": 0.4},
    "no capstan along the robot": {"capstan": 0.0},
    "cell shows 0.2 N, no capstan along the robot": {"zero_N": 0.2, "capstan": 0.0},
    "no constant friction": {"constant_N": 0.0},
    "stretch by the mean of both tensions": {"cell_side": 0.5},
    "no friction before the robot but a constant one": {"entry": 0.0},
    "no loop of the material": {"loop_share": 0.0, "loop_angle_deg": 8.0},
    "no stretch": {"stretch_mm_per_N": 0.0, "cell_side": 1.0},
    "no friction": {"entry": 0.0, "constant_N": 0.0, "capstan": 0.0},
}
AS_GOOD = 1.05  # in training errors: structures that the records do not tell apart
TOP_DEG = 55.0  # bending of the loop that is divided
DRAWS = 200
_GRID_DEG = 2.5
_FROM_DEG = 5.0  # below, the robot has hardly left its stop
_REVERSED = 0.6  # of the largest bending: on the way back, friction has turned round below it
_LEAST_LOOP_DEG = 15.0


# --- capstan constant from the tension ratio -------------------------------------------------------------------------


@dataclass(frozen=True)
class Ratio:
    """ln(loading / unloading tension) = 2 (wrap + slope theta), with intervals of 95 % by blocks of whole loops."""

    wrap: tuple[float, float, float]  # value, low, high
    slope_per_rad: tuple[float, float, float]
    loops: int
    least: float  # ratio at the least and at the largest bending, by the line
    largest: float


def ratios(record: Trace, tension_N: Floats) -> list[tuple[Floats, Floats]]:
    """Of each loop: bending in rad and logarithm of loading over unloading tension there."""
    found = []
    for loop in record.loops():
        bent, tension = record.bending_deg[loop], tension_N[loop]
        top = int(np.argmax(record.stroke_mm[loop]))
        if top < 2 or bent.size - top < 3 or bent[top] < _LEAST_LOOP_DEG:
            continue
        rising, falling = np.maximum.accumulate(bent[: top + 1]), np.maximum.accumulate(bent[top:][::-1])
        grid = np.arange(max(_FROM_DEG, rising[0], falling[0]), _REVERSED * bent[top], _GRID_DEG)
        one, other = np.interp(grid, rising, tension[: top + 1]), np.interp(grid, falling, tension[top:][::-1])
        if grid.size > 1 and other.min() > 0:
            found.append((np.radians(grid), np.log(one / other)))
    return found


def capstan(records: Sequence[Trace], tensions_N: Sequence[Floats], seed: int = 0) -> Ratio:
    """Regress the logarithm of the ratio on bending; draw whole loops for the intervals."""
    loops = [loop for record, t in zip(records, tensions_N, strict=True) for loop in ratios(record, t)]

    def line(chosen: Sequence[tuple[Floats, Floats]]) -> Floats:
        theta, ratio = (np.concatenate([loop[i] for loop in chosen]) for i in range(2))
        return np.polyfit(theta, ratio, 1)[::-1] / 2

    rng = np.random.default_rng(seed)
    drawn = [line([loops[i] for i in rng.integers(0, len(loops), len(loops))]) for _ in range(2000)]
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    wrap, slope = line(loops)
    theta = np.concatenate([t for t, _ in loops])
    ends = [float(np.exp(2 * (wrap + slope * end))) for end in (theta.min(), theta.max())]
    return Ratio(
        (float(wrap), float(low[0]), float(high[0])),
        (float(slope), float(low[1]), float(high[1])),
        len(loops),
        ends[0],
        ends[1],
    )


# --- tables ----------------------------------------------------------------------------------------------------------


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def _columns(record: Trace, relation: int) -> Record:
    x = record.tension_N if relation == 1 else record.stroke_mm
    unit = "N" if relation == 1 else "mm"
    return Record(drive=x, angle_deg=record.measured()[relation], drive_unit=unit, source=record.name)  # type: ignore[arg-type]


def operator_errors(kind: Kind, relation: int, train: Sequence[Trace], judged: Sequence[Trace]) -> list[float]:
    """RMSE of an operator fitted to one relation of the training records, % of the range of each record judged."""
    records = [_columns(record, relation) for record in train]
    everything = [Split(np.ones(r.drive.size, dtype=bool), np.zeros(r.drive.size, dtype=bool), "") for r in records]
    operator = fit_operator(kind, records, everything)
    found = []
    for record in judged:
        one = _columns(record, relation)
        found.append(
            100 * float(np.sqrt(np.mean((operator.predict(one) - one.angle_deg) ** 2)) / np.ptp(one.angle_deg))
        )
    return found


def error_table(rig: TendonRig, data: Mapping[str, Trace]) -> str:
    """Errors of the rig and of operators, relation by relation: training, and each record held out."""
    train, held = [data[n] for n in TRAINING], [data[n] for n in HELD_OUT]
    rows = []
    for i, relation in enumerate(RELATIONS):
        entries = {"one rig for all three": [r.errors(rig)[i] for r in (*train, *held)]}
        entries |= {words: operator_errors(kind, i, train, [*train, *held]) for kind, words in KINDS.items()}
        for words, found in entries.items():
            rms = float(np.sqrt(np.mean(np.square(found[: len(train)]))))
            rows.append([relation, words, f"{rms:.2f}", *(f"{e:.2f}" for e in found[len(train) :])])
    return _table(["relation", "model", "training", *HELD_OUT], rows)


def structure_table(fits: Mapping[str, TendonRig], data: Mapping[str, Trace]) -> str:
    """Structures: training and held-out errors, shares, and the constants that they disagree about."""
    train, held = [data[n] for n in TRAINING], [data[n] for n in HELD_OUT]
    rows = []
    for words, rig in fits.items():
        heldout = np.sqrt(np.mean(np.square([record.errors(rig) for record in held]), axis=0))
        p = parts(rig, TOP_DEG)
        shares = [
            f"{p.tension_width[k]:.2f} / {p.energy[k]:.2f}" for k in ("friction", "tendon_elasticity", "material")
        ]
        cells = [f"{v:.3g}" for v in (rig.entry, rig.capstan, rig.zero_N, rig.stretch_mm_per_N, rig.arm_mm)]
        rows.append([words, f"{training_error(rig, train):.2f}", *(f"{e:.2f}" for e in heldout), *shares, *cells])
    head = ["structure", "training", *(f"held out, {r}" for r in RELATIONS), "friction", "elasticity", "material"]
    return _table([*head, "phi", "mu, 1/rad", "zero, N", "stretch, mm/N", "arm, mm"], rows)


def training_error(rig: TendonRig, train: Sequence[Trace]) -> float:
    """Root mean square over the three relations and the records, % of range."""
    miss = misses(rig, train)
    return 100 * float(np.sqrt(miss @ miss / (len(RELATIONS) * len(train))))


def share_table(best: Parts, drawn: Sequence[Parts], others: Sequence[Parts]) -> str:
    """Shares, 95 % intervals by blocks, and the range over the structures that the records do not tell apart."""
    rows = []
    for name in best.energy:
        row = [name.replace("_", " ")]
        for measure in ("tension_width", "energy", "stroke_width"):
            low, high = np.quantile([getattr(p, measure)[name] for p in drawn], [0.025, 0.975])
            ends = [getattr(p, measure)[name] for p in (best, *others)]
            value = getattr(best, measure)[name]
            row.append(f"{value:.3f} ({low:.3f} to {high:.3f}); {min(ends):.3f} to {max(ends):.3f}")
        rows.append(row)
    return _table(["part", "width, tension to bending", "energy", "width, stroke to bending"], rows)


def constant_table(fits: Mapping[str, TendonRig], drawn: Sequence[TendonRig]) -> str:
    """Values, intervals by blocks, and the range over structures that are as good."""
    best = fits["as declared"]
    low, high = np.quantile([rig.row() for rig in drawn], [0.025, 0.975], axis=0)
    rows = []
    for i, name in enumerate(NAMES):
        free = [rig.row()[i] for rig in fits.values()]
        unit = LIMITS[name][3]
        value = f"{best.row()[i]:.3g} ({low[i]:.3g} to {high[i]:.3g})"
        rows.append([name, value, f"{min(free):.3g} to {max(free):.3g}", unit])
    return _table(["constant", "value, interval by loops", "over structures as good", "unit"], rows)


def ratio_table(rig: TendonRig, data: Mapping[str, Trace]) -> str:
    """Give the line through the logarithm of the tension ratio, as the cell reads and over other zeros."""
    records = list(data.values())
    without = replace(rig, capstan=0.0)
    entries = {
        "measured, as the cell reads": [r.tension_N for r in records],
        "measured, over 0.2 N": [r.tension_N - 0.2 for r in records],
        "measured, over 0.4 N, about the reading at rest": [r.tension_N - 0.4 for r in records],
        "the fitted rig, as its cell reads": [r.run(rig).tension_N for r in records],
        "the same with no capstan along the robot": [r.run(without).tension_N for r in records],
    }
    rows = []
    for words, tensions in entries.items():
        found = capstan(records, tensions)
        cells = [f"{v:.3f} ({a:.3f} to {b:.3f})" for v, a, b in (found.slope_per_rad, found.wrap)]
        rows.append([words, *cells, f"{found.least:.2f} to {found.largest:.2f}", str(found.loops)])
    return _table(["tension", "capstan constant, 1/rad", "wrap before the robot", "ratio, by the line", "loops"], rows)


def blind_words(rig: TendonRig, train: Sequence[Trace]) -> str:
    """Pairs of constants that are known only together, and the direction that the records show least."""
    correlation, weakest = correlations(rig, train)
    pairs = sorted(combinations(range(len(NAMES)), 2), key=lambda ij: -abs(correlation[ij]))
    lines = [
        f"* {NAMES[i]} and {NAMES[j]}: {correlation[i, j]:+.3f}" for i, j in pairs if abs(correlation[i, j]) > 0.95
    ]
    large = [f"{v * LIMITS[n][2]:+.3g} {n}" for n, v in zip(NAMES, weakest, strict=True) if abs(v) > 0.1]
    return "\n".join([*lines, f"* least seen direction: {', '.join(large)}"])


def experiment_table(rig: TendonRig, train: Sequence[Trace]) -> str:
    """Say what a further record would bring, by the information of simulated ones."""
    rows = []
    for e in experiments(rig, train):
        narrowed = ", ".join(f"{name} {factor:.1f}" for name, factor in e.narrower.items() if factor >= 1.5)
        rows.append([e.what, f"{e.gain:.1f}", narrowed or "none"])
    return _table(["record", "gain, nats", "intervals narrower by at least 1.5 times"], rows)


def figure(rig: TendonRig, data: Mapping[str, Trace], path: Path) -> None:
    """Draw the three relations, measured and of the rig, for one training record and two held out."""
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(9.0, 8.0), layout="constrained")
    axes = drawing.subplots(3, 3, squeeze=False)
    labels = (("stroke, mm", "tension, N"), ("tension, N", "bending, deg"), ("stroke, mm", "bending, deg"))
    for row, name in enumerate((TRAINING[0], HELD_OUT[1], HELD_OUT[2])):
        record = data[name]
        for column, predicted in enumerate(record.predictions(rig)):
            x = record.tension_N if column == 1 else record.stroke_mm
            ax = axes[row, column]
            ax.plot(x, record.measured()[column], color="0.6", lw=1.2, label="measured")
            ax.plot(x, predicted, color="C0", lw=0.8, label="rig")
            ax.set(xlabel=labels[column][0], ylabel=labels[column][1])
        axes[row, 0].set_title(f"{name}, {'fitted' if name in TRAINING else 'held out'}", fontsize=9, loc="left")
    axes[0, 0].legend(fontsize=7)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part.png")
    drawing.savefig(part, dpi=130)
    part.replace(path)


def tables(folder: Path, picture: Path) -> str:
    """Run everything; return the tables and draw the figure.

    Raises
    ------
    RecordError
        As :func:`hysteresis.record_file.read_record`.
    """
    names = (*TRAINING, *HELD_OUT)
    data = {n: trace(read_record(folder / f"tendon-robot-{n}.csv")) for n in names}
    train = [data[n] for n in TRAINING]
    best = fit(train, TendonRig(), DECLARED)
    fits = {words: fit(train, best, {**DECLARED, **more}) if more else best for words, more in STRUCTURES.items()}
    limit = AS_GOOD * min(training_error(rig, train) for rig in fits.values())
    good = {words: rig for words, rig in fits.items() if training_error(rig, train) <= limit}
    drawn = draws(best, train, DRAWS, seed=0, fixed=DECLARED)
    shares = [parts(rig, TOP_DEG) for rig in drawn]
    whole = parts(best, TOP_DEG)
    figure(best, data, picture)
    energy = (
        f"Loop from rest to {TOP_DEG:g} deg and back: {whole.width_deg:.1f} deg wide over tension, "
        f"{whole.energy_mJ:.2f} mJ; losses as booked close it to {abs(whole.closure_percent):.1g} %."
    )
    blocks = [
        ("Errors, % of range", error_table(best, data)),
        ("Structures", structure_table(fits, data)),
        ("Constants", constant_table(good, drawn)),
        ("Capstan constant from the tension ratio", ratio_table(best, data)),
        ("Shares", f"{energy}\n\n{share_table(whole, shares, [parts(rig, TOP_DEG) for rig in good.values()])}"),
        ("What the records cannot fix", blind_words(best, train)),
        ("Which record would", experiment_table(best, train)),
    ]
    return "\n\n".join(f"### {title}\n\n{text}" for title, text in blocks)


if __name__ == "__main__":
    docs = Path(__file__).parents[2] / "docs"
    write_page(docs / "validation" / "tendon-robot.md", tables(measured_folder(), docs / "images" / "tendon-robot.png"))
