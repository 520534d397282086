"""The gallery: every script runs and gives what its page shows."""

import re
from pathlib import Path

import pytest

from docs.make.gallery.cells import cells_of, page_of, run_script

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
SCRIPTS = sorted(GALLERY.glob("*.py"))
MOST_BYTES = 60_000
NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"


def same_but_for_rounding(text: str, page: str) -> None:
    """The words are equal, and numbers within a tenth: another machine rounds a search differently."""
    assert re.split(NUMBER, text) == re.split(NUMBER, page)
    for ours, shown in zip(re.findall(NUMBER, text), re.findall(NUMBER, page), strict=True):
        assert float(ours) == pytest.approx(float(shown), rel=0.1, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_script_gives_its_page(script: Path, tmp_path: Path) -> None:
    page, pictures = page_of(script, run_script(script, tmp_path))
    same_but_for_rounding(page, script.with_suffix(".md").read_text())
    assert pictures
    for name, picture in pictures.items():
        assert picture.startswith(b"\x89PNG"), name
        assert len(picture) < MOST_BYTES, name
        assert (GALLERY / name).stat().st_size < MOST_BYTES, name


def test_all_pictures_and_scripts_are_shown() -> None:
    assert len(SCRIPTS) >= 6
    pages = "".join(page.read_text() for page in GALLERY.glob("*.md"))
    assert {file.name for file in GALLERY.glob("*.png")} == set(re.findall(r"\]\(([\w-]+\.png)\)", pages))
    index = (GALLERY / "index.md").read_text()
    assert all(f"({script.stem}.md)" in index for script in SCRIPTS)


def test_cells() -> None:
    """Text, code and the docstring, in the percent format."""
    cells = cells_of('"""Title.\n\nWords.\n"""\n\n# %% [markdown]\n# ## Head\n# text\n\n# %%\nx = 1\n\nprint(x)\n')
    assert [(cell.source, cell.is_text) for cell in cells] == [
        ("Title.\n\nWords.", True),
        ("## Head\ntext", True),
        ("x = 1\n\nprint(x)", False),
    ]
    with pytest.raises(ValueError, match="without a docstring"):
        cells_of("x = 1\n")


def test_page_has_output_and_picture_of_a_cell(tmp_path: Path) -> None:
    script = tmp_path / "one.py"
    script.write_text(
        '"""One."""\n# %%\nfrom matplotlib.figure import Figure\nfigure = Figure()\nprint("said")\n# %%\n1\n'
    )
    page, pictures = page_of(script, run_script(script, tmp_path))
    assert page.startswith("# One\n")
    assert "```text\nsaid\n```\n\n![One, figure 1](one-1.png)\n\n```py\n1\n```" in page  # and none of the next cell
    assert list(pictures) == ["one-1.png"]
