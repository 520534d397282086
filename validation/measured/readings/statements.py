"""Statements of the paper about its loops, each with its own error, and what a rig's loops say to them.

A number has an error, half of its last digit or that of a reading from a figure, which counts as two standard
deviations. A statement in words (this place is wider than that one) is what a reader of a figure said: its likelihood
is the probability that a reader of the model's loop says the same, with the reading error of two widths. A flat curve
therefore neither meets nor contradicts it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from hysteresis.arrays import Floats
from validation.measured.preset_du2018 import AMPLITUDE_MM
from validation.measured.readings.loops import Loop, Loops
from validation.measured.readings.paper_table import (
    FACTORS,
    FULL_SCALE_DEG,
    NEAR_THE_END,
    WIDTHS_DEG,
    paper_table,
)

READ_DEG = 0.1
"""Error of a width that is read from a figure or measured in an image, deg; assumed."""
FULL_SCALE_ERROR_DEG = 1.0
"""The paper says 45 deg; the percentages of its Table 1 imply 45.6 to 46.05."""
APPROXIMATELY = 0.1
"""Relative error of "approximately the same"; assumed."""
CENTRE = 0.25
"""Part of the stroke within which "under the minimum driving force" lies; assumed."""
INNER = 0.75
"""Part of the stroke outside of which "under the maximum driving force" lies; assumed."""
MET = 2.0
"""Standard deviations within which a number is met."""
FULL, W10, W20 = "45 deg at 2.2 mm", "width at 10 N", "width at 20 N"
CENTRE_WIDEST, END_LEAST, SAME = "widest at the least force", "least at the largest bend", "the same at 1.1 mm"
PEAK, APART = "peak at 1 Hz", "1 Hz by the static law"
STATIC_SIZE = 9
"""Residuals of the static statements, which come first."""
HUNDREDTH_DEG = 0.005
"""The paper's widths have hundredths: what is wider by less than half of one is as wide. So have its errors."""
STATEMENTS = (FULL, W10, W20, CENTRE_WIDEST, END_LEAST, SAME, PEAK, APART)


@dataclass(frozen=True)
class Judged:
    """What the loops of a rig say to the statements: a deviance of each by name, whether each is met, and numbers.

    A deviance is a squared residual in standard deviations, or -2 ln of the probability that a reader says the same.
    """

    deviance: Mapping[str, float]
    met: Mapping[str, bool]
    numbers: Mapping[str, float]

    @property
    def chi_square(self) -> float:
        """Sum of the deviances."""
        return math.fsum(self.deviance.values())


_PAPER = paper_table()
_PEAK_MIDDLE = sum(_PAPER.peak_ratio) / 2
_PEAK_SD = (_PAPER.peak_ratio[1] - _PAPER.peak_ratio[0]) / 2 / MET


def numbers_of(loops: Loops) -> dict[str, float]:
    """Numbers that the statements are about, deg or ratios."""
    high, low = loops.high, loops.low
    return {
        "full scale, deg": float(max(high.up_deg.max(), high.down_deg.max())),
        "other full scale, deg": float(-min(high.up_deg.min(), high.down_deg.min())),
        "width at 10 N, deg": float(low.width_deg.max()),
        "width at 20 N, deg": float(high.width_deg.max()),
        **{f"centre over elsewhere, {name}": _centre(one)[0] for name, one in (("10 N", low), ("20 N", high))},
        **{f"at 0.9 of the stroke over centre, {name}": _end(one)[0] for name, one in (("10 N", low), ("20 N", high))},
        "width at 1.1 mm over that at 2.2 mm": float(loops.smaller.width_deg.max() / high.width_deg.max()),
        "peak at 1 Hz over the static one": loops.peak_ratio,
        "1 Hz from the static loop, deg": loops.apart_deg,
    }


