"""Commands ``practice export``, ``practice answer`` and ``practice score``: a benchmark that others can take."""
# Imports inside a command are needed by it alone.

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from fem_models.rig import RigError
from fem_models.rig.checks import require
from hysteresis.files import RecordError, place, present, require_place, write_files
from hysteresis.own import marked_values
from hysteresis.plain import to_plain
from studies.commands.options import Common, Out, Overwrite
from studies.commands.tables import spaced_table
from studies.engines import MissingError
from studies.progress import counted, steps

if TYPE_CHECKING:
    from validation.practice.benchmark.answering import Answerer

ANSWERS = "answers"
"""Folder of the answers in that of the cases."""

Cases = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of the cases, as export wrote it.")]
By = Literal["tracer", "sparse-regression", "classifier"]


def _require_practice() -> None:
    """Refuse where the practice cases are not installed: wheels are without them.

    Raises
    ------
    MissingError
        One line: what is missing and what to install.
    """
    if find_spec("validation.practice") is None:
        raise MissingError(
            "practice: validation/practice is not installed: expected the repository: pip install --editable ."
        )


def export(
    *,
    out: Out,
    count: Annotated[int, typer.Option("--count", min=1, help="Cases of each source.")] = 8,
    measured: Annotated[
        Path | None, typer.Option("--measured", help="Folder of measured records to hide changes in; by default none.")
    ] = None,
    sources: Annotated[
        str | None,
        typer.Option(
            "--sources", help="Some of own, other, series, sensors, protocols, real, with commas; by default all."
        ),
    ] = None,
    answers: Annotated[
        Path | None, typer.Option("--answers", help="File of the sealed answers; by default DIR-ANSWERS.json.")
    ] = None,
    common: Common,
) -> None:
    """Write blind cases, and their sealed answers in a file apart from them."""
    _require_practice()
    from validation.practice.benchmark.sealed import LIST, require_apart, write_cases
    from validation.practice.benchmark.sources import draw_source

    wanted = _sources(sources, measured)
    target = answers or out.with_name(f"{Path(place(out)).name}-ANSWERS.json")
    _require_free(out / LIST, target)
    require_apart(out, target)
    drawn = []
    with steps(common.shows_progress, len(wanted)) as step:
        for source in wanted:
            step(f"cases of {source}")
            drawn += draw_source(source, common.seed, count, measured)
    sealed = write_cases(drawn, common.seed, out, target)
    found = {"schema": 1, "cases": len(sealed.cases), "folder": str(out), "answers": str(target)}
    common.show(found, f"{len(sealed.cases)} cases: {out}", f"sealed answers: {target}")


def _require_free(listed: Path, answers: Path) -> None:
    """Refuse names that are taken, and a folder with cases without a list: those of another hand would be replaced.

    Raises
    ------
    RecordError
        One line with the path.
    """
    for path in (listed, answers):
        require_place(path)
    for path in (answers, *sorted(listed.parent.glob("case-*"))[:1]):
        if present(path):
            raise RecordError(f"{path}: exists: expected another name, or a folder without cases; it is left as it is")


def _sources(given: str | None, measured: Path | None) -> list[str]:
    from validation.practice.benchmark.sources import REAL, SIMULATED, SOURCES
    from validation.practice.hidden.draw import groups_of

    wanted = [*(SOURCES if measured else SIMULATED)] if given is None else given.split(",")
    if unknown := [name for name in wanted if name not in SOURCES]:
        raise RigError(f"--sources {unknown[0]}: expected some of {', '.join(SOURCES)}")
    require(REAL not in wanted or measured is not None, "--measured", "missing", "the folder of the measured records")
    if REAL in wanted and measured is not None:
        groups_of(measured)  # a folder without records is refused before any case is drawn
    return wanted


def answer(
    *,
    folder: Cases,
    by: Annotated[By, typer.Option("--by", help="Method that answers.")] = "tracer",
    into: Annotated[Path | None, typer.Option("--into", help="Folder of the answers; by default DIR/answers.")] = None,
    training: Annotated[
        Path | None, typer.Option("--training", help="Features of other cases for --by classifier; by default none.")
    ] = None,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Number of processes.")] = 1,
    common: Common,
) -> None:
    """Answer all cases that have no answer yet."""
    _require_practice()
    from validation.practice.benchmark.answering import answer_all

    target = into or folder / ANSWERS
    with counted(common.shows_progress, "cases") as count, _saying_how_to_go_on(target):
        answered = answer_all(folder, target, _answerer(by, training), workers, progress=count)
    found = {"schema": 1, "answered": answered, "folder": str(target)}
    common.show(found, f"{answered} cases answered: {target}")


@contextmanager
def _saying_how_to_go_on(target: Path) -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt as stop:
        stop.add_note(f"{len(list(target.glob('*.json')))} answers are in {target}, the same command goes on")
        raise


def _answerer(by: By, training: Path | None) -> Answerer:
    if by == "tracer":
        from validation.practice.benchmark.answering import by_tracer

        return by_tracer
    try:
        if by == "sparse-regression":
            import_module("pysindy")
            from validation.practice.benchmark.sparse_regression import by_sparse_regression

            return by_sparse_regression
        import_module("sklearn")
    except ImportError as error:
        raise MissingError(f"--by {by}: {error}: expected pip install notchbend[comparison]") from None
    from validation.practice.benchmark.classifier import ClassifierAnswerer, forest_of

    require(
        training is not None, "--training", "missing", "the file that validation.practice.benchmark.training writes"
    )
    assert training is not None
    forest_of(training)  # a malformed file is refused before any case is answered
    return ClassifierAnswerer(training)


def score(
    *,
    folder: Cases,
    sealed: Annotated[Path, typer.Argument(metavar="ANSWERS", help="The sealed answers, as export wrote them.")],
    answers_of: Annotated[
        Path | None, typer.Option("--answers-of", help="Folder of the answers to score; by default DIR/answers.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="File for the score, JSON; by default none.")] = None,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Score anyone's answers: CASE.json each, or a trace in the folder CASE."""
    _require_practice()
    from validation.practice.benchmark.scoring import score_answers

    replacing.allow([out] if out is not None else [])
    found = score_answers(folder, sealed, answers_of or folder / ANSWERS)
    if out is not None:
        write_files({out: json.dumps(marked_values(to_plain(found)), indent=1) + "\n"})
    table = spaced_table("", *found.rates)
    for name in next(iter(found.rates.values())):
        cells = [rates[name] for rates in found.rates.values()]
        table.add_row(name, *(f"{rate.hits} of {rate.of}" if rate.of else "" for rate in cells))
    spreads = found.heldout_over_noise.values()
    table.add_row("held-out error over noise", *("" if s.median is None else f"{s.median:.3g}" for s in spreads))
    common.show(found, table, f"{found.answered} of {found.cases} cases answered")
