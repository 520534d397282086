"""``python -m tests.mutation.score``: put small faults into the code, one at a time, and see whether the tests notice.

It changes files of the working copy in which it runs, and puts them back: run it in a copy of its own. See
docs/develop/mutation.md.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tests.mutation.draw import MISSING, Mutant, changed, difference, drawn
from tests.mutation.lines import Tests, is_compiled, read_tests
from tests.mutation.modules import GROUPS, ROOT
from tests.mutation.trial import COMPILE_S, START_S, TIMES_NORMAL, Outcome, load_libraries, run_tests, with_change

COPY = "the listed modules have changes: expected a working copy of its own, as from `git worktree add ../mutants`"


def try_mutant(mutant: Mutant, tests: Tests, most_s: float) -> tuple[Outcome, int, list[str]]:
    """Run the tests that a mutant may fail, those of its own room first; their number, and the change."""
    source = (ROOT / mutant.module).read_text(encoding="utf-8")
    code = changed(source, mutant.operator, mutant.occurrence)
    compiled = is_compiled(source, mutant.line)
    chosen = ordered_tests(mutant, tests, compiled, most_s)
    caches = ("hysteresis", "validation") if "hysteresis/laws" in mutant.module else ()
    if "fem_models/chain" in mutant.module:
        caches = ("fem_models/chain",)
    if not chosen:
        sys.exit(f"{mutant.module}: no test of its room in the files of coverage and times: make them anew")
    normal = sum(tests.seconds.get(test, START_S) for test in chosen)
    limit = START_S + TIMES_NORMAL * normal + (COMPILE_S if caches else 0.0)
    with with_change(ROOT, mutant.module, code, caches):
        return run_tests(chosen, limit), len(chosen), difference(source, code)


def ordered_tests(mutant: Mutant, tests: Tests, compiled: bool, most_s: float) -> list[str]:
    """Tests that run the changed line, the near ones first, the shortest of them first, as many as there is time for.

    Where these are few, the shortest tests of the room follow.
    """
    near = GROUPS[mutant.group].near
    found = tests.of(mutant.module, mutant.first, mutant.last, compiled)
    mine = [test for test in found if test.startswith(near)]
    others = [test for test in found if not test.startswith(near)]
    room = [test for folder in near for test in tests.inside(folder)] if compiled or not found else []
    return tests.within(dict.fromkeys([*mine, *room, *others]), most_s)


def main(arguments: list[str] | None = None) -> None:
    """Draw mutants, try those that are not in the file of results yet, and add each to it."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation.score", description="Mutation score.")
    parser.add_argument("--group", choices=list(GROUPS), nargs="+", default=list(GROUPS))
    parser.add_argument("--seed", type=int, default=23)
    parser.add_argument("--mutants", type=int, default=50, help="of each group")
    parser.add_argument("--most-s", type=float, default=120.0, help="normal time of the tests of one mutant, at most")
    parser.add_argument("--coverage", type=Path, nargs="+", required=True, help="files of `pytest --cov-context=test`")
    parser.add_argument("--times", type=Path, nargs="+", required=True, help="files of tests.mutation.in_order")
    parser.add_argument(
        "--out", type=Path, required=True, help="JSON lines, one a mutant; what is there is not repeated"
    )
    parser.add_argument("--again", action="store_true", help="try mutants that survived again")
    given = parser.parse_args(arguments)
    try:
        __import__("cosmic_ray.mutating")
    except ImportError:
        sys.exit(MISSING)
    files = {name: GROUPS[name].files() for name in given.group}
    listed = [file for own in files.values() for file in own]
    if subprocess.run(["git", "diff", "--quiet", "--", *listed], cwd=ROOT, check=False).returncode:
        sys.exit(COPY)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the change is taken out again
    os.chdir(ROOT)
    load_libraries()
    tests, known = read_tests(given.coverage, given.times), read_results([given.out])
    for name in given.group:
        mutants = drawn(name, files[name], ROOT, given.mutants, given.seed)
        for i, mutant in enumerate(mutants):
            row = known.get(mutant.name)
            if row is not None and not (given.again and row["outcome"] == "survived"):
                continue
            found, count, change = try_mutant(mutant, tests, given.most_s)
            row = {**asdict(mutant), "seed": given.seed, "change": change, "tests": count, **asdict(found)}
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            print(
                f"{i + 1}/{len(mutants)} {found.outcome} {found.seconds:.0f} s {mutant.name} {found.test}", flush=True
            )


def read_results(paths: list[Path]) -> dict[str, dict[str, Any]]:
    """Read the last result of every mutant by its name, with the outcome of its first trial, ``at_first``."""
    rows = [json.loads(text) for path in paths if path.exists() for text in path.read_text().splitlines()]
    out: dict[str, dict[str, Any]] = {}
    for row in rows:
        name = Mutant(**{k: row[k] for k in Mutant.__dataclass_fields__}).name
        out[name] = {**row, "at_first": out[name]["at_first"] if name in out else row["outcome"]}
    return out


if __name__ == "__main__":
    main()
