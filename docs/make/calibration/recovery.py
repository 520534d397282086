"""Writes how often the ranges of the ensemble hold a hidden rig: ``python -m docs.make.calibration.recovery``.

Takes an hour on two free cores.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from docs.make.pages import DOCS, put_between_marks, table
from fem_models.rig import preset
from validation.measured.ensemble.priors import MODELS
from validation.measured.ensemble.recovery import DRAWS, LEAST_EFFECTIVE, Recovery, recover
from validation.practice.summary import exact_interval

PAGE = DOCS / "validation" / "calibration.md"
NAME, READING, MODEL = "du2018", "half", "Jenkins loop, toe and play"


def words_and_table(found: Recovery, others: int) -> str:
    """How many hidden values lie within their ranges, in all and by name."""
    rows = [
        [f"`{name}`" if " " not in name else name, f"{int(one.sum())} of {one.size}"]
        for name, one in found.inside.items()
    ]
    every = np.concatenate(list(found.inside.values()))
    few = int((found.effective < LEAST_EFFECTIVE).sum())
    low, high = exact_interval(int(every.sum()), every.size)
    words = (
        f"{int(every.sum())} of {every.size} hidden values, {100 * every.mean():.1f} % ({100 * low:.1f} to "
        f'{100 * high:.1f} %), lie within their 95 % ranges (model "{MODEL}", {found.effective.size} rigs, '
        f"{others:,} others, {DRAWS} draws each; {np.median(found.effective):.0f} effective in the median, "
        f"fewer than {LEAST_EFFECTIVE:.0f} in {few} rigs)."
    )
    return words + "\n\n" + table(["number", "within"], rows)


def main() -> None:
    """Hide rigs, find their ranges, and put the count on the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigs", type=int, default=100)
    parser.add_argument("--others", type=int, default=200_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    size = {"rigs": given.rigs, "others": given.others, "seed": given.seed}
    with ProcessPoolExecutor(given.workers) as pool:
        found = recover(preset(NAME), MODELS[MODEL], READING, **size, pool=pool)
    put_between_marks(PAGE, "docs.make.calibration.recovery", words_and_table(found, given.others))


if __name__ == "__main__":
    main()
