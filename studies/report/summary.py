"""The verdicts that open the report: what was asked, what was found, and the command that makes it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from studies.report.templates import significant

State = Literal["holds", "look", "note"]


@dataclass(frozen=True)
class Verdict:
    """One line of the summary. ``section`` is the heading's id; ``value`` carries its unit."""

    state: State
    title: str
    value: str
    words: str
    section: str
    command: str


@dataclass(frozen=True)
class Bound:
    """What the paper gives, and how near the default rig has to come: the claims of the README."""

    value: float
    within: float


PAPER_WIDTH_DEG = {10.0: Bound(3.52, 0.2), 20.0: Bound(2.21, 0.15)}
PAPER_FULL_SCALE_DEG = Bound(45.0, 1.0)
MODELS_AGREE_DEG = 0.05
TWINS_AGREE_DEG = 0.01
ENERGY_PERCENT = 0.2
OVER_NOISE = 1.5
"""Times the noise floor: a held-out error above it has structure that the model does not explain."""


def run_verdicts(run: Mapping[str, Any], fits: Sequence[Mapping[str, Any]], command: str) -> list[Verdict]:
    """Verdicts of a main run: bending, loops, strain, agreement of the models, energy, the layer."""
    loops, checks = run["loops"], run["crosscheck"]
    return [
        _full_scale(loops[-1], checks[-1], command),
        _widths(loops, checks, command),
        _strain(loops[-1], checks[-1], command),
        _agreement(checks, command),
        _energy(loops, command),
        *([_layer(fits, command)] if fits else []),
    ]


def _state(good: bool) -> State:
    return "holds" if good else "look"


def _full_scale(loop: Mapping[str, Any], check: Mapping[str, Any], command: str) -> Verdict:
    found, paper = loop["full_scale_deg"], PAPER_FULL_SCALE_DEG
    words = f"at {check['amplitude_mm']:g} mm and {check['preload_N']:g} N; the paper states {paper.value:g} deg"
    good = abs(found - paper.value) <= paper.within
    return Verdict(_state(good), "Bending", f"{significant(found)} deg", words, "loops", command)


def _widths(loops: Sequence[Mapping[str, Any]], checks: Sequence[Mapping[str, Any]], command: str) -> Verdict:
    good, paper = True, []
    for loop, check in zip(loops, checks, strict=True):
        bound = PAPER_WIDTH_DEG.get(check["preload_N"])
        if bound is not None:
            good &= abs(loop["loop_width_deg"] - bound.value) <= bound.within
            paper.append(f"{bound.value:g} deg")
    preloads = " and ".join(f"{check['preload_N']:g} N" for check in checks)
    values = " / ".join(significant(loop["loop_width_deg"]) for loop in loops)
    words = f"at {preloads}" + (f"; the paper measured {' and '.join(paper)}" if paper else "")
    return Verdict(_state(good), "Loop width", f"{values} deg", words, "loops", command)


def _strain(loop: Mapping[str, Any], check: Mapping[str, Any], command: str) -> Verdict:
    passed = [row for row in loop["strain_limits"] if row["passed_at_mm"] is not None]
    where = [
        f"{row['name']}, {significant(row['limit_percent'], 2)} %, from {row['passed_at_mm']:.2f} mm on"
        for row in passed
    ]
    words = f"at {check['preload_N']:g} N; " + (f"limits passed: {'; '.join(where)}" if where else "within all limits")
    value = f"{significant(loop['peak_strain_percent'])} %"
    return Verdict(_state(not passed), "Peak strain", value, words, "rig", command)


def _agreement(checks: Sequence[Mapping[str, Any]], command: str) -> Verdict:
    ideal = max(check["frictionless_max_deg"] for check in checks)
    twin = max(check["chain_max_deg"] for check in checks)
    words = (
        f"at most between analytic and multibody model without friction (bound {MODELS_AGREE_DEG:g}); chain against "
        f"multibody with friction {significant(twin, 2)} deg (bound {TWINS_AGREE_DEG:g})"
    )
    good = ideal <= MODELS_AGREE_DEG and twin <= TWINS_AGREE_DEG
    return Verdict(_state(good), "Models agree", f"{significant(ideal, 2)} deg", words, "crosschecks", command)


