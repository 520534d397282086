"""The report: one HTML page of a folder of results, and its PDF."""
# The names are imported when they are first used: the app and the trace need parts of the page, and not its charts.

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from studies.report.page import write_report
    from studies.report.pdf import write_pdf

__all__ = ["write_pdf", "write_report"]

_MODULES = {"write_report": "page", "write_pdf": "pdf"}


def __getattr__(name: str) -> object:
    if name in _MODULES:
        return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    raise AttributeError(f"module {__name__} has no attribute {name}")
