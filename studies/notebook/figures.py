"""Figures of records, rigs and results for a notebook, from the charts of the report."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from textwrap import shorten
from typing import Literal, get_args

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from fem_models.view import SceneError
from hysteresis import Fit, Record
from hysteresis.arrays import Floats
from hysteresis.messages import quoted
from hysteresis.records.backbone import backbone_of, is_thin
from studies.notebook.results import Compensation, StudyResult
from studies.notebook.solid import NotebookFigure, shown_angles_deg, solid_figure, wrist_figure
from studies.report.charts import TONES, Chart, Line
from studies.report.plots import ANGLE, LESS, Series, fit_plate, parts_plate
from studies.report.still import STYLE, draw_chart, has_legend_above
from studies.results.separation import Separation
from validation.tracing.outcome import Trace

View = Literal["solid", "side"]
_WIDTH_IN, _HEIGHT_IN = 4.7, 3.2  # of one chart
_TITLE = 62  # characters that fit above one chart


def figure_of(what: object, view: View = "solid", joint_angles_deg: ArrayLike | None = None) -> Figure:
    """Draw a record, records, a rig, a load program or a result; see :func:`studies.notebook.calls.plot`.

    Raises
    ------
    TypeError
        Something else.
    ValueError
        An unknown view.
    SceneError
        Joint angles that do not fit the rig.
    """
    if not isinstance(view, str) or view not in get_args(View):
        raise ValueError(f"view = {quoted(view)}: expected one of {', '.join(get_args(View))}")
    match what:
        case Rig() if not what.is_planar:
            return wrist_figure(what, joint_angles_deg)
        case Rig() if view == "solid":
            return _solid_view(what, joint_angles_deg)
        case Rig():
            return _side_view(what)
        case Record():
            return _drawn(_loops([what]))
        case [Record(), *_]:
            return _drawn(_loops([_record(one) for one in what]))
        case Fit():
            return _drawn([chart for i in range(len(what.observed)) for chart in _fit(what, i)])
        case Trace():
            return _drawn(_residuals(what))
        case Separation():
            plate = parts_plate(what)
            if plate is None:
                raise TypeError("separation without a loop: expected one with shares")
            return _drawn(list(plate.charts))
        case Compensation():
            return _drawn(_compensation(what))
        case LoadProgram():
            return _drawn([_program(what)])
        case StudyResult():
            return _drawn(_study(what))
    expected = "a record, records, a rig, a load program, or a result of identify, trace, separate, compensate or study"
    raise TypeError(f"what = {quoted(what, 40)}: expected {expected}")


def _record(what: object) -> Record:
    if not isinstance(what, Record):
        raise TypeError(f"{type(what).__name__} beside records: expected records only")
    return what


def _drawn(charts: Sequence[Chart]) -> Figure:
    """Draw charts side by side, at most three in a row."""
    columns = min(len(charts), 2 if len(charts) in (2, 4) else 3)
    rows = -(-len(charts) // columns)
    with matplotlib.rc_context(STYLE):
        figure = NotebookFigure(figsize=(_WIDTH_IN * columns, _HEIGHT_IN * rows), layout="constrained")
        places = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, chart in zip(places, charts, strict=False):
            draw_chart(figure, axes, chart)
            title = shorten(chart.title, _TITLE, placeholder=" ...")
            axes.set_title(title, loc="left", fontsize=9.5, pad=20 if has_legend_above(chart) else None)
        for axes in places[len(charts) :]:
            axes.set_visible(False)
    return figure


def _loops(records: Sequence[Record]) -> list[Chart]:
    """Chart the angle of records over the drive, and less the backbone where a loop is a thin line."""
    units = list(dict.fromkeys(record.drive_unit for record in records))
    if len(units) > 1:
        raise TypeError(f"records with drives in {' and '.join(units)}: expected one unit")
    names = [record.title or f"record {i + 1}" for i, record in enumerate(records)]
    tones = [TONES[i % len(TONES)] for i in range(len(records))]
    lines = tuple(
        Line(record.drive, record.angle_deg, name, tone)
        for record, name, tone in zip(records, names, tones, strict=True)
    )
    title = names[0] if len(records) == 1 else "Loops"
    drive = f"{'force' if units == ['N'] else 'drive'}, {units[0]}"
    charts = [Chart(title, drive, ANGLE, lines, title)]
    backbones = [backbone_of(record) for record in records]
    if any(b is not None and is_thin(record, b) for record, b in zip(records, backbones, strict=True)):
        opened = tuple(
            Line(record.drive, record.angle_deg - b, name, tone)
            for record, b, name, tone in zip(records, backbones, names, tones, strict=True)
            if b is not None
        )
        charts.append(Chart("Less the backbone", drive, LESS, opened, f"{title}, less the backbone"))
    return charts


def _fit(fit: Fit, i: int) -> tuple[Chart, ...]:
    """Chart measured and predicted loop of a record, both less the backbone where it is thin, and the residual."""
    record = fit.observed[i]
    base, predicted = fit.plain(record.drive, i), fit.predict(record.drive, record.time_s, i)
    series = Series(record.drive, record.angle_deg, base, predicted, fit.heldout_masks[i])
    first, *_, last = fit_plate(series, fit.drive_unit, fit.records[i]).charts
    if not is_thin(record, base):
        return first, last
    lines = (
        Line(record.drive, record.angle_deg - base, "record", "grey", "points"),
        Line(record.drive, predicted - base, "f + Bouc-Wen", "blue"),
    )
    opened = Chart("Less f alone", first.x_label, LESS, lines, f"{fit.records[i]}: record and fit less f alone")
    of_layer = tuple(mark for mark in last.marks if isinstance(mark, Line) and mark.name != "f alone")
    return first, opened, replace(last, marks=of_layer)


def _residuals(trace: Trace) -> list[Chart]:
    """Chart the residual of each record before and after, with twice the noise floor."""
    drive = f"drive, {trace.records[0].drive_unit}"
    inputs = trace.baseline.model.problem.inputs
    names = " + ".join(trace.augmented.names)
    charts = []
    for i, (record, used) in enumerate(zip(trace.records, inputs, strict=True)):
        lines = [Line(used.drive, trace.baseline.residuals[i], "baseline", "orange", "points")]
        if trace.augmented is not trace.baseline:
            lines.append(Line(used.drive, trace.augmented.residuals[i], f"with {names}", "blue", "points"))
        ends = np.array([used.drive.min(), used.drive.max()])
        noise: Floats = np.full(2, 2 * trace.floor.deg)
        lines += [Line(ends, noise, "2 x noise floor", "grey", "dot"), Line(ends, -noise, "_", "grey", "dot")]
        title = record.title or f"record {i + 1}"
        charts.append(Chart(f"Residual: {title}", drive, "residual, deg", tuple(lines), title))
    return charts


def _compensation(found: Compensation) -> list[Chart]:
    angle = found.columns["angle_deg"]
    time = found.columns.get("time_s")
    along, label = _along(time, angle.size), "sample" if time is None else "time, s"
    unit = found.summary.drive_unit
    return [
        Chart("Reference", label, ANGLE, (Line(along, angle, "reference", "grey"),), "reference"),
        Chart("Drive", label, f"drive, {unit}", (Line(along, found.drive, "with compensation"),), "drive"),
    ]


def _program(program: LoadProgram) -> Chart:
    line = Line(_along(program.time_s, program.drive_mm.size), program.drive_mm, "drive")
    label = "sample" if program.time_s is None else "time, s"
    return Chart("Load program", label, "drive, mm", (line,), "load program")


def _along(time_s: Floats | None, samples: int) -> Floats:
    """Horizontal axis of a series: its times, else the numbers of its samples."""
    return np.arange(samples, dtype=float) if time_s is None else time_s


def _study(result: StudyResult) -> list[Chart]:
    from studies.report.study import read_study  # xarray takes a second

    section = read_study(result.folder)
    plates = section.plates if section else ()
    charts = [
        replace(chart, title=f"{chart.title}: {plate.heading}") if plate.heading else chart
        for plate in plates
        for chart in plate.charts
    ]
    if not charts:
        raise TypeError(f"study {result.folder}: no case has a result: expected one to draw")
    return charts


def _solid_view(rig: Rig, joint_angles_deg: ArrayLike | None) -> Figure:
    """Draw the bent manipulator; from the side where no angles are asked for and this machine has no OpenGL."""
    if joint_angles_deg is not None:
        return solid_figure(rig, joint_angles_deg)
    try:
        return solid_figure(rig, shown_angles_deg(rig))
    except SceneError as error:
        warnings.warn(f"side view in place of three dimensions: {error}", stacklevel=4)
        return _side_view(rig)


def _side_view(rig: Rig) -> Figure:
    """Draw the straight manipulator in the bending plane: tube and notches, or measured joints, and the tendons."""
    ends: Floats = np.array([0.0, rig.length_mm])
    match rig.joint:
        case NotchedTube() as joint:
            outline = _outline(joint)
            lines = [Line(*outline, "tube and notches", "grey")]
        case MeasuredJoint():
            at: Floats = rig.pitch_mm * np.linspace(0.5, rig.joints - 0.5, rig.joints)
            lines = [Line(ends, 0 * ends, "axis", "grey"), Line(at, 0 * at, "joints", "grey", "points")]
    for tendon, side, tone in zip(rig.tendons, (1.0, -1.0), (TONES[0], TONES[1]), strict=False):
        name = "tendon a" if side > 0 else "tendon b"
        lines.append(Line(ends, np.full(2, side * tendon.moment_arm_mm), name, tone, "dash"))
    chart = Chart(repr(rig), "along the tube, mm", "across, mm", tuple(lines), "side view")
    figure = _drawn([chart])
    figure.set_size_inches(2 * _WIDTH_IN, _HEIGHT_IN)
    (axes,) = figure.axes
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(lines), fontsize=7.5)  # not on the notches
    return figure


def _outline(joint: NotchedTube) -> tuple[Floats, Floats]:
    """Outline of a notched tube in the bending plane, one closed polygon: x along the tube, y across, mm."""
    radius, places, edges, heights = 0.5 * joint.tube.outer_diameter_mm, joint.places(), list[Floats](), list[float]()
    for number, middle in enumerate(places.middles):
        notch = joint.notch.at(number)
        half, bottom = 0.5 * notch.width_mm, radius - notch.depth_mm
        root = half if notch.root_width_mm is None else 0.5 * notch.root_width_mm
        edges.append(middle + np.array([-half, -root, root, half]))
        heights += [radius, bottom, bottom, radius]
    x, upper = np.concatenate([[0.0], *edges, [places.centres[-1]]]), np.array([radius, *heights, radius])
    cut_twice = joint.notch.shape in ("v_pair", "rectangular_pair")
    lower = -upper if cut_twice else np.full(x.size, -radius)
    return np.concatenate([x, x[::-1], x[:1]]), np.concatenate([upper, lower[::-1], upper[:1]])
