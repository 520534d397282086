"""What a case is made of: the tables of rig and program with single numbers changed, and the key of a case."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import MOST_JOINTS
from fem_models.rig.ensemble import member_constants
from fem_models.rig.rig_file import numbers_of_a_rig
from hysteresis.plain import optional, to_plain
from studies.sweep.code import code_version

PROGRAM = {"amplitude_mm": False, "cycles": True, "step_mm": False, "rate_Hz": False}
DERIVED: dict[str, tuple[str, ...]] = {
    "tube.wall_mm": ("tube.inner_diameter_mm",),
    "notch.depth_gradient_mm": (),
    "notch.angle_deg": ("notch.width_mm",),
    "notch.turn_step_deg": (),
}
"""Numbers that a rig file does not have, in the order in which they are applied, and the numbers that each one sets.

The gradient of the depth sets the depths about their mean, which may be varied beside it. The step of the turn turns
each notch of a rig in space on from the one before, beginning with the turn of the first.
"""

TURN = "notch.turn_deg"
"""Turn of all notches of a rig in space about the tube axis."""
TURN_KEYS = (TURN, "notch.turn_step_deg")
"""Numbers that only rigs in space have."""

MEMBER = "ensemble.member"
"""Number of a member of the ensemble of the rig's preset, from 0 on: it sets all constants of that member."""

FIELDS: dict[str, bool] = (
    numbers_of_a_rig()
    | {f"program.{name}": whole for name, whole in PROGRAM.items()}
    | dict.fromkeys(DERIVED, False)
    | {MEMBER: True, TURN: False}
)
"""Every number that a study may vary, by its dotted name; True for a whole number."""


@dataclass(frozen=True)
class ProgramTable:
    """The load program of a study.

    ``drive_mm`` and ``time_s`` are from a file. Otherwise the program is a triangle with ``step_mm``, or a sine with
    ``rate_Hz``.
    """

    amplitude_mm: float | None = optional()
    cycles: int | None = optional()
    rate_Hz: float | None = optional()
    step_mm: float | None = optional()
    drive_mm: tuple[float, ...] | None = optional()
    time_s: tuple[float, ...] | None = optional()


@dataclass(frozen=True)
class CaseTables:
    """Rig and load program of a case; ``rig`` has the tables of a rig file, plain values."""

    rig: Mapping[str, Any]
    program: ProgramTable


@dataclass(frozen=True)
class CaseInputs(CaseTables):
    """Everything that a case is computed from.

    ``values`` are those of the point if the tables cannot take them: the worker then fails with the reason.
    """

    engine: str
    groups: tuple[str, ...]
    seed: int
    values: Mapping[str, float] | None = optional()


def clash(names: Sequence[str]) -> tuple[str, str] | None:
    """Find two of the names that set the same number; None if there are none."""
    for name in names:
        for other in DERIVED.get(name, ()):
            if other in names:
                return name, other
        table, _, field = name.partition(".")
        if table in ("tendon_a", "tendon_b") and f"tendon.{field}" in names:
            return name, f"tendon.{field}"
    return None


def with_values(base: CaseTables, values: Mapping[str, float]) -> CaseTables:
    """Change numbers of rig and program by their dotted names; ``base`` stays as it is.

    A table that the rig does not have is made, with what is given. A member of an ensemble comes first, and derived
    numbers last, since they depend on what the others have set. Only what a derived number needs is checked.

    Raises
    ------
    RigError
        A derived number that does not apply to the rig, or a member that there is not.
    """
    if MEMBER in values:
        values = {**_member(base, values[MEMBER]), **{name: value for name, value in values.items() if name != MEMBER}}
    rig: dict[str, Any] = {name: dict(part) if isinstance(part, Mapping) else part for name, part in base.rig.items()}
    program = base.program
    for name, value in values.items():
        if name in DERIVED:
            continue
        table, _, field = name.rpartition(".")
        number: float = int(value) if FIELDS[name] else float(value)
        if table == "program":
            program = ProgramTable(**(vars(program) | {field: number}))
        elif table == "tendon":
            for side in ("tendon", "tendon_a", "tendon_b"):  # "tendon" is that of a rig in space
                if side in rig:
                    rig[side][field] = number
        elif table:
            if name == "tip_load.force_N" and isinstance(rig.get(table, {}).get(field), list | tuple):
                raise RigError(f"{name} = {number:g}: expected fixed where the force has three components")
            rig.setdefault(table, {})[field] = number
        else:
            rig[field] = number
    for name in DERIVED:
        if name in values:
            _DERIVE[name](rig, float(values[name]))
    return CaseTables(rig, program)


def _member(base: CaseTables, number: float) -> Mapping[str, float]:
    members = member_constants(str(base.rig.get("name", "")))
    if not 0 <= number < len(members):
        raise RigError(f"{MEMBER} = {number:g}: expected from 0 to {len(members) - 1}")
    return members[int(number)]


def _set_wall(rig: Mapping[str, Any], wall_mm: float) -> None:
    if "tube" not in rig:
        raise RigError(f"tube.wall_mm = {wall_mm:g}: expected a rig with [tube]")
    rig["tube"]["inner_diameter_mm"] = rig["tube"]["outer_diameter_mm"] - 2 * wall_mm


