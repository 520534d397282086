"""numba's cache on disk for the chain's kernels, which call each other from file to file.

numba finds compiled code again by the date and size of the file that holds the function. A change in another file, of a
function that it calls or of a type that it takes, would then run old code, or fail to load it. Here the names of the
cached files have a checksum of all files that the kernels come from.
"""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import CompileResultCacheImpl, FunctionCache

from fem_models.load import stepping


def sources() -> list[Path]:
    """All files that the kernels come from: those of this folder, and the step control."""
    return [*sorted(Path(__file__).parent.glob("*.py")), Path(stepping.__file__)]


CHECKSUM = sha256(b"".join(path.read_bytes() for path in sources())).hexdigest()[:16]


class _NamedBySources(CompileResultCacheImpl):
    def get_filename_base(self, fullname: str, abiflags: str) -> str:
        return f"{super().get_filename_base(fullname, abiflags)}-{CHECKSUM}"


class _Cache(FunctionCache):
    _impl_class = _NamedBySources


def chain_njit(*, error_model: str = "numpy", **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a kernel as ``numba.njit(**options)`` does, and keep the code on disk.

    A division by zero gives inf or nan, as numpy's does, unless ``error_model`` is "python": the checks cost time.
    """

    def compile_cached(function: Callable[..., Any]) -> Any:
        dispatcher = njit(error_model=error_model, **options)(function)
        dispatcher._cache = _Cache(function)
        return dispatcher

    return compile_cached
