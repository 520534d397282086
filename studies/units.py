"""Unit and description of a number from its name: ``notch.depth_mm`` is a notch depth in mm."""

from __future__ import annotations

_UNITS = {
    "Nmm_s_per_rad": "N mm s/rad",
    "Nmm_per_rad": "N mm/rad",
    "N_s_per_mm": "N s/mm",
    "N_per_mm": "N/mm",
    "mm_per_N": "mm/N",
    "percent": "%",
    "mm2": "mm^2",
} | {unit: unit for unit in ("GPa", "MPa", "deg", "mm", "mJ", "Hz", "N", "g", "s")}
"""Units by the ending of a name, the longest ending first."""


def unit_of(name: str) -> str:
    """Give the unit at the end of a name; empty if there is none."""
    return _UNITS.get(_ending(name), "")


def words_of(name: str) -> str:
    """Give the words of a name, without its unit."""
    return name.removesuffix(f"_{_ending(name)}").replace("_", " ").replace(".", " ")


def label_of(name: str, unit: str = "") -> str:
    """Give words and unit for a scale; ``unit`` replaces that of the name."""
    unit = unit or unit_of(name)
    return f"{words_of(name)}, {unit}" if unit else words_of(name)


def _ending(name: str) -> str:
    return next((ending for ending in _UNITS if name.endswith(f"_{ending}")), "")
