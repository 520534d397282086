"""``design.json`` for the page: tubes that meet a requirement, the verdict on each, and what to tighten."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.files import present
from studies.report.charts import Chart, Line, Plate
from studies.report.plots import Drawn, draw
from studies.report.summary import State, Verdict
from studies.results import read_result
from studies.results.design import DesignSummary, FoundDesign
from studies.units import label_of, words_of

FILE = "design.json"
WHAT = "the result of `notchbend design`"


@dataclass(frozen=True)
class DesignSection:
    """Tubes for a requirement.

    ``chosen`` is the design that the page judges: the first robust one, else the first; None where there is none.
    ``plate`` shows the trade, None with fewer than two designs or quantities.
    """

    result: DesignSummary
    chosen: FoundDesign | None
    plate: Drawn | None
    command: str


def read_designed(folder: Path) -> DesignSection | None:
    """Read ``design.json``; None if there is no such file.

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    path = folder / FILE
    if not present(path):
        return None
    found = read_result(DesignSummary, path, WHAT)
    command = "notchbend design REQUIRE.toml --out DIR" if found.made is None else found.made.command
    return DesignSection(found, found.chosen, _plate(found), command)


def _plate(found: DesignSummary) -> Drawn | None:
    """Draw the designs over the first two quantities that are traded."""
    names = list(found.trade)[:2]
    if len(names) < 2 or len(found.designs) < 2:
        return None
    lines = []
    for kind, tone in (("nominal", "orange"), ("robust", "green")):
        rows = [one for one in found.designs if one.kind == kind]
        x, y = ([one.quantities.get(name, float("nan")) for one in rows] for name in names)
        if rows:
            lines.append(Line(np.array(x), np.array(y), kind, tone, "dots"))  # type: ignore[arg-type]
    alt = f"{len(found.designs)} designs over {words_of(names[0])} and {words_of(names[1])}."
    chart = Chart("Designs", label_of(names[0]), label_of(names[1]), tuple(lines), alt)
    return draw(Plate((chart,), f"{alt} Robust ones meet the requirements as surely as was asked.", columns=1))


def designed_verdicts(section: DesignSection, *, alone: bool = True) -> list[Verdict]:
    """Give how many tubes meet the requirements, and, ``alone``, without a first page, each one of the chosen tube."""
    r, one, command = section.result, section.chosen, section.command
    state: State = "holds" if r.feasible and not r.warnings else "look"
    words = "; ".join(r.warnings) or "meet all requirements with their nominal numbers"
    out = [Verdict(state, "Tubes", f"{r.feasible} of {r.tried}", words, "designs", command)]
    for row in one.verdicts if one is not None and alone else ():
        bounds = " and ".join(
            f"{side} {bound:g} {_unit(row.unit)}".rstrip()
            for side, bound in (("at least", row.low), ("at most", row.high))
            if bound is not None
        )
        chance = "" if row.p_met is None else f"; P(met) {row.p_met.value:.3f}, asked {row.confidence:g}"
        good: State = "holds" if row.decision == "met" else "look"
        value = f"{row.value:.4g} {_unit(row.unit)}".rstrip()
        out.append(
            Verdict(good, words_of(row.quantity), value, f"{row.decision}: {bounds}{chance}", "designs", command)
        )
    return out


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit
