"""Writes how often the ranges of the ensemble hold a hidden rig: ``python -m docs.make.calibration.recovery``.

Takes five minutes on two free cores.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor

import numpy as np

from docs.make.pages import DOCS, put_between_marks, table
from fem_models.rig import preset
from validation.measured.ensemble.priors import MODELS
from validation.measured.ensemble.recovery import recover

PAGE = DOCS / "validation" / "calibration.md"
MODEL = "Jenkins loop, toe"
RIGS, DRAWS, SEED = 16, 256, 100


def main() -> None:
    """Hide rigs, find their ranges, and put the count on the page."""
    with ProcessPoolExecutor(2) as pool:
        found = recover(preset("du2018"), MODELS[MODEL], rigs=RIGS, draws=DRAWS, seed=SEED, pool=pool)
    rows = [
        [f"`{name}`" if " " not in name else name, f"{int(one.sum())} of {one.size}"]
        for name, one in found.inside.items()
    ]
    every = np.concatenate(list(found.inside.values()))
    words = (
        f"{int(every.sum())} of {every.size} hidden values, {100 * every.mean():.0f} %, lie within their 90 % ranges "
        f'(model "{MODEL}", {RIGS} rigs, {DRAWS} draws each, {np.median(found.effective):.0f} effective).'
    )
    put_between_marks(PAGE, "docs.make.calibration.recovery", words + "\n\n" + table(["number", "within"], rows))


if __name__ == "__main__":
    main()
