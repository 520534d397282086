"""A gallery script in cells: run in order as a notebook would, each with what it printed and the figure it made.

A script is plain Python in the percent format that notebooks open, too: ``# %%`` begins a cell of code,
``# %% [markdown]`` one of text. The docstring has the title and the first words.
"""

from __future__ import annotations

import ast
import io
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import matplotlib.figure
from PIL import Image

_DPI, _COLOURS = 90, 64  # of a picture: few colours keep it small


@dataclass(frozen=True)
class Cell:
    """One cell: its text or code, and of code what it printed and drew (PNG, empty without a figure)."""

    source: str
    is_text: bool = False
    printed: str = ""
    picture: bytes = b""


def cells_of(script: str) -> list[Cell]:
    """Divide the text of a script; the docstring is its first cell."""
    module = ast.parse(script)
    words = ast.get_docstring(module)
    if words is None:
        raise ValueError("gallery script without a docstring: expected its title in one")
    body = "\n".join(script.splitlines()[module.body[0].end_lineno or 0 :])
    found = [Cell(words, is_text=True)]
    for head, source in re.findall(r"^# %%([^\n]*)\n(.*?)(?=^# %%|\Z)", body + "\n", re.M | re.S):
        is_text = "[markdown]" in head
        found.append(Cell(re.sub(r"^# ?", "", source, flags=re.M).strip() if is_text else source.strip(), is_text))
    return found


def run_script(script: Path, folder: Path) -> list[Cell]:
    """Run the cells of a script in a folder, where it may write; a cell that sets ``figure`` shows it."""
    names: dict[str, object] = {"__name__": "__main__"}
    with _inside(folder):
        return [
            cell if cell.is_text else _run(cell, names, script) for cell in cells_of(script.read_text(encoding="utf-8"))
        ]


def page_of(script: Path, cells: list[Cell]) -> tuple[str, dict[str, bytes]]:
    """Write the cells as Markdown; return the page, and its pictures by their names beside it."""
    title = cells[0].source.partition("\n")[0].rstrip(".")
    words = cells[0].source.partition("\n")[2].strip()
    parts = [f"# {title}", words]
    pictures: dict[str, bytes] = {}
    for cell in cells[1:]:
        parts.append(cell.source if cell.is_text else f"```py\n{cell.source}\n```")
        if cell.printed:
            parts.append(f"```text\n{cell.printed.rstrip()}\n```")
        if cell.picture:
            name = f"{script.stem}-{len(pictures) + 1}.png"
            pictures[name] = cell.picture
            parts.append(f"![{title}, figure {len(pictures)}]({name})")
    parts.append(f"The script is `docs/gallery/{script.name}`; `python -m docs.make.gallery` makes this page from it.")
    return "\n\n".join(parts) + "\n", pictures


def _run(cell: Cell, names: dict[str, object], script: Path) -> Cell:
    names.pop("figure", None)
    heard = io.StringIO()
    with redirect_stdout(heard):
        exec(compile(cell.source, str(script), "exec"), names)
    figure = names.get("figure")
    picture = _small_png(figure) if isinstance(figure, matplotlib.figure.Figure) else b""
    return Cell(cell.source, False, heard.getvalue(), picture)


def _small_png(figure: matplotlib.figure.Figure) -> bytes:
    drawn, small = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=_DPI)
    Image.open(drawn).convert("RGB").quantize(_COLOURS).save(small, format="png", optimize=True)
    return small.getvalue()


@contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
