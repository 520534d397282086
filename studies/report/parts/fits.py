"""Fits for the page: those of a main run, and ``identify.json``; and the figure that ``notchbend identify`` draws."""

from __future__ import annotations

import io
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from hysteresis import Fit
from hysteresis.arrays import Floats
from hysteresis.files import inside, present
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_columns, read_record
from studies.report.charts import Chart, Line, Plate
from studies.report.plots import Drawn, Series, draw, fit_plate
from studies.report.still import STYLE, draw_chart
from studies.report.summary import FitResult
from studies.results import fit, read_result
from studies.results.fit import StoredFit
from studies.results.run import FitEntry, record_of_run

LAYER_WORDS = {
    "saturation_deg": "saturation: largest |h|",
    "slope_after_reversal": "initial slope dh/df after a reversal",
    "reach_deg": "reach: path of f until h has gone 90 % of its way",
    "n": "exponent: sharpness of the transition",
    "asymmetry": "asymmetry: (rising - falling) / sum of the limits of |h|",
}
"""The layer in the form that data can fix, by the names of :func:`hysteresis.fitting.response.response`."""
FIT_COLUMNS = ("drive", "angle_deg", "f_alone_deg", "predicted_deg", "heldout")
_WIDTH_IN, _HEIGHT_IN = 4.2, 3.1
_LEAST_FLOOR_DEG = 1e-3  # a record without noise has no floor


@dataclass(frozen=True)
class FitSection(FitResult):
    """A fit with its charts, one plate a record; ``gain`` is the factor by which the layer reduces the error."""

    title: str
    plates: tuple[Drawn, ...]
    gain: float | None
    layer_words: Mapping[str, str]


def run_fit(folder: Path, item: FitEntry, seed: int, command: str) -> FitSection:
    """Read a fit of a main run; ``command`` is that of the run.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    path = inside(folder / "run.json", "fits[].name", f"identify-{item.name}.csv", [".csv"])
    found = read_result(StoredFit, path.with_suffix(".json"), fit.WHAT)  # a name may have folders in it
    unit = read_record(record_of_run(folder, item.record)).drive_unit
    plate = draw(fit_row(_series(path, "run"), unit, item.name))
    again = f"notchbend identify DIR/records/{item.record}.csv --out DIR/again --seed {seed}"
    # only the run itself fits a record without its rig
    return _section(item, found, (plate,), again if item.name == item.record else command)


def read_fit(folder: Path) -> FitSection | None:
    """Read ``identify.json`` with the samples beside it; None if there is no such file.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    path = folder / "identify.json"
    if not present(path):
        return None
    found = read_result(StoredFit, path, fit.WHAT)
    names = [Path(record).stem for record in found.records] or ["record"]
    files = [folder / f"identify{f'-{i + 1}' if i else ''}.csv" for i in range(len(names))]
    plates = tuple(
        draw(fit_row(_series(file, "identify"), found.drive_unit, name))
        for file, name in zip(files, names, strict=True)
    )
    records = " ".join(map(shlex.quote, found.records)) or "RECORD"
    title = "one fit, its law shared by all records" if len(names) > 1 else ""
    name = " + ".join(names)
    again = f"notchbend identify {records} --out DIR --seed {found.seed}"
    command = again if found.made is None else found.made.command
    return _section(FitEntry(name, name, title), found, plates, command)


def _section(item: FitEntry, found: StoredFit, plates: tuple[Drawn, ...], command: str) -> FitSection:
    before, after, floor = found.baseline.heldout.rmse_deg, found.heldout.rmse_deg, found.noise_floor_deg
    return FitSection(
        name=item.name,
        record=item.record,
        title=item.title,
        fit=found,
        plates=plates,
        gain=before / after if after > 0 else None,
        over_floor=after / floor if floor > _LEAST_FLOOR_DEG else None,
        command=command,
        layer_words=LAYER_WORDS,
    )


def _series(path: Path, command: str) -> Series:
    """Read the samples of a fit by the names of their columns."""
    columns = read_columns(path, FIT_COLUMNS)
    drive, angle, base, predicted, heldout = (columns[name] for name in FIT_COLUMNS)
    if not drive.size:
        raise RecordError(f"{path}: no samples: expected those of a fit; run `notchbend {command}` again")
    return Series(drive, angle, base, predicted, heldout != 0)


def fit_row(series: Series, unit: str, name: str) -> Plate:
    """Chart record and model, the same less the curve without hysteresis, and the residual, fitted and predicted."""
    s, held = series, series.heldout
    loop = fit_plate(series, unit, name).charts[0]
    before, after = s.angle_deg - s.base_deg, s.angle_deg - s.predicted_deg
    less = (
        Line(s.drive, before, "record", "grey", "points"),
        Line(s.drive, s.predicted_deg - s.base_deg, "f + Bouc-Wen", "blue"),
    )
    residual = (
        Line(s.drive[~held], after[~held], "fitted", "blue", "points"),
        Line(s.drive[held], after[held], "predicted (held out)", "orange", "points"),
    )
    most = f"At most {np.abs(before).max():.3g} deg without the layer and {np.abs(after).max():.3g} deg with it"
    return Plate(
        (
            replace(loop, title="Record and model"),
            Chart("Less f alone", loop.x_label, "angle - f alone, deg", less, f"{name}: the loop less f alone."),
            Chart("Residual", loop.x_label, "residual, deg", residual, f"{name}, residual. {most}."),
        ),
        "Record and model; the same less the best curve without hysteresis, which shows a thin loop; residual of the "
        f"samples that were fitted, and of those that were held out and predicted. {most}.",
        columns=3,
    )


def figure_of_fit(found: Fit) -> bytes:
    """Draw the charts of a fit, a row a record, as PNG."""
    rows = [fit_row(_of(found, i), found.drive_unit, name).charts for i, name in enumerate(found.records)]
    with matplotlib.rc_context(STYLE):
        size = (_WIDTH_IN * len(rows[0]), _HEIGHT_IN * len(rows))
        figure = Figure(figsize=size, layout="constrained")
        for axes, charts, name in zip(
            figure.subplots(len(rows), len(rows[0]), squeeze=False), rows, found.records, strict=True
        ):
            for place, chart in zip(axes, charts, strict=True):
                draw_chart(figure, place, chart)
                place.set_title(chart.title, loc="left", fontsize=9.5)
            axes[0].set_title(f"{Path(name).name}: {charts[0].title.lower()}", loc="left", fontsize=9.5)
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=130, metadata={"Software": None})
    return stream.getvalue()


def _of(found: Fit, i: int) -> Series:
    """Give a record of a fit sample by sample: the Bouc-Wen layer, as the files beside ``identify.json`` have it."""
    layer, record = found.bouc_wen or found, found.observed[i]
    predicted: Floats = layer.predict(record.drive, record.time_s, i)
    return Series(record.drive, record.angle_deg, layer.plain(record.drive, i), predicted, found.heldout_masks[i])
