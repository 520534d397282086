"""Writes the tables of ``docs/reference/notchbend.md`` from the docstrings: ``python -m docs.make.reference``.

The page can then be read where nothing renders ``:::``, such as on a host of the repository.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping

import notchbend
from docs.make.pages import DOCS, put_between_marks, table

PAGE = DOCS / "reference" / "notchbend.md"
COMMAND = "docs.make.reference"
TASKS: Mapping[str, tuple[str, ...]] = {
    "Rigs": ("preset", "read_rig", "ensemble"),
    "Motions of the drive": ("triangle", "sine", "calibrate"),
    "Records": ("simulate", "read_record", "write_record"),
    "Questions to a record or a rig": ("identify", "identify_each", "trace", "separate", "follow"),
    "Use": ("compensate", "study", "plot", "export"),
}
"""Functions by what a reader wants to do. A public function that is missing here stops the command and fails a test."""

_SHORT = 40
"""Longest default that is shown as it is written, characters."""


def public_functions() -> dict[str, Callable[..., object]]:
    """Functions of :mod:`notchbend` by name."""
    return {name: thing for name in notchbend.__all__ if inspect.isfunction(thing := getattr(notchbend, name))}


def public_classes() -> dict[str, type]:
    """Classes of :mod:`notchbend` by name, errors last."""
    found = {name: thing for name in notchbend.__all__ if inspect.isclass(thing := getattr(notchbend, name))}
    return dict(sorted(found.items(), key=lambda entry: issubclass(entry[1], Exception)))


def tables() -> str:
    """Markdown of all public names: an overview, then each function with its arguments, its result and an example.

    Raises
    ------
    ValueError
        ``TASKS`` lacks a function, or has one that is not public.
    """
    functions = public_functions()
    sorted_in = [name for names in TASKS.values() for name in names]
    if set(sorted_in) != set(functions):
        raise ValueError(f"TASKS: expected each public function once: {set(sorted_in) ^ set(functions)}")
    blocks = [_overview(functions)]
    for task, names in TASKS.items():
        blocks += [f"## {task}", *(_function(name, functions[name]) for name in names)]
    classes = [[f"`nb.{name}`", _summary(thing)] for name, thing in public_classes().items()]
    return "\n\n".join([*blocks, "## Types and errors", table(["name", "is"], classes)])


def _overview(functions: Mapping[str, Callable[..., object]]) -> str:
    rows = [
        [f"[`nb.{name}`](#nb{name})", _summary(functions[name]), _returned(functions[name])]
        for names in TASKS.values()
        for name in names
    ]
    return table(["function", "does", "returns"], rows)


def _function(name: str, function: Callable[..., object]) -> str:
    parts = _sections(function)
    arguments = _arguments(function, parts["Parameters"])
    returned = _plain(re.sub(r"^\w+\n(?=    )", "", parts.get("Returns", "")))
    more = f": {returned[0].lower()}{returned[1:]}" if returned else "."
    words = f"Returns {_returned(function)}{more}"
    blocks = [f"### nb.{name}", _summary(function), table(["argument", "default", "is"], arguments), words]
    return "\n\n".join([*blocks, f"```pycon\n{parts['Examples'].strip()}\n```"])


def _arguments(function: Callable[..., object], described: str) -> list[list[str]]:
    """One row an argument; two that the docstring describes together share a row."""
    defaults = inspect.signature(function).parameters
    rows = []
    for names, text in re.findall(r"^(\S.*)\n((?:    .*\n?)+)", described, re.M):
        each = names.split(", ")
        rows.append([", ".join(f"`{one}`" for one in each), ", ".join(_default(defaults[one]) for one in each), text])
    return [[names, default, _plain(text)] for names, default, text in rows]


def _default(parameter: inspect.Parameter) -> str:
    if parameter.default is inspect.Parameter.empty:
        return "-"
    shown = repr(parameter.default)
    return f"`{shown}`" if len(shown) <= _SHORT else f"`{type(parameter.default).__name__}(...)`"


def _returned(thing: Callable[..., object]) -> str:
    return f"`{str(inspect.signature(thing).return_annotation).strip(chr(39))}`"


def _summary(thing: object) -> str:
    """Return the first line of a docstring."""
    return _plain((inspect.getdoc(thing) or "").split("\n\n")[0])


def _sections(thing: object) -> dict[str, str]:
    """Text of the sections of a docstring in the numpy style, by their headings."""
    parts = re.split(r"^(\w+)\n-{3,}\n", inspect.getdoc(thing) or "", flags=re.M)
    return dict(zip(parts[1::2], (part.rstrip() + "\n" for part in parts[2::2]), strict=True))


def _plain(text: str) -> str:
    """One line of Markdown: roles as code, and nothing that would end a cell of a table."""
    as_code = re.sub(r":[a-z]+:`~?([^`]+)`", r"`\1`", text).replace("``", "`")
    return " ".join(as_code.replace("|", "\\|").split())


if __name__ == "__main__":
    put_between_marks(PAGE, COMMAND, f"\n{tables()}\n")
