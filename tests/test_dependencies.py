"""Dependencies: the page says the licence and reason of each, extras are named where they are missing."""

import ast
import re
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

import hysteresis.extras
from docs.make.release.dependencies import BROUGHT, PAGE, libraries, licence
from hysteresis.extras import EXTRAS, MissingError, require_extra
from notchbend_start import PACKAGES
from studies.commands import first_report

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
IMPORTED_AS = {"scikit-fem": "skfem", "trame-vtk": "trame_vtk"}


def page_rows() -> dict[str, list[str]]:
    rows = [line.strip("| \n").split(" | ") for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    return {row[1].strip(): [cell.strip() for cell in row] for row in rows if len(row) == 5}


def test_page_has_every_library_with_its_licence_and_reason():
    rows = page_rows()
    for library in libraries():
        assert library.why, f"{library.name}: expected a comment in pyproject.toml"
        assert rows[library.name][0] == library.group
        assert rows[library.name][4] == library.why
        if (found := licence(library.name)) is not None:
            assert rows[library.name][2] == found, f"{library.name}: run python -m docs.make.release.dependencies"
    assert set(rows) - {"library"} == {library.name for library in libraries()} | set(BROUGHT)


def test_only_extras_are_copyleft():
    plain = [row for row in page_rows().values() if row[0] == "plain"]
    assert len(plain) > 10
    assert not [row[1] for row in plain if "GPL" in row[2]]


def test_extras_name_what_they_import():
    wanted = PROJECT["optional-dependencies"]
    for extra, modules in EXTRAS.items():
        names = [re.split(r"[^A-Za-z0-9_.-]", one)[0] for one in wanted[extra] if "[" not in one]
        assert [IMPORTED_AS.get(name, name) for name in names] == list(modules)


def test_plain_imports_are_plain_dependencies():
    """At the top of a module only what a plain installation has, but in the rooms of an extra."""
    extra = {module for modules in EXTRAS.values() for module in modules}
    rooms = (
        "fem_models/solid",
        "studies/sweep",
        "studies/design",
        "fem_models/view/solid.py",
        "studies/report/study.py",
    )
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            where = path.relative_to(ROOT).as_posix()
            if where.startswith(rooms):
                continue
            for node in ast.parse(path.read_text()).body:
                names = [one.name for one in node.names] if isinstance(node, ast.Import) else []
                names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
                assert not extra & {name.split(".")[0] for name in names}, where


@pytest.mark.parametrize("extra", EXTRAS)
def test_missing_library_is_one_line_with_its_extra(extra, monkeypatch):
    monkeypatch.setattr(hysteresis.extras, "find_spec", lambda name: None)
    with pytest.raises(MissingError) as error:
        require_extra(extra, "this")
    assert str(error.value).endswith(f"expected for this: pip install 'notchbend[{extra}]'")
    assert "\n" not in str(error.value)


BARRED = """
import sys
class Bar:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {barred!r}:
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Bar())
import hysteresis.extras, importlib.util
find = importlib.util.find_spec
hysteresis.extras.find_spec = lambda name: None if name in {barred!r} else find(name)
from studies.commands.cli import call
sys.exit([call(arguments) for arguments in {commands!r}] != {codes!r})
"""


def test_commands_without_any_extra(tmp_path):
    barred = {module for modules in EXTRAS.values() for module in modules}
    commands = [
        ["simulate", "--preset", "du2018", "--amplitude", "0.5", "--engine", "chain", "--out", "loop.csv", "--quiet"],
        ["report", "--help"],
        ["study", "preload", "--out", "out"],
        ["validate", "--out", "out"],
        ["app"],
        ["data", "fetch", "surgical-manipulator-feedforward"],
        ["identify", "loop.csv", "--method", "cma", "--out", "fit"],
    ]
    code = BARRED.format(barred=barred, commands=commands, codes=[0, 0, 2, 2, 2, 2, 2])
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{code}"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    lines = done.stderr.strip().splitlines()
    assert [re.search(r"notchbend\[(\w+)\]", line)[1] for line in lines] == ["study", "solid", "app", "data", "cma"]


def test_a_run_notes_the_versions_that_are_there(monkeypatch):
    """Without the extra ``view`` a run ended in a traceback after all its work."""

    def without_pyvista(name):
        if name == "pyvista":
            raise PackageNotFoundError(name)
        return "1.0"

    monkeypatch.setattr(first_report, "version", without_pyvista)
    assert first_report.versions_found() == {name: "1.0" for name in first_report.PACKAGES if name != "pyvista"}


def test_make_install_has_what_every_command_needs_and_no_tools_of_developers():
    plain = set(re.findall(r"^([a-z0-9_.-]+)==", (ROOT / "requirements.lock").read_text(), re.M))
    full = set(re.findall(r"^([a-z0-9_.-]+)==", (ROOT / "requirements-dev.lock").read_text(), re.M))
    assert plain < full
    assert not plain & {"pytest", "ruff", "mypy", "import-linter", "hypothesis", "playwright", "mkdocs"}
    assert {"pytest", "ruff", "mypy", "import-linter", "mkdocs", "mujoco"} <= full
    assert {"exudyn", "numpy", "scipy", "pygad", "pyvista", "meshio", "gmsh", "trame", "dask"} <= plain
    locks = [(ROOT / f"requirements{one}.lock").read_text() for one in ("", "-dev")]
    pins = [dict(re.findall(r"^([\w.-]+)==([^\s;]+)", lock, re.M)) for lock in locks]
    assert not {name for name, version in pins[0].items() if pins[1][name] != version}


def test_one_version():
    citation = (ROOT / "CITATION.cff").read_text()
    assert re.search(r"^version: (.*)$", citation, re.M)[1] == PROJECT["version"]
    page = (ROOT / "docs" / "cite.md").read_text()
    assert re.findall(r"(?:version = \{|notchbend )(\d+\.\d+\.\d+)", page) == [PROJECT["version"]] * 2
    others = [path for path in ROOT.rglob("*.py") if ".venv" not in path.parts and "tests" not in path.parts]
    assert not [path for path in others if re.search(r"^__version__ = [\"']", path.read_text(), re.M)]


# --- packages of other people with the same names ------------------------------------------------------------------


@pytest.mark.parametrize("name", PACKAGES)
@pytest.mark.parametrize("as_folder", [True, False])
def test_other_package_of_the_same_name_is_refused_in_one_line(name, as_folder, tmp_path):
    if as_folder:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("")
    else:
        (tmp_path / f"{name}.py").write_text("")
    start = f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]; import notchbend_start; "
    done = subprocess.run(
        [sys.executable, "-c", start + "notchbend_start.main()"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr.startswith(f"notchbend: package {name} is found in {tmp_path}")
    assert done.stderr.count("\n") == 1


def test_front_door_refuses_it_too(tmp_path):
    (tmp_path / "hysteresis.py").write_text("")
    start = f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]\nimport notchbend"
    done = subprocess.run([sys.executable, "-c", start], capture_output=True, text=True, check=False)
    assert done.stderr.splitlines()[-1].startswith("ImportError: package hysteresis is found in")
