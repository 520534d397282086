"""The numbers of a user's own rig as the report lists them, each with its source."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from fem_models.rig.rig_file import given_in_file
from studies.results.run import RigNumber


def numbers_of_file(numbers: Mapping[str, float], file: Path) -> tuple[RigNumber, ...]:
    """Give the numbers of a rig with their source: its file, or the default of what the file does not give.

    Raises
    ------
    RigError
        A file that cannot be read.
    """
    given = given_in_file(file)
    return tuple(
        RigNumber(name, value, "rig file" if name in given else "default", "") for name, value in numbers.items()
    )


def with_preloads(rows: Iterable[RigNumber], preloads_N: Sequence[float]) -> tuple[RigNumber, ...]:
    """Note beside the preload of the rig at which preloads the loops of the report are, where they have others."""
    loops = f"the loops of this report are at {', '.join(f'{value:g}' for value in preloads_N)} N"
    return tuple(
        replace(row, note="; ".join(filter(None, (row.note, loops))))
        if row.name == "preload_N" and [row.value] != [*preloads_N]
        else row
        for row in rows
    )
