"""The numbers of a user's own rig as the report lists them, each with its source."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from fem_models.rig import Rig
from fem_models.rig.rig_file import given_in_file
from hysteresis.fitting.uncertainty import Parameter
from studies.own_rig.key_numbers import derived
from studies.results.run import RigNumber
from studies.results.separation import Separation


def numbers_of_file(numbers: Mapping[str, float], file: Path) -> tuple[RigNumber, ...]:
    """Give the numbers of a rig with their source: its file, or the default of what the file does not give.

    Raises
    ------
    RigError
        A file that cannot be read.
    """
    given = given_in_file(file)
    return tuple(RigNumber(name, value, "file" if name in given else "default", "") for name, value in numbers.items())


def derived_numbers(rig: Rig) -> tuple[RigNumber, ...]:
    """Give what follows from the numbers of a rig: lengths, stiffness and arm of a joint."""
    note = "" if rig.joint.alike else "of the first notch"
    return tuple(
        RigNumber(name, value, "derived", "" if name == "length_mm" else note) for name, value in derived(rig).items()
    )


def fitted_numbers(result: Separation, records: str) -> tuple[RigNumber, ...]:
    """Give the constants that records of the rig were fitted with, beside those of its file."""
    if result.calibration is None:
        return ()
    return tuple(
        RigNumber(name, one.value, "fitted", f"{_interval(one)}to {records}")
        for name, one in result.calibration.parameters.items()
    )


def _interval(one: Parameter) -> str:
    return "" if one.low is None or one.high is None else f"{one.low:.4g} to {one.high:.4g}, "


def with_preloads(rows: Iterable[RigNumber], preloads_N: Sequence[float]) -> tuple[RigNumber, ...]:
    """Note beside the preload of the rig at which preloads the loops of the report are, where they have others."""
    loops = f"the loops of this report are at {', '.join(f'{value:g}' for value in preloads_N)} N"
    return tuple(
        replace(row, note="; ".join(filter(None, (row.note, loops))))
        if row.name == "preload_N" and [row.value] != [*preloads_N]
        else row
        for row in rows
    )
