"""The verdicts that open the report: what was tested, what was found, and the command that makes it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from studies.report.templates import significant
from studies.results.fit import StoredFit
from studies.results.run import CrossCheckRow, RunLoop, RunSummary
from studies.results.separation import Separation
from studies.results.trace import FoldErrors, StoredTrace

State = Literal["holds", "look", "note"]


@dataclass(frozen=True)
class Verdict:
    """One line of the summary. ``section`` is the id of the heading; ``value`` includes its unit."""

    state: State
    title: str
    value: str
    words: str
    section: str
    command: str


@dataclass(frozen=True)
class Bound:
    """A value of the paper, and how near the default rig has to come: the claims of the README."""

    value: float
    within: float


@dataclass(frozen=True)
class FitResult:
    """A fit of a main run; ``over_floor`` is its held-out error over the noise floor, None without noise."""

    name: str
    record: str
    fit: StoredFit
    over_floor: float | None


PAPER_WIDTH_DEG = {10.0: Bound(3.52, 0.2), 20.0: Bound(2.21, 0.15)}
PAPER_FULL_SCALE_DEG = Bound(45.0, 1.0)
MODELS_AGREE_DEG = 0.05
CHAIN_AGREES_DEG = 0.01
ENERGY_PERCENT = 0.2
OVER_NOISE = 1.5
"""Factor over the noise floor from which on the held-out residual has structure that the model does not explain."""


def run_verdicts(run: RunSummary, fits: Sequence[FitResult], command: str) -> list[Verdict]:
    """Give the verdicts of a main run: bending, loops, strain, agreement of the models, energy, hysteresis layer."""
    loops, checks = run.loops, run.crosscheck
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


def _full_scale(loop: RunLoop, check: CrossCheckRow, command: str) -> Verdict:
    found, paper = loop.full_scale_deg, PAPER_FULL_SCALE_DEG
    words = f"at {check.amplitude_mm:g} mm and {check.preload_N:g} N; the paper states {paper.value:g} deg"
    good = abs(found - paper.value) <= paper.within
    return Verdict(_state(good), "Bending", f"{significant(found)} deg", words, "loops", command)


def _widths(loops: Sequence[RunLoop], checks: Sequence[CrossCheckRow], command: str) -> Verdict:
    good, paper = True, []
    for loop, check in zip(loops, checks, strict=True):
        bound = PAPER_WIDTH_DEG.get(check.preload_N)
        if bound is not None:
            good &= abs(loop.loop_width_deg - bound.value) <= bound.within
            paper.append(f"{bound.value:g} deg")
    preloads = " and ".join(f"{check.preload_N:g} N" for check in checks)
    values = " / ".join(significant(loop.loop_width_deg) for loop in loops)
    words = f"at {preloads}" + (f"; the paper measured {' and '.join(paper)}" if paper else "")
    return Verdict(_state(good), "Loop width", f"{values} deg", words, "loops", command)


def _strain(loop: RunLoop, check: CrossCheckRow, command: str) -> Verdict:
    exceeded = [
        f"{row.name}, {significant(row.limit_percent, 2)} %, from {row.passed_at_mm:.2f} mm on"
        for row in loop.strain_limits
        if row.passed_at_mm is not None
    ]
    limits = f"limits exceeded: {'; '.join(exceeded)}" if exceeded else "within all limits"
    value = f"{significant(loop.peak_strain_percent)} %"
    return Verdict(_state(not exceeded), "Peak strain", value, f"at {check.preload_N:g} N; {limits}", "rig", command)


def _agreement(checks: Sequence[CrossCheckRow], command: str) -> Verdict:
    frictionless = max(check.frictionless_max_deg for check in checks)
    chain = max(check.chain_max_deg for check in checks)
    words = (
        f"largest difference of analytic and multibody model without friction (bound {MODELS_AGREE_DEG:g}); of chain "
        f"and multibody model with friction {significant(chain, 2)} deg (bound {CHAIN_AGREES_DEG:g})"
    )
    good = frictionless <= MODELS_AGREE_DEG and chain <= CHAIN_AGREES_DEG
    return Verdict(_state(good), "Models agree", f"{significant(frictionless, 2)} deg", words, "crosschecks", command)


def _energy(loops: Sequence[RunLoop], command: str) -> Verdict:
    gap = max(abs(loop.energy_gap_percent) for loop in loops)
    words = f"difference between the work of the wheel and the losses of a cycle (bound {ENERGY_PERCENT:g} %)"
    title = "Energy balance"
    return Verdict(_state(gap <= ENERGY_PERCENT), title, f"{significant(gap, 2)} %", words, "loops", command)


def _layer(fits: Sequence[FitResult], command: str) -> Verdict:
    """Judge the fit of the shipped record with its rig, as an example of a user's own record; else the last fit."""
    item = next((item for item in fits if item.name == item.record and "bench" in item.name), fits[-1])
    before, after = item.fit.baseline.heldout.rmse_deg, item.fit.heldout.rmse_deg
    over = item.over_floor
    structured = over is not None and over > OVER_NOISE
    rest = f"; {significant(over, 2)} times the noise: the residual has structure" if structured else ""
    words = f"held-out RMSE on {item.record}, kinematics alone and with the Bouc-Wen layer{rest}"
    value = f"{significant(before)} → {significant(after)} deg"
    return Verdict(_state(not structured), "Hysteresis layer", value, words, "layer", command)


