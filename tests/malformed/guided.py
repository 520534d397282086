"""A fuzzer that is guided by coverage: ``python -m tests.malformed.guided KIND SECONDS CORPUS``.

It needs atheris (Google's libFuzzer for Python), which is not among the tools of developers: install it beside them.
KIND is a key of :func:`kinds`. What breaks the promise (a refusal that names the file, within 5 s) ends the run, and
its file is kept as ``CORPUS/crash-...``. Findings become tests.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

MOST_S = 5
MODULES = [
    "hysteresis.files", "hysteresis.messages", "hysteresis.plain", "hysteresis.records.record_file",
    "hysteresis.records.record", "hysteresis.records.sidecar", "fem_models.rig.rig_file", "fem_models.rig.checks",
    "fem_models.rig.of_record", "fem_models.rig.effects", "fem_models.rig.joints", "fem_models.rig.rig",
    "studies.sweep.study_file", "studies.sweep.inputs", "studies.results.files", "studies.results.run",
    "studies.commands.compensation", "studies.engines", "studies.own_rig.bench_csv",
]  # fmt: skip

Read = Callable[[Path], object]


def kinds(folder: Path) -> dict[str, tuple[Path, Read]]:
    """Make good files of each kind; return the file to change, and what reads it."""
    import_module("malformed.samples").readers(folder)
    records, study, fits, run, trace = (folder / one for one in ("records", "study", "fits", "run", "trace"))
    record_file, of_record = import_module("hysteresis.records.record_file"), import_module("fem_models.rig.of_record")
    compensation = import_module("studies.commands.compensation")
    results = import_module("studies.results.run")
    page = import_module("studies.report.page")

    def record(_: Path) -> object:
        return of_record.rig_of(record_file.read_record(records / "loop.csv"))

    return {
        "record": (records / "loop.csv", record),
        "sidecar": (records / "loop.toml", record),
        "theory": (records / "theory.csv", record),
        "rig": (records / "mine.toml", import_module("fem_models.rig.rig_file").read_rig),
        "program": (records / "program.csv", import_module("studies.engines").program_of_file),
        "study": (study / "study.toml", import_module("studies.sweep.study_file").read_study),
        "fit": (fits / "identify.json", compensation.read_layer),
        "reference": (fits / "reference.csv", compensation.read_reference),
        "run": (run / "run.json", lambda path: results.read_run(path.parent)),
        "trace": (trace / "trace.json", lambda path: page.write_report(path.parent)),
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
        import_module("studies.sweep.errors").StudyError,
    )
    corpus.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        path, read = kinds(Path(made) / "good")[kind]
        (corpus / f"good-{path.name}").write_bytes(path.read_bytes())
        read(path)

        def once(data: bytes) -> None:
            path.write_bytes(data)
            try:
                read(path)
            except refusals as error:
                if path.parent.name not in str(error):  # commands make one line of it
                    raise RuntimeError(f"a refusal that names no file: {error}") from None

        arguments = [f"-max_total_time={seconds}", f"-timeout={MOST_S}", "-max_len=8192", "-seed=1"]
        atheris.Setup([sys.argv[0], str(corpus), f"-artifact_prefix={corpus}/", *arguments], once)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
