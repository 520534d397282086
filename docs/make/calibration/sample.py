"""Makes the ensembles of the presets of the paper, hours on two cores: ``python -m docs.make.calibration.sample``.

It writes ``NAME-ensemble.csv`` and ``.toml`` in ``fem_models/rig/``, which ship with the package: of ``du2018``, with
the paper's widths as half widths, and of ``du2018-full-widths``. ``--live 100 --effective 50 --members 20 --out
FOLDER`` makes small ones elsewhere. The number of workers changes nothing but the time.
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

PRESETS = {"half": "du2018", "full": "du2018-full-widths"}
"""The preset of each reading of the paper's widths."""


def main() -> None:
    """Make the ensembles and write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    defaults = Settings()
    for name, value in vars(defaults).items():
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--reading", choices=list(PRESETS), action="append", help="by default both")
    parser.add_argument("--keep", type=Path, help="folder that keeps runs, so that a stopped command goes on")
    parser.add_argument("--out", type=Path, default=ensemble_file("du2018").parent)
    given = parser.parse_args()
    settings = Settings(**{name: getattr(given, name) for name in vars(defaults)})
    with ProcessPoolExecutor(given.workers) as pool:
        for reading in given.reading or PRESETS:
            name = PRESETS[reading]
            found = make_ensemble(preset(name), MODELS, reading, settings, pool=pool, keep=given.keep)
            made = {"reading": f"{reading} widths", **vars(settings)}
            write_files(ensemble_files(given.out, name, found, MODELS, made))


if __name__ == "__main__":
    main()
