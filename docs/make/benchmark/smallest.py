"""Puts the smallest sizes that are found into ``docs/validation/practice.md``, and draws their figure.

``python -m docs.make.benchmark.smallest DIR`` reads what ``validation.practice.smallest.score`` wrote.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from docs.make.pages import DOCS, IMAGES, png, put_between_marks, table
from hysteresis.files import write_files
from hysteresis.plain import from_plain
from validation.practice.catalogue import CATALOGUE
from validation.practice.draw import CLEAN
from validation.practice.protocols import KINDS
from validation.practice.smallest.score import FalseAlarms
from validation.practice.smallest.search import LADDER, Smallest

PAGE = DOCS / "validation" / "practice.md"
UNITS = {
    "backlash": "mm",
    "time_delay": "s",
    "thermal_drift": "deg/s",
    "wheel_eccentricity": "mm",
    "preload_loss": "of the preload",
    "preloaded_play": "mm",
    "drive_gain": "relative",
    "superelastic_plateau": "MPa",
    "notch_closure": "deg",
}
"""Units of the main constants."""
COLOURS = {"known": "#1f77b4", "unknown": "#d95f02"}

Found = Mapping[tuple[str, str], Smallest]


def read(folder: Path) -> tuple[Found, Mapping[str, FalseAlarms]]:
    """Read the results of a folder, by kind and effect, and the false alarms by kind."""
    found, alarms = dict[tuple[str, str], Smallest](), dict[str, FalseAlarms]()
    for kind in KINDS:
        for name in [*CATALOGUE, CLEAN]:
            file = folder / f"{kind}-{name}.json"
            if not file.exists():
                continue
            contents = json.loads(file.read_text(encoding="utf-8"))
            if name == CLEAN:
                alarms[kind] = from_plain(FalseAlarms, contents, str(file))
            else:
                found[kind, name] = from_plain(Smallest, contents, str(file))
    return found, alarms


def tables(found: Found, alarms: Mapping[str, FalseAlarms]) -> str:
    """Markdown: false alarms, and a row for each effect."""
    words = [
        f"{a.named} of {a.of} ({'known rig' if kind == 'known' else 'unknown geometry'})" for kind, a in alarms.items()
    ]
    rows = [
        [f"`{name}`", *(_cell(found.get((kind, name)), name) for kind in KINDS)]
        for name in CATALOGUE
        if any((kind, name) in found for kind in KINDS)
    ]
    return "\n\n".join(
        [
            f"Clean cases of the same protocol in which an effect is named: {', '.join(words)}.",
            table(["effect", "known rig: times the noise", "unknown geometry: times the noise"], rows),
        ]
    )


def _cell(one: Smallest | None, name: str) -> str:
    if one is None:
        return "-"
    if one.ratio is None:
        missed = sorted((tried for tried in one.tried if tried.is_missed), key=lambda tried: tried.ratio)
        if not missed:
            return "out of reach"
        left = [value for value in missed[-1].left if math.isfinite(value)]
        held = f"; the baseline's error is {np.median(left):.2g} times the noise there" if left else ""
        return f"not at {' to '.join(f'{ratio:g}' for ratio in sorted({missed[0].ratio, missed[-1].ratio}))}{held}"
    constant = f" ({one.constant:.2g} {UNITS[name]})" if one.constant is not None and name in UNITS else ""
    return f"{one.ratio:g}{constant}"


def figure(found: Found) -> Figure:
    """Draw the smallest size of each effect, both kinds beside each other."""
    names = [name for name in CATALOGUE if any((kind, name) in found for kind in KINDS)]
    picture = Figure(figsize=(8.0, 0.28 * len(names) + 1.4), layout="constrained")
    axes = picture.add_subplot()
    for kind, offset in zip(KINDS, (-0.15, 0.15), strict=True):
        at = [(i, found[kind, name].ratio) for i, name in enumerate(names) if (kind, name) in found]
        there = [(i, ratio) for i, ratio in at if ratio is not None]
        missed = [(i, _largest_missed(found[kind, names[i]])) for i, ratio in at if ratio is None]
        label = "known rig" if kind == "known" else "unknown geometry"
        axes.plot([r for _, r in there], [i + offset for i, _ in there], "o", color=COLOURS[kind], label=label)
        axes.plot([r for _, r in missed], [i + offset for i, _ in missed], ">", color=COLOURS[kind], mfc="none")
    axes.set_xscale("log", base=2)
    axes.set_xticks(LADDER[::2], [f"{ratio:g}" for ratio in LADDER[::2]])
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlabel("smallest size found in 9 of 10, times the noise (open: largest one missed)")
    axes.grid(axis="x", alpha=0.3)
    picture.legend(loc="outside upper center", ncols=2)
    return picture


def _largest_missed(one: Smallest) -> float:
    return max((tried.ratio for tried in one.tried if tried.is_missed), default=LADDER[-1])


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the table and the figure."""
    parser = argparse.ArgumentParser(
        prog="python -m docs.make.benchmark.smallest", description="Put smallest sizes into a page."
    )
    parser.add_argument("folder", type=Path, help="folder that validation.practice.smallest.score wrote")
    options = parser.parse_args(arguments)
    found, alarms = read(options.folder)
    put_between_marks(PAGE, "docs.make.benchmark.smallest", tables(found, alarms))
    write_files({IMAGES / "smallest-sizes.png": png(figure(found))})


if __name__ == "__main__":
    main()
