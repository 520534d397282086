"""The practice score as a page of the documentation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hysteresis.files import write_files
from validation.practice.cases import LABELS, PAIR
from validation.practice.hidden import CATALOGUE
from validation.practice.outside import OUTSIDE

HEADINGS = {"known": "## Known rig", "unknown": "## Unknown geometry"}
SLOW = frozenset({PAIR, *OUTSIDE})
"""All effects are searched three times over before nothing, or two, are found; scored apart, a section of their own."""
VERDICTS = ("none", "unexplained", "error")


def tables(result: Mapping[str, Any]) -> str:
    """Markdown of a score: rates, errors and times, confusion matrix."""
    asked = {"count": result.get("count"), "others": result.get("others"), "effects": result.get("effects")}
    fewer = "".join(f" --{name} {value}" for name, value in asked.items() if value is not None)
    effects = [_both(k, v) for k, v in result["by_effect"].items()]
    by_effect = [*_table(["effect", "first", "interval %", "within set", "interval %"], effects), ""] if effects else []
    lines = [
        f"Made by `python -m validation.practice.score --set {result['set']} --kind {result['kind']}{fewer}`: "
        f"{result['cases']} cases.",
        "",
        *_table(
            ["rate", "hits", "of", "%", "95 % interval"],
            [_rate(k, v) for k, v in result["rates"].items() if v["of"]],
        ),
        "",
        *_table(["", "median", "largest"], [_spread(*row) for row in _spreads(result) if row[1]["median"] is not None]),
        "",
        *by_effect,
        "Confusion matrix. Rows: what was hidden. Columns: what was named first, by its number.",
        "",
        *_matrix(result["confusion"]),
    ]
    return "\n".join(lines) + "\n"


def put_section(page: Path, result: Mapping[str, Any], text: str) -> None:
    """Put tables in place of the section of their kind; at the end of the page where there is none."""
    labels = (result.get("effects") or "").split(",")
    heading = HEADINGS[result["kind"]] + (", pairs and outside of the catalogue" if SLOW.issuperset(labels) else "")
    prose = page.read_text(encoding="utf-8") if page.exists() else "# Practice score\n"
    before, found, after = prose.partition(f"{heading}\n")
    _, next_heading, rest = after.partition("\n## ") if found else ("", "", "")
    write_files({page: f"{before.rstrip()}\n\n{heading}\n\n{text}{next_heading}{rest}"})


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]


def _interval(rate: Mapping[str, Any]) -> str:
    return f"{100 * rate['low']:.0f} to {100 * rate['high']:.0f}"


def _rate(name: str, rate: Mapping[str, Any]) -> list[str]:
    return [name, str(rate["hits"]), str(rate["of"]), f"{100 * rate['rate']:.1f}", _interval(rate)]


def _both(name: str, rates: Mapping[str, Any]) -> list[str]:
    cells = [[f"{rate['hits']}/{rate['of']}", _interval(rate)] for rate in (rates["first"], rates["within set"])]
    return [f"`{name}`", *cells[0], *cells[1]]


def _spreads(result: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    return [
        ("held-out error after, over the noise, where right", result["after_over_noise"]),
        ("held-out error after over before, where right", result["after_over_before"]),
        ("seconds a case", result["seconds"]),
    ]


def _spread(name: str, values: Mapping[str, Any]) -> list[str]:
    return [name, *(f"{values[key]:.3g}" for key in ("median", "largest"))]


def _matrix(matrix: Mapping[str, Mapping[str, int]]) -> list[str]:
    columns = [*CATALOGUE, *VERDICTS]
    columns += sorted({name for row in matrix.values() for name in row} - set(columns))
    numbers = {name: str(i + 1) if name in CATALOGUE else name for i, name in enumerate(columns)}
    rows = [
        [
            f"{numbers[label]} `{label}`" if label in CATALOGUE else label,
            *(str(matrix[label].get(c, "")) for c in columns),
        ]
        for label in LABELS
        if label in matrix
    ]
    return _table(["hidden", *(numbers[c] for c in columns)], rows)
