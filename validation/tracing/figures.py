"""Figures of a trace, as PNG: the residual before and after, the loops, and the candidates ranked."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from hysteresis.attempts import attempt
from hysteresis.records.record import Record
from validation.tracing.effect import SampleInputs
from validation.tracing.fitting.fitted import Fitted, rms
from validation.tracing.fitting.ranking import best_candidates, with_interval
from validation.tracing.outcome import Candidate, Trace
from validation.tracing.result import UNNAMED, record_name

BEFORE, AFTER, MEASURED, BAND = "#d55e00", "#0072b2", "#7a7f87", "#e9ebee"
RECORDS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
"""Colours for colour-blind readers (Okabe and Ito 2008); with more than six records all are grey."""
MARKERS = ("o", "s", "^", "D", "v", "P")
STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e6ea",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
}
_DPI = 150
_WIDTH_IN = 11.0
_MOST_POINTS = 600  # of a record in a panel
_MOST_LOOPS = 2
_MARGIN = 1.15  # above the largest residual
_ONE_TIME_AXIS = 3.0  # longest record over the shortest one, up to which they share an axis of time


Drawing = Callable[[], bytes]
"""Draws a figure as PNG."""


def drawings(trace: Trace) -> dict[str, tuple[Drawing, str]]:
    """Give what draws each figure of a trace, by file name, with its caption."""
    named = trace.verdict not in UNNAMED
    what = "the baseline and the augmented model" if named else "the baseline model"
    out: dict[str, tuple[Drawing, str]] = {
        "trace-residual.png": (
            lambda: residual_figure(trace),
            f"Residual of {what}: measured less predicted angle, without the offset of each record. The band is two "
            "standard deviations of the noise: where no effect is missing, 95 % of the points are inside, without a "
            "pattern. In the third column a point is the mean of a cycle, and its bar the standard deviation.",
        ),
        "trace-loops.png": (
            lambda: loop_figure(trace),
            f"Left: measured angle, and {what}. Right: the same less a {_curve(trace)[1]} fitted to the measurement, "
            "to show small differences.",
        ),
    }
    if best_candidates(trace):
        out["trace-candidates.png"] = (
            lambda: candidates_figure(trace),
            "Error on held-out data, with a 95 % interval"
            + (
                ": of folds that each fit has not seen."
                if trace.baseline.fold_errors is not None
                else " (left). Right: how much higher the BIC is than the best one; models in the shaded range are not "
                "distinguished."
            ),
        )
    return out


def figures(trace: Trace, failed: list[str] | None = None) -> dict[str, tuple[bytes, str]]:
    """Draw all figures of a trace: file name -> PNG and caption; ``failed`` takes a line for one that is missing."""
    drawn, failed = dict[str, tuple[bytes, str]](), [] if failed is None else failed
    for name, (draw, caption) in attempt("no figures", lambda: drawings(trace), dict[str, Any](), failed).items():
        png = attempt(f"no {name}", draw, None, failed)
        if png is not None:
            drawn[name] = (png, caption)
    return drawn


def residual_figure(trace: Trace, dpi: int = _DPI) -> bytes:
    """Residual over drive, time, cycle and angle: the baseline above, the augmented model below, on one scale."""
    named = trace.verdict not in UNNAMED
    rows = [(trace.baseline, "baseline model")]
    if named:
        rows.append((trace.augmented, f"with {' + '.join(trace.augmented.names)}"))
    reach = _MARGIN * max(3 * trace.floor.deg, *(float(np.abs(r).max()) for r in trace.baseline.residuals))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH_IN, 2.5 * len(rows) + 0.9), layout="constrained")
        panels = figure.subplots(len(rows), 4, sharey=True, sharex="col", squeeze=False)
        for axes, (fitted, title) in zip(panels, rows, strict=True):
            _residual_row(axes, trace, fitted)
            axes[0].set_ylim(-reach, reach)
            axes[0].set_ylabel("residual, deg")
            axes[0].set_title(
                f"{title}: {rms(fitted.error_deg):.3g} deg rms", loc="left", fontsize=10, fontweight="bold"
            )
        time, _ = _time_axis(trace.baseline.model.problem.inputs)
        names = (f"drive, {trace.records[0].drive_unit}", time, "cycle", "angle, deg")
        for axis, name in zip(panels[-1], names, strict=True):
            axis.set_xlabel(name)
        _record_legend(figure, panels[0][0], trace)
        return _png(figure, dpi)


def _residual_row(axes: Sequence[Axes], trace: Trace, fitted: Fitted) -> None:
    problem = fitted.model.problem
    band = 2 * trace.floor.deg
    for axis in axes:
        axis.axhspan(-band, band, color=BAND, zorder=0)
        axis.axhline(0, color="#9aa0a8", lw=0.7)
    count, (_, lengths) = len(problem.inputs), _time_axis(problem.inputs)
    for i, (inputs, angle, residual) in enumerate(zip(problem.inputs, problem.observed, fitted.residuals, strict=True)):
        some = slice(None, None, max(1, math.ceil(residual.size / _MOST_POINTS)))
        style: dict[str, Any] = {"color": _colour(i, count), "alpha": 0.75, "ms": 1.8, "lw": 0, "marker": "o", "mew": 0}
        axes[0].plot(inputs.drive[some], residual[some], **style)
        axes[1].plot(inputs.time_s[some] / lengths[i], residual[some], **style)
        axes[3].plot(angle[some], residual[some], **style)
        cycles = np.unique(inputs.cycle)
        means = [residual[inputs.cycle == c].mean() for c in cycles]
        spread = [residual[inputs.cycle == c].std() for c in cycles]
        at = cycles + 0.12 * (i - (count - 1) / 2)
        mark = MARKERS[i % len(MARKERS)]
        axes[2].errorbar(at, means, spread, color=_colour(i, count), fmt=mark, ms=4, lw=1, capsize=0)
    first, last = (pick(int(pick(s.cycle)) for s in problem.inputs) for pick in (min, max))
    axes[2].set_xlim(first - 0.5, last + 0.5)
    axes[2].xaxis.set_major_locator(MaxNLocator(integer=True))


def _time_axis(inputs: Sequence[SampleInputs]) -> tuple[str, list[float]]:
    """Name of the time axis, and the divisor of the times of each record: its length where lengths differ much."""
    lengths = [float(s.time_s[-1]) for s in inputs]
    if max(lengths) > _ONE_TIME_AXIS * min(lengths):
        return "time / length of the record", lengths
    return "time, s" if all(s.timed for s in inputs) else "sample", [1.0] * len(lengths)


def _record_legend(figure: Figure, axis: Axes, trace: Trace) -> None:
    count = len(trace.records)
    if count == 1:
        return
    for i, record in enumerate(trace.records[: len(RECORDS)]):
        held = trace.baseline.holdout.is_held_out(i)
        name = _label(record, i) + (" (held out)" if held else "")
        axis.plot([], [], "o", ms=5, color=_colour(i, count), label=name)
    figure.legend(loc="outside upper center", ncols=min(count, 4), fontsize=9)


def loop_figure(trace: Trace) -> bytes:
    """Loops of two records, one of them held out: measured, baseline and augmented model, whole and less a curve."""
    shown = _loops_shown(trace)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH_IN, 3.2 * len(shown)), layout="constrained")
        panels = figure.subplots(len(shown), 2, squeeze=False, width_ratios=(1, 1.7))
        for (whole, less), i in zip(panels, shown, strict=True):
            _loop_row(whole, less, trace, i)
        for axis in panels[-1]:
            axis.set_xlabel(f"drive, {trace.records[0].drive_unit}")
        figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=9)
        return _png(figure)


def _curve(trace: Trace) -> tuple[int, str]:
    """Degree and name of the curve that is subtracted; records that only load have no loop, and keep theirs."""
    return (1, "straight line") if trace.records[0].drive_unit == "N" else (3, "cubic of the drive")


def _loops_shown(trace: Trace) -> list[int]:
    """Choose the held-out record, and of the others the one with the largest residual."""
    count = len(trace.records)
    whole = [i for i in range(count) if trace.baseline.holdout.is_held_out(i)]
    rest = sorted((i for i in range(count) if i not in whole), key=lambda i: -rms(trace.baseline.residuals[i]))
    return [*rest[:1], *whole, *rest[1:]][:_MOST_LOOPS]


def _loop_row(whole: Axes, less: Axes, trace: Trace, i: int) -> None:
    inputs, angle = trace.baseline.model.problem.inputs[i], trace.baseline.model.problem.observed[i]
    curve = np.polynomial.Polynomial.fit(inputs.drive, angle, _curve(trace)[0])(inputs.drive)
    breaks = np.flatnonzero((np.diff(inputs.cycle) != 0) & (np.abs(np.diff(inputs.drive)) > 0.5 * np.ptp(inputs.drive)))
    lines = [(angle - trace.baseline.residuals[i], BEFORE, "baseline model")]
    if trace.verdict not in UNNAMED:
        lines.append((angle - trace.augmented.residuals[i], AFTER, f"with {' + '.join(trace.augmented.names)}"))
    for axis, base in ((whole, np.zeros_like(angle)), (less, curve)):
        axis.plot(inputs.drive, angle - base, "o", ms=2.4, mew=0, color=MEASURED, alpha=0.7, label="measured")
        for predicted, colour, name in lines:
            x, y = (np.insert(row, breaks + 1, np.nan) for row in (inputs.drive, predicted - base))
            axis.plot(x, y, color=colour, label=name)
    held = trace.baseline.holdout.is_held_out(i)
    title = _label(trace.records[i], i) + (", held out" if held else "")
    whole.set_title(title, loc="left", fontsize=10, fontweight="bold")
    whole.set_ylabel("angle, deg")
    less.set_ylabel(f"angle less a {_curve(trace)[1]}, deg")


def candidates_figure(trace: Trace) -> bytes:
    """Candidates ranked: held-out error with its interval, and BIC above the best one."""
    by_folds = trace.baseline.fold_errors is not None
    best = best_candidates(trace)
    names = [" + ".join(c.names[len(trace.baseline.names) :]) for c in best]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH_IN, 1.3 + 0.34 * (len(best) + 1)), layout="constrained")
        panels = figure.subplots(1, 1 if by_folds else 2, sharey=True, squeeze=False)[0]
        left = panels[0]
        places = np.arange(len(best) + 1)
        for at, fitted in zip(places, [*(c.fitted for c in best), trace.baseline], strict=True):
            value, half = with_interval(fitted)
            chosen = bool(trace.names) and fitted.names == trace.augmented.names and fitted is not trace.baseline
            colour = AFTER if chosen else BEFORE if fitted is trace.baseline else MEASURED
            left.errorbar(value, at, xerr=half, fmt="o", ms=6 if chosen else 5, color=colour, lw=1.6, capsize=3)
        left.axvline(trace.floor.deg, color="#333", lw=1, ls=":")
        left.annotate(
            "noise", (trace.floor.deg, 1.0), (0, 2), xycoords=("data", "axes fraction"),
            textcoords="offset points", ha="center", va="bottom", fontsize=8, color="#333",
        )  # fmt: skip
        left.set_xlim(left=0)
        left.set_xlabel("held-out error, deg rms")
        for right in panels[1:]:
            _bic_above_best(right, trace, best, places)
        left.set_yticks(places, [*names, "baseline model alone"])
        left.invert_yaxis()
        left.grid(axis="y", visible=False)
        return _png(figure)


def _bic_above_best(axis: Axes, trace: Trace, best: Sequence[Candidate], places: Any) -> None:
    """Draw how much higher the BIC of each candidate is than the best one's, the baseline last."""
    above = [best[0].delta_bic - c.delta_bic for c in best] + [best[0].delta_bic]
    colours = [AFTER if c.fitted is trace.augmented else MEASURED for c in best] + [BEFORE]
    axis.axvspan(0, trace.alike, color=BAND, zorder=0)
    axis.hlines(places, 0, above, color=colours, lw=1.2)
    axis.scatter(above, places, color=colours, s=28, zorder=3)
    axis.set_xscale("symlog", linthresh=10)
    axis.set_xlim(left=min(-0.4, 1.1 * min(above)))
    axis.set_xlabel("BIC above the best")
    axis.grid(axis="y", visible=False)
    axis.tick_params(axis="y", length=0)


def _label(record: Record, i: int) -> str:
    """Name of a record, short."""
    return record_name(record.source, i).removesuffix(".csv")


def _colour(i: int, count: int) -> str:
    return MEASURED if count > len(RECORDS) else RECORDS[i]


def _png(figure: Figure, dpi: int = _DPI) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi, metadata={"Software": None})
    return stream.getvalue()
