"""Arguments of public functions and classes: one of a wrong type is refused in a line that names it."""

from __future__ import annotations

import functools
import inspect
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin

import numpy as np

from hysteresis.messages import quoted

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")
Given = TypeVar("Given", bound=type)

_ACCEPTED: dict[object, tuple[tuple[type, ...], str]] = {
    bool: ((bool, np.bool_, int), "True or False"),
    int: ((int, Integral), "a whole number"),
    float: ((float,), "a number"),  # and what converts to one
    str: ((str,), "a text"),
    Path: ((os.PathLike, str), "a path"),
    Sequence: ((list, Sequence), "a list"),
    Mapping: ((dict, Mapping), "a table of names and values"),
    NoneType: ((NoneType,), "None"),
    "ArrayLike": ((), "numbers"),
}
"""What is taken for an annotation, and its words; of any other class, its instances."""


@dataclass(frozen=True)
class _Kind:
    """What an argument may be: instances of classes, or what converts to them."""

    classes: tuple[type, ...]
    annotated: tuple[Any, ...]
    words: str

    def require(self, name: str, value: object, error: type[Exception] = TypeError) -> None:
        """Refuse another value; one line."""
        if not isinstance(value, self.classes) and not any(_converts(value, one) for one in self.annotated):
            raise error(f"{name} = {quoted(value, 40)}: expected {self.words}")


def checked(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Check the types of the arguments by the annotations, before the function runs.

    Annotations are those of ``from __future__ import annotations``: names of classes and of ``Literal``, ``ArrayLike``,
    and unions of them. What has another annotation is left to the function.

    Raises
    ------
    TypeError
        When it is called: one line with the name of the argument, its value and what was expected.
    """
    signature = inspect.signature(function)
    known = functools.cache(
        lambda: _kinds({name: one.annotation for name, one in signature.parameters.items()}, function.__module__)
    )

    @functools.wraps(function)
    def call(*given: Parameters.args, **named: Parameters.kwargs) -> Result:
        try:
            arguments = signature.bind(*given, **named).arguments
        except TypeError:  # missing or unknown arguments, which Python names
            return function(*given, **named)
        for name, kind in known().items():
            if name in arguments:
                kind.require(name, arguments[name])
        return function(*given, **named)

    return call


def checked_class(error: type[Exception] = TypeError) -> Callable[[Given], Given]:
    """Check the types of the fields of a dataclass as :func:`checked` does, before its ``__post_init__``."""

    def decorate(kind: Given) -> Given:
        after: Callable[[Any], None] = kind.__post_init__  # type: ignore[attr-defined]
        known = functools.cache(lambda: _kinds({one.name: one.type for one in fields(kind)}, kind.__module__))

        @functools.wraps(after)
        def check(self: Any) -> None:
            for name, one in known().items():
                one.require(name, getattr(self, name), error)
            after(self)

        kind.__post_init__ = check  # type: ignore[attr-defined]
        return kind

    return decorate


def _kinds(annotations: Mapping[str, Any], module: str) -> dict[str, _Kind]:
    """Give what arguments may be by their annotations, as far as it is known here."""
    names = vars(sys.modules[module])
    found = {name: _classes(str(one), names) for name, one in annotations.items()}
    return {name: _kind(one) for name, one in found.items() if one is not None}


def _classes(annotation: str, names: dict[str, Any]) -> tuple[Any, ...] | None:
    """Give the parts of a union; None where one is neither a class, nor texts, nor ``ArrayLike``."""
    found = list[Any]()
    for one in annotation.split(" | "):
        try:
            part = one if one == "ArrayLike" else eval(one, names)
        except (NameError, SyntaxError):  # imported for type checkers only
            return None
        found.append(NoneType if part is None else part if _texts(part) else get_origin(part) or part)
        known = found[-1] in _ACCEPTED or _texts(part) or isinstance(found[-1], type)
        if not known or found[-1] in (np.ndarray, UnionType, Union):  # which the function reads or converts
            return None
    return tuple(found)


def _texts(part: object) -> tuple[str, ...]:
    """Texts of a ``Literal``; the function refuses others."""
    return tuple(one for one in get_args(part) if isinstance(one, str))


def _kind(parts: tuple[Any, ...]) -> _Kind:
    classes, words = list[type](), list[str]()
    for one in parts:
        texts = _texts(one)
        accepted = ((str,), f"one of {', '.join(texts)}") if texts else _ACCEPTED.get(one)
        of, said = accepted or ((one,), f"a {one.__name__}")
        classes += of
        words += [] if one is str and Path in parts else [said]
    return _Kind(tuple(classes), parts, " or ".join(words))


def _converts(value: object, part: Any) -> bool:
    if isinstance(value, np.ndarray) and value.ndim == 0 and part in (int, float, bool):
        return _converts(value[()], part) or isinstance(value[()], _ACCEPTED[part][0])
    if part != "ArrayLike" and not (part is float and isinstance(value, Real)):
        return False
    try:
        np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        return False
    return value is not None
