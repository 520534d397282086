"""Errors and checks of values: one line that names the field, its value and what was expected."""

from __future__ import annotations

import math
from dataclasses import fields


class RigError(ValueError):
    """A rig or a load program with impossible values; the message names field, value and what was expected."""


class SolverError(RuntimeError):
    """A load program for which an engine found no equilibrium; the message gives the sample and the drive."""


def require(condition: bool, name: str, value: object, expected: str) -> None:
    """Raise a RigError ``name = value: expected ...`` where the condition does not hold."""
    if not condition:
        raise RigError(f"{name} = {value}: expected {expected}")


def require_numbers(owner: str, item: object) -> None:
    """Raise a RigError where a field of a dataclass is neither None nor a finite number."""
    for f in fields(item):  # type: ignore[arg-type]
        value = getattr(item, f.name)
        if value is None or f.name in ("shape", "rigid_roots"):  # fields of a notch: a word and a switch
            continue
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise RigError(f"{owner}.{f.name} = {value!r}: expected a number")
        require(math.isfinite(value), f"{owner}.{f.name}", value, "a finite number")