def separation_verdict(result: Separation, label: str, command: str) -> Verdict:
    """Name the part that contributes most to the width of the loop."""
    title, section = "Contributions to the loop", "contributions"
    shares = {name: row.width_share for name, row in result.contributions.items() if row.width_share is not None}
    if not shares:
        return Verdict("note", title, "no loop", label, section, command)
    most = max(shares, key=lambda name: shares[name])
    rest = ", ".join(f"{name.replace('_', ' ')} {100 * v:.0f} %" for name, v in shares.items() if name != most)
    state: State = "note" if abs(result.energy.closure_percent) <= 1.0 else "look"
    value = f"{most.replace('_', ' ')} {100 * shares[most]:.0f} %"
    return Verdict(state, title, value, f"of the width at {label}; {rest}", section, command)


TRACE_WORDS: Mapping[str, str] = {
    "none": "the residual is noise",
    "effect": "the residual is traced to an effect",
    "partial": "the residual is traced to an effect; some structure remains",
    "ambiguous": "several effects explain the residual equally well",
    "unexplained": "the residual has structure that no candidate explains",
}


def trace_verdict(result: StoredTrace, command: str) -> Verdict:
    """Give the effects that the residual was traced to."""
    names = " + ".join(effect.name.replace("_", " ") for effect in result.effects)
    before, after = _rmse(result.before), _rmse(result.after)
    words = TRACE_WORDS.get(result.verdict, result.verdict)
    if before is not None and after is not None:
        words += f"; held-out RMSE {significant(before)} → {significant(after)} deg"
    state: State = "holds" if result.verdict in ("none", "effect") else "look"
    return Verdict(state, "Residual", names or result.verdict, words, "trace", command)


def _rmse(errors: FoldErrors) -> float | None:
    return None if errors.heldout is None else errors.heldout.rmse_deg


def study_verdict(size: str, cases: int, failed: int, pending: int, command: str) -> Verdict:
    """Give the number of cases with a result."""
    problems = [f"{failed} failed, for the reasons below"] * (failed > 0) + [f"{pending} not run yet"] * (pending > 0)
    words = f"{size}; {', '.join(problems) or 'all with a result'}"
    return Verdict(_state(not problems), "Study", f"{cases} cases", words, "study", command)


def front_verdict(designs: int, objectives: Sequence[str], command: str) -> Verdict:
    """Give the number of designs on the Pareto front."""
    words = "not dominated in " + ", ".join(objectives)
    return Verdict("note", "Pareto front", f"{designs} designs", words, "pareto", command)
