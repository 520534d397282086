"""A dimensioned drawing of a notched tube: side view, detail of a notch, section at its root; SVG and PDF.

The side view looks across the bending plane of a notch without turn, which points up; a rig with turned notches has a
second view from above. Lengths are true to scale within a view.
"""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.joints import Cut, Tube
from fem_models.rig.rig import notched_tube
from hysteresis.arrays import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK: Final = "#1c2330"
_METAL, _SOFT, _DIM, _TENDON = "#dfe4ec", "#8a8f98", "#1f5fa8", "#1b8070"
_STYLE: dict[Any, Any] = {"font.size": 8.5, "svg.hashsalt": "notchbend", "svg.fonttype": "path", "pdf.fonttype": 42}
_PAPER: Final = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none"}
"""Behind the words of a dimension, which may be wider than it."""
_SIDES = (90.0, 270.0)
"""Angles of the upper and of the lower edge of a view, from the line of sight."""
_SAMPLES = 24


def side_view_svg(rig: Rig) -> str:
    """Draw a rig as SVG text.

    Raises
    ------
    RigError
        Measured joints, which have no notch to draw.
    """
    import matplotlib

    with matplotlib.rc_context(_STYLE):
        stream = io.StringIO()
        _figure(rig).savefig(stream, format="svg", metadata={"Date": None, "Title": "made by notchbend"})
    return stream.getvalue()


def side_view_pdf(rig: Rig) -> bytes:
    """Draw a rig as PDF; errors as :func:`side_view_svg`."""
    import matplotlib

    with matplotlib.rc_context(_STYLE):
        stream = io.BytesIO()
        _figure(rig).savefig(stream, format="pdf", metadata={"CreationDate": None})
    return stream.getvalue()


def _figure(rig: Rig) -> Figure:
    from matplotlib.figure import Figure

    joint = notched_tube(rig)
    # a pair looks alike after half a turn
    turned = any(turn % (360.0 if joint.one_sided else 180.0) for turn in rig.turns_deg)
    rows = 2 if turned else 1
    long, wide = _length_mm(rig), joint.tube.outer_diameter_mm
    tall = min(2.4, max(1.0, 9.8 * 1.75 * wide / (1.12 * long + wide)))
    figure = Figure(figsize=(10.0, rows * tall + 2.9))
    grid = figure.add_gridspec(
        rows + 1, 2, height_ratios=[tall] * rows + [2.8], width_ratios=[1.75, 1.0], left=0.01, right=0.99, top=0.97,
        bottom=0.02, hspace=0.06, wspace=0.03,
    )  # fmt: skip
    axes = figure.add_subplot(grid[0, :])
    _side(axes, rig, sight_deg=-90.0, words="side view" if turned else "", dimensions=True)
    if turned:
        _side(figure.add_subplot(grid[1, :]), rig, sight_deg=0.0, words="from above")
    _detail(figure.add_subplot(grid[rows, 0]), rig)
    _section(figure.add_subplot(grid[rows, 1]), rig)
    return figure


def _length_mm(rig: Rig) -> float:
    joint = notched_tube(rig)
    return joint.places().centres[-1] + 0.5 * (
        joint.notch.at(0).spacing_mm + joint.notch.at(joint.joints - 1).spacing_mm
    )


# --- views --------------------------------------------------------------------------------------------------------


def _profile(cut: Cut, tube: Tube) -> tuple[Floats, Floats]:
    """Places along a notch from its middle, mm, and half of the angle that it spans there, rad; shapes (m,)."""
    half, outer = cut.width_mm / 2, tube.outer_diameter_mm / 2
    root = half if cut.root_width_mm is None else cut.root_width_mm / 2
    flank = np.linspace(half, root, _SAMPLES)
    share = np.ones(_SAMPLES) if root == half else (half - flank) / (half - root)
    right, angle = flank, np.arccos((outer - cut.depth_mm * share) / outer)
    return np.concatenate([-right, right[::-1]]), np.concatenate([angle, angle[::-1]])


