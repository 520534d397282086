"""Study files for the tests, and how two datasets are compared."""

from pathlib import Path

import numpy as np
import xarray as xr

HEAD = 'schema = 1\ntitle = "t"\nengine = "chain"\n[rig]\npreset = "du2018"\n'
PROGRAM = "[program]\namplitude_mm = 2.2\ncycles = 2\n"
GRID = HEAD + PROGRAM + '[vary]\npreload_N = [10, 15, 20, 30]\n"notch.depth_mm" = [2.8, 2.825, 3.2]\n'
"""Twelve cases; the last depth is beyond the tube's radius of 3.1 mm, so that four of them fail."""
LONG = GRID.replace("[10, 15, 20, 30]", "{ from = 10, to = 40, count = 80 }").replace("cycles = 2", "cycles = 12")
"""240 cases, of which 80 fail; long enough to be interrupted."""


def study_file(folder: Path, text: str = GRID, name: str = "s.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def same(a: xr.Dataset, b: xr.Dataset) -> None:
    """Bit for bit, except for the computing time of the cases."""
    xr.testing.assert_identical(a.drop_vars("wall_s").load(), b.drop_vars("wall_s").load())
    for name in a.data_vars:
        if a[name].dtype == np.float64 and name != "wall_s":
            assert a[name].values.tobytes() == b[name].values.tobytes()