def _energy(loops: Sequence[Mapping[str, Any]], command: str) -> Verdict:
    gap = max(abs(loop["energy_gap_percent"]) for loop in loops)
    words = f"of the wheel's work is missing from the losses of a cycle (bound {ENERGY_PERCENT:g} %)"
    return Verdict(_state(gap <= ENERGY_PERCENT), "Energy closes", f"{significant(gap, 2)} %", words, "loops", command)


def _layer(fits: Sequence[Mapping[str, Any]], command: str) -> Verdict:
    """Judge the shipped record with its rig, which stands for a user's own, or the last fit."""
    item = next((item for item in fits if item["name"] == item["record"] and "bench" in item["name"]), fits[-1])
    before, after = item["fit"]["baseline"]["heldout"]["rmse_deg"], item["fit"]["heldout"]["rmse_deg"]
    over = item["over_floor"]
    rest = f"; {significant(over, 2)} times the noise: something is left to explain" if _over_noise(over) else ""
    words = f"held-out RMSE on {item['record']}, kinematics alone and with the Bouc-Wen layer{rest}"
    value = f"{significant(before)} → {significant(after)} deg"
    return Verdict(_state(not rest), "Hysteresis layer", value, words, "layer", command)


def _over_noise(over: float | None) -> bool:
    return over is not None and over > OVER_NOISE


def separation_verdict(result: Mapping[str, Any], label: str, command: str) -> Verdict:
    """Say which part makes most of the loop."""
    parts = result["contributions"]
    shared = {name: row["width_share"] for name, row in parts.items() if row["width_share"] is not None}
    if not shared:
        return Verdict("note", "What makes the loop", "no loop", label, "contributions", command)
    most = max(shared, key=lambda name: shared[name])
    rest = ", ".join(f"{name.replace('_', ' ')} {100 * v:.0f} %" for name, v in shared.items() if name != most)
    closes = abs(result["energy"]["closure_percent"]) <= 1.0
    value = f"{most.replace('_', ' ')} {100 * shared[most]:.0f} %"
    return Verdict(
        "note" if closes else "look",
        "What makes the loop",
        value,
        f"of its width at {label}; {rest}",
        "contributions",
        command,
    )


TRACE_WORDS = {
    "none": "nothing is left above the noise",
    "effect": "the rest is named",
    "ambiguous": "more than one effect explains the rest alike",
    "unexplained": "structure is left that no candidate explains",
}


def trace_verdict(result: Mapping[str, Any], command: str) -> Verdict:
    """Say what the residual was traced to."""
    names = " + ".join(effect["name"].replace("_", " ") for effect in result.get("effects", ()))
    before, after = (_rmse(result.get(key)) for key in ("before", "after"))
    words = TRACE_WORDS.get(result["verdict"], str(result["verdict"]))
    if before is not None and after is not None:
        words += f"; held-out RMSE {significant(before)} → {significant(after)} deg"
    state: State = "holds" if result["verdict"] in ("none", "effect") else "look"
    return Verdict(state, "Residual", names or str(result["verdict"]), words, "trace", command)


def _rmse(errors: Mapping[str, Any] | None) -> float | None:
    held = (errors or {}).get("heldout")
    return held["rmse_deg"] if isinstance(held, Mapping) else None


def study_verdict(size: str, cases: int, failed: int, pending: int, command: str) -> Verdict:
    """Say how far a study went."""
    said = [f"{failed} failed, for the reasons below"] * (failed > 0) + [f"{pending} not run yet"] * (pending > 0)
    words = f"{size}; {', '.join(said) or 'all with a result'}"
    return Verdict(_state(not said), "Study", f"{cases} cases", words, "study", command)


def front_verdict(designs: int, objectives: Sequence[str], command: str) -> Verdict:
    """Say how many designs stand on the front."""
    words = "that no other beats in " + ", ".join(objectives)
    return Verdict("note", "Pareto front", f"{designs} designs", words, "pareto", command)
