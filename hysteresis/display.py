"""How results show themselves: HTML tables in a notebook (``_repr_html_``), lines on a terminal (``print``)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from textwrap import fill

SCREEN = 80
"""Width of a terminal, columns."""


def on_screen(lines: Iterable[str]) -> str:
    """Return lines that are at most :data:`SCREEN` columns wide; what continues a line is indented further."""
    return "\n".join(
        fill(line.lstrip(), SCREEN, initial_indent=indent, subsequent_indent=indent + "  ", break_long_words=False)
        for line in lines
        for indent in [" " * (len(line) - len(line.lstrip()))]
    )


def html_table(caption: str, rows: Iterable[Sequence[str]], head: Sequence[str] = (), notes: Iterable[str] = ()) -> str:
    """Return a table as HTML.

    Parameters
    ----------
    caption
        Text above the table.
    rows
        Cells of each row; the first cell is its header.
    head
        Names of the columns, if they have any.
    notes
        Lines below the table.
    """
    lines = ["<table>", f'<caption style="text-align:left">{escape(caption)}</caption>']
    if head:
        lines.append("<thead><tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr></thead>")
    for first, *rest in rows:
        cells = "".join(f'<td style="text-align:left">{escape(cell)}</td>' for cell in rest)
        lines.append(f'<tr><th style="text-align:left">{escape(first)}</th>{cells}</tr>')
    return "\n".join([*lines, "</table>", *(f"<div>{escape(note)}</div>" for note in notes)])


def from_to(values: Iterable[float], unit: str) -> str:
    """Return the range of values as words, such as ``-2.2 to 2.2 mm``."""
    numbers = [float(value) for value in values]
    return f"{min(numbers):.4g} to {max(numbers):.4g} {unit}"
