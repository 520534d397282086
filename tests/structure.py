"""Measure the structure of the code: ``python tests/structure.py`` prints it, and ``tests/test_structure.py`` holds it.

Rooms (folders) stay small, files and functions short, signatures narrow, and no modules import each other in a circle.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("hysteresis", "fem_models", "validation", "studies")
PLACES = (*PACKAGES, "benchmarks", "docs")
MOST_PARAMETERS = 8
MOST_OF_FUNCTION, MOST_OF_KERNEL = 60, 80
MOST_BARE_DICTS = 17
BARE_DICTS = ("dict", "dict[str, Any]", "dict[str, object]", "Mapping[str, Any]", "Tables")
FIXED_SIGNATURES = "mbs"
"""First parameter of a function whose signature Exudyn prescribes."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Found:
    """What a rule measured: where, and how much."""

    where: str
    count: int

    def __str__(self) -> str:
        """One line."""
        return f"{self.where}: {self.count}"


def sources() -> list[Path]:
    """All Python files but tests, and the front door."""
    files = [path for place in PLACES for path in sorted((ROOT / place).rglob("*.py"))]
    return files + [path for path in (ROOT / "notchbend.py",) if path.exists()]


def functions() -> Iterator[tuple[str, Function]]:
    """All functions with where they stand."""
    for path in sources():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, Function):
                yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", node


def wide_signatures() -> list[Found]:
    """Functions with too many parameters, ``self`` and ``cls`` not counted."""
    found = []
    for where, node in functions():
        a = node.args
        names = [one.arg for one in (*a.posonlyargs, *a.args, *a.kwonlyargs)]
        if names[:1] in (["self"], ["cls"]):
            names = names[1:]
        if len(names) > MOST_PARAMETERS and names[0] != FIXED_SIGNATURES:
            found.append(Found(where, len(names)))
    return found


def is_kernel(node: Function) -> bool:
    """Tell whether a function is compiled by numba."""
    return any("njit" in ast.unparse(decorator) for decorator in node.decorator_list)


def long_functions() -> list[Found]:
    """Functions with too many lines; kernels may be longer."""
    found = [(where, node, (node.end_lineno or 0) - node.lineno + 1) for where, node in functions()]
    return [
        Found(where, lines)
        for where, node, lines in found
        if lines > (MOST_OF_KERNEL if is_kernel(node) else MOST_OF_FUNCTION)
    ]


def bare_dicts() -> list[Found]:
    """Functions that return a dictionary without a type for its values."""
    return [
        Found(where, 1)
        for where, node in functions()
        if node.returns is not None and ast.unparse(node.returns).removesuffix(" | None") in BARE_DICTS
    ]


def imports() -> dict[str, set[str]]:
    """Give the modules of the packages, each with the ones that it imports, inside functions too."""
    files = {_module(path): path for package in PACKAGES for path in (ROOT / package).rglob("*.py")}
    out: dict[str, set[str]] = {}
    for name, path in files.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        typing_only = {
            id(inner)
            for node in ast.walk(tree)
            if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
            for inner in ast.walk(node)
        }
        wanted: set[str] = set()
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module and id(node) not in typing_only:
                wanted |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
            elif isinstance(node, ast.Import):
                wanted |= {alias.name for alias in node.names}
        out[name] = {module for module in wanted if module in files and module != name}
    return out


def _module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def circles() -> list[Found]:
    """Modules that import each other in a circle: strongly connected components (Tarjan) of more than one."""
    graph = imports()
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[Found] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in sorted(graph[name]):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            start = stack.index(name)
            members = stack[start:]
            del stack[start:]
            if len(members) > 1:
                found.append(Found(" <-> ".join(sorted(members)), len(members)))

    for name in sorted(graph):
        if name not in index:
            visit(name)
    return found


RULES = {
    f"signatures with more than {MOST_PARAMETERS} parameters": (wide_signatures, 0),
    f"functions above {MOST_OF_FUNCTION} lines, kernels above {MOST_OF_KERNEL}": (long_functions, 0),
    "functions that return a bare dict": (bare_dicts, MOST_BARE_DICTS),
    "import circles": (circles, 0),
}
"""What is measured, and how many findings are allowed."""


def main() -> None:
    """Print every rule with what breaks it."""
    for name, (measure, most) in RULES.items():
        found = measure()
        print(f"{name}: {len(found)} (allowed {most})")
        print(*(f"  {one}" for one in found), sep="\n", end="\n" if found else "")


if __name__ == "__main__":
    main()
