"""What a case is made of: tables of rig and program with single numbers changed, and the key that stands for them."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from fem_models.rig.checks import RigError
from fem_models.rig.rig_file import numbers_of_a_rig

Tables = dict[str, Any]

PROGRAM = {"amplitude_mm": False, "cycles": True, "step_mm": False, "rate_Hz": False}
DERIVED: dict[str, tuple[str, ...]] = {
    "tube.wall_mm": ("tube.inner_diameter_mm",),
    "notch.angle_deg": ("notch.width_mm",),
}
"""Numbers that a rig file does not have, and which of its own they set; the others stay as they are."""

FIELDS: dict[str, bool] = (
    numbers_of_a_rig() | {f"program.{name}": whole for name, whole in PROGRAM.items()} | dict.fromkeys(DERIVED, False)
)
"""Every number that a study may vary, by its dotted name; True for a whole one."""

_LIBRARIES = {
    "chain": ("numpy", "scipy", "numba"),
    "analytic": ("numpy", "scipy"),
    "multibody": ("numpy", "scipy", "exudyn"),
    "solid": ("numpy", "scipy", "numba", "gmsh", "scikit-fem", "cholespy"),
}
_DRAWING = ("scene.py", "solid_scene.py")  # modules without say in a number


def clash(names: Sequence[str]) -> tuple[str, str] | None:
    """Two of the names that set the same number, if there are any."""
    for name in names:
        for other in DERIVED.get(name, ()):
            if other in names:
                return name, other
        table, _, field = name.partition(".")
        if table in ("tendon_a", "tendon_b") and f"tendon.{field}" in names:
            return name, f"tendon.{field}"
    return None


def with_values(base: Mapping[str, Tables], values: Mapping[str, float]) -> dict[str, Tables]:
    """Change numbers of ``{"rig": tables, "program": table}`` by their dotted names; ``base`` stays as it is.

    A table that the rig does not have is made, with what is given. Derived numbers come last: they are read of what
    the others have set. Nothing is checked here but what a derived number needs.

    Raises
    ------
    RigError
        A derived number of a rig that has no such thing.
    """
    rig = {name: dict(part) if isinstance(part, Mapping) else part for name, part in base["rig"].items()}
    out = {"rig": rig, "program": dict(base["program"])}
    for name, value in values.items():
        if name in DERIVED:
            continue
        table, _, field = name.rpartition(".")
        number: float = int(value) if FIELDS[name] else float(value)
        if table == "program":
            out["program"][field] = number
        elif table == "tendon":
            for side in ("tendon_a", "tendon_b"):
                if side in out["rig"]:
                    out["rig"][side][field] = number
        elif table:
            out["rig"].setdefault(table, {})[field] = number
        else:
            out["rig"][field] = number
    for name in DERIVED:
        if name in values:
            _DERIVE[name](out["rig"], float(values[name]))
    return out


def _set_wall(rig: Tables, wall_mm: float) -> None:
    if "tube" not in rig:
        raise RigError(f"tube.wall_mm = {wall_mm:g}: expected a rig with [tube]")
    rig["tube"]["inner_diameter_mm"] = rig["tube"]["outer_diameter_mm"] - 2 * wall_mm


def _set_angle(rig: Tables, angle_deg: float) -> None:
    """Open a V by its flanks: each leans half the angle away from the notch's middle plane."""
    notch = rig.get("notch", {})
    if notch.get("shape") != "v_pair":
        raise RigError(f"notch.angle_deg = {angle_deg:g}: expected a rig with a notch of the shape v_pair")
    if not 0 < angle_deg < 180:
        raise RigError(f"notch.angle_deg = {angle_deg:g}: expected above 0, below 180")
    notch["width_mm"] = notch["root_width_mm"] + 2 * notch["depth_mm"] * math.tan(math.radians(angle_deg) / 2)


_DERIVE: dict[str, Callable[[Tables, float], None]] = {"tube.wall_mm": _set_wall, "notch.angle_deg": _set_angle}


def key_of(inputs: Mapping[str, Any]) -> str:
    """Sha256 of a case's inputs, its numbers to the last bit, and of the code that makes quantities of them."""
    tables = _as_floats(dict(inputs)) | {"code": code_version(inputs["engine"])}
    return hashlib.sha256(json.dumps(tables, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _as_floats(value: Any) -> Any:
    """Let 5 and 5.0, -0.0 and 0.0, be the same number."""
    if isinstance(value, Mapping):
        return {k: _as_floats(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_as_floats(v) for v in value]
    return value if isinstance(value, bool) or not isinstance(value, int | float) else float(value) + 0.0


@cache
def code_version(engine: str) -> str:
    """Sha256 of the sources that have a say in a number of an engine, and the versions of its libraries."""
    root = Path(__file__).parents[2]
    sources = [p for folder in ("hysteresis", "fem_models") for p in sorted((root / folder).rglob("*.py"))]
    sources += [
        root / name
        for name in ("validation/separation/contributions.py", "studies/sweep/cases.py", "studies/sweep/inputs.py")
    ]
    digest = hashlib.sha256()
    for path in sources:
        if path.name not in _DRAWING:
            digest.update(path.name.encode() + b"\0" + path.read_bytes())
    digest.update(json.dumps(versions(engine)).encode())
    return digest.hexdigest()


def versions(engine: str) -> dict[str, str]:
    """Versions of the libraries that an engine calculates with, and of this package where it is installed."""
    try:
        own = {"notchbend": version("notchbend")}
    except PackageNotFoundError:  # run from its sources
        own = {}
    return own | {name: version(name) for name in _LIBRARIES[engine]}
