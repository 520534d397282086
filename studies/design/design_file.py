"""REQUIRE.toml: what is required of a tube, what may be bought and cut, and how well it is made."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from fem_models.joint.strain_life import StrainLife
from fem_models.rig import Rig, RigError, preset, read_rig
from fem_models.rig.joints import NOTCH_SHAPES, NotchShape
from fem_models.rig.rig import notched_tube
from fem_models.rig.rig_file import rig_of_tables
from hysteresis.files import inside, read_bytes, read_toml
from hysteresis.messages import quoted
from hysteresis.records.record import RecordError
from studies.design.measure import Use
from studies.design.quantities import QUANTITIES
from studies.design.requirement import Requirements, requirements_of_table
from studies.design.space import Cutting, Ranges, Space
from studies.design.stock import GRID_MM, KERF_MM, LEAST_BRIDGE_MM, TUBES, WIRES, TubeSize, WireSize
from studies.design.tolerance import Tolerances, tolerances_of_table
from studies.results.study import Goal
from studies.sweep.errors import StudyError
from studies.sweep.file_table import FileTable

_TOP = (
    "schema", "title", "seed", "require", "rig", "stock", "cutting", "design", "trade", "tolerance", "metal", "search",
)  # fmt: skip
TRADE: Mapping[str, Goal] = {"length_mm": "min", "tension_N": "min"}
"""What is traded where the file does not say it."""
_OF_BASE: Mapping[str, Any] = {
    "tendons": 1,
    "preload_N": 0.0,
    "friction": {"capstan_coefficient": 0.3},  # steel on Nitinol, 0.2 to 0.4: York et al., ICRA 2015
    "closure": {"stiffness_Nmm_per_rad": 1000.0},
    "wheel": {"radius_mm": 10.0},
    "superelastic": {},
    "material": {},
}
"""Rig of a design file without [rig]: Nitinol by its default constants, one tendon of steel."""
_FREE_LENGTH_MM = 200.0


@dataclass(frozen=True)
class SearchSize:
    """Size of the searches; ``draws`` tubes are drawn for P(met) of each design that is shown."""

    explore: int
    population: int
    generations: int
    robust_generations: int
    draws: int
    shown: int


@dataclass(frozen=True)
class DesignFile:
    """A design file as it stands; ``inputs`` are the files that were read, with their sha256."""

    path: Path
    title: str
    seed: int
    requirements: Requirements
    use: Use
    space: Space
    trade: tuple[tuple[str, Goal], ...]
    tolerances: Tolerances
    size: SearchSize
    inputs: Mapping[Path, str]


def read_design(path: Path, *, seed: int | None = None) -> DesignFile:
    """Read a design file; ``seed`` replaces that of the file.

    Raises
    ------
    StudyError
        One line with file, field, value and what was expected.
    """
    try:
        data = read_toml(path, "a design file in TOML")
        return _design(path, FileTable("", data, _TOP), seed)
    except (StudyError, RigError, RecordError) as error:
        words = str(error)
        raise StudyError(words if words.startswith(str(path)) else f"{path}: {words}") from None


def _design(path: Path, top: FileTable, seed: int | None) -> DesignFile:
    if type(top.data.get("schema")) is not int or top.data["schema"] != 1:
        raise top.complain("schema", "1")
    if "require" not in top.data:
        raise top.complain("require", "a table of requirements")
    inputs = {path: _sha256(path)}
    requirements = requirements_of_table(top.table("require"))
    trade = _trade(top.table("trade"))
    base = _base(path, top.table("rig"), top.table("design"), inputs)
    life = _life(top.table("metal", "strain", "cycles", "exponent", "scatter"))
    wanted = frozenset(requirements.names) | {name for name, _ in trade}
    if "cycles" in wanted and life is None and base.superelastic is None:
        raise StudyError(
            "require.cycles: [metal] missing: expected the strain-life of a metal that is not superelastic"
        )
    tension, drive = requirements.bound("tension_N", "high"), requirements.bound("drive_mm", "high")
    return DesignFile(
        path=path,
        title=top.text("title", path.stem),
        seed=top.whole("seed", 0, 0, 2**31) if seed is None else seed,
        requirements=requirements,
        use=Use(
            requirements.bend_deg,
            math.inf if tension is None else tension,
            math.inf if drive is None else drive,
            wanted,
            life,
        ),
        space=_space(top, base),
        trade=trade,
        tolerances=tolerances_of_table(top.table("tolerance")),
        size=_size(top.table("search", "explore", "population", "generations", "robust_generations", "draws", "shown")),
        inputs=inputs,
    )


def _sha256(path: Path) -> str:
    return hashlib.sha256(read_bytes(path, "an input of the design")).hexdigest()


def _trade(table: FileTable) -> tuple[tuple[str, Goal], ...]:
    if not table.data:
        return tuple(TRADE.items())
    for name in table.data:
        if name not in QUANTITIES:
            raise table.complain(name, "a quantity, such as tension_N, with min or max")
    return tuple((name, cast("Goal", table.text(name, None, ("min", "max")))) for name in table.data)


def _life(table: FileTable) -> StrainLife | None:
    if not table.data:
        return None
    numbers = {name: table.number(name) for name in ("strain", "cycles", "exponent", "scatter")}
    try:
        return StrainLife(**numbers)
    except ValueError as error:
        raise StudyError(f"metal.{error}") from None


def _base(path: Path, table: FileTable, design: FileTable, inputs: dict[Path, str]) -> Rig:
    """Read the rig without its tube: a preset, a file, or tables of a rig file on top of the defaults."""
    if "preset" in table.data or "file" in table.data:
        chosen = FileTable("rig", table.data, ("preset", "file"))
        if len(chosen.data) != 1:
            raise StudyError("[rig]: expected either preset or file")
        if "preset" in chosen.data:
            return preset(chosen.text("preset"))
        file = inside(path, "rig.file", chosen.text("file"), [".toml"])
        inputs[file] = _sha256(file)
        return read_rig(file)
    for name in ("tube", "notch"):
        if name in table.data:
            raise StudyError(f"rig.{name}: expected absent: stock and search give it")
    tables = dict(_OF_BASE) | dict(table.data)
    if tables["superelastic"] is False:
        del tables["superelastic"]
    shape = design.text("shape", "rectangular", NOTCH_SHAPES)
    tendon = dict(tables.get("tendon", {}))
    for name in ("EA_N", "moment_arm_mm"):
        if name in tendon:
            raise StudyError(f"rig.tendon.{name} = {quoted(tendon[name])}: expected absent: wire and tube give it")
    tables["tendon"] = {"free_length_mm": _FREE_LENGTH_MM} | tendon | {"EA_N": 1000.0, "moment_arm_mm": 0.3}
    tables["tube"] = {"outer_diameter_mm": 1.0, "inner_diameter_mm": 0.8}
    depth = 0.7 if shape == "rectangular" else 0.3
    root = {"root_width_mm": 0.01} if shape == "v_pair" else {}
    tables["notch"] = {"shape": shape, "count": 3, "depth_mm": depth, "width_mm": 0.4, "spacing_mm": 0.4} | root
    if tables["tendons"] == 2:
        del tables["tendons"]
        tables["preload_N"] = tables["preload_N"] or 10.0
    return rig_of_tables(tables, "rig", "design")


def _space(top: FileTable, base: Rig) -> Space:
    design = top.table("design", "shape", "count", "depth_share", "width_mm", "spacing_mm", "preload_N")
    cutting = top.table("cutting", "kerf_mm", "least_bridge_mm", "grid_mm")
    shape = cast("NotchShape", design.text("shape", notched_tube(base).notch.shape, NOTCH_SHAPES))
    low, high = _range(design, "count", (2.0, 30.0), above=0.0)
    if low != round(low) or high != round(high):
        raise design.complain("count", "two whole numbers, least and most")
    return Space(
        base=base,
        shape=shape,
        tubes=_tubes(top.table("stock", "tubes", "wires", "wire_modulus_GPa")),
        wires=_wires(top.table("stock")),
        cutting=Cutting(
            _above_0(cutting, "kerf_mm", KERF_MM),
            _above_0(cutting, "least_bridge_mm", LEAST_BRIDGE_MM),
            _above_0(cutting, "grid_mm", GRID_MM),
        ),
        ranges=Ranges(
            count=(int(low), int(high)),
            depth_share=_range(design, "depth_share", (0.5, 0.95), above=0.0, most=0.99),
            width_mm=_range(design, "width_mm", (0.1, 1.5), above=0.0),
            spacing_mm=_range(design, "spacing_mm", (0.1, 1.5), above=0.0),
            preload_N=_range(design, "preload_N", (5.0, 30.0), above=0.0),
        ),
    )


def _range(
    table: FileTable, key: str, default: tuple[float, float], *, above: float, most: float = math.inf
) -> tuple[float, float]:
    """Read two numbers, least and most; equal ones keep the number fixed."""
    given = table.data.get(key, list(default))
    ends = " above 0" if most == math.inf else f" from above 0 to {most:g}"
    numbers = isinstance(given, list) and len(given) == 2
    if not numbers or any(isinstance(v, bool) or not isinstance(v, int | float) for v in given):
        raise table.complain(key, f"two numbers{ends}, least and most")
    low, high = map(float, given)
    if not above < low <= high <= most:
        raise table.complain(key, f"two numbers{ends}, least and most")
    return low, high


def _above_0(table: FileTable, key: str, default: float) -> float:
    value = table.number(key, default)
    if value <= 0:
        raise table.complain(key, "above 0")
    return value


def _tubes(table: FileTable) -> tuple[TubeSize, ...]:
    """Read ``stock.tubes``: pairs of outer and inner diameter, mm."""
    if "tubes" not in table.data:
        return TUBES
    return tuple(TubeSize(outer, inner, "design file") for outer, inner in _rows(table, "tubes", 2, "outer, inner"))


def _wires(table: FileTable) -> tuple[WireSize, ...]:
    """Read ``stock.wires``: pairs of diameter, mm, and tensile strength, MPa."""
    if "wires" not in table.data:
        return WIRES
    modulus = _above_0(table, "wire_modulus_GPa", WIRES[0].modulus_GPa)
    rows = _rows(table, "wires", 2, "diameter in mm, tensile strength in MPa")
    return tuple(WireSize(diameter, strength, modulus, "design file") for diameter, strength in rows)


def _rows(table: FileTable, key: str, width: int, words: str) -> list[tuple[float, ...]]:
    given, found = table.data[key], list[tuple[float, ...]]()
    for row in given if isinstance(given, list) else []:
        numbers = isinstance(row, list) and len(row) == width and all(type(v) in (int, float) and v > 0 for v in row)
        if numbers:
            found.append(tuple(map(float, row)))
    if not found or len(found) != len(given):
        raise table.complain(key, f"rows of {width} numbers above 0: {words}")
    return found


def _size(table: FileTable) -> SearchSize:
    return SearchSize(
        explore=table.whole("explore", 1024, 0, 1_000_000),
        population=table.whole("population", 64, 8, 10_000),
        generations=table.whole("generations", 24, 1, 100_000),
        robust_generations=table.whole("robust_generations", 10, 1, 100_000),
        draws=table.whole("draws", 600, 50, 1_000_000),
        shown=table.whole("shown", 3, 1, 20),
    )
