"""The example of the README, run as it stands there: a rig with a hidden fault, its record, and its trace."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from docs.make.pages import DOCS
from fem_models.rig import Rig
from hysteresis import Record
from validation.tracing.outcome import Trace

README = DOCS.parent / "README.md"


@dataclass(frozen=True)
class Example:
    """What the code of the README makes: the rig as its file declares it, the loop with the fault, and the trace."""

    rig: Rig
    worn: Rig
    loop: Record
    found: Trace


def code_and_output(page: Path = README) -> tuple[str, str]:
    """Give the first Python block of a page, and the first block of text after it, which it prints.

    Raises
    ------
    ValueError
        A page without them.
    """
    match = re.search(r"```python\n(.*?)```.*?```text\n(.*?)```", page.read_text(encoding="utf-8"), re.S)
    if match is None:
        raise ValueError(f"{page}: expected a block of Python, then a block of text")
    return match[1], match[2]


def run_example() -> Example:
    """Run the example; its trace is kept where the README prints it."""
    code, _ = code_and_output()
    names: dict[str, object] = {"__name__": "__main__"}
    exec(compile(re.sub(r"print\((nb\.trace\(.*\))\)", r"found = \1", code), str(README), "exec"), names)
    rig, worn, loop, found = (names[name] for name in ("rig", "worn", "loop", "found"))
    assert isinstance(rig, Rig)
    assert isinstance(worn, Rig)
    assert isinstance(loop, Record)
    assert isinstance(found, Trace)
    return Example(rig, worn, loop, found)