def _side(axes: Axes, rig: Rig, *, sight_deg: float, words: str, dimensions: bool = False) -> None:
    """Draw the tube seen along a direction, at an angle from y towards z: 0 looks from the side that y points to."""
    from matplotlib.patches import Polygon

    joint, long = notched_tube(rig), _length_mm(rig)
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    cuts = _cuts(rig)
    edges = [_edge(cuts, joint.tube, long, sight_deg + side) for side in _SIDES]
    upper, lower = edges[0], edges[1] * [1.0, -1.0]
    axes.add_patch(Polygon(np.concatenate([upper, lower[::-1]]), fc=_METAL, ec=INK, lw=0.8, joinstyle="miter"))
    for middle, turn, cut in cuts:
        off = (turn - sight_deg + 180.0) % 360.0 - 180.0
        if abs(off) < 89.0:  # it faces the reader
            along, half = _profile(cut, joint.tube)
            around = np.radians(off)
            top = outer * np.sin(np.clip(around + half, -np.pi / 2, np.pi / 2))
            bottom = outer * np.sin(np.clip(around - half, -np.pi / 2, np.pi / 2))
            outline = np.stack([np.r_[along, along[::-1]] + middle, np.r_[top, bottom[::-1]]], axis=1)
            axes.add_patch(Polygon(outline, fc="white", ec=INK, lw=0.6))
    for height in (-inner, inner):
        axes.plot([0, long], [height, height], color=_SOFT, lw=0.5, ls=(0, (4, 3)))
    axes.plot([-0.02 * long, 1.02 * long], [0, 0], color=_SOFT, lw=0.4, ls=(0, (12, 3, 2, 3)))
    gap = 2 * outer
    if dimensions:
        _across(axes, (0, -outer), (0, outer), -0.45 * gap, f"Ø{_mm(2 * outer)}")
        _across(axes, (long, -inner), (long, inner), 0.45 * gap, f"Ø{_mm(2 * inner)}")
        _along(axes, (0, -outer), (long, -outer), -0.35 * gap, _mm(long))
    if words:
        axes.text(0, outer + 0.12 * gap, words, color=_SOFT)
    for place, text in ((0.0, "base"), (long, "tip")):
        axes.text(place, outer + 0.1 * gap, text, color=_SOFT, ha="right" if place else "left") if not words else None
    _frame(
        axes,
        (-0.06 * long - 0.5 * gap, 1.06 * long + 0.5 * gap),
        (-1.0 * gap if dimensions else -0.6 * gap, 0.75 * gap),
    )


def _cuts(rig: Rig) -> list[tuple[float, float, Cut]]:
    """Give every cut: its middle along the tube, mm, its angle round it, deg, and the notch."""
    joint, places = notched_tube(rig), notched_tube(rig).places()
    first, turns = joint.notch.at(0).spacing_mm, rig.turns_deg
    return [
        (places.middles[k] + first / 2, turns[k] + 180.0 * side, joint.notch.at(k))
        for k in range(joint.joints)
        for side in range(2 - joint.one_sided)
    ]


def _edge(cuts: list[tuple[float, float, Cut]], tube: Tube, long: float, angle_deg: float) -> Floats:
    """Outline of the tube at an angle round it, shape (m, 2): along, and height of the remaining metal."""
    outer = tube.outer_diameter_mm / 2
    points = [np.array([[0.0, outer]])]
    for middle, turn, cut in cuts:
        off = abs(math.radians((turn - angle_deg + 180.0) % 360.0 - 180.0))
        along, half = _profile(cut, tube)
        if off >= half.max():
            continue
        height = outer * np.cos(np.clip(half - off, 0.0, np.pi))
        points += [
            np.array([[middle - cut.width_mm / 2, outer]]),
            np.stack([along + middle, height], axis=1),
            np.array([[middle + cut.width_mm / 2, outer]]),
        ]
    return np.concatenate([*points, np.array([[long, outer]])])


