"""Run commands on a disk that is full, or read-only, and look at what they leave; then again, with space.

    PYTHONPATH=. python tests/full_disks.py --out full          # as root: it mounts disks in memory

Each command is run once in peace, which tells how much it writes. Then its folder of results is a disk with a part of
that space: the command must end with code 2 and one line that names a file, every file that is there must be whole, and
the same command on a larger disk must write what the one in peace wrote. At last the disk with all results is
read-only, then full: no file that is there may change, but for those that ``run`` removes first, which may give it the
space that it needs, and the same command must write all of them again once there is space. This takes minutes; it is no
part of the test command.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from killed_commands import COMMANDS, MEANT_RESUMED, NOTCHBEND, broken_files, differences, notchbend, prepare

PARTS = (0.0, 0.1, 0.6, 0.95)
"""Sizes of the disk, as a part of what the command writes."""
REMOVED_FIRST = ("report.html", "run.json", "wrist.json")
"""Files of an earlier ``run``, removed when the next one begins: they would be of other numbers than its records."""
PAGE = 4096


def mount(disk: Path, size: int) -> None:
    """Make a folder a disk of so many bytes."""
    disk.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", disk], check=True)


def again(disk: Path, options: str) -> None:
    """Mount it with other options."""
    subprocess.run(["mount", "-o", f"remount,{options}", disk], check=True)


def space_of(folder: Path) -> int:
    """Give the space of a folder on a disk, whole pages."""
    return sum(PAGE * (1 + path.stat().st_size // PAGE) if path.is_file() else PAGE for path in folder.rglob("*"))


def refusal(folder: Path, arguments: list[str], *, may_fit: bool = False) -> list[str]:
    """Run a command that cannot write; list what is wrong with its end. With ``may_fit`` it may find space."""
    done = subprocess.run([*NOTCHBEND, *arguments, "--quiet"], cwd=folder, capture_output=True, text=True, check=False)
    said = done.stderr
    print(f"    exit {done.returncode}: {said.strip()[-200:]}", flush=True)
    if may_fit and done.returncode == 0 and not said:
        return []
    if done.returncode == 2 and said.startswith("notchbend: ") and said.count("\n") == 1 and len(said) < 300:
        return []
    return [f"exit {done.returncode}: {said.strip()[-300:]!r}"]


def contents(folder: Path) -> dict[str, bytes]:
    """Read all files."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def changed(before: dict[str, bytes], after: dict[str, bytes]) -> list[str]:
    """Name the files that are lost, changed or new; the store of a study is a database, which is compared later."""
    names = sorted(before.keys() | after.keys())
    return [name for name in names if before.get(name) != after.get(name) and "cases.sqlite" not in name]


def try_parts(top: Path, command: list[str], size: int, parts: Sequence[float]) -> list[str]:
    """Run on disks that are too small."""
    found = []
    for part in parts:
        folder = top / f"part-{part:g}"
        shutil.copytree(top / "inputs", folder, ignore=shutil.ignore_patterns("results"))
        mount(disk := folder / "results", 2 * PAGE + int(part * size))
        try:
            earlier = top / "inputs" / "results"
            if earlier.exists():
                again(disk, f"size={space_of(earlier) + 2 * PAGE + int(part * (size - space_of(earlier)))}")
                shutil.copytree(earlier, disk, dirs_exist_ok=True)
            print(f"  {part:.0%} of the space", flush=True)
            found += [f"part {part:g}: {one}" for one in refusal(folder, command) + broken_files(folder)]
            again(disk, "size=200m")
            notchbend(folder, command)
            found += [f"part {part:g}: {one}" for one in differences(top / "peace", folder, MEANT_RESUMED)]
        finally:
            subprocess.run(["umount", disk], check=True)
    return found


def try_again(top: Path, command: list[str], removed: tuple[str, ...]) -> list[str]:
    """Run where all results are, on a disk that is full and then read-only."""
    folder, found = top / "full", list[str]()
    shutil.copytree(top / "inputs", folder, ignore=shutil.ignore_patterns("results"))
    mount(disk := folder / "results", 200 << 20)
    try:
        shutil.copytree(top / "peace" / "results", disk, dirs_exist_ok=True)
        before = contents(disk)
        again(disk, "ro")
        print("  read-only, with all results", flush=True)
        found += [f"read-only: {one}" for one in refusal(folder, command)]
        found += [f"read-only: changed: {name}" for name in changed(before, contents(disk))]
        again(disk, "rw")
        filler = disk / "filler"
        with filler.open("wb", buffering=0) as file:  # a last flush would fail, too
            again(disk, f"size={space_of(disk) + 64 * PAGE}")
            try:
                while True:
                    file.write(bytes(PAGE))
            except OSError:
                pass
        before = contents(disk)
        print("  full, with all results", flush=True)
        wrong = refusal(folder, command, may_fit=bool(removed))  # in the place of what it removed
        found += [f"full: {one}" for one in wrong + broken_files(folder)]
        if any((disk / name).exists() for name in removed):  # it found space, and wrote all again: times differ
            filler.unlink()
            found += [f"full: {one}" for one in differences(top / "peace", folder, MEANT_RESUMED)]
        else:
            found += [f"full: changed: {name}" for name in changed(before, contents(disk)) if name not in removed]
        filler.unlink(missing_ok=True)
        again(disk, "size=200m")
        notchbend(folder, command)
        found += [f"full: {one}" for one in differences(top / "peace", folder, MEANT_RESUMED)]
    finally:
        subprocess.run(["umount", disk], check=True)
    return found


def main() -> int:
    """Run all; 1 where a file is broken, lost or different, or an end is not as promised."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--parts", nargs="*", type=float, default=PARTS)
    parser.add_argument("--only", nargs="*", default=list(COMMANDS), choices=COMMANDS)
    options = parser.parse_args()
    failed = 0
    for name in options.only:
        command, top = COMMANDS[name], options.out.absolute() / name.replace(" ", "-")
        prepare(top / "inputs", name)
        shutil.copytree(top / "inputs", top / "peace")
        notchbend(top / "peace", command)
        size = space_of(top / "peace" / "results")
        print(f"{name}: writes {size / 1e6:.2f} MB", flush=True)
        found = try_parts(top, command, size, options.parts) + try_again(
            top, command, REMOVED_FIRST if name.startswith("run") else ()
        )
        failed += bool(found)
        print(f"{name}: {len(found)} faults", flush=True)
        print(*(f"  {one}" for one in found[:20]), sep="\n", end="\n" if found else "")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
