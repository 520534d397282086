"""A study that was killed, interrupted or extended goes on with the same numbers."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc
from small_study import GRID, HEAD, LONG, PROGRAM, same, study_file

from studies.commands import call
from studies.results.study import Sample
from studies.sweep import StudyError, open_study, read_study, run_study
from studies.sweep import run as sweep
from studies.sweep.plan import cases, plan_of, unit_points
from studies.sweep.store import open_store

ROOT = Path(__file__).parents[3]


def test_a_widened_study_computes_the_new_points_only(finished, tmp_path):
    text = GRID.replace("[10, 15, 20, 30]", "[10, 15, 20, 25, 30]")
    first = run_study(read_study(finished[0] / "s.toml"), tmp_path / "out", workers=1)
    wider = run_study(read_study(study_file(tmp_path, text)), tmp_path / "out", workers=1)
    again = run_study(read_study(tmp_path / "s.toml"), tmp_path / "out", workers=1)
    assert (first.computed, first.from_store) == (12, 0)
    assert (wider.computed, wider.from_store) == (3, 12)
    assert (again.computed, again.from_store) == (0, 15)
    # and one worker has given what two had
    same(open_study(tmp_path / "out").sel(preload_N=[10.0, 15.0, 20.0, 30.0]).assign_attrs(
        open_study(finished[0] / "out").attrs), open_study(finished[0] / "out"))  # fmt: skip


def test_more_sobol_points_begin_with_the_same():
    few, many = (unit_points(Sample("sobol", n, 7), 3) for n in (16, 64))
    assert np.array_equal(few, many[:16])
    assert np.array_equal(
        unit_points(Sample("latin-hypercube", 9, 7), 3), unit_points(Sample("latin-hypercube", 9, 7), 3)
    )


def test_a_sample_drawn_block_by_block_is_that_of_one_draw(monkeypatch):
    whole = qmc.Sobol(3, scramble=True, rng=7).random(64)
    monkeypatch.setattr("studies.sweep.plan._DRAWN", 9)
    assert np.array_equal(unit_points(Sample("sobol", 64, 7), 3), whole)


def test_latin_hypercube_has_one_point_a_row():
    """Its definition: cut each range into n, and each piece holds one point."""
    points = unit_points(Sample("latin-hypercube", 20, 1), 2)
    assert all(sorted(np.floor(20 * column)) == list(range(20)) for column in points.T)


RUN = "import sys; from studies.commands import main; sys.argv[0] = 'notchbend'; main()"
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
MOST_S = 180
"""Most time until a command has come so far, and until it has ended with its workers."""


def stored(out: Path) -> int:
    try:
        with sqlite3.connect(f"file:{out / 'cases.sqlite'}?mode=ro&immutable=1", uri=True) as db:
            return db.execute("SELECT COUNT(*) FROM cases WHERE status != 'running'").fetchone()[0]
    except sqlite3.Error:  # not there yet, or just being written
        return 0


def finished_in(store) -> int:
    counts = store.counts().by_status
    return counts.get("ok", 0) + counts.get("failed", 0)


def begun(file: Path, out: Path) -> subprocess.Popen:
    command = [sys.executable, "-c", RUN, "study", str(file), "--out", str(out), "--workers", "2", "--quiet"]
    # a shell that runs the tests in its background has Ctrl-C ignored, and children inherit that
    heard = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        return subprocess.Popen(command, env=ENVIRONMENT, stderr=subprocess.PIPE, start_new_session=True)
    finally:
        signal.signal(signal.SIGINT, heard)


def last_words(process: subprocess.Popen) -> str:
    """What a command that was told to end has said; it and its workers are killed where they do not end."""
    try:
        return process.communicate(timeout=MOST_S)[1].decode()
    except subprocess.TimeoutExpired:
        end_all(process)
        raise


def wait_until(process: subprocess.Popen, there: Callable[[], bool]) -> None:
    """Wait until something is there, or the command has ended."""
    end = time.monotonic() + MOST_S
    while process.poll() is None and not there():
        if time.monotonic() > end:
            end_all(process)
            pytest.fail(f"the command has not come so far in {MOST_S} s")
        time.sleep(0.02)


def end_all(process: subprocess.Popen) -> None:
    """Kill a command with its workers."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


