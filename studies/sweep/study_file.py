"""STUDY.toml: what is varied, on which rig and load program, with which engine, and what is computed."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from functools import partial
from itertools import islice, product
from pathlib import Path
from typing import Any, cast

from fem_models.rig import RigError
from fem_models.rig.ensemble import member_constants
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig_file import any_rig_of_tables, read_any_rig, rig_of_tables
from hysteresis.files import inside, read_bytes, read_text, read_toml
from hysteresis.messages import as_given, listed, quoted
from hysteresis.records.record import RecordError
from studies.programs import program_of_file
from studies.results.study import Goal, Sample
from studies.sweep.cases import program_of_table
from studies.sweep.errors import StudyError
from studies.sweep.file_table import MOST, FileTable
from studies.sweep.inputs import FIELDS, MEMBER, PROGRAM, TURN_KEYS, CaseTables, ProgramTable, clash, with_values
from studies.sweep.quantities import ENGINE_GROUPS, GROUPS, IN_SPACE, quantity_names

METHODS = ("sobol", "latin-hypercube")
MAX_CASES = 1_000_000
MAX_SAMPLE, MAX_NUMBERS = 10_000_000, 100_000_000
"""Cases of a sample, and numbers of all its points, which are held while it runs, 8 bytes each."""
MAX_AXES = 64
MOST_RIGS = 1_000  # rigs of a study that are made before the first case, to find one that can be
_TOP = (
    "schema",
    "title",
    "engine",
    "seed",
    "rig",
    "program",
    "vary",
    "sample",
    "quantities",
    "sensitivity",
    "pareto",
    "require",
)


@dataclass(frozen=True)
class Axis:
    """A number that is varied: its ``values`` in a grid, or only its range (``values`` empty) in a sample."""

    name: str
    values: tuple[float, ...]
    low: float
    high: float
    whole: bool


@dataclass(frozen=True)
class Sensitivity:
    """Sobol indices over the ranges of all axes: ``count`` times (axes + 2) cases."""

    count: int
    quantities: tuple[str, ...]
    confidence: float
    resamples: int
    seed: int


@dataclass(frozen=True)
class Limit:
    """Bounds of a quantity that a design must keep; None is no bound."""

    quantity: str
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Pareto:
    """Search for Pareto-optimal designs: ``objectives`` are quantities with their goal, min or max."""

    objectives: tuple[tuple[str, Goal], ...]
    limits: tuple[Limit, ...]
    variables: tuple[str, ...]
    population: int
    generations: int
    seed: int


@dataclass(frozen=True)
class Study:
    """A study as its file describes it.

    Every case starts from ``tables``. ``inputs`` are the files that were read, with their sha256; the study file is the
    first. ``require`` are bounds that the report judges the cases by, in place of the limits of Nitinol.
    """

    path: Path
    text: str
    title: str
    engine: str
    seed: int
    tables: CaseTables
    axes: tuple[Axis, ...]
    groups: tuple[str, ...]
    sample: Sample | None
    sensitivity: Sensitivity | None
    pareto: Pareto | None
    inputs: Mapping[Path, str]
    require: tuple[Limit, ...] = ()


def ready_studies() -> dict[str, Path]:
    """Give the studies that ship with the package, by name."""
    return {path.stem: path for path in sorted((Path(__file__).parent / "ready").glob("*.toml"))}


def files_of_study(study: Study, out: Path) -> list[Path]:
    """Give the files that running a study may replace; a folder with a store of cases keeps its own inputs."""
    names = ("study.json", "study.zarr", "report.html", "sensitivity.json", "pareto.json", "ensemble.csv")
    kept = [out / "inputs" / path.name for path in study.inputs if not (out / "cases.sqlite").exists()]
    changed = [path for path in kept if not (path.is_file() and _sha256(path) in study.inputs.values())]
    return [*(out / name for name in names), *changed]


def over_ensemble(study: Study) -> Study:
    """Return the study with the members of its preset's ensemble as one more axis, the last.

    Raises
    ------
    StudyError
        A rig without an ensemble, or a study that varies the member already, or too many cases.
    """
    if any(axis.name == MEMBER for axis in study.axes):
        raise StudyError(f"{study.path}: vary.{MEMBER}: expected absent with --ensemble")
    try:
        last = len(member_constants(str(study.tables.rig.get("name", "")))) - 1
    except RigError as error:
        raise StudyError(f"{study.path}: {error}") from None
    values = () if study.sample else tuple(float(k) for k in range(last + 1))
    more = replace(study, axes=(*study.axes, Axis(MEMBER, values, 0.0, float(last), whole=True)))
    _require_few(more)
    return more


def read_study(name: Path, *, seed: int | None = None) -> Study:
    """Read a study file, or a ready study by its name; ``seed`` replaces all seeds of the file.

    Raises
    ------
    StudyError
        One line with file, field, value and what was expected.
    """
    ready = ready_studies()
    path = ready[str(name)] if str(name) in ready and not name.exists() else name
    try:
        data = read_toml(path, f"a study file in TOML, or one of {', '.join(ready)}")
        text = read_text(path, "a study file in TOML")
        return _study(path, text, FileTable("", data, _TOP), seed)
    except (StudyError, RigError, RecordError) as error:
        words = str(error)
        raise StudyError(words if words.startswith(str(path)) else f"{path}: {words}") from None


SeedOf = Callable[[FileTable], int]
"""The seed of a table: its own, that of the file, or the one given."""


def _study(path: Path, text: str, top: FileTable, given_seed: int | None) -> Study:
    if type(top.data.get("schema")) is not int or top.data["schema"] != 1:
        raise top.complain("schema", "1")
    base_seed = top.whole("seed", 0, 0, 2**31)

    def seed(table: FileTable) -> int:
        own = table.whole("seed", base_seed, 0, 2**31)
        return own if given_seed is None else given_seed

    inputs: dict[Path, str] = {path: _sha256(path)}
    tables, engine = _tables(path, top, inputs)
    sample = _sample(top, seed)
    axes = _axes(top.table("vary"), sampled=sample is not None)
    names = [axis.name for axis in axes]
    if (found := clash(names)) is not None:
        raise StudyError(f"vary.{found[0]}: expected not beside {found[1]}, which it sets as well")
    if tables.program.drive_mm is not None and any(name.startswith("program.") for name in names):
        raise StudyError(
            f"program.file = {quoted(top.data['program']['file'])}: expected absent where the program is varied"
        )
    _require_different_names(inputs)
    groups = top.table("quantities", "groups").texts("groups", ENGINE_GROUPS[engine][:2], tuple(GROUPS))
    for group in groups:
        if group not in ENGINE_GROUPS[engine]:
            raise StudyError(f"quantities.groups = {quoted(group)}: expected one of those of the engine {engine}: "
                             + ", ".join(ENGINE_GROUPS[engine]))  # fmt: skip
    known = quantity_names(engine, groups)
    study = Study(
        path=path, text=text, title=top.text("title", path.stem), engine=engine, seed=seed(top),
        tables=tables, axes=axes, groups=groups, sample=sample,
        sensitivity=_sensitivity(top, known, seed), pareto=_pareto(top, known, names, seed), inputs=inputs,
        require=_limits(top.table("require"), known),
    )  # fmt: skip
    _require_few(study)
    _require_programs(study)
    _require_rig(study)
    return study


def _require_programs(study: Study) -> None:
    """Refuse numbers of the program that no case can run: below 0 anywhere, or a fixed program that cannot be made."""
    spans = {axis.name: (axis.low, axis.high) for axis in study.axes if axis.name.startswith("program.")}
    fixed = {f"program.{name}": getattr(study.tables.program, name) for name in PROGRAM}
    for name, span in ({name: (v, v) for name, v in fixed.items() if v is not None} | spans).items():
        for value in span:
            if not value > 0:
                raise StudyError(f"{f'vary.{name}' if name in spans else name} = {value:g}: expected above 0")
    if not spans:
        try:
            program_of_table(study.tables.program)
        except RigError as error:
            raise StudyError(f"program.{error}") from None


def _require_rig(study: Study) -> None:
    """Refuse a rig that no value of the axes makes possible; the message is that of the first case."""
    spans = [axis.values or (axis.low, 0.5 * (axis.low + axis.high), axis.high) for axis in study.axes]
    names, first = [axis.name for axis in study.axes], ""
    made = partial(any_rig_of_tables, in_space=True) if study.engine == IN_SPACE else rig_of_tables
    for values in islice(product(*spans), MOST_RIGS):
        try:
            made(with_values(study.tables, dict(zip(names, values, strict=True))).rig, "rig")
            return
        except RigError as error:
            first = first or str(error)
    raise StudyError(f"{first}, in this and all other cases that were tried")


def _require_different_names(inputs: Mapping[Path, str]) -> None:
    """Refuse two files of the same name: they are copied into one folder of the study."""
    names = [path.name for path in inputs]
    for name in names:
        if names.count(name) > 1:
            raise StudyError(f"{name}: name of two files that the study reads: expected different names")


def _require_few(study: Study) -> None:
    grid = math.prod(len(axis.values) for axis in study.axes)
    if study.sensitivity is not None and (cases := study.sensitivity.count * (len(study.axes) + 2)) > MAX_CASES:
        raise StudyError(
            f"sensitivity.count = {study.sensitivity.count}: {cases:,} cases: expected at most {MAX_CASES:,}"
        )
    if study.pareto is not None and (designs := study.pareto.population * study.pareto.generations) > MAX_CASES:
        raise StudyError(f"pareto: population times generations = {designs:,} designs: expected at most {MAX_CASES:,}")
    if study.sample is not None and (numbers := study.sample.count * len(study.axes)) > MAX_NUMBERS:
        raise StudyError(
            f"sample.count = {study.sample.count}: {numbers:,} numbers of {len(study.axes)} axes: "
            f"expected at most {MAX_NUMBERS:,}"
        )
    if study.sample is None and grid > MAX_CASES:
        raise StudyError(f"vary: a grid of {grid:,} cases: expected at most {MAX_CASES:,}; [sample] takes fewer")


def _sha256(path: Path) -> str:
    return hashlib.sha256(read_bytes(path, "an input of the study")).hexdigest()


def _tables(path: Path, top: FileTable, inputs: dict[Path, str]) -> tuple[CaseTables, str]:
    """Read rig, load program and engine; files, relative to the study file's folder, are added to ``inputs``."""
    table = top.table("rig")
    if ("preset" in table.data) == ("file" in table.data):
        raise StudyError("[rig]: expected either preset or file")
    if "preset" in table.data:
        rig = any_preset(table.text("preset"))
    else:
        file = inside(path, "rig.file", table.text("file"), [".toml"])
        rig = read_any_rig(file)
        inputs[file] = _sha256(file)
    changed = {}
    for name, value in _dotted({k: v for k, v in table.data.items() if k not in ("preset", "file")}):
        if name not in FIELDS or name.startswith("program."):
            raise StudyError(
                f"rig.{as_given(name)} = {quoted(value)}: expected preset, file or a number of a rig, {_some(name)}"
            )
        changed[name] = _value(f"rig.{name}", value, FIELDS[name])
    program = _program(path, top.table("program", "amplitude_mm", "cycles", "step_mm", "rate_Hz", "file"), inputs)
    engine = _engine(top, rig.name, in_space=not rig.is_planar)
    if engine == IN_SPACE and program.drive_mm is not None:
        raise StudyError(f"program.file: expected amplitude_mm with the rig {rig.name}, which bends in space")
    return with_values(CaseTables(rig.to_dict(), program), changed), engine


