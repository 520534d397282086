"""The work of ``notchbend design``: search, robust search, P(met) of what is shown, and the files."""

from __future__ import annotations

import csv
import io
import json
import math
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.special import ndtri

from hysteresis.arrays import Floats
from hysteresis.files import write_files
from hysteresis.own import MAKER, marked_values
from hysteresis.plain import to_plain
from hysteresis.records.record_file import files_of_record, write_record
from hysteresis.records.sidecar import toml
from studies.design.design_file import DesignFile
from studies.design.evaluation import CANNOT, Evaluated, Task, evaluate
from studies.design.first_page import LOOP, FirstPage, first_page
from studies.design.influence import influences
from studies.design.quantities import QUANTITIES
from studies.design.reliability import Drawn, draw, tightened
from studies.design.requirement import verdicts
from studies.design.search import Found, Progress, Search, best, search
from studies.design.space import Candidate
from studies.design.workers import Crew, crew
from studies.results.design import DesignSummary, FoundDesign, Tightened
from studies.results.made import Made
from studies.results.page_one import DRAWING
from studies.results.page_one import FILE as PAGE_ONE

DESIGN, TABLE, RIGS = "design.json", "designs.csv", "rigs"
SAFETY = (0.3, 0.8, 1.5)
"""Added to the reliability that is asked for, in standard deviations, in turn until drawn tubes confirm it: it is of
first order."""
START = 16
"""Tubes of the nominal search that the robust one starts from: those with the most margin."""
ROBUST_SHARE = 2
"""Population of the nominal search over that of the robust one, whose tubes cost more."""
TIGHTEN_DRAWS = 300
"""Most draws of the question what to tighten."""
BOUGHT = ("outer_diameter_mm", "free_lumen_mm")
"""Quantities of stock sizes: no dimension of the cut changes them."""
BOUGHT_ADDS = 1e6


@dataclass(frozen=True)
class _Shown:
    """A tube that is shown, and the draws about it; None without tolerances."""

    name: str
    kind: Literal["nominal", "robust"]
    found: Evaluated
    drawn: Drawn | None


def design_files(out: Path, shown: int) -> list[Path]:
    """Give the files that a design may replace."""
    rigs = [out / RIGS / f"{kind}-{k}.toml" for kind in ("nominal", "robust") for k in range(1, shown + 1)]
    page = [out / PAGE_ONE, out / DRAWING, *files_of_record(out / LOOP)]
    return [out / DESIGN, out / TABLE, out / "report.html", *page, *rigs]


def run_design(
    design: DesignFile, out: Path, *, workers: int, progress: Progress | None = None, made: Made | None = None
) -> DesignSummary:
    """Find tubes, and write ``design.json``, ``designs.csv`` and a rig file for each design that is shown.

    The first page of the report is that of the design that is judged first (``page-one.json``, ``drawing.svg``, and a
    cycle of it, ``records/cycle.csv``).

    Results do not depend on the number of workers. A requirement that nothing meets is a warning, and no error: the
    summary says what refused how many tubes, and has the nearest tube as a design.
    """
    start = time.perf_counter()
    task = Task(design.space, design.requirements, design.use, design.tolerances)
    _warm(task)
    with crew(workers) as team:
        size = design.size
        settings = Search(size.population, size.generations, design.seed, design.trade, size.explore)
        found = search(task, settings, team, (), progress)
        warnings = list[str]()
        shown = _nominal(design, task, found, team, warnings)
        if design.tolerances.each and found.feasible:
            shown += _robust(design, task, found, team, warnings, progress)
        designs = tuple(_described(design, task, one, team) for one in shown)
    summary = _summary(design, found, designs, warnings, made, time.perf_counter() - start)
    candidates = {one.name: one.found.candidate for one in shown}
    chosen = summary.chosen
    page = None if chosen is None else first_page(task, candidates[chosen.name], chosen, design.title)
    _write(design, out, summary, candidates, page)
    return summary


