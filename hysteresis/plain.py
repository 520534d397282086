"""Results to plain values for JSON, and back: frozen dataclasses of numbers, texts, sequences and other dataclasses.

The names of the fields are the keys, in the order in which the fields are declared.
"""

from __future__ import annotations

import math
import types
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np

from hysteresis.files import RecordError

Result = TypeVar("Result")


def to_plain(value: object) -> Any:
    """Give a result as dictionaries, lists, numbers and texts; a number that is not finite becomes None.

    Arrays and tuples become lists.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: to_plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {key: to_plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return to_plain(value.tolist())
    if isinstance(value, list | tuple):
        return [to_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def from_plain(kind: type[Result], values: object, where: str = "") -> Result:
    """Make a dataclass of plain values as :func:`to_plain` gives them; keys that it does not have are left out.

    Parameters
    ----------
    kind
        A dataclass. Its fields may be plain, dataclasses, one of these or None, ``tuple[X, ...]``, ``Mapping[str, X]``.
    values
        A mapping of its fields' names.
    where
        What the values are from, for the error.

    Raises
    ------
    RecordError
        One line with the field that is missing, or that has not the form of its type.
    """
    if not isinstance(values, Mapping):
        raise RecordError(f"{where or kind.__name__}: {values!r:.40}: expected a table")
    hints, given = get_type_hints(kind), dict[str, Any]()
    for field in fields(cast(Any, kind)):
        place = f"{where}: {field.name}" if where else field.name
        if field.name in values:
            given[field.name] = _read(hints[field.name], values[field.name], place)
        elif field.default is MISSING and field.default_factory is MISSING:
            raise RecordError(f"{place}: missing")
    return kind(**given)


def _read(kind: Any, value: Any, where: str) -> Any:
    """Make a value of a type of plain values."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        inner = [one for one in arguments if one is not types.NoneType]
        return _read(inner[0], value, where) if len(inner) == 1 else value
    if origin is tuple:
        if not isinstance(value, list | tuple):
            raise RecordError(f"{where}: {value!r:.40}: expected a list")
        return tuple(_read(arguments[0], item, f"{where}[{i}]") for i, item in enumerate(value))
    if origin is not None and isinstance(origin, type) and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise RecordError(f"{where}: {value!r:.40}: expected a table")
        return {key: _read(arguments[1], item, f"{where}: {key}") for key, item in value.items()}
    return from_plain(cast(Any, kind), value, where) if is_dataclass(kind) else value
