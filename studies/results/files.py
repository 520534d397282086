"""Results as JSON files: written whole or not at all, checked field by field when they are read."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TypeVar

from hysteresis.files import RecordError, read_json, write_files
from hysteresis.messages import quoted
from hysteresis.own import marked_values
from hysteresis.plain import from_plain, to_plain

Result = TypeVar("Result")

SCHEMA = 1
"""Version of the results that are read; files without one are of this one."""


def file_stem(name: str) -> str:
    """Give a name for files: letters, digits, dots and dashes of the rig's name."""
    return re.sub(r"[^A-Za-z0-9.]+", "-", name)[:60].strip(".-") or "rig"


def without_folders(name: str) -> str:
    """Give the name of a rig for files; one with a slash, which would lead to another folder, by :func:`file_stem`."""
    return file_stem(name) if set(name) & set("/\\\0") else name


def write_result(path: Path, result: object) -> None:
    """Write a dataclass, or plain values, as JSON with the mark of its maker; a missing folder is made.

    Numbers that are not finite stay, as Python's JSON has them.

    Raises
    ------
    RecordError
        A folder that cannot be written to.
    """
    write_files({path: json.dumps(marked_values(to_plain(result, finite=False)), indent=2) + "\n"})


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
        One line with the file, the field and what was expected; also a file of another schema.
    """
    values = read_json(path, expected)
    schema = values.get("schema", SCHEMA) if isinstance(values, dict) else SCHEMA
    if type(schema) is not int or schema != SCHEMA:  # True is 1
        raise RecordError(f"{path}: schema = {quoted(schema)}: expected {SCHEMA}")
    try:
        return from_plain(kind, values, str(path))
    except RecordError as error:
        raise RecordError(f"{error}: expected {expected}" if str(error).endswith(": missing") else str(error)) from None