def _set_gradient(rig: Mapping[str, Any], gradient_mm: float) -> None:
    """Make the depth of the notches linear along the tube: at the tip deeper by the gradient than at the base."""
    notch = rig.get("notch", {})
    if "depth_mm" not in notch:
        raise RigError(f"notch.depth_gradient_mm = {gradient_mm:g}: expected a rig with [notch]")
    count, mean = notch.get("count", 0), float(np.mean(notch["depth_mm"]))
    if not 2 <= count <= MOST_JOINTS:
        expected = f"2 to {MOST_JOINTS:,} notches"
        raise RigError(f"notch.depth_gradient_mm = {gradient_mm:g}: notch.count = {count}: expected {expected}")
    notch["depth_mm"] = [mean + gradient_mm * (k / (count - 1) - 0.5) for k in range(count)]


def _set_angle(rig: Mapping[str, Any], angle_deg: float) -> None:
    """Set the width of a V from its angle: each flank leans half the angle away from the middle plane of the notch.

    Notches of different depths or roots get widths of their own.
    """
    notch = rig.get("notch", {})
    if notch.get("shape") != "v_pair":
        raise RigError(f"notch.angle_deg = {angle_deg:g}: expected a rig with a notch of the shape v_pair")
    if not 0 < angle_deg < 180:
        raise RigError(f"notch.angle_deg = {angle_deg:g}: expected above 0, below 180")
    root, depth, slope = notch["root_width_mm"], notch["depth_mm"], 2 * math.tan(math.radians(angle_deg) / 2)
    try:
        notch["width_mm"] = (np.asarray(root) + np.multiply(depth, slope)).tolist()
    except ValueError:
        raise RigError(f"notch.angle_deg = {angle_deg:g}: depth_mm and root_width_mm: expected one a notch") from None


def _set_turns(rig: Mapping[str, Any], step_deg: float) -> None:
    """Turn each notch on from the one before it."""
    notch = rig.get("notch", {})
    count = notch.get("count", 0)
    if not 1 <= count <= MOST_JOINTS:
        expected = f"1 to {MOST_JOINTS:,} notches"
        raise RigError(f"notch.turn_step_deg = {step_deg:g}: notch.count = {count}: expected {expected}")
    first = float(np.ravel(notch.get("turn_deg", 0.0))[0])
    notch["turn_deg"] = [first + step_deg * k for k in range(count)]


_DERIVE: dict[str, Callable[[Mapping[str, Any], float], None]] = {
    "tube.wall_mm": _set_wall,
    "notch.depth_gradient_mm": _set_gradient,
    "notch.angle_deg": _set_angle,
    "notch.turn_step_deg": _set_turns,
}


def key_of(inputs: CaseInputs) -> str:
    """Compute the sha256 of a case's inputs, its numbers to the last bit, and of the code that evaluates them."""
    return hashlib.sha256(_text_of(inputs).encode()).hexdigest()


def keys_of(base: CaseInputs, names: Sequence[str]) -> Callable[[Mapping[str, float]], str] | None:
    """Give :func:`key_of` of the values by these names, at a twentieth of its time; None where one is derived.

    The text around the numbers is written once. A number that no rig has marks where each of them stands.
    """
    if any(name in DERIVED or name == MEMBER for name in names):
        return None
    marks = {name: float(_MARK + k) for k, name in enumerate(names)}
    try:
        text = _text_of(replace(base, **vars(with_values(base, marks))))
    except RigError:
        return None
    of_text = {json.dumps(mark): name for name, mark in marks.items()}
    pieces = re.split(f"({'|'.join(map(re.escape, of_text))})", text)
    written = [(of_text.get(one, ""), one) for one in pieces if one]

    def key(values: Mapping[str, float]) -> str:
        own = {name: repr(float(int(v) if FIELDS[name] else v) + 0.0) for name, v in values.items()}
        return hashlib.sha256("".join([own[name] if name else one for name, one in written]).encode()).hexdigest()

    others = {name: 2.0 * mark for name, mark in marks.items()}  # a text of the rig may look like a mark
    return key if key(others) == key_of(replace(base, **vars(with_values(base, others)))) else None


_MARK = 2**52
"""Beyond all that a rig takes (:data:`fem_models.rig.checks.RANGES`), and an exact number."""


def _text_of(inputs: CaseInputs) -> str:
    tables = {name: _as_floats(value) for name, value in vars(inputs).items()} | {"code": code_version(inputs.engine)}
    return json.dumps(tables, sort_keys=True, separators=(",", ":"))


def _as_floats(value: Any) -> Any:
    """Give plain values, 5 and 5.0 as the same number, and -0.0 and 0.0; a study makes a key for each case, twice."""
    kind = type(value)
    if kind is float or kind is int:
        return float(value) + 0.0
    if kind is dict:
        return {k: _as_floats(v) for k, v in value.items()}
    if kind is str or kind is bool or value is None:
        return value
    if kind is list or kind is tuple:
        return [_as_floats(v) for v in value]
    if isinstance(value, ProgramTable):
        return _as_floats(vars(value))
    if isinstance(value, Mapping):
        return _as_floats(dict(value))
    plain = to_plain(value, finite=False)
    return plain if type(plain) is kind else _as_floats(plain)
