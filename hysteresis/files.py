"""Reading files within limits, writing results all or none, and the error that names what is wrong with a file."""

from __future__ import annotations

import glob
import json
import os
import re
import shutil
import stat
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hysteresis.messages import as_given, quoted

MB = 2**20
MOST_BYTES = 512 * MB
"""Size of the largest file that is read."""
MOST_TOML_BYTES = MB
MOST_PARTS = 16
"""Most parts of a dotted key, and most levels of nested values, of a TOML or JSON file."""
_TOML_STRINGS = re.compile(
    r'"""(?:\\.|[^\\])*?"""|' + r"'''.*?'''|" + r'"(?:\\.|[^"\\\n])*"|' + r"'[^'\n]*'|#[^\n]*", re.DOTALL
)
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
_KINDS = ((stat.S_ISFIFO, "a fifo"), (stat.S_ISSOCK, "a socket"), (stat.S_ISDIR, "a folder"))


class RecordError(ValueError):
    """A record that cannot be read or used; one line with file, line or field, value and what was expected."""


# --- reading -----------------------------------------------------------------------------------------------------


def present(path: Path) -> bool:
    """Tell whether a name is taken: by a file, a folder, or a link, also one that leads nowhere."""
    return os.path.lexists(path)


def read_bytes(path: Path, expected: str, *, most: int = MOST_BYTES) -> bytes:
    """Read a regular file of at most ``most`` bytes; ``expected`` completes the error message.

    Raises
    ------
    RecordError
        A file that cannot be opened, is too large, or is no regular file: a fifo, a device, a link that leads nowhere.
    """
    if "\0" in str(path):
        raise RecordError(f"{quoted(str(path))}: NUL in the name: expected {expected}")
    require_name(path)
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            kind = next((words for test, words in _KINDS if test(found.st_mode)), "a device")
            raise RecordError(f"{path}: is {kind}: expected {expected}")
        if found.st_size > most:
            raise RecordError(f"{path}: {found.st_size / MB:,.1f} MB: expected {expected}, at most {most / MB:,.0f} MB")
        with path.open("rb") as file:
            content = file.read(found.st_size + 1)
    except OSError as error:
        dangling = isinstance(error, FileNotFoundError) and path.is_symlink()
        reason = "a link to a file that does not exist" if dangling else error.strerror
        raise RecordError(f"{path}: {reason}: expected {expected}") from None
    if len(content) > found.st_size:
        raise RecordError(f"{path}: grows while it is read: expected {expected}")
    return content


