"""Kill commands with SIGKILL at random moments and look at what they leave; then run them again, to the same results.

    PYTHONPATH=. python tests/killed_commands.py --kills 6 --out killed
    PYTHONPATH=. python tests/killed_commands.py --kills 6 --terminate --out terminated   # SIGTERM to the command alone
    PYTHONPATH=. python tests/killed_commands.py --kills 0 --out twice   # twice, and with other threads

Each command is run once in peace. In each trial it is killed with all its children after a random part of that time.
With SIGTERM it must end by itself, with code 143 and one line that says how to go on.
Every file that is there then must be whole: JSON, CSV and HTML are read to their end. The same command in the same
folder must then write what the one in peace wrote, times aside. This takes minutes; it is no part of the test command.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from same_results import STUDY, compare

from fem_models.rig.presets_in_space import any_preset
from hysteresis.records.sidecar import toml

NOTCHBEND = [sys.executable, "-c", "from notchbend_start import main; main()"]
COMMANDS = {
    "simulate": ["simulate", "--preset", "du2018", "--amplitude", "2.2", "--cycles", "40", "--out", "results/loop.csv"],
    "identify": ["identify", "20N.csv", "--out", "results"],
    "trace": ["trace", "20N.csv", "10N.csv", "--out", "results"],
    "separate": ["separate", "--preset", "du2018", "--preload", "20", "--out", "results"],
    "study": ["study", "study.toml", "--out", "results"],
    "export": ["export", "--to", "mujoco", "--preset", "du2018", "--out", "results/du2018.xml"],
    "report": ["report", "results"],
    "run": ["run", "--out", "results"],
    "run in space": ["run", "--preset", "zhang2026", "--amplitude", "1", "--out", "results"],
    "workspace": ["workspace", "--preset", "zhang2026", "--amplitude", "1", "--out", "results"],
    "compensate": ["compensate", "20N.csv", "--reference", "wanted.csv", "--out", "results/drive.csv"],
    "compensate in space": ["compensate", "wrist.toml", "--reference", "wanted.csv", "--out", "results/drives.csv"],
}
"""Command lines after ``notchbend``, in the folder of a trial."""
OTHER_THREADS = {"trace": ["--threads", "1"], "study": ["--workers", "1"]}
"""Options of the second run; other commands have no threads of their own, and get one processor."""
MOST_S = 30.0
"""Most time between SIGTERM and the end of a command."""
MEANT_AGAIN = ("results/study.json.made.command", "results/trace.json.made.command")
"""What differs by design in the second run: the command, where it has the number of workers or threads in it."""
MEANT_RESUMED = ("results/study.json.from_store",)
"""What differs by design after a kill: how many cases a resumed study had stored."""


def prepare(folder: Path, name: str) -> None:
    """Fill the folder of a trial with the inputs of its command."""
    folder.mkdir(parents=True)
    (folder / "study.toml").write_text(STUDY)
    (folder / "wrist.toml").write_text(toml(any_preset("zhang2026").to_dict()))
    angle = [4 * math.sin(math.tau * i / 60) for i in range(61)]
    across = [2 * math.sin(2 * math.tau * i / 60) for i in range(61)]
    rows = [f"{one:.6f},{other:.6f}" for one, other in zip(angle, across, strict=True)]
    (folder / "wanted.csv").write_text("\n".join(["angle_deg,angle_2_deg", *rows]) + "\n")
    for preload in ("20", "10"):
        given = [
            "--preset",
            "du2018",
            "--preload",
            preload,
            "--amplitude",
            "2.2",
            "--cycles",
            "2",
            "--out",
            f"{preload}N.csv",
        ]
        notchbend(folder, ["simulate", *given])
    if name == "report":
        notchbend(folder, ["identify", "20N.csv", "--out", "results"])


def notchbend(folder: Path, arguments: list[str], **environment: str) -> None:
    """Run a command in peace."""
    done = subprocess.run(
        [*NOTCHBEND, *arguments, "--quiet"],
        cwd=folder, capture_output=True, text=True, check=False, env={**os.environ, **environment},
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"{' '.join(arguments)}: exit {done.returncode}: {done.stderr}")


def terminate_after(folder: Path, arguments: list[str], seconds: float) -> tuple[bool, list[str]]:
    """Start a command and send it SIGTERM; tell whether it was still at work, and what is wrong with its end."""
    child = subprocess.Popen(
        [*NOTCHBEND, *arguments, "--quiet"],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        child.wait(seconds)
    except subprocess.TimeoutExpired:
        child.terminate()
    start = time.perf_counter()
    try:
        told, said = child.communicate(timeout=MOST_S)
    except subprocess.TimeoutExpired:
        os.killpg(child.pid, signal.SIGKILL)
        child.wait()
        return True, [f"at {seconds:.2f} s: still at work {MOST_S:g} s after SIGTERM"]
    took = time.perf_counter() - start
    if child.returncode == 0 and not said:
        return False, []
    ends = said.startswith("notchbend: terminated: ") and re.search(r"the same command (starts again|goes on)", said)
    good = child.returncode == 128 + signal.SIGTERM and said.count("\n") == 1 and len(said) < 300 and ends and not told
    print(f"  at {seconds:.2f} s, ended {took:.2f} s later: {said.strip()[:200]}", flush=True)
    return True, [] if good else [f"at {seconds:.2f} s: exit {child.returncode}: {said.strip()[-300:]!r}"]


def kill_after(folder: Path, arguments: list[str], seconds: float) -> bool:
    """Start a command and kill it with its children; tell whether it was still at work."""
    child = subprocess.Popen(
        [*NOTCHBEND, *arguments, "--quiet"],
        cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    try:
        child.wait(seconds)
        return False
    except subprocess.TimeoutExpired:
        os.killpg(child.pid, signal.SIGKILL)
        child.wait()
        return True


def broken_files(folder: Path) -> list[str]:
    """Name the files that are not whole; staged ones, which the next run removes, are not looked at."""
    broken = []
    for path in sorted(folder.rglob("*")):
        if not path.is_file() or path.name.startswith(".") or ".zarr" in str(path):
            continue
        try:
            if path.suffix == ".json":
                json.loads(path.read_text())
            elif path.suffix == ".csv":
                text = path.read_text()
                if not text.endswith("\n") or len({len(row) for row in csv.reader(text.splitlines())}) != 1:
                    raise ValueError("no whole table")
            elif path.suffix == ".html" and not path.read_text().rstrip().endswith("</html>"):
                raise ValueError("no end")
        except ValueError as error:
            broken.append(f"{path.relative_to(folder)}: {error}")
    return broken


def differences(peace: Path, again: Path, meant: tuple[str, ...]) -> list[str]:
    """List what differs between the results of two folders, times and the values at ``meant`` aside."""
    found = compare(peace, again)
    all_of_them = [*found.structure, *(where for _, where in found.numbers), *found.texts]
    return [one for one in all_of_them if one.partition(":")[0] not in meant]


def main() -> int:
    """Run all; 1 where a file is broken, lost or different."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=6)
    parser.add_argument("--terminate", action="store_true", help="SIGTERM in place of SIGKILL")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", nargs="*", default=list(COMMANDS), choices=COMMANDS)
    options = parser.parse_args()
    drawn, failed = random.Random(options.seed), 0
    for name in options.only:
        command, top = COMMANDS[name], options.out.absolute() / name.replace(" ", "-")
        prepare(top / "inputs", name)
        shutil.copytree(top / "inputs", top / "peace")
        start = time.perf_counter()
        notchbend(top / "peace", command)
        seconds = time.perf_counter() - start
        if not any((top / "peace" / "results").iterdir()):
            raise SystemExit(f"{name}: nothing in results: expected what the command writes")
        shutil.copytree(top / "inputs", top / "again")
        notchbend(top / "again", [*command, *OTHER_THREADS.get(name, [])], NUMBA_NUM_THREADS="1", OMP_NUM_THREADS="1")
        found, killed = differences(top / "peace", top / "again", MEANT_AGAIN), 0
        for trial in range(options.kills):
            folder = top / f"killed-{trial}"
            shutil.copytree(top / "inputs", folder)
            after = drawn.uniform(0.1, 1.0) * seconds
            if options.terminate:
                stopped, wrong = terminate_after(folder, command, after)
                found += wrong
            else:
                stopped = kill_after(folder, command, after)
            killed += stopped
            found += broken_files(folder)
            notchbend(folder, command)
            found += [f"killed-{trial}: {one}" for one in differences(top / "peace", folder, MEANT_RESUMED)]
        failed += bool(found)
        print(f"{name}: {seconds:.1f} s, killed {killed} of {options.kills} times: {len(found)} faults", flush=True)
        print(*(f"  {one}" for one in found[:10]), sep="\n", end="\n" if found else "")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
