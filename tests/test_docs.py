"""Examples in the documentation run; its files, links, modules and commands exist."""

import re
import shlex
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import typer

from docs.make.front.example import code_and_output
from fem_models.chain.solve import simulate_chain
from fem_models.load import triangle
from fem_models.rig import presets, read_rig
from fem_models.rig.rig import numeric_fields
from studies.commands.cli import app, call
from studies.engines import ENGINES
from validation.tracing.effect import catalogue

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
README = ROOT / "README.md"
PAGES = [README, *sorted(DOCS.rglob("*.md"))]
FIRST_STEPS = DOCS / "guide" / "first-steps.md"
EXAMPLES = [
    pytest.param(page, code, id=f"{page.name}-{i}", marks=[] if page.name == "README.md" else pytest.mark.slow)
    for page in PAGES
    for i, code in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(), re.S))
]
EACH_PAGE = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


@pytest.mark.parametrize(("page", "code"), EXAMPLES)
def test_example_runs(page, code, tmp_path, monkeypatch, capsys):
    """As a script: an example that fails raises, and what it prints is there and has numbers."""
    monkeypatch.chdir(tmp_path)
    for name, text in re.findall(r"^`(\S+)`\n```\w+\n(.*?)```", page.read_text(), re.S | re.M):  # files shown beside it
        Path(name).write_text(text)
    exec(compile(code, "example", "exec"), {"__name__": "__main__"})
    printed = capsys.readouterr().out
    assert bool(printed.strip()) or "print(" not in code
    assert not re.search(r"\bnan\b", printed)
    if page.name == "README.md":
        assert_same_text(printed, code_and_output(page)[1])


def assert_same_text(printed: str, shown: str) -> None:
    """The same words; numbers may differ by 1 in 100, as between processors."""
    number = r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?"
    assert re.sub(number, "0", printed).split() == re.sub(number, "0", shown).split()
    values = [[float(x) for x in re.findall(number, text)] for text in (printed, shown)]
    assert values[0] == pytest.approx(values[1], rel=0.01)


def test_readme_is_short():
    """A stranger reads it in two minutes; what is longer has a page in docs."""
    assert len(README.read_text().split()) <= 500


def test_rig_file_of_the_first_steps(tmp_path):
    text = re.search(r"```toml\n(preload_N.*?)```", FIRST_STEPS.read_text(), re.S)
    (tmp_path / "mine.toml").write_text(text[1])
    assert read_rig(tmp_path / "mine.toml").joints == 10


