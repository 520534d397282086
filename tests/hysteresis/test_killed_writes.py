"""SIGKILL at every step of writing files: each is as it was or as it is to be, and the next run writes them all."""

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from forked import alone_in_fork

from fem_models.rig import preset
from hysteresis.files import write_files
from studies.export import write_model

OLD, NEW = "old " * 5_000, "new " * 6_000


def killed_at(step: int, write: Callable[[], object]) -> bool:
    """Write in a child that is killed at a step: half way through a file, or before one is put in place."""
    child = os.fork()
    if child == 0:
        alone_in_fork()
        steps = iter(range(step + 1))
        text, data, put = Path.write_text, Path.write_bytes, Path.replace

        def at(now: Callable[[], object]) -> None:
            if next(steps) == step:
                now()
                os.kill(os.getpid(), signal.SIGKILL)

        def write_text(self: Path, content: str, **keywords: str) -> int:
            at(lambda: text(self, content[: len(content) // 2], **keywords))
            return text(self, content, **keywords)

        def write_bytes(self: Path, content: bytes) -> int:
            at(lambda: data(self, content[: len(content) // 2]))
            return data(self, content)

        def replace(self: Path, target: Path) -> Path:
            at(lambda: None)
            return put(self, target)

        Path.write_text, Path.write_bytes, Path.replace = write_text, write_bytes, replace
        try:
            write()
            os._exit(0)
        finally:
            os._exit(1)
    ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert ended in (0, -signal.SIGKILL)
    return ended != 0


def contents(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def check_every_step(folder: Path, write: Callable[[], object], old: dict[str, bytes]) -> int:
    """Kill at each step in turn, then write in peace; return the number of steps."""
    write()
    new, steps = contents(folder), 0
    while True:
        for file in folder.iterdir():
            file.unlink()
        for name, content in old.items():
            (folder / name).write_bytes(content)
        killed = killed_at(steps, write)
        for name, content in contents(folder).items():
            if not name.startswith("."):
                assert content in (old.get(name), new[name]), f"{name} at step {steps}"
        write()
        assert contents(folder) == new, f"after step {steps}"
        if not killed:
            return steps
        steps += 1


@pytest.mark.parametrize("there", [True, False], ids=["over old files", "in an empty folder"])
def test_files_are_whole_whenever_their_writer_is_killed(there, tmp_path):
    names = ["loop.csv", "loop.toml", "loop[1].png"]
    old = {name: f"{name} {OLD}".encode() for name in names if there}
    files = {tmp_path / name: f"{name} {NEW}" for name in names[:2]} | {tmp_path / names[2]: NEW.encode()}
    assert check_every_step(tmp_path, lambda: write_files(files), old) == 6


def test_an_export_is_whole_whenever_it_is_killed(tmp_path):
    rig = preset("du2018")

    def export() -> None:
        write_model(rig, tmp_path / "du2018.xml", to="mujoco", amplitude_mm=0.5)

    assert check_every_step(tmp_path, export, {"du2018.xml": OLD.encode()}) == 4


def test_what_a_running_process_stages_stays(tmp_path):
    staged = tmp_path / f".loop.csv.{os.getppid()}.part"
    staged.write_text("another's")
    write_files({tmp_path / "loop.csv": NEW})
    assert staged.read_text() == "another's"
