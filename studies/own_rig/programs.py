"""Load programs of a report: a loop that closes, and the drives of the curve without hysteresis."""

from __future__ import annotations

import numpy as np

from fem_models.load import LoadProgram, triangle
from validation.separation import loop_program

CYCLES = 3
"""Closed cycles of a loop."""
_MOST_STEP_MM, _LEAST_STEPS = 0.1, 20


def programs_of_report(amplitude_mm: float, *, both_ways: bool) -> tuple[LoadProgram, LoadProgram]:
    """Give the program of a loop and that of the curve; a tendon without a second one is driven from rest.

    Raises
    ------
    RigError
        An amplitude out of its range.
    """
    if not both_ways:
        return loop_program(0.0, amplitude_mm), LoadProgram(np.linspace(0.0, amplitude_mm, 41))
    step = min(_MOST_STEP_MM, amplitude_mm / _LEAST_STEPS)
    return triangle(amplitude_mm, step_mm=step, cycles=CYCLES), triangle(amplitude_mm, step_mm=step)
