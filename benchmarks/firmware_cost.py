"""What a compensator in C costs, how near it is to the package, and what compilers and checkers say of it.

    python benchmarks/firmware_cost.py --steps 1000000 --out cost.jsonl

For each law a made-up fit is exported and compiled. Random steps between random turning points are replayed: drives
into the model, and references into its inverse, whose drives are put into the model in Python. Instructions are counted
by callgrind of valgrind in the function `step` and all that it calls, those of the library among them: the mean of
20,000 steps, and of 500 single ones the 99 % quantile and the largest. Checkers that are not installed are left out.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))  # made-up fits of all laws
from firmware_fits import CASES, STRICT, stored_fit

from hysteresis.arrays import Floats
from hysteresis.files import write_files
from studies.firmware import compensator_files, read_compensator
from studies.firmware.vector import predicted, random_path

COUNTED, SINGLE = 20_000, 500
KINDS = {"double": (), "float": ("-DCMP_FLOAT",)}
CHECKERS = {
    "cppcheck": ("cppcheck", "--std=c99", "--enable=warning,style,performance,portability", "--error-exitcode=1",
                 "--inline-suppr", "--suppress=missingIncludeSystem", "--suppress=unusedFunction", "--quiet", "cmp.c"),
    "clang-tidy": ("clang-tidy", "cmp.c", "--quiet", "--warnings-as-errors=*",
                   "--checks=-*,bugprone-*,-bugprone-easily-swappable-parameters,clang-analyzer-*,cert-*,misc-*,"
                   "-misc-include-cleaner,performance-*,portability-*", "--", "-std=c99"),
}  # fmt: skip
MAIN = """
#include "cmp.c"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
int main(int count, char **words)
{
    int many = count > 1 ? atoi(words[1]) : 0, rounds = count > 2 ? atoi(words[2]) : 1, k, turn;
    double *given = malloc(sizeof *given * (size_t)many);
    volatile cmp_real kept = 0;
    cmp_state state;
    clock_t began;
    for (k = 0; k < many; k++)
        if (scanf("%lf", &given[k]) != 1)
            return 1;
    began = clock();
    for (turn = 0; turn < rounds; turn++) {
        cmp_init(&state);
        for (k = 0; k < many; k++)
            kept = cmp_step(&state, (cmp_real)given[k]);
    }
    printf("%g\\n", (double)(clock() - began) / CLOCKS_PER_SEC);
    (void)kept;
    return 0;
}
"""


def run(words: Sequence[str], folder: Path, given: str = "") -> subprocess.CompletedProcess[str]:
    """Run a program in a folder."""
    return subprocess.run(words, cwd=folder, input=given, capture_output=True, text=True, check=False)


def compiled(source: str, made: str, folder: Path, *options: str) -> str:
    """Compile strictly."""
    done = run(["cc", *STRICT, "-O2", *options, source, "-o", made, "-lm"], folder)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return str(folder / made)


def lines(values: Floats) -> str:
    """Give numbers, a line each."""
    return "\n".join(map(repr, values.tolist())) + "\n"


def second_column(program: str, values: Floats, folder: Path, *words: str) -> Floats:
    """Replay numbers."""
    rows = run([program, *words], folder, lines(values)).stdout.splitlines()[1:]
    return np.array([row.split(",")[1] for row in rows], dtype=float)


def instructions(program: str, reference: Floats, folder: Path) -> dict[str, float]:
    """Count instructions of `step`: mean of many steps, 99 % quantile and largest of single ones."""
    valgrind = ["valgrind", "--tool=callgrind", "--toggle-collect=cmp_step"]
    many, few = reference[:COUNTED], reference[:SINGLE]
    done = run([*valgrind, "--callgrind-out-file=all.out", program, str(many.size)], folder, lines(many))
    total = re.search(r"Collected : (\d+)", done.stderr)
    if total is None:
        return {}
    (folder / "single").mkdir(exist_ok=True)
    options = ["--dump-after=cmp_step", "--callgrind-out-file=single/one.out"]
    run([*valgrind, *options, program, str(few.size)], folder, lines(few))
    found = [re.search(r"^summary: (\d+)", one.read_text(), re.M) for one in (folder / "single").glob("one.out.*")]
    shutil.rmtree(folder / "single")
    single = np.array([int(one[1]) for one in found if one is not None and int(one[1])])
    return {
        "instructions": int(total[1]) / many.size,
        "instructions_99": float(np.quantile(single, 0.99)),
        "instructions_most": float(single.max()),
    }


def one_law(case: str, steps: int, folder: Path) -> list[dict[str, object]]:
    """Measure one law, a row for double and one for float."""
    compensator = read_compensator(stored_fit(folder / "identify.json", case), "cmp")
    write_files(compensator_files(compensator, folder))
    (folder / "cost.c").write_text(MAIN)
    layer = compensator.layer
    drive = random_path(steps, (-1.6, 1.6), layer.first_drive, seed=11)
    angle = predicted(layer, drive)
    header = (folder / "cmp.h").read_text()
    said = {
        name: f"exit {run(words, folder).returncode}" if shutil.which(words[0]) else "not installed"
        for name, words in CHECKERS.items()
    }
    rows = list[dict[str, object]]()
    for kind, options in KINDS.items():
        replay = compiled("cmp.c", kind, folder, "-DCMP_MAIN", *options)
        checked = compiled("cmp.c", "checked", folder, "-DCMP_MAIN", "-fsanitize=undefined,address", *options)
        clean = run([checked], folder, lines(angle[:20_000])).stderr == ""
        model = second_column(replay, drive, folder, "observe")
        found = second_column(replay, angle, folder)
        cost = compiled("cost.c", "cost", folder, *options)
        rounds = 20
        seconds = float(run([cost, str(COUNTED), str(rounds)], folder, lines(angle[:COUNTED])).stdout)
        symbols = run(["nm", compiled("cmp.c", "cmp.o", folder, "-c", *options)], folder).stdout
        stack = run(["cat", "cmp.su"], folder) if compiled("cmp.c", "cmp.o", folder, "-c", "-fstack-usage") else None
        frames = sum(int(row.split("\t")[1]) for row in stack.stdout.splitlines()) if stack else 0
        sizes = re.search(r"(\d+) bytes in double and (\d+) in float", header)
        row: dict[str, object] = {"law": case, "real": kind, "steps": steps}
        row |= {"model_deg": float(np.abs(model - angle).max())}
        row |= {"inverse_deg": float(np.abs(predicted(layer, found) - angle).max())}
        row |= instructions(str(folder / "cost"), angle, folder)
        row |= {"steps_per_us": COUNTED * rounds / seconds / 1e6, "sanitizers_clean": clean, "stack": frames}
        row |= {"state": int(sizes[1 if kind == "double" else 2]) if sizes else 0}
        row |= {"undefined": sorted(set(re.findall(r" U (\w+)", symbols)))} | said
        rows.append(row)
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Print and store a row for each law."""
    parser = argparse.ArgumentParser(prog="python benchmarks/firmware_cost.py", description=__doc__)
    parser.add_argument("--steps", type=int, default=1_000_000, help="random steps of a law")
    parser.add_argument("--law", action="append", choices=list(CASES), help="by default all; may be repeated")
    parser.add_argument("--out", type=Path, required=True, help="lines of JSON, appended")
    options = parser.parse_args(arguments)
    for case in options.law or CASES:
        began = time.perf_counter()
        with TemporaryDirectory() as folder:
            rows = one_law(case, options.steps, Path(folder))
        with options.out.open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(row) + "\n" for row in rows)
        for row in rows:
            sys.stdout.write(json.dumps(row) + "\n")
        sys.stdout.write(f"{case}: {time.perf_counter() - began:.0f} s\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
