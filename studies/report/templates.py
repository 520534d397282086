"""Templates of the pages, and the format of their numbers."""

from __future__ import annotations

import math
from pathlib import Path

import jinja2
from plotly.offline import get_plotlyjs

from studies.units import unit_of

TEMPLATES = Path(__file__).parent / "template"


def environment(*own: Path) -> jinja2.Environment:
    """Load the templates of reports, and those of folders of one's own; a missing value is an error.

    Texts of results are escaped. Every page has the style, the script and plotly.js; the filter ``here`` writes a
    command as it is.
    """
    out = jinja2.Environment(
        loader=jinja2.FileSystemLoader([*own, TEMPLATES]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    out.filters["sig"] = significant
    out.filters["unit"] = unit_of
    out.filters["here"] = str
    style, script = ((TEMPLATES / name).read_text(encoding="utf-8") for name in ("style.css", "page.js"))
    out.globals.update(style=style, script=script, plotly=get_plotlyjs())
    return out


def significant(value: object, digits: int = 3) -> str:
    """Format a number with a few significant digits, without exponent from 0.001 to 10^6; other values as text."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "" if value is None else str(value)
    if value == 0 or isinstance(value, int):
        return str(value)
    size = abs(value)
    if 1e-3 <= size < 1e6:
        decimals = max(0, digits - 1 - math.floor(math.log10(size)))
        return f"{value:.{decimals}f}"
    return f"{value:.{digits - 1}e}"
