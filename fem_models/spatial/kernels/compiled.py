"""How the kernels of the chain in space are compiled: see :mod:`fem_models.compiled`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fem_models.compiled import Kernel, njit_of
from fem_models.load import stepping

_HERE = Path(__file__).parent
SOURCES = [*sorted(_HERE.glob("*.py")), *sorted(_HERE.parent.glob("*.py")), Path(stepping.__file__)]
"""All files that the kernels and their types come from: those of this room, and the step control."""

_kernel = njit_of(*SOURCES)


def spatial_njit(**options: Any) -> Callable[[Kernel], Any]:
    """Give the decorator of the kernels, which make no arrays (see :func:`fem_models.compiled.njit_of`)."""
    return _kernel(allocates=False, **options)
