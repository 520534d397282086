"""The verdicts that open the report: what was tested, what was found, and the command that makes it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from studies.report.templates import significant
from studies.results.fit import StoredFit
from studies.results.run import CrossCheckRow, OwnRig, Prediction, RunLoop, RunSummary, StrainLimit
from studies.results.separation import Separation
from studies.results.trace import FoldErrors, StoredTrace

if TYPE_CHECKING:
    from studies.report.parts.feasible import Feasible
    from studies.report.study import StudySection

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
    """A value of the paper, and how near the default rig has to come: the claims of docs/validation/claims.md."""

    value: float
    within: float


@dataclass(frozen=True)
class FitResult:
    """A fit; ``over_floor`` is its held-out error over the noise floor, None without noise."""

    name: str
    record: str
    fit: StoredFit
    over_floor: float | None
    command: str


PAPER_HALF_WIDTH_DEG = {10.0: Bound(3.52, 0.1), 20.0: Bound(2.21, 0.075)}
"""The paper's hysteresis by preload in N, read as half the width of the loop: docs/validation/readings.md."""
PAPER_FULL_SCALE_DEG = Bound(45.0, 1.0)
MODELS_AGREE_DEG = 0.05
CHAIN_AGREES_DEG = 0.01
ENERGY_PERCENT = 0.2
OVER_NOISE = 1.5
"""Factor over the noise floor from which on the held-out residual has structure that the model does not explain."""


LEGEND: Mapping[str, str] = {
    "holds": "within the bound that stands beside it",
    "look": "outside the bound, or something to decide",
    "note": "a finding without a bound",
}
"""What the verdicts mean."""


def run_verdicts(run: RunSummary, fits: Sequence[FitResult], command: str) -> list[Verdict]:
    """Give the verdicts of a main run: bending, loops, strain, agreement of the models, energy, hysteresis layer.

    Bending and loops of the default rig are compared with the paper; of a user's own rig they are findings.
    """
    own = run.own
    paper = [] if own is not None else [_full_scale(run.loops[-1], run.crosscheck[-1], command)]
    return [
        *(paper if own is None else [_own_full_scale(run.loops, own, command)]),
        _widths(run.loops, own, command),
        strain_verdict(run.loops, command),
        *([_agreement(run.crosscheck, command)] if run.crosscheck else []),
        energy_verdict(run.loops, command),
        *(_prediction(one, command) for one in (own.predictions if own is not None else ())),
        *([_layer(fits, command)] if fits and own is None else layer_verdicts(fits)),
    ]


def preload_label(loop: RunLoop) -> str:
    """Name a loop by its preload; by its record where there is none."""
    return f"{loop.preload_N:g} N" if loop.preload_N else loop.record


def _state(good: bool) -> State:
    return "holds" if good else "look"


def _full_scale(loop: RunLoop, check: CrossCheckRow, command: str) -> Verdict:
    found, paper = loop.full_scale_deg, PAPER_FULL_SCALE_DEG
    words = f"at {check.amplitude_mm:g} mm and {check.preload_N:g} N; the paper states {paper.value:g} deg"
    good = abs(found - paper.value) <= paper.within
    return Verdict(_state(good), "Bending", f"{significant(found)} deg", words, "loops", command)


def _own_full_scale(loops: Sequence[RunLoop], own: OwnRig, command: str) -> Verdict:
    """Give the largest angle of a user's own rig, with its range where there is an ensemble."""
    values = " / ".join(significant(loop.full_scale_deg) for loop in loops)
    words = f"at {own.amplitude_mm:g} mm and {_preloads(loops)}{_ranges(own, loops, 'full_scale_deg')}"
    return Verdict("note", "Bending", f"{values} deg", words, "loops", command)


def _preloads(loops: Sequence[RunLoop]) -> str:
    return ", ".join(map(preload_label, loops))