def _detail(axes: Axes, rig: Rig) -> None:
    """Draw the first notch, with its rings, in its own bending plane."""
    from matplotlib.patches import Polygon

    joint = notched_tube(rig)
    tube, cut, outer = joint.tube, joint.notch.at(0), joint.tube.outer_diameter_mm / 2
    inner, ring = tube.inner_diameter_mm / 2, cut.spacing_mm
    shown = min(ring, 3.0 * cut.width_mm)
    begin, end = -cut.width_mm / 2 - 0.5 * shown, cut.width_mm / 2 + shown
    along, half = _profile(cut, tube)
    height = outer * np.cos(half)
    next_one = [[end, outer], [end, outer - cut.depth_mm]]
    top = np.concatenate([[[begin, outer]], [[-cut.width_mm / 2, outer]], np.stack([along, height], 1),
                          [[cut.width_mm / 2, outer]], next_one])  # fmt: skip
    flip = np.array([1.0, -1.0])
    bottom = np.array([[begin, -outer], [end, -outer]]) if joint.one_sided else top * flip
    axes.add_patch(Polygon(np.concatenate([top, bottom[::-1]]), fc=_METAL, ec=INK, lw=0.9, joinstyle="miter"))
    for wall in (-inner, inner):
        axes.plot([begin, end], [wall, wall], color=_SOFT, lw=0.5, ls=(0, (4, 3)))
    size, step = 2 * outer, 0.2 * 2 * outer
    width, left, right = cut.width_mm, -cut.width_mm / 2, cut.width_mm / 2
    _along(axes, (left, outer), (right, outer), step, f"width {_mm(width)}")
    if ring <= shown:
        _along(axes, (right, outer), (end, outer), 2.0 * step, f"ring {_mm(ring)}")
        _along(axes, (left, outer), (end, outer), 3.0 * step, f"pitch {_mm(cut.pitch_mm)}")
    if cut.root_width_mm:
        root = cut.root_width_mm / 2
        _along(axes, (-root, -outer), (root, -outer), -0.8 * step, f"root {_mm(cut.root_width_mm)}")
    _across(axes, (begin, outer), (begin, outer - cut.depth_mm), -0.16 * size, f"depth {_mm(cut.depth_mm)}")
    low = -outer if joint.one_sided else cut.depth_mm - outer
    _across(axes, (end, outer - cut.depth_mm), (end, low), 0.16 * size, f"web {_mm(outer - cut.depth_mm - low)}")
    many = f"notch 1 of {joint.joints}" + (", all alike" if joint.notch.alike else "; the others differ")
    many += "" if ring <= shown else f"; ring {_mm(ring)}, pitch {_mm(cut.pitch_mm)}"
    axes.text((begin + end) / 2, -outer - 0.26 * size, many, color=_SOFT, va="top", ha="center")
    _frame(
        axes,
        (begin - 0.55 * size, end + 0.5 * size),
        (-outer - 0.4 * size, outer + (3.8 if ring <= shown else 1.8) * step),
    )


