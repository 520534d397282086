"""Reading text, writing results all or none, and the error that names what is wrong with a file."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path


class RecordError(ValueError):
    """A record that cannot be read or used; one line with file, line or field, value and what was expected."""


def read_text(path: Path, expected: str) -> str:
    """Read a text file in UTF-8, with or without a byte order mark; ``expected`` completes the error message.

    Raises
    ------
    RecordError
        A file that cannot be opened or is not UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror}: expected {expected}") from None
    except UnicodeDecodeError as error:
        raise RecordError(f"{path}: byte {error.start} is not UTF-8: expected {expected} in UTF-8") from None


def write_files(files: Mapping[Path, str | bytes]) -> None:
    """Write texts, as UTF-8, and bytes, all or none: all are staged in their folders before any is replaced.

    Missing folders are created.

    Raises
    ------
    RecordError
        A folder that cannot be written to, or a folder in the place of a file; existing files stay unchanged.
    """
    for path in files:
        if path.is_dir():
            raise RecordError(f"{path}: is a folder: expected the name of a file")
    staged: dict[Path, Path] = {}
    try:
        for path, content in files.items():
            part = path.with_name(f".{path.name}.{os.getpid()}.part")
            path.parent.mkdir(parents=True, exist_ok=True)
            staged[part] = path
            if isinstance(content, str):
                part.write_text(content, encoding="utf-8", newline="\n")
            else:
                part.write_bytes(content)
        with _put_back(staged.values()):
            for part, path in staged.items():
                part.replace(path)
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror}: expected a folder that can be written to") from None
    finally:
        for part in staged:
            part.unlink(missing_ok=True)


@contextmanager
def _put_back(paths: Iterable[Path]) -> Iterator[None]:
    """Restore all files if the block fails or is interrupted."""
    before = {path: path.with_name(f".{path.name}.{os.getpid()}.old") for path in paths}
    try:
        for path, old in before.items():
            if path.exists():
                shutil.copy2(path, old)
        try:
            yield
        except BaseException:
            for path, old in before.items():
                if old.exists():
                    old.replace(path)
                else:
                    path.unlink(missing_ok=True)
            raise
    finally:
        for old in before.values():
            old.unlink(missing_ok=True)