def _ranges(own: OwnRig | None, loops: Sequence[RunLoop], name: str) -> str:
    """Give the ranges of a number over the ensemble; empty without one."""
    found = [own.ranges[loop.record] for loop in loops if own is not None and loop.record in own.ranges]
    limits = [one.ranges[name] for one in found if name in one.ranges]
    if not limits:
        return ""
    words = " / ".join(f"{significant(limit.low)} to {significant(limit.high)}" for limit in limits)
    return f"; {100 * found[0].level:.0f} % of {found[0].members} members of the ensemble: {words}"


def _widths(loops: Sequence[RunLoop], own: OwnRig | None, command: str) -> Verdict:
    good, paper = True, []
    for loop in loops if own is None else ():
        bound = PAPER_HALF_WIDTH_DEG.get(loop.preload_N or 0.0)
        if bound is not None:
            good &= abs(loop.loop_width_deg / 2 - bound.value) <= bound.within
            paper.append(f"{bound.value:g} deg")
    values = " / ".join(significant(loop.loop_width_deg) for loop in loops)
    words = f"at {_preloads(loops)}" + (
        f"; the paper measured {' and '.join(paper)}, read as half widths" if paper else ""
    )
    words += _ranges(own, loops, "loop_width_deg")
    state: State = _state(good) if own is None else "note"
    return Verdict(state, "Loop width", f"{values} deg", words, "loops", command)


def strain_verdict(loops: Sequence[RunLoop], command: str) -> Verdict:
    """Judge the loop with the largest strain by the limits of Nitinol."""
    loop = max(loops, key=lambda one: one.peak_strain_percent)
    if not loop.strain_limits:
        return Verdict(
            "note", "Peak strain", "not known", "the section of measured joints is not known", "rig", command
        )
    exceeded = [
        f"{row.name}, {significant(row.limit_percent, 2)} %, {limit_words(loop, row)}"
        for row in loop.strain_limits
        if row.passed_at_mm is not None
    ]
    limits = f"limits exceeded: {'; '.join(exceeded)}" if exceeded else "within all limits"
    value = f"{significant(loop.peak_strain_percent)} %"
    return Verdict(_state(not exceeded), "Peak strain", value, f"at {preload_label(loop)}; {limits}", "rig", command)


def limit_words(loop: RunLoop, row: StrainLimit) -> str:
    """Say where a limit is passed: the amplitude of a cycle for an alternating strain, else the drive from rest."""
    amplitude = loop.fatigue_amplitude_mm
    if row.kind == "alternating" and amplitude is not None:
        return f"in cycles of more than {'±' if loop.both_ways else '0 to '}{amplitude:.2f} mm"
    return "" if row.passed_at_mm is None else f"from {abs(row.passed_at_mm):.2f} mm on"


def _prediction(one: Prediction, command: str) -> Verdict:
    """Judge how well the rig as its file says predicts a record, by the noise of the record."""
    good = one.rmse_deg <= OVER_NOISE * one.noise_floor_deg
    words = f"RMSE of {one.record} from the loop that the rig file predicts, nothing fitted; the record's noise is "
    words += f"{significant(one.noise_floor_deg, 2)} deg (bound {OVER_NOISE:g} times)"
    return Verdict(_state(good), "Rig file", f"{significant(one.rmse_deg)} deg", words, "records", command)


def _agreement(checks: Sequence[CrossCheckRow], command: str) -> Verdict:
    frictionless = max(check.frictionless_max_deg for check in checks)
    chain = max(check.chain_max_deg for check in checks)
    words = (
        f"largest difference of analytic and multibody model without friction (bound {MODELS_AGREE_DEG:g}); of chain "
        f"and multibody model with friction {significant(chain, 2)} deg (bound {CHAIN_AGREES_DEG:g})"
    )
    good = frictionless <= MODELS_AGREE_DEG and chain <= CHAIN_AGREES_DEG
    return Verdict(_state(good), "Models agree", f"{significant(frictionless, 2)} deg", words, "crosschecks", command)


def energy_verdict(loops: Sequence[RunLoop], command: str) -> Verdict:
    """Judge the error of the energy balance over a cycle."""
    gap = max(abs(loop.energy_gap_percent) for loop in loops)
    words = f"difference between the work of the wheel and the losses of a cycle (bound {ENERGY_PERCENT:g} %)"
    title = "Energy balance"
    return Verdict(_state(gap <= ENERGY_PERCENT), title, f"{significant(gap, 2)} %", words, "loops", command)


