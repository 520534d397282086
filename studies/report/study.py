"""A stored study for the page: its surfaces, its spread, its sensitivities, and the Pareto front."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hysteresis.arrays import Floats
from hysteresis.record import RecordError
from studies.report.charts import Bars, Chart, Dots, Heat, Line, Plate, Tone, finite
from studies.report.live import as_json, packed
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
"""Drawn first, in this order; a plate has room for six."""
ROOM = 6
REASONS = 2
BLUE: Tone = "blue"
ORANGE: Tone = "orange"
SAMPLES = 1024
SIDE = 200
"""Drawn of a sample, and of each axis of a grid; the numbers beside the pictures are of all cases."""
_FEW = f"Drawn are the first {SAMPLES:,} samples, or at most {SIDE} values of an axis; the table is of all cases."


@dataclass(frozen=True)
class StudySection:
    """What the page shows of a study. ``rows``: quantity, unit, least, middle, largest of the cases that are done."""

    size: str
    cases: int
    failed: int
    pending: int
    messages: tuple[str, ...]
    rows: tuple[dict[str, Any], ...]
    plates: tuple[Plate, ...]
    surfaces: str | None
    surface_names: tuple[str, ...]
    facts: dict[str, Any]
    title: str
    engine: str
    command: str


def read_study(folder: Path) -> StudySection | None:
    """Read ``study.zarr`` and ``study.json`` of a folder; None where there is no study.

    Raises
    ------
    RecordError
        One line with the file that cannot be read.
    """
    store = folder / "study.zarr"
    if not store.exists():
        return None
    import xarray as xr  # takes a second

    facts, sensitivity = read_json(folder / "study.json"), _sensitivity(folder / "sensitivity.json")
    try:
        with xr.open_dataset(store, engine="zarr", consolidated=False, chunks=None, cache=False) as opened:
            return _section(opened, _drawn(opened).load(), facts, sensitivity)
    except Exception as error:  # the store may be broken in as many ways as it has files
        raise RecordError(f"{store}: {' '.join(str(error).split())[:200]}: expected the store of a study") from None


def _drawn(data: xr.Dataset) -> xr.Dataset:
    """Leave what is drawn: the first samples, spread as all of them are, or a plane of a grid, not too fine."""
    if _is_sampled(data):
        return data.isel(case=slice(SAMPLES))
    places = {dim: slice(size // 2, size // 2 + 1) for dim, size in data.sizes.items()}  # the plane is in the middle
    for axis in _axes(data)[:2]:
        places[axis] = slice(None, None, -(-data.sizes[axis] // SIDE))
    return data.isel(places)


def read_json(path: Path) -> dict[str, Any]:
    """Read a table of JSON; an absent file is an empty one.

    Raises
    ------
    RecordError
        A file that is no table of JSON.
    """
    if not path.exists():
        return {}
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise RecordError(f"{path}: {error}: expected a table in JSON") from None


def _section(whole: xr.Dataset, drawn: xr.Dataset, facts: dict[str, Any], sensitivity: Plate | None) -> StudySection:
    """Put the section together; of ``whole`` one quantity at a time is read."""
    status = whole["status"].values.ravel()
    rows = _rows(whole)
    quantities = [row["name"] for row in rows]
    sampled, axes = _is_sampled(whole), _axes(whole)
    plates = _samples(drawn, quantities, _inputs(whole, facts)) if sampled else _grids(drawn, quantities)
    if any(whole.sizes[axis] > drawn.sizes[axis] for axis in axes[:2]):
        plates = [replace(plate, caption=f"{plate.caption} {_FEW}") for plate in plates]
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
        facts=facts,
        title=str(whole.attrs.get("title", "Study")),
        engine=str(whole.attrs.get("engine", "")),
        command=_command(facts),
    )


def _reasons(messages: NDArray[Any]) -> tuple[str, ...]:
    """Why cases have no result: a few of the reasons, and how many there are besides."""
    known = [str(message) for message in np.unique(messages)]
    more = len(known) - REASONS
    return (*known[:REASONS], *([f"and {more} more; all of them are in study.zarr, `message`"] if more > 0 else []))


def _command(facts: Mapping[str, Any]) -> str:
    """Give the command; the study file stands among the inputs of its folder, the first of them."""
    file = next(iter(facts.get("inputs_sha256", ())), "STUDY.toml")
    return f"notchbend study DIR/inputs/{file} --out DIR"


def _is_sampled(data: xr.Dataset) -> bool:
    return "case" in data.sizes


def _rows(data: xr.Dataset) -> tuple[dict[str, Any], ...]:
    """Give a row for each quantity that has a value anywhere, the most wanted first."""
    rows = []
    for name, field in data.data_vars.items():
        if not np.issubdtype(field.dtype, np.number) or name == "wall_s":
            continue
        values = field.values.astype(float)
        values = values[np.isfinite(values)]
        if values.size:
            rows.append({
                "name": str(name),
                "words": field.attrs.get("long_name", ""),
                "unit": str(field.attrs.get("units", "")) or unit_of(str(name)),
                "low": float(values.min()),
                "middle": float(np.median(values)),
                "high": float(values.max()),
            })  # fmt: skip
    order = {name: place for place, name in enumerate(FIRST)}
    return tuple(sorted(rows, key=lambda row: (order.get(row["name"], len(order)), row["name"])))


def _label(data: xr.Dataset, name: str) -> str:
    """Name and unit of an axis or a quantity, for a scale."""
    unit = str(data[name].attrs.get("units", ""))
    return words_of(name) if unit == "1" else label_of(name, unit)


def _heading(data: xr.Dataset, name: str) -> str:
    """Say what a quantity is, in the words of the dataset."""
    return _title(str(data[name].attrs.get("long_name", words_of(name))))


def _flat(data: xr.Dataset, name: str) -> tuple[Floats, dict[str, Any]]:
    """Values over the first two axes, shape (first, second) or (first,), and where the others are held."""
    axes = _axes(data)
    held = {axis: data[axis].values[0] for axis in axes[2:]}
    return np.asarray(data[name].sel(held).transpose(*axes[:2]).values, dtype=float), held


def _axes(data: xr.Dataset) -> list[str]:
    return [str(dim) for dim in data["status"].dims]  # in the order of the study file


def _grids(data: xr.Dataset, quantities: Sequence[str]) -> list[Plate]:
    """Quantities over the first two axes as fields, or over the one axis as curves."""
    axes = _axes(data)[:2]
    if not quantities:
        return []
    charts, held = [], dict[str, Any]()
    ends = [data[axis].values.astype(float) for axis in axes]
    for name in quantities[:ROOM]:
        values, held = _flat(data, name)
        label, unit = _label(data, name), str(data[name].attrs.get("units", "")).removeprefix("1")
        mark = Line(ends[0], values, label) if len(axes) == 1 else Heat(ends[0], ends[1], values.T, unit)
        along = label if len(axes) == 1 else _label(data, axes[1])
        charts.append(Chart(_heading(data, name), _label(data, axes[0]), along, (mark,), f"{label}{_span(values)}."))
    where = "".join(f"; {label_of(dim)} at {value:g}" for dim, value in held.items())
    over = " and ".join(_label(data, axis) for axis in axes)
    caption = f"Quantities of the study over {over}{where}. Blank where a case has no result."
    return [Plate(tuple(charts), caption, columns=3 if len(charts) > 2 else 2)]


def _span(values: Floats) -> str:
    """Say from where to where values go; nothing where there are none."""
    known = values[np.isfinite(values)]
    return f": from {known.min():.3g} to {known.max():.3g}" if known.size else ""


def _title(label: str) -> str:
    return label[:1].upper() + label[1:]


def _inputs(data: xr.Dataset, facts: Mapping[str, Any]) -> list[str]:
    """Name what was sampled, in the order of the study file; a dataset has no order of its own."""
    order = {name: place for place, name in enumerate(facts.get("axes", ()))}
    names = [str(name) for name in data.coords if name != "case"]
    return sorted(names, key=lambda name: (order.get(name, len(order)), name))


def _samples(data: xr.Dataset, quantities: Sequence[str], inputs: Sequence[str]) -> list[Plate]:
    """Quantities over the first sampled input, coloured by the second."""
    if not inputs:
        return []
    first, second = inputs[0], inputs[min(1, len(inputs) - 1)]
    x, colour = data[first].values.astype(float), data[second].values.astype(float)
    charts = []
    for name in quantities[:ROOM]:
        y, label = data[name].values.astype(float), _label(data, name)
        notes = tuple(f"case {i}: {label} {v:.4g}" for i, v in enumerate(y))
        dots = Dots(x, y, colour, _label(data, second), notes)
        said = f"{label} of {y.size} samples{_span(y)}."
        charts.append(Chart(_heading(data, name), _label(data, first), label, (dots,), said))
    caption = f"Each point is a sampled case; colour: {_label(data, second)}."
    return [Plate(tuple(charts), caption, columns=2)]


def _surfaces(data: xr.Dataset, names: Sequence[str]) -> str | None:
    """Give the surfaces over the first two axes, one of them shown at a time; None where there are none."""
    if not names:
        return None
    axes = _axes(data)
    x, y = (data[axis].values.astype(float) for axis in axes[:2])
    traces = []
    for i, name in enumerate(names):
        values, _ = _flat(data, name)
        traces.append(
            {
                "type": "surface",
                "x": packed(x),
                "y": packed(y),
                "z": packed(values.T),
                "colorscale": "Cividis",
                "visible": i == 0,
                "showscale": False,
                "name": _label(data, name),
                "hovertemplate": f"%{{x:.4g}}, %{{y:.4g}}: %{{z:.4g}}<extra>{_label(data, name)}</extra>",
            }
        )
    axis = {"gridcolor": "$line", "backgroundcolor": "rgba(0,0,0,0)", "zerolinecolor": "$line"}
    scene = {
        "xaxis": {"title": {"text": _label(data, axes[0])}, **axis},
        "yaxis": {"title": {"text": _label(data, axes[1])}, **axis},
        "zaxis": {"title": {"text": ""}, **axis},
        "camera": {"eye": {"x": -1.6, "y": -1.6, "z": 0.95}, "center": {"x": 0, "y": 0, "z": -0.15}},
    }
    return as_json(traces, {"scene": scene})


def _sensitivity(path: Path) -> Plate | None:
    """Sobol indices with their intervals; None where there is no such file.

    Raises
    ------
    RecordError
        Another file.
    """
    stored = read_json(path)
    if not stored:
        return None
    charts = []
    try:
        for quantity, found in stored["quantities"].items():
            rows = found["indices"]
            bars = [
                Bars(tuple(map(label_of, rows)), *_ends([row[key] for row in rows.values()], name, tone))
                for key, name, tone in (("first", "first order", BLUE), ("total", "total", ORANGE))
            ]
            most = max(rows, key=lambda name: rows[name]["total"]["value"])
            said = f"{label_of(quantity)} depends most on {label_of(most)}."
            charts.append(Chart(_title(words_of(quantity)), "Sobol index", "", tuple(bars), said))
        share = f"{100 * stored['confidence']:g} % intervals"
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise RecordError(f"{path}: {error}: expected the sensitivities of a study") from None
    caption = (
        "Share of a quantity's variance that an input makes alone (first order) and with the others (total), "
        f"with {share}."
    )
    return Plate(tuple(charts[:ROOM]), caption, columns=2) if charts else None


def _ends(rows: Sequence[Mapping[str, float]], name: str, tone: Tone) -> tuple[Floats, str, Tone, Floats, Floats]:
    value, low, high = (finite([row[key] for row in rows]) for key in ("value", "low", "high"))
    return value, name, tone, low, high


@dataclass(frozen=True)
class Front:
    """Designs that no other beats; ``names`` are the columns of ``rows``."""

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    objectives: tuple[str, ...]
    plate: Plate


def read_front(path: Path) -> Front | None:
    """Read ``pareto.json``; None where there is none.

    Raises
    ------
    RecordError
        Another file.
    """
    stored = read_json(path)
    if not stored:
        return None
    try:
        objectives = {name: str(row["goal"]) for name, row in stored["objectives"].items()}
        names = (*stored["variables"], *objectives)
        rows = tuple(tuple(float(point[name]) for name in names) for point in stored["front"])
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise RecordError(f"{path}: {error}: expected the front of a Pareto search") from None
    if not rows or len(objectives) < 2:
        raise RecordError(f"{path}: front: expected designs, and two or more objectives")
    order = np.argsort([row[-len(objectives)] for row in rows], kind="stable")
    rows = tuple(rows[i] for i in order)
    column = {name: finite([row[i] for row in rows]) for i, name in enumerate(names)}
    notes = tuple("<br>".join(f"{n} {v:.4g}" for n, v in zip(names, row, strict=True)) for row in rows)
    charts = tuple(
        _front_chart(a, b, next(name for name in (*objectives, *names) if name not in (a, b)), column, notes)
        for a, b in list(combinations(objectives, 2))[:4]
    )
    caption = (
        "Each point is a design that keeps its limits and that no other beats in every objective; "
        f"{stored['designs_tried']} were tried."
    )
    goals = tuple(f"{label_of(name)} ({goal})" for name, goal in objectives.items())
    return Front(names, rows, goals, Plate(charts, caption, columns=2))


def _front_chart(a: str, b: str, colour: str, column: Mapping[str, Floats], notes: tuple[str, ...]) -> Chart:
    """Two objectives against each other, coloured by a third or by a variable."""
    dots = Dots(column[a], column[b], column[colour], label_of(colour), notes)
    ends = (f"{label_of(n)} from {column[n].min():.3g} to {column[n].max():.3g}" for n in (a, b))
    title = f"{words_of(b)} against {words_of(a)}"
    return Chart(_title(title), label_of(a), label_of(b), (dots,), f"{len(notes)} designs: {', '.join(ends)}.")
