"""Makes the ensemble of the preset du2018, half an hour on two busy cores: ``python -m docs.make.calibration.sample``.

It writes ``fem_models/rig/du2018-ensemble.csv`` and ``.toml``, which ship with the package. ``--draws 256 --members 20
--out FOLDER`` makes a small one elsewhere. The number of workers changes nothing but the time.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from fem_models.rig import preset
from fem_models.rig.ensemble import ensemble_file
from hysteresis.files import write_files
from validation.measured.ensemble.make import Settings, ensemble_files, make_ensemble
from validation.measured.ensemble.priors import MODELS

NAME = "du2018"


def _tell(text: str) -> None:
    print(text, flush=True)  # noqa: T201


def main() -> None:
    """Make the ensemble and write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--draws", type=int, default=2048, help="draws of a model, a power of two")
    parser.add_argument("--members", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="folder that keeps draws, so that a stopped run goes on")
    parser.add_argument("--out", type=Path, default=ensemble_file(NAME).parent)
    given = parser.parse_args()
    settings = Settings(given.seed, given.draws, given.members)
    with ProcessPoolExecutor(given.workers) as pool:
        found = make_ensemble(preset(NAME), MODELS, settings, pool=pool, keep=given.keep, tell=_tell)
    write_files(ensemble_files(given.out, NAME, found, MODELS, settings))


if __name__ == "__main__":
    main()
