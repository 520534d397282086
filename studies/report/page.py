"""The report: one self-contained HTML file, made from the results in a folder.

Each part is shown if its results are in the folder.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.attempts import attempt
from hysteresis.files import inside, present, write_files
from hysteresis.messages import quoted
from hysteresis.own import marked_page
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import column_names, read_columns, read_record
from studies.report import summary
from studies.report.parts.advice import what_to_do
from studies.report.parts.comparisons import (
    CompensationSection,
    ValidationSection,
    compensation_verdict,
    read_compensations,
    read_validation,
    validation_verdict,
)
from studies.report.parts.designed import FILE as DESIGN
from studies.report.parts.designed import DesignSection, designed_verdicts, read_designed
from studies.report.parts.device import FILE as DEVICE
from studies.report.parts.device import DeviceSection, device_verdict, read_device
from studies.report.parts.fits import FitSection, read_fit, run_fit
from studies.report.parts.followed import FollowedSection, followed_verdict, read_followed
from studies.report.parts.page_one import PageOneSection, read_page_one_section
from studies.report.parts.pictures import PictureSection, image_text, read_picture
from studies.report.parts.predictions import PredictedRecord, predicted_records
from studies.report.parts.reach import ReachSection, reach_verdict, read_reach
from studies.report.parts.stiffnesses import NAMES, SixSection, read_six, six_verdict
from studies.report.parts.traced import trace_command, trace_plates
from studies.report.parts.wrists import WristSection, read_wrist_section, wrist_verdicts
from studies.report.plots import LOOPS_CAPTION, TOE_CAPTION, Drawn, columns_plate, draw, loops_plate, parts_plate
from studies.report.study import Front, StudySection, read_front, read_study
from studies.report.summary import Verdict
from studies.report.templates import environment
from studies.report.tube import VIEWS
from studies.results import read_result, trace
from studies.results.compensation import ENDING
from studies.results.made import Made
from studies.results.page_one import FILE as PAGE_ONE
from studies.results.run import OF_RUNS, RunLoop, RunSummary, read_run, record_of_run
from studies.results.separation import Separation
from studies.results.trace import FigureFile, StoredTrace
from studies.results.trace_samples import read_samples
from studies.results.validation import FILE_IN_SPACE as SIX
from studies.results.workspace import FILES as WORKSPACE_FILES
from studies.results.wrist import FILE as WRIST

PAGE = "report.html"
REACH = WORKSPACE_FILES[0]
PARTS = (
    "run.json",
    WRIST,
    "identify.json",
    "separate.json",
    "trace.json",
    "validate.json",
    SIX,
    "study.zarr",
    "pareto.json",
    REACH,
    DESIGN,
    DEVICE,
    PAGE_ONE,
)
"""Results that a page can be made from; any of them is enough."""


@dataclass(frozen=True)
class RunSection:
    """A main run with its charts; ``simulate`` are the commands that make its loops."""

    result: RunSummary
    command: str
    loops_plate: Drawn
    picture: PictureSection
    simulate: tuple[str, ...]
    validate: str
    predicted: tuple[PredictedRecord, ...]


@dataclass(frozen=True)
class SeparationSection:
    """A separation with its chart, if there is a loop."""

    label: str
    command: str
    result: Separation
    plate: Drawn | None


@dataclass(frozen=True)
class FigureSection:
    """A figure of a trace of which no samples are stored: an image as base64 text, or a chart."""

    caption: str
    image: str | None
    plate: Drawn | None


@dataclass(frozen=True)
class TraceSection:
    """A trace with its charts, or its figures; ``records`` are their file names, ``pictures`` those of figures."""

    name: str
    records: str
    result: StoredTrace
    plates: tuple[Drawn, ...]
    figures: tuple[FigureSection, ...]
    pictures: tuple[str, ...]
    command: str


@dataclass(frozen=True)
class Parts:
    """What was read from a folder; a part is None or empty if the folder has no results of it."""

    page_one: PageOneSection | None
    run: RunSection | None
    wrist: WristSection | None
    reach: ReachSection | None
    separations: tuple[SeparationSection, ...]
    fits: tuple[FitSection, ...]
    traces: tuple[TraceSection, ...]
    validation: ValidationSection | None
    six: SixSection | None
    compensations: tuple[CompensationSection, ...]
    followed: tuple[FollowedSection, ...]
    study: StudySection | None
    front: Front | None
    design: DesignSection | None
    device: DeviceSection | None

    @property
    def study_command(self) -> str:
        """The command that makes the study again."""
        return self.study.command if self.study is not None else "notchbend study STUDY.toml --out DIR"


@dataclass(frozen=True)
class Page(Parts):
    """What the template takes: the parts, and what is drawn and said of them.

    ``made`` says how the results came about, one entry a command, in the order of the parts. ``above`` is the command
    of the page's head that verdicts do not repeat, empty where it is not clear which of them it made.
    """

    title: str
    made: tuple[Made, ...]
    above: str
    advice: tuple[str, ...]
    legend: Mapping[str, str]
    verdicts: tuple[Verdict, ...]
    fits_command: str
    study_plates: tuple[Drawn, ...]
    front_plate: Drawn | None
    versions: Mapping[str, str]
    views: tuple[str, ...]
    six_names: Mapping[str, str]


def stands_alone(folder: Path) -> bool:
    """Tell whether a folder has results, and none of a run, whose records would have to be checked."""
    return not any(present(folder / name) for name in OF_RUNS) and _has_results(folder)


def _has_results(folder: Path) -> bool:
    return any(present(folder / name) for name in PARTS) or any(folder.glob(f"*{ENDING}"))


def write_report(folder: Path) -> Path:
    """Write ``report.html`` into a folder of results; return its path.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    path = folder / PAGE
    write_files({path: page_text(folder, page_of(folder))})
    return path


