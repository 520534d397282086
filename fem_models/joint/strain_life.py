"""Strain-life of superelastic Nitinol: cycles to failure with a 95 % interval, from published tests alone.

No published curve is of your tube: surface, melt, heat treatment and temperature move it. The interval holds what the
sources disagree in; a curve of one's own specimens (:class:`StrainLife`) replaces it.

Above the strain at which the metal transforms, life follows a line on logarithmic scales,

    N = N_t (strain_t / amplitude)^(1/c)

with an exponent c from 0.40 (286 instruments of four makes in rotating bending; Cheung and Darvell 2007, doi
10.1111/j.1365-2591.2007.01257.x) to 0.56. The upper end is an assumption: no source of it could be opened. It is taken
as 0.48 to 0.64, half the range to either side, and each end of the interval of lives is that of the least favourable
one. Where the amplitude reaches the transformation, N_t is below 1e5 (Tobushi et al., J.
Eng. Mater. Technol. 120(1), 1998, 64-70; rotating bending to 1e9 cycles says the same: Weaver et al. 2023, doi
10.1007/s40830-022-00409-7), and temperature and medium move lives by a factor of 5, single instruments of one make by a
standard deviation of 30 % (Huelsmann et al. 2019, doi 10.1111/iej.13182). So N_t is uniform on a logarithmic scale from
2e4 to 1e5.

Below the transformation, 4e8 cycles are borne at an amplitude of 0.55 % without mean strain, and of 0.16 % from 3 % of
mean strain on (90 % reliability at 95 % confidence; Cao et al., doi 10.34657/3724); in between the limit is taken as
linear. Between that limit and the transformation life is interpolated on logarithmic scales.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

LEAST_EXPONENT = 0.40
MOST_EXPONENT = 0.56
ASSUMED = (0.48, 0.64)
"""Range in which :data:`MOST_EXPONENT` is assumed; it widens the interval of lives, the median is that of 0.56."""
AT_TRANSFORMATION = (2e4, 1e5)
SCATTER = 0.30
"""Standard deviation of single lives, over their mean."""
ENDURANCE_CYCLES = 4e8
ENDURANCE = (0.0055, 0.0016)
"""Amplitudes of :data:`ENDURANCE_CYCLES` without mean strain, and from :data:`MEAN_STRAIN` on."""
MEAN_STRAIN = 0.03
SOURCES = (
    "Cheung and Darvell 2007, doi 10.1111/j.1365-2591.2007.01257.x; Tobushi et al. 1998, J. Eng. Mater. Technol. "
    "120(1), 64-70; Weaver et al. 2023, doi 10.1007/s40830-022-00409-7; Huelsmann et al. 2019, doi 10.1111/iej.13182; "
    "Cao et al., doi 10.34657/3724"
)
_TWO_SIDED = 1.96


@dataclass(frozen=True)
class Life:
    """Cycles to failure: ``median``, and the interval that holds 95 % of tubes. inf is more than anyone tested."""

    low: float
    median: float
    high: float


@dataclass(frozen=True)
class StrainLife:
    """Strain-life curve of one's own metal: ``cycles`` at ``strain`` (amplitude), and a line through that point.

    On logarithmic scales the line falls by ``exponent``; ``scatter`` is the standard deviation of ln(cycles).

    Raises
    ------
    ValueError
        Numbers out of range.
    """

    strain: float
    cycles: float
    exponent: float
    scatter: float

    def __post_init__(self) -> None:
        for name, value in (("strain", self.strain), ("cycles", self.cycles), ("exponent", self.exponent)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value}: expected above 0")
        if not (math.isfinite(self.scatter) and self.scatter >= 0):
            raise ValueError(f"scatter = {self.scatter}: expected at least 0")

    def life(self, amplitude: float) -> Life:
        """Cycles at a strain amplitude; inf without strain."""
        if amplitude <= 0:
            return Life(math.inf, math.inf, math.inf)
        median = self.cycles * (self.strain / amplitude) ** (1 / self.exponent)
        wide = math.exp(_TWO_SIDED * self.scatter)
        return Life(median / wide, median, median * wide)


def endurance_limit(mean: float) -> float:
    """Strain amplitude that :data:`ENDURANCE_CYCLES` bear at a mean strain, of either sign."""
    part = min(abs(mean) / MEAN_STRAIN, 1.0)
    return ENDURANCE[0] + part * (ENDURANCE[1] - ENDURANCE[0])


def nitinol_life(amplitude: float, mean: float, transforms_at: float) -> Life:
    """Cycles to failure of superelastic Nitinol.

    Parameters
    ----------
    amplitude, mean
        Half the range of a fibre's strain in a cycle, and its middle.
    transforms_at
        Strain at which the metal transforms: plateau over modulus.

    Returns
    -------
        Life; the interval combines the range of the curves and the scatter of single lives.
    """
    limit = endurance_limit(mean)
    if amplitude <= limit:
        return Life(ENDURANCE_CYCLES, math.inf, math.inf)
    knee = max(transforms_at, limit)
    scatter = math.sqrt(math.log1p(SCATTER**2))
    lowest, highest = AT_TRANSFORMATION
    middle = math.sqrt(lowest * highest)
    half = 0.5 * math.log(highest / lowest) * 0.95  # of a uniform logarithm: 95 % of its range
    other = math.hypot(half, _TWO_SIDED * scatter)
    if amplitude < knee:
        return _between(amplitude, limit, knee, middle, other)
    ratio = math.log(amplitude / knee)
    lines = [_beyond(ratio, middle, most, other) for most in (ASSUMED[0], MOST_EXPONENT, ASSUMED[1])]
    return Life(min(one.low for one in lines), lines[1].median, max(one.high for one in lines))


def _beyond(ratio: float, at_knee: float, most: float, other: float) -> Life:
    """Life at an amplitude of exp(ratio) times that of the transformation; the slope is uniform between both exponents.

    ``other`` is half of the logarithm's interval by all else.
    """
    slopes = 1 / LEAST_EXPONENT, 1 / most
    median = at_knee * math.exp(-0.5 * sum(slopes) * ratio)
    wide = math.hypot(other, 0.95 * 0.5 * abs(slopes[0] - slopes[1]) * ratio)
    return Life(median * math.exp(-wide), median, median * math.exp(wide))


def _between(amplitude: float, limit: float, knee: float, at_knee: float, wide: float) -> Life:
    """Interpolate from the life at the transformation to that at the endurance limit."""
    part = math.log(knee / amplitude) / math.log(knee / limit)
    median = at_knee * (ENDURANCE_CYCLES / at_knee) ** part
    return Life(median * math.exp(-wide), median, median * math.exp(wide))
