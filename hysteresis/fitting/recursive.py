"""On-line re-identification of what drifts: zero, gain and width of an identified model, from one angle at a time.

The model is angle = zero + gain f(drive) + h, where h is the identified law with its saturation times a width. The
slope of h after a reversal stays. The three are found by recursive least squares on the prediction error (Ljung and
Soderstrom 1983), linearised about the present width: dh/dwidth is the difference to a second law that is
:data:`WIDER` times wider and follows the same path. A law whose width changes gets the state that it would have had
with that width all along, to first order: h moves by as much as the slope says.

- The covariance is held as a square root S, P = S S', and is changed by factors, so it stays positive (Potter 1963).
- Forgetting is directional (Kulhavy 1987): old data are forgotten only along the direction that a new sample excites.
  With f = S' phi and z = f' f, both over the noise, S becomes S (I - m f f'), m z = 1 - 1 / sqrt(lambda (1 + z)), and
  the estimate moves by S f e / (1 + z). Nothing is forgotten where the variance would grow beyond that at the start.
- The error of a law is correlated along the stroke: samples that are :attr:`RecursionSettings.alike` count as one.
- A sample counts only after f has moved by a spacing. Without motion nothing is learnt and nothing forgotten.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.laws.elements import Element

WIDER = 1.05
"""Width of the second law over that of the first one."""
CLIPPED = 5.0
"""Prediction errors count at most this many standard deviations: a lone wrong reading moves little."""
_SPACING = 0.005  # of the range of f: some 400 samples a loop
_ALIKE = 0.1  # of the range of f: length along which the error of a law is correlated

NOT_EXCITED, AT_BOUND, OUTSIDE_FIT, NOT_FINITE = 1, 2, 4, 8
"""Bits of :attr:`Recursion.flags`: f has not moved enough since the last sample; a constant is held at its bound; the
error stays above what the fit had; the angle was not finite."""


@dataclass(frozen=True)
class Drift:
    """What has drifted: an offset, and factors on f and on the saturation of h."""

    zero_deg: float = 0.0
    gain: float = 1.0
    width: float = 1.0


@dataclass(frozen=True)
class RecursionSettings:
    """Constants of the recursion.

    Parameters
    ----------
    noise_deg
        Standard deviation of the prediction error of a device as it was identified, above 0.
    spacing_deg
        Change of f between two samples that count, above 0.
    scale
        Standard deviations of zero (deg), gain and width before the first sample, above 0.
    lowest, highest
        Bounds of the three; 0, 1 and 1 lie within, and gain and width are above 0.
    forgetting
        lambda, above 0, at most 1. About 1 / (1 - lambda) samples are remembered.
    alike
        Number of samples in a row whose errors are about the same, at least 1: together they count as one. What a law
        misses varies along the stroke, not from sample to sample.
    outside
        Root mean square of the error over the noise above which the device has left the fit.

    Raises
    ------
    ValueError
        A number out of range.
    """

    noise_deg: float
    spacing_deg: float
    scale: tuple[float, float, float]
    lowest: tuple[float, float, float]
    highest: tuple[float, float, float]
    forgetting: float = 0.995
    outside: float = 3.0
    alike: float = 1.0

    def __post_init__(self) -> None:
        for name, value in (("noise_deg", self.noise_deg), ("spacing_deg", self.spacing_deg)):
            if not 0.0 < value < math.inf:
                raise ValueError(f"{name} = {value:g}: expected above 0")
        if not all(0.0 < value < math.inf for value in self.scale):
            raise ValueError(f"scale = {self.scale}: expected three numbers above 0")
        if not 0.0 < self.forgetting <= 1.0:
            raise ValueError(f"forgetting = {self.forgetting:g}: expected above 0, at most 1")
        if not 1.0 <= self.alike < math.inf:
            raise ValueError(f"alike = {self.alike:g}: expected at least 1")
        if not self.outside > 1.0:
            raise ValueError(f"outside = {self.outside:g}: expected above 1")
        rows = zip(self.lowest, (0.0, 1.0, 1.0), self.highest, strict=True)
        if not all(low <= start <= high for low, start, high in rows) or min(self.lowest[1:]) <= 0.0:
            raise ValueError(
                f"lowest = {self.lowest}, highest = {self.highest}: expected 0, 1 and 1 between them, "
                f"and gain and width above 0"
            )


def settings_for(size_deg: float, error_deg: float) -> RecursionSettings:
    """Choose the constants for the range of f and the root mean square error that a fit leaves, both in deg."""
    zero = 0.1 * size_deg
    return RecursionSettings(
        noise_deg=max(error_deg, 1e-4 * size_deg),
        spacing_deg=_SPACING * size_deg,
        scale=(0.5 * zero, 0.15, 0.5),
        lowest=(-zero, 0.5, 0.25),
        highest=(zero, 2.0, 4.0),
        forgetting=0.998,
        alike=2 * _ALIKE / _SPACING,
    )


@dataclass(frozen=True, eq=False)
class Recursion:
    """State of a re-identification.

    ``elements`` and ``wider`` are the law at the present width and at :data:`WIDER` times it, both at ``f_deg``.
    ``root``, shape (3, 3), is a square root of the covariance of zero, gain and width in units of ``settings.scale``.
    ``mean_square_deg2`` is that of the prediction errors, forgotten as the data are. ``flags`` are of the last sample.
    """

    settings: RecursionSettings
    drift: Drift
    elements: tuple[Element, ...]
    wider: tuple[Element, ...]
    f_deg: float
    sampled_deg: float
    root: Floats
    mean_square_deg2: float
    flags: int = 0

    @property
    def angle_deg(self) -> float:
        """Angle of the model at its present f."""
        return self.drift.zero_deg + self.drift.gain * self.f_deg + _sum(self.elements, self.f_deg)

    @property
    def standard_deviation(self) -> Drift:
        """Standard deviations of the three constants."""
        return Drift(*(np.array(self.settings.scale) * np.linalg.norm(self.root, axis=1)).tolist())


def start_recursion(elements: Sequence[Element], f_deg: float, settings: RecursionSettings) -> Recursion:
    """Begin at an f, deg, with laws in their present state and no drift."""
    return Recursion(
        settings=settings,
        drift=Drift(),
        elements=tuple(elements),
        wider=_widened(elements, WIDER, f_deg),
        f_deg=f_deg,
        sampled_deg=f_deg,
        root=np.eye(3),
        mean_square_deg2=settings.noise_deg**2,
    )


def updated(before: Recursion, f_deg: float, angle_deg: float) -> Recursion:
    """Move the model to an f, deg, on a straight way, and learn from the angle that was measured there.

    An angle that is NaN or infinite is followed without learning from it.
    """
    settings, path = before.settings, np.array([before.f_deg, f_deg])
    moved = replace(
        before,
        elements=tuple(one.after(path) for one in before.elements),
        wider=tuple(one.after(path) for one in before.wider),
        f_deg=f_deg,
        flags=before.flags & OUTSIDE_FIT,
    )
    if not math.isfinite(angle_deg):
        return replace(moved, flags=moved.flags | NOT_FINITE)
    if abs(f_deg - before.sampled_deg) < settings.spacing_deg:
        return replace(moved, flags=moved.flags | NOT_EXCITED)
    now = before.drift
    steeper = (_sum(moved.wider, f_deg) - _sum(moved.elements, f_deg)) / ((WIDER - 1.0) * now.width)
    of_one = settings.noise_deg * math.sqrt(settings.alike)
    phi = np.array(settings.scale) * np.array([1.0, f_deg, steeper]) / of_one
    error = angle_deg - moved.angle_deg
    direction, root = phi @ before.root, before.root
    seen = float(direction @ direction)
    most = CLIPPED * settings.noise_deg * math.sqrt(1.0 + settings.alike * seen)
    clipped = min(most, max(-most, error))
    gain = root @ direction * (clipped / (of_one * (1.0 + seen)))
    wanted = np.array([now.zero_deg, now.gain, now.width]) + np.array(settings.scale) * gain
    held = np.clip(wanted, settings.lowest, settings.highest)
    drift = Drift(*held.tolist())
    share = 1.0 - settings.forgetting
    # clipped, too: one lost reading is not another device
    mean_square = settings.forgetting * before.mean_square_deg2 + share * clipped**2
    outside = mean_square > (settings.outside * settings.noise_deg) ** 2
    elements, wider = _with_width(moved, drift.width / now.width)
    return replace(
        moved,
        drift=drift,
        elements=elements,
        wider=wider,
        sampled_deg=f_deg,
        root=_forgotten(root, direction, seen, settings.forgetting),
        mean_square_deg2=mean_square,
        flags=(AT_BOUND if (held != wanted).any() else 0) | (OUTSIDE_FIT if outside else 0),
    )


def _forgotten(root: Floats, direction: Floats, seen: float, forgetting: float) -> Floats:
    """Square root of the covariance after a sample; nothing is forgotten where a variance would pass its first one."""
    if seen == 0.0:
        return root
    for kept in (forgetting, 1.0):
        shrink = (1.0 - 1.0 / math.sqrt(kept * (1.0 + seen))) / seen
        found = root - shrink * np.outer(root @ direction, direction)
        if ((found**2).sum(axis=1) <= 1.0).all():
            break
    return found


def _sum(elements: Sequence[Element], f_deg: float) -> float:
    return sum(float(one.along(np.array([f_deg]))[0]) for one in elements)


def _with_width(at: Recursion, ratio: float) -> tuple[tuple[Element, ...], tuple[Element, ...]]:
    """Give both laws a width times a ratio, in the states that they would have had with it, to first order."""
    f, laws = np.array([at.f_deg]), []
    for factor, times in ((1.0, (ratio - 1.0) / (WIDER - 1.0)), (WIDER, (ratio - 1.0) / (WIDER - 1.0) + ratio)):
        laws.append(
            tuple(
                one.widened(factor * ratio).in_state(one.state + times * (wide.state - one.state)).after(f)
                for one, wide in zip(at.elements, at.wider, strict=True)
            )
        )
    return laws[0], laws[1]


def _widened(elements: Sequence[Element], factor: float, f_deg: float) -> tuple[Element, ...]:
    return tuple(one.widened(factor).after(np.array([f_deg])) for one in elements)
