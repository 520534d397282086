"""Pages that a command of docs.make writes: their tables, and prose that is that of the template."""

import re
from pathlib import Path

import pytest

from docs.make import dynamics, pages
from validation.engines.checks.dynamics import Delay, DynamicComparison

TEMPLATES = sorted((Path(pages.__file__).parent / "templates").glob("*.txt"))


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda path: path.stem)
def test_page_has_the_prose_of_its_template(template: Path) -> None:
    (path,) = pages.DOCS.glob(f"*/{template.stem}.md")
    page = path.read_text()
    for fragment in re.split(r"\{[\w:.,]+\}", template.read_text()):
        assert fragment.strip() in page


def test_table_of_the_dynamic_runs() -> None:
    row = DynamicComparison(20.0, 1.0, True, 2.2, 2.9, 2.9, Delay(1.3e-3, 1.2e-3), 0.4, 0.02, 3.3e-3)
    assert "| 20 | 1 | yes | 2.200 | 2.900 | 1.300 | 1.200 |" in dynamics.page([row])


def test_only_the_part_between_the_marks_or_after_the_heading_changes(tmp_path: Path) -> None:
    page, mark = tmp_path / "page.md", "<!-- table of `python -m docs.make.x` -->"
    page.write_text(f"# Page\n\n{mark}\nold\n{mark}\n\nprose\n\n## Tables\n\nold\n")
    pages.put_between_marks(page, "docs.make.x", "new")
    pages.put_after_heading(page, "## Tables", "last\n")
    assert page.read_text() == f"# Page\n\n{mark}\nnew\n{mark}\n\nprose\n\n## Tables\n\nlast\n"
    assert [file.name for file in tmp_path.iterdir()] == ["page.md"]
