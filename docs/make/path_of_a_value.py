"""Count how often a value enters a file on its way through a command.

    python -m docs.make.path_of_a_value Record -- trace loop.csv --out traced
    python -m docs.make.path_of_a_value Rig -- simulate --preset du2018 --amplitude 2.2 --engine chain --out loop.csv

The command runs under a profiler. An entry is a call from one file into another that has a value of the named class
among its arguments, by itself or in a list or tuple. Calls between the same two functions count once. A short path has
few files and few entries. The figures stand in docs/develop/path-of-a-record.md and path-of-a-rig.md.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

PACKAGES = ("hysteresis", "fem_models", "validation", "studies", "notchbend.py")


def entries(name: str, arguments: list[str]) -> Counter[str]:
    """Run a command line of notchbend and count the entries into each file by values of the class ``name``."""
    main = _entry_point()
    root = next(Path(path) for path in sys.path if (Path(path or ".") / "hysteresis").is_dir()).resolve()
    edges: set[tuple[CodeType, CodeType]] = set()

    def watch(frame: FrameType, event: str, _: Any) -> None:
        caller = frame.f_back
        if event != "call" or caller is None or frame.f_code.co_filename == caller.f_code.co_filename:
            return
        own = [_inside(root, code) for code in (caller.f_code, frame.f_code)]
        if all(own) and _carries(frame, name):
            edges.add((caller.f_code, frame.f_code))

    sys.setprofile(watch)
    try:
        main(arguments)
    finally:
        sys.setprofile(None)
    return Counter(str(Path(callee.co_filename).relative_to(root)) for _, callee in edges)


def _entry_point() -> Any:
    from studies.commands.cli import call

    return call


def _inside(root: Path, code: CodeType) -> bool:
    path = Path(code.co_filename)
    return path.is_relative_to(root) and path.relative_to(root).parts[0] in PACKAGES


def _carries(frame: FrameType, name: str) -> bool:
    count = frame.f_code.co_argcount + frame.f_code.co_kwonlyargcount
    for argument in frame.f_code.co_varnames[:count]:
        value = frame.f_locals.get(argument)
        inner = value[0] if isinstance(value, list | tuple) and value else value
        if type(inner).__name__ == name:
            return True
    return False


def main() -> None:
    """Print the files with their entries, most entered first."""
    name, _, *arguments = sys.argv[1:]
    counted = entries(name, arguments)
    for path, count in counted.most_common():
        print(f"{count:4d}  {path}")  # noqa: T201
    print(f"{name}: {len(counted)} files entered, {counted.total()} entries")  # noqa: T201


if __name__ == "__main__":
    main()
