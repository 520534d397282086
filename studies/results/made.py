"""How results were made: the key ``made`` of the files of all commands."""

from __future__ import annotations

import re
import shlex
import subprocess
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from hysteresis.messages import quoted

MOST_COMMAND = 2**20
"""Characters of the longest command that is stored."""
_DATE, _COMMIT = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d UTC"), re.compile(r"[0-9a-f]{0,40}")


@dataclass(frozen=True)
class Made:
    """How results were made: the command as it was given, the date, and the commit, empty outside a checkout.

    Raises
    ------
    ValueError
        A command that is not one call of notchbend with its words quoted, a date or a commit of another form.
    """

    command: str
    date: str
    commit: str

    def __post_init__(self) -> None:
        expected = f"one call of notchbend, its words quoted, at most {MOST_COMMAND} characters"
        known = len(self.command) <= MOST_COMMAND and self.command.startswith("notchbend ")
        if not known or not _is_one_call(self.command):  # a page that was sent must not have others run its commands
            raise ValueError(f"command = {quoted(self.command, 40)}: expected {expected}")
        if not _DATE.fullmatch(self.date):
            raise ValueError(f"date = {quoted(self.date, 40)}: expected the form 2026-01-31 12:00 UTC")
        if not _COMMIT.fullmatch(self.commit):
            raise ValueError(f"commit = {quoted(self.commit, 40)}: expected at most 40 hexadecimal digits")


def _is_one_call(command: str) -> bool:
    """Tell whether a shell takes every word as it is written: no second command, no variable, no pattern."""
    try:
        return shlex.join(shlex.split(command)) == command
    except ValueError:  # a quotation mark that is not closed
        return False


def made_now(command: str) -> Made | None:
    """Say with which command, when, and by which commit of a checkout results are made.

    None where there is no command, as in a call from Python, or a longer one than :data:`MOST_COMMAND`.
    """
    if not 0 < len(command) <= MOST_COMMAND:
        return None
    root = Path(__file__).resolve().parents[2]
    commit = ""
    if (root / ".git").exists():
        try:
            asked = ["git", "-C", str(root), "rev-parse", "--short", "HEAD"]
            commit = subprocess.run(asked, capture_output=True, text=True, timeout=5, check=False).stdout.strip()
        except (OSError, subprocess.TimeoutExpired):
            commit = ""
    return Made(command, datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"), commit)


def made_entry(made: Made | None) -> dict[str, dict[str, str]]:
    """Give the key ``made`` of a JSON file with its texts; nothing where that is None."""
    return {} if made is None else {"made": asdict(made)}