def _section(axes: Axes, rig: Rig) -> None:
    """Draw the section at the root of the first notch, seen from the tip, with the tendons."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    joint = notched_tube(rig)
    outer, inner, cut = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2, joint.notch.at(0)
    height, size = outer - cut.depth_mm, 2 * outer
    turn = np.linspace(0, 2 * np.pi, 361)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    for radius in (outer, inner):
        axes.plot(*(radius * circle).T, color=_SOFT, lw=0.5, ls=(0, (4, 3)))
    for begin, stop in _arcs_left(height / outer, joint.one_sided):
        ring = _metal(outer, inner, height, joint.one_sided, begin, stop)
        axes.add_patch(PathPatch(Path(ring), fc=_METAL, ec=INK, lw=0.8, hatch="////"))
    for name, angle, tendon in zip("abcd", rig.angles_deg, rig.tendons, strict=False):
        place = tendon.moment_arm_mm * np.array([math.sin(math.radians(angle)), math.cos(math.radians(angle))])
        axes.plot(*place, "o", ms=3.5, color=_TENDON)
        axes.text(float(place[0]) + 0.04 * size, float(place[1]) + 0.04 * size, name, color=_TENDON)
    _across(
        axes, (0, 0), (0, height), 0.64 * size, f"{_mm(abs(height))}\n{'above' if height > 0 else 'below'}\nthe axis"
    )
    axes.plot([-0.58 * size, 0.58 * size], [0, 0], color=_SOFT, lw=0.4, ls=(0, (12, 3, 2, 3)))
    axes.plot([0, 0], [-0.58 * size, 0.58 * size], color=_SOFT, lw=0.4, ls=(0, (12, 3, 2, 3)))
    arm = rig.tendon_a.moment_arm_mm
    axes.text(
        0, -0.62 * size, f"section at the root; tendons {_mm(arm)} mm from the axis", ha="center", va="top", color=_SOFT
    )
    _frame(axes, (-0.95 * size, 1.05 * size), (-0.8 * size, 0.75 * size))


def _arcs_left(share: float, one_sided: bool) -> list[tuple[float, float]]:
    """Angles, rad from up, between which the outer surface is left."""
    half = math.acos(min(1.0, max(-1.0, share)))
    if one_sided:
        return [(half, 2 * math.pi - half)]
    return [(half, math.pi - half), (math.pi + half, 2 * math.pi - half)]


def _metal(outer: float, inner: float, height: float, one_sided: bool, begin: float, stop: float) -> Floats:
    """Outline of one piece of metal: along the outer surface, and back along the bore where it is below the cut."""
    turn = np.linspace(begin, stop, 181)
    around = outer * np.stack([np.sin(turn), np.cos(turn)], axis=1)
    back = inner * np.stack([np.sin(turn), np.cos(turn)], axis=1)[::-1]
    low = -np.inf if one_sided else -height
    back = back[(back[:, 1] <= height) & (back[:, 1] >= low)]
    if abs(height) < inner:  # the cut meets the bore
        chord, ends = math.sqrt(inner**2 - height**2), around[[-1, 0]]
        corners = [[math.copysign(chord, x), y] for x, y in ends]
        back = np.concatenate([corners[:1], back, corners[1:]])
    whole = np.concatenate([around, back, around[:1]])
    return np.asarray(whole)


# --- dimensions ---------------------------------------------------------------------------------------------------


def _along(axes: Axes, one: tuple[float, float], other: tuple[float, float], off: float, words: str) -> None:
    """Dimension along the tube between two points, ``off`` mm above them."""
    height = one[1] + off
    for x, y in (one, other):
        axes.plot([x, x], [y, height], color=_DIM, lw=0.4)
    _arrow(axes, (one[0], height), (other[0], height))
    axes.annotate(
        words,
        ((one[0] + other[0]) / 2, height),
        (0, 2),
        textcoords="offset points",
        ha="center",
        va="bottom",
        color=_DIM,
        bbox=_PAPER,
    )


def _across(axes: Axes, one: tuple[float, float], other: tuple[float, float], off: float, words: str) -> None:
    """Dimension across the tube between two points, ``off`` mm beside them; its words stand on the far side."""
    place = one[0] + off
    for x, y in (one, other):
        axes.plot([x, place], [y, y], color=_DIM, lw=0.4)
    _arrow(axes, (place, one[1]), (place, other[1]))
    side = math.copysign(1.0, off)
    axes.annotate(
        words, (place, (one[1] + other[1]) / 2), (4 * side, 0), textcoords="offset points", va="center", color=_DIM,
        ha="left" if side > 0 else "right", bbox=_PAPER,
    )  # fmt: skip


def _arrow(axes: Axes, one: tuple[float, float], other: tuple[float, float]) -> None:
    axes.annotate(
        "", one, other, arrowprops={"arrowstyle": "<|-|>", "color": _DIM, "lw": 0.5, "shrinkA": 0, "shrinkB": 0,
                                    "mutation_scale": 5}
    )  # fmt: skip


def _frame(axes: Axes, across: tuple[float, float], up: tuple[float, float]) -> None:
    axes.set_xlim(*across)
    axes.set_ylim(*up)
    axes.set_aspect("equal", adjustable="box")
    axes.axis("off")


def _mm(value: float) -> str:
    return f"{value:.4g}"
