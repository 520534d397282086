"""Results as tables for the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.markup import escape
from rich.table import Table

from hysteresis.plain import to_plain
from studies.results.separation import Contribution, Separation
from studies.results.study import StudySummary

if TYPE_CHECKING:
    from studies.commands.comparison import Models
    from studies.report.summary import Verdict
    from validation.engines import EngineAgreement

LEFT_OUT = ("rig", "versions", "fits", "sha256")
"""Long texts and tables of sources, which a terminal has no room for."""
MARKS = {"holds": "ok", "look": "LOOK", "note": ""}
"""Marks of the states of a verdict: plain letters, which every terminal and log has."""
WIDTH = 80
"""Of a terminal, columns."""
OF_THE_PAPER = "element_error_percent"
"""Of the cross-checks: the error of the paper's two elements, which says something of the paper's rig alone."""


def spaced_table(*columns: str) -> Table:
    """Make a table whose columns stand apart by spaces; names in the first column stay whole, and no cell is cut."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for number, name in enumerate(columns):
        table.add_column(name, overflow="fold", no_wrap=number == 0)
    return table


def values_table(result: object) -> Table:
    """Make one row for each number and text of a result, under its dotted name."""
    table = Table(show_header=False)
    for key, value in dotted(to_plain(result, finite=False)):
        table.add_row(key, f"{value:.6g}" if isinstance(value, float | np.floating) else escape(str(value)))
    return table


def dotted(data: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Give nested values with their dotted names, such as ``loops[0].title``; without :data:`LEFT_OUT`."""
    for key, value in data.items():
        name = f"{prefix}{key}"
        if name in LEFT_OUT:
            continue
        if isinstance(value, Mapping):
            yield from dotted(value, name + ".")
        elif isinstance(value, Sequence) and not isinstance(value, str) and value and isinstance(value[0], Mapping):
            for i, item in enumerate(value):
                yield from dotted(item, f"{name}[{i}].")
        else:
            yield name, value


def models_table(models: Models) -> Table:
    """Make one row for each model: its stiffnesses, and their difference from the reference model."""
    table = spaced_table("model", "bending, Nmm/rad", "axial, N/mm", "shear, N/mm", "s")
    for row in models.models:
        table.add_row(
            row.name,
            _with_difference(row.bending_Nmm_per_rad, row.bending_percent),
            _with_difference(row.axial_N_per_mm, row.axial_percent),
            _with_difference(row.shear_N_per_mm, row.shear_percent),
            f"{row.seconds:.2g}",
        )
    return table


def bent_table(models: Models) -> Table:
    """Make one row for each model: its angles at the tensions of the reference model, and their difference from it."""
    reference = next(row for row in models.models if row.name == models.judge)
    at = [f"deg at {bent.tendon_N:.3g} N" for bent in reference.bent]
    table = spaced_table("model", *at, "tip, mm")
    for row in models.models:
        x, y = row.bent[-1].tip_mm
        angles = (_with_difference(bent.angle_deg, bent.angle_percent) for bent in row.bent)
        table.add_row(row.name, *angles, f"{x:.2f}, {y:.2f}")
    return table


def engines_table(rigs: Sequence[EngineAgreement], *, of_the_paper: bool) -> Table:
    """Make one row for each comparison of the engines, one column for each preload."""
    rows = [to_plain(one, finite=False) for one in rigs]
    table = spaced_table("engines", *(f"{row['preload_N']:g} N" for row in rows))
    for name in rows[0] if rows else ():
        if name not in ("rig", "preload_N") and (of_the_paper or name != OF_THE_PAPER):
            table.add_row(name, *(f"{row[name]:.6g}" for row in rows))
    return table


def notches_table(models: Models) -> Table | None:
    """Make one row for each notch: its bending stiffness in every model; None where all notches are equal."""
    if not models.models[0].notches:
        return None
    table = spaced_table("notch", "depth, mm", "width, mm", *(row.name for row in models.models))
    for number, one in enumerate(models.models[0].notches):
        own = [row.notches[number] for row in models.models]
        values = [below(notch.bending_Nmm_per_rad, notch.bending_percent) for notch in own]
        table.add_row(str(one.number), f"{one.depth_mm:.4g}", f"{one.width_mm:.4g}", *values)
    table.caption = "bending of every notch, Nmm/rad; below it the difference from the first model"
    return table


def verdict_lines(verdicts: Iterable[Verdict]) -> list[str]:
    """Give the summary rows of a report: the mark of the state, what was judged, the value, and below it words."""
    out = []
    for verdict in verdicts:
        out.append(f"{MARKS[verdict.state]:<6}{verdict.title:<25} {verdict.value}")
        out.append(textwrap.fill(verdict.words, WIDTH, initial_indent=6 * " ", subsequent_indent=6 * " "))
    return out


def contributions_table(result: Separation) -> Table:
    """Make one row for each part of the loop, with intervals if the rig is calibrated on records."""
    table = spaced_table("part", "share of energy", "mJ a cycle", "share of width", "deg")
    for name, part in result.contributions.items():
        table.add_row(
            name,
            _share(part, "share"),
            f"{part.dissipated_mJ:.4g}",
            _share(part, "width_share"),
            f"{part.width_deg:.4g}",
        )
    return table


def study_table(summary: StudySummary) -> Table:
    """Make one row for each quantity: its minimum and its maximum, and where they are."""
    title = f"{summary.title}: {summary.cases} cases, {summary.computed} computed now, {summary.failures.count} failed"
    table = spaced_table("quantity", "unit", "minimum", "at", "maximum", "at")
    table.title = title
    for name, row in summary.quantities.items():
        ends = [(f"{end.value:.4g}", _point(end.at)) for end in (row.min, row.max)]
        table.add_row(name, row.units, *(cell for pair in ends for cell in pair))
    return table


def _point(point: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in point.items())


def _share(part: Contribution, quantity: str) -> str:
    value, limits = part.share_of(quantity), part.interval(quantity)
    if value is None:
        return "-"
    return f"{value:.3f}" + (f" ({limits[0]:.3f} to {limits[1]:.3f})" if limits else "")


def below(value: float, percent: float) -> str:
    """Give a value and below it a difference, for tables of many columns."""
    return f"{value:.4g}\n{percent:+.1f} %"


def _with_difference(value: float | None, percent: float | None) -> str:
    if value is None or percent is None:
        return "-"
    return f"{value:.4g} ({percent:+.1f} %)"