def links(page: Path) -> list[str]:
    """Relative targets of links and images, without the part after ``#``."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.S)
    targets = re.findall(r"\]\(\s*<?([^)>\s]+)", text) + re.findall(r"(?:src|srcset|href)=\"([^\"]+)\"", text)
    return [target for target in targets if not re.match(r"[a-z]+:", target)]


@EACH_PAGE
def test_links_and_images_lead_somewhere(page):
    for target in links(page):
        path, _, heading = target.partition("#")
        file = page.parent / path if path else page
        assert file.exists(), target
        if heading:
            anchors = [re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-") for h in headings(file)]
            assert heading in anchors, target


def headings(page: Path) -> list[str]:
    return re.findall(r"^#+ (.*)$", page.read_text(), re.M)


def test_every_page_is_reached_from_the_index():
    reached, queue = set(), [DOCS / "index.md"]
    while queue:
        page = queue.pop().resolve()
        if page not in reached and page.suffix == ".md":
            reached.add(page)
            queue += [page.parent / target.partition("#")[0] for target in links(page) if target[0] != "#"]
    assert {page.resolve() for page in PAGES[1:]} <= reached


def test_every_image_is_shown():
    shown = {(page.parent / target).resolve() for page in PAGES for target in links(page)}
    assert {image.resolve() for image in (DOCS / "images").iterdir()} <= shown


def test_tools_of_the_site_are_installed_for_the_tests():
    """Else ``tests/test_site.py`` would be skipped, and nobody would see it."""
    locked = "".join(file.read_text() for file in ROOT.glob("requirements*.lock"))
    assert re.findall(r"^(mkdocs-material|mkdocstrings-python)==", locked, re.M) == [
        "mkdocs-material",
        "mkdocstrings-python",
    ]


@EACH_PAGE
def test_modules_that_are_run_exist(page):
    for module in re.findall(r"python3? -m ([\w.]*\w)", page.read_text()):
        assert find_spec(module) is not None, module


def test_every_room_is_in_the_plan():
    plan = re.findall(r"^\| `([\w/]+)/` \|", (DOCS / "develop" / "index.md").read_text(), re.M)
    rooms = {
        str(file.parent.relative_to(ROOT))
        for package in ("hysteresis", "fem_models", "validation", "studies")
        for file in (ROOT / package).rglob("*.py")
        if file.name != "__init__.py" and file.parent not in [ROOT / p for p in ("fem_models", "studies")]
    }
    assert rooms | {"docs/make", "docs/make/gallery", "docs/make/site", "docs/gallery"} == set(plan)


def code_of(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (DOCS / "develop" / page).read_text(), re.S)


@pytest.fixture
def room_with(monkeypatch, tmp_path):
    """Put the first example of a page into a room, as the file that the page has its reader create."""

    def put(page: str, room: str, name: str) -> None:
        (tmp_path / f"{name}.py").write_text(code_of(page, "python")[0])
        package = import_module(room)
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(tmp_path)])
        monkeypatch.delitem(sys.modules, f"{room}.{name}", raising=False)

    return put


@pytest.mark.slow
def test_effect_of_the_guide_is_found(room_with, capsys):
    """One new file: the command lists the effect, and the tracer names it."""
    room_with("add-an-effect.md", "validation.tracing.effects", "sensor_filter")
    catalogue.cache_clear()
    try:
        assert call(["effects", "--quiet"]) == 0
        assert "sensor_filter" in capsys.readouterr().out.split()
        exec(compile(code_of("add-an-effect.md", "py")[0], "example", "exec"), {})
        assert capsys.readouterr().out == "effect ['sensor_filter']\n"
    finally:
        catalogue.cache_clear()


def test_engine_of_the_guide_runs(room_with, monkeypatch, capsys):
    room_with("add-an-engine.md", "fem_models.analytic", "constant_curvature")
    module = import_module("fem_models.analytic.constant_curvature")
    monkeypatch.setitem(ENGINES, "constant-curvature", module.simulate_constant_curvature)
    exec(compile(code_of("add-an-engine.md", "py")[-1], "example", "exec"), {})
    printed = dict(line.split() for line in capsys.readouterr().out.splitlines())
    assert float(printed["constant-curvature"]) == pytest.approx(np.degrees(2.2 / 2.58))  # x / r


def test_preset_of_the_guide_has_all_sources(monkeypatch):
    names = dict(vars(presets))
    exec(compile(code_of("add-a-preset.md", "py")[0], "example", "exec"), names)
    lab = names["_LAB"]
    assert set(lab.sources) == set(numeric_fields(lab.rig))
    monkeypatch.setitem(presets.PRESETS, "lab-6mm", lab)
    assert simulate_chain(presets.preset("lab-6mm"), triangle(1.5)).angle_deg.max() > 20


@EACH_PAGE
def test_files_of_the_project_that_are_named_exist(page):
    named = re.findall(
        r"`((?:hysteresis|fem_models|validation|studies|tests|docs|benchmarks)/[\w/.*-]+)`", page.read_text()
    )
    for name in set(named) - created(page):
        assert any(ROOT.glob(name.rstrip("/"))), name


@EACH_PAGE
def test_functions_of_a_file_exist(page):
    """Rows of a table that begin with a file: its functions or classes stand in the next cell."""
    for file, names in re.findall(r"^\| `([\w/]+\.py)` \| ((?:`\w+`(?:, )?)+) \|", page.read_text(), re.M):
        source = (ROOT / file).read_text()
        for name in re.findall(r"`(\w+)`", names):
            assert re.search(rf"^(?:class |def )?{name}\b", source, re.M), f"{file}: {name}"


@EACH_PAGE
def test_dotted_modules_that_are_named_exist(page):
    """``package.module`` or ``package.module.name``, in code or in an example."""
    text = page.read_text()
    named = re.findall(r"\b((?:hysteresis|fem_models|validation|studies|benchmarks)(?:\.\w+)+)", text)
    for name in named:
        new = any(file.removesuffix(".py").replace("/", ".") == name for file in created(page))
        if new or name.rpartition(".")[2] in {"py", "md", "csv", "toml", "json"}:
            continue
        assert module_or_name(name), name


def created(page: Path) -> set[str]:
    """Files that a page has its reader create."""
    return set(re.findall(r"\b[Cc]reate\s+`([^`]+)`", page.read_text()))


def module_or_name(dotted: str) -> bool:
    try:
        if find_spec(dotted) is not None:
            return True
    except ModuleNotFoundError:  # its parent is no package
        pass
    parent, _, name = dotted.rpartition(".")
    try:
        module = __import__(parent, fromlist=[name])
    except ModuleNotFoundError:
        return False
    return hasattr(module, name)


def quoted_commands(page: Path) -> list[list[str]]:
    """Command lines after ``notchbend``, in indented or fenced blocks and in backticks."""
    text = page.read_text()
    shell = "\n".join(re.findall(r"^```(?:sh|console|bash)\n(.*?)```", text, re.S | re.M))
    lines = re.findall(r"^    (?:\.venv/bin/)?notchbend ([^`\n]*)$", text, re.M)
    lines += re.findall(r"^(?:\$ )?(?:\.venv/bin/)?notchbend (.*)$", shell, re.M)
    lines += re.findall(r"`(?:\.venv/bin/)?notchbend ([^`\n]*)`", text)
    return [shlex.split(line, comments=True) for line in lines]


@EACH_PAGE
def test_commands_and_their_options_exist(page):
    known = typer.main.get_command(app)
    for words in quoted_commands(page):
        command, left = known, list(words)
        while left and hasattr(command, "commands") and left[0] in command.commands:
            command = command.commands[left.pop(0)]
        assert command is not known or words[0].startswith(("-", "COMMAND")), f"notchbend {' '.join(words)}"
        options = {name for parameter in command.params for name in parameter.opts} | {"--help"}
        for word in left:
            if word.startswith("--"):
                assert word.partition("=")[0] in options, f"notchbend {' '.join(words)}"


FORMER_WORDS = (
    r"\bropes?\b|\b(?:is|are) asked\b|for its own|what is left|told apart|\btells? (?:\w+ )?apart|goes with|\bfree rig|"
    r"grown model|declared model|who is near|\blet pass"
)
"""Words of earlier versions; docs/develop/glossary.md has them beside the terms of the field."""


@EACH_PAGE
def test_pages_use_the_words_of_the_field(page):
    text = page.read_text().replace("Theory of Wire Rope", "")  # a book
    if page.name == "glossary.md":
        text = text.partition("## Words of earlier versions")[0]
    if page.name == "measured-traces.md":  # then come the sentences of the run that made the tables
        text = text.partition("## Results")[0]
    assert re.findall(FORMER_WORDS, text, re.I) == []
