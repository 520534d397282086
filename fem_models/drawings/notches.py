"""Notches from the outlines of a flat pattern: the inverse of :mod:`fem_models.drawings.pattern`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from fem_models.drawings.beam import Beam, cut_height_of_angle_mm
from fem_models.drawings.pattern import v_flank
from fem_models.drawings.read_dxf import Sheet
from fem_models.rig import RigError
from fem_models.rig.joints import Cut, Tube
from hysteresis.arrays import Floats

DIGITS: Final = 6
"""Decimals of the lengths, mm, and angles, deg, that are read."""
TOLERANCE_MM: Final = 0.02
"""How far an outline may be from the notch that is read from it, and opposite cuts of a pair from each other."""
NotchTable = Mapping[str, str | int | float | list[float]]
"""The table [notch] of a rig file, with ``turn_deg``."""
_STRAIGHT = 0.02
_PLACES = 25


@dataclass(frozen=True)
class _Slit:
    """One cut: its middle (along, round), its extents with the kerf, and its outline about its middle, mm."""

    along: float
    round: float
    width: float
    arc: float
    points: Floats


@dataclass(frozen=True)
class _Reading:
    """What an outline is read with."""

    where: str
    tube: Tube
    kerf_mm: float
    beam: Beam


def notch_table(sheet: Sheet, tube: Tube, where: str, *, kerf_mm: float, beam: Beam) -> NotchTable:
    """Give the table [notch] of a rig file, with ``turn_deg``, from the outlines of a sheet.

    Outlines at one place along the tube are the cuts of one notch: one of a one-sided notch, two opposite ones of a
    pair. An outline that the seam divides is joined. The turn of a notch is that of its middle from the rig's y;
    without an angle of the seam in the header the first notch has a turn of 0. The uncut tube beyond the last notch is
    as long as the ring before it, where the drawing has no edge of the sheet.

    Parameters
    ----------
    where
        Name of the file, for messages.
    kerf_mm
        What the beam takes away, half of it on either side of its path.

    Raises
    ------
    RigError
        One line with file and notch: outlines that are no such notches.
    """
    read = _Reading(where, tube, kerf_mm, beam)
    rounds = math.pi * tube.outer_diameter_mm
    slits = _joined([_slit(points, kerf_mm) for points in sheet.outlines], rounds, read)
    slits = [one for one in slits if one.arc < rounds * (1 - 1e-6)]  # the edge of the sheet is none
    if not slits:
        raise RigError(f"{where}: no outline of a notch: expected closed outlines narrower than {rounds:g} mm")
    rows = _rows(sorted(slits, key=lambda one: one.along), read)
    pairs = {len(row) for row in rows}
    if len(pairs) > 1 or max(pairs) > 2:
        counts = ", ".join(str(len(row)) for row in rows)
        raise RigError(f"{where}: {counts} outlines at the places along the tube: expected one of each notch, or two")
    notches = [_notch(row, number, read) for number, row in enumerate(rows, start=1)]
    shapes = {one.shape for one in notches}
    if len(shapes) > 1:
        raise RigError(f"{where}: notches of the shapes {' and '.join(sorted(shapes))}: expected one shape")
    return _table(rows, notches, sheet, rounds)


def _slit(points: Floats, kerf_mm: float) -> _Slit:
    low, high = points.min(axis=0), points.max(axis=0)
    (along, around), (width, arc) = (low + high) / 2, high - low + kerf_mm
    return _Slit(float(along), float(around), float(width), float(arc), points - (low + high) / 2)


def _joined(slits: list[_Slit], rounds: float, read: _Reading) -> list[_Slit]:
    """Join the halves of outlines that the seam divides: one ends on either long side of the sheet."""
    half, close = read.kerf_mm / 2, TOLERANCE_MM
    above = [one for one in slits if abs(one.round - one.arc / 2 + half) <= close]
    below = [one for one in slits if abs(one.round + one.arc / 2 - half - rounds) <= close]
    out = list(slits)
    for one in above:
        for other in below:
            if one is not other and other in out and abs(one.along - other.along) <= close and one in out:
                out.remove(one)
                out.remove(other)
                moved = other.points + np.array([other.along, other.round - rounds])
                whole = np.concatenate([moved, one.points + np.array([one.along, one.round])])
                out.append(_slit(whole, read.kerf_mm))
                break
    return out


def _rows(slits: list[_Slit], read: _Reading) -> list[list[_Slit]]:
    """Group cuts at one place along the tube."""
    rows: list[list[_Slit]] = []
    for one in slits:
        if rows and one.along - rows[-1][0].along <= min(TOLERANCE_MM, one.width / 4):
            rows[-1].append(one)
        else:
            rows.append([one])
    for number, (row, after) in enumerate(pairwise(rows), start=1):
        gap = after[0].along - after[0].width / 2 - row[0].along - row[0].width / 2
        if gap <= 0:
            raise RigError(f"{read.where}: notches {number} and {number + 1} overlap: expected a ring between them")
    return rows


def _notch(row: list[_Slit], number: int, read: _Reading) -> Cut:
    """Read one notch; the spacing is not known yet."""
    at, one_sided, rounds = f"{read.where}: notch {number}", len(row) == 1, math.pi * read.tube.outer_diameter_mm
    first = row[0]
    for other in row[1:]:
        off = abs((other.round - first.round) % rounds - rounds / 2)
        sizes = max(abs(other.width - first.width), abs(other.arc - first.arc))
        if max(off, sizes) > TOLERANCE_MM:
            found = f"{at}: its two cuts are {off:.3g} mm off opposite, {sizes:.3g} mm different"
            raise RigError(f"{found}: expected at most {TOLERANCE_MM} mm of both")
    half = first.arc / read.tube.outer_diameter_mm
    if not one_sided and half >= math.pi / 2:
        raise RigError(
            f"{at}: an arc of {first.arc:.4g} mm: expected below {rounds / 2:.4g} mm, half the circumference"
        )
    cut = cut_height_of_angle_mm(read.tube, half, one_sided=one_sided, beam=read.beam)
    depth = read.tube.outer_diameter_mm / 2 - cut
    if abs(_width_at(first.points, 0.5 * (first.arc - read.kerf_mm) * 0.9) + read.kerf_mm - first.width) <= (
        _STRAIGHT * first.width
    ):
        return Cut("rectangular" if one_sided else "rectangular_pair", depth, first.width, 0.0, None, False)
    if one_sided:
        raise RigError(f"{at}: narrower at its ends than in its middle: expected a slot, as notches on one side are")
    return _v(first, depth, at, read)


def _width_at(points: Floats, around: float) -> float:
    """Width of an outline along the tube, at a place round it."""
    closed = np.concatenate([points, points[:1]])
    crossing = []
    for one, other in pairwise(closed):
        low, high = sorted((one[1], other[1]))
        if low < around <= high:
            crossing.append(one[0] + (other[0] - one[0]) * (around - one[1]) / (other[1] - one[1]))
    return max(crossing) - min(crossing) if crossing else 0.0


def _v(slit: _Slit, depth: float, at: str, read: _Reading) -> Cut:
    """Read depth and root of a V: of all, the one whose path is as broad as the outline all along it.

    A kerf may round the path to a point before the root, so that the arc of the outline does not give the depth.
    """
    end = 0.5 * (slit.arc - read.kerf_mm)
    places = end * np.linspace(0.05, 0.98, _PLACES)
    found = np.array([_width_at(slit.points, place) for place in places])

    def cut_of(values: Floats) -> Cut:
        return Cut("v_pair", float(values[0]), slit.width, 0.0, float(values[1]), False)

    def off(values: Floats) -> Floats:
        flank = v_flank(read.tube, cut_of(values), read.kerf_mm, read.beam)
        return np.asarray(2 * np.interp(places, flank[:, 1], flank[:, 0], right=0.0) - found)

    most = read.tube.outer_diameter_mm / 2 * (1 - 1e-9)
    least = depth if read.kerf_mm == 0 else min(depth, most) * 0.98
    start = [min(max(depth, least), most), min(max(float(found[-1]), 0.0), 0.99 * slit.width)]
    bounds = ([least * (1 - 1e-12), 0.0], [most, slit.width * (1 - 1e-9)])
    fit = least_squares(off, start, bounds=bounds, xtol=1e-14, ftol=1e-14, gtol=1e-14, x_scale=[1.0, 0.1])
    apart = float(np.abs(fit.fun).max())
    if apart > TOLERANCE_MM:
        words = f"{at}: its flanks are {apart:.3g} mm off those of a V"
        raise RigError(f"{words} that planes cut into a tube: expected at most {TOLERANCE_MM} mm")
    return cut_of(fit.x)


def _table(rows: list[list[_Slit]], notches: list[Cut], sheet: Sheet, rounds: float) -> NotchTable:
    widths, along = [one.width_mm for one in notches], [row[0].along for row in rows]
    ends = [place + width / 2 for place, width in zip(along, widths, strict=True)]
    spacings = [place - width / 2 - end for place, width, end in zip(along[1:], widths[1:], ends, strict=False)]
    if sheet.ends_mm is not None:
        last = sheet.ends_mm[1] - ends[-1]
        spacings.append(last if last > 0 else (spacings or widths)[-1])
    else:
        spacings.append((spacings or [along[0] - widths[0] / 2])[-1])
    angles = [-360.0 * row[0].round / rounds for row in rows]
    zero = sheet.said.get("SEAM_DEG", -angles[0])
    period = 360.0 if notches[0].shape == "rectangular" else 180.0
    turns = [_rounded((angle + zero + period / 4) % period - period / 4) for angle in angles]
    columns: Mapping[str, list[float]] = {
        "depth_mm": [_rounded(one.depth_mm) for one in notches],
        "width_mm": list(map(_rounded, widths)),
        "spacing_mm": list(map(_rounded, spacings)),
        **({"root_width_mm": [_rounded(one.root_width_mm or 0.0) for one in notches]} if _is_v(notches) else {}),
        "turn_deg": turns,
    }
    same = {name: values[0] if len(set(values)) == 1 else values for name, values in columns.items()}
    return {"shape": notches[0].shape, "count": len(notches), **same}


def _is_v(notches: list[Cut]) -> bool:
    return notches[0].shape == "v_pair"


def _rounded(value: float) -> float:
    return round(value, DIGITS) + 0.0
