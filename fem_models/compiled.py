"""numba's cache on disk for kernels whose code, or whose types, stand in several files.

numba finds compiled code again by the date and size of the file that holds the function. A change in another file, of a
function that it calls or of a type that it takes, would then run old code. A type that was renamed would not load at
all. Here the names of the cached files have a checksum of all files that the kernels come from.
"""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import CompileResultCacheImpl, FunctionCache

Kernel = Callable[..., Any]


def checksum_of(sources: list[Path]) -> str:
    """Checksum of the text of files."""
    return sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]


def njit_of(*sources: Path) -> Callable[..., Callable[[Kernel], Any]]:
    """Give a decorator for kernels that come from these files; its options are those of ``numba.njit``.

    A division by zero gives inf or nan, as numpy's does, unless ``error_model`` is "python": the checks cost time.
    """
    checksum = checksum_of(list(sources))

    class NamedBySources(CompileResultCacheImpl):
        def get_filename_base(self, fullname: str, abiflags: str) -> str:
            return f"{super().get_filename_base(fullname, abiflags)}-{checksum}"

    class Cache(FunctionCache):
        _impl_class = NamedBySources

    def kernel_njit(*, error_model: str = "numpy", **options: Any) -> Callable[[Kernel], Any]:
        def compile_cached(function: Kernel) -> Any:
            dispatcher = njit(error_model=error_model, **options)(function)
            dispatcher._cache = Cache(function)
            return dispatcher

        return compile_cached

    return kernel_njit
