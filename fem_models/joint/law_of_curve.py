"""The moment-angle law of a measured joint from its curve: flag elements by nonnegative least squares.

An elastic curve, loaded only, and a superelastic loop both are sums of flag elements
(:class:`fem_models.joint.superelastic.FlagFibres`) as long as no part is stiffer than the beginning.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from fem_models.joint.superelastic import FlagFibres, flag_moment
from fem_models.rig import RigError
from fem_models.rig.joints import MOST_ELEMENTS, MeasuredJoint
from hysteresis.arrays import Floats

ONSETS, ENDS = 24, 6
RETURNS = (0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0)
"""How many angles of onset and of the end of a span the fit chooses from, and which ratios of unloading."""
MOST_OFF = 0.1
"""Largest difference of the law to its curve, over the largest moment: beyond it the curve is refused."""
_MOST_SAMPLES = 240
_LEAST = 1e-4
_EARLY = 0.15
"""Onset over the largest angle, below which no element ends its span: a curve that stiffens is no stiff beginning."""


@dataclass(frozen=True)
class CurveLaw:
    """Elements of a law, and how far it is from its curve, over the largest moment: the root mean square, the most."""

    elements: FlagFibres
    rms: float
    most: float

    def joint(self, joints: int, pitch_mm: float, rigid_gap_mm: float = 0.0) -> MeasuredJoint:
        """Make joints of this law."""
        one, stiffness = self.elements, float(self.elements.stiffness.sum())
        return MeasuredJoint(
            joints=joints,
            pitch_mm=pitch_mm,
            flexure_stiffness_Nmm_per_rad=stiffness,
            rigid_gap_mm=rigid_gap_mm,
            law_share=tuple((one.stiffness / stiffness).tolist()),
            law_onset_deg=tuple(np.degrees(one.upper_Nmm / one.stiffness).tolist()),
            law_return=tuple((one.lower_Nmm / one.upper_Nmm).tolist()),
            law_span_deg=tuple(np.degrees(one.span_rad).tolist()),
        )


def law_of_curve(angle_rad: Floats, moment_Nmm: Floats, where: str) -> CurveLaw:
    """Fit a law to the moment of a joint along a path of angles from rest, both of shape (m,).

    A path that only loads is that of an elastic joint. The law is the same on either side of zero.

    Raises
    ------
    RigError
        One line with ``where``: fewer than eight samples, no moment, or a curve that no such law follows.
    """
    if len(angle_rad) < 8 or not np.abs(moment_Nmm).max() > 0 or not np.ptp(angle_rad) > 0:
        raise RigError(f"{where}: {len(angle_rad)} samples: expected 8 or more of angle and moment, from rest")
    keep = np.unique(np.linspace(0, len(angle_rad) - 1, min(len(angle_rad), _MOST_SAMPLES)).round().astype(int))
    angle, moment = angle_rad[keep], moment_Nmm[keep]
    largest, scale = float(np.abs(angle).max()), float(np.abs(moment).max())
    unloads = bool((np.diff(np.abs(angle)) < -1e-3 * largest).any())
    grid = _grid(largest, RETURNS if unloads else (1.0,))
    path = _path(grid, angle)
    stiffness, _ = nnls(path, moment, maxiter=10 * path.shape[1])
    order = np.argsort(-stiffness)[:MOST_ELEMENTS]
    order = order[stiffness[order] > _LEAST * stiffness.sum()]
    stiffness, _ = nnls(path[:, order], moment)
    order, stiffness = order[stiffness > 0], stiffness[stiffness > 0]
    off = (path[:, order] @ stiffness - moment) / scale if order.size else np.ones_like(moment)
    most = float(np.abs(off).max())
    if most > MOST_OFF:
        raise RigError(
            f"{where}: {100 * most:.3g} % of the largest moment off an elastic or superelastic law: expected a curve "
            "from rest, alike on both sides, nowhere stiffer than at its beginning (closed notches are [closure])"
        )
    made = FlagFibres(
        stiffness, stiffness * grid.upper_Nmm[order], stiffness * grid.lower_Nmm[order], grid.span_rad[order],
        np.zeros_like(stiffness),
    )  # fmt: skip
    return CurveLaw(made, math.sqrt(float(np.mean(off**2))), most)


def _grid(largest: float, returns: tuple[float, ...]) -> FlagFibres:
    """Elements of stiffness 1 that the fit chooses from; the last one stays elastic."""
    onsets, ends = largest * np.geomspace(0.03, 1.0, ONSETS), largest * np.linspace(0.4, 1.0, ENDS)
    rows = [(onset, back, 100 * largest) for onset in onsets for back in returns]
    rows += [
        (onset, back, end - onset)
        for onset in onsets
        for back in returns
        for end in ends
        if _EARLY * largest < onset < end / 1.2
    ]
    rows.append((10 * largest, 1.0, 100 * largest))
    onset, back, span = np.array(rows).T
    one = np.ones_like(onset)
    return FlagFibres(one, onset, onset * back, span, np.zeros_like(onset))


def _path(elements: FlagFibres, angle_rad: Floats) -> Floats:
    """Moments of elements along a path from rest, shape (m, k)."""
    rest, rows = np.zeros_like(elements.stiffness), []
    for angle in angle_rad:
        moment = flag_moment(np.full_like(rest, angle), rest, elements)
        rest = angle - moment / elements.stiffness
        rows.append(moment)
    return np.array(rows)


def without_law(joint: MeasuredJoint) -> MeasuredJoint:
    """Give a joint that is linear, as stiff as at rest."""
    return replace(joint, law_share=(), law_onset_deg=(), law_return=(), law_span_deg=())
