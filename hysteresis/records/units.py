"""Units that the name of a column says, where they are not those of a record."""

from __future__ import annotations

import re

_OTHER_UNITS = {
    "drive": r"(^|[^a-z])(um|cm|m|inch|inches|rad|radians?|turns?|revs?|counts?|ticks|current|voltage)(\b|_|$)",
    "angle": r"(?<!g)rad(ians?)?(\b|_|$)",  # not grad, as degrees are called in some languages
    "time": r"(^|[^a-z])(ms|us|ns|min|minutes|h|hours)(\b|_|$)",
    "force": r"(^|[^a-z])(g|gf|kg|kgf|mn|kn|lbf?)(\b|_|$)",
}
_EXPECTED = {"drive": "mm, deg, steps or N", "angle": "degrees", "time": "seconds", "force": "newtons"}
_OF_KEY = {
    **dict.fromkeys(("drive", "drive_2", "drive_3", "drive_4"), "drive"),
    **dict.fromkeys(("angle", "angle_2", "torsion", "notches"), "angle"),
    **dict.fromkeys(("force", "tension_a", "tension_b", "tension_c", "tension_d"), "force"),
    "time": "time",
}
"""Key of ``[columns]`` -> what is measured."""


def expected_unit(key: str, name: str) -> str | None:
    """Say which unit was expected of a column, by its key of ``[columns]``, if its name says another; else None."""
    measured = _OF_KEY.get(key)
    words = set(re.sub(r"[^a-z]+", " ", name.lower()).split())
    if measured == "drive" and words & {"mm", "deg", "step", "steps", "n", "newton", "newtons"}:
        return None  # as in current_position_mm and wheel_turn_deg
    if measured == "angle" and words & {"deg", "degree", "degrees"}:
        return None
    if measured is None or not re.search(_OTHER_UNITS[measured], name.lower()):
        return None
    return _EXPECTED[measured]
