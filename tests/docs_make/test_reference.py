"""The reference page of ``import notchbend as nb``: every public name with what it does, takes and returns."""

import re

import pytest

import notchbend
from docs.make import reference

TEXT = reference.PAGE.read_text(encoding="utf-8")


def test_the_page_is_up_to_date():
    assert reference.tables() in TEXT, "run python -m docs.make.reference"


@pytest.mark.parametrize("name", [name for name in notchbend.__all__ if name != "__version__"])
def test_every_public_name_is_on_the_page(name):
    assert f"`nb.{name}`" in TEXT


@pytest.mark.parametrize("name", reference.public_functions())
def test_a_function_has_its_arguments_its_result_and_an_example(name):
    section = re.split(r"^##+ ", TEXT.partition(f"### nb.{name}\n")[2], flags=re.M)[0]
    assert re.search(r"^\| `\w+`", section, re.M)
    assert re.search(r"^Returns `", section, re.M)
    assert f"nb.{name}(" in section.partition("```pycon")[2]


def test_a_new_public_function_without_a_place_is_refused(monkeypatch):
    def new() -> None:
        """Do nothing."""

    monkeypatch.setattr(notchbend, "new", new, raising=False)
    monkeypatch.setattr(notchbend, "__all__", [*notchbend.__all__, "new"])
    with pytest.raises(ValueError, match="new"):
        reference.tables()
