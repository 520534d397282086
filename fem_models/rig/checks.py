"""Errors and checks of values: one line that names the field, its value and what was expected."""

from __future__ import annotations

import math
from dataclasses import fields
from functools import cache

from hysteresis.messages import as_given, quoted

LEAST_MM, MOST_MM = 1e-9, 1e4
"""Smallest and largest length of a part, mm: far below an atom, and ten metres."""
MOST_JOINTS = 1_000
RANGES: dict[str, tuple[float, float]] = {
    "creep.fraction": (-10.0, 10.0),
    "drive_gain.error": (-10.0, 10.0),
    "growth_per_mm": (-10.0, 10.0),
    "slack.tendon_a_mm": (-1e3, 1e3),
    "slack.tendon_b_mm": (-1e3, 1e3),
    "eccentricity.amplitude_mm": (-1e3, 1e3),
    "backlash.width_mm": (-1e3, 1e3),
    "free_length_mm": (-1e12, 1e12),  # a soft spring in a proof
    "_N_per_mm": (-1e12, 1e12),
    "_N_s_per_mm": (-1e12, 1e12),
    "_Nmm_per_rad": (-1e15, 1e15),
    "_Nmm_s_per_rad": (-1e12, 1e12),
    "_mm_per_s": (-1e6, 1e6),
    "_mm_per_N": (-1e6, 1e6),
    "_per_mm": (-1e3, 1e3),
    "_MPa_per_K": (-1e3, 1e3),
    "_mm": (-MOST_MM, MOST_MM),
    "EA_N": (-1e15, 1e15),
    "preload_N": (-1e6, 1e6),
    "_N": (-1e9, 1e9),
    "_GPa": (-1e6, 1e6),
    "_MPa": (-1e9, 1e9),
    "_deg": (-1e6, 1e6),
    "_C": (-273.15, 5e3),
    "_s": (-1e12, 1e12),
    "_g": (-1e9, 1e9),
    "capstan_coefficient": (-100.0, 100.0),
    "": (-1e12, 1e12),
}
"""Ends of the numbers of a rig by the end of their name: far beyond any instrument, within what a solver can hold."""


class RigError(ValueError):
    """A rig or a load program with impossible values; the message names field, value and what was expected."""


class SolverError(RuntimeError):
    """A load program for which an engine found no equilibrium; the message gives the sample and the drive."""


class ImpossibleError(SolverError):
    """A load under which a rig cannot be; the message gives the quantity and where it begins."""


class FoldedTubeError(ImpossibleError):
    """A tube that bends through itself."""


class ClosedNotchError(ImpossibleError):
    """A notch that bends past the angle at which its edges meet, of a rig without ``[closure]``."""


def require(condition: bool, name: str, value: object, expected: str) -> None:
    """Raise a RigError ``name = value: expected ...`` where the condition does not hold."""
    if not condition:
        raise RigError(f"{name} = {as_given(str(value))}: expected {expected}")


def require_numbers(owner: str, item: object, lists: tuple[str, ...] = ()) -> None:
    """Raise a RigError where a field of a dataclass is neither None nor a finite number within its range.

    The fields ``lists`` may be tuples of such numbers, one a notch.
    """
    for field, name, low, high in _fields_within(owner, type(item)):  # type: ignore[arg-type]
        value = getattr(item, field)
        if value is None or (type(value) is float and low <= value <= high):
            continue
        if field in lists and isinstance(value, tuple):
            if len(value) > MOST_JOINTS:
                raise RigError(f"{name} = {len(value):,} numbers: expected at most {MOST_JOINTS:,}")
            for number, one in enumerate(value, start=1):
                _require_number(name, one, f" of notch {number}")
        else:
            _require_number(name, value)


def _require_number(name: str, value: object, of: str = "") -> None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise RigError(f"{name}{of} = {quoted(value)}: expected a number")
    require_in_range(name, value, of)


@cache
def _fields_within(owner: str, kind: type) -> tuple[tuple[str, str, float, float], ...]:
    """Give the fields of a dataclass that hold numbers, their names with the owner, and their ends.

    Searches make rigs by the thousand.
    """
    names = [f.name for f in fields(kind) if f.name not in ("shape", "rigid_roots")]  # of a notch: a word and a switch
    return tuple((name, f"{owner}.{name}", *_range_of(f"{owner}.{name}")) for name in names)


@cache
def _range_of(name: str) -> tuple[float, float]:
    return next(ends for unit, ends in RANGES.items() if name.endswith(unit))


def require_in_range(name: str, value: float, of: str = "") -> None:
    """Raise a RigError where a number is not finite or beyond :data:`RANGES`.

    ``name`` ends in its unit; ``of`` comes after it in the message.
    """
    low, high = _range_of(name)
    if not low <= value <= high:
        require(math.isfinite(value), name + of, value, "a finite number")
        require(False, name + of, value, f"from {low:g} to {high:g}")


def require_length(name: str, value_mm: float) -> None:
    """Raise a RigError where a length that must be positive is not from :data:`LEAST_MM` to :data:`MOST_MM`."""
    require(value_mm > 0, name, value_mm, "above 0")
    require(LEAST_MM <= value_mm <= MOST_MM, name, value_mm, f"from {LEAST_MM:g} to {MOST_MM:g}")
