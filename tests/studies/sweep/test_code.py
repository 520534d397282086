"""A stored case is of the code that computed it: the key depends on every file that evaluates a case, and on no other.

The files are found by following the imports of :mod:`studies.sweep.cases` in the syntax trees, without running them.
"""

import ast
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from studies.sweep import code

PACKAGES = ("hysteresis", "fem_models", "validation", "studies")
START = "studies.sweep.cases"
BLOCKS = (ast.stmt, ast.excepthandler, ast.match_case)
"""What an import can stand in: no expression is walked through."""


def file_of(module: str) -> Path | None:
    """File of a module or of a package, relative to the root; None for a name that is neither."""
    path = Path(*module.split("."))
    found = (path.with_suffix(".py"), path / "__init__.py")
    return next((one for one in found if (code.ROOT / one).exists()), None)


def imported(path: Path) -> Iterator[str]:
    """Modules that a file imports, also inside functions; not those that only the type checker imports."""
    waiting: list[ast.AST] = [ast.parse((code.ROOT / path).read_text(encoding="utf-8"))]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            waiting += node.orelse
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            assert node.level == 0  # imports are absolute in this project
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        waiting += (one for one in ast.iter_child_nodes(node) if isinstance(one, BLOCKS))


def reached(start: str) -> set[Path]:
    """Files that are executed when a module is imported and everything in it is used: it, its packages, and theirs."""
    found: set[Path] = set()
    waiting = [start]
    while waiting:
        module = waiting.pop()
        if module.split(".")[0] not in PACKAGES:
            continue
        parents = [module.rsplit(".", n)[0] for n in range(1, module.count(".") + 1)]
        for name in (module, *parents):
            path = file_of(name)
            if path is not None and path not in found:
                found.add(path)
                waiting += imported(path)
    return found


REACHED = sorted(reached(START))


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the packages that a test may change."""
    root = tmp_path_factory.mktemp("copy")
    for name in PACKAGES:
        shutil.copytree(code.ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    return root


@pytest.fixture(scope="module")
def before(copy):
    """The code of the copy as it was; every test leaves it so."""
    return code.digest(copy)


def test_imports_are_followed():
    """Modules that a case is computed by, near and far: imported at the top, in a function, by a package's own file."""
    names = {path.as_posix() for path in REACHED}
    assert {"studies/sweep/cases.py", "studies/engines.py", "hysteresis/laws/bouc_wen.py"} <= names
    assert {"fem_models/multibody/quasi_static.py", "fem_models/solid/mesh.py", "hysteresis/__init__.py"} <= names
    assert len(names) > 60


@pytest.mark.parametrize("path", REACHED, ids=str)
def test_a_change_of_any_file_that_evaluates_a_case_changes_the_code(path, copy, before):
    file = copy / path
    content = file.read_bytes()
    try:
        file.write_bytes(content + b"\n")
        assert code.digest(copy) != before
    finally:
        file.write_bytes(content)


@pytest.mark.parametrize(
    "folder", ["fem_models/view", "studies/report", "studies/app", "studies/commands", "validation/tracing"]
)
def test_a_change_of_a_drawing_or_a_report_does_not(folder, copy, before):
    files = sorted((copy / folder).rglob("*.py"))
    assert files
    for file in files:
        content = file.read_bytes()
        file.write_bytes(content + b"\n")
        assert code.digest(copy) == before, file
        file.write_bytes(content)


def test_a_file_that_is_moved_added_or_removed_changes_the_code(copy):
    before = code.digest(copy)
    file, other = copy / "fem_models" / "joint" / "friction.py", copy / "fem_models" / "chain" / "friction.py"
    file.rename(other)
    assert code.digest(copy) != before
    other.rename(file)
    other.write_text("")
    assert code.digest(copy) != before
    other.unlink()
    assert code.digest(copy) == before


def test_content_does_not_pass_from_one_file_to_the_next(copy):
    """The same bytes, divided among two files in another place, are other code."""
    first, second = (copy / "hysteresis" / name for name in ("a_first.py", "a_second.py"))
    codes = set()
    for a, b in (("x", "y"), ("xy", ""), ("", "xy")):
        first.write_text(a)
        second.write_text(b)
        codes.add(code.digest(copy))
    assert len(codes) == 3
    first.unlink()
    second.unlink()


def test_every_listed_file_exists():
    assert all((code.ROOT / name).exists() for name in code.FILES)


@pytest.mark.parametrize("engine", code.LIBRARIES)
def test_the_libraries_of_an_engine_are_part_of_its_code(engine, monkeypatch):
    before = code.code_version(engine)
    code.code_version.cache_clear()
    monkeypatch.setattr(code, "version", lambda name: "0.0")
    assert code.code_version(engine) != before
    code.code_version.cache_clear()
