"""Shared fixtures."""

import gc
import os
from pathlib import Path

import pytest
from hypothesis import settings

from notchbend_start import use_one_blas_thread

use_one_blas_thread()  # as the command does, and before any test imports numpy
# numba compiles only with the number of threads that it was started with; workers of a study are started with one
os.environ.setdefault("NUMBA_NUM_THREADS", "1")
settings.register_profile("machine", deadline=None)  # the first call compiles, and a loaded machine takes its time
settings.load_profile("machine")


LONG = ("validation/tracing", "studies/report", "studies/commands")
"""Folders with most of the long tests."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run long tests first: at the end one worker would wait for the other's."""
    items.sort(key=lambda item: not any(folder in item.nodeid for folder in LONG))


def pytest_collection_finish() -> None:
    """Leave what is imported and collected out of Python's search for cycles: it stays to the end.

    A full search through it takes half a second, and tests start many.
    """
    gc.freeze()


@pytest.fixture(scope="session")
def measured() -> Path:
    """Folder of the real measured records, which are not part of the project."""
    folder = Path(os.environ.get("NOTCHBEND_MEASURED", Path(__file__).parents[2] / "shared" / "measured"))
    if not folder.is_dir():
        pytest.skip(f"no measured records at {folder}; get them with `notchbend data fetch`")
    return folder
