"""The modules whose tests are measured, in groups, and where their tests are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Group:
    """Modules that are measured together.

    Parameters
    ----------
    name
        In the table of the page.
    modules
        Patterns of files.
    near
        Folders of their tests, the nearest first.
    """

    name: str
    modules: tuple[str, ...]
    near: tuple[str, ...]

    def files(self, root: Path = ROOT) -> list[str]:
        """Modules of the group with something in them, by their path in the project."""
        found = [path for pattern in self.modules for path in sorted(root.glob(pattern))]
        return [path.relative_to(root).as_posix() for path in found if path.name != "__init__.py"]


_CHAIN = ("equations", "laws", "newton", "follow", "moved", "turns", "section", "fibres", "sweep")

GROUPS = {
    group.name: group
    for group in (
        Group("hysteresis", ("hysteresis/**/*.py",), ("tests/hysteresis",)),
        Group(
            "tracer",
            (
                "validation/tracing/fitting/*.py",
                "validation/tracing/verdict.py",
                "validation/tracing/search/by_folds.py",
            ),
            ("tests/validation/tracing",),
        ),
        Group(
            "joint",
            tuple(f"fem_models/joint/{name}.py" for name in ("flexure", "section", "segments")),
            ("tests/fem_models/joint",),
        ),
        Group(
            "chain",
            tuple(f"fem_models/chain/{name}.py" for name in _CHAIN),
            ("tests/fem_models/chain", "tests/fem_models"),
        ),
    )
}
