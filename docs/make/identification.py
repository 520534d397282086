"""Writes ``docs/validation/identification-results.md``: ``python -m docs.make.identification``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from docs.make.pages import DOCS, table, template
from hysteresis.files import write_files
from hysteresis.fitting.law_choice import LawChoice
from validation.layer.identification import (
    DAVINCI_RATES,
    RecordScores,
    Score,
    catheter,
    davinci,
    laws,
    single_records,
)
from validation.layer.recovery import NAMES, Coverage, MethodRecovery, coverage, recoveries
from validation.layer.simulated_loops import LoopFit, minor_loops, paper_table
from validation.measured import measured_folder

PAGE = DOCS / "validation" / "identification-results.md"
_PAPER = ["the paper, measured", "its model", "1", "1.48", "3.23", "0.0133"]


def score_table(scores: Sequence[Score]) -> str:
    """Format the scores of models on the same records."""
    rows = [
        [
            s.model,
            f"{s.rmse_deg:.3f}",
            ", ".join(f"{p:.2f}" for p in s.percents),
            "" if s.train_rmse_deg is None else f"{s.train_rmse_deg:.3f}",
        ]
        for s in scores
    ]
    return table(["model", "held-out rmse, deg", "% of range, each record", "training rmse, deg"], rows)


def page(folder: Path) -> str:
    """Markdown of the page; ``folder`` has the measured records."""
    intervals = coverage()
    recovered = recoveries()
    return template("identification-results").format(
        single="\n\n".join(_single(record) for record in single_records(folder)),
        catheter=score_table(catheter(folder)),
        laws="\n\n".join(_laws(*one) for one in laws(folder)),
        davinci=score_table(davinci(folder)),
        rates=" and ".join(DAVINCI_RATES),
        paper=_paper_table(paper_table()),
        minor=_minor_table(minor_loops()),
        recovery=_recovery_table(recovered),
        seeds=recovered[0].seeds,
        coverage=_coverage_table(intervals),
        count=intervals.count,
        noise=intervals.noise_deg,
    )


def _single(record: RecordScores) -> str:
    return f"`{record.record}`, held out: {record.heldout_by}.\n\n{score_table(record.scores)}"


def _laws(record: str, choice: LawChoice, notes: Sequence[str]) -> str:
    rows = [
        [
            c.title + (" (chosen)" if c is choice.chosen else ""),
            str(c.constants),
            *(f"{e:.3f}" for e in (c.inner_rmse_deg, c.train_rmse_deg, c.heldout_rmse_deg)),
        ]
        for c in choice.candidates
    ]
    head = ["law", "constants", "inner folds, deg", "training, deg", "held-out rmse, deg"]
    return "\n\n".join([f"`{record}`: {'; '.join(notes)}." if notes else f"`{record}`.", table(head, rows)])


def _loop(fit: LoopFit) -> list[str]:
    return [f"{fit.preload_N:g} N", fit.kinematics, str(fit.elements)]


def _paper_table(fits: Sequence[LoopFit]) -> str:
    rows = []
    for fit in fits:
        (e,) = fit.errors
        relative = 100 * e.max_abs_deg / fit.amplitude_deg
        rows.append([*_loop(fit), f"{e.max_abs_deg:.3f}", f"{relative:.2f}", f"{e.normalised:.5f}"])
    head = ["loop", "f", "elements of h", "largest error, deg", "relative, %", "normalised"]
    return table(head, [_PAPER, *rows])


def _minor_table(fits: Sequence[LoopFit]) -> str:
    rows = [[*_loop(fit), *(f"{e.rmse_deg:.3f}, {e.max_abs_deg:.3f}" for e in fit.errors)] for fit in fits]
    return table(["loop", "f", "elements of h", "2.2 mm", "1.1 mm", "0.55 mm"], rows)


def _recovery_table(found: Sequence[MethodRecovery]) -> str:
    rows = [[r.method, f"{r.recovered} of {r.seeds}", f"{r.largest_error:.1e}", f"{r.seconds:.2f}"] for r in found]
    return table(["method", "within 1e-4", "largest relative error", "seconds a fit"], rows)


def _coverage_table(found: Coverage) -> str:
    rows = [
        [name, *(f"{100 * counts[name] / found.count:.1f}" for counts in (found.jacobian, found.blocks))]
        for name in NAMES
    ]
    return table(["parameter", "Jacobian, %", "blocks, %"], rows)


if __name__ == "__main__":
    write_files({PAGE: page(measured_folder())})