def _engine(top: FileTable, rig: str, *, in_space: bool) -> str:
    """Give the engine: of a rig in space its chain, which is the default."""
    engine = top.text("engine", "chain", list(ENGINE_GROUPS))
    if in_space and engine not in ("chain", IN_SPACE):
        raise top.complain("engine", f"chain, for the rig {rig} bends in space")
    if engine == IN_SPACE and not in_space:
        raise top.complain("engine", f"chain, for the rig {rig} bends in one plane")
    turned = [] if in_space else [name for name, _ in _axes_dotted(top.table("vary").data) if name in TURN_KEYS]
    if turned:
        raise StudyError(f"vary.{turned[0]}: expected absent with the rig {rig}, which bends in one plane")
    return IN_SPACE if in_space else engine


def _dotted(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _dotted(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _program(path: Path, table: FileTable, inputs: dict[Path, str]) -> ProgramTable:
    if "file" in table.data:
        if len(table.data) > 1:
            raise table.complain("file", "to stand alone: it has the whole program")
        file = inside(path, "program.file", table.text("file"), [".csv"])
        program = program_of_file(file)
        inputs[file] = _sha256(file)
        time = program.time_s
        return ProgramTable(
            drive_mm=tuple(program.drive_mm.tolist()), time_s=None if time is None else tuple(time.tolist())
        )
    cycles, amplitude = table.whole("cycles", 1, 1, 10_000), table.number("amplitude_mm")
    if "rate_Hz" in table.data:
        if "step_mm" in table.data:
            raise table.complain("step_mm", "absent beside rate_Hz, which makes a sine")
        return ProgramTable(amplitude, cycles, rate_Hz=table.number("rate_Hz"))
    return ProgramTable(amplitude, cycles, step_mm=table.number("step_mm", 0.1))


def _sample(top: FileTable, seed: SeedOf) -> Sample | None:
    if "sample" not in top.data:
        return None
    table = top.table("sample", "method", "count", "seed")
    return Sample(table.text("method", None, METHODS), table.whole("count", None, 2, MAX_SAMPLE), seed(table))


def _axes(table: FileTable, *, sampled: bool) -> tuple[Axis, ...]:
    if not table.data:
        raise StudyError("[vary]: missing, expected at least one field with its values")
    axes = tuple(_axis(table, name, value, sampled) for name, value in _axes_dotted(table.data))
    if not 1 <= len(axes) <= MAX_AXES:
        raise StudyError(f"[vary]: {len(axes)} fields: expected at least one with its values, at most {MAX_AXES}")
    return axes


def _axes_dotted(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Accept ``notch.depth_mm = [..]`` without quotes, which TOML reads as nested tables."""
    for key, value in table.items():
        if isinstance(value, Mapping) and "from" not in value and "to" not in value:
            yield from _axes_dotted(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _axis(table: FileTable, name: str, given: object, sampled: bool) -> Axis:
    where = f"vary.{as_given(name)}"
    if name not in FIELDS:
        raise StudyError(f"{where} = {quoted(given)}: expected a number of the rig or the program, {_some(name)}")
    whole = FIELDS[name]
    if isinstance(given, Mapping):
        span = FileTable(where, given, ("from", "to", "count"))
        low, high = _value(f"{where}.from", given.get("from"), whole), _value(f"{where}.to", given.get("to"), whole)
        if not low < high:
            raise span.complain("to", f"above from = {low:g}")
        if sampled:
            if "count" in given:
                raise span.complain("count", "absent beside [sample], which has the count")
            return Axis(name, (), low, high, whole)
        count = span.whole("count", None, 2, MAX_CASES)
        values = [low + (high - low) * k / (count - 1) for k in range(count - 1)] + [high]
    elif isinstance(given, list) and given:
        if sampled:
            raise StudyError(f"{where} = {quoted(given)}: expected {{from = , to = }} beside [sample]")
        values = [_value(where, value, whole) for value in given]
    else:
        raise StudyError(f"{where} = {quoted(given)}: expected a list of numbers, or {{from = , to = , count = }}")
    values = [_value(where, value, whole) for value in values]
    if len(set(values)) < len(values):
        raise StudyError(f"{where} = {quoted(given)}: expected different values")
    return Axis(name, tuple(values), min(values), max(values), whole)


def _value(where: str, value: object, whole: bool) -> float:
    if value is None:
        raise StudyError(f"{where}: missing, expected a number")
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= MOST:
        raise StudyError(f"{where} = {quoted(value)}: expected a finite number, at most {MOST:g}")
    if whole and value != round(value):
        raise StudyError(f"{where} = {quoted(value)}: expected a whole number")
    return float(value)


def _some(name: str) -> str:
    """List the most similar fields of the same table, or the tables if there is no such table."""
    table = name.partition(".")[0] + "."
    same = [field for field in FIELDS if "." in name and field.startswith(table)]
    same.sort(key=lambda field: -SequenceMatcher(None, field, name).ratio())
    tables = sorted({field.partition(".")[0] + (".*" if "." in field else "") for field in FIELDS})
    return "one of " + listed(same[:3] or tables)


def _sensitivity(top: FileTable, known: Sequence[str], seed: SeedOf) -> Sensitivity | None:
    if "sensitivity" not in top.data:
        return None
    table = top.table("sensitivity", "count", "quantities", "confidence", "resamples", "seed")
    count = table.whole("count", None, 4, MAX_CASES)
    if count & (count - 1):
        raise table.complain("count", "a power of two: Sobol's points are even over the ranges only then")
    confidence = table.number("confidence", 0.95)
    if not 0 < confidence < 1:
        raise table.complain("confidence", "between 0 and 1")
    quantities = table.texts("quantities", known, known)
    return Sensitivity(count, quantities, confidence, table.whole("resamples", 200, 10, 100_000), seed(table))


def _pareto(top: FileTable, known: Sequence[str], axes: Sequence[str], seed: SeedOf) -> Pareto | None:
    if "pareto" not in top.data:
        return None
    table = top.table("pareto", "objectives", "limits", "variables", "population", "generations", "seed")
    goals = table.table("objectives")
    if len(goals.data) < 2:
        raise table.complain("objectives", "two or more quantities, each with min or max")
    for name in goals.data:
        if name not in known:
            raise goals.complain(name, "a quantity of this study, one of " + listed(known))
    return Pareto(
        objectives=tuple((name, cast("Goal", goals.text(name, None, ("min", "max")))) for name in goals.data),
        limits=_limits(table.table("limits"), known),
        variables=table.texts("variables", axes, axes),
        population=table.whole("population", 40, 4, 10_000),
        generations=table.whole("generations", 25, 1, 100_000),
        seed=seed(table),
    )


def _limits(table: FileTable, known: Sequence[str]) -> tuple[Limit, ...]:
    """Read bounds of quantities, each with min, max or both."""
    limits = []
    for name in table.data:
        if not isinstance(table.data[name], Mapping):
            raise table.complain(name, "{ min = } or { max = }")
        limit = table.table(name, "min", "max")
        if name not in known or not limit.data:
            raise StudyError(
                f"{limit.name} = {quoted(dict(limit.data))}: expected min or max of one of {listed(known)}"
            )
        low, high = (limit.number(key) if key in limit.data else None for key in ("min", "max"))
        limits.append(Limit(name, low, high))
    return tuple(limits)
