"""Shared fixtures of what a user runs."""

from collections.abc import Iterator

import pytest
from page_links import dead_references

from studies import progress
from studies.report import page


@pytest.fixture(autouse=True)
def _no_lines_of_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first run on a machine compiles for a minute: its lines of progress are not what these tests are about."""
    monkeypatch.setattr(progress, "FIRST_S", 1e6)


@pytest.fixture(scope="session", autouse=True)
def _dead() -> Iterator[list[str]]:
    """What pages point to and do not have, of all pages that are made: also those of fixtures."""
    dead, made = list[str](), page.page_text

    def checked(*given: object) -> str:
        text = made(*given)
        dead.extend(dead_references(text))
        return text

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "page_text", checked)
        yield dead


@pytest.fixture(autouse=True)
def _every_reference_of_a_page_leads_somewhere(_dead: list[str]) -> Iterator[None]:
    yield
    found = [*_dead]
    _dead.clear()
    assert not found, f"a page points to what it does not have: {found}"
