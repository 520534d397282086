"""Spoil files, read them by the commands, and count what happens."""

from __future__ import annotations

import io
import random
import shutil
import signal
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import studies.sweep
from fem_models.rig.of_record import rig_of
from hysteresis.records.path import require_reversal
from hysteresis.records.record import Record
from malformed.samples import Reader
from malformed.spoil import spoil
from studies.commands import separation, tracing
from studies.commands.cli import call
from studies.sweep import StudyError
from validation.tracing.baseline.in_space import space_problem

MOST_S = 5.0
"""Most computing time of a command."""
HANGS_S = 30.0
"""Time of the clock after which a command counts as waiting, whatever it computes: the machine may be shared."""
MOST_CHARACTERS = 300
TAKEN = "the study was read"


class SlowError(BaseException):
    """A command that takes too long."""


@dataclass(frozen=True)
class Tried:
    """A spoiled file and what became of it: refused, taken, traceback, slow, or a refusal that is not one line."""

    reader: str
    file: str
    way: str
    outcome: str
    words: str
    seconds: float

    @property
    def good(self) -> bool:
        """Whether that is as promised."""
        return self.outcome in ("refused", "taken")


def try_all(readers: list[Reader], count: int, seed: int, work: Path) -> Iterator[Tried]:
    """Spoil ``count`` files, one at a time, over all readers in turn; each comes from a generator of its own."""
    with _read_only():
        for i in range(count):
            rng = random.Random(f"{seed}-{i}")
            reader = readers[i % len(readers)]
            at = work / "at"
            shutil.copytree(reader.folder, at)
            name = rng.choice(reader.files)
            way = spoil(at / name, rng)
            yield _tried(reader, name, way, at)
            shutil.rmtree(at)


def try_good(readers: list[Reader], work: Path) -> list[Tried]:
    """Read the files as they are: all are taken, and what is compiled at first use is compiled."""
    with _read_only():
        tried = []
        for reader in readers:
            at = work / f"good-{reader.name}"
            shutil.copytree(reader.folder, at)
            tried.append(_tried(reader, "", "as it is", at, 600.0))
    return tried


def _taken(*_: object, **__: object) -> None:
    raise StudyError(TAKEN)


def _read(records: Sequence[Record], **_: object) -> None:
    for record in records:
        rig_of(record)
        require_reversal(record)
    raise StudyError(TAKEN)


def _read_in_space(records: Sequence[Record], **_: object) -> None:
    space_problem(records)
    raise StudyError(TAKEN)


@contextmanager
def _read_only() -> Iterator[None]:
    """Files are read and checked, and nothing long is computed."""
    with (
        patch.dict(studies.sweep.__dict__, {"run_study": _taken}),
        patch.object(separation, "separate_records", _read),
        patch.object(tracing, "trace_records", _read_in_space),
    ):
        yield


def _tried(reader: Reader, name: str, way: str, at: Path, most_s: float = MOST_S) -> Tried:
    out, err, start, code = io.StringIO(), io.StringIO(), time.process_time(), None
    try:
        with _limit(max(most_s, HANGS_S)), redirect_stdout(out), redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("always")
            code = call(reader.arguments(at))
        outcome, words = "", err.getvalue()
    except SlowError:
        outcome, words = "slow", ""
    except BaseException:
        outcome, words = "traceback", traceback.format_exc()
    seconds = time.process_time() - start
    if seconds > most_s:
        outcome = "slow"
    if not outcome:
        line = words.startswith("notchbend: ") and words.count("\n") == 1 and len(words) <= MOST_CHARACTERS
        taken = TAKEN in words or (code == 0 and not words)
        outcome = "taken" if taken else "refused" if line and code == 2 else "not one line"
    return Tried(reader.name, name, way, outcome, words, seconds)


@contextmanager
def _limit(seconds: float) -> Iterator[None]:
    def stop(*_: object) -> None:
        raise SlowError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def table(tried: list[Tried]) -> str:
    """Give what happened by reader, as a table of the documentation."""
    counts = Counter((one.reader, one.outcome) for one in tried)
    rows = ["| reader | files | refused | taken | tracebacks | over 5 s | refusal not one line | slowest, s |"]
    rows.append("|---|---|---|---|---|---|---|---|")
    for reader in [*dict.fromkeys(one.reader for one in tried), None]:
        mine = [one for one in tried if reader in (one.reader, None)]
        cells = [sum(n for (r, o), n in counts.items() if reader in (r, None) and o == outcome)
                 for outcome in ("refused", "taken", "traceback", "slow", "not one line")]  # fmt: skip
        slowest = max(one.seconds for one in mine)
        rows.append(f"| {reader or 'all'} | {len(mine)} | {' | '.join(map(str, cells))} | {slowest:.1f} |")
    return "\n".join(rows)
