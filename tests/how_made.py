"""What results and their page say of how they were made: the same command, with the date, and it is the one given."""

import html
import json
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from studies.results.made import Made

MADE = Made("notchbend trace bench.csv --out DIR", "2026-11-23 08:00 UTC", "0123abc")


def printed(file: Path, page: str, given: Sequence[object]) -> list[str]:
    """Check the key ``made`` of a file, and the head of its page; give the words of the printed command to run it."""
    made = json.loads(file.read_text())["made"]
    assert re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d UTC", made["date"])
    head = html.unescape(re.search(r"<header>.*?</header>", page, re.S)[0])
    assert f"{made['date']}" in head
    assert f"commit {made['commit']}," in head or not made["commit"]
    command = re.search(r"Made by <code>(.*?)</code>", head)[1]
    assert made["command"] == command
    words = shlex.split(command)
    assert words == ["notchbend", *map(str, given)]
    return words[1:]
