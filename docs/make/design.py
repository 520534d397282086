"""Writes the tables of ``docs/validation/design.md``: ``python -m docs.make.design`` (half an hour of a core)."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from docs.make.pages import DOCS, put_after_heading, table
from fem_models.joint import joint_row
from fem_models.joint.section import section
from fem_models.multibody import solve_multibody
from fem_models.rig.rig import notched_tube
from hysteresis.arrays import Floats
from hysteresis.files import write_files
from studies.design.design_file import DesignFile, read_design
from studies.design.evaluation import Evaluated, Task, evaluate
from studies.design.influence import influences
from studies.design.measure import SolverBender, Use, measure
from studies.design.quantities import QUANTITIES
from studies.design.reliability import Drawn, draw, margins_of, share, tightened
from studies.design.requirement import Requirement, Requirements
from studies.design.run import run_design
from studies.design.search import Search, search
from studies.design.space import Candidate
from studies.design.stock import TUBES, WIRES
from studies.design.subset import SubsetSize, small_probability
from studies.design.tolerance import Tolerance, Tolerances, normal_draws
from studies.design.workers import Crew, crew
from studies.results.design import Probability
from studies.results.study import Goal

PAGE = DOCS / "validation" / "design.md"
HEADING = "## Tables"
FILES = DOCS / "validation" / "design"
EXAMPLE = DOCS / "guide" / "require.toml"
DRAWS, CHECKED = 10_000, 20
BRUTE = 60_000
SPREAD = 4096
OTHER: Mapping[Goal, Goal] = {"min": "max", "max": "min"}
_TUBES = {(one.outer_mm, one.inner_mm): one for one in TUBES}


@dataclass(frozen=True)
class Published:
    """A published tube: its file of requirements, what it is made of, and where that is from."""

    file: str
    words: str
    candidate: Candidate


def published() -> tuple[Published, ...]:
    """Give the published tubes."""
    york = Candidate(_TUBES[1.16, 0.86], WIRES[0], 5, 0.979, 0.508, 0.51, 0.0)
    narrow, wide = (Candidate(_TUBES[1.62, 1.40], WIRES[2], 5, 1.40, *cut, 0.0) for cut in ((0.5, 1.5), (0.8, 1.2)))
    return (
        Published("york2015", "York 2015, 144 deg at 4.2 N", york),
        Published("york2015-model", "York 2015, 110 deg at 4.2 N", york),
        Published("middle-ear", "middle ear, 95.4 deg, radius 3 mm", middle_ear()),
        Published("notched-wrist-90", "wrist '90', 93 deg at 1.73 N", narrow),
        Published("notched-wrist-150", "wrist '150', 150 deg at 2.06 N", wide),
    )


def middle_ear() -> Candidate:
    """Give the endoscope of comet-lab/SPIE-2021: nine slots 0.85 of the diameter deep, closed at 5 mm over 3 mm.

    The width of a slot is that closing angle times the distance of the outer surface from the neutral axis.
    """
    tube, count, length, bend = _TUBES[1.10, 0.90], 9, 5.0, 5.0 / 3.0
    first = Candidate(tube, WIRES[0], count, 0.85 * tube.outer_mm, 0.19, 0.36, 0.0)
    rig = read_design(FILES / "middle-ear.toml").space.rig(first)
    offset = float(section(notched_tube(rig), 0.0).neutral_offset_mm)
    width = bend * (tube.outer_mm / 2 + offset) / count
    return replace(first, width_mm=width, spacing_mm=length / count - width)


def task_of(design: DesignFile) -> Task:
    """Give what every tube of a design file is asked."""
    return Task(design.space, design.requirements, design.use, design.tolerances)


def wrist_row(one: Published, team: Crew) -> list[str]:
    """Search for a published tube from its requirements, and say where it lies among those that were found.

    The set of its tube are all tubes of that stock size that meet the requirements: of the search, and of two more of
    this size alone, which trade in opposite directions and start from :data:`SPREAD` tubes over the whole space.
    """
    design = read_design(FILES / f"{one.file}.toml")
    task, size = task_of(design), design.size
    judged = evaluate(task, one.candidate)
    found = search(task, Search(size.population, size.generations, design.seed, design.trade, size.explore), team)
    own = replace(task, space=replace(task.space, tubes=(one.candidate.tube,)))
    turned = tuple((name, OTHER[goal]) for name, goal in design.trade)
    wide = [
        search(own, Search(size.population, size.generations, design.seed, trade, SPREAD), team)
        for trade in (design.trade, turned)
    ]
    same = [t for part in (found, *wide) for t in part.feasible if t.candidate.tube == one.candidate.tube]
    missed = ", ".join(f"{name} by {100 * by:.0f} %" for name, by in judged.shortfalls.items()) or "nothing"
    joints = joint_row(task.space.rig(one.candidate))
    closed = np.degrees(joints.of("closure_angle_rad")).sum()
    return [
        one.words,
        f"{len(found.feasible)} of {len(found.tried)}",
        f"{missed}; all slots closed are {closed:.1f} deg",
        f"{len(same)}",
        _inside(one.candidate, same),
        _near(one.candidate, same),
        _better(judged, found.feasible, design.trade),
    ]


def _inside(candidate: Candidate, found: list[Evaluated]) -> str:
    if not found:
        return "no set"
    outside = []
    for name in ("notch.count", "notch.depth_mm", "notch.width_mm", "notch.spacing_mm"):
        values = [one.candidate.values()[name] for one in found]
        value = candidate.values()[name]
        if not min(values) <= value <= max(values):
            outside.append(f"{name.partition('.')[2]} {value:.3g} outside {min(values):g} to {max(values):g}")
    return "; ".join(outside) or "yes"


def _near(candidate: Candidate, found: list[Evaluated]) -> str:
    """Describe the found tube that is nearest by count, depth, width and pitch, each over its own size."""
    if not found:
        return "none"
    own = _sizes(candidate)
    nearest = min(found, key=lambda one: float(np.abs(np.log(_sizes(one.candidate) / own)).max()))
    off = float(np.abs(_sizes(nearest.candidate) / own - 1).max())
    return f"{_dimensions(nearest.candidate)} ({100 * off:.0f} % off at most)"


def _sizes(one: Candidate) -> Floats:
    return np.array([one.count, one.depth_mm, one.width_mm, one.width_mm + one.spacing_mm])


def _dimensions(one: Candidate) -> str:
    return f"{one.count} x {one.width_mm:.3g} mm, depth {one.depth_mm:.3f}, spacing {one.spacing_mm:.3g}"


def _better(judged: Evaluated, found: Sequence[Evaluated], trade: Sequence[tuple[str, Goal]]) -> str:
    """Count found tubes that are at least as good in all that is traded, and give the one with the least tension."""
    if judged.shortfalls:
        return "-"

    def cost(one: Evaluated) -> Floats:
        return np.array([one.measured.of(name) * (1 if goal == "min" else -1) for name, goal in trade])

    better = [one for one in found if (cost(one) <= cost(judged)).all()]
    if not better:
        return "none"
    least = min(better, key=lambda one: one.measured.tension_N)
    tube = f"{least.candidate.tube.outer_mm:g}/{least.candidate.tube.inner_mm:g}"
    return f"{len(better)}, such as {tube}, {_dimensions(least.candidate)}: {least.measured.tension_N:.2g} N"


@dataclass(frozen=True)
class Robust:
    """A design at a high P(met): 10,000 tubes by the chain, 20 of them by the multibody model, too."""

    words: str
    each: Mapping[str, Probability]
    all: Probability
    agree: int
    largest: Mapping[str, float]


def robust(out: Path, team: Crew, workers: int) -> Robust:
    """Take the first robust design of the example, and check it by both engines."""
    design = read_design(EXAMPLE)
    summary = run_design(design, out, workers=workers)
    first = next(one for one in summary.designs if one.kind == "robust")
    values = first.values
    candidate = Candidate(
        _TUBES[values["tube.outer_diameter_mm"], values["tube.inner_diameter_mm"]],
        next(wire for wire in WIRES if wire.diameter_mm == values["wire_mm"]),
        int(values["notch.count"]),
        values["notch.depth_mm"],
        values["notch.width_mm"],
        values["notch.spacing_mm"],
        values["preload_N"],
    )
    task = task_of(design)
    drawn = draw(task, candidate, DRAWS, design.seed + 1, team)
    return by_both(task, candidate, drawn, team)


def by_both(task: Task, candidate: Candidate, drawn: Drawn, team: Crew) -> Robust:
    """Judge the first draws by the multibody model, too; ``largest`` are relative differences of the quantities."""
    rows = team.each(partial(pair, task, candidate), list(drawn.z[:CHECKED]))
    largest = dict[str, float]()
    for row in rows:
        for name, (chain, bodies) in row.items():
            off = abs(bodies - chain) / abs(chain) if chain else 0.0
            largest[name] = max(largest.get(name, 0.0), off)
    agree = sum(
        all((need.margin(row[need.quantity][0]) >= 0) == (need.margin(row[need.quantity][1]) >= 0)
            for need in task.requirements.each if need.quantity in row)
        for row in rows
    )  # fmt: skip
    names = task.requirements.names
    words = f"{candidate.tube.outer_mm:g}/{candidate.tube.inner_mm:g} mm, wire {candidate.wire.diameter_mm:g}, "
    return Robust(
        words + _dimensions(candidate), dict(zip(names, drawn.each(), strict=True)), drawn.all(), agree, largest
    )


def pair(task: Task, candidate: Candidate, z: np.ndarray) -> dict[str, tuple[float, float]]:
    """Give the required quantities of a drawn tube by the chain and by the multibody model."""
    rig = task.tolerances.drawn(task.space.rig(candidate), z)
    wire = task.space.wire(candidate)
    chain = measure(rig, wire, task.use)
    bodies = measure(rig, wire, task.use, lambda one: SolverBender(one, solve_multibody))
    return {name: (chain.of(name), bodies.of(name)) for name in task.requirements.names}


SMALL = Tolerances(
    (
        Tolerance("depth_mm", "normal", 0.003, percent=False),
        Tolerance("plateau_MPa", "uniform", 8.0, percent=True),
        Tolerance("capstan_coefficient", "lognormal", 15.0, percent=True),
    )
)
"""Tolerances of the case of a small probability: York's tube, cut and known well."""
SMALL_BEND_DEG = 90.0


