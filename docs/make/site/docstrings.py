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

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Change the docstring of one module, class, function or attribute."""
        if obj.docstring is not None:
            obj.docstring.value = markdown(obj.docstring.value)
