"""How the kernels of the chain in space are compiled: see :mod:`fem_models.compiled`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fem_models.compiled import Kernel, njit_of
from fem_models.load import stepping

SOURCES = [*sorted(Path(__file__).parent.glob("*.py")), Path(stepping.__file__)]
"""All files that the kernels come from: those of this folder, and the step control."""

_kernel = njit_of(*SOURCES)


def spatial_njit(*, allocates: bool = False, **options: Any) -> Callable[[Kernel], Any]:
    """Give the decorator of the kernels; most make no arrays (see :func:`fem_models.compiled.njit_of`)."""
    return _kernel(allocates=allocates, **options)