def require_name(path: Path) -> None:
    """Refuse a name that no text in UTF-8 can hold: results, sidecars and pages name the files that they are of.

    Raises
    ------
    RecordError
        Such a name, or one that this locale cannot read.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError:
        try:
            os.fsencode(path).decode()
            found, expected = "a name that this locale cannot read", "LANG=C.UTF-8, or another name"
        except UnicodeError:
            found, expected = "a name that is not UTF-8, which no result can hold", "it renamed"
        raise RecordError(f"{quoted(str(path))}: {found}: expected {expected}") from None


def read_text(path: Path, expected: str, *, most: int = MOST_BYTES, or_else: str = "") -> str:
    """Read a text file in UTF-8, with or without a byte order mark; ``expected`` completes the error message.

    ``or_else`` is said, too, of a file that is not UTF-8.

    Raises
    ------
    RecordError
        As :func:`read_bytes`, or a file that is not UTF-8.
    """
    try:
        text = read_bytes(path, expected, most=most).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise RecordError(f"{path}: byte {error.start} is not UTF-8: expected {expected} in UTF-8{or_else}") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_toml(path: Path, expected: str) -> dict[str, Any]:
    """Read a TOML file of at most 1 MB, whose keys and values are at most :data:`MOST_PARTS` levels deep.

    Raises
    ------
    RecordError
        As :func:`read_text`, or a file that is not such a TOML file.
    """
    text = read_text(path, expected, most=MOST_TOML_BYTES)
    for part in re.split(r"[,=\n{}\[\]]", _TOML_STRINGS.sub('""', text)):
        if part.count(".") >= MOST_PARTS:
            raise RecordError(f"{path}: key {as_given(part.strip(), 40)}: expected at most {MOST_PARTS} parts")
    try:
        tables = tomllib.loads(text)
    except RecursionError:
        raise RecordError(f"{path}: nested too deep: expected at most {MOST_PARTS} levels") from None
    except ValueError as error:  # of TOML, or of a number with too many digits
        raise RecordError(f"{path}: not TOML: {as_given(str(error), 120)}") from None
    _require_shallow(path, tables)
    return tables


def read_json(path: Path, expected: str) -> Any:
    """Read a JSON file whose values are at most :data:`MOST_PARTS` levels deep.

    Raises
    ------
    RecordError
        As :func:`read_text`, or a file that is not such a JSON file.
    """
    text = read_text(path, expected)
    try:
        values = json.loads(text)
        if _SURROGATE.search(text):
            json.dumps(values, ensure_ascii=False).encode()  # half a character, which no page can hold
    except RecursionError:
        raise RecordError(f"{path}: nested too deep: expected at most {MOST_PARTS} levels") from None
    except ValueError as error:
        raise RecordError(f"{path}: not JSON: {as_given(str(error), 120)}: expected {expected}") from None
    _require_shallow(path, values)
    return values


def _require_shallow(path: Path, values: object) -> None:
    level = [values]
    for _ in range(MOST_PARTS):
        inner = [one.values() if isinstance(one, Mapping) else one for one in level if isinstance(one, Mapping | list)]
        level = [item for items in inner for item in items if isinstance(item, Mapping | list)]
        if not level:
            return
    raise RecordError(f"{path}: nested too deep: expected at most {MOST_PARTS} levels")


def inside(source: Path, key: str, name: str, endings: Sequence[str] = ()) -> Path:
    """Give the path of a file that another file names, which must lie in the folder of that file or below it.

    Parameters
    ----------
    source, key
        The file that names it, and under which key, for the error.
    name
        The name, relative to the folder of ``source``. Links are followed before the place is checked.
    endings
        The endings of the name that are expected, such as ".csv"; none for any.

    Raises
    ------
    RecordError
        A name that leads out of the folder, has another ending, or leads in circles.
    """
    where = f"{source}: {key} = {quoted(name)}"
    if "\0" in name:
        raise RecordError(f"{where}: NUL in the name: expected the name of a file")
    path, folder = source.parent / name, source.parent.resolve()
    try:
        within = path.resolve(strict=False).is_relative_to(folder)
    except (OSError, RuntimeError) as error:  # a loop of links is a RuntimeError
        reason = getattr(error, "strerror", None) or "links that lead in a circle"
        raise RecordError(f"{where}: {reason}: expected a file") from None
    if not within:
        raise RecordError(f"{where}: outside its folder: expected a file in {folder}")
    if endings and path.suffix.lower() not in endings:
        raise RecordError(f"{where}: expected a name that ends in {' or '.join(endings)}")
    return path


def place(path: Path) -> str:
    """Give the absolute place of a file, links followed; unlike ``Path.resolve`` it takes links in a circle."""
    return os.path.realpath(path)


# --- writing -----------------------------------------------------------------------------------------------------


def require_place(path: Path) -> None:
    """Check that a file can be put in its place, before anything is computed for it; nothing is made.

    Raises
    ------
    RecordError
        A folder that is none, cannot be written to or made, links in a circle, or a name that is too long.
    """
    expected = "expected a folder that can be written to"
    require_name(path)
    try:
        os.lstat(path)
    except FileNotFoundError:  # its folder may be missing, too
        pass
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror}: {expected}") from None
    folder = path.parent
    while not present(folder):
        folder = folder.parent
    if not folder.is_dir():
        raise RecordError(f"{folder}: is no folder: {expected}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise RecordError(f"{folder}: cannot be written to: {expected}")


def require_kept(out: Path, files: Iterable[Path], sources: Iterable[Path]) -> None:
    """Refuse a folder ``out`` whose files, ``files``, would replace one of the sources.

    Raises
    ------
    RecordError
        One line with the source.
    """
    targets = {place(path) for path in files}
    for path in sources:
        if place(path) in targets:
            raise RecordError(f"{path}: --out {out} would replace it: expected another folder")


def write_files(files: Mapping[Path, str | bytes]) -> None:
    """Write texts, as UTF-8, and bytes, all or none: all are staged in their folders before any is replaced.

    Missing folders are created. A process that is killed leaves each file as it was or as it is to be, and perhaps
    staged ones in the same folder, whose names start with a dot: the next one that writes the files removes them.

    Raises
    ------
    RecordError
        A folder that cannot be written to, or a folder in the place of a file; existing files stay unchanged.
    """
    for path in files:
        if path.is_dir():
            raise RecordError(f"{path}: is a folder: expected the name of a file")
        if path.exists() and not path.is_file():
            raise RecordError(f"{path}: is no regular file: expected the name of a file")
    staged: dict[Path, Path] = {}
    for path, content in files.items():
        _require_utf8(path, content)
    try:
        for path, content in files.items():
            part = path.with_name(f".{path.name}.{os.getpid()}.part")
            path.parent.mkdir(parents=True, exist_ok=True)
            _remove_staged(path)
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


def _require_utf8(path: Path, content: str | bytes) -> None:
    if isinstance(content, bytes):
        return
    try:
        content.encode()
    except UnicodeEncodeError as error:
        found = quoted(content[max(0, error.start - 20) : error.start + 20])
        raise RecordError(f"{path}: would hold {found}, which is not UTF-8: expected names in UTF-8") from None


@contextmanager
def folder_beside(path: Path) -> Iterator[Path]:
    """Make a hidden folder next to a file, for programs that write the file in parts, and remove it afterwards.

    A process that is killed leaves it: the next one that writes the file removes it.
    """
    _remove_staged(path)
    folder = path.with_name(f".{path.name}.{os.getpid()}.part")
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _remove_staged(path: Path) -> None:
    """Remove what a process that is gone staged for a file."""
    for staged in path.parent.glob(f".{glob.escape(path.name)}.*"):
        number, _, kind = staged.name[len(path.name) + 2 :].partition(".")
        if kind in ("part", "old") and number.isdecimal() and not _runs(int(number)):
            if staged.is_dir():
                shutil.rmtree(staged, ignore_errors=True)
            else:
                staged.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    if os.name == "nt":  # where signal 0 is Ctrl-C
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:  # it belongs to somebody else
        pass
    return True


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
