"""What comes after a result: figures, pages, second opinions. One that fails is a line, and the result stays."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from hysteresis.messages import failure

Made = TypeVar("Made")
Instead = TypeVar("Instead")


def attempt(what: str, make: Callable[[], Made], instead: Instead, failed: list[str]) -> Made | Instead:
    """Make something that a result can do without.

    Any error counts, also one that nobody thought of: minutes of computing stand behind the result. Ctrl-C passes.

    Parameters
    ----------
    what
        Beginning of the line that says what is missing, such as "no identify.png".
    instead
        What is given where it cannot be made.
    failed
        Takes the line: what is missing, the type of the error and its first line.
    """
    try:
        return make()
    except Exception as error:
        failed.append(f"{what}: {failure(error)}")
        return instead
