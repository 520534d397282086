"""The report: one self-contained HTML file, made from the results in a folder.

Each part is shown if its results are in the folder.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from plotly.offline import get_plotlyjs

from hysteresis.files import write_files
from hysteresis.own import marked_page
from hysteresis.record import RecordError
from hysteresis.record_file import read_record
from studies.report import summary
from studies.report.plots import Drawn, Series, columns_plate, draw, fit_plate, loops_plate, parts_plate
from studies.report.study import Front, StudySection, read_front, read_study
from studies.report.summary import FitResult, Verdict
from studies.report.templates import environment
from studies.report.tube import VIEWS, read_tube
from studies.results import fit, read_result, trace
from studies.results.fit import StoredFit
from studies.results.run import CrossCheckRow, FitEntry, Picture, RunSummary, read_run
from studies.results.separation import Separation
from studies.results.trace import FigureFile, StoredTrace

TEMPLATES = Path(__file__).parent / "template"
PARTS = ("run.json", "separate.json", "trace.json", "study.zarr", "pareto.json")
"""Results that a page can be made from; any of them is enough."""


@dataclass(frozen=True)
class FitSection(FitResult):
    """A fit with its charts; ``gain`` is the factor by which the layer reduces the held-out error."""

    title: str
    plate: Drawn
    gain: float | None
    command: str


@dataclass(frozen=True)
class PictureSection:
    """The tube: a still image as base64 text, or the reason why there is none, and a view in three dimensions."""

    caption: str
    missing: str | None
    data: str | None
    view: str | None


@dataclass(frozen=True)
class RunSection:
    """A main run with its charts; ``simulate`` are the commands that make its loops."""

    result: RunSummary
    command: str
    loops_plate: Drawn
    fits: tuple[FitSection, ...]
    picture: PictureSection
    simulate: tuple[str, ...]


@dataclass(frozen=True)
class SeparationSection:
    """A separation with its chart, if there is a loop."""

    label: str
    command: str
    result: Separation
    plate: Drawn | None


@dataclass(frozen=True)
class FigureSection:
    """A figure of a trace: an image as base64 text, or a chart."""

    caption: str
    image: str | None
    plate: Drawn | None


@dataclass(frozen=True)
class TraceSection:
    """A trace with its figures; ``records`` are their file names."""

    name: str
    records: str
    result: StoredTrace
    figures: tuple[FigureSection, ...]
    command: str


@dataclass(frozen=True)
class Page:
    """What the template takes; a part is None or empty if the folder has no results of it."""

    title: str
    verdicts: tuple[Verdict, ...]
    run: RunSection | None
    separations: tuple[SeparationSection, ...]
    traces: tuple[TraceSection, ...]
    study: StudySection | None
    study_plates: tuple[Drawn, ...]
    study_command: str
    front: Front | None
    front_plate: Drawn | None
    versions: Mapping[str, str]
    views: tuple[str, ...]
    plotly: str
    style: str
    script: str


def stands_alone(folder: Path) -> bool:
    """Tell whether a folder has results, and none of a main run, whose records would have to be checked."""
    return not (folder / "run.json").exists() and any((folder / name).exists() for name in PARTS)


def write_report(folder: Path) -> Path:
    """Write ``report.html`` into a folder of results; return its path.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    if not any((folder / name).exists() for name in PARTS):
        raise RecordError(f"{folder}: none of {', '.join(PARTS)}: expected results of a notchbend command")
    path = folder / "report.html"
    page = environment(TEMPLATES).get_template("page.html").render(**vars(page_of(folder)))
    write_files({path: marked_page(page)})
    return path


