"""The wheel is complete: outside of the repository, the example of the README and the commands run from it."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from once import made_once

ROOT = Path(__file__).parents[1]
PACKAGES = ("hysteresis", "fem_models", "validation", "studies")
SOURCES = ("pyproject.toml", "README.md", "LICENSE", "notchbend.py", "notchbend_start.py", *PACKAGES)
EXAMPLE = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)[1]
EVIDENCE = re.compile(r"validation/(layer|measured|practice|\w+/checks)/")
"""What only pages, tests and benchmarks run, and `notchbend practice`: not in the wheel."""
DATA = (
    "hysteresis/py.typed",
    "studies/app/app.css",
    "studies/firmware/c/compensator.h",
    "studies/firmware/c/flow.c",
    "studies/report/template/page.html",
    "studies/report/template/page.js",
    "studies/report/template/style.css",
    "studies/sweep/ready/preload.toml",
    "studies/records/bench-like-20N.csv",
    "studies/records/bench-like-20N.toml",
)


def run(*arguments: object, cwd: Path) -> str:
    """Run a program without the repository on its path; its standard output."""
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
    done = subprocess.run([*map(str, arguments)], cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel of a copy of the sources, so that nothing is left beside them."""

    def build(folder: Path) -> None:
        (folder / "source").mkdir(parents=True)
        for name in SOURCES:
            if (ROOT / name).is_dir():
                shutil.copytree(ROOT / name, folder / "source" / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copyfile(ROOT / name, folder / "source" / name)
        pip = (sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-index")
        run(*pip, "--no-deps", "--no-build-isolation", "--wheel-dir", folder, folder / "source", cwd=folder)

    (built,) = made_once(tmp_path_factory, "wheel", build).glob("notchbend-*.whl")
    return built


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the wheel into an environment that has the libraries of this one, but not the repository."""

    def install(folder: Path) -> None:
        run(sys.executable, "-m", "venv", "--without-pip", folder, cwd=wheel.parent)
        pip = (sys.executable, "-m", "pip", "--python", folder / "bin" / "python", "--quiet")
        run(*pip, "--disable-pip-version-check", "install", "--no-index", "--no-deps", wheel, cwd=folder)
        (packages,) = folder.glob("lib/python*/site-packages")
        libraries = [path for path in sys.path if path.endswith("-packages")]
        (packages / "libraries.pth").write_text("\n".join(libraries) + "\n")  # after its own; none of theirs is read

    return made_once(tmp_path_factory, "environment", install) / "bin" / "python"


def test_wheel_has_the_front_door_and_the_data(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert "notchbend.py" in names
    assert set(DATA) <= set(names)
    rooms = {path.relative_to(ROOT).as_posix() for top in PACKAGES for path in (ROOT / top).rglob("*.py")}
    evidence = {room for room in rooms if EVIDENCE.match(room)}
    assert evidence
    assert rooms - evidence <= set(names)
    assert not [name for name in names if name.startswith(("tests/", "docs/", "benchmarks/")) or EVIDENCE.match(name)]


def test_what_ships_imports_no_evidence() -> None:
    """The command ``practice`` alone does, and says what is missing."""
    files = [path for top in PACKAGES for path in (ROOT / top).rglob("*.py")]
    shipped = [path for path in files if not EVIDENCE.match(path.relative_to(ROOT).as_posix())]
    found = [
        path.relative_to(ROOT).as_posix()
        for path in shipped
        if re.search(r"(from|import) validation\.(layer|measured|practice|\w+\.checks)\b", path.read_text())
    ]
    assert found == ["studies/commands/practice.py"]


@pytest.mark.slow
def test_example_of_the_readme_runs_from_the_wheel(python: Path, tmp_path: Path) -> None:
    """In a folder of its own, where the repository is not found; its kernels are compiled anew."""
    code = f"import notchbend\nassert {str(python.parents[1])!r} in notchbend.__file__\n{EXAMPLE}"
    code += "nb.plot(nb.identify(bench)).savefig('fit.png')\n"
    assert "traced to unequal_tendons" in run(python, "-c", code, cwd=tmp_path)
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_package_data_is_found_from_the_wheel(python: Path, tmp_path: Path) -> None:
    """The shipped record, a ready study, and a report from its templates."""
    code = (
        "import notchbend as nb\n"
        "from pathlib import Path\n"
        "from studies.bench_record import SHIPPED\n"
        "from studies.sweep.study_file import read_study\n"
        "print(nb.read_record(SHIPPED), read_study(Path('preload')).title)\n"
        "print(nb.study('two.toml', 'out', workers=1).report.read_text().count('</section>'))\n"
    )
    (tmp_path / "two.toml").write_text(
        'schema = 1\ntitle = "two"\nengine = "analytic"\n[rig]\npreset = "du2018"\n[program]\namplitude_mm = 1.0\n'
        'cycles = 1\n[vary]\npreload_N = [10, 20]\n[quantities]\ngroups = ["loop"]\n'
    )
    (tmp_path / "run.py").write_text(f"if __name__ == '__main__':\n    exec({code!r})\n")
    first, sections = run(python, "run.py", cwd=tmp_path).splitlines()
    assert first.startswith("Record(")
    assert int(sections) > 0
    assert "du2018" in run(python.parent / "notchbend", "simulate", "--help", cwd=tmp_path)
    command = (python.parent / "notchbend", "practice", "export", "--out", "cases")
    refused = subprocess.run([*map(str, command)], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (refused.returncode, refused.stderr.count("\n")) == (2, 1)
    assert "validation/practice is not installed" in refused.stderr
