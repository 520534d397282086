"""A fuzzer that is guided by coverage: ``python -m tests.malformed.guided KIND SECONDS CORPUS``.

It needs atheris (Google's libFuzzer for Python), which is not among the tools of developers: install it beside them.
KIND is a key of :func:`kinds`. What breaks the promise (a refusal that names the file, within 5 s) ends the run, and
its file is kept as ``CORPUS/crash-...``. Findings become tests.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, NoReturn

MOST_S = 5
LEAST_BYTES = 8192
HANGS_S = 60
"""Time of the clock after which a reader counts as waiting; the machine may be shared."""
FAULTS = (ArithmeticError, AttributeError, LookupError, OSError, RuntimeError, TypeError, ValueError)
"""What a reader without a check raises; the fuzzer itself keeps the file of any other error."""
MODULES = [
    "hysteresis.files", "hysteresis.messages", "hysteresis.plain", "hysteresis.records.record_file",
    "hysteresis.records.record", "hysteresis.records.sidecar", "fem_models.rig.rig_file", "fem_models.rig.checks",
    "fem_models.rig.of_record", "fem_models.rig.effects", "fem_models.rig.joints", "fem_models.rig.rig",
    "studies.sweep.study_file", "studies.sweep.inputs", "studies.results.files", "studies.results.run",
    "studies.commands.compensation", "studies.engines", "studies.own_rig.columns", "studies.own_rig.samples",
    "fem_models.rig.layout", "fem_models.spatial.drives", "fem_models.spatial.rig",
    "studies.programs", "studies.results.wrist", "studies.results.workspace", "studies.results.compensation",
    "studies.results.separation", "studies.results.fit", "studies.results.trace", "studies.results.study",
    "studies.report.study", "studies.report.parts.wrists", "studies.report.parts.reach", "studies.report.parts.fits",
    "studies.report.parts.followed", "validation.tracing.baseline.in_space", "validation.tracing.prepared",
    "validation.tracing.trace", "hysteresis.sensors.readings", "hysteresis.sensors.lone_steps",
    "validation.tracing.sensors.drive_steps", "validation.tracing.baseline.known_rig", "hysteresis.records.path",
    "validation.tracing.baseline.equivalent_rig", "validation.tracing.baseline.runs", "hysteresis.records.metrics",
    "studies.own_rig.tables.cells", "studies.own_rig.tables.layout", "studies.own_rig.tables.text",
    "studies.own_rig.tables.table", "studies.own_rig.tables.read", "studies.own_rig.tables.spreadsheet",
    "studies.own_rig.tables.arrays", "hysteresis.records.units", "hysteresis.records.wrapped",
    "validation.tracing.baseline.samples", "hysteresis.records.leaps", "hysteresis.records.holdout",
]  # fmt: skip

BASELINE = "validation.tracing.baseline"

Read = Callable[[Path], object]


def kinds(folder: Path) -> dict[str, tuple[Path, Read]]:
    """Make good files of each kind; return the file to change, and what reads it."""
    import_module("malformed.samples").readers(folder)
    records, study, fits, run, trace = (folder / one for one in ("records", "study", "fits", "run", "trace"))
    space = folder / "space"
    record_file, of_record = import_module("hysteresis.records.record_file"), import_module("fem_models.rig.of_record")
    compensation = import_module("studies.commands.compensation")
    results = import_module("studies.results.run")
    page = import_module("studies.report.page")
    in_space = import_module("validation.tracing.baseline.in_space")
    tracing, equivalent = import_module("validation.tracing.trace"), import_module(f"{BASELINE}.equivalent_rig")
    known_rig = import_module(f"{BASELINE}.known_rig")
    own_rig = import_module("studies.own_rig.new_record")
    wheels = import_module("studies.programs").wheels_of_file
    read_study = import_module("studies.sweep.study_file").read_study

    def record(_: Path) -> object:
        return of_record.rig_of(record_file.read_record(records / "loop.csv"))

    def record_in_space(_: Path) -> object:
        return in_space.space_problem([record_file.read_record(space / "loop.csv")])

    def prepared_record(_: Path) -> object:
        """Take a record as a trace does, up to the first fit."""
        whole, _ = tracing._with_all_counts([record_file.read_record(records / "loop.csv")])
        numbered = tracing._numbered(whole)
        return known_rig.known_rig_problem(numbered), equivalent.equivalent_rig_problem(numbered)

    def bench(path: Path) -> object:
        copy = path.with_name("new.csv")
        for one in (copy, copy.with_suffix(".toml")):
            one.unlink(missing_ok=True)
        return own_rig.new_record(path, own_rig.RecordRig({}, None), out=copy)

    def reference_in_space(path: Path) -> object:
        return record_file.read_columns(path, ["angle_deg", "angle_2_deg"], optional=["time_s"])

    def report(path: Path) -> object:
        return page.write_report(path.parent)

    return {
        "record": (records / "loop.csv", record),
        "prepared-record": (records / "loop.csv", prepared_record),
        "its-sidecar": (records / "loop.toml", prepared_record),
        "sidecar": (records / "loop.toml", record),
        "theory": (records / "theory.csv", record),
        "rig": (records / "mine.toml", import_module("fem_models.rig.rig_file").read_rig),
        "program": (records / "program.csv", import_module("studies.programs").program_of_file),
        "study": (study / "study.toml", read_study),
        "fit": (fits / "identify.json", compensation.read_layer),
        "reference": (fits / "reference.csv", compensation.read_reference),
        "run": (run / "run.json", lambda path: results.read_run(path.parent)),
        "trace": (trace / "trace.json", report),
        "rig-in-space": (space / "wrist.toml", import_module("fem_models.rig.rig_file").read_any_rig),
        "program-in-space": (space / "program.csv", wheels),
        "tensions-in-space": (space / "tensions.csv", wheels),
        "record-in-space": (space / "loop.csv", record_in_space),
        "sidecar-in-space": (space / "loop.toml", record_in_space),
        "reference-in-space": (space / "wanted.csv", reference_in_space),
        "study-in-space": (space / "study.toml", read_study),
        "bench": (records / "bench.csv", bench),
        "stored-study": (folder / "results" / "study.json", report),
        "stored-wrist": (folder / "wrist" / "wrist.json", report),
        "stored-workspace": (folder / "workspace" / "workspace.json", report),
        "stored-compensation": (folder / "compensation" / "drives-compensate.json", report),
        "stored-trace-in-space": (folder / "trace in space" / "trace.json", report),
        "stored-fit": (folder / "fit" / "identify.json", report),
        "stored-separation": (folder / "separation" / "separate.json", report),
    }


def _functions(module: ModuleType) -> list[FunctionType]:
    """Functions and methods of a module; kernels are none, and numba would not know their bytecode again."""
    found: list[FunctionType] = []
    for item in vars(module).values():
        if getattr(item, "__module__", "") == module.__name__:
            found += [one for one in (vars(item).values() if isinstance(item, type) else [item])
                      if isinstance(one, FunctionType)]  # fmt: skip
    return found


def main() -> None:
    """Fuzz one kind of file for some seconds."""
    kind, seconds, corpus = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    sys.path[:0] = [str(Path(__file__).parents[1])]
    atheris: Any = import_module("atheris")
    for module in MODULES:
        for function in _functions(import_module(module)):
            atheris.instrument_func(function)
    refusals = (
        import_module("hysteresis.files").RecordError,
        import_module("fem_models.rig.checks").RigError,
        import_module("fem_models.rig.checks").SolverError,
        import_module("studies.sweep.errors").StudyError,
    )
    corpus.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        path, read = kinds(Path(made) / "good")[kind]
        (corpus / f"good-{path.name}").write_bytes(path.read_bytes())
        read(path)

        def once(data: bytes) -> None:
            path.write_bytes(data)
            start = time.process_time()
            try:
                read(path)
            except refusals as error:
                if path.parent.name not in str(error):  # commands make one line of it
                    kept(data, f"a refusal that names no file: {error}")
            except FAULTS:
                kept(data, traceback.format_exc())
            if (took := time.process_time() - start) > MOST_S:
                kept(data, f"{took:.1f} s of computing")

        def kept(data: bytes, why: str) -> NoReturn:
            """Keep a finding and end: the fuzzer's own way out may take so long that its alarm ends it first."""
            name = f"crash-{hashlib.sha1(data, usedforsecurity=False).hexdigest()}"
            (corpus / name).write_bytes(data)
            sys.stderr.write(f"\n{name}: {why}\n")
            sys.stderr.flush()
            os._exit(1)

        most = max(LEAST_BYTES, 2 * path.stat().st_size)  # a file that is cut to fewer bytes never parses
        arguments = [f"-max_total_time={seconds}", f"-timeout={HANGS_S}", f"-max_len={most}", "-seed=1"]
        atheris.Setup([sys.argv[0], str(corpus), f"-artifact_prefix={corpus}/", *arguments], once)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