def _layer(fits: Sequence[FitResult], command: str) -> Verdict:
    """Judge the fit of the shipped record with its rig, as an example of a user's own record; else the last fit."""
    item = next((item for item in fits if item.name == item.record and "bench" in item.name), fits[-1])
    return _layer_of(item, command)


def layer_verdicts(fits: Sequence[FitResult]) -> list[Verdict]:
    """Judge each fit by its held-out error."""
    return [_layer_of(item, item.command) for item in fits]


def _layer_of(item: FitResult, command: str) -> Verdict:
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
    rest = ", ".join(f"{name.replace('_', ' ')} {round(100 * v)} %" for name, v in shares.items() if name != most)
    state: State = "note" if abs(result.energy.closure_percent) <= 1.0 else "look"
    value = f"{most.replace('_', ' ')} {round(100 * shares[most])} %"
    return Verdict(state, title, value, f"of the width at {label}; {rest}", section, command)


def words_of_part(name: str) -> str:
    """Give the words of a part of a loop as the subject of a sentence in the plural."""
    known = {
        "friction": "friction losses",
        "tendon_elasticity": "elastic tendons",
        "material": "material losses",
        "play": "gaps of the drive",
    }
    return known.get(name, f"{name.replace('_', ' ')} effects")


TRACE_WORDS: Mapping[str, str] = {
    "none": "the residual is noise, or too near it for a name",
    "effect": "the residual is traced to an effect",
    "partial": "a part of the residual is traced to an effect; structure remains that no effect explains",
    "ambiguous": "several effects explain the residual equally well",
    "unexplained": "the residual has structure that no candidate explains",
}


def trace_verdict(result: StoredTrace, command: str) -> Verdict:
    """Give the effects that the residual was traced to."""
    names = " + ".join(effect.name.replace("_", " ") for effect in result.effects)
    before, after = _rmse(result.before), _rmse(result.after)
    words = TRACE_WORDS.get(result.verdict, result.verdict)
    if before is not None and after is not None:
        words += f"; held-out RMSE of the baseline model {significant(before)} deg"
        words += f", with the effects {significant(after)} deg" if names else ""
    state: State = "holds" if result.verdict in ("none", "effect") else "look"
    return Verdict(state, "Residual", names or result.verdict, words, "trace", command)


def _rmse(errors: FoldErrors) -> float | None:
    return None if errors.heldout is None else errors.heldout.rmse_deg


def study_verdicts(study: StudySection, command: str) -> list[Verdict]:
    """Give the number of cases with a result, and how many of them keep the limits of a design."""
    found = [_study(study.size, study.cases, study.failed, study.pending, command)]
    if study.feasible is not None:
        found.append(_feasible(study.feasible, command))
    return found


def _feasible(found: Feasible, command: str) -> Verdict:
    """Say how many designs keep all limits; a limit that any of them breaks asks for a decision."""
    each = "; ".join(f"{limit.words}: {limit.kept}" for limit in found.limits)
    state: State = "look" if found.kept < found.cases else "holds"
    value = f"{found.kept} of {found.cases}"
    return Verdict(state, "Designs within limits", value, f"kept of {found.cases} cases: {each}", "study", command)


def _study(size: str, cases: int, failed: int, pending: int, command: str) -> Verdict:
    problems = [f"{failed} failed, for the reasons below"] * (failed > 0) + [f"{pending} not run yet"] * (pending > 0)
    words = f"{size}; {', '.join(problems) or 'all with a result'}"
    return Verdict(_state(not problems), "Study", f"{cases} cases", words, "study", command)


def front_verdict(designs: int, objectives: Sequence[str], command: str) -> Verdict:
    """Give the number of designs on the Pareto front."""
    words = "not dominated in " + ", ".join(objectives)
    return Verdict("note", "Pareto front", f"{designs} designs", words, "pareto", command)