def residuals(loops: Loops, reading: str) -> dict[str, tuple[float, ...]]:
    """Signed residuals of each statement in standard deviations; of words, roots of -2 ln of the probability."""
    factor = FACTORS[reading]
    n = numbers_of(loops)
    scale = FULL_SCALE_ERROR_DEG / MET * math.sqrt(2)  # both ends are one statement
    width = factor * READ_DEG / MET
    margins = margins_of(loops)
    return {
        FULL: tuple((n[name] - FULL_SCALE_DEG) / scale for name in ("full scale, deg", "other full scale, deg")),
        W10: ((n["width at 10 N, deg"] - factor * WIDTHS_DEG[10.0]) / width,),
        W20: ((n["width at 20 N, deg"] - factor * WIDTHS_DEG[20.0]) / width,),
        CENTRE_WIDEST: tuple(_said(z) for z in margins[:2]),
        END_LEAST: tuple(_said(z) for z in margins[2:]),
        SAME: ((n["width at 1.1 mm over that at 2.2 mm"] - 1) / (APPROXIMATELY / MET),),
        PEAK: ((loops.peak_ratio - _PEAK_MIDDLE) / _PEAK_SD,),
        APART: (max(0.0, loops.apart_deg - _PAPER.between_tests_deg) / (READ_DEG / MET),),
    }


def margins_of(loops: Loops) -> tuple[float, ...]:
    """By how much the loops at 10 and 20 N have what is said of the centre, then of the ends, over a reader's error."""
    reader = math.sqrt(2) * READ_DEG / MET
    return tuple(of(one)[1] / reader for of in (_centre, _end) for one in (loops.low, loops.high))


def judge(loops: Loops, reading: str) -> Judged:
    """Compare the loops of a rig with all statements under a reading."""
    found = residuals(loops, reading)
    words = {CENTRE_WIDEST: _centre, END_LEAST: _end}
    met = {}
    for name, row in found.items():
        if name in words:
            met[name] = all(words[name](one)[1] > -HUNDREDTH_DEG for one in (loops.low, loops.high))
        elif name == APART:
            met[name] = loops.apart_deg <= _PAPER.between_tests_deg + 2 * HUNDREDTH_DEG
        else:
            met[name] = max(abs(r) for r in row) <= MET / (math.sqrt(2) if name == FULL else 1)
    return Judged({name: math.fsum(r * r for r in row) for name, row in found.items()}, met, numbers_of(loops))


def met_but_peak(judged: Judged) -> bool:
    """Whether all statements but the peak at 1 Hz are met; a rig without a rate mechanism has the rest by itself."""
    return all(met for name, met in judged.met.items() if name != PEAK)


def residual_vector(loops: Loops, reading: str) -> Floats:
    """All residuals in the order of the statements, shape (11,)."""
    return np.array([r for row in residuals(loops, reading).values() for r in row])


def _said(z: float) -> float:
    return math.sqrt(max(0.0, -2 * float(log_ndtr(z))))


def _at(loop: Loop, drive_mm: float) -> float:
    return float(np.interp(drive_mm, loop.drive_mm, loop.width_deg))


def _centre(loop: Loop) -> tuple[float, float]:
    """Width at zero drive over the largest elsewhere, and the difference, deg."""
    elsewhere = float(loop.width_deg[np.abs(loop.drive_mm) >= CENTRE * loop.drive_mm[-1] - 1e-9].max())
    centre = _at(loop, 0.0)
    return centre / max(elsewhere, 1e-9), centre - elsewhere


def _end(loop: Loop) -> tuple[float, float]:
    """Mean width at 0.9 of the stroke over that at zero, and by how much the least inner width is larger, deg."""
    x = NEAR_THE_END * AMPLITUDE_MM
    ends = (_at(loop, x), _at(loop, -x))
    inner = float(loop.width_deg[np.abs(loop.drive_mm) <= INNER * loop.drive_mm[-1] + 1e-9].min())
    return sum(ends) / 2 / max(_at(loop, 0.0), 1e-9), inner - max(ends)
