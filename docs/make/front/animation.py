"""The animation of the start page: the tube over one cycle, the tensions of its tendons, and the loop."""

from __future__ import annotations

import io

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

import notchbend as nb
from docs.make.front.tube import TENDONS, Camera
from hysteresis.records.backbone import backbone_of

_STEP_MM, _EVERY, _MS, _COLOURS = 0.1, 2, 80, 96
_SIZE_IN, _DPI = (7.6, 3.8), 100


def animation() -> bytes:
    """Draw the last of two cycles of the default rig as GIF."""
    rig = nb.preset("du2018", preload_N=20.0)
    loop = nb.simulate(rig, nb.triangle(2.2, cycles=2, step_mm=_STEP_MM), engine="chain")
    assert loop.cycle is not None
    assert loop.notches_deg is not None
    assert loop.tension_a_N is not None
    assert loop.tension_b_N is not None
    backbone = backbone_of(loop)
    assert backbone is not None
    last = np.flatnonzero(loop.cycle == loop.cycle.max())
    last = np.concatenate([[last[0] - 1], last])  # the reversal at which the cycle begins
    camera = Camera(rig, (820, 760), (-4.0, -19.0), (38.0, 20.0))
    frames = []
    for now in last[1::_EVERY]:
        with mpl.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
            figure = Figure(figsize=_SIZE_IN, facecolor="white")
            tube = figure.add_axes((0.0, 0.0, 0.56, 1.0))
            tube.imshow(camera.take(loop.notches_deg[now], 1.2))
            tube.set_axis_off()
            tube.text(0.03, 0.95, f"{loop.angle_deg[now]:+.0f} deg", transform=tube.transAxes, fontsize=13, va="top")
            tension, width = figure.add_axes((0.64, 0.6, 0.34, 0.32)), figure.add_axes((0.64, 0.12, 0.34, 0.32))
            for name, values in (("a", loop.tension_a_N), ("b", loop.tension_b_N)):
                tension.plot(loop.drive[last], values[last], color=TENDONS[name], lw=1.2, label=f"tendon {name}")
                tension.plot(loop.drive[now], values[now], "o", color=TENDONS[name], ms=6)
            tension.set_title("tension at the wheel, N", loc="left", fontsize=9)
            tension.legend(frameon=False, fontsize=8, loc="upper center", ncols=2)
            tension.set_ylim(0.0, 1.25 * max(loop.tension_a_N.max(), loop.tension_b_N.max()))
            opened = loop.angle_deg - backbone
            width.plot(loop.drive[last], opened[last], color="#8a8f98", lw=1.2)
            width.plot(loop.drive[now], opened[now], "o", color="#c8641e", ms=6)
            width.set_title("hysteresis: angle less its mean, deg", loc="left", fontsize=9)
            width.set_xlabel("drive, mm")
            stream = io.BytesIO()
            figure.savefig(stream, format="png", dpi=_DPI)
        frames.append(Image.open(stream).convert("RGB"))
    palette = _palette(frames)
    first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    film = io.BytesIO()
    first.save(film, format="gif", save_all=True, append_images=others, duration=_MS, loop=0, optimize=True)
    return film.getvalue()


def _palette(frames: list[Image.Image]) -> Image.Image:
    """One palette for all frames, so that nothing flickers: that of a few of them side by side."""
    some = frames[:: len(frames) // 6]
    width, height = frames[0].size
    sheet = Image.new("RGB", (width * len(some), height))
    for i, frame in enumerate(some):
        sheet.paste(frame, (width * i, 0))
    return sheet.quantize(_COLOURS, method=Image.Quantize.MAXCOVERAGE)
