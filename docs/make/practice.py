"""Puts a score of the tracer, or of hidden changes, into a page.

``python -m docs.make.practice DIR/score.json --page docs/archive/practice-2026.md``
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from docs.make.pages import DOCS, put_between_marks, table
from hysteresis.files import write_files
from hysteresis.plain import from_plain
from validation.practice.catalogue import CATALOGUE
from validation.practice.draw import LABELS
from validation.practice.hidden.changes import OUTSIDE
from validation.practice.hidden.score import HiddenOutcome
from validation.practice.hidden.score import table as hidden_table
from validation.practice.score import SLOW, Request
from validation.practice.summary import Rate, Spread, Summary

PAGE = DOCS / "validation" / "practice.md"
HEADINGS = {"known": "## Known rig", "unknown": "## Unknown geometry"}
SOURCE_HEADINGS = {
    "own": "",
    "lumped": ", records from another generator",
    "series": ", rigs in series",
    "sensors": ", spoiled sensors",
    "protocols": ", spoiled protocols",
}
VERDICTS = ("none", "unexplained", "error")
_RATES = {
    "first, not of the angle alone": "first, without effects of the angle alone",
    "within set, not of the angle alone": "within set, without effects of the angle alone",
    "pairs, neither of the angle alone: both named": "pairs without effects of the angle alone: both named",
    "right: held-out error within 1.3 of the noise": "first: held-out error within 1.3 times the noise",
}
"""How the page calls a rate, if not by its key."""


def tables(request: Request, found: Summary) -> str:
    """Markdown of a score: rates, errors and times, confusion matrix."""
    source = None if request.source == "own" else request.source
    options = {"source": source, "count": request.count, "others": request.others, "effects": request.effects}
    command = f"python -m validation.practice.score --set {request.set} --kind {request.kind}"
    command += "".join(f" --{name} {value}" for name, value in options.items() if value is not None)
    spreads = {
        "held-out error after over the noise, effect named first": found.after_over_noise,
        "held-out error after over before, effect named first": found.after_over_before,
        "seconds per case": found.seconds,
    }
    rates = [_rate(_RATES.get(name, name), rate) for name, rate in found.rates.items() if rate.of]
    blocks = [
        f"Scored by `{command}`: {found.cases} cases.",
        table(["rate", "hits", "of", "%", "95 % interval"], rates),
        table(["", "median", "largest"], [_spread(name, s) for name, s in spreads.items() if s.median is not None]),
    ]
    if found.by_effect:
        head = ["effect", "first", "interval %", "within set", "interval %"]
        blocks.append(table(head, [_both(name, rates) for name, rates in found.by_effect.items()]))
    if request.source in ("sensors", "protocols"):
        return "\n\n".join([*blocks, _by_kind(found.confusion)]) + "\n"
    blocks.append("Confusion matrix. Rows: injected effect. Columns: effect named first, by its number.")
    blocks.append(_matrix(found.confusion))
    return "\n\n".join(blocks) + "\n"


def put_section(page: Path, request: Request, text: str) -> None:
    """Replace the section of the kind of a score; append it if the page has none."""
    labels = (request.effects or "").split(",")
    heading = HEADINGS[request.kind] + SOURCE_HEADINGS[request.source]
    heading += ", pairs and effects outside the catalogue" if SLOW.issuperset(labels) else ""
    prose = page.read_text(encoding="utf-8") if page.exists() else "# Practice score\n"
    before, found, after = prose.partition(f"{heading}\n")
    _, next_heading, rest = after.partition("\n## ") if found else ("", "", "")
    write_files({page: f"{before.rstrip()}\n\n{heading}\n\n{text}{next_heading}{rest}"})


def _interval(rate: Rate) -> str:
    return f"{100 * rate.low:.0f} to {100 * rate.high:.0f}"


def _rate(name: str, rate: Rate) -> list[str]:
    return [name, str(rate.hits), str(rate.of), f"{100 * (rate.rate or 0.0):.1f}", _interval(rate)]


def _both(name: str, rates: Mapping[str, Rate]) -> list[str]:
    cells = [[f"{rate.hits}/{rate.of}", _interval(rate)] for rate in (rates["first"], rates["within set"])]
    return [f"`{name}`", *cells[0], *cells[1]]


def _spread(name: str, values: Spread) -> list[str]:
    return [name, *(f"{value:.3g}" for value in (values.median, values.largest))]


def _by_kind(matrix: Mapping[str, Mapping[str, int]]) -> str:
    """Answers by what spoils a record; effects with their counts."""
    rows = []
    for label, counts in matrix.items():
        named = [f"`{name}` {count}" for name, count in counts.items() if name not in VERDICTS]
        rows.append([label.replace("_", " "), *(str(counts.get(v, 0)) for v in VERDICTS), ", ".join(named)])
    return table(["spoiled by", *VERDICTS, "named first"], rows)


def _matrix(matrix: Mapping[str, Mapping[str, int]]) -> str:
    columns = [*CATALOGUE, *VERDICTS]
    columns += sorted({name for row in matrix.values() for name in row} - set(columns))
    numbers = {name: str(i + 1) if name in CATALOGUE else name for i, name in enumerate(columns)}
    there = [*(label for label in LABELS if label in matrix), *(label for label in matrix if label not in LABELS)]
    rows = [
        [
            f"{numbers[label]} `{label}`" if label in CATALOGUE else label,
            *(str(matrix[label].get(c, "")) for c in columns),
        ]
        for label in there
    ]
    return table(["injected", *(numbers[c] for c in columns)], rows)


def hidden_text(outcomes: Sequence[HiddenOutcome], seed: int) -> str:
    """Markdown of a score on hidden changes: the table, and what the baseline absorbed."""
    command = f"python -m validation.practice.hidden.score --measured DIR --seed {seed} --count {len(outcomes)}"
    missed = [one for one in outcomes if one.change not in OUTSIDE and not one.in_set]
    rows = [
        [
            one.group,
            one.change.replace("_", " "),
            f"{one.ratio:.1f}",
            one.verdict,
            ", ".join(one.named) or "-",
            f"{one.control_deg:.2f}",
            f"{one.before_deg:.2f}",
        ]
        for one in missed
    ]
    head = ["group", "hidden", "size", "verdict", "named", "control, deg", "changed, deg"]
    return "\n\n".join(
        [
            f"Scored by `{command}`.",
            "\n".join(hidden_table(outcomes)),
            "The changes that are not in the set, with the held-out error of the baseline without and with the change:",
            table(head, rows),
        ]
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Read scores and put their tables into the page."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.practice", description="Put scores into a page.")
    parser.add_argument("scores", type=Path, nargs="+", help="score.json of validation.practice.score")
    parser.add_argument("--page", type=Path, default=PAGE, help="page of the documentation")
    options = parser.parse_args(arguments)
    for path in options.scores:
        contents = json.loads(path.read_text(encoding="utf-8"))
        if "rates" not in contents:
            hidden = [from_plain(HiddenOutcome, one, str(path)) for one in contents["cases"]]
            put_between_marks(options.page, "docs.make.practice hidden.json", hidden_text(hidden, contents["seed"]))
            continue
        request, found = from_plain(Request, contents, str(path)), from_plain(Summary, contents, str(path))
        put_section(options.page, request, tables(request, found))


if __name__ == "__main__":
    main()
