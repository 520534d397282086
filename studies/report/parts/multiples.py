"""A study over three or more axes as small multiples: a chart for each value of the third, with the feasible region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hysteresis.arrays import Floats, Mask
from studies.report.charts import Chart, Heat, Line, Plate
from studies.report.parts.feasible import ANGLE, WIDTH, Feasible, feasibility
from studies.units import label_of, unit_of, words_of

if TYPE_CHECKING:
    import xarray as xr

AXES = ("notch.depth_mm", "preload_N", "notch.count")
"""Horizontal axis, vertical axis and the axis of the charts, where a study has them."""
MOST_CHARTS, MOST_VALUES = 6, 24
_PLATES = 2


def multiples(data: xr.Dataset, quantities: Sequence[str]) -> tuple[Plate, ...]:
    """Chart a grid of a study; none unless three of its axes have two or more values.

    The width of the loop is given as a share of the full scale, by which designs are compared. Of axes beside the
    three, the value in the middle is taken.

    Parameters
    ----------
    data
        A study over a grid; only what is drawn is read.
    quantities
        Names of the quantities with a result, the most telling ones first.
    """
    axes = _three(data)
    if axes is None or not quantities:
        return ()
    part = data.isel({str(dim): _places(str(dim), size, axes) for dim, size in data.sizes.items()}).load()
    judged = feasibility(part)
    fields = _fields(part, quantities)
    first, *others = (_plate(part, axes, name, field, judged) for name, field in list(fields.items())[:_PLATES])
    return (replace(first, caption=f"{first.caption}{_region(judged)}"), *others)


def _three(data: xr.Dataset) -> tuple[str, str, str] | None:
    """Give the axes of the charts: those of :data:`AXES`, and others of the study in their place."""
    wide = [str(dim) for dim in data["status"].dims if data.sizes[dim] > 1]
    if len(wide) < 3:
        return None
    others = iter([axis for axis in wide if axis not in AXES])
    along, up, each = (axis if axis in wide else next(others) for axis in AXES)
    return along, up, each


def _places(dim: str, size: int, axes: Sequence[str]) -> list[int]:
    """Choose the values of an axis that are drawn; one in the middle where it is none of the three."""
    if dim not in axes:
        return [size // 2]
    most = MOST_CHARTS if dim == axes[2] else MOST_VALUES
    return sorted(set(np.linspace(0, size - 1, min(size, most)).round().astype(int).tolist()))


def _fields(data: xr.Dataset, quantities: Sequence[str]) -> dict[str, Floats]:
    """Give the values that are drawn by their labels, over all dimensions of the data."""
    known = {name: data[name].values.astype(float) for name in quantities}
    out = dict[str, Floats]()
    if ANGLE in known and WIDTH in known:
        angle = np.where(known[ANGLE] > 0, known[ANGLE], np.nan)
        out["width of the loop, % of the full scale"] = 100 * known[WIDTH] / angle
    for name, values in known.items():
        unit = str(data[name].attrs.get("units", "")).removeprefix("1") or unit_of(name)
        out[", ".join(filter(None, [str(data[name].attrs.get("long_name", words_of(name))), unit]))] = values
    return out


def _plate(data: xr.Dataset, axes: tuple[str, str, str], label: str, field: Floats, judged: Feasible | None) -> Plate:
    along, up, each = axes
    x, y = (data[axis].values.astype(float) for axis in (along, up))
    finite = field[np.isfinite(field)]
    scale = (float(finite.min()), float(finite.max())) if finite.size else None
    charts = list[Chart]()
    for place, value in enumerate(data[each].values.tolist()):
        z = _layer(data, field, axes, place)
        marks: list[Heat | Line] = [Heat(x, y, z, "", scale)]
        title = f"{words_of(each)} {value:g} {unit_of(each)}".rstrip()
        done = np.isfinite(z)
        alt = f"{title}: {label}" + (f" from {z[done].min():.3g} to {z[done].max():.3g}" if done.any() else "")
        if judged is not None:
            kept = _layer(data, judged.mask.astype(float), axes, place) > 0
            marks += _marks(x, y, done, kept)
            marks += _best(judged, axes, value)
            alt += f", {int(kept.sum())} of {int(done.sum())} designs within all limits"
        charts.append(Chart(title, label_of(along), label_of(up), tuple(marks), f"{alt}.", legend=not charts))
    others = [str(dim) for dim in data["status"].dims if str(dim) not in axes]
    held = "".join(f"; {label_of(dim)} at {data[dim].values[0]:g}" for dim in others)
    columns = 2 if len(charts) in (2, 4) else 3
    caption = f"One scale of colours for all charts{held}."
    return Plate(tuple(charts), caption, columns, heading=f"{label[:1].upper()}{label[1:]}")


def _layer(data: xr.Dataset, field: Floats, axes: tuple[str, str, str], place: int) -> Floats:
    """Give a field at one value of the third axis, shape (up, along)."""
    along, up, each = axes
    array = data["status"].copy(data=field)
    return np.asarray(array.isel({each: place}).transpose(..., up, along).values, dtype=float).reshape(
        data.sizes[up], data.sizes[along]
    )


def _marks(x: Floats, y: Floats, done: Mask, kept: Mask) -> list[Line]:
    """Mark the designs within all limits, and those outside."""
    across, up = np.meshgrid(x, y)
    out = done & ~kept
    return [
        Line(across[kept], up[kept], "within all limits", "green", "dots"),
        Line(across[out], up[out], "breaks a limit", "orange", "crosses"),
    ]


def _best(judged: Feasible, axes: tuple[str, str, str], value: float) -> list[Line]:
    """Mark the best design that keeps all limits, if it is in the chart of a value of the third axis."""
    along, up, each = axes
    best = judged.best
    if best is None or not best.feasible or best.at[each] != value:
        return []
    return [Line(np.array([best.at[along]]), np.array([best.at[up]]), "narrowest loop", "purple", "star")]


def _region(judged: Feasible | None) -> str:
    if judged is None:
        return ""
    limits = "; ".join(limit.words for limit in judged.limits)
    best = "" if judged.kept == 0 else " Star: the narrowest loop for its full scale of these."
    return f" {judged.kept} of the {judged.cases} designs drawn keep all limits ({limits}).{best}"
