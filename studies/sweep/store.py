"""Finished cases in one SQLite file, which survives a killed process, a crash of the machine and a full disk.

Only the process that runs the study writes. Each answer of a worker is one transaction, together with the cases that
are handed out next: if the process dies, at most the cases in flight are lost.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from studies.sweep.cases import Outcome
from studies.sweep.errors import DiskFullError, StudyError

FILE = "cases.sqlite"
_TABLE = """
CREATE TABLE IF NOT EXISTS cases (
    key TEXT PRIMARY KEY,      -- sha256 of the inputs
    point TEXT NOT NULL,       -- JSON: what was varied
    status TEXT NOT NULL,      -- running, ok or failed; running after the end of a study: it was killed
    attempts INTEGER NOT NULL, -- how often it was handed out
    message TEXT NOT NULL DEFAULT '',
    wall_s REAL,
    quantities TEXT            -- JSON; Python writes floats so that they read back to the last bit
) WITHOUT ROWID
"""


@dataclass(frozen=True)
class Counts:
    """Number of cases by status, and how often cases were handed out in all."""

    by_status: dict[str, int]
    attempts: int


class Store:
    """The cases of a folder; one process at a time can open it. See :func:`open_store`."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            # unlike a write-ahead log, which has to be merged, a rollback journal needs no room on the disk
            self._db = sqlite3.connect(self.path, isolation_level=None, timeout=0.0)
            for setting in ("locking_mode = EXCLUSIVE", "journal_mode = TRUNCATE", "synchronous = FULL"):
                self._db.execute(f"PRAGMA {setting}").fetchall()
            known = {name for (name,) in self._db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            if known and "cases" not in known:
                raise StudyError(f"{self.path}: another database: expected the store of a study")
            with self.transaction():
                self._db.execute(_TABLE)
        except sqlite3.Error as error:
            raise self._explain(error) from None
        except OSError as error:
            raise StudyError(f"{folder}: {error.strerror}: expected a folder that can be written to") from None

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Keep everything that the block writes, or nothing of it.

        Raises
        ------
        StudyError
            A full disk, or a file in use by another study; what was stored before is kept.
        """
        try:
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._db.execute("COMMIT")
            except BaseException:
                if self._db.in_transaction:
                    self._db.execute("ROLLBACK")
                raise
        except sqlite3.Error as error:
            raise self._explain(error) from None

    def hand_out(self, cases: Iterable[tuple[str, Mapping[str, float]]]) -> None:
        """Record the cases that go to a worker, by key and point."""
        self._db.executemany(
            "INSERT INTO cases (key, point, status, attempts) VALUES (?, ?, 'running', 1) "
            "ON CONFLICT (key) DO UPDATE SET status = 'running', attempts = attempts + 1",
            [(key, json.dumps(dict(point))) for key, point in cases],
        )

    def keep(self, outcomes: Iterable[Outcome]) -> None:
        """Store the outcomes of cases that were handed out."""
        self._db.executemany(
            "UPDATE cases SET status = ?, message = ?, wall_s = ?, quantities = ? WHERE key = ?",
            [(o.status, o.message, o.wall_s, json.dumps(o.quantities), o.key) for o in outcomes],
        )

    def find(self, key: str) -> Outcome | None:
        """Give a finished case, ok or failed; None if it is not there or was in flight."""
        try:
            row = self._db.execute(
                "SELECT status, message, wall_s, quantities FROM cases WHERE key = ? AND status != 'running'", (key,)
            ).fetchone()
        except sqlite3.Error as error:
            raise self._explain(error) from None
        if row is None:
            return None
        return self._outcome(key, *row)

    def _outcome(self, key: str, status: object, message: object, wall_s: object, quantities: object) -> Outcome:
        """Make the outcome of a row; SQLite keeps any type in a column, and no NaN: the time of a worker that died."""
        wall_s = math.nan if wall_s is None else wall_s
        try:
            numbers = json.loads(str(quantities))
        except (ValueError, RecursionError):
            numbers = None
        floats = isinstance(numbers, dict) and set(map(type, numbers.values())) <= {int, float}
        if not floats or status not in ("ok", "failed") or not isinstance(wall_s, int | float):
            raise StudyError(f"{self.path}: case {key[:12]}...: spoiled: expected the store of a study")
        return Outcome(key, str(status), str(message), wall_s, numbers)

    def counts(self) -> Counts:
        """Count the cases."""
        by_status = dict(self._db.execute("SELECT status, COUNT(*) FROM cases GROUP BY status").fetchall())
        (attempts,) = self._db.execute("SELECT COALESCE(SUM(attempts), 0) FROM cases").fetchone()
        return Counts(by_status, attempts)

    def _explain(self, error: sqlite3.Error) -> StudyError:
        name = getattr(error, "sqlite_errorname", "")
        if name.startswith("SQLITE_BUSY"):
            return StudyError(f"{self.path}: in use: expected no other study running in this folder")
        if name.startswith(("SQLITE_FULL", "SQLITE_IOERR")):
            return DiskFullError(
                f"{self.path}: {error}: expected room; the stored cases are kept, run the study again to go on"
            )
        return StudyError(f"{self.path}: {error}: expected the store of a study")


@contextmanager
def open_store(folder: Path) -> Iterator[Store]:
    """Open the store of a folder; it is created if it is missing."""
    store = Store(folder)
    try:
        yield store
    finally:
        store.close()
