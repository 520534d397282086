"""The work of ``notchbend run``: simulate at both preloads of the paper, cross-check, identify, separate, and trace.

Everything that the report needs goes into one folder: records (CSV and sidecar), one JSON file for each fit,
``run.json``, and the bent tube as a picture and as a mesh. ``notchbend report`` writes the page again from these.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from fem_models.load import triangle
from fem_models.rig import preset
from hysteresis.files import write_files
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record, write_record
from studies.bench_record import SHIPPED
from studies.commands.identification import identify_records, write_fit
from studies.commands.separation import separate_rig
from studies.commands.tracing import FITS, PICTURES, trace_loaded, with_ending
from studies.own_rig.design import numbers_of_preset
from studies.own_rig.loops import draw_rig, write_loop
from studies.own_rig.programs import CYCLES
from studies.own_rig.strain import strain_of_record
from studies.progress import Steps, steps
from studies.results import write_result
from studies.results.made import Made
from studies.results.run import (
    NOT_DRAWN,
    CrossCheckRow,
    FitEntry,
    RunLoop,
    RunSummary,
    SeparationEntry,
    TraceEntry,
    checksums,
)
from studies.results.trace_samples import SAMPLES
from studies.results.wrist import FILE as WRIST
from validation.engines import compare_engines

PRESET = "du2018"
PRELOADS_N = (10.0, 20.0)
AMPLITUDE_MM = 2.2
PACKAGES = ("notchbend", "exudyn", "numpy", "scipy", "numba", "pygad", "pyvista", "plotly")


def versions_found() -> dict[str, str]:
    """Give the versions of the libraries of a run that are installed; pyvista is in an extra."""
    found = dict[str, str]()
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def files_of_run(out: Path) -> list[Path]:
    """Give the files that :func:`first_report` and the report after it may write."""
    loops = [f"{PRESET}-{preload:g}N" for preload in PRELOADS_N]
    records = [*loops, *(f"{name}-analytic" for name in loops), SHIPPED.stem]
    fits = [f"identify-{name}" for name in (*loops, SHIPPED.stem, f"{SHIPPED.stem}-unknown-geometry")]
    jsons = ["run", Path(WRIST).stem, *fits, f"separate-{loops[-1]}", f"trace-{SHIPPED.stem}", "tube"]
    names = [*(f"{name}.json" for name in jsons), *(f"{name}.csv" for name in fits), "report.html", "tube.png"]
    return [
        *(out / name for name in (*names, *PICTURES, SAMPLES)),
        *(out / "records" / f"{name}{end}" for name in records for end in (".csv", ".toml")),
    ]


def first_report(out: Path, *, seed: int = 0, progress: bool = True, made: Made | None = None) -> RunSummary:
    """Run the main job into ``out`` and return the summary that is stored as ``run.json``.

    ``made`` says how it came about, and stands at the top of the page.

    ``run.json`` and the page of an earlier run are removed first, and ``run.json`` is written last, before the picture:
    a folder that has it holds a finished run.

    Raises
    ------
    SolverError, RecordError, OSError
        From the parts; files that are already written stay, each of them complete.
    """
    for name in ("run.json", WRIST, "report.html"):
        (out / name).unlink(missing_ok=True)
    with steps(progress, total=3 * len(PRELOADS_N) + 5) as step, _saying_what_is_stored(out):
        records, loops, checks = _simulated(out, step)
        shipped = read_record(SHIPPED)
        records[SHIPPED.stem] = shipped
        write_record(shipped, out / "records" / SHIPPED.name)
        fits = _identified(out, records, seed, step)
        step(f"separating {PRESET} at {PRELOADS_N[-1]:g} N")
        separation = _separated(out, PRELOADS_N[-1], seed)
        step(f"tracing {SHIPPED.stem}")
        traced = trace_loaded([shipped], seed=seed, stage=step.within(FITS))
        report, files = with_ending(traced, "")
        report = replace(report, next_program=None)  # its file is the trace command's: docs/guide/trace.md
        write_result(out / f"trace-{SHIPPED.stem}.json", report.to_dict())
        write_files({out / name: content for name, content in files.items()})
        last = records[f"{PRESET}-{PRELOADS_N[-1]:g}N"]
        strain = strain_of_record(preset(PRESET), last)
        assert strain is not None
        summary = RunSummary(
            seed=seed,
            versions=versions_found(),
            rig=numbers_of_preset(PRESET),
            peak_strain_percent=strain.peak_strain_percent,
            loops=tuple(loops),
            crosscheck=tuple(checks),
            fits=tuple(fits),
            separations=(separation,),
            trace=TraceEntry(traced.report.verdict, tuple(effect.name for effect in traced.report.effects)),
            picture=NOT_DRAWN,
            sha256=checksums(out, [*records, *(loop.theory for loop in loops)]),
            made=made,
        )
        write_result(out / "run.json", summary)
        step("drawing the tube")
        summary = replace(summary, picture=draw_rig(preset(PRESET), last, out))
    write_result(out / "run.json", summary)
    return summary


@contextmanager
def _saying_what_is_stored(out: Path) -> Iterator[None]:
    """Say on Ctrl-C what is there: whole files, but no finished run."""
    try:
        yield
    except KeyboardInterrupt as stop:
        count = sum(path.suffix in (".csv", ".json") for path in out.rglob("*"))
        if count:
            stop.add_note(f"{count} whole files are in {out}, the same command starts again and replaces them")
        raise


def _simulated(out: Path, step: Steps) -> tuple[dict[str, Record], list[RunLoop], list[CrossCheckRow]]:
    """Simulate and cross-check at both preloads: the records by name, their loops, and the comparisons of engines."""
    records, loops, checks = {}, [], []
    for preload in PRELOADS_N:
        step(f"simulating {PRESET} at {preload:g} N")
        rig = preset(PRESET, preload_N=preload)
        program, name = triangle(AMPLITUDE_MM, cycles=CYCLES), f"{PRESET}-{preload:g}N"
        solution, loop = write_loop(rig, program, triangle(AMPLITUDE_MM), out, name)
        records[name] = solution.record
        loops.append(loop)
        step(f"cross-checking at {preload:g} N")
        checks.append(CrossCheckRow(**vars(compare_engines(rig, amplitude_mm=AMPLITUDE_MM))))
    return records, loops, checks


def _identified(out: Path, records: dict[str, Record], seed: int, step: Steps) -> list[FitEntry]:
    """Identify each record; the shipped one twice, with its rig and as if the rig were unknown."""
    jobs = [(name, name, True) for name in records] + [(f"{SHIPPED.stem}-unknown-geometry", SHIPPED.stem, False)]
    fits = []
    for label, name, use_rig in jobs:
        step(f"identifying {label}")
        fit = identify_records([records[name]], settings=IdentifySettings(seed=seed), use_rig=use_rig)
        write_fit(fit, [records[name]], out, f"identify-{label}")
        fits.append(FitEntry(label, name, records[name].title))
    return fits


def _separated(out: Path, preload_N: float, seed: int) -> SeparationEntry:
    """Divide the loop of the preset with the chain, and store the result."""
    name = f"{PRESET}-{preload_N:g}N"
    write_result(
        out / f"separate-{name}.json", separate_rig(preset(PRESET, preload_N=preload_N), AMPLITUDE_MM, seed=seed)
    )
    options = f"--preset {PRESET} --preload {preload_N:g} --amplitude {AMPLITUDE_MM:g} --seed {seed}"
    return SeparationEntry(
        file=f"separate-{name}.json",
        label=f"{PRESET}, {preload_N:g} N, {AMPLITUDE_MM:g} mm",
        command=f"notchbend separate {options} --out DIR",
    )
