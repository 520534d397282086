"""Facts of the paper and their resolution, and the same numbers of a rig."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fem_models.chain.parameters import ChainSettings
from fem_models.chain.solve import chain_angle_deg
from fem_models.load import triangle
from fem_models.rig import Rig
from hysteresis.arrays import Floats
from validation.measured.preset_du2018 import AMPLITUDE_MM, FULL_SCALE_DEG, READING, WIDTHS_DEG
from validation.measured.readings.paper_table import FACTORS

FULL_SCALE_RESOLUTION_DEG = 0.5
"""The paper gives whole degrees: half of the last digit on either side."""
WIDTH_RESOLUTION_DEG = 0.005 * FACTORS[READING]
"""The paper gives hundredths of a degree; a width is twice a half one."""
PLACE_RESOLUTION_MM = 0.5
"""The paper says "near zero drive" and shows it in figures with points every 0.1 mm; assumed."""
PRELOADS_N = tuple(WIDTHS_DEG)


@dataclass(frozen=True)
class LoopNumbers:
    """Numbers of one closed loop: largest angle, largest width, and the drive where the loop is widest."""

    full_scale_deg: float
    width_deg: float
    widest_at_mm: float


def loop_numbers(rig: Rig, amplitude_mm: float = AMPLITUDE_MM, step_mm: float = 0.1) -> LoopNumbers:
    """Run the paper's program on a rig and measure its closed cycle.

    Both branches have the same drives, so the width needs no interpolation. It is that of
    :func:`hysteresis.records.metrics.loop_width`.

    Raises
    ------
    SolverError, RigError
        From the chain.
    """
    program = triangle(amplitude_mm, step_mm=step_mm)
    angle = chain_angle_deg(rig, program, ChainSettings(max_step_mm=step_mm))
    quarter = (program.drive_mm.size - 1) // 5
    down, up = angle[quarter : 3 * quarter + 1], angle[3 * quarter :]
    width = np.abs(down[::-1] - up)
    k = int(np.argmax(width))
    return LoopNumbers(float(np.abs(angle).max()), float(width[k]), float(program.drive_mm[3 * quarter + k]))


@dataclass(frozen=True)
class Facts:
    """Full scale at 20 N, and widths and places of the largest width at 10 and 20 N."""

    full_scale_deg: float
    widths_deg: tuple[float, float]
    widest_at_mm: tuple[float, float]

    @property
    def numbers(self) -> Floats:
        """Full scale and widths, deg, shape (3,)."""
        return np.array([self.full_scale_deg, *self.widths_deg])

    @property
    def place_met(self) -> bool:
        """Whether both loops are widest near zero drive."""
        return all(abs(x) <= PLACE_RESOLUTION_MM + 1e-9 for x in self.widest_at_mm)

    def met_by(self, other: Facts, width_resolution_deg: float = WIDTH_RESOLUTION_DEG) -> bool:
        """Whether another rig shows these facts within their resolution."""
        off = np.abs(self.numbers - other.numbers)
        limits = np.array([FULL_SCALE_RESOLUTION_DEG, width_resolution_deg, width_resolution_deg])
        return bool((off <= limits + 1e-9).all()) and other.place_met


def facts_as(reading: str) -> Facts:
    """Give what the paper states, sections 3.1 and 4.2, with its widths as ``"full"`` or ``"half"`` ones."""
    low, high = (FACTORS[reading] / FACTORS[READING] * WIDTHS_DEG[preload] for preload in PRELOADS_N)
    return Facts(FULL_SCALE_DEG, (low, high), (0.0, 0.0))


PAPER = facts_as(READING)
"""What the paper states, as the preset takes it."""


def facts_of(rig: Rig, step_mm: float = 0.1) -> Facts:
    """Work out the facts of a rig by the chain, with the paper's step of the drive or another.

    Raises
    ------
    SolverError, RigError
        From the chain.
    """
    low, high = (loop_numbers(replace(rig, preload_N=p), step_mm=step_mm) for p in PRELOADS_N)
    return Facts(high.full_scale_deg, (low.width_deg, high.width_deg), (low.widest_at_mm, high.widest_at_mm))