def small(most_N: float, team: Crew) -> tuple[Probability, Probability]:
    """P(York's tube needs more than a tension at 90 deg): by subset simulation, and by as many draws as it takes."""
    task, candidate = small_case(most_N)

    def limit_state(z: np.ndarray) -> np.ndarray:
        return margins_of(task, candidate, z, team)[:, 1]

    found = small_probability(limit_state, len(SMALL.each), 0, SubsetSize(400, 8))
    z = normal_draws(SMALL, BRUTE, 1)
    return found, share(limit_state(z) < 0)


def small_case(most_N: float) -> tuple[Task, Candidate]:
    """Give York's tube with a bound of the tension at 90 deg."""
    design = read_design(FILES / "york2015-model.toml")
    bounds = Requirements((Requirement("bend_deg", SMALL_BEND_DEG, None), Requirement("tension_N", None, most_N)))
    use = Use(SMALL_BEND_DEG, np.inf, np.inf, frozenset())
    return Task(design.space, bounds, use, SMALL), published()[0].candidate


def depth_rows(team: Crew) -> tuple[list[list[str]], list[list[str]]]:
    """Say what a depth off by 0.02 mm does to York's wrist: its influence beside the other tolerances."""
    design = read_design(FILES / "york2015-model.toml")
    tolerances = Tolerances(
        (
            Tolerance("depth_mm", "normal", 0.02, percent=False),
            Tolerance("width_mm", "normal", 0.01, percent=False),
            Tolerance("wall_mm", "uniform", 0.01, percent=False),
            Tolerance("youngs_modulus_GPa", "uniform", 11.0, percent=True),
            Tolerance("plateau_MPa", "uniform", 9.0, percent=True),
            Tolerance("capstan_coefficient", "lognormal", 20.0, percent=True),
        )
    )
    task = Task(design.space, design.requirements, design.use, tolerances)
    candidate = published()[0].candidate
    told = [
        [one.tolerance, f"{one.change:+.3g} {one.unit}", f"{one.first:.2f}", f"{one.total:.2f}"]
        for one in influences(task, candidate, 0, team)
        if one.quantity == "bend_deg"
    ]
    z = normal_draws(tolerances, 500, 0)
    now = share(margins_of(task, candidate, z, team).min(axis=1) >= 0)
    better = [["none", _chance(now)]]
    better += [[name, _chance(p)] for name, p in tightened(task, candidate, z, team)]
    return told, better


