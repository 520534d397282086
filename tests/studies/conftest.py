"""Shared fixtures of what a user runs."""

import pytest

from studies import progress


@pytest.fixture(autouse=True)
def _no_lines_of_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first run on a machine compiles for a minute: its lines of progress are not what these tests are about."""
    monkeypatch.setattr(progress, "FIRST_S", 1e6)
