"""``notchbend identify --each``: fit every record of a folder, write the table, each.json and the page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from hysteresis.attempts import attempt
from hysteresis.files import require_kept, write_files
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.own import marked_page, marked_values
from hysteresis.plain import to_plain
from hysteresis.records.record import RecordError
from studies.each.result import EachResult, csv_table, parquet_table
from studies.each.work import EachSettings, fit_each, records_of
from studies.progress import bar
from studies.results.made import made_now

if TYPE_CHECKING:
    from studies.commands.options import Common, Overwrite
    from studies.commands.records import EachChoice

PAGE, SUMMARY = "report.html", "each.json"


def identify_folder(
    many: EachChoice,
    records: Sequence[Path],
    out: Path,
    settings: IdentifySettings,
    plane: int,
    others: tuple[Overwrite, Common],
) -> None:
    """Do the work of the command.

    Raises
    ------
    RecordError
        Records beside the folder, a folder without records, or a folder that cannot be written to.
    """
    assert many.each is not None
    replacing, common = others
    if records:
        raise RecordError(f"{records[0]}: with --each {many.each}: expected one of the two")
    table = out / f"fits.{many.table}"
    files = [table, out / SUMMARY, out / PAGE]
    paths = records_of(many.each, leave_out=[out / f"fits.{suffix}" for suffix in ("csv", "parquet")])
    require_kept(out, files, paths)
    replacing.allow(files)
    if many.table == "parquet":
        parquet_table(EachResult(()))  # before minutes of work
    made = made_now(common.command)
    with bar(common.shows_progress) as shown:
        task = shown.add_task("fitting", total=len(paths), left=True)
        found = fit_each(
            paths,
            EachSettings(settings, plane=plane),
            workers=many.workers,
            progress=lambda done, total: shown.update(task, completed=done, total=total),
        )
    found = replace(found, made=made)
    words = write_each(found, out, table)
    page = out / PAGE
    shown_page = f"report: {page}" if page.exists() else "; ".join(words)
    common.show(found.summary(table.name), *found.lines(), f"wrote {table}", shown_page)


def write_each(found: EachResult, out: Path, table: Path) -> list[str]:
    """Write the table and each.json, which names it, then the page; give the words on a page that cannot be drawn.

    Raises
    ------
    RecordError
        A folder that cannot be written to.
    """
    content = csv_table(found) if table.suffix == ".csv" else parquet_table(found)
    text = json.dumps(marked_values(to_plain(found.summary(table.name))), indent=2, allow_nan=False) + "\n"
    write_files({table: content, out / SUMMARY: text})
    (out / PAGE).unlink(missing_ok=True)  # of an older table
    failed = list[str]()

    def drawn() -> str:
        from studies.each.page import each_page  # Plotly

        return marked_page(each_page(found, table.name))

    page = attempt(f"no {PAGE}", drawn, None, failed)
    if page is not None:
        write_files({out / PAGE: page})
    return failed