def _chance(p: Probability) -> str:
    return f"{p.value:.3f} ({p.low:.3f} to {p.high:.3f})"


def robust_tables(found: Robust) -> list[tuple[str, str]]:
    """Format the check of a robust design."""
    rows = [
        [name, f"{p.value:.4f} ({p.low:.4f} to {p.high:.4f})", f"{100 * found.largest.get(name, 0.0):.2g} %"]
        for name, p in {**found.each, "all": found.all}.items()
    ]
    return [
        (
            f"Robust design of the example ({found.words}): P(met) by {DRAWS:,} tubes in the chain, and the largest "
            f"difference of both engines in {CHECKED} of them; verdicts agree in {found.agree} of {CHECKED}",
            table(["requirement", "P(met), 95 %", "multibody less chain, at most"], rows),
        )
    ]


WRIST_HEAD = [
    "requirement", "tubes that meet it", "the published tube misses", "set of its tube", "published within it",
    "nearest in it", "better in all that is traded",
]  # fmt: skip
SMALL_N = 4.5
"""Bound of the tension of the small case, N."""


def small_table(subset: Probability, brute: Probability) -> tuple[str, str]:
    """Format the case of a small probability."""
    rows = [[p.method, f"{p.draws:,}", f"{p.value:.2e}", f"{p.low:.2e} to {p.high:.2e}"] for p in (subset, brute)]
    title = f"P(York's tube needs more than {SMALL_N:g} N at {SMALL_BEND_DEG:g} deg)"
    return title, table(["method", "tubes", "P", "95 %"], rows)


