"""A stored study for the page: its surfaces, its spread, its sensitivities, and the Pareto front."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hysteresis.record import RecordError
from studies.report.charts import Array, Bars, Chart, Dots, Heat, Line, Plate, Tone, finite
from studies.report.live import as_json, packed

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
UNITS = {"Nmm_per_rad": "Nmm/rad", "N_per_mm": "N/mm", "percent": "%"} | {
    u: u for u in ("mm", "GPa", "MPa", "deg", "mJ", "N", "s")
}


@dataclass(frozen=True)
class StudySection:
    """What the page shows of a study. ``rows``: quantity, unit, least, middle, largest of the cases that are done."""

    size: str
    cases: int
    failed: int
    messages: tuple[str, ...]
    rows: tuple[dict[str, Any], ...]
    plates: tuple[Plate, ...]
    surfaces: str | None
    surface_names: tuple[str, ...]
    facts: dict[str, Any]
    title: str
    engine: str
    command: str


def unit_of(name: str) -> str:
    """Give the unit at the end of a name, as in ``notch.depth_mm``; empty where there is none."""
    return next((unit for end, unit in UNITS.items() if name.endswith(f"_{end}")), "")


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

    try:
        with xr.open_zarr(store, consolidated=False, chunks=None) as opened:
            data = opened.load()
    except Exception as error:  # the store may be broken in as many ways as it has files
        raise RecordError(f"{store}: {' '.join(str(error).split())[:200]}: expected the store of a study") from None
    return _study(data, read_json(folder / "study.json"), _sensitivity(folder / "sensitivity.json"))


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


def _study(data: xr.Dataset, facts: dict[str, Any], sensitivity: Plate | None) -> StudySection:
    status, message = (_texts(data, name) for name in ("status", "message"))
    good = status == "ok"
    quantities = _quantities(data)
    plates = [_samples(data, quantities)] if _is_sampled(data) else _grids(data, quantities)
    plates.append(sensitivity)
    names = [] if _is_sampled(data) else _over_two_axes(data, quantities)
    sizes = " x ".join(f"{size} {_words(str(name)).split(',')[0]}" for name, size in data.sizes.items())
    return StudySection(
        size=f"{status.size} samples" if _is_sampled(data) else sizes,
        cases=status.size,
        failed=int((~good).sum()),
        messages=_reasons(message[~good]),
        rows=tuple(_row(data, name) for name in quantities),
        plates=tuple(plate for plate in plates if plate is not None),
        surfaces=_surfaces(data, names),
        surface_names=tuple(_label(data, name) for name in names),
        facts=facts,
        title=str(data.attrs.get("title", "Study")),
        engine=str(data.attrs.get("engine", "")),
        command=_command(facts),
    )


def _texts(data: xr.Dataset, name: str) -> NDArray[np.object_]:
    """Texts of the cases, shape (cases,)."""
    return np.array([str(text) for text in data[name].values.ravel()], dtype=object)


def _reasons(messages: NDArray[np.object_]) -> tuple[str, ...]:
    """Why cases have no result: a few of the reasons, and how many there are besides."""
    known = sorted({str(message) for message in messages if message})
    more = len(known) - REASONS
    return (*known[:REASONS], *([f"and {more} more; all of them are in study.zarr, `message`"] if more > 0 else []))


def _command(facts: Mapping[str, Any]) -> str:
    """Give the command; the study file stands among the inputs of its folder, the first of them."""
    file = next(iter(facts.get("inputs_sha256", ())), "STUDY.toml")
    return f"notchbend study DIR/inputs/{file} --out DIR"


def _is_sampled(data: xr.Dataset) -> bool:
    return "case" in data.sizes


def _quantities(data: xr.Dataset) -> list[str]:
    """Numeric quantities that have a value anywhere, the most wanted first."""
    out = []
    for name, field in data.data_vars.items():
        numeric = np.issubdtype(field.dtype, np.number) or field.dtype == bool
        if numeric and name not in ("wall_s", "seed") and field.dims and np.isfinite(field.values.astype(float)).any():
            out.append(str(name))
    return sorted(out, key=lambda name: (FIRST.index(name) if name in FIRST else len(FIRST), out.index(name)))


def _label(data: xr.Dataset, name: str) -> str:
    """Name and unit of an axis or a quantity, for a scale."""
    unit = str(data[name].attrs.get("units", "")).replace("1", "") or unit_of(name)
    text = _words(name).split(",")[0]
    return f"{text}, {unit}" if unit else text


def _heading(data: xr.Dataset, name: str) -> str:
    """Say what a quantity is, in the words of the dataset."""
    return _title(str(data[name].attrs.get("long_name", _words(name))))


def _row(data: xr.Dataset, name: str) -> dict[str, Any]:
    values = data[name].values.astype(float)
    values = values[np.isfinite(values)]
    attributes = data[name].attrs
    unit = str(attributes.get("units", "")) or unit_of(name)
    low, middle, high = float(values.min()), float(np.median(values)), float(values.max())
    return {
        "name": name,
        "words": attributes.get("long_name", ""),
        "unit": unit,
        "low": low,
        "middle": middle,
        "high": high,
    }


def _flat(data: xr.Dataset, name: str) -> tuple[Array, dict[str, Any]]:
    """Values over the first two numeric axes, shape (first, second) or (first,), and where the others were held."""
    field = data[name].astype(float)
    axes = [str(dim) for dim in field.dims if np.issubdtype(data[dim].dtype, np.number)][:2]
    held = {str(dim): data[dim].values[data.sizes[dim] // 2] for dim in field.dims if dim not in axes}
    return np.asarray(field.sel(held).transpose(*axes).values, dtype=float), held


def _axes(data: xr.Dataset) -> list[str]:
    return [str(dim) for dim in data.sizes if np.issubdtype(data[dim].dtype, np.number)]


def _grids(data: xr.Dataset, quantities: Sequence[str]) -> list[Plate | None]:
    axes = _axes(data)
    shown = [name for name in quantities if set(axes[:2]) <= set(data[name].dims)][:ROOM]
    if not axes or not shown:
        return []
    charts: list[Chart] = []
    held: dict[str, Any] = {}
    for name in shown:
        values, held = _flat(data, name)
        label = _label(data, name)
        said = (
            f"{label}: from {np.nanmin(values):.3g} to {np.nanmax(values):.3g}." if np.isfinite(values).any() else label
        )
        x = data[axes[0]].values.astype(float)
        if len(axes) == 1:
            line = Line(x, values, label)
            charts.append(Chart(_heading(data, name), _label(data, axes[0]), label, (line,), said))
        else:
            y = data[axes[1]].values.astype(float)
            field = Heat(x, y, values.T, label.rsplit(", ", 1)[-1] if ", " in label else "")
            charts.append(Chart(_heading(data, name), _label(data, axes[0]), _label(data, axes[1]), (field,), said))
    where = "; ".join(f"{_words(dim)} at {value:g}" for dim, value in held.items())
    over = " and ".join(_label(data, axis) for axis in axes[:2])
    caption = f"Quantities of the study over {over}{f', {where}' if where else ''}. Blank where a case has no result."
    return [Plate(tuple(charts), caption, columns=3 if len(charts) > 2 else 2)]


def _title(label: str) -> str:
    return label[:1].upper() + label[1:]


def _inputs(data: xr.Dataset) -> list[str]:
    return [
        str(name)
        for name, field in data.coords.items()
        if name != "case" and field.dims == ("case",) and np.issubdtype(field.dtype, np.number)
    ]


def _samples(data: xr.Dataset, quantities: Sequence[str]) -> Plate | None:
    """Quantities over the first sampled input, coloured by the second."""
    inputs = _inputs(data)
    if not inputs:
        return None
    first, second = inputs[0], inputs[min(1, len(inputs) - 1)]
    x, colour = data[first].values.astype(float), data[second].values.astype(float)
    charts = []
    for name in quantities[:ROOM]:
        y, label = data[name].values.astype(float), _label(data, name)
        notes = tuple(f"case {i}: {label} {v:.4g}" for i, v in enumerate(y)) if y.size <= 2000 else ()
        dots = Dots(x, y, colour, _label(data, second), notes)
        said = f"{label} of {y.size} samples: from {np.nanmin(y):.3g} to {np.nanmax(y):.3g}."
        charts.append(Chart(_heading(data, name), _label(data, first), label, (dots,), said))
    return Plate(tuple(charts), f"Each point is a sampled case; colour: {_label(data, second)}.", columns=2)


def _over_two_axes(data: xr.Dataset, quantities: Sequence[str]) -> list[str]:
    """Quantities that make a surface over the first two axes."""
    axes = _axes(data)[:2]
    if len(axes) < 2 or min(data.sizes[axis] for axis in axes) < 2:
        return []
    return [name for name in quantities if set(axes) <= set(data[name].dims)]


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
        "camera": {"eye": {"x": -1.5, "y": -1.5, "z": 0.9}},
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
                Bars(tuple(_words(input_) for input_ in rows), *_ends([row[key] for row in rows.values()], name, tone))
                for key, name, tone in (("first", "first order", BLUE), ("total", "total", ORANGE))
            ]
            most = max(rows, key=lambda name: rows[name]["total"]["value"])
            said = f"{_words(quantity)} depends most on {_words(most)}."
            charts.append(Chart(_title(_words(quantity).split(",")[0]), "Sobol index", "", tuple(bars), said))
        share = f"{100 * stored['confidence']:g} % intervals"
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise RecordError(f"{path}: {error}: expected the sensitivities of a study") from None
    caption = (
        "Share of a quantity's variance that an input makes alone (first order) and with the others (total), "
        f"with {share}."
    )
    return Plate(tuple(charts[:ROOM]), caption, columns=2) if charts else None


def _ends(rows: Sequence[Mapping[str, float]], name: str, tone: Tone) -> tuple[Array, str, Tone, Array, Array]:
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
    goals = tuple(f"{_words(name)} ({goal})" for name, goal in objectives.items())
    return Front(names, rows, goals, Plate(charts, caption, columns=2))


def _front_chart(a: str, b: str, colour: str, column: Mapping[str, Array], notes: tuple[str, ...]) -> Chart:
    """Two objectives against each other, coloured by a third or by a variable."""
    dots = Dots(column[a], column[b], column[colour], _words(colour), notes)
    ends = (f"{_words(n)} from {column[n].min():.3g} to {column[n].max():.3g}" for n in (a, b))
    title = f"{_words(b).split(',')[0]} against {_words(a).split(',')[0]}"
    return Chart(_title(title), _words(a), _words(b), (dots,), f"{len(notes)} designs: {', '.join(ends)}.")


def _words(name: str) -> str:
    unit = unit_of(name)
    end = next((e for e in UNITS if name.endswith(f"_{e}")), "")
    text = (name.removesuffix(f"_{end}") if end else name).replace("_", " ").replace(".", " ")
    return f"{text}, {unit}" if unit else text
