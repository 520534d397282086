"""Writes the tables and the figure of ``docs/validation/york2015.md``: ``python -m docs.make.york``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from docs.make.pages import DOCS, IMAGES, png, put_after_heading, table
from fem_models.load_control import run_load_control
from fem_models.rig import Rig, read_rig
from hysteresis.files import write_files
from validation.measured import measured_folder
from validation.measured.predicted_wrists import (
    AUTHORS,
    RANGES,
    Band,
    Score,
    band,
    influence_deg,
    known,
    predicted,
    score,
)
from validation.measured.wrists import TUBES, read_trials

PAGE = DOCS / "validation" / "york2015.md"
RIG = PAGE.with_suffix(".toml")
PICTURE = IMAGES / "york2015.png"
HEADING = "## Tables"
FORCE_N = np.linspace(0.0, 4.2, 22)
SHOWN = slice(0, None, 3)
AT_N = (2.0, 3.0, 4.2)
PUBLISHED_N, PUBLISHED_DEG = 4.2, 144.0
"""Largest force and the tip there, York et al., ICRA 2015: the one measured value that is used, and only to compare."""


@dataclass(frozen=True)
class Prediction:
    """What the page tells: the band, the authors' curve, influences at :data:`AT_N`, narrower bands, other tubes."""

    found: Band
    authors_deg: Sequence[float]
    effects: Sequence[Mapping[str, float]]
    narrower: Mapping[str, Band]
    scores: Sequence[Score]


def tables(told: Prediction) -> str:
    """Format everything after the heading of the tables."""
    found, authors_deg, effects, scores = told.found, told.authors_deg, told.effects, told.scores
    ranges = [[name, f"{one.low:g} to {one.high:g} {one.unit}".strip(), one.source] for name, one in RANGES.items()]
    columns = (found.force_N, found.low_deg, found.median_deg, found.high_deg, found.middle_deg, np.array(authors_deg))
    rows = [[f"{value:.1f}" for value in row] for row in zip(*(column[SHOWN] for column in columns), strict=True)]
    influence = [[name, *(f"{effect[name]:+.1f}" for effect in effects)] for name in RANGES]
    measured = [[f"'{one.tube}'", f"{one.rmse_deg:.1f}", f"{one.inside} of {one.count}"] for one in scores]
    at = [int(np.argmin(np.abs(FORCE_N - force))) for force in AT_N]
    widths = [
        [name, *(f"{one.high_deg[i] - one.low_deg[i]:.0f}" for i in at)]
        for name, one in {"nothing more": found, **told.narrower}.items()
    ]
    parts = [
        ("Ranges, uniform", table(["constant", "range", "from"], ranges)),
        (
            f"Tip of York's tube, deg, over {found.samples} samples of the ranges",
            table(["N", "5 %", "median", "95 %", "`york2015.toml`", "authors' constants"], rows),
        ),
        (
            "Tip at the end of a range less that at its start, the others in the middle, deg",
            table(["constant", *(f"at {force:g} N" for force in AT_N)], influence),
        ),
        (
            "Width of the band, deg, if something were known",
            table(["known", *(f"at {FORCE_N[i]:.1f} N" for i in at)], widths),
        ),
        (
            "Two other measured wrists with the same settings",
            table(["tube", "RMSE of the tip, deg", "samples in the 90 % band"], measured),
        ),
    ]
    return "\n\n".join(f"### {title}\n\n{text}" for title, text in parts)


def figure(found: Band, authors_deg: Sequence[float]) -> bytes:
    """PNG of the band, and the published end of the curve."""
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(6.5, 4.2), layout="constrained")
    ax = drawing.subplots()
    ax.fill_between(found.force_N, found.low_deg, found.high_deg, alpha=0.3, label="90 % band of the ranges")
    ax.plot(found.force_N, found.middle_deg, label="york2015.toml, middle of the ranges")
    ax.plot(found.force_N, authors_deg, "--", label="authors' constants")
    ax.plot(PUBLISHED_N, PUBLISHED_DEG, "k*", ms=10, label="published largest angle")
    ax.set_xlabel("tension of the tendon, N")
    ax.set_ylabel("angle of the tip, deg")
    ax.legend(fontsize=8, loc="upper left")
    return png(drawing, dpi=100)


def authors_curve(rig: Rig) -> list[float]:
    """Tip with the constants that the authors chose, deg."""
    return run_load_control(predicted(rig, AUTHORS), FORCE_N).angle_deg.tolist()


def main(folder: Path | None = None) -> None:
    """Predict York's tube and both measured wrists; write tables and figure."""
    rig = read_rig(RIG)
    told = Prediction(
        found=band(rig, FORCE_N),
        authors_deg=authors_curve(rig),
        effects=[influence_deg(rig, force) for force in AT_N],
        narrower={
            "depth to 0.005 mm": band(rig, FORCE_N, ranges=known(RANGES, ["depth"], 0.25)),
            "all but the depth": band(rig, FORCE_N, ranges=known(RANGES, [n for n in RANGES if n != "depth"])),
        },
        scores=[score(read_trials(folder or measured_folder(), tube)) for tube in TUBES],
    )
    put_after_heading(PAGE, HEADING, tables(told))
    write_files({PICTURE: figure(told.found, told.authors_deg)})


if __name__ == "__main__":
    main()
