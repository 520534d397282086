"""Write the tables of docs/develop/dependencies.md: every library, its licence, its size and why it is there.

``python -m docs.make.release.dependencies``, in an environment with all extras: ``make dev``. Reasons are the comments
of pyproject.toml, licences those of the libraries' metadata. A size is that of the files of the library itself, without
what it brings along and without bytecode.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from docs.make.pages import DOCS, put_between_marks, table

PAGE = DOCS / "develop" / "dependencies.md"
PROJECT = DOCS.parent / "pyproject.toml"
PLAIN = "plain"
BROUGHT = {
    "llvmlite": "compiler of numba",
    "moocore": "brought by pymoo: hypervolumes and non-dominated sets",
    "pillow": "brought by matplotlib: pictures",
}
"""Libraries that others bring, and that who reads licences or sizes asks for."""
LONGEST = 40


@dataclass(frozen=True)
class Library:
    """A library that pyproject.toml asks for, and the comment behind it."""

    group: str
    name: str
    why: str


def libraries() -> list[Library]:
    """Give the libraries of pyproject.toml, those of a plain installation first."""
    text = PROJECT.read_text(encoding="utf-8")
    project = tomllib.loads(text)["project"]
    groups = {PLAIN: project["dependencies"], **project["optional-dependencies"]}
    names = [
        (group, re.split(r"[^A-Za-z0-9_.-]", one)[0])
        for group, wanted in groups.items()
        for one in wanted
        if not one.startswith(f"{project['name']}[")
    ]
    return [Library(group, name, _comment(text, name)) for group, name in names]


def _comment(text: str, name: str) -> str:
    found = re.search(rf'"{re.escape(name)}[^A-Za-z0-9_.-][^#\n]*#\s*(.+)$', text, re.MULTILINE)
    return found[1].strip() if found else ""


def licence(name: str) -> str | None:
    """Licence in the metadata of an installed library, None for one that is not installed."""
    try:
        data = distribution(name).metadata
    except PackageNotFoundError:
        return None
    lines = (data.get("License-Expression") or data.get("License") or "").strip().splitlines()
    if lines and len(lines[0]) <= LONGEST:
        return lines[0]
    named = [one.rsplit(" :: ", 1)[-1] for one in data.get_all("Classifier") or [] if one.startswith("License ::")]
    return ", ".join(named) or "not stated"


def size_MB(name: str) -> float:
    """Size of the files of an installed library, MB."""
    files = [file.locate() for file in distribution(name).files or [] if file.suffix != ".pyc"]
    return sum(Path(str(file)).stat().st_size for file in files if Path(str(file)).is_file()) / 2**20


def rows() -> list[list[str]]:
    """Give the rows of the table."""
    found = [*libraries(), *(Library("with others", name, why) for name, why in BROUGHT.items())]
    return [
        [one.group, one.name, licence(one.name) or "", f"{size_MB(one.name):.0f}" if licence(one.name) else "", one.why]
        for one in found
    ]


if __name__ == "__main__":
    put_between_marks(
        PAGE, "docs.make.release.dependencies", table(["group", "library", "licence", "MB", "why"], rows())
    )
