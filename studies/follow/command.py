"""``notchbend follow``: read the records of a device, follow it, write follow.json and the page."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer

from hysteresis.attempts import attempt
from hysteresis.files import require_kept, write_files
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.laws.elements import LawName
from hysteresis.messages import quoted
from hysteresis.own import marked_page, marked_values
from hysteresis.plain import to_plain
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_records
from studies.commands.options import Common, Out, Overwrite
from studies.follow.result import FollowReport
from studies.follow.times import in_order, read_times
from studies.follow.work import FALSE_ALARM, FollowSettings, follow_loaded
from studies.progress import bar
from studies.results.made import made_now

FILES = ("follow.json", "report.html")


@dataclass(frozen=True)
class FollowChoice:
    """How a device is followed."""

    times: Annotated[
        Path | None,
        typer.Option("--times", help="CSV of record and day, uses or the like; by default the records stand in order."),
    ] = None
    reference_count: Annotated[
        int | None,
        typer.Option(
            "--reference-count", help="First records that are the device as it should be; by default a third."
        ),
    ] = None
    limit: Annotated[
        list[str] | None,
        typer.Option("--limit", help="NAME=VALUE of a number: when is it passed? By default none; may be repeated."),
    ] = None
    false_alarm: Annotated[
        float,
        typer.Option("--false-alarm", min=0.0001, max=0.2, help="How often a steady device may be said to change."),
    ] = FALSE_ALARM
    law: Annotated[LawName, typer.Option("--law", help="Law of the hysteresis.")] = "bouc-wen"
    no_trace: Annotated[bool, typer.Option("--no-trace", help="Do not trace the cause, which takes a minute.")] = False
    threads: Annotated[int, typer.Option("--threads", min=1, help="Threads of the trace.")] = 2


def follow(
    *,
    records: Annotated[list[Path], typer.Argument(help="Records of one device, CSV, the oldest first; six or more.")],
    out: Out,
    choice: FollowChoice,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Follow one device over days or uses: what changed since when, why, and when a limit will be passed."""
    files = [out / name for name in FILES]
    require_kept(out, files, records)
    replacing.allow(files)
    made = made_now(common.command)
    axis = in_order(len(records)) if choice.times is None else read_times(choice.times, records)
    settings = FollowSettings(
        reference=choice.reference_count,
        false_alarm=choice.false_alarm,
        limits=limits_of(choice.limit or []),
        trace=not choice.no_trace,
        threads=choice.threads,
        identify=IdentifySettings(law=choice.law, seed=common.seed),
    )
    settings.reference_of(len(records))  # before anything is read
    loaded = read_records(records)
    with bar(common.shows_progress) as shown:
        task = shown.add_task("following", total=None)

        def tell(words: str, done: int, expected: int) -> None:
            shown.update(task, description=words, completed=done, total=expected)

        report = follow_loaded(loaded, axis, settings, progress=tell)
    report = write_follow(replace(report, made=made), out)
    page = out / "report.html"
    common.show(report, *report.words, f"report: {page}" if page.exists() else f"wrote {out / 'follow.json'}")


def limits_of(given: Sequence[str]) -> dict[str, float]:
    """Read limits, ``NAME=VALUE``.

    Raises
    ------
    RecordError
        One of another form, or a name that is given twice.
    """
    found = dict[str, float]()
    for text in given:
        name, _, value = text.partition("=")
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not name or not math.isfinite(number):
            raise RecordError(f"--limit {quoted(text, 40)}: expected NAME=VALUE, such as width=1.5")
        if name in found:
            raise RecordError(f"--limit {name}: given twice: expected one value")
        found[name] = number
    return found


def write_follow(report: FollowReport, out: Path) -> FollowReport:
    """Write follow.json, then report.html; give the report as it is stored, with a word if there is no page.

    Raises
    ------
    RecordError
        A folder that cannot be written to.
    """
    from studies.follow.page import follow_page  # Plotly

    write_files({out / "follow.json": _stored(report)})
    (out / "report.html").unlink(missing_ok=True)  # of an older verdict
    failed = list[str]()
    page = attempt("no report.html", lambda: marked_page(follow_page(report)), None, failed)
    if page is None:
        report = replace(report, words=(*report.words, *failed))
        write_files({out / "follow.json": _stored(report)})
    else:
        write_files({out / "report.html": page})
    return report


def _stored(report: FollowReport) -> str:
    return json.dumps(marked_values(to_plain(report)), indent=2, allow_nan=False) + "\n"