def _warm(task: Task) -> None:
    """Load the compiled kernels before the workers are copied from this process."""
    for share in (0.3, 0.5, 0.7):
        evaluate(task, task.space.candidate(np.full(task.space.size, share)))


def _nominal(design: DesignFile, task: Task, found: Found, team: Crew, warnings: list[str]) -> list[_Shown]:
    chosen: Sequence[Evaluated] = best(found.feasible, design.trade, design.size.shown)
    if not chosen:
        nearest = min(found.tried, key=lambda one: one.missed)
        chosen = (nearest,)
        missed = ", ".join(f"{name} by {100 * by:.3g} %" for name, by in nearest.shortfalls.items())
        warnings.append(f"no tube meets all requirements; the nearest one misses {missed}")
    return [
        _Shown(f"nominal-{k}", "nominal", one, _draws(design, task, one.candidate, team) if one.bent else None)
        for k, one in enumerate(chosen, start=1)
    ]


def _draws(design: DesignFile, task: Task, candidate: Candidate, team: Crew) -> Drawn | None:
    if not design.tolerances.each:
        return None
    return draw(task, candidate, design.size.draws, design.seed, team)


def _robust(
    design: DesignFile, task: Task, found: Found, team: Crew, warnings: list[str], progress: Progress | None
) -> list[_Shown]:
    """Search for tubes that meet each requirement as surely as was asked, and confirm them by drawn tubes."""
    asked = np.array([one.confidence for one in task.requirements.each])
    least = ndtri(asked)
    size = design.size
    settings = Search(
        max(size.population // ROBUST_SHARE, 8), size.robust_generations, design.seed + 1, design.trade,
        start=_most_margin(found, task, size.population // ROBUST_SHARE),
    )  # fmt: skip
    tried = search(task, settings, team, tuple(least + SAFETY[0]), progress).tried
    shown, seen = list[_Shown](), set[Candidate]()
    for more in SAFETY:
        sure = [one for one in tried if one.reliability and np.all(np.array(one.reliability) >= least + more)]
        for one in best(sure, design.trade, size.shown):
            if one.candidate in seen or len(shown) == size.shown:
                continue
            seen.add(one.candidate)
            drawn = _draws(design, task, one.candidate, team)
            assert drawn is not None
            if all(p.value >= need for p, need in zip(drawn.each(), asked.tolist(), strict=True)):
                shown.append(_Shown(f"robust-{len(shown) + 1}", "robust", one, drawn))
    if not shown:
        warnings.append("no tube meets every requirement as surely as was asked: tighten what [tolerance] costs most")
    return shown


def _most_margin(found: Found, task: Task, most: int) -> tuple[Floats, ...]:
    good = [k for k, one in enumerate(found.tried) if not one.shortfalls]
    good.sort(key=lambda k: -task.requirements.least_share(found.tried[k].measured))
    return tuple(found.points[k] for k in good[: min(START, most)])


def _described(design: DesignFile, task: Task, shown: _Shown, team: Crew) -> FoundDesign:
    one, drawn = shown.found, shown.drawn
    p_met = None if drawn is None else drawn.each()
    first = shown.name.endswith("-1")  # what to tighten is asked of the first of each kind alone
    halved: tuple[Tightened, ...] = ()
    if drawn is not None and first:
        rows = tightened(task, one.candidate, drawn.z[:TIGHTEN_DRAWS], team)
        halved = tuple(Tightened(name, p) for name, p in rows)
    return FoundDesign(
        name=shown.name,
        kind=shown.kind,
        values=one.candidate.values(),
        tube_source=one.candidate.tube.source,
        wire_source=one.candidate.wire.source,
        rig=f"{RIGS}/{shown.name}.toml",
        quantities={name: one.measured.of(name) for name in QUANTITIES},
        limited_by=_limited_by(task, shown),
        verdicts=verdicts(task.requirements, one.measured, p_met),
        p_all=None if drawn is None else drawn.all(),
        tightened=halved,
        influences=influences(task, one.candidate, design.seed, team) if drawn is not None and first else (),
    )


def _limited_by(task: Task, shown: _Shown) -> str:
    """Name what limits a tube: what it misses most; else the requirement that is least surely met.

    That is the one with the lowest P(met), then with the least margin in standard deviations, then over its bound; of
    these last only if it is not bought as it is.
    """
    one, needs = shown.found, task.requirements.each
    if one.shortfalls:
        return max(one.shortfalls, key=lambda name: one.shortfalls[name])
    if shown.drawn is not None:
        chances = [p.value for p in shown.drawn.each()]
        if min(chances) < 1:
            return needs[int(np.argmin(chances))].quantity
    if one.reliability and min(one.reliability) < math.inf:
        return needs[int(np.argmin(one.reliability))].quantity
    shares = {
        need.quantity: need.share(one.measured.of(need.quantity)) + BOUGHT_ADDS * (need.quantity in BOUGHT)
        for need in needs
    }
    return min(shares, key=lambda name: shares[name])


def _summary(
    design: DesignFile,
    found: Found,
    designs: tuple[FoundDesign, ...],
    warnings: Sequence[str],
    made: Made | None,
    seconds: float,
) -> DesignSummary:
    refused = Counter(max(one.shortfalls, key=lambda k: one.shortfalls[k]) for one in found.tried if one.shortfalls)
    return DesignSummary(
        title=design.title,
        seed=design.seed,
        trade=dict(design.trade),
        tolerances={one.name: one.words for one in design.tolerances.each},
        tried=len(found.tried),
        simulated=sum(one.bent or CANNOT in one.shortfalls for one in found.tried),
        feasible=len(found.feasible),
        refused=dict(sorted(refused.items())),
        spans=_spans(found.feasible),
        designs=designs,
        warnings=tuple(warnings),
        inputs_sha256={path.name: digest for path, digest in design.inputs.items()},
        seconds=seconds,
        made=made,
    )


def _spans(feasible: Sequence[Evaluated]) -> dict[str, tuple[float, float]]:
    rows = [one.candidate.values() for one in feasible]
    return {name: (min(r[name] for r in rows), max(r[name] for r in rows)) for name in (rows[0] if rows else ())}


def _write(
    design: DesignFile,
    out: Path,
    summary: DesignSummary,
    candidates: Mapping[str, Candidate],
    page: FirstPage | None,
) -> None:
    """Write the files; a page or a cycle of an earlier design does not stay beside them."""
    for path in (out / PAGE_ONE, out / DRAWING, *files_of_record(out / LOOP)):
        path.unlink(missing_ok=True)
    if page is not None and page.loop is not None:
        write_record(page.loop, out / LOOP)
    files: dict[Path, str | bytes] = {
        out / DESIGN: _json(summary),
        out / TABLE: _table(summary.designs),
    }
    if page is not None:
        files |= {out / PAGE_ONE: _json(page.page), out / DRAWING: page.drawing}
    for name, candidate in candidates.items():
        rig = design.space.rig(candidate, name)
        files[out / RIGS / f"{name}.toml"] = f"# made by {MAKER}\n{toml(rig.to_dict())}"
    write_files(files)


def _json(result: object) -> str:
    return json.dumps(marked_values(to_plain(result, finite=False)), indent=2) + "\n"


def _table(designs: Sequence[FoundDesign]) -> str:
    """Give ``designs.csv``: a row a design, its numbers, its quantities, P(all met) and what limits it."""
    text = io.StringIO()
    rows = [
        {
            "design": one.name,
            **one.values,
            **one.quantities,
            "p_all_met": math.nan if one.p_all is None else one.p_all.value,
            "limited_by": one.limited_by,
        }
        for one in designs
    ]
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
