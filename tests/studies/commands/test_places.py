"""Places that cannot be written to: every command refuses them in one line, before it computes, and loses nothing."""

import json
import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

import pytest
from malformed.samples import readers
from results_folder import write_trace

from studies.commands import tracing
from studies.commands.cli import call

WANTED_IN_SPACE = "angle_deg,angle_2_deg\n0,0\n1,0.5\n0,1\n-1,0\n0,0\n"
ROOT = Path(__file__).parents[3]
SEMICOLONS = "drive_mm;angle_deg\n0;0\n1;20\n0;1\n-1;-20\n0;-1\n1;20\n"
COMMANDS = {
    "simulate": (["simulate", "--preset", "du2018", "--amplitude", "1", "--engine", "analytic"], "x.csv"),
    "simulate in space": (["simulate", "--rig", "space/wrist.toml", "--amplitude", "0.1"], "x.csv"),
    "identify": (["identify", "records/loop.csv"], ""),
    "trace": (["trace", "records/loop.csv"], ""),
    "compensate": (["compensate", "fits/identify.json", "--reference", "fits/reference.csv"], "drive.csv"),
    "compensate in space": (["compensate", "space/wrist.toml", "--reference", "wanted.csv"], "drives.csv"),
    "workspace": (["workspace", "--preset", "zhang2026", "--amplitude", "0.2"], ""),
    "export": (["export", "--to", "mujoco", "--preset", "du2018"], "m.xml"),
    "separate": (["separate", "--preset", "du2018"], ""),
    "study": (["study", "study/study.toml"], ""),
    "run": (["run"], ""),
    "run in space": (["run", "--rig", "space/wrist.toml"], ""),
    "validate": (["validate"], ""),
    "practice export": (["practice", "export", "--count", "1", "--sources", "own"], ""),
    "record new": (["record", "new", "bench.csv"], "new.csv"),
}
"""Commands with ``--out``, and the file that it names; none where it is a folder."""
WRITERS = ("simulate", "simulate in space", "identify", "trace", "compensate", "compensate in space", "workspace",
           "export")  # fmt: skip
"""Those that write within a second or two."""


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs") / "inputs"
    readers(folder, stored=False)
    (folder / "wanted.csv").write_text(WANTED_IN_SPACE)
    (folder / "bench.csv").write_text(SEMICOLONS)
    return folder


@pytest.fixture
def folder(inputs, tmp_path, monkeypatch):
    shutil.copytree(inputs, tmp_path / "inputs")
    monkeypatch.chdir(tmp_path / "inputs")
    return tmp_path / "inputs"


def given(name: str, place: str) -> list[str]:
    """Give the command line with its results in a folder."""
    command, file = COMMANDS[name]
    return [*command, "--out", f"{place}/{file}" if file else place, "--quiet"]


def refusal(line: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert call(line) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert len(said) < 300
    return said


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """Make a folder one that cannot be written to; root can write to any, but not to a disk that is read-only."""
    if os.geteuid():
        folder.chmod(0o500)
        try:
            yield
        finally:
            folder.chmod(0o700)
        return
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", folder], check=False, capture_output=True)
    if done.returncode:
        pytest.skip(f"a disk cannot be mounted here: {done.stderr.decode().strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", folder], check=True)


@contextmanager
def full_disk(most: int) -> Iterator[None]:
    """No file can be longer than ``most`` bytes, as on a disk that is full after them.

    Python does not see that the bytecode of a module imported here is cut off; the next process would stumble over it.
    """
    before, writes_none = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        sys.dont_write_bytecode = writes_none
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_place_that_is_no_folder_is_refused(name, folder, capsys):
    Path("file").write_text("mine")
    Path("circle").symlink_to("circle")
    Path("nowhere").symlink_to("not/there")
    os.mkfifo("fifo")
    before = contents(folder)
    for place in ("file", "circle", "nowhere", "fifo"):
        assert "expected a folder that can be written to" in refusal(given(name, place), capsys), place
    assert "File name too long" in refusal(given(name, "y" * 300), capsys)
    assert contents(folder) == before


@pytest.mark.parametrize("name", COMMANDS)
def test_a_read_only_folder_is_refused(name, folder, capsys):
    (folder / "out").mkdir()
    with read_only(folder / "out"):
        assert "out: cannot be written to" in refusal(given(name, "out"), capsys)
        assert "out: cannot be written to" in refusal(given(name, "out/inner"), capsys)


EXTRAS = {"trace": "report.html", "identify": "identify.png", "workspace": "workspace.png"}
"""The largest file of a command, where it is written after the results."""


