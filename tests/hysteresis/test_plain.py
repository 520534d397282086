"""Results as plain values: the same after JSON, keys in the order of the fields, errors that name the field."""

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from hysteresis.files import RecordError
from hysteresis.plain import from_plain, to_plain
from hysteresis.uncertainty import Parameter


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
    ],
)
def test_an_error_names_the_field(change, words):
    with pytest.raises(RecordError, match=words):
        from_plain(Whole, to_plain(WHOLE) | change, "f.json")


def test_defaults_stand_in_and_other_keys_are_left_out():
    assert from_plain(Part, {"name": "a", "older": 1}) == Part("a")
