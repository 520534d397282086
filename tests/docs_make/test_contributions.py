"""The table of the page on contributions is what the command writes today."""

from docs.make import contributions


def test_the_page_has_the_figures_of_the_command() -> None:
    page = contributions.PAGE.read_text(encoding="utf-8")
    mark = f"<!-- table of `python -m {contributions.COMMAND}` -->"
    _, written, _ = page.split(mark)
    assert written.strip() == contributions.text().strip()