def page_of(folder: Path) -> Page:
    """Read the results in a folder, and draw their charts.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    run = _run(folder) if (folder / "run.json").exists() else None
    separations, traces = _separations(folder, run), _traces(folder)
    study, front = read_study(folder), read_front(folder / "pareto.json")
    study_command = study.command if study is not None else "notchbend study STUDY.toml --out DIR"
    verdicts: list[Verdict] = []
    if run is not None:
        verdicts += summary.run_verdicts(run.result, run.fits, run.command)
    verdicts += [summary.separation_verdict(s.result, s.label, s.command) for s in separations]
    verdicts += [summary.trace_verdict(t.result, t.command) for t in traces]
    if study is not None:
        verdicts.append(summary.study_verdict(study.size, study.cases, study.failed, study.pending, study_command))
    if front is not None:
        verdicts.append(summary.front_verdict(len(front.rows), front.objectives, study_command))
    return Page(
        title=_title(folder, run, study),
        verdicts=tuple(verdicts),
        run=run,
        separations=separations,
        traces=traces,
        study=study,
        study_plates=tuple(draw(plate) for plate in study.plates) if study else (),
        study_command=study_command,
        front=front,
        front_plate=draw(front.plate) if front else None,
        versions=(run.result.versions if run else {}) or (study.versions if study else {}),
        views=tuple(VIEWS),
        plotly=get_plotlyjs(),
        style=_text("style.css"),
        script=_text("page.js"),
    )


def _text(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


def _title(folder: Path, run: RunSection | None, study: StudySection | None) -> str:
    if run is not None:
        return run.result.loops[-1].title.split(",")[0]
    return study.title if study is not None else folder.resolve().name


def _run(folder: Path) -> RunSection:
    """Read a main run with its charts, its fits, and the tube."""
    run = read_run(folder)
    loops, theories = (
        [read_record(folder / "records" / f"{name}.csv") for name in names]
        for names in ((loop.record for loop in run.loops), (loop.theory for loop in run.loops))
    )
    labels = [f"{check.preload_N:g} N" for check in run.crosscheck]
    command = f"notchbend run --out DIR --seed {run.seed}"
    return RunSection(
        result=run,
        command=command,
        loops_plate=draw(loops_plate(loops, labels, theories)),
        fits=tuple(_fit(folder, item, run.seed, command) for item in run.fits),
        picture=_picture(folder, run.picture),
        simulate=tuple(_simulate_command(check) for check in run.crosscheck),
    )


def _simulate_command(check: CrossCheckRow) -> str:
    return (
        f"notchbend simulate --preset {check.rig} --preload {check.preload_N:g} "
        f"--amplitude {check.amplitude_mm:g} --cycles 3 --out loop.csv"
    )


def _fit(folder: Path, item: FitEntry, seed: int, command: str) -> FitSection:
    path = folder / f"identify-{item.name}.csv"
    found = read_result(StoredFit, path.with_suffix(".json"), fit.WHAT)
    try:
        table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError) as error:
        raise RecordError(f"{path}: {error}: expected the samples of a fit; run `notchbend run` again") from None
    drive, angle, base, predicted, heldout = table.T
    series = Series(drive, angle, base, predicted, heldout != 0)
    unit = read_record(folder / "records" / f"{item.record}.csv").drive_unit
    before, after, floor = found.baseline.heldout.rmse_deg, found.heldout.rmse_deg, found.noise_floor_deg
    again = f"notchbend identify DIR/records/{item.record}.csv --out DIR/again --seed {seed}"
    return FitSection(
        name=item.name,
        record=item.record,
        title=item.title,
        fit=found,
        plate=draw(fit_plate(series, unit, item.name)),
        gain=before / after if after > 0 else None,
        over_floor=after / floor if floor > 1e-3 else None,  # a record without noise has no floor
        # only the run itself fits a record without its rig
        command=again if item.name == item.record else command,
    )


def _picture(folder: Path, picture: Picture) -> PictureSection:
    return PictureSection(
        caption=picture.caption,
        missing=picture.missing,
        data=None if picture.file is None else _image(folder / picture.file),
        view=None if picture.tube is None else read_tube(folder / picture.tube),
    )


def _separations(folder: Path, run: RunSection | None) -> tuple[SeparationSection, ...]:
    """Read the separations of a main run, and ``separate.json``."""
    what = "the result of `notchbend separate`"
    sections = []
    for item in run.result.separations if run else ():
        result = read_result(Separation, folder / item.file, what)
        sections.append(_separation(result, item.label, item.command))
    alone = folder / "separate.json"
    if alone.exists():
        result = read_result(Separation, alone, what)
        sections.append(_separation(result, *_label_and_command(result)))
    return tuple(sections)


def _separation(result: Separation, label: str, command: str) -> SeparationSection:
    plate = parts_plate(result)
    return SeparationSection(label, command, result, draw(plate) if plate else None)


def _label_and_command(result: Separation) -> tuple[str, str]:
    rig, high = result.rig, result.drive_mm[1]
    if result.calibration is not None:
        return f"{rig['name']}, calibrated on records", "notchbend separate RECORD --out DIR"
    options = f"--preload {rig['preload_N']:g} --amplitude {high:g} --engine {result.engine}"
    return (
        f"{rig['name']}, {rig['preload_N']:g} N, {high:g} mm",
        f"notchbend separate --preset {rig['name']} {options} --out DIR",
    )


def _traces(folder: Path) -> tuple[TraceSection, ...]:
    """Read every stored trace with its figures."""
    sections = []
    for path in sorted(folder.glob("trace*.json")):
        result = read_result(StoredTrace, path, trace.WHAT)
        records = " ".join(Path(record).name for record in result.records)
        figures = tuple(_figure(folder, item) for item in result.figures)
        sections.append(TraceSection(path.stem, records, result, figures, f"notchbend trace {records} --out DIR"))
    return tuple(sections)


def _figure(folder: Path, item: FigureFile) -> FigureSection:
    """Read an image (PNG), or a CSV whose first column is drawn against the others."""
    file = folder / item.file
    if file.suffix == ".png":
        return FigureSection(item.caption, _image(file), None)
    return FigureSection(item.caption, None, _columns(file, item.caption))


def _columns(file: Path, caption: str) -> Drawn:
    try:
        names = file.read_text(encoding="utf-8").splitlines()[0].split(",")
        table = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError, IndexError) as error:
        raise RecordError(f"{file}: {error}: expected a PNG, or a CSV with a header and numbers") from None
    if table.shape[1] != len(names) or len(names) < 2:
        raise RecordError(
            f"{file}: {len(names)} names over {table.shape[1]} columns: expected a name for each, and two or more"
        )
    return draw(columns_plate(table, names, caption))


def _image(path: Path) -> str:
    try:
        return base64.b64encode(path.read_bytes()).decode()
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror}: expected an image beside the results") from None
