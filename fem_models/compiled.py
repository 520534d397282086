"""numba's cache on disk for kernels whose code, or whose types, stand in several files.

numba finds compiled code again by the date and size of the file that holds the function. A change in another file, of a
function that it calls or of a type that it takes, would then run old code, and the code for a type that was renamed
would fail to load. Here a checksum of all files that the kernels come from takes the place of date and size.
"""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile

from fem_models.inlined import KernelCompiler, inline_in_kernels

Kernel = Callable[..., Any]


def checksum_of(sources: list[Path]) -> str:
    """Checksum of the text of files."""
    return sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]


class _Index(IndexDataCacheFile):
    """Index of the cached code of one kernel."""

    def _load_index(self) -> dict[Any, str]:
        try:
            return dict(super()._load_index())
        except (AttributeError, ImportError):  # it names a type that is no longer there
            return {}


class _Cache(FunctionCache):
    """numba's cache of one kernel, valid for a checksum."""

    def __init__(self, function: Kernel, checksum: str) -> None:
        super().__init__(function)
        self._cache_file = _Index(self._cache_path, self._impl.filename_base, checksum)


def njit_of(*sources: Path) -> Callable[..., Callable[[Kernel], Any]]:
    """Give a decorator for kernels that come from these files; its options are those of ``numba.njit``.

    A division by zero gives inf or nan, as numpy's does, unless ``error_model`` is "python": the checks cost time. A
    kernel that is told not to allocate (``allocates`` False) counts no references to the arrays that it takes, which
    may cost more than its arithmetic. Its caller holds the arrays, and it returns none; numba refuses to compile it if
    it makes one.
    """
    checksum = checksum_of(list(sources))

    def kernel_njit(*, error_model: str = "numpy", allocates: bool = True, **options: Any) -> Callable[[Kernel], Any]:
        def compile_cached(function: Kernel) -> Any:
            compiler = {"pipeline_class": KernelCompiler, "error_model": error_model}
            dispatcher = njit(**compiler, _nrt=allocates, **options)(function)
            dispatcher._cache = _Cache(function, checksum)
            inline_in_kernels(dispatcher)
            return dispatcher

        return compile_cached

    return kernel_njit
