"""How the chain's kernels are compiled: see :mod:`fem_models.compiled`."""

from __future__ import annotations

from pathlib import Path

from fem_models.compiled import njit_of
from fem_models.load import stepping

SOURCES = [*sorted(Path(__file__).parent.glob("*.py")), Path(stepping.__file__)]
"""All files that the kernels come from: those of this folder, and the step control."""

chain_njit = njit_of(*SOURCES)
