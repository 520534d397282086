"""What the paper's own model (equation 10) and its Table 1 say about the two readings of its loop widths.

The loop of equation 7 over +-45 deg has a width that f does not change: theta = f(x) + h, and f is the same on both
branches. A model whose loop is wider than a measured one by D at some drive misses one of the branches by D/2 at
least, whatever f is. So Table 1 bounds the measured width from both sides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.laws.bouc_wen import BoucWen, hysteresis

WIDTHS_DEG = {10.0: 3.52, 20.0: 2.21}
"""Maximum hysteresis displacements by preload in N, section 3.1 of the paper."""
FACTORS = {"full": 1.0, "half": 2.0}
"""Loop width over the printed number, by reading."""
FULL_SCALE_DEG = 45.0
LARGEST_DEG, PERCENT, NORMALISED = (1.48, 1.61), (3.23, 3.58), (0.0133, 0.0162)
"""Table 1 of the paper: discrete and sinusoidal signal."""
EQUATION_10 = BoucWen(A=1.895, beta=0.315, gamma=0.2606, n=1.176)
NEAR_THE_END = 0.9
"""Part of the stroke at which a loop is looked at for "least at the largest bend"."""
_POINTS = 4501


@dataclass(frozen=True)
class Reference:
    """Angle that the percentages of Table 1 refer to, deg: what the rounding of the printed numbers allows."""

    low_deg: float
    high_deg: float


@dataclass(frozen=True)
class OfReading:
    """One preload under one reading.

    ``least_error_deg`` is the largest error that equation 10 has at least on a loop of this width, ``least_rms_deg``
    the least root mean square error if no place of the loop is wider. ``percent`` and ``normalised`` are these over the
    reference of Table 1, ``normalised_by_range`` over 90 deg.
    """

    reading: str
    preload_N: float
    printed_deg: float
    width_deg: float
    least_error_deg: float
    percent: float
    least_rms_deg: float
    normalised: float
    normalised_by_range: float

    @property
    def largest_error_met(self) -> bool:
        """Whether the bound lies below the largest error of Table 1."""
        return self.least_error_deg <= LARGEST_DEG[0]


@dataclass(frozen=True)
class PaperTable:
    """What the paper's numbers imply.

    ``model_width_deg``, ``model_width_near_end_deg``, ``model_lag_deg``: largest loop width of equation 10, the one at
    0.9 of the stroke, and the mean of h on the rising branch; positive means that the angle leads f. ``static``,
    ``dynamic``: references of the percentages. ``peak_ratio``: dynamic over static reference. ``by_largest_deg``:
    measured widths that the largest error allows. ``near_end_from_deg``: least width at 0.9 of the stroke that it
    allows. ``from_normalised_deg``: least largest width that 0.0133 allows as a root mean square over the reference,
    ``from_normalised_by_range_deg`` over the range. ``between_tests_deg``: largest difference between the loops of the
    two tests that the two largest errors allow, if the same constants predict both, as in the paper.
    ``lag_of_peak_ms``, ``lag_of_peak_deg``: time constant of a linear first-order lag at 1 Hz that lowers the peak to
    the middle of ``peak_ratio``, and how far it puts the angle behind at the middle of the stroke.
    """

    model_width_deg: float
    model_width_near_end_deg: float
    model_lag_deg: float
    static: Reference
    dynamic: Reference
    peak_ratio: tuple[float, float]
    by_largest_deg: tuple[float, float]
    near_end_from_deg: float
    from_normalised_deg: float
    from_normalised_by_range_deg: float
    between_tests_deg: float
    lag_of_peak_ms: float
    lag_of_peak_deg: float
    readings: tuple[OfReading, ...]


def reference(largest_deg: float, percent: float) -> Reference:
    """Quotients of numbers that round to those printed: hundredths of a degree, hundredths of a percent."""
    return Reference(
        100 * (largest_deg - 0.005) / (percent + 0.005),
        100 * (largest_deg + 0.005) / (percent - 0.005),
    )


def model_loop() -> tuple[Floats, Floats, Floats]:
    """Give the closed loop of equation 10 over +-45 deg: f increasing, h rising and h falling, shapes (k,)."""
    up = np.linspace(-FULL_SCALE_DEG, FULL_SCALE_DEG, _POINTS)
    path = np.concatenate([up, up[::-1][1:], up[1:], up[::-1][1:]])
    h = hysteresis(path, EQUATION_10)
    n = _POINTS - 1
    return up, h[2 * n : 3 * n + 1], h[3 * n :][::-1]


def least_rms_deg(model_width_deg: Floats, largest_deg: float) -> float:
    """Least root mean square error of a model of widths (k,) on a loop that is nowhere wider than ``largest_deg``.

    The two branches are missed by half of the difference each, at best.
    """
    over = np.maximum(model_width_deg - largest_deg, 0.0) / 2
    return float(np.sqrt(np.mean(over**2)))


def _width_of_rms(model_width_deg: Floats, rms_deg: float) -> float:
    """Least largest width of a loop on which the model has no larger root mean square error."""
    low, high = 0.0, float(model_width_deg.max())
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (middle, high) if least_rms_deg(model_width_deg, middle) > rms_deg else (low, middle)
    return high


def paper_table() -> PaperTable:
    """Work out what the paper's numbers imply for each reading."""
    f, rising, falling = model_loop()
    width = np.abs(rising - falling)
    widest, limit = float(width.max()), 2 * LARGEST_DEG[0]
    near_end = float(np.interp(NEAR_THE_END * FULL_SCALE_DEG, f, width))
    static, dynamic = (reference(*pair) for pair in zip(LARGEST_DEG, PERCENT, strict=True))
    middle = LARGEST_DEG[0] / PERCENT[0] * 100
    ratio = (dynamic.low_deg / static.high_deg, dynamic.high_deg / static.low_deg)
    peak = sum(ratio) / 2
    phase = math.sqrt(1 / peak**2 - 1)  # of a lag of time constant t: 2 pi t at 1 Hz
    return PaperTable(
        model_width_deg=widest,
        model_width_near_end_deg=near_end,
        model_lag_deg=float(rising[len(f) // 4 :].mean()),
        static=static,
        dynamic=dynamic,
        peak_ratio=ratio,
        by_largest_deg=(widest - limit, widest + limit),
        near_end_from_deg=near_end - limit,
        from_normalised_deg=_width_of_rms(width, NORMALISED[0] * middle),
        from_normalised_by_range_deg=_width_of_rms(width, NORMALISED[0] * 2 * FULL_SCALE_DEG),
        between_tests_deg=math.fsum(LARGEST_DEG),
        lag_of_peak_ms=1e3 * phase / (2 * math.pi),
        lag_of_peak_deg=FULL_SCALE_DEG * math.sin(math.atan(phase)) * peak,
        readings=tuple(
            _of_reading(width, name, factor, preload, middle)
            for name, factor in FACTORS.items()
            for preload in WIDTHS_DEG
        ),
    )


def _of_reading(model_width_deg: Floats, name: str, factor: float, preload_N: float, middle_deg: float) -> OfReading:
    printed = WIDTHS_DEG[preload_N]
    width = factor * printed
    error = abs(float(model_width_deg.max()) - width) / 2
    rms = least_rms_deg(model_width_deg, width)
    return OfReading(
        reading=name,
        preload_N=preload_N,
        printed_deg=printed,
        width_deg=width,
        least_error_deg=error,
        percent=100 * error / middle_deg,
        least_rms_deg=rms,
        normalised=rms / middle_deg,
        normalised_by_range=rms / (2 * FULL_SCALE_DEG),
    )
