"""Results as JSON files: written whole or not at all, checked field by field when they are read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TypeVar

from hysteresis.files import RecordError, write_files
from hysteresis.plain import from_plain, to_plain

Result = TypeVar("Result")


def write_result(path: Path, result: object) -> None:
    """Write a dataclass, or plain values, as JSON; the folder is made where it is missing.

    Numbers that are not finite stay, as Python's JSON has them.

    Raises
    ------
    RecordError
        A folder that cannot be written to.
    """
    write_files({path: json.dumps(to_plain(result, finite=False), indent=2) + "\n"})


def read_result(kind: type[Result], path: Path, expected: str) -> Result:
    """Read a JSON file into a dataclass.

    Parameters
    ----------
    kind
        The dataclass; see :func:`hysteresis.plain.from_plain` for what its fields may be.
    expected
        What the file should be, for the error.

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror}: expected {expected}") from None
    except ValueError as error:
        raise RecordError(f"{path}: not JSON: {error}: expected {expected}") from None
    try:
        return from_plain(kind, values, str(path))
    except RecordError as error:
        raise RecordError(f"{error}: expected {expected}" if str(error).endswith(": missing") else str(error)) from None
