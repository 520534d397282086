"""Examples in the documentation run, and its files are files that the package takes."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from fem_models.rig.rig_file import read_rig
from studies.commands.cli import call
from validation.practice.bench_record import SHIPPED

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
EXAMPLES = [
    pytest.param(page, code, id=f"{page.name}-{i}")
    for page in PAGES
    for i, code in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(), re.S))
]


@pytest.mark.parametrize(("page", "code"), EXAMPLES)
def test_example_runs(page, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in re.findall(r"^`(\S+)`\n```\w+\n(.*?)```", page.read_text(), re.S | re.M):  # files shown beside it
        Path(name).write_text(text)
    exec(compile(code, "example", "exec"), {"__name__": "__main__"})  # as a script; an example that fails raises


def test_rig_file_of_the_first_steps(tmp_path):
    text = re.search(r"```toml\n(preload_N.*?)```", (ROOT / "docs" / "first-steps.md").read_text(), re.S)
    (tmp_path / "mine.toml").write_text(text[1])
    assert read_rig(tmp_path / "mine.toml").joints == 10


def test_commands_of_the_first_steps_run(tmp_path, monkeypatch, capsys):
    page = (ROOT / "docs" / "first-steps.md").read_text()
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(re.search(r"```toml\n(preload_N.*?)```", page, re.S)[1])
    for file in (SHIPPED, SHIPPED.with_suffix(".toml")):  # stands for what the reader measures
        shutil.copy(file, f"bench-20N{file.suffix}")
    commands = re.findall(r"^    notchbend (.*)$", page, re.M)
    assert len(commands) == 2
    for command in commands:
        assert call(shlex.split(command)) == 0, capsys.readouterr().err
    assert read_rig(Path("mine.toml")).joints == 10
    assert Path("fit/identify.json").exists()


def test_links_between_pages_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\((?!http)([^)#]+)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
