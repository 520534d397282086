"""The picture of the README: the bent tube, the residual before and after, and the verdict."""

from __future__ import annotations

import io
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from docs.make.front.example import Example
from docs.make.front.tube import Camera

_SIZE_IN, _DPI, _COLOURS = (10.0, 7.0), 120, 128


@dataclass(frozen=True)
class Page:
    """Colours of a page of GitHub."""

    paper: str
    ink: str
    faint: str
    before: str
    after: str


LIGHT = Page("#ffffff", "#1f2328", "#d8dee4", "#c8641e", "#1f5fa8")
DARK = Page("#0d1117", "#e6edf3", "#30363d", "#f0883e", "#58a6ff")


def draw(example: Example, tube: Image.Image, page: Page) -> bytes:
    """Draw the picture as PNG."""
    style = {"font.size": 16, "text.color": page.ink, "axes.labelcolor": page.ink, "axes.edgecolor": page.faint}
    style |= {"xtick.color": page.ink, "ytick.color": page.ink, "axes.spines.top": False, "axes.spines.right": False}
    with mpl.rc_context({**style, "grid.color": page.faint}):
        figure = Figure(figsize=_SIZE_IN, facecolor=page.paper)
        _tube(figure.add_axes((0.0, 0.47, 0.56, 0.52)), tube, example, page)
        _verdict(figure.add_axes((0.57, 0.47, 0.42, 0.52)), example, page)
        before = figure.add_axes((0.125, 0.105, 0.37, 0.29))
        after = figure.add_axes((0.61, 0.105, 0.37, 0.29))
        _residuals(before, after, example, page)
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=_DPI, facecolor=page.paper)
    small = io.BytesIO()
    Image.open(stream).convert("RGB").quantize(_COLOURS).save(small, format="png", optimize=True)
    return small.getvalue()


def bent_tube(example: Example) -> Image.Image:
    """Draw the tube where the loop bends it most."""
    loop = example.loop
    assert loop.notches_deg is not None
    top = int(np.argmax(loop.angle_deg))
    return Camera(example.rig, (1100, 740), (-4.0, -5.0), (36.0, 21.0)).take(loop.notches_deg[top], 1.2)


def _tube(axes: Axes, tube: Image.Image, example: Example, page: Page) -> None:
    axes.imshow(tube)
    axes.set_axis_off()
    words = f"simulated, at {example.loop.angle_deg.max():.0f} deg\ncolour: bending strain"
    axes.text(0.04, 0.97, words, transform=axes.transAxes, fontsize=14, va="top", color=page.ink)


def _verdict(axes: Axes, example: Example, page: Page) -> None:
    """Write what the tracer says, and what was hidden."""
    axes.set_axis_off()
    found = example.found
    (effect,) = found.to_dict()["effects"]
    ratio = effect["parameters"]["arm_ratio"]
    a, b = example.worn.tendons
    axes.text(0.0, 0.92, "Which effect does\nthe model lack?", fontsize=21, weight="bold", va="top")
    axes.text(0.0, 0.6, f"verdict: {effect['name']}", fontsize=18, weight="bold", color=page.after, va="top")
    lines = (
        f"ratio of the arms {ratio['value']:.3f}",
        f"95 % interval {ratio['low']:.3f} to {ratio['high']:.3f}",
        f"hidden in the rig {b.moment_arm_mm / a.moment_arm_mm:.3f}",
        f"noise {found.floor.deg:.3f} deg (grey: twice)",
    )
    axes.text(0.0, 0.45, "\n".join(lines), fontsize=16, va="top", linespacing=1.45)


def _residuals(before: Axes, after: Axes, example: Example, page: Page) -> None:
    found, drive = example.found, example.loop.drive
    errors = found.baseline.heldout_rmse_deg, found.augmented.heldout_rmse_deg
    most = 1.1 * float(np.abs(found.baseline.residuals[0]).max())
    for axes, fitted, colour, name in (
        (before, found.baseline, page.before, "before"),
        (after, found.augmented, page.after, "after"),
    ):
        axes.axhspan(-2 * found.floor.deg, 2 * found.floor.deg, color=page.faint, lw=0)
        axes.plot(drive, fitted.residuals[0], "o-", color=colour, ms=3.5, lw=1.0)
        error = errors[axes is after]
        axes.set_title(f"{name}: {error:.3f} deg rms held out", loc="left", fontsize=16, color=colour)
        axes.set(ylim=(-most, most), xlabel="drive, mm", facecolor=page.paper)
    before.set_ylabel("residual, deg")
