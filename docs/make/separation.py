"""Writes the tables of ``docs/validation/separation.md``: ``python -m docs.make.separation [SCORE.jsonl]``.

The score is that of ``benchmarks/covered_shares.py``; by default the one that is kept beside the page.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.covered_shares import NOISES_DEG, NUMBERS, Covered, counts, interval_of, kept
from docs.make.pages import DOCS, put_between_marks, table
from fem_models.rig.metal import METAL_RANGES
from validation.separation.contributions import SOURCES
from validation.separation.priors import FLAG, PRIORS
from validation.separation.rig_calibration import ENOUGH

PAGE = DOCS / "validation" / "separation.md"
SCORE = DOCS / "validation" / "separation.jsonl"
COMMAND, OF_PRIORS, OF_MEMBERS = "docs.make.separation", "docs.make.separation priors", "docs.make.separation members"
_SHAPES = {"log": "{:g} of the logarithm", "logit": "{:g} of the logit", "plain": "{:g} {}"}


def score(lines: Sequence[Covered]) -> str:
    """Format what the intervals of rigs drawn from the priors hold, and what a division costs."""
    rows, tables = [one for one in lines if not one.members], []
    for number, words in zip(NUMBERS, ("energy", "width"), strict=True):
        head = [f"share of the {words}", *(f"held, {noise:g} deg | median width" for noise in NOISES_DEG)]
        lines = [
            [name.replace("_", " "), *(_cells(_of(rows, noise), number, sources) for noise in NOISES_DEG)]
            for name, sources in {**{source: (source,) for source in SOURCES}, "all three": SOURCES}.items()
        ]
        tables.append(table(" | ".join(head).split(" | "), [" | ".join(line).split(" | ") for line in lines]))
    return "\n\n".join([_words(rows), *tables, _by_law(rows)])


def _of(rows: Sequence[Covered], noise_deg: float) -> list[Covered]:
    return [one for one in rows if one.noise_deg == noise_deg]


def _held(rows: Sequence[Covered], number: str, sources: Sequence[str]) -> str:
    held, count = counts(rows, number, sources)
    low, high = interval_of(held, count)
    return f"{held} of {count}, {100 * held / max(count, 1):.1f} % ({100 * low:.0f} to {100 * high:.0f})"


def _cells(rows: Sequence[Covered], number: str, sources: Sequence[str]) -> str:
    found = [one.found[number][source] for one in rows if not one.refused for source in sources]
    return f"{_held(rows, number, sources)} | {np.median([high - low for _, _, low, high in found]):.3f}"


def _words(rows: Sequence[Covered]) -> str:
    seeds = ", ".join(str(seed) for seed in sorted({one.seed for one in rows}))
    rigs = len({(one.seed, one.number) for one in rows})
    flags = len({(one.seed, one.number) for one in rows if one.law == "flag"})
    seconds = np.array([one.seconds for one in rows])
    sure = sum(one.laws.get(one.law, 0.0) > 0.5 for one in rows if not one.refused)
    flat = sum(one.effective_draws < ENOUGH + 0.1 for one in rows if not one.refused)
    return (
        f"Seed {seeds}: {rigs} rigs, {flags} of them with the flag; {len(rows)} divisions, "
        f"{sum(bool(one.refused) for one in rows)} refused. The law that made the records has more than half of the\n"
        f"probability in {sure}; weights were flattened in {flat}. A division takes {np.median(seconds):.0f} s of "
        "processor time in the median,\n"
        f"{np.quantile(seconds, 0.9):.0f} s at most in nine of ten, on a machine that had other work."
    )


def _by_law(rows: Sequence[Covered]) -> str:
    head = ["law of the metal", *(f"energy shares held, {noise:g} deg" for noise in NOISES_DEG)]
    lines = [
        [law, *(_held([one for one in _of(rows, noise) if one.law == law], "share", SOURCES) for noise in NOISES_DEG)]
        for law in ("linear", "flag")
    ]
    return table(head, lines)


def members(lines: Sequence[Covered]) -> str:
    """Format what the intervals of members of the ensemble hold."""
    rows = [one for one in lines if one.members]
    seeds = ", ".join(str(seed) for seed in sorted({one.seed for one in rows}))
    head = [f"seed {seeds}", *(f"held, {noise:g} deg" for noise in NOISES_DEG)]
    lines_of = [
        [f"shares of the {words}", *(_held(_of(rows, noise), number, SOURCES) for noise in NOISES_DEG)]
        for number, words in zip(NUMBERS, ("energy", "width"), strict=True)
    ]
    return table(head, lines_of)


def priors() -> str:
    """Format the priors with their sources."""
    lines = []
    for name, prior in PRIORS.items():
        size = _SHAPES[prior.shape].format(prior.spread, prior.unit)
        known = "" if prior.unstated is None else "{:g}, {:g}".format(*prior.unstated)
        known += f" ({prior.unstated_shape})" if prior.unstated_shape else ""
        lines.append([f"`{name}`", prior.unit, size, known, prior.source])
    head = ["constant", "unit", "standard deviation", "where it is stated as 0: median, deviation", "source"]
    ranges = [
        [f"`{name}`", "{:g} to {:g}".format(*METAL_RANGES[f"superelastic.{name}"][:2]),
         METAL_RANGES[f"superelastic.{name}"][2]]
        for name in FLAG
    ]  # fmt: skip
    return f"{table(head, lines)}\n\n{table(['flag where the rig states no law', 'uniform', 'source'], ranges)}"


def main() -> None:
    """Put both tables on the page."""
    rows = kept(Path(sys.argv[1]) if len(sys.argv) > 1 else SCORE)
    put_between_marks(PAGE, COMMAND, score(rows))
    put_between_marks(PAGE, OF_MEMBERS, members(rows))
    put_between_marks(PAGE, OF_PRIORS, priors())


if __name__ == "__main__":
    main()
