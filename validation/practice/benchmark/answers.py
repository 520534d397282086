"""The answer to a case, as anyone may give it: a small JSON file, of which a trace.json is one.

An example: ``{"schema": 1, "verdict": "effect", "effects": [{"name": "backlash", "confusable_with": [], "parameters":
{"width_mm": 0.12}}], "heldout_rmse_deg": 0.05}``. Effects stand in order, the surest first. A parameter is a number, or
a table with its ``value``. The held-out error may also stand where a trace.json has it, in ``after``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hysteresis.files import read_json
from hysteresis.messages import as_given, quoted
from hysteresis.plain import to_plain
from hysteresis.records.record import RecordError
from validation.practice.outcome import CLAIMS

UNANSWERED = "unanswered"
VERDICTS = (*CLAIMS, "none", "unexplained", "error")
MOST = 1e300
EXPECTED = "an answer: a JSON object with schema, verdict and effects"


@dataclass(frozen=True)
class NamedEffect:
    """An effect that is named, those that it may be confused with, and its parameters, units in their names."""

    name: str
    confusable_with: tuple[str, ...]
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class CaseAnswer:
    """Answer to a case.

    Parameters
    ----------
    verdict
        One of :data:`VERDICTS`; effects count with those of :data:`CLAIMS` alone.
    effects
        In order.
    heldout_rmse_deg
        Error on data that was not fitted, None if not given.
    """

    schema: int
    verdict: str
    effects: tuple[NamedEffect, ...] = ()
    heldout_rmse_deg: float | None = None

    @property
    def named(self) -> tuple[NamedEffect, ...]:
        """Effects that are claimed."""
        return self.effects if self.verdict in CLAIMS else ()

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in the file."""
        return dict(to_plain(self))


def answer_file(folder: Path, case: str) -> Path | None:
    """File of the answer to a case: ``CASE.json``, or ``CASE/trace.json``; None where there is neither."""
    return next((path for path in (folder / f"{case}.json", folder / case / "trace.json") if path.is_file()), None)


def read_answer(folder: Path, case: str) -> CaseAnswer:
    """Read the answer to a case.

    Raises
    ------
    RecordError
        One line with file, field, value and what was expected.
    """
    path = answer_file(folder, case)
    if path is None:
        return CaseAnswer(1, UNANSWERED)
    return answer_of(read_json(path, EXPECTED), str(path))


def answer_of(values: object, where: str) -> CaseAnswer:
    """Check the values of an answer.

    Raises
    ------
    RecordError
        One line with the field, its value and what was expected.
    """
    if not isinstance(values, dict):
        raise RecordError(f"{where}: {quoted(values)}: expected {EXPECTED}")
    if type(values.get("schema")) is not int or values["schema"] != 1:  # True is 1
        raise RecordError(f"{where}: schema = {quoted(values.get('schema', 'missing'))}: expected 1")
    verdict, effects = values.get("verdict", "missing"), values.get("effects", [])
    if verdict not in VERDICTS:
        raise RecordError(f"{where}: verdict = {quoted(verdict)}: expected one of {', '.join(VERDICTS)}")
    if not isinstance(effects, list):
        raise RecordError(f"{where}: effects = {quoted(effects)}: expected a list")
    if verdict in CLAIMS and not effects:
        raise RecordError(f"{where}: effects: none with the verdict {verdict}: expected at least one")
    named = tuple(_effect(one, f"{where}: effects[{k}]") for k, one in enumerate(effects))
    return CaseAnswer(1, verdict, named, _heldout(values, where))


def _effect(values: object, where: str) -> NamedEffect:
    if not isinstance(values, dict) or not isinstance(values.get("name"), str):
        raise RecordError(f"{where}: {quoted(values)}: expected an object with a name")
    confusable = values.get("confusable_with", [])
    if not isinstance(confusable, list) or not all(isinstance(name, str) for name in confusable):
        raise RecordError(f"{where}: confusable_with = {quoted(confusable)}: expected a list of names")
    parameters = values.get("parameters", {})
    if not isinstance(parameters, dict):
        raise RecordError(f"{where}: parameters = {quoted(parameters)}: expected an object")
    numbers = {key: _number(one, f"{where}: parameters: {as_given(key)}") for key, one in parameters.items()}
    known = {key: value for key, value in numbers.items() if value is not None}
    return NamedEffect(values["name"], tuple(confusable), known)


def _number(value: object, where: str) -> float | None:
    if isinstance(value, dict):
        value = value.get("value")
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= MOST:
        raise RecordError(f"{where} = {quoted(value)}: expected a number")
    return float(value)


def _heldout(values: Mapping[str, Any], where: str) -> float | None:
    after = values.get("after")
    if "heldout_rmse_deg" not in values and isinstance(after, dict) and isinstance(after.get("heldout"), dict):
        return _number(after["heldout"].get("rmse_deg"), f"{where}: after: heldout: rmse_deg")
    return _number(values.get("heldout_rmse_deg"), f"{where}: heldout_rmse_deg")
