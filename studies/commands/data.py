"""Commands ``data list`` and ``data fetch``: measured records from public repositories."""
# Imports inside a command are needed by it alone.

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from studies.commands.options import Common, Out, Overwrite
from studies.commands.tables import spaced_table
from studies.progress import status


def list_records(*, common: Common) -> None:
    """List the measured records that can be fetched, and their sources; with --quiet the names alone."""
    from studies.fetch import CATALOGUE, SOURCES_ONLY

    if common.quiet and not common.json:
        typer.echo("\n".join(CATALOGUE))
        return
    rows = [(e.name, e.title, e.citation) for e in CATALOGUE.values()]
    rows += [(name, "source only", citation) for name, citation in SOURCES_ONLY.items()]
    table = spaced_table("name", "what")
    for name, title, _ in rows:
        table.add_row(name, title)
    sources_of = dict[str, list[str]]()
    for name, _, citation in rows:
        sources_of.setdefault(citation, []).append(name)
    cited = [f"{_common(names)}: {citation}" for citation, names in sources_of.items()]
    records = [{"name": e.name, "title": e.title, "source": e.citation} for e in CATALOGUE.values()]
    sources = [{"name": name, "source": citation} for name, citation in SOURCES_ONLY.items()]
    result = {"schema": 1, "records": records, "sources_only": sources}
    if common.json or sys.stdout.isatty():
        common.show(result, table, *cited)
    else:  # a line each, for other programs
        typer.echo("\n".join("\t".join(row) for row in rows))


def _common(names: Sequence[str]) -> str:
    """Name of one record, or the first words of the names of several."""
    return names[0] if len(names) == 1 else ", ".join(dict.fromkeys(f"{name.split('-')[0]}-*" for name in names))


def fetch(
    *,
    name: Annotated[str, typer.Argument(help="A name of `notchbend data list`.")],
    out: Out = Path("measured"),
    replacing: Overwrite,
    common: Common,
) -> None:
    """Fetch a measured record from its public repository, verify its checksum, and write it as a record."""
    from studies.fetch import CATALOGUE, fetch_record

    with status(common.shows_progress, f"fetching {name}"):
        path = fetch_record(name, out, allow=replacing.allow)
    entry = CATALOGUE[name]
    result = {"schema": 1, "record": str(path), "cite": entry.citation, "licence": entry.licence}
    common.show(result, *(f"{key}: {value}" for key, value in result.items() if key != "schema"))
