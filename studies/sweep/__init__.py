"""Parametric studies: a study file, its cases on Dask workers, their store and the dataset."""
# The names are imported when they are first used: a worker that evaluates cases needs neither Dask's client nor xarray.

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from studies.sweep.dataset import open_study
    from studies.sweep.errors import StudyError
    from studies.sweep.run import run_study
    from studies.sweep.study_file import over_ensemble, read_study

__all__ = ["StudyError", "open_study", "over_ensemble", "read_study", "run_study"]

_MODULES = {
    "open_study": "dataset",
    "StudyError": "errors",
    "run_study": "run",
    "over_ensemble": "study_file",
    "read_study": "study_file",
}


def __getattr__(name: str) -> object:
    if name in _MODULES:
        return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    raise AttributeError(f"module {__name__} has no attribute {name}")
