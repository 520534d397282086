"""Rig files: a rig as TOML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

from fem_models.rig.checks import RigError, require
from fem_models.rig.effects import EFFECTS
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.layout import IN_SPACE, LayoutKeys, split_tables
from fem_models.rig.rig import Friction, Material, Rig, Tendon, Wheel, rig_in_space
from hysteresis.arguments import checked
from hysteresis.files import RecordError, read_toml
from hysteresis.messages import as_given, listed, quoted
from hysteresis.records.rows import Value, table_of_rows

_TABLES: dict[str, type] = {
    "tube": Tube,
    "notch": Notch,
    "material": Material,
    "tendon_a": Tendon,
    "tendon_b": Tendon,
    "friction": Friction,
    "wheel": Wheel,
    "bench": MeasuredJoint,
    **EFFECTS,
}
_JOINT_TABLES = ("tube", "notch", "bench")
_PARTS = {f.name for f in fields(Rig)} - {"joint", "layout"} | set(_JOINT_TABLES)


def numbers_of_a_rig() -> dict[str, bool]:
    """Every number of a rig file, by dotted name; True for integers. ``tendon`` stands for both tendons."""
    tables = {"": Rig, "tendon": Tendon, **_TABLES}
    return {
        f"{table}.{f.name}".lstrip("."): f.type == "int"
        for table, cls in tables.items()
        for f in fields(cls)
        if str(f.type).split(" | ")[0] in ("int", "float", "OfEach")
    }


def build(table_name: str, table: object, where: str) -> Any:
    """Make the dataclass of a TOML table; a RigError names unknown and missing keys.

    Tables of single values are remembered: a study makes rigs by the thousand, and few of their tables differ.
    """
    if not isinstance(table, Mapping):
        raise RigError(f"{where}: [{table_name}] = {quoted(table)}: expected a table")
    values = tuple(table.values())
    make = _made if all(isinstance(value, float | int | str) for value in values) else _made.__wrapped__
    try:
        return make(table_name, tuple(table), *values)
    except RigError as error:
        raise RigError(f"{where}: {error}") from None


@lru_cache(maxsize=1024, typed=True)
def _made(table_name: str, keys: tuple[str, ...], *values: Any) -> Any:
    cls, table = _TABLES[table_name], dict(zip(keys, values, strict=True))
    known = {f.name: f for f in fields(cls)}
    _require_sane_integers(table, f"{table_name}.")
    for key, value in table.items():
        if (table_name, key) == ("notch", "turn_deg"):
            raise RigError(f"notch.turn_deg = {quoted(value)}: {IN_SPACE}")
        if key not in known:
            raise RigError(f"{table_name}.{as_given(key)} = {quoted(value)}: expected one of {listed(known)}")
    for key, f in known.items():
        if key not in table and f.default is MISSING:
            raise RigError(f"{table_name}.{key}: missing, expected in [{table_name}]")
    return cls(**table)


def notch_of_rows(rows: Sequence[object], where: str) -> Mapping[str, Value]:
    """Make the table of ``[[notch]]`` rows, lists where the notches differ.

    Raises
    ------
    RigError
        One line with ``where``, row, key, value and what was expected.
    """
    try:
        return table_of_rows(where, "notch", rows)
    except RecordError as error:
        raise RigError(str(error)) from None


@checked
def read_rig(path: Path | str) -> Rig:
    """Read a rig file (TOML): ``name``, ``preload_N`` and the tables of :class:`Rig`.

    ``[tendon]`` stands for both tendons; ``[tendon_b]`` overrides it for unequal tendons. ``tendons = 1`` is a rig with
    a single tendon, [tendon] or [tendon_a]. Fields of [notch] may be lists, one number a notch; rows [[notch]] are
    another spelling. A turn of 0 and tendons at 0 and 180 degrees are those of any planar rig.

    Parameters
    ----------
    path
        The file. Names of its numbers end in their units: mm, N, GPa, deg, and a ratio has none.

    Raises
    ------
    RigError
        One line with file, field, value and what was expected; a rig that bends in space, which
        :func:`read_any_rig` reads.

    Examples
    --------
    >>> nb.simulate(nb.read_rig("mine.toml"), nb.triangle(1.5))
    """
    rig, space = rig_and_space_of_file(Path(path))
    return _planar(rig, space, str(path))


def read_any_rig(path: Path | str) -> Rig:
    """Read a rig file, of a planar rig or of one that bends in space.

    Beyond :func:`read_rig`: ``turn_deg`` in [notch], one angle or one a notch; ``angles_deg`` in [tendons], and
    ``wheels`` where opposite tendons do not share one; ``force_N`` of [tip_load] and ``direction`` of [gravity] and
    [tip_mass] as three components.

    Raises
    ------
    RigError
        One line with file, field, value and what was expected.
    """
    path = Path(path)
    return _laid_out(*rig_and_space_of_file(path), str(path))


def rig_and_space_of_file(path: Path) -> tuple[Rig, LayoutKeys | None]:
    """Read the rig of a file, and what takes it into space, as :func:`rig_and_space`.

    Raises
    ------
    RigError
        As :func:`read_rig`, but for a rig in space.
    """
    try:
        data = read_toml(path, "a rig file in TOML")
    except RecordError as error:
        raise RigError(str(error)) from None
    return rig_and_space(data, str(path), path.stem)


def given_in_file(path: Path | str) -> frozenset[str]:
    """Names of what a rig file gives, such as ``tube.outer_diameter_mm``; [tendon] gives that of both tendons.

    The other numbers of :func:`fem_models.rig.rig.numeric_fields` are defaults.

    Raises
    ------
    RigError
        A file that cannot be read.
    """
    try:
        data = read_toml(Path(path), "a rig file in TOML")
    except RecordError as error:
        raise RigError(str(error)) from None
    found = set[str]()
    for name, value in data.items():
        tables = [one for one in (value if isinstance(value, list) else [value]) if isinstance(one, Mapping)]
        sides = ("tendon_a", "tendon_b") if name == "tendon" else (name,)
        found |= {f"{side}.{key}" for side in sides for table in tables for key in table} if tables else {name}
    return frozenset(found)


def rig_of_tables(tables: Mapping[str, Any], where: str, name: str = "rig") -> Rig:
    """Make a rig from the tables of a rig file or from :meth:`fem_models.rig.rig.Rig.to_dict`.

    ``name`` is used where the tables have none.

    Raises
    ------
    RigError
        One line with ``where``, field, value and what was expected.
    """
    return _planar(*rig_and_space(tables, where, name), where)


def any_rig_of_tables(tables: Mapping[str, Any], where: str, name: str = "rig", *, in_space: bool = False) -> Rig:
    """Make a rig, of one plane or in space, from the tables of a rig file or from ``to_dict``.

    With ``in_space`` one whose turns are 0 and whose tendons are those of a planar rig is still one in space.

    Raises
    ------
    RigError
        One line with ``where``, field, value and what was expected.
    """
    rig, keys = rig_and_space(tables, where, name)
    return _laid_out(rig, LayoutKeys("") if keys is None and in_space else keys, where)


def _laid_out(rig: Rig, keys: LayoutKeys | None, where: str) -> Rig:
    try:
        return rig if keys is None else rig_in_space(rig, keys)
    except RigError as error:
        raise RigError(f"{where}: {error}") from None


def _planar(rig: Rig, space: LayoutKeys | None, where: str) -> Rig:
    """Refuse a rig in space."""
    if space is not None:
        raise RigError(f"{where}: {space.found}: rig {rig.name} {IN_SPACE}")
    return rig


def rig_and_space(tables: Mapping[str, Any], where: str, name: str) -> tuple[Rig, LayoutKeys | None]:
    """Make the rig of the tables, and what takes it into space, if anything does: it is then without turn.

    Raises
    ------
    RigError
        As :func:`rig_of_tables`, but for a rig in space.
    """
    data = dict(tables)
    if isinstance(data.get("notch"), list):
        data["notch"] = notch_of_rows(data["notch"], where)
    data, space = split_tables(data, where)
    return _planar_rig(data, where, name), space


def _planar_rig(data: dict[str, Any], where: str, name: str) -> Rig:
    for key in ("tendon", "tendon_a", "tendon_b"):
        if not isinstance(data.get(key, {}), Mapping):
            raise RigError(f"{where}: [{key}] = {quoted(data[key])}: expected a table")
    both, count = data.pop("tendon", {}), data.pop("tendons", 2)
    if isinstance(count, bool) or not isinstance(count, int) or count not in (1, 2):
        raise RigError(f"{where}: tendons = {quoted(count)}: expected 1 or 2")
    if count == 1 and "tendon_b" in data:
        raise RigError(f"{where}: [tendon_b]: expected absent with tendons = 1")
    sides = ("tendon_a", "tendon_b")[:count]
    for side in sides:
        if both or side in data:
            data[side] = {**both, **data.get(side, {})}
    for key in data:
        if key not in _PARTS:
            expected = listed(sorted(_PARTS | {"tendon", "tendons"}))
            raise RigError(f"{where}: {as_given(key)} = {quoted(data[key])}: expected one of {expected}")
    for key in ("material", *sides, "wheel", "preload_N"):
        if key not in data:
            raise RigError(f"{where}: {key}: missing, expected in a rig file")
    try:
        _require_sane_integers(data)
    except RigError as error:
        raise RigError(f"{where}: {error}") from None
    if not isinstance(data.get("name", ""), str):
        raise RigError(f"{where}: name = {quoted(data['name'])}: expected text")
    parts = {k: build(k, v, where) if k in _TABLES else v for k, v in data.items()}
    try:
        joint = _joint(data.get("name", name), **{k: parts.pop(k, None) for k in _JOINT_TABLES})
        rig = Rig(**{"name": name, "tendon_b": None, **parts, "joint": joint})
        _require_tendons_in_tube(rig)
    except RigError as error:
        raise RigError(f"{where}: {error}") from None
    return rig


def _require_tendons_in_tube(rig: Rig) -> None:
    """Refuse a tendon outside the tube, also beside one-sided notches, whose arms count from the tube axis.

    It runs in the lumen or in channels of the wall. A rig in memory may have arms up to the outer diameter: searches
    for unequal tendons try arms of up to twice the declared one.
    """
    if not isinstance(rig.joint, NotchedTube):
        return
    outer = rig.joint.tube.outer_diameter_mm / 2
    for name, tendon in zip(("tendon_a", "tendon_b"), rig.tendons, strict=False):
        arm = tendon.moment_arm_mm
        require(
            arm <= outer, f"{name}.moment_arm_mm", arm, f"at most {outer:g}, the outer radius: it counts from the axis"
        )


def _joint(
    rig: str, tube: Tube | None, notch: Notch | None, bench: MeasuredJoint | None
) -> NotchedTube | MeasuredJoint:
    """Make the joint from the tables of a rig file; the others are None."""
    if bench is None and tube is not None and notch is not None:
        return NotchedTube(tube, notch)
    if bench is not None and tube is None and notch is None:
        return bench
    raise RigError(f"rig {rig}: expected either [tube] and [notch], or measured joints")


def _require_sane_integers(table: Mapping[str, Any], prefix: str = "") -> None:
    """Refuse integers beyond 64 bits, which TOML forbids but its reader accepts: they overflow as floats."""
    for key, value in table.items():
        for one in value if isinstance(value, list) else (value,):
            if isinstance(one, int) and not -(2**63) <= one < 2**63:
                raise RigError(f"{prefix}{as_given(key)} = {quoted(one)}: expected an integer of 64 bits")
