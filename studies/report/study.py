"""A stored study for the page: fields over its axes, samples, sensitivities, and the Pareto front."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from hysteresis.arrays import Floats
from hysteresis.files import present
from hysteresis.messages import as_given
from hysteresis.plain import optional
from hysteresis.records.record import RecordError
from studies.report.charts import Bars, Chart, Dots, Heat, Line, Plate, Tone, finite
from studies.report.parts.feasible import Feasible, feasibility, region_plate
from studies.report.parts.multiples import multiples
from studies.report.plotly import as_json, packed, tone
from studies.results import read_result
from studies.results.made import Made
from studies.results.manifest import require_complete
from studies.results.study import AxisIndices, Index, ParetoFront, Sensitivities
from studies.units import label_of, unit_of, words_of

if TYPE_CHECKING:
    import xarray as xr

FIRST = (
    "full_scale_angle_deg",
    "loop_width_at_zero_deg",
    "dissipated_mJ",
    "peak_strain_percent",
    "tension_max_N",
    "tension_min_N",
    "loop_width_max_deg",
    "superelastic_margin",
    "fatigue_margin",
)
"""Quantities that are drawn first, in this order."""
ROOM = 6  # charts of a plate
REASONS = 2
BLUE: Tone = "blue"
ORANGE: Tone = "orange"
SAMPLES = 1024
SIDE = 200
"""Largest number of samples, and of values of an axis of a grid, that are drawn; tables are of all cases."""
_FEW = f"The charts show the first {SAMPLES:,} samples, or at most {SIDE} values of an axis; the table is of all cases."


@dataclass(frozen=True)
class StudyFacts:
    """The fields of ``study.json`` that the page uses."""

    versions: Mapping[str, str] = field(default_factory=dict)
    inputs_sha256: Mapping[str, str] = field(default_factory=dict)
    axes: Mapping[str, Any] = field(default_factory=dict)
    state: str = ""
    made: Made | None = optional()


@dataclass(frozen=True)
class QuantityRow:
    """A quantity over the cases with a result: minimum, median and maximum."""

    name: str
    words: str
    unit: str
    low: float
    middle: float
    high: float


@dataclass(frozen=True)
class StudySection:
    """What the page shows of a study."""

    size: str
    cases: int
    failed: int
    pending: int
    messages: tuple[str, ...]
    rows: tuple[QuantityRow, ...]
    plates: tuple[Plate, ...]
    surfaces: str | None
    surface_names: tuple[str, ...]
    versions: Mapping[str, str]
    interrupted: bool
    title: str
    engine: str
    command: str
    feasible: Feasible | None
    made: Made | None


def read_study(folder: Path) -> StudySection | None:
    """Read ``study.zarr`` and ``study.json`` of a folder; None if there is no study.

    Raises
    ------
    RecordError
        One line with the file that cannot be read.
    """
    store = folder / "study.zarr"
    if not present(store):
        return None
    require_complete(store)
    import xarray as xr  # takes a second

    known = folder / "study.json"
    facts = read_result(StudyFacts, known, "the summary of `notchbend study`") if present(known) else StudyFacts()
    sensitivity = _sensitivity(folder / "sensitivity.json")
    try:
        with xr.open_dataset(store, engine="zarr", consolidated=False, chunks=None, cache=False) as opened:
            return _section(opened, _drawn(opened).load(), facts, sensitivity)
    except Exception as error:  # a broken store raises errors of many kinds
        raise RecordError(f"{store}: {as_given(str(error), 120)}: expected the store of a study") from None


def _drawn(data: xr.Dataset) -> xr.Dataset:
    """Select what is drawn: the first samples, or a plane of a grid with at most :data:`SIDE` values an axis."""
    if _is_sampled(data):
        return data.isel(case=slice(SAMPLES))
    places = {
        dim: slice(size // 2, size // 2 + 1) for dim, size in data.sizes.items()
    }  # the plane is in the middle of the other axes
    for axis in _axes(data)[:2]:
        places[axis] = slice(None, None, -(-data.sizes[axis] // SIDE))
    return data.isel(places)


def _section(whole: xr.Dataset, drawn: xr.Dataset, facts: StudyFacts, sensitivity: Plate | None) -> StudySection:
    """Make the section; of ``whole`` one quantity at a time is read."""
    status = whole["status"].values.ravel()
    rows = _rows(whole)
    quantities = [row.name for row in rows]
    sampled, axes = _is_sampled(whole), _axes(whole)
    plates = _samples(drawn, quantities, _inputs(whole, facts)) if sampled else _grids(drawn, quantities)
    if any(whole.sizes[axis] > drawn.sizes[axis] for axis in axes[:2]):
        plates = [replace(plate, caption=f"{plate.caption} {_FEW}") for plate in plates]
    small = () if sampled else multiples(whole, quantities)
    judged, inputs = feasibility(drawn), (_inputs(whole, facts) if sampled else axes)
    if small and judged is not None:  # they show the region
        plates = [*small, *plates]
    elif small:
        plates = [*plates, *small]
    elif judged is not None and len(inputs) > 1:
        plates = [region_plate(drawn, (inputs[0], inputs[1]), judged), *plates]
    has_surface = len(axes) > 1 and min(drawn.sizes[axis] for axis in axes[:2]) > 1
    names = quantities if has_surface else []
    sizes = " x ".join(f"{whole.sizes[axis]} {words_of(axis)}" for axis in axes)
    return StudySection(
        size=f"{status.size} samples" if sampled else sizes,
        cases=status.size,
        failed=int((status == "failed").sum()),
        pending=int((status == "pending").sum()),
        messages=_reasons(whole["message"].values.ravel()[status == "failed"]),
        rows=rows,
        plates=tuple(plate for plate in (*plates, sensitivity) if plate is not None),
        surfaces=_surfaces(drawn, names),
        surface_names=tuple(_label(drawn, name) for name in names),
        versions=facts.versions,
        interrupted=facts.state == "interrupted",
        title=str(whole.attrs.get("title", "Study")),
        engine=str(whole.attrs.get("engine", "")),
        command=_command(facts),
        feasible=feasibility(whole),
        made=facts.made,
    )


def _reasons(messages: NDArray[Any]) -> tuple[str, ...]:
    """Give some reasons why cases have no result, and how many more there are."""
    known = [str(message) for message in np.unique(messages)]
    more = len(known) - REASONS
    return (*known[:REASONS], *([f"and {more} more; study.zarr has all of them in `message`"] if more > 0 else []))


def _command(facts: StudyFacts) -> str:
    """Give the command that made the study, or one that makes it again; the study file is the first of the inputs."""
    if facts.made is not None:
        return facts.made.command
    file = next(iter(facts.inputs_sha256), "STUDY.toml")
    return f"notchbend study DIR/inputs/{file} --out DIR"


def _is_sampled(data: xr.Dataset) -> bool:
    return "case" in data.sizes


def _rows(data: xr.Dataset) -> tuple[QuantityRow, ...]:
    """Give a row for each quantity that any case has, those of :data:`FIRST` first."""
    rows = []
    for name, column in data.data_vars.items():
        if not np.issubdtype(column.dtype, np.number) or name == "wall_s":
            continue
        values = column.values.astype(float)
        values = values[np.isfinite(values)]
        if values.size:
            rows.append(
                QuantityRow(
                    name=str(name),
                    words=column.attrs.get("long_name", ""),
                    unit=str(column.attrs.get("units", "")) or unit_of(str(name)),
                    low=float(values.min()),
                    middle=float(np.median(values)),
                    high=float(values.max()),
                )
            )
    order = {name: place for place, name in enumerate(FIRST)}
    return tuple(sorted(rows, key=lambda row: (order.get(row.name, len(order)), row.name)))


def _label(data: xr.Dataset, name: str) -> str:
    """Give name and unit of an axis or a quantity, for a scale."""
    unit = str(data[name].attrs.get("units", ""))
    return words_of(name) if unit == "1" else label_of(name, unit)


def _heading(data: xr.Dataset, name: str) -> str:
    """Give the description of a quantity in the dataset."""
    return _title(str(data[name].attrs.get("long_name", words_of(name))))


def _plane(data: xr.Dataset, name: str) -> tuple[Floats, dict[str, float]]:
    """Give values over the first two axes, shape (first, second) or (first,), and the values of the other axes."""
    axes = _axes(data)
    held = {axis: data[axis].values[0] for axis in axes[2:]}
    return np.asarray(data[name].sel(held).transpose(*axes[:2]).values, dtype=float), held


def _axes(data: xr.Dataset) -> list[str]:
    return [str(dim) for dim in data["status"].dims]  # in the order of the study file


def _grids(data: xr.Dataset, quantities: Sequence[str]) -> list[Plate]:
    """Chart quantities over the first two axes as fields, or over a single axis as curves."""
    axes = _axes(data)[:2]
    if not quantities:
        return []
    charts, held = [], dict[str, float]()
    ends = [data[axis].values.astype(float) for axis in axes]
    for name in quantities[:ROOM]:
        values, held = _plane(data, name)
        label, unit = _label(data, name), str(data[name].attrs.get("units", "")).removeprefix("1")
        mark = Line(ends[0], values, label) if len(axes) == 1 else Heat(ends[0], ends[1], values.T, unit)
        along = label if len(axes) == 1 else _label(data, axes[1])
        charts.append(Chart(_heading(data, name), _label(data, axes[0]), along, (mark,), f"{label}{_span(values)}."))
    where = "".join(f"; {label_of(dim)} at {value:g}" for dim, value in held.items())
    over = " and ".join(_label(data, axis) for axis in axes)
    caption = f"Quantities of the study over {over}{where}. Blank: a case without a result."
    return [Plate(tuple(charts), caption, columns=3 if len(charts) > 2 else 2)]


def _span(values: Floats) -> str:
    """Give the range of values in words; nothing if there are none."""
    known = values[np.isfinite(values)]
    return f": from {known.min():.3g} to {known.max():.3g}" if known.size else ""


def _title(label: str) -> str:
    return label[:1].upper() + label[1:]


def _inputs(data: xr.Dataset, facts: StudyFacts) -> list[str]:
    """Name the sampled numbers in the order of the study file, which the dataset does not keep."""
    order = {name: place for place, name in enumerate(facts.axes)}
    names = [str(name) for name in data.coords if name != "case"]
    return sorted(names, key=lambda name: (order.get(name, len(order)), name))


def _samples(data: xr.Dataset, quantities: Sequence[str], inputs: Sequence[str]) -> list[Plate]:
    """Chart quantities over the first sampled input, coloured by the second."""
    if not inputs:
        return []
    first, second = inputs[0], inputs[min(1, len(inputs) - 1)]
    x, colour = data[first].values.astype(float), data[second].values.astype(float)
    charts = []
    for name in quantities[:ROOM]:
        y, label = data[name].values.astype(float), _label(data, name)
        notes = tuple(f"case {i}: {label} {v:.4g}" for i, v in enumerate(y))
        dots = Dots(x, y, colour, _label(data, second), notes)
        alt = f"{label} of {y.size} samples{_span(y)}."
        charts.append(Chart(_heading(data, name), _label(data, first), label, (dots,), alt))
    caption = f"Each point is a sampled case; colour: {_label(data, second)}."
    return [Plate(tuple(charts), caption, columns=2)]


def _surfaces(data: xr.Dataset, names: Sequence[str]) -> str | None:
    """Give the surfaces over the first two axes, of which one is visible at a time; None if there are none."""
    if not names:
        return None
    axes = _axes(data)
    x, y = (data[axis].values.astype(float) for axis in axes[:2])
    surfaces = []
    for i, name in enumerate(names):
        values, _ = _plane(data, name)
        label = _label(data, name)
        hover = f"%{{x:.4g}}, %{{y:.4g}}: %{{z:.4g}}<extra>{label}</extra>"
        surfaces.append(
            go.Surface(
                x=packed(x),
                y=packed(y),
                z=packed(values.T),
                name=label,
                visible=i == 0,
                hovertemplate=hover,
                showscale=False,
            )
        )
    camera = {"eye": {"x": -1.6, "y": -1.6, "z": 0.95}, "center": {"x": 0, "y": 0, "z": -0.15}}
    lines = {"backgroundcolor": "rgba(0,0,0,0)", "gridcolor": tone("line"), "zerolinecolor": tone("line")}
    first, second, third = (
        {"title": {"text": label}, **lines} for label in (*(_label(data, axis) for axis in axes[:2]), "")
    )
    return as_json(surfaces, go.Layout(scene={"xaxis": first, "yaxis": second, "zaxis": third, "camera": camera}))


def _sensitivity(path: Path) -> Plate | None:
    """Chart the Sobol indices with their intervals; None if there is no such file.

    Raises
    ------
    RecordError
        A file that does not hold sensitivities.
    """
    if not present(path):
        return None
    stored = read_result(Sensitivities, path, "the sensitivities of `notchbend study`")
    charts = []
    for quantity, found in stored.quantities.items():
        rows = found.indices
        if not rows:
            raise RecordError(f"{path}: quantities: {as_given(quantity, 40)}: indices: expected one for each input")
        bars = (
            _bars(rows, [row.first for row in rows.values()], "first order", BLUE),
            _bars(rows, [row.total for row in rows.values()], "total", ORANGE),
        )
        most = max(rows, key=lambda name: rows[name].total.value)
        alt = f"{label_of(quantity)} depends most on {label_of(most)}."
        charts.append(Chart(_title(words_of(quantity)), "Sobol index", "", bars, alt))
    caption = (
        "Share of the variance of a quantity that an input causes alone (first order) and with the others (total), "
        f"with {100 * stored.confidence:g} % intervals."
    )
    return Plate(tuple(charts[:ROOM]), caption, columns=2) if charts else None


def _bars(rows: Mapping[str, AxisIndices], indices: Sequence[Index], name: str, tone: Tone) -> Bars:
    value, low, high = (finite([getattr(index, key) for index in indices]) for key in ("value", "low", "high"))
    return Bars(tuple(map(label_of, rows)), value, name, tone, low, high)


@dataclass(frozen=True)
class Front:
    """Pareto-optimal designs; ``names`` are the columns of ``rows``."""

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    objectives: tuple[str, ...]
    plate: Plate


def read_front(path: Path) -> Front | None:
    """Read ``pareto.json``; None if there is no such file.

    Raises
    ------
    RecordError
        A file that does not hold a Pareto front.
    """
    if not present(path):
        return None
    stored = read_result(ParetoFront, path, "the front of a Pareto search")
    objectives = {name: objective.goal for name, objective in stored.objectives.items()}
    names = (*stored.variables, *objectives)
    if not stored.front or len(objectives) < 2:
        raise RecordError(f"{path}: front: expected designs, and two or more objectives")
    unordered = [_numbers(design, names, path) for design in stored.front]
    order = np.argsort([row[-len(objectives)] for row in unordered], kind="stable")
    rows = tuple(unordered[i] for i in order)
    column = {name: finite([row[i] for row in rows]) for i, name in enumerate(names)}
    notes = tuple("<br>".join(f"{n} {v:.4g}" for n, v in zip(names, row, strict=True)) for row in rows)
    charts = tuple(
        _front_chart(a, b, next((name for name in (*objectives, *names) if name not in (a, b)), a), column, notes)
        for a, b in list(combinations(objectives, 2))[:4]
    )
    caption = (
        "Each point is a design within the limits for which no other is better in every objective; "
        f"{stored.designs_tried} were tried."
    )
    goals = tuple(f"{label_of(name)} ({goal})" for name, goal in objectives.items())
    return Front(names, rows, goals, Plate(charts, caption, columns=2))


def _numbers(design: Mapping[str, float | None], names: Sequence[str], path: Path) -> tuple[float, ...]:
    """Give variables and objectives of a design; every design of a front has them."""
    for name in names:
        if design.get(name) is None:
            raise RecordError(f"{path}: front: {name}: missing, expected a number in every design")
    return tuple(float(design[name] or 0.0) for name in names)


def _front_chart(a: str, b: str, colour: str, column: Mapping[str, Floats], notes: tuple[str, ...]) -> Chart:
    """Chart two objectives against each other, coloured by a third or by a variable."""
    dots = Dots(column[a], column[b], column[colour], label_of(colour), notes)
    ends = (f"{label_of(n)} from {column[n].min():.3g} to {column[n].max():.3g}" for n in (a, b))
    title = f"{words_of(b)} against {words_of(a)}"
    return Chart(_title(title), label_of(a), label_of(b), (dots,), f"{len(notes)} designs: {', '.join(ends)}.")