def test_nothing_is_computed_for_a_place_that_is_refused(folder, capsys, monkeypatch):
    def computed(*_: object, **__: object) -> None:
        raise AssertionError("computed")

    monkeypatch.setattr(tracing, "trace_records", computed)
    Path("file").write_text("mine")
    assert "file" in refusal(given("trace", "file"), capsys)
    assert Path("file").read_text() == "mine"


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_keeps_what_was_there(name, folder, capsys):
    line = given(name, "out")
    assert call(line) == 0  # what is compiled here is kept: on a full disk it could not be
    before = contents(folder / "out")
    with full_disk(max(map(len, before.values())) * 9 // 10):  # a page has times in it, of few digits or more
        assert "File too large" in refusal(line, capsys)
    after, extra = contents(folder / "out"), EXTRAS.get(name, "")
    assert after.keys() == before.keys() - {extra}
    if extra:
        json.loads(after[f"{name}.json"])  # whole: it is written first
    else:
        assert after == before
    with full_disk(100):
        assert "new/" in refusal(given(name, "new"), capsys)
    assert contents(folder / "new") == {}


def test_a_full_disk_that_takes_no_compiled_kernel_is_named(folder, capsys, monkeypatch):
    """The error of numba's cache names no file: the line began with "None"."""
    Path("kernel.py").write_text("import numba\n\n@numba.njit(cache=True)\ndef twice(x):\n    return 2 * x\n")
    monkeypatch.syspath_prepend(str(folder))
    twice = import_module("kernel").twice
    monkeypatch.setattr(tracing, "trace_loaded", lambda *_, **__: twice(1.0))
    with full_disk(100):
        assert "cache of compiled kernels: File too large" in refusal(given("trace", "out"), capsys)


def test_an_output_that_takes_no_more_is_one_line_and_blames_no_file():
    """Such an error names no file either; it had been laid on the cache of kernels."""
    with Path("/dev/full").open("w") as full:
        line = [sys.executable, "-c", "from studies.commands.cli import main; main()", "effects"]
        done = subprocess.run(line, stdout=full, stderr=subprocess.PIPE, text=True, check=False, cwd=ROOT)
    assert (done.returncode, done.stderr) == (2, "notchbend: No space left on device\n")


def test_a_full_disk_keeps_the_report(folder, capsys):
    (folder / "out").mkdir()
    write_trace(folder / "out")
    assert call(["report", "out", "--quiet"]) == 0
    before = contents(folder / "out")
    with full_disk(10_000):
        assert "out/report.html: File too large" in refusal(["report", "out", "--quiet"], capsys)
    with read_only_report(folder / "out"):
        assert "cannot be written to" in refusal(["report", "out", "--quiet"], capsys)
    assert contents(folder / "out") == before


@contextmanager
def read_only_report(folder: Path) -> Iterator[None]:
    """Mount a folder over itself, read-only."""
    if os.geteuid():
        with read_only(folder):
            yield
        return
    done = subprocess.run(["mount", "--bind", folder, folder], check=False, capture_output=True)
    if done.returncode:
        pytest.skip(f"a disk cannot be mounted here: {done.stderr.decode().strip()}")
    try:
        subprocess.run(["mount", "-o", "remount,bind,ro", folder], check=True)
        yield
    finally:
        subprocess.run(["umount", folder], check=True)


@pytest.mark.parametrize(
    ("name", "file"),
    [
        *(("simulate in space", f"x{end}") for end in (".csv", ".toml", ".rig.toml")),
        *(("compensate", f"drive{end}") for end in (".csv", ".toml", "-compensate.json")),
        *(("compensate in space", f"drives{end}") for end in (".csv", ".toml", ".rig.toml", "-compensate.json")),
        *(("workspace", f"workspace.{end}") for end in ("json", "csv", "png")),
        *(("export", name) for name in ("m.xml", "m-guides.csv")),
        *(("record new", name) for name in ("new.csv", "new.toml")),
        *(("run in space", name) for name in ("wrist.json", "tube.png", "workspace.csv", "trace.json")),
        ("run in space", "records/wrist-5N-wheel-1.csv"),
        ("identify", "identify.png"),
        ("validate", "validate.json"),
    ],
)
def test_files_of_another_hand_are_kept(name, file, folder, capsys):
    mine = folder / "out" / file
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    assert f"out/{file}: " in refusal(given(name, "out"), capsys)
    assert contents(folder / "out") == {file: b"mine"}


def test_a_score_of_another_hand_is_kept(folder, capsys):
    Path("score.json").write_text("mine")
    said = refusal(["practice", "score", "cases", "answers.json", "--out", "score.json"], capsys)
    assert "score.json: not written by notchbend" in said
    assert Path("score.json").read_text() == "mine"


def test_a_link_that_leads_nowhere_is_kept(folder, capsys):
    """A name that is taken by a link without a file is taken: `record new` put its copy in the place of the link."""
    for name in ("new.csv", "new.toml"):
        Path(name).symlink_to("not/there")
        assert f"{name}: exists" in refusal(["record", "new", "bench.csv", "--out", "new.csv"], capsys)
        assert Path(name).readlink() == Path("not/there")
        Path(name).unlink()


@pytest.mark.parametrize("taken", ["cases-ANSWERS.json", "cases/case-001"])
def test_cases_of_another_hand_are_kept(taken, folder, capsys):
    """`practice export` wrote its cases over records of the same name."""
    Path("cases").mkdir()
    mine = Path(taken) if taken.endswith("json") else Path(taken) / "record-1.csv"
    mine.parent.mkdir(exist_ok=True)
    mine.write_text("mine")
    line = ["practice", "export", "--count", "1", "--sources", "own", "--out", "cases"]
    assert f"{taken}: exists" in refusal(line, capsys)
    assert mine.read_text() == "mine"
