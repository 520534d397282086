"""Download a measured record from its public repository, check it and write it as a record.

None of the data is part of this project. A file is taken at a fixed commit and must have the sha256 of the catalogue,
so that the same name gives everybody the same record.
"""

from __future__ import annotations

import difflib
import logging
from collections.abc import Callable, Iterable
from pathlib import Path
from urllib.parse import urlsplit

from hysteresis.extras import require_extra
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import files_of_record, read_record, write_record
from studies.fetch.catalogue import CATALOGUE, SOURCES_ONLY, Entry

RAW = "https://raw.githubusercontent.com"
TIMEOUT_S = 10.0


class FetchError(RecordError):
    """A record that cannot be fetched; one line with its name, its address, what failed, its source and licence."""


def fetch_record(
    name: str, folder: Path, *, cache: Path | None = None, allow: Callable[[Iterable[Path]], None] = lambda _: None
) -> Path:
    """Fetch a measured record and write it as CSV with its sidecar.

    Parameters
    ----------
    name
        A key of ``CATALOGUE``.
    folder
        Where ``<name>.csv`` and ``<name>.toml`` go; made if it is not there.
    cache
        Where upstream files are kept, by default the user's cache folder. A file that is there is not fetched again.

    allow
        Called with the files to be replaced, if ``<name>.csv`` is there and is another record; it raises to keep them.

    Returns
    -------
    Path
        The CSV.

    Raises
    ------
    FetchError
        An unknown name, no connection, a file that is not the one of the catalogue.
    RecordError
        A folder that cannot be written to.
    MissingError
        A library of the extra ``data`` is missing.
    """
    if name not in CATALOGUE:
        raise FetchError(_no_such(name))
    require_extra("data", "records from public repositories")
    entry = CATALOGUE[name]
    upstream = _download(entry, cache or _cache())
    samples = vars(entry.read(upstream))
    record = Record(**samples, title=entry.title, drive_unit=entry.drive_unit, tube=entry.tube, notch=entry.notch)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FetchError(f"{folder}: {error.strerror}: expected a folder that can be made") from None
    path = folder / f"{name}.csv"
    if not _is_there(record, path):
        allow(files_of_record(path))
        write_record(record, path)
    return path


def _cache() -> Path:
    import platformdirs

    return platformdirs.user_cache_path("notchbend", appauthor=False)


def _is_there(record: Record, path: Path) -> bool:
    try:
        return read_record(path) == record
    except RecordError:
        return False


def _no_such(name: str) -> str:
    if name in SOURCES_ONLY:
        return f"{name}: not fetched, it is no bending record; source: {SOURCES_ONLY[name]}"
    near = difflib.get_close_matches(name, CATALOGUE, n=3, cutoff=0.5) or list(CATALOGUE)
    return f"{name}: no such record: expected one of {', '.join(near)}"


def address(entry: Entry) -> str:
    """Address of the upstream file at the fixed commit."""
    return f"{RAW}/{entry.place}"


def _download(entry: Entry, cache: Path) -> Path:
    import pooch

    pooch.get_logger().setLevel(logging.WARNING)  # it announces every download on standard error
    try:
        return Path(
            pooch.retrieve(
                address(entry),
                known_hash=f"sha256:{entry.sha256}",
                fname=f"{entry.sha256[:12]}-{Path(entry.path).name}",
                path=cache,
                downloader=pooch.HTTPDownloader(timeout=TIMEOUT_S),
            )
        )
    except (OSError, ValueError) as error:
        where = f"{entry.path} of github.com/{entry.repository.owner_name} at {entry.repository.commit[:7]}"
        raise FetchError(
            f"{entry.name}: {_reason(error, entry)}; wanted {where}; source: {entry.citation}; licence: {entry.licence}"
        ) from None


def _reason(error: Exception, entry: Entry) -> str:
    import requests

    host = urlsplit(address(entry)).netloc
    match error:
        case requests.Timeout():
            return f"no answer from {host} within {TIMEOUT_S:g} s"
        case requests.ConnectionError():
            return f"no connection to {host}"
        case requests.HTTPError(response=response) if response is not None:
            return f"{host} answered {response.status_code} {response.reason}"
        case requests.RequestException():
            return f"{type(error).__name__} from {host}"
        case OSError():
            return f"{error.filename}: {error.strerror}"
        case _:  # pooch: the hash differs
            return f"not the file of the catalogue, expected sha256 {entry.sha256[:12]}..."