@pytest.mark.slow
def test_killed_three_times_then_finished(tmp_path, undisturbed):
    """240 cases; the process gets SIGKILL as soon as some of them are stored, three times over."""
    file, out = study_file(tmp_path, LONG), tmp_path / "out"
    at_kill = []
    for _ in range(3):
        before, process = stored(out), begun(file, out)
        enough = before + 32  # more than a batch, so that one is there for good
        wait_until(process, lambda enough=enough: stored(out) >= enough)
        process.kill()
        last_words(process)
        with open_store(out) as store:  # takes back what was half written
            at_kill.append(finished_in(store))
    assert 0 < at_kill[0] < at_kill[1] < at_kill[2] < 240  # each run was killed in its middle
    finished = run_study(read_study(file), out, workers=2)
    assert (finished.state, finished.from_store) == ("finished", at_kill[2])
    same(open_study(out), undisturbed)
    with open_store(out) as store:
        in_flight = sweep.IN_FLIGHT * 2 * 30  # batches a worker, workers, at most an eighth of the cases a batch
        assert store.counts().attempts - 240 <= 3 * in_flight
        assert store.counts().by_status == {"ok": 160, "failed": 80}


@pytest.mark.parametrize(
    ("when", "number"),
    [
        ("while the workers start", signal.SIGINT),
        ("in the middle", signal.SIGINT),
        ("while the workers start", signal.SIGTERM),
        pytest.param("in the middle", signal.SIGTERM, marks=pytest.mark.slow),
    ],
)
def test_interrupted_study_says_how_far_it_came(when, number, tmp_path, undisturbed):
    """Ctrl-C goes to all processes, SIGTERM to the command: one line, exit 130 or 143, dataset and summary so far."""
    file, out = study_file(tmp_path, LONG), tmp_path / "out"
    process = begun(file, out)
    wait_until(process, lambda: stored(out) > 0 if when == "in the middle" else (out / "inputs").exists())
    (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    said = last_words(process)
    assert process.returncode == 128 + number
    status = open_study(out).status.values.ravel().tolist()
    summary = json.loads((out / "study.json").read_text())
    assert summary["state"] == "interrupted"
    assert summary["status"] == {name: status.count(name) for name in ("ok", "failed", "pending")}
    done = 240 - status.count("pending")
    word = "interrupted" if number == signal.SIGINT else "terminated"
    assert said == f"notchbend: {word}: {done} of 240 cases are stored in {out}, the same command goes on\n"
    assert (done == 0) if when != "in the middle" else (0 < done < 240)
    assert summary["computed"] == done
    if done:
        again = run_study(read_study(file), out, workers=1)
        assert (again.state, again.from_store) == ("finished", done)
        same(open_study(out), undisturbed)


def test_results_of_another_study_do_not_stay(tmp_path, monkeypatch):
    """A study that is stopped before its sensitivities leaves none of an earlier run, whose ranges may be others."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "sensitivity.json").write_text("{}")
    text = HEAD + PROGRAM + "[vary]\npreload_N = [10, 20]\n[sensitivity]\ncount = 4\n"

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("studies.sweep.sensitivity.sensitivity", stopped)
    with pytest.raises(KeyboardInterrupt):
        run_study(read_study(study_file(tmp_path, text)), out, workers=1)
    summary = json.loads((out / "study.json").read_text())
    assert (summary["state"], summary["status"]["ok"]) == ("interrupted", 2)
    assert not (out / "sensitivity.json").exists()


def test_two_studies_in_one_folder_are_refused(tmp_path):
    with open_store(tmp_path), pytest.raises(StudyError, match="in use"), open_store(tmp_path):
        pass


@pytest.mark.slow
def test_full_disk(tmp_path, capfd, undisturbed):
    """A disk of 96 KB takes the store for a while, then one line and exit 2; what was stored is read, and goes on."""
    disk, file = tmp_path / "disk", study_file(tmp_path, LONG)
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=96k", "tmpfs", disk], check=False, capture_output=True
    )
    if mounted.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {mounted.stderr.decode().strip()}")
    try:
        assert call(["study", str(file), "--out", str(disk / "out"), "--workers", "1", "--quiet"]) == 2
        error = capfd.readouterr().err
        assert error.count("\n") == 1
        assert "full" in error
        with open_store(disk / "out") as store:
            done, asked = finished_in(store), read_study(file)
            found = [store.find(c.key) for c in cases(asked, plan_of(asked).points())]
        assert sum(f is not None for f in found) == done > 0
        subprocess.run(["mount", "-o", "remount,size=8m", disk], check=True)
        run_study(asked, disk / "out", workers=2)
        same(open_study(disk / "out"), undisturbed)
    finally:
        subprocess.run(["umount", disk], check=True)
