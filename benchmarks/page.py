"""Writes the figures of ``docs/validation/benchmarks.md``, all of one run: ``python -m benchmarks.page [FILE]``.

The same loop in this package's engines and in other codes (:mod:`benchmarks.peers`), and how the cost of ours grows
(:mod:`benchmarks.growth`). It needs ``pip install -e '.[bench]'``, a quiet machine and some five minutes. A peer that
is not installed is named with its reason.
"""

from __future__ import annotations

import datetime
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # the engines import the task as scripts do
from growth import CYCLES, DESIGNS, LARGEST_MULTIBODY, SIZES, rows, with_designs, with_joints, with_samples
from peers import ENGINES, installed, machine, markdown, measure_apart

from docs.make.pages import DOCS, put_between_marks, table

PAGE = DOCS / "validation" / "benchmarks.md"
COMMAND = "benchmarks.page"
OTHERS = ("numba", "numpy", "scipy")


def text() -> str:
    """Run everything, and format it."""
    load = os.getloadavg()[0]
    compared = markdown({module: measure_apart(module) for module in ENGINES})
    joints, samples, designs = with_joints(), with_samples(), with_designs()
    versions = ", ".join(f"{name} {installed(name)}" for name in OTHERS)
    said = f"{datetime.date.today():%-d %B %Y}: {machine()}, {versions}, load {load:.1f} before the run."
    return "\n\n".join(
        [
            said,
            *compared.rstrip().split("\n", 2)[2:],
            f"Milliseconds of a cycle of 88 steps over the number of joints (multibody up to {LARGEST_MULTIBODY}), and "
            "the exponent of growth:",
            table(["engine", *map(str, SIZES), "exponent"], rows(joints)),
            "Milliseconds of a run over the number of samples:",
            table(["engine", *(f"{88 * cycles:,}" for cycles in CYCLES), "exponent"], rows([samples])),
            "Milliseconds of a batch over the number of designs, one cycle each:",
            table(["engine", *(f"{count:,}" for count in DESIGNS), "exponent"], rows([designs])),
        ]
    )


def main(words: list[str]) -> None:
    """Write the page, or a file with the same text."""
    if words:
        Path(words[0]).write_text(text() + "\n", encoding="utf-8")
    else:
        put_between_marks(PAGE, COMMAND, text())


if __name__ == "__main__":
    main(sys.argv[1:])
