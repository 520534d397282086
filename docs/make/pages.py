"""Where the generated pages are, and how a generated part is put into a page."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from hysteresis.files import write_files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOCS = Path(__file__).parents[1]
IMAGES = DOCS / "images"
_TEMPLATES = Path(__file__).parent / "templates"


def template(name: str) -> str:
    """Read the prose of a page, with fields in braces as of :meth:`str.format`."""
    return (_TEMPLATES / f"{name}.txt").read_text(encoding="utf-8")


def table(head: list[str], rows: list[list[str]]) -> str:
    """Format a table as Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def png(figure: Figure, dpi: int = 130) -> bytes:
    """Draw a figure as PNG."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi)
    return stream.getvalue()


def put_between_marks(page: Path, command: str, text: str) -> None:
    """Put a text between the two marks of a page that name the command, ``<!-- table of `python -m ...` -->``."""
    mark = f"<!-- table of `python -m {command}` -->"
    before, _, after = page.read_text(encoding="utf-8").split(mark)
    write_files({page: f"{before}{mark}\n{text}\n{mark}{after}"})


def put_after_heading(page: Path, heading: str, text: str) -> None:
    """Replace everything after a heading of a page."""
    prose = page.read_text(encoding="utf-8").split(f"\n{heading}\n")[0]
    write_files({page: f"{prose}\n{heading}\n\n{text.rstrip()}\n"})
