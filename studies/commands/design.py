"""The command that finds tubes for a requirement: ``design``."""
# Imports inside a command are needed by it alone.

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from hysteresis.extras import require_extra
from studies.commands.options import Out, Output, Overwrite
from studies.commands.tables import spaced_table
from studies.progress import bar
from studies.results.made import made_now

if TYPE_CHECKING:
    from studies.results.design import DesignSummary, FoundDesign


def design(
    *,
    file: Annotated[Path, typer.Argument(help="A file of requirements, TOML.")],
    out: Out,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Number of worker processes; by default one a core.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", min=0, help="Seed in place of the file's; by default 0.")
    ] = None,
    replacing: Overwrite,
    output: Output,
) -> None:
    """Find tubes that meet a requirement: stock sizes, whole numbers of notches, and P(met) under tolerances."""
    require_extra("study", "notchbend design")
    from studies.design.design_file import read_design
    from studies.design.run import design_files, run_design

    found = read_design(file, seed=seed)
    replacing.allow(design_files(out, found.size.shown))
    with bar(output.shows_progress) as shown:
        tasks = dict[str, object]()

        def progress(words: str, done: int, of: int) -> None:
            if words not in tasks:
                tasks[words] = shown.add_task(words, total=of)
            shown.update(tasks[words], completed=done)  # type: ignore[arg-type]

        count = workers or os.cpu_count() or 1
        summary = run_design(found, out, workers=count, progress=progress, made=made_now(output.command))
    from studies.report.page import try_report

    output.show_with_page(summary, try_report(out), *_words(summary), f"wrote {out / 'design.json'}")


def _words(summary: DesignSummary) -> list[str | Table]:
    """Give the table of the designs, the verdicts on the last one, and what to tighten."""
    head = f"{summary.feasible} of {summary.tried} tubes meet all requirements"
    parts: list[str | Table] = [head, *summary.warnings, _designs(summary.designs)]
    from studies.design.first_page import first_words

    last = summary.chosen
    if last is not None:
        parts += [f"{last.name}:", _verdicts(last)]
        parts += first_words(last)
    return parts


def _designs(designs: tuple[FoundDesign, ...]) -> Table:
    table = spaced_table("design", "tube, mm", "wire", "n", "depth", "width", "spacing", "P(all)", "limited by")
    for one in designs:
        v = one.values
        table.add_row(
            one.name,
            f"{v['tube.outer_diameter_mm']:g}/{v['tube.inner_diameter_mm']:g}",
            *(f"{v[name]:g}" for name in ("wire_mm", "notch.count")),
            *(f"{v[f'notch.{name}_mm']:.3f}" for name in ("depth", "width", "spacing")),
            "" if one.p_all is None else f"{one.p_all.value:.3f}",
            one.limited_by,
        )
    return table


def _verdicts(one: FoundDesign) -> Table:
    table = spaced_table("requirement", "bounds", "value", "margin", "P(met)", "verdict")
    for row in one.verdicts:
        bounds = " and ".join(
            f"{word} {bound:g}" for word, bound in (("at least", row.low), ("at most", row.high)) if bound is not None
        )
        chance = "" if row.p_met is None else f"{row.p_met.value:.3f}"
        table.add_row(row.quantity, bounds, f"{row.value:.4g}", f"{row.margin:+.3g}", chance, row.decision)
    return table
