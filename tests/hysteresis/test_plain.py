"""Results as plain values: the same after JSON, keys in the order of the fields, errors that name the field."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, make_dataclass
from typing import Any, Literal, TypeVar

import numpy as np
import pytest
from typing_extensions import TypeAliasType

from hysteresis.arrays import Floats
from hysteresis.files import RecordError
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.plain import from_plain, named, optional, to_plain


@dataclass(frozen=True)
class Part:
    name: str
    error_deg: float | None = None


@dataclass(frozen=True)
class Whole:
    parts: tuple[Part, ...]
    parameters: Mapping[str, Parameter]
    best: Part | None
    samples: int


WHOLE = Whole((Part("b", 0.1), Part("a")), {"width_mm": Parameter(0.1, None, 0.2, "mm")}, None, 3)


def test_a_result_survives_json():
    assert from_plain(Whole, json.loads(json.dumps(to_plain(WHOLE)))) == WHOLE


def test_keys_are_the_fields_in_their_order():
    assert list(to_plain(WHOLE)) == ["parts", "parameters", "best", "samples"]
    assert to_plain(WHOLE)["parts"] == [{"name": "b", "error_deg": 0.1}, {"name": "a", "error_deg": None}]


def test_numbers_that_json_lacks_become_none_and_arrays_lists():
    plain = to_plain({"x": np.array([1.0, np.nan]), "y": (np.float64(0.1), float("inf")), "z": np.int64(3)})
    assert plain == {"x": [1.0, None], "y": [0.1, None], "z": 3}
    assert all(type(value) in (float, int) for value in (plain["x"][0], plain["y"][0], plain["z"]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"parts": [{"error_deg": 1.0}]}, r"f.json: parts\[0\]: name: missing"),
        ({"parts": 3}, "f.json: parts: 3: expected a list"),
        ({"parameters": [1]}, "f.json: parameters: .* expected a table"),
        ({"best": 1}, "f.json: best: 1: expected a table"),
        ({"samples": 1.5}, "f.json: samples: 1.5: expected a whole number"),
        ({"samples": True}, "f.json: samples: True: expected a whole number"),
        ({"parts": [{"name": 1}]}, r"f.json: parts\[0\]: name: 1: expected text"),
        ({"best": {"name": "a", "error_deg": "x"}}, "f.json: best: error_deg: 'x': expected a number"),
    ],
)
def test_an_error_names_the_field(change, words):
    with pytest.raises(RecordError, match=words):
        from_plain(Whole, to_plain(WHOLE) | change, "f.json")


def test_defaults_stand_in_and_other_keys_are_left_out():
    assert from_plain(Part, {"name": "a", "older": 1}) == Part("a")


@dataclass(frozen=True)
class Span:
    ends_mm: tuple[float, str]
    low: float = named("from")
    goal: Literal["min", "max"] = "min"
    values: Floats | None = optional()


def test_a_field_may_have_another_key_or_be_absent():
    """``from`` is a word of Python's: no field can have it as a name."""
    assert to_plain(Span((1.0, "a"), 0.5)) == {"ends_mm": [1.0, "a"], "from": 0.5, "goal": "min"}
    whole = to_plain(Span((1.0, "a"), 0.5, "max", np.array([1.0])))
    assert list(whole) == ["ends_mm", "from", "goal", "values"]
    read = from_plain(Span, whole)
    assert (read.low, read.goal, read.values.tolist()) == (0.5, "max", [1.0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ends_mm": [1.0]}, "ends_mm: .* expected a list of 2"),
        ({"goal": "least"}, "goal: 'least': expected one of min, max"),
        ({"values": ["a"]}, "values: .* expected numbers"),
    ],
)
def test_pairs_words_and_arrays_are_checked(change, words):
    with pytest.raises(RecordError, match=words):
        from_plain(Span, {"ends_mm": [1.0, "a"], "from": 0.5} | change)


def test_numbers_that_are_not_finite_come_back_or_stay():
    assert math.isnan(from_plain(Span, {"ends_mm": [1.0, "a"], "from": None}).low)
    assert math.isnan(to_plain({"x": math.nan}, finite=False)["x"])


def test_array_types_that_are_an_alias_by_a_type_statement():
    """From Python 3.12 on, numpy's NDArray is one; typing_extensions makes the same in 3.11."""
    scalar = TypeVar("scalar", bound=np.generic)
    alias = TypeAliasType("alias", np.ndarray[tuple[Any, ...], np.dtype[scalar]], type_params=(scalar,))
    table = make_dataclass("Table", [("rows", alias[np.float64]), ("lines", Mapping[str, alias[np.int64]])])
    read = from_plain(table, {"rows": [[1.0, 2.0]], "lines": {"a": [3]}})
    assert read.rows.shape == (1, 2)
    assert read.lines["a"].dtype == np.int64
