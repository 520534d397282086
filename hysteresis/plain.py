"""Results to plain values for JSON, and back: frozen dataclasses of numbers, texts, sequences and other dataclasses.

The names of the fields are the keys, in the order in which the fields are declared. :func:`named` gives a field another
key, :func:`optional` makes a key that is absent where it has no value.
"""

from __future__ import annotations

import math
import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, field, fields, is_dataclass
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np

from hysteresis.files import RecordError
from hysteresis.messages import as_given, quoted

Result = TypeVar("Result")

MOST_WHOLE = 2**63
MOST_REAL = 1e30
"""Largest magnitudes of numbers that are read; those that are not finite may be results, too."""
_SIMPLE: dict[Any, tuple[tuple[type, ...], str]] = {
    float: ((int, float), "a number"),
    int: ((int,), "a whole number"),
    str: ((str,), "text"),
    bool: ((bool,), "true or false"),
}
"""Types of single values: what may stand in a file, and how an error calls it."""


def named(key: str) -> Any:
    """Declare a field whose key is not its name, such as ``from``."""
    return field(metadata={"key": key})


def optional() -> Any:
    """Declare a field, None by default, whose key is absent where the value is None."""
    return field(default=None, metadata={"optional": True})


def to_plain(value: object, *, finite: bool = True) -> Any:
    """Give a result as dictionaries, lists, numbers and texts.

    Arrays and tuples become lists. A number that is not finite becomes None, or stays where ``finite`` is False.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {
            _key(one): to_plain(item, finite=finite)
            for one in fields(value)
            if (item := getattr(value, one.name)) is not None or "optional" not in one.metadata
        }
    if isinstance(value, Mapping):
        return {key: to_plain(item, finite=finite) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return to_plain(value.tolist(), finite=finite)
    if isinstance(value, list | tuple):
        return [to_plain(item, finite=finite) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) or not finite else None
    return value


def from_plain(kind: type[Result], values: object, where: str = "") -> Result:
    """Make a dataclass of plain values as :func:`to_plain` gives them; keys that it does not have are left out.

    Parameters
    ----------
    kind
        A dataclass. Its fields may be numbers, texts, dataclasses, one of these or None, tuples, ``Mapping[str, X]``,
        and arrays of numbers.
    values
        A mapping of its keys.
    where
        What the values are from, for the error.

    Raises
    ------
    RecordError
        One line with the field that is missing, or that has not the form of its type or that its dataclass refuses
        with a ValueError, and what was expected.
    """
    if not isinstance(values, Mapping):
        raise RecordError(f"{where or kind.__name__}: {quoted(values, 40)}: expected a table")
    hints, given = get_type_hints(kind), dict[str, Any]()
    for one in fields(cast(Any, kind)):
        key = _key(one)
        place = f"{where}: {key}" if where else key
        if key in values:
            given[one.name] = _read(hints[one.name], values[key], place)
        elif one.default is MISSING and one.default_factory is MISSING:
            raise RecordError(f"{place}: missing")
    try:
        return kind(**given)
    except ValueError as error:  # of a dataclass that checks its values
        raise RecordError(f"{where}: {error}" if where else str(error)) from None


def _key(one: Field[Any]) -> str:
    return str(one.metadata.get("key", one.name))


def _read(kind: Any, value: Any, where: str) -> Any:
    """Make a value of a type of plain values."""
    origin, arguments = get_origin(kind), get_args(kind)
    if hasattr(origin, "__value__"):  # an alias by a type statement, as numpy's NDArray from Python 3.12 on
        return _read(origin.__value__[arguments], value, where)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        inner = [one for one in arguments if one is not types.NoneType]
        return _read(inner[0], value, where) if len(inner) == 1 else value
    if origin is tuple:
        return _tuple(arguments, value, where)
    if origin is np.ndarray:
        return _array(get_args(arguments[1])[0], value, where)
    if origin is Literal:
        if value not in arguments:
            raise RecordError(f"{where}: {quoted(value, 40)}: expected one of {', '.join(map(str, arguments))}")
        return value
    if origin is not None and isinstance(origin, type) and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise RecordError(f"{where}: {quoted(value, 40)}: expected a table")
        return {key: _read(arguments[1], item, f"{where}: {as_given(key, 40)}") for key, item in value.items()}
    return from_plain(cast(Any, kind), value, where) if is_dataclass(kind) else _simple(kind, value, where)


def _tuple(arguments: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise RecordError(f"{where}: {quoted(value, 40)}: expected a list")
    of_any_length = arguments[-1] is Ellipsis
    if not of_any_length and len(value) != len(arguments):
        raise RecordError(f"{where}: {quoted(value, 40)}: expected a list of {len(arguments)}")
    kinds = [arguments[0]] * len(value) if of_any_length else arguments
    return tuple(_read(one, item, f"{where}[{i}]") for i, (one, item) in enumerate(zip(kinds, value, strict=True)))


def _array(number: Any, value: Any, where: str) -> Any:
    try:
        array = np.asarray(value, dtype=number)
    except (TypeError, ValueError, OverflowError):
        raise RecordError(f"{where}: {quoted(value, 40)}: expected numbers") from None
    size = np.abs(array[np.isfinite(array)]) if array.ndim else np.abs(array)
    if size.size and size.max() > MOST_REAL:
        raise RecordError(f"{where}: {size.max()}: expected at most {MOST_REAL:g} in magnitude")
    return array


def _simple(kind: Any, value: Any, where: str) -> Any:
    """Check a single value; None stands for a number that is not finite, as :func:`to_plain` writes it."""
    if kind not in _SIMPLE:
        return value
    if kind is float and value is None:
        return math.nan
    kinds, expected = _SIMPLE[kind]
    if not isinstance(value, kinds) or (isinstance(value, bool) and kind is not bool):
        raise RecordError(f"{where}: {quoted(value, 40)}: expected {expected}")
    if isinstance(value, int) and abs(value) > MOST_WHOLE:
        raise RecordError(f"{where}: {quoted(value, 40)}: expected at most 64 bits")
    if isinstance(value, float) and MOST_REAL < abs(value) < math.inf:
        raise RecordError(f"{where}: {value}: expected at most {MOST_REAL:g} in magnitude")
    return value
