"""Writes how often intervals of the tendon robot hold the truth: ``python -m docs.make.coverage``, four minutes."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor

import numpy as np

from docs.make.pages import DOCS, put_between_marks, table
from validation.measured.tendon_coverage import coverage
from validation.measured.tendon_robot import FIXED

PAGE = DOCS / "validation" / "tendon-robot.md"
PAIRS = 40
NOISES = {"bending 0.5 %, tension 0.05 %": (0.0005, 0.005), "both 0.5 %": (0.005, 0.005)}


def main() -> None:
    """Score the intervals at two sizes of noise, and put the table on the page."""
    with ProcessPoolExecutor(2) as pool:
        found = {name: coverage(PAIRS, *noise, FIXED, pool) for name, noise in NOISES.items()}
    names = next(iter(found.values()))
    rows = [[f"`{name}`", *(f"{100 * one[name]:.0f}" for one in found.values())] for name in names]
    rows.append(["all", *(f"{100 * np.mean(list(one.values())):.0f}" for one in found.values())])
    put_between_marks(PAGE, "docs.make.coverage", table(["parameter", *found], rows))


if __name__ == "__main__":
    main()
