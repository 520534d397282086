"""Commands ``data list`` and ``data fetch``: measured records from public repositories."""
# Imports inside a command are needed by it alone.

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from studies.commands.options import Common, Out, Overwrite
from studies.progress import status


def list_records(*, common: Common) -> None:
    """List the measured records that can be fetched, and their sources; with --quiet the names alone."""
    from studies.fetch import CATALOGUE, SOURCES_ONLY

    if common.quiet and not common.json:
        typer.echo("\n".join(CATALOGUE))
        return
    table = Table("name", "what", "source")
    for entry in CATALOGUE.values():
        table.add_row(entry.name, entry.title, entry.citation)
    for name, citation in SOURCES_ONLY.items():
        table.add_row(name, "source only", citation)
    records = [{"name": e.name, "title": e.title, "source": e.citation} for e in CATALOGUE.values()]
    sources = [{"name": name, "source": citation} for name, citation in SOURCES_ONLY.items()]
    common.show({"schema": 1, "records": records, "sources_only": sources}, table)


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