def page_text(folder: Path, found: Page) -> str:
    """Give the page of what was read from a folder, HTML."""
    templates = environment()
    here, given = shlex.quote(str(folder)), {one.command for one in found.made}
    templates.filters["here"] = lambda command: (
        command if command in given else re.sub(r"\bDIR\b", lambda _: here, command)
    )
    page = templates.get_template("page.html").render(**vars(found), study_command=found.study_command)
    return marked_page(page)


@dataclass(frozen=True)
class Written:
    """What came of a page: its content, None where it cannot be made, and a line that says where it is, or why not."""

    page: Page | None
    line: str


def try_report(folder: Path) -> Written:
    """Write ``report.html`` of a folder whose results are stored; one that cannot be made is a line.

    The page of earlier results is removed first.

    Raises
    ------
    RecordError
        A folder that cannot be written to.
    """
    failed = list[str]()
    (folder / PAGE).unlink(missing_ok=True)

    def made() -> tuple[Page, str]:
        page = page_of(folder)
        return page, page_text(folder, page)

    found = attempt(f"no {PAGE}", made, None, failed)
    if found is None:
        return Written(None, failed[0])
    write_files({folder / PAGE: found[1]})
    return Written(found[0], f"report: {folder / PAGE}")


def page_of(folder: Path) -> Page:
    """Read the results in a folder, and draw their charts.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    if not _has_results(folder):
        names = ", ".join((*PARTS, f"*{ENDING}"))
        raise RecordError(f"{folder}: none of {names}: expected results of a notchbend command")
    run = _run(folder) if present(folder / "run.json") else None
    parts = Parts(
        page_one=read_page_one_section(folder),
        run=run,
        wrist=read_wrist_section(folder),
        reach=read_reach(folder),
        separations=_separations(folder, run),
        fits=_fits(folder, run),
        traces=_traces(folder, run),
        validation=read_validation(folder),
        six=read_six(folder),
        compensations=read_compensations(folder),
        followed=read_followed(folder),
        study=read_study(folder),
        front=read_front(folder / "pareto.json"),
        design=read_designed(folder),
        device=read_device(folder),
    )
    made, study, fits, front = _made(parts), parts.study, parts.fits, parts.front
    known = tuple(one for one in made if one is not None)
    versions = [one.result.versions for one in (run, parts.wrist) if one is not None]
    versions += [study.versions] if study is not None else []
    return Page(
        title=_title(folder, parts),
        made=known,
        above=known[0].command if len(known) == 1 and made[0] is not None else "",
        advice=what_to_do(folder, study.feasible if study else None),
        legend=summary.LEGEND,
        verdicts=tuple(_verdicts(parts)),
        fits_command=run.command if run else fits[0].command if fits else "",
        study_plates=tuple(draw(plate) for plate in study.plates) if study else (),
        front_plate=draw(front.plate) if front else None,
        versions=next((found for found in versions if found), {}),
        views=tuple(VIEWS),
        six_names=NAMES,
        **vars(parts),
    )


def _verdicts(parts: Parts) -> list[Verdict]:
    """Give the verdicts in the order of the page."""
    run, fits, out = parts.run, parts.fits, list[Verdict]()
    if run is not None:
        out += summary.run_verdicts(run.result, fits, run.command)
    elif fits:
        out += summary.layer_verdicts(fits)
    if parts.wrist is not None:
        out += wrist_verdicts(parts.wrist)
    if parts.reach is not None:
        out.append(reach_verdict(parts.reach))
    out += [summary.separation_verdict(s.result, s.label, s.command) for s in parts.separations]
    out += [summary.trace_verdict(t.result, t.command) for t in parts.traces]
    if parts.validation is not None:
        out.append(validation_verdict(parts.validation))
    if parts.six is not None:
        out.append(six_verdict(parts.six))
    out += [compensation_verdict(one) for one in parts.compensations]
    out += [followed_verdict(one) for one in parts.followed]
    if parts.device is not None:
        out.append(device_verdict(parts.device))
    if parts.study is not None:
        out += summary.study_verdicts(parts.study, parts.study_command)
    if parts.front is not None:
        out.append(summary.front_verdict(len(parts.front.rows), parts.front.objectives, parts.study_command))
    if parts.design is not None:
        out += designed_verdicts(parts.design, alone=parts.page_one is None)
    return out


def _made(parts: Parts) -> list[Made | None]:
    """Say how each result came about; a workspace of the report of a rig in space is not listed again."""
    wrist, reach = parts.wrist, parts.reach
    out: list[Made | None] = [one.result.made for one in (parts.run, wrist) if one is not None]
    if reach is not None and (wrist is None or reach.result.made != wrist.result.made):
        out.append(reach.result.made)
    out += [one.result.made for one in parts.separations] + [one.fit.made for one in parts.fits]
    out += [one.result.made for one in parts.traces]
    out += [one.result.made for one in (parts.validation, parts.six) if one is not None]
    out += [one.result.made for one in parts.compensations] + [one.result.made for one in parts.followed]
    out += [] if parts.study is None else [parts.study.made]
    return out + [one.result.made for one in (parts.design, parts.device) if one is not None]


def _title(folder: Path, parts: Parts) -> str:
    run, study = parts.run, parts.study
    if run is not None:
        own = run.result.own
        return own.name if own is not None else run.result.loops[-1].title.split(",")[0]
    if parts.wrist is not None:
        return parts.wrist.result.name
    if parts.design is not None:
        return parts.design.result.title
    if parts.page_one is not None and parts.page_one.result.title is not None:
        return parts.page_one.result.title
    return study.title if study is not None else folder.resolve().name


def _run(folder: Path) -> RunSection:
    """Read a main run with its charts and the tube."""
    run = read_run(folder)
    loops, theories = (
        [read_record(record_of_run(folder, name)) for name in names]
        for names in ((loop.record for loop in run.loops), (loop.theory for loop in run.loops))
    )
    labels = [summary.preload_label(loop) for loop in run.loops]
    own = run.own
    command = run.made.command if run.made else f"notchbend run --out DIR --seed {run.seed}"
    option = own.option if own is not None else f"--preset {run.crosscheck[-1].rig}"
    amplitude = own.amplitude_mm if own is not None else run.crosscheck[-1].amplitude_mm
    caption = TOE_CAPTION if own is None else LOOPS_CAPTION
    return RunSection(
        result=run,
        command=command,
        loops_plate=draw(loops_plate(loops, labels, theories, caption)),
        picture=read_picture(folder, "run.json", run.picture),
        simulate=tuple(_simulate_command(option, loop, amplitude) for loop in run.loops),
        validate=f"notchbend validate {option} --out DIR",
        predicted=predicted_records(folder, run),
    )


def _simulate_command(option: str, loop: RunLoop, amplitude_mm: float) -> str:
    preload = f"--preload {loop.preload_N:g} " if loop.preload_N else ""
    return f"notchbend simulate {option} {preload}--amplitude {amplitude_mm:g} --cycles 3 --out loop.csv"


def _fits(folder: Path, run: RunSection | None) -> tuple[FitSection, ...]:
    """Read the fits of a main run, and ``identify.json``."""
    alone = read_fit(folder)
    of_run = () if run is None else (run_fit(folder, item, run.result.seed, run.command) for item in run.result.fits)
    return (*of_run, *(() if alone is None else (alone,)))


def _separations(folder: Path, run: RunSection | None) -> tuple[SeparationSection, ...]:
    """Read the separations of a main run, and ``separate.json``."""
    sections = []
    for item in run.result.separations if run else ():
        result = _read_separation(inside(folder / "run.json", "separations[].file", item.file, [".json"]))
        sections.append(_separation(result, item.label, item.command))
    alone = folder / "separate.json"
    if present(alone):
        result = _read_separation(alone)
        sections.append(_separation(result, *_label_and_command(result)))
    return tuple(sections)


def _read_separation(path: Path) -> Separation:
    result = read_result(Separation, path, "the result of `notchbend separate`")
    for key, kind in (("name", str), ("preload_N", int | float)):
        if not isinstance(result.rig.get(key), kind):
            raise RecordError(f"{path}: rig: {key} = {quoted(result.rig.get(key))}: expected that of a rig")
    return result


def _separation(result: Separation, label: str, command: str) -> SeparationSection:
    plate = parts_plate(result)
    return SeparationSection(label, command, result, draw(plate) if plate else None)


def _label_and_command(result: Separation) -> tuple[str, str]:
    rig, high = result.rig, result.drive_mm[1]
    if result.calibration is not None:
        records = " ".join(map(shlex.quote, result.records)) or "RECORD"
        return f"{rig['name']}, calibrated on records", f"notchbend separate {records} --out DIR"
    options = f"--preload {rig['preload_N']:g} --amplitude {high:g} --engine {result.engine}"
    return (
        f"{rig['name']}, {rig['preload_N']:g} N, {high:g} mm",
        f"notchbend separate --preset {rig['name']} {options} --out DIR",
    )


def _traces(folder: Path, run: RunSection | None) -> tuple[TraceSection, ...]:
    """Read every stored trace with its figures."""
    own = set() if run is None else {f"{name}.csv" for name in run.result.sha256}
    sections = []
    for path in sorted(folder.glob("trace*.json")):
        result = read_result(StoredTrace, path, trace.WHAT)
        records = " ".join(Path(record).name for record in result.records)
        if result.reference:
            records += f" against {' '.join(Path(record).name for record in result.reference)}"
        files = [inside(path, "figures[].file", item.file, [".png", ".csv"]) for item in result.figures]
        plates, figures = tuple[Drawn, ...](), tuple[FigureSection, ...]()
        if result.samples_file is None:
            figures = tuple(map(_figure, files, result.figures))
        else:
            file = inside(path, "samples_file", result.samples_file, [".csv"])
            samples = read_samples(file, len(result.records) + len(result.reference))
            plates = tuple(map(draw, trace_plates(result, samples)))
        pictures = tuple(file.name for file in files) if plates else ()
        command = trace_command(result.records, result.reference)
        if result.made is not None:
            command = result.made.command
        elif own.issuperset(result.records):  # a run has them beside its results, and keeps its own page
            command = trace_command([f"DIR/records/{name}" for name in result.records], (), "DIR/again")
        sections.append(TraceSection(path.stem, records, result, plates, figures, pictures, command))
    return tuple(sections)


def _figure(file: Path, item: FigureFile) -> FigureSection:
    """Read an image (PNG), or a CSV whose first column is drawn against the others."""
    if file.suffix.lower() == ".png":
        return FigureSection(item.caption, image_text(file), None)
    return FigureSection(item.caption, None, _columns(file, item.caption))


def _columns(file: Path, caption: str) -> Drawn:
    names = column_names(file)
    if odd := [name for name in names if not name.isprintable()]:
        raise RecordError(f"{file}:1: column {quoted(odd[0])}: expected names that print")
    columns = read_columns(file, names)
    if len(names) < 2 or not columns[names[0]].size:
        raise RecordError(f"{file}: {len(names)} columns: expected a header of two or more, and numbers")
    return draw(columns_plate(np.column_stack([columns[name] for name in names]), names, caption))
