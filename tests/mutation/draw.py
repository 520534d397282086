"""Draw small faults at random: statements of the listed modules in equal shares, and one change in each."""

from __future__ import annotations

import ast
import difflib
import random
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

MISSING = "cosmic-ray is not installed: expected `pip install cosmic-ray` in this environment"

_SENSELESS = re.compile(
    r"RShift|LShift|_Mod$|FloorDiv$|BinaryOperator_(Add|Sub|Mul|Div|Pow)_Bit|ReplaceUnaryOperator_\w+_(Invert|Not)$"
    r"|ComparisonOperator_(?!Is)\w+_Is|ComparisonOperator_Is_(?!IsNot)|ComparisonOperator_IsNot_(?!Is$)"
    r"|RemoveDecorator|Variable"
)
"""Changes that nearly always end in a TypeError, so that any test notices: they would flatter the score."""


@dataclass(frozen=True)
class Mutant:
    """One change of one file.

    Parameters
    ----------
    occurrence
        Number of the place in the file among those where the operator applies.
    first, last
        Lines of the statement.
    """

    group: str
    module: str
    operator: str
    occurrence: int
    line: int
    first: int
    last: int

    @property
    def name(self) -> str:
        """What it is known by in the table of results."""
        return f"{self.module}:{self.line} {self.operator.removeprefix('core/')} {self.occurrence}"


def changed(source: str, operator: str, occurrence: int) -> str:
    """Give the source with one change."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    code = mutate_code(source, get_operator(operator)(), occurrence)
    if code is None:
        raise ValueError(f"{operator}, occurrence {occurrence}: expected a place where it applies")
    return str(code)


def difference(before: str, after: str) -> list[str]:
    """Lines that were taken out and put in."""
    rows = difflib.unified_diff(before.splitlines(), after.splitlines(), n=0, lineterm="")
    return [row for row in list(rows)[2:] if not row.startswith("@@")]


def drawn(group: str, files: list[str], root: Path, count: int, seed: int) -> list[Mutant]:
    """Draw ``count`` statements of the files that can be changed, and one change in each.

    Every statement is as likely as another: a module gets mutants in proportion to its statements.
    """
    random_ = random.Random(f"{seed} {group}")
    statements: dict[tuple[str, int], list[Mutant]] = {}
    for module in files:
        for mutant in mutants_of(group, module, (root / module).read_text(encoding="utf-8")):
            statements.setdefault((module, mutant.first), []).append(mutant)
    chosen = random_.sample(sorted(statements), min(count, len(statements)))
    found = [_sound(_one_of(statements[key], random_), statements[key], root) for key in chosen]
    return [mutant for mutant in found if mutant is not None]


def _sound(mutant: Mutant, others: list[Mutant], root: Path) -> Mutant | None:
    """Give the mutant, or another one of its statement where it is no Python (`*` for the `**` of a dictionary)."""
    source = (root / mutant.module).read_text(encoding="utf-8")
    for one in (mutant, *random.Random(mutant.name).sample(others, len(others))):
        with suppress(SyntaxError):
            compile(changed(source, one.operator, one.occurrence), one.module, "exec")
            return one
    return None


def _one_of(mutants: list[Mutant], random_: random.Random) -> Mutant:
    """Draw a kind of operator first: a comparison has six changes and a number two."""
    kinds = sorted({_kind(m) for m in mutants})
    kind = random_.choice(kinds)
    return random_.choice([m for m in mutants if _kind(m) == kind])


def _kind(mutant: Mutant) -> str:
    return mutant.operator.partition("_")[0]


def mutants_of(group: str, module: str, source: str) -> Iterator[Mutant]:
    """All changes of a file where one means something: no docstrings, annotations, decorators, words of errors."""
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.plugins import get_operator, operator_names

    tree, statements = ast.parse(source), {}
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt):
            for line in range(node.lineno, _head_end(node) + 1):
                statements[line] = (node.lineno, _head_end(node))
    left_out, rows = _left_out(tree), source.splitlines()
    nodes = list(ast_nodes(get_ast(source)))
    for name in sorted(n for n in operator_names() if not _SENSELESS.search(n)):
        operator = get_operator(name)()
        places = [place for node in nodes for place in operator.mutation_positions(node)]
        for occurrence, (start, end) in enumerate(places):
            marker = "Binary" in name and rows[end[0] - 1][end[1] :].lstrip().startswith(",")  # def f(a, *, b)
            if start[0] in statements and not marker and not any(low <= start < high for low, high in left_out):
                yield Mutant(group, module, name, occurrence, start[0], *statements[start[0]])


def _head_end(node: ast.stmt) -> int:
    """Last line of a statement, less the statements inside it."""
    body = getattr(node, "body", None)
    if isinstance(body, list) and body:
        return max(node.lineno, min(body[0].lineno - 1, node.end_lineno or node.lineno))
    return node.end_lineno or node.lineno


def _left_out(tree: ast.Module) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    nodes: list[ast.AST] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            nodes += node.decorator_list
        if isinstance(node, ast.FunctionDef) and node.returns:
            nodes.append(node.returns)
        if isinstance(node, ast.arg | ast.AnnAssign) and node.annotation:
            nodes.append(node.annotation)
        if isinstance(node, ast.Raise) and node.exc:
            nodes.append(node.exc)
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            nodes.append(node)
        if isinstance(node, ast.keyword) and node.arg == "strict":  # of zip: an assertion
            nodes.append(node)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            nodes.append(node)
    return [((n.lineno, n.col_offset), (n.end_lineno, n.end_col_offset)) for n in nodes]  # type: ignore[attr-defined]
