"""Templates of the pages, and the format of their numbers."""

from __future__ import annotations

import math
from pathlib import Path

import jinja2

from studies.units import unit_of


def environment(folder: Path) -> jinja2.Environment:
    """Load the templates of a folder; texts of results are escaped, and a missing value is an error."""
    out = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    out.filters["sig"] = significant
    out.filters["unit"] = unit_of
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