def main(out: Path = Path("results/design-example"), workers: int = 2) -> None:
    """Compute everything, and write the tables; what an ended run has computed is taken from its files in ``out``."""
    with crew(workers) as team:
        wrists = [_kept(out, one.file, partial(wrist_row, one, team)) for one in published()]
        checked = _kept(out, "robust", lambda: robust_tables(robust(out, team, workers)))
        rare = _kept(out, "small", lambda: small_table(*small(SMALL_N, team)))
        told, better = _kept(out, "depth", lambda: depth_rows(team))
    write(wrists, checked, rare, told, better)


def _kept(out: Path, name: str, work: Callable[[], Any]) -> Any:
    """Give a part of the tables, texts, computed or as it is stored."""
    path = out / f"part-{name}.json"
    if not path.is_file():
        write_files({path: json.dumps(work())})
    return json.loads(path.read_text(encoding="utf-8"))


def write(
    wrists: list[list[str]],
    checked: list[tuple[str, str]],
    rare: tuple[str, str],
    told: list[list[str]],
    better: list[list[str]],
) -> None:
    """Put the tables into the page."""
    depth = f"What tolerances do to the bend of York's wrist at 4.2 N ({QUANTITIES['bend_deg'].long_name})"
    parts = [
        ("Published tubes from their requirements", table(WRIST_HEAD, wrists)),
        *checked,
        rare,
        (depth, table(["tolerance", "+1 sd less -1 sd", "first-order index", "total index"], told)),
        ("P(110 deg at 4.2 N and the rest met) with a tolerance half as wide", table(["halved", "P(all met)"], better)),
    ]
    put_after_heading(PAGE, HEADING, "\n\n".join(f"### {title}\n\n{text}" for title, text in parts))


if __name__ == "__main__":
    main()
