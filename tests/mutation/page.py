"""``python -m tests.mutation.page RESULTS... --into docs/develop/mutation.md``: write the tables of the page."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tests.mutation.modules import GROUPS
from tests.mutation.score import read_results

REASONS = Path(__file__).with_name("reasons.json")
"""Why mutants survive: a reason by the name of each."""
START, END = "<!-- results -->", "<!-- end of results -->"


def interval(killed: int, of: int) -> tuple[float, float]:
    """Give the 95 % interval of a share in percent (Wilson 1927, doi 10.1080/01621459.1927.10502953)."""
    z, p = 1.96, killed / of
    middle, half = p + z**2 / (2 * of), z * math.sqrt(p * (1 - p) / of + z**2 / (4 * of**2))
    return 100 * (middle - half) / (1 + z**2 / of), 100 * (middle + half) / (1 + z**2 / of)


def tables(rows: dict[str, dict[str, Any]], reasons: dict[str, str]) -> str:
    """Write the score of each group, and the survivors with their reasons, as Markdown."""
    out = ["| modules | mutants | killed before | killed now | score, 95 % interval | equivalent ones left out |"]
    out.append("|---|---|---|---|---|---|")
    for group in [*GROUPS, "all"]:
        own = {name: row for name, row in rows.items() if group in (row["group"], "all")}
        if own:
            out.append(f"| {group} | {_score(own, reasons)} |")
    out += ["", "| survivor | change | why |", "|---|---|---|"]
    for name, row in sorted(rows.items()):
        if row["outcome"] == "survived":
            change = " → ".join(f"`{text[1:].strip()}`" for text in row["change"]).replace("|", "\\|")
            out.append(f"| {row['module']}:{row['line']} | {change} | {reasons.get(name, 'not looked at')} |")
    return "\n".join(out)


def _score(rows: dict[str, dict[str, Any]], reasons: dict[str, str]) -> str:
    survived = {name for name, row in rows.items() if row["at_first"] == "survived"}
    alive = {name for name, row in rows.items() if row["outcome"] == "survived"}
    equal = {name for name in alive if reasons.get(name, "").startswith("equivalent")}
    of, before, now = len(rows), len(rows) - len(survived), len(rows) - len(alive)
    low, high = interval(now, of)
    cells = (of, f"{before} ({100 * before / of:.0f} %)", now, f"{100 * now / of:.0f} % ({low:.0f} to {high:.0f} %)")
    return " | ".join([*map(str, cells), f"{100 * now / max(1, of - len(equal)):.0f} %"])


def main(arguments: Iterable[str] | None = None) -> None:
    """Write the tables between the marks of a page."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation.page", description="Write the page's tables.")
    parser.add_argument("results", type=Path, nargs="+", help="files of tests.mutation.score")
    parser.add_argument("--into", type=Path, required=True, help="page with marks for the tables")
    given = parser.parse_args(None if arguments is None else list(arguments))
    reasons = json.loads(REASONS.read_text(encoding="utf-8"))
    text = given.into.read_text(encoding="utf-8")
    before, after = text.partition(START)[0], text.partition(END)[2]
    made = tables(read_results(given.results), reasons)
    given.into.write_text(f"{before}{START}\n\n{made}\n\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
