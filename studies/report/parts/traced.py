"""The charts of a trace: residuals before and after, loops, and candidates ranked."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats, Mask
from hysteresis.records.backbone import backbone_of
from hysteresis.records.record import Record
from studies.report.charts import TONES, Bars, Chart, Line, Plate, Span, Tone, finite
from studies.report.plots import ANGLE, LESS
from studies.results.trace import StoredTrace
from studies.results.trace_samples import TraceSamples
from validation.tracing.fitting.ranking import RankedModel

MOST_POINTS = 1800  # of all records in one chart
MOST_LOOPS = 2
_MARGIN = 1.15  # above the largest residual
_ONE_TIME_AXIS = 3.0  # longest record over the shortest one, up to which they share an axis of time
_JUMP = 0.5  # of the drive's range: the drive was reset between two cycles


def trace_command(records: Sequence[str], reference: Sequence[str], out: str = "DIR") -> str:
    """Give the command that traces records; names without a folder are those of the folder where it is run."""
    old = "".join(f" --reference {shlex.quote(name)}" for name in reference)
    return f"notchbend trace {' '.join(map(shlex.quote, records))}{old} --out {out}"


@dataclass(frozen=True)
class _Model:
    """A model of the trace: its name, colour, predicted angle and residual, shape (m,)."""

    name: str
    tone: Tone
    predicted_deg: Floats
    residual_deg: Floats


def trace_plates(result: StoredTrace, samples: TraceSamples) -> tuple[Plate, ...]:
    """Chart a trace from its samples.

    Parameters
    ----------
    samples
        Of the records and then the references of the result.
    """
    names = [name.removesuffix(".csv") for name in (*result.records, *result.reference)]
    held = (*result.held_out, *[False] * len(names))
    labels = [f"{name} (held out)" if out else name for name, out in zip(names, held, strict=False)]
    models = _models(result, samples)
    plates = [_residuals(result, samples, models, labels), _loops(samples, models, labels, held)]
    return (*plates, _candidates(result)) if result.ranking else tuple(plates)


def _models(result: StoredTrace, samples: TraceSamples) -> list[_Model]:
    named = " + ".join(effect.name.replace("_", " ") for effect in result.effects)
    models = [("baseline model", "orange", samples.baseline_deg), (f"with {named}", "blue", samples.augmented_deg)]
    return [_Model(name, tone, p, samples.angle_deg - p) for name, tone, p in models if p is not None]  # type: ignore[arg-type]


def _residuals(result: StoredTrace, samples: TraceSamples, models: Sequence[_Model], labels: Sequence[str]) -> Plate:
    """Chart the residual over drive, time, cycle and angle; models are side by side, on one scale."""
    floor = result.noise_floor_deg or 0.0
    reach = _MARGIN * max(3 * floor, float(np.abs(models[0].residual_deg).max()), 1e-12)
    time_label, time = _time(samples)
    axes = [
        (f"drive, {samples.drive_unit}", samples.drive),
        (time_label, time),
        ("angle, deg", samples.angle_deg),
    ]
    rows = [(label, [_by_record(samples, x, one.residual_deg, labels) for one in models]) for label, x in axes]
    has_cycles = bool(samples.cycle.max() > samples.cycle.min())
    if has_cycles:
        rows.append(("cycle", [_by_cycle(samples, one.residual_deg, labels) for one in models]))
    charts = list[Chart]()
    for label, marks in rows:
        for model, lines in zip(models, marks, strict=True):
            over = label.split(",")[0]
            rms = float(np.sqrt(np.mean(model.residual_deg**2)))
            title = f"{model.name[:1].upper()}{model.name[1:]}, over the {over}"
            alt = f"Residual of the {model.name.removeprefix('with ')} over the {over}: {rms:.3g} deg rms."
            band = Span("y", -2 * floor, 2 * floor)
            # the colours of the records are named once
            chart = Chart(title, label, "residual, deg", (band, *lines), alt, (-reach, reach), legend=not charts)
            charts.append(chart)
    cycles = " Over the cycle, a point is the mean of a cycle and its bar the standard deviation." if has_cycles else ""
    caption = (
        "Residual: measured less predicted angle, without the offset of each record. Band: twice the noise floor; "
        f"where no effect is missing, 95 % of the points are inside, without a pattern.{cycles}"
    )
    return Plate(tuple(charts), caption, columns=2)


def _time(samples: TraceSamples) -> tuple[str, Floats]:
    """Give the name and the values of the time axis: shares of each record where their lengths differ much."""
    ends = np.array([samples.time[samples.record == number].max() for number in np.unique(samples.record)])
    if ends.max() > _ONE_TIME_AXIS * ends.min():
        return "time, share of the record", samples.time / np.maximum(ends, 1e-12)[samples.record - 1]
    return ("time, s" if samples.clock == "time_s" else "sample"), samples.time


def _groups(samples: TraceSamples, labels: Sequence[str]) -> list[tuple[str, Tone, Mask]]:
    """Give the records by colour; with more records than colours all are grey."""
    if len(labels) > len(TONES):
        return [(f"{len(labels)} records", "grey", np.ones(samples.record.size, dtype=bool))]
    return [(name, TONES[i], samples.record == i + 1) for i, name in enumerate(labels)]


def _by_record(samples: TraceSamples, x: Floats, y: Floats, labels: Sequence[str]) -> list[Line]:
    every = slice(None, None, -(-samples.record.size // MOST_POINTS))
    return [Line(x[mine][every], y[mine][every], name, tone, "points") for name, tone, mine in _groups(samples, labels)]


def _by_cycle(samples: TraceSamples, y: Floats, labels: Sequence[str]) -> list[Line]:
    """Give mean and standard deviation of each cycle, records side by side."""
    lines, groups = [], _groups(samples, labels)
    for i, (name, tone, mine) in enumerate(groups):
        numbers, place = np.unique(samples.cycle[mine], return_inverse=True)
        count = np.bincount(place)
        mean = np.bincount(place, y[mine]) / count
        spread: Floats = np.sqrt(np.maximum(np.bincount(place, y[mine] ** 2) / count - mean**2, 0.0))
        at = numbers.astype(float) + 0.12 * (i - (len(groups) - 1) / 2)
        lines.append(Line(at, mean, name, tone, "points", spread))
    return lines


def _loops(samples: TraceSamples, models: Sequence[_Model], labels: Sequence[str], held: Sequence[bool]) -> Plate:
    """Chart two records, one of them held out, whole and less a curve."""
    charts, bases = list[Chart](), list[str]()
    drive = f"drive, {samples.drive_unit}"
    for i in _shown(samples, models[0], held[: len(labels)]):
        mine = samples.record == i + 1
        x, angle = samples.drive[mine], samples.angle_deg[mine]
        base, words = _base(samples, mine)
        bases.append(words)
        breaks = np.flatnonzero(np.diff(samples.cycle[mine]) & (np.abs(np.diff(x)) > _JUMP * np.ptp(x))) + 1
        for title, less, label in ((labels[i], 0 * angle, ANGLE), (f"{labels[i]}, less {words}", base, _less(words))):
            lines = [Line(x, angle - less, "measured", "grey", "points")]
            for one in models:
                along, up = (np.insert(row, breaks, np.nan) for row in (x, one.predicted_deg[mine] - less))
                lines.append(Line(along, up, one.name, one.tone))
            rms = float(np.sqrt(np.mean(models[-1].residual_deg[mine] ** 2)))
            alt = f"{title}: measured and models; residual {rms:.3g} deg rms with the last of them."
            charts.append(Chart(title, drive, label, tuple(lines), alt, legend=not charts))
    caption = (
        f"Measured and predicted angle; on the right the same less {' and '.join(dict.fromkeys(bases))} of the "
        "measurement, which shows small differences."
    )
    return Plate(tuple(charts), caption, columns=2)


def _shown(samples: TraceSamples, baseline: _Model, held: Sequence[bool]) -> list[int]:
    """Choose a held-out record, and of the others the one with the largest residual."""
    square = np.bincount(samples.record - 1, baseline.residual_deg**2) / np.bincount(samples.record - 1)
    rest = sorted((i for i, out in enumerate(held) if not out), key=lambda i: -square[i])
    return [*rest[:1], *(i for i, out in enumerate(held) if out), *rest[1:]][:MOST_LOOPS]


def _base(samples: TraceSamples, mine: Mask) -> tuple[Floats, str]:
    """Give the backbone of a record, or a straight line where it only loads, and its name."""
    drive, angle = samples.drive[mine], samples.angle_deg[mine]
    backbone = backbone_of(Record(drive, angle, cycle=samples.cycle[mine]))
    if backbone is not None:
        return backbone, "the backbone"
    return np.polynomial.Polynomial.fit(drive, angle, 1)(drive), "a straight line"


def _less(words: str) -> str:
    return LESS if words == "the backbone" else f"angle less {words}, deg"


def _candidates(result: StoredTrace) -> Plate:
    """Chart the held-out error of the candidates with intervals, and their criterion above the best."""
    rows, floor = result.ranking, result.noise_floor_deg
    names = _apart([row.name.replace("_", " ") or "baseline model alone" for row in rows])
    tones = tuple(map(_tone, rows))
    value, low, high = (
        finite([getattr(row, key) for row in rows]) for key in ("heldout_rmse_deg", "low_deg", "high_deg")
    )
    marks = [Bars(names, value, "held-out error", low=low, high=high, tones=tones)]
    noise = () if floor is None else (Span("x", floor, floor),)
    best = names[int(np.nanargmin(value))]
    alt = f"The least held-out error is {np.nanmin(value):.3g} deg, of {best}."
    charts = [Chart("Error on held-out data", "held-out error, deg rms", "", (*noise, *marks), alt)]
    above = [row.bic_above_best for row in rows]
    named = "Blue: the model with the named effects; orange" if any(row.chosen for row in rows) else "Orange"
    caption = f"{named}: the baseline. Dotted: noise floor. Whiskers: 95 % intervals"
    if any(one is None for one in above):
        caption += " of folds that each fit has not seen."
    else:
        bars = Bars(names, finite(above), "BIC above the best", tones=tones)
        alike = (Span("x", 0.0, result.alike),) if result.alike else ()
        words = f"{names[int(np.argmin(finite(above)))]} has the lowest BIC."
        charts.append(Chart("BIC above the best", "BIC above the best", "", (*alike, bars), words))
        caption += ". A lower BIC is better; models within the band of the best are not distinguished."
    return Plate(tuple(charts), caption, columns=len(charts))


def _apart(names: Sequence[str]) -> tuple[str, ...]:
    """Add numbers to names that stand for several fits, whose bars would be added up."""
    counts = [names[: i + 1].count(name) for i, name in enumerate(names)]
    return tuple(name if count == 1 else f"{name} ({count})" for name, count in zip(names, counts, strict=True))


def _tone(row: RankedModel) -> Tone:
    return "blue" if row.chosen else "grey" if row.name else "orange"
