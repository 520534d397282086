"""How often the ranges of the ensemble hold a hidden rig.

    python -m benchmarks.recovered_rigs --seed 7 --workers 2 --out recovered.jsonl

A line is appended to the file for every rig, and rigs that have a line are not drawn again: a minute or two each. The
file that the page has is ``docs/validation/recovery.jsonl``.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fem_models.rig import preset
from validation.measured.ensemble.priors import MODELS
from validation.measured.ensemble.recovery import inside
from validation.measured.preset_du2018 import READING
from validation.practice.kept_lines import Score, run
from validation.practice.summary import exact_interval

MODEL = "Jenkins loop, toe and play"
LIVE, EFFECTIVE = 100, 100


@dataclass(frozen=True)
class Asked:
    """Which hidden rig: the seed of its set, its row and its number, from 0."""

    seed: int
    row: str
    number: int


@dataclass(frozen=True)
class Hidden:
    """Whether the values of a hidden rig lie within their 95 % ranges, by name of the constant or the prediction."""

    row: str
    seed: int
    number: int
    inside: Mapping[str, bool]


def hidden_of(asked: Asked) -> Hidden:
    """Hide a rig of the preset, and draw from what it states."""
    own = zlib.crc32(f"{asked.seed} {asked.number}".encode())
    found = inside(preset("du2018"), MODELS[MODEL], READING, seed=own, live=LIVE, effective=EFFECTIVE)
    return Hidden(asked.row, asked.seed, asked.number, found)


def table(lines: Sequence[Hidden]) -> list[str]:
    """Rows of a Markdown table: how many hidden values lie within their ranges, by name and in all."""
    out = ["| number | within |", "|---|---|"]
    for name in lines[0].inside:
        label = name if " " in name else f"`{name}`"
        out.append(f"| {label} | {sum(one.inside[name] for one in lines)} of {len(lines)} |")
    every = [value for one in lines for value in one.inside.values()]
    low, high = exact_interval(sum(every), len(every))
    share = f"{100 * np.mean(every):.1f} % ({100 * low:.1f} to {100 * high:.1f})"
    return [*out, f"| all | {sum(every)} of {len(every)}, {share} |"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Hide the rigs that have no line yet, and print the table of all."""
    run(Score("benchmarks.recovered_rigs", ("rigs",), 100, Asked, hidden_of, Hidden, table), arguments)


if __name__ == "__main__":
    main()
