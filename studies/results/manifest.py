"""The files of a study's dataset and their checksums, kept in the dataset: a chunk that is deleted reads as blank."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from hysteresis.files import RecordError, inside, read_bytes, read_json

KEY = "files_sha256"
"""Attribute of the dataset: name of each file -> the first digits of its checksum."""
_TIMES = "wall_s/"
_ROOT = "zarr.json"
_WHAT = "a file of the dataset of a study"


def digests(store: Path) -> dict[str, str]:
    """Compute the checksums of the files of a dataset but its root; computing times, which vary, have none."""
    files = sorted(path for path in store.rglob("*") if path.is_file())
    names = {path.relative_to(store).as_posix(): path for path in files}
    return {name: _digest(name, path) for name, path in names.items() if name != _ROOT}


def require_complete(store: Path) -> None:
    """Refuse a dataset with a file that is missing or changed; one without checksums is of an earlier version.

    Raises
    ------
    RecordError
        One line with the file.
    """
    root = read_json(store / _ROOT, _WHAT)
    attributes = root.get("attributes", {}) if isinstance(root, Mapping) else {}
    if not isinstance(attributes, Mapping) or KEY not in attributes:
        return
    try:
        expected = json.loads(attributes[KEY])
        items = list(expected.items())
    except (TypeError, ValueError, AttributeError, RecursionError):
        raise RecordError(f"{store / _ROOT}: {KEY}: expected checksums by file; run the study again") from None
    for name, digest in items:
        path = inside(store / _ROOT, KEY, str(name))
        if not path.is_file():
            raise RecordError(f"{store}: {name}: missing: expected all chunks; run the study again")
        if _digest(name, path) != digest:
            raise RecordError(f"{store}: {name}: changed: expected as it was written; run the study again")


def _digest(name: str, path: Path) -> str:
    return "" if name.startswith(_TIMES) else hashlib.sha256(read_bytes(path, _WHAT)).hexdigest()[:16]
