"""Docstrings as Markdown for the reference pages: roles such as ``:func:`a.b``` become code, examples a block."""

import re
from typing import Any

import griffe

_ROLE = re.compile(r":[a-z]+:`~?([^`]+)`")
_EXAMPLE = re.compile(r"(?:^>>> .*\n?)+", re.M)


def markdown(text: str) -> str:
    """Rewrite the text of a docstring."""
    return _EXAMPLE.sub(lambda found: f"```py\n{found[0].rstrip()}\n```\n", _ROLE.sub(r"`\1`", text))


class PlainDocstrings(griffe.Extension):
    """Rewrites every docstring that mkdocstrings reads."""

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """Change the docstrings of a package that has been read."""
        _rewrite(pkg)


def _rewrite(thing: griffe.Object) -> None:
    """Rewrite the docstrings of a module, a class or a function and of all that is defined in it."""
    if thing.docstring is not None:
        thing.docstring.value = markdown(thing.docstring.value)
    for member in thing.members.values():
        if isinstance(member, griffe.Object):  # not a name that is only imported
            _rewrite(member)
