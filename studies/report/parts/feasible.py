"""Which cases of a study keep their limits, and which of them has the narrowest loop.

The limits are those of the study's ``[require]``; without one they are those of Nitinol and of the tendons.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hysteresis.arrays import Floats, Mask
from studies.report.charts import Chart, Line, Plate
from studies.units import label_of, unit_of, words_of

if TYPE_CHECKING:
    import xarray as xr

REQUIRE = "require"
"""Attribute of a study's dataset: its bounds, JSON, by quantity with ``min`` and ``max``."""
_MOST_LARGE = 300  # cases up to which their marks do not hide each other
ANGLE, WIDTH = "full_scale_angle_deg", "loop_width_max_deg"


@dataclass(frozen=True)
class Limit:
    """Least and most of a quantity, None for no bound, and what the limit says."""

    quantity: str
    low: float | None
    high: float | None
    words: str

    def kept(self, values: Floats) -> Mask:
        """Tell which values, of any shape, are within."""
        low, high = (-np.inf if self.low is None else self.low), (np.inf if self.high is None else self.high)
        return (values >= low) & (values <= high)


LIMITS = (
    Limit("fatigue_margin", 1.0, None, "fatigue at 10^7 cycles, 0.4 % alternating strain"),
    Limit("superelastic_margin", 1.0, None, "6 %, the strain to which superelasticity is tested"),
    Limit("slack_reached", None, 0.0, "no tendon falls slack"),
)
"""What a design has to keep without other words."""


@dataclass(frozen=True)
class LimitCount:
    """How many cases keep a limit."""

    name: str
    words: str
    kept: int


@dataclass(frozen=True)
class Best:
    """The case with the narrowest loop for its full scale, of those that keep all limits or of all cases.

    ``at`` has its point of the study; ``share_percent`` is the width of the loop over the full scale, and
    ``middle_percent`` that of the median case of the same kind.
    """

    feasible: bool
    at: Mapping[str, float]
    angle_deg: float
    width_deg: float
    share_percent: float
    middle_percent: float
    fatigue_margin: float | None

    def place(self) -> str:
        """Give the point in words."""
        return ", ".join(f"{words_of(name)} {value:.4g} {unit_of(name)}".rstrip() for name, value in self.at.items())


@dataclass(frozen=True)
class Feasible:
    """How many of the ``cases`` with a result keep all limits, and the best; ``mask`` has the shape of the study."""

    cases: int
    kept: int
    limits: tuple[LimitCount, ...]
    best: Best | None
    mask: Mask


def feasibility(data: xr.Dataset) -> Feasible | None:
    """Judge the cases of a study; None if it has none of the quantities that are limited."""
    limits = _limits(data)
    if not limits:
        return None
    done = data["status"].values == "ok"
    kept, counts = done.copy(), []
    for limit in limits:
        good = done & limit.kept(data[limit.quantity].values.astype(float))
        counts.append(LimitCount(limit.quantity, limit.words, int(good.sum())))
        kept &= good
    return Feasible(int(done.sum()), int(kept.sum()), tuple(counts), _best(data, done, kept), kept)


def _limits(data: xr.Dataset) -> list[Limit]:
    """Give the limits of the quantities that a study has."""
    given = json.loads(str(data.attrs.get(REQUIRE, "{}")))
    asked = [Limit(name, row["min"], row["max"], _words(name, row["min"], row["max"])) for name, row in given.items()]
    return [limit for limit in asked or LIMITS if limit.quantity in data]


def _words(name: str, low: float | None, high: float | None) -> str:
    bounds = [f"{side} {bound:g}" for side, bound in (("at least", low), ("at most", high)) if bound is not None]
    return f"{words_of(name)} {' and '.join(bounds)} {unit_of(name)}".rstrip()


def _best(data: xr.Dataset, done: Mask, kept: Mask) -> Best | None:
    """Find the narrowest loop for its full scale among the cases that keep the limits, else among all."""
    if ANGLE not in data or WIDTH not in data:
        return None
    angle, width = (data[name].values.astype(float) for name in (ANGLE, WIDTH))
    share: Floats = np.where(angle > 0, 100 * width / np.where(angle > 0, angle, 1.0), np.nan)
    among = (kept if kept.any() else done) & np.isfinite(share)
    if not among.any():
        return None
    case = np.unravel_index(int(np.argmin(np.where(among, share, np.inf))), share.shape)
    margin = float(data["fatigue_margin"].values[case]) if "fatigue_margin" in data else None
    return Best(
        feasible=bool(kept.any()),
        at=_point(data, case),
        angle_deg=float(angle[case]),
        width_deg=float(width[case]),
        share_percent=float(share[case]),
        middle_percent=float(np.median(share[among])),
        fatigue_margin=margin,
    )


def _point(data: xr.Dataset, case: tuple[np.intp, ...]) -> dict[str, float]:
    dims = [str(dim) for dim in data["status"].dims]
    if dims == ["case"]:
        return {str(name): float(data[name].values[case]) for name in data.coords if name != "case"}
    return {dim: float(data[dim].values[place]) for dim, place in zip(dims, case, strict=True)}


def region_plate(data: xr.Dataset, inputs: tuple[str, str], found: Feasible) -> Plate:
    """Chart which cases keep all limits, over two inputs of the study, and where the best one is.

    ``data`` is the part of the study that is drawn, and ``found`` is what was judged of it.
    """
    x, y = (_over_cases(data, name) for name in inputs)
    done = data["status"].values == "ok"
    inside, outside = ("dots", "crosses") if x.size <= _MOST_LARGE else ("points", "points")
    groups = (
        ("outside the limits", done & ~found.mask, "orange", outside),
        ("within all limits", found.mask, "green", inside),
    )
    marks = [Line(x[mask], y[mask], name, tone, style) for name, mask, tone, style in groups]  # type: ignore[arg-type]
    best = found.best
    if best is not None and all(name in best.at for name in inputs):
        name = "narrowest loop" if best.feasible else "narrowest loop, outside the limits"
        place = [np.array([best.at[axis]]) for axis in inputs]
        marks.append(Line(place[0], place[1], name, "purple", "star"))
    alt = f"{found.kept} of {found.cases} cases keep all limits."
    chart = Chart("Designs within the limits", label_of(inputs[0]), label_of(inputs[1]), tuple(marks), alt)
    limits = "; ".join(limit.words for limit in found.limits)
    return Plate((chart,), f"{alt} Limits: {limits}. The narrowest loop is that for its full scale.", columns=1)


def _over_cases(data: xr.Dataset, name: str) -> Floats:
    """Give an input at every case, the shape of the status."""
    status = data["status"]
    return np.asarray(data[name].broadcast_like(status).transpose(*status.dims).values, dtype=float)
