"""The work of the commands as functions of records and rigs.

A record is given as such, as the path of its CSV, or as a DataFrame with its columns; a rig as such, as the path of its
file, or as the name of a preset.

Imports inside a function are needed by it alone, so that ``import notchbend`` is quick and needs no OpenGL.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from fem_models.load import LoadProgram
from fem_models.rig import Rig
from hysteresis import Fit, Record
from hysteresis.arguments import checked
from hysteresis.extras import require_extra
from hysteresis.fitting.settings import DEFAULTS, IdentifySettings
from hysteresis.messages import quoted
from hysteresis.records import record_file
from hysteresis.records.frame import RecordLike, as_record, is_frame
from hysteresis.records.record import RecordError
from studies.engines import ENGINES, EngineName, simulate_wheels
from studies.notebook.given import RigLike, as_any_rig, as_records, as_rig, is_rig_name
from studies.notebook.results import Compensation, StudyResult
from studies.notebook.script import require_guarded_script

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from studies.calibrate import Calibration
    from studies.drawings import DrawingChoice
    from studies.drawings.written import Drawing
    from studies.each.result import EachResult
    from studies.export import Target
    from studies.follow import FollowReport
    from studies.notebook.figures import View
    from studies.results.separation import Separation
    from validation.tracing.outcome import Trace

_FOR_COMPENSATION = IdentifySettings(elements=None)


OF_THE_COMMAND = replace(DEFAULTS, law="auto")
"""Settings that ``notchbend identify`` has by default."""
OF_EACH = replace(DEFAULTS, method="least-squares", forward=True)
"""Settings that ``notchbend identify --each`` has by default."""


@checked
def simulate(rig: RigLike, program: LoadProgram, engine: EngineName | None = None) -> Record:
    """Run a load program on a rig; the same as ``notchbend simulate``.

    Parameters
    ----------
    rig
        A rig, the path of its file, or the name of a preset (``"du2018"``). Its preload is that of the file or the
        preset: ``nb.preset("du2018", preload_N=10.0)`` gives another.
    program
        Drive of the wheel sample by sample, mm of tendon: ``nb.triangle``, ``nb.sine``, or
        ``nb.LoadProgram(drive_mm, time_s)``. Times, s, matter to rigs with creep, drag or other effects of the rate.
        Of a rig in space it moves the first wheel.
    engine
        ``"multibody"`` (Exudyn), ``"chain"`` (the same mechanics, compiled) or ``"analytic"`` (without friction, not
        in space). By default multibody, in space chain.

    Returns
    -------
    Record
        One sample for each of the program: ``drive`` in mm, ``angle_deg`` of the tip, ``notches_deg``, tensions in N.

    Raises
    ------
    ValueError
        An unknown engine.
    SolverError, RigError, MissingError
        A rig that cannot follow the program, or an engine that is not installed.

    Examples
    --------
    >>> record = nb.simulate("du2018", nb.triangle(2.2, cycles=2), engine="chain")
    >>> round(record.loop_width_deg, 1)
    4.4
    """
    if engine is not None and engine not in ENGINES:
        raise ValueError(f"engine = {quoted(engine)}: expected one of {', '.join(ENGINES)}")
    chosen = as_any_rig(rig)
    if chosen.is_planar:
        return ENGINES[engine or "multibody"](chosen, program)
    from fem_models.spatial.drives import first_wheel

    return simulate_wheels(chosen, first_wheel(program, chosen), engine)


@checked
def identify(
    records: RecordLike | Sequence[RecordLike],
    *,
    settings: IdentifySettings = OF_THE_COMMAND,
    use_rig: bool = True,
    progress: bool = False,
) -> Fit:
    """Identify the hysteresis of one record, or of several jointly; the same as ``notchbend identify``.

    The kinematics are the record's own theory, the analytic model of its rig, or a curve that is fitted.

    Parameters
    ----------
    records
        One or several: each a record, the path of its CSV, or a DataFrame.
    settings
        Of the search and of the model; by default folds choose the law, as the command has it.
    use_rig
        False ignores the rig and fits the curve.
    progress
        Whether a terminal shows a progress bar.

    Returns
    -------
    Fit
        Law, parameters with units and 95 % intervals, errors in deg of fitted and of held-out samples.

    Raises
    ------
    RecordError, RigError
        A record without a loop, or a rig that is not possible or cannot follow the drive.

    Examples
    --------
    >>> fit = nb.identify("bench-10N.csv")
    >>> fit.parameters["A"].value, fit.heldout.rmse_deg
    """
    from studies.commands.identification import identify_records

    return identify_records(as_records(records), settings=settings, use_rig=use_rig, progress=progress)


@checked
def identify_each(
    records: Path | str | Sequence[RecordLike],
    *,
    settings: IdentifySettings = OF_EACH,
    use_rig: bool = True,
    workers: int | None = None,
    progress: bool = False,
) -> EachResult:
    """Identify many devices, each by itself; the same as ``notchbend identify --each``.

    Parameters
    ----------
    records
        A folder of records, CSV, or a list: each a record, the path of its CSV, or a DataFrame.
    settings
        Of the search and of the model; by default the Bouc-Wen law by least squares with forward derivatives.
    use_rig
        False ignores the rigs and fits a curve to each record.
    workers
        Processes; by default one a core. The result is the same whatever their number.
    progress
        Whether a terminal shows a progress bar.

    Returns
    -------
    EachResult
        ``to_dataframe()`` has a row for each parameter of each record: value and 95 % interval in its unit, errors in
        deg. A record that cannot be read or fitted is a row, too, with the reason.

    Raises
    ------
    RecordError
        A folder that is none, or has no records.

    Examples
    --------
    >>> found = nb.identify_each("devices")
    >>> found.to_dataframe().query("parameter == 'saturation_deg' and fixed")
    """
    from studies.each.work import EachSettings, fit_each, records_of
    from studies.progress import bar

    if isinstance(records, str | Path):
        given: Sequence[Record | Path] = records_of(Path(records))
    else:
        given = [Path(one) if isinstance(one, str) else one for one in records]
        given = [one if isinstance(one, Path) else as_record(one, f"records[{i}]") for i, one in enumerate(given)]
    with bar(progress) as shown:
        task = shown.add_task("fitting", total=len(given), left=True)
        return fit_each(
            given,
            EachSettings(settings, use_rig=use_rig),
            workers=workers,
            progress=lambda done, total: shown.update(task, completed=done, total=total),
        )


@checked
def trace(
    records: RecordLike | Sequence[RecordLike],
    *,
    reference: RecordLike | Sequence[RecordLike] = (),
    threads: int = 2,
) -> Trace:
    """Trace the residual of records of one rig to the physical effect that the model lacks.

    Parameters
    ----------
    records
        One or several: each a record, the path of its CSV, or a DataFrame.
    reference
        Records of the same rig before a change: then only what changed since is traced.
    threads
        For runs of the records and for derivatives.

    Returns
    -------
    Trace
        The verdict, the effects with their parameters and units, and held-out errors in deg with and without them.

    Raises
    ------
    RecordError, RigError, SolverError
        Records that cannot be used, or a rig that is not possible or cannot follow the drive.

    Examples
    --------
    >>> found = nb.trace(["bench-10N.csv", "bench-20N.csv"])
    >>> found.verdict, found.names
    """
    from validation.tracing import trace_records

    new, old = as_records(records), as_records(reference, "reference")
    if any(one in old for one in new):
        raise RecordError("reference: a record is its own reference: expected different records")
    return trace_records(new, reference=old, threads=threads)


@checked
def follow(
    records: Sequence[RecordLike],
    *,
    at: ArrayLike | None = None,
    axis: str = "record",
    reference_count: int | None = None,
    limits: Mapping[str, float] | None = None,
    trace: bool = True,
) -> FollowReport:
    """Follow one device over days or uses; the same as ``notchbend follow``.

    Parameters
    ----------
    records
        Six or more, the oldest first: each a record, the path of its CSV, or a DataFrame.
    at, axis
        Where they stand, shape (n,), increasing, and what that is: ``"day"``, ``"uses"``. By default their numbers.
    reference_count
        How many of the first are the device as it should be; by default a third.
    limits
        Values of followed numbers, by name; the result estimates when each is passed: ``zero_deg`` in deg, ``lag_s``
        in s, ``tension_N`` in N, ``gain`` and ``width`` over those of the first records.
    trace
        Whether the cause of a change is traced, which takes a minute.

    Returns
    -------
    FollowReport
        ``verdict``, ``changes``, ``cause``, ``limits``, and every number with its intervals and control chart.

    Raises
    ------
    ValueError
        Places of another shape, or that do not increase.
    RecordError
        Records that cannot be compared, or an unknown name of a limit.

    Examples
    --------
    >>> found = nb.follow(sorted(Path("days").glob("*.csv")), limits={"width": 1.5})
    >>> found.verdict, found.cause
    """
    from hysteresis.drift.changes import LEAST_RECORDS
    from studies.follow.result import Axis
    from studies.follow.times import in_order
    from studies.follow.work import FollowSettings, follow_loaded

    if len(given := as_records(records)) < LEAST_RECORDS:
        raise ValueError(f"records: {len(given)}: expected {LEAST_RECORDS} or more")
    places = in_order(len(given))
    if at is not None:
        values = np.asarray(at, dtype=float)
        if values.shape != (len(given),) or not np.isfinite(values).all() or (np.diff(values) <= 0).any():
            raise ValueError(f"at = {quoted(at, 40)}: expected {len(given)} numbers that increase")
        places = Axis(axis, tuple(values.tolist()))
    return follow_loaded(given, places, FollowSettings(reference=reference_count, limits=limits or {}, trace=trace))


@checked
def separate(
    what: RigLike | RecordLike | Sequence[RecordLike],
    *,
    amplitude_mm: float | None = None,
    engine: EngineName = "chain",
    seed: int = 0,
    members: Sequence[RigLike] = (),
) -> Separation:
    """Divide a loop among friction, elasticity of the tendons and material.

    Parameters
    ----------
    what
        A rig (or the path of its file, or the name of a preset), whose loop of ``amplitude_mm`` (2.2 by default) the
        ``engine`` simulates (chain or multibody); or records of a known rig (or the paths of their CSV, or DataFrames),
        which is calibrated on all of them, and whose first record's loop is divided.
    amplitude_mm
        With a rig: amplitude of the drive, mm.
    engine
        With a rig: ``"chain"`` or ``"multibody"``.
    seed
        Of the Bouc-Wen parameters.
    members
        With a rig and the chain: rigs of an ensemble, such as ``nb.ensemble("du2018")``, whose loops give the ranges.

    Returns
    -------
    Separation
        For every part of the loop its energy, mJ a cycle, its width, deg, and its shares.

    Raises
    ------
    ValueError
        A seed below 0.
    RecordError, RigError, SolverError, MissingError
        Records without a known rig or a loop, or with what a rig alone takes (amplitude, engine, members); a rig that
        cannot be divided or cannot follow the drive.

    Examples
    --------
    >>> parts = nb.separate("du2018", amplitude_mm=2.2)
    >>> parts.contributions["friction"].share
    """
    from studies.commands.records import SEPARATION_MM
    from studies.commands.separation import separate_records, separate_rig

    if seed < 0:
        raise ValueError(f"seed = {seed}: expected at least 0")
    if isinstance(what, Rig) or is_rig_name(what):
        size = SEPARATION_MM if amplitude_mm is None else amplitude_mm
        rigs = [as_rig(one, f"members[{i}]") for i, one in enumerate(members)]
        return separate_rig(as_rig(what), size, engine=engine, seed=seed, members=rigs)  # type: ignore[arg-type]
    if amplitude_mm is not None or engine != "chain" or members:
        raise RecordError("amplitude_mm, engine or members: with records: expected a rig, or none of them")
    return separate_records(as_records(what), seed=seed)


@checked
def compensate(
    model: RecordLike | Fit,
    reference_deg: ArrayLike,
    *,
    time_s: ArrayLike | None = None,
    settings: IdentifySettings = _FOR_COMPENSATION,
) -> Compensation:
    """Find the drive that makes the angle follow a reference; the same as ``notchbend compensate``.

    Parameters
    ----------
    model
        A fit, or a record (or the path of its CSV, or a DataFrame), which is identified with a fitted
        curve.
    reference_deg
        Angles to follow, shape (m,), deg.
    time_s
        Their times, s, shape (m,). A fit with a delay needs them: the drive is due that much earlier.
    settings
        For a record.

    Returns
    -------
    Compensation
        ``drive``, shape (m,), in the unit of the record, which ``summary.drive_unit`` names.

    Raises
    ------
    RecordError
        A record without a loop, a reference beyond the range of the model, or times of another shape.

    Examples
    --------
    >>> found = nb.compensate("bench-10N.csv", [0.0, 5.0, 10.0, 5.0])
    >>> found.drive, found.summary.drive_unit
    """
    from studies.commands.compensation import compensated, layer_of

    fit = model if isinstance(model, Fit) else identify(as_record(model, "model"), settings=settings, use_rig=False)
    given = {"reference_deg": reference_deg} if time_s is None else {"reference_deg": reference_deg, "time_s": time_s}
    reference = {name.replace("reference", "angle"): np.asarray(row, dtype=float) for name, row in given.items()}
    for name, row in zip(given, reference.values(), strict=True):
        if row.ndim != 1 or row.shape != reference["angle_deg"].shape or not row.size or not np.isfinite(row).all():
            raise RecordError(f"{name} = {quoted(given[name], 40)}: expected a finite number for each sample")
    return Compensation(*compensated(layer_of(fit), reference, "reference"))


@checked
def study(
    file: Path | str, out: Path | str, *, workers: int | None = None, retry: bool = False, progress: bool = False
) -> StudyResult:
    """Run a parametric study and write its report; the same as ``notchbend study``.

    Where the report cannot be made, a warning says why. Cases run in worker processes, which import the script that
    starts them: in a script, call it below ``if __name__ == "__main__":``, else every worker would run the script
    again. A notebook needs no such line.

    Parameters
    ----------
    file
        A study file, TOML, or the name of a ready study.
    out
        Folder of the results. A study that was stopped or extended runs only the cases that are missing.
    workers
        Number of worker processes; by default one a core.
    retry
        Whether failed cases run again.
    progress
        Whether a terminal shows a progress bar.

    Raises
    ------
    StudyError, RigError, MissingError
        A study that cannot be read or run, or a call in a script outside ``if __name__ == "__main__":``.

    Examples
    --------
    >>> if __name__ == "__main__":
    ...     found = nb.study("preload", "results/preload", workers=2)
    ...     print(found)
    """
    require_extra("study", "studies")
    require_guarded_script()
    from studies.report.page import PAGE, try_report
    from studies.sweep.run import run_study
    from studies.sweep.study_file import read_study

    folder = Path(out)
    summary = run_study(read_study(Path(file)), folder, workers=workers, retry=retry, progress=progress)
    written = try_report(folder)
    if written.page is None:
        warnings.warn(written.line, stacklevel=2)
    return StudyResult(summary, folder, folder / PAGE)


@checked
def export(
    what: RigLike | RecordLike | Fit,
    out: Path | str,
    *,
    to: Target | Drawing = "mujoco",
    amplitude_mm: float = 2.2,
    name: str = "compensator",
    seed: int = 0,
    cutting: DrawingChoice | None = None,
) -> tuple[Path, ...]:
    """Write a rig for another simulator or a workshop, or a fit as a compensator; the same as ``notchbend export``.

    Parameters
    ----------
    what
        For a simulator or a drawing a rig, the path of its file, or the name of a preset; a drawing may be of one in
        space. Else a fit, or a record (path, DataFrame), which is identified with the law that folds choose.
    out
        The model, ``.xml``, with the table of the tension at every guide; the drawing; for a compensator a folder.
    to
        ``"mujoco"``; ``"dxf"``, ``"step"``, ``"stl"``, ``"svg"``, ``"pdf"``; ``"c"``, ``"fmu"``, ``"table"``.
    amplitude_mm
        Of a model for a simulator: largest drive that it is meant for, mm.
    name, seed
        Of a compensator: name of its files and functions; seed of the search and of the references in its test file.
    cutting
        Of a flat pattern, ``"dxf"``: width of the beam, where it points, and the angle of the seam.

    Returns
    -------
    The files: of a model for a simulator the model and the table, ``<stem>-guides.csv``.

    Raises
    ------
    ValueError
        An unknown target, or what it is not of.
    RecordError, RigError, SolverError, MissingError
        What cannot be written, followed or cut so; an extra that is not installed.

    Examples
    --------
    >>> model, guides = nb.export("du2018", "du2018.xml", amplitude_mm=2.2)
    >>> (drawing,) = nb.export("du2018", "du2018.dxf", to="dxf")
    >>> files = nb.export(nb.identify("bench.csv"), "firmware", to="c")
    """
    from studies.export import lacking_compiler, write_compensator, write_model

    _require_target(what, to, cutting)
    if to == "dxf" or to == "step" or to == "stl" or to == "svg" or to == "pdf":
        from studies.drawings import write_drawing

        rig = as_any_rig(cast("RigLike", what), "what")
        return (write_drawing(rig, Path(out), to=to, choice=cutting),)
    if to == "mujoco":
        return write_model(as_rig(cast("RigLike", what), "what"), Path(out), to=to, amplitude_mm=amplitude_mm)
    settings = replace(OF_THE_COMMAND, seed=seed)
    fit = what if isinstance(what, Fit) else identify(as_record(what, "what"), settings=settings, use_rig=False)
    if (words := lacking_compiler(to)) is not None:
        warnings.warn(words, stacklevel=2)
    return write_compensator(fit, Path(out), to=to, name=name, seed=seed)


def _require_target(what: object, to: object, cutting: DrawingChoice | None) -> None:
    """Refuse a target that is none, or that is not of what is given.

    Raises
    ------
    ValueError
        One line with what was expected.
    """
    from studies.drawings import DRAWINGS
    from studies.export import TARGETS

    if not isinstance(to, str) or to not in (*TARGETS, *DRAWINGS):
        raise ValueError(f"to = {quoted(to)}: expected one of {', '.join((*TARGETS, *DRAWINGS))}")
    of_rig = to == "mujoco" or to in DRAWINGS
    if of_rig and isinstance(what, Fit | Record):
        other = ", or another target" if to == "mujoco" else ""
        raise ValueError(f"to = {quoted(to)}: of a {type(what).__name__}: expected a rig{other}")
    if cutting is not None and to not in DRAWINGS:  # of another drawing, its writer says so
        raise ValueError(f"cutting: of a flat pattern: expected with to = 'dxf', not {quoted(to)}")
    if not of_rig and (isinstance(what, Rig) or is_rig_name(what)):
        raise ValueError(f"to = {quoted(to)}: of a rig: expected a fit or a record")


@checked
def calibrate(
    rig: RigLike,
    *,
    amplitude_mm: float,
    noise_deg: float = 0.05,
    error_deg: float | None = None,
    speed_mm_per_s: float = 0.5,
    minutes: float = 5.0,
) -> Calibration:
    """Find the shortest motion that fixes the compensator of a rig; the same as ``notchbend calibrate``.

    Parameters
    ----------
    rig
        A rig, the path of its file, or the name of a preset.
    amplitude_mm
        Drive up to which the compensator will work, mm; limits of strain and tension may lower it.
    noise_deg
        Standard deviation of the sensor of the angle.
    error_deg
        Error of the angle that the noise may cause; by default a fiftieth of the loop's width.
    speed_mm_per_s, minutes
        Of the motion, and how long it may be.

    Returns
    -------
    Calibration
        ``load_program`` is the motion, ``parameters`` the expected precision of the law, ``error_deg`` that of the
        angle.

    Raises
    ------
    RigError, SolverError
        A number out of range, a rig that exceeds the limits at every drive, or a time that is too short.

    Examples
    --------
    >>> motion = nb.calibrate("du2018", amplitude_mm=2.2)
    >>> motion.duration_s, motion.load_program
    """
    from studies.calibrate import Demands, calibration

    demands = Demands(
        amplitude_mm=amplitude_mm,
        error_deg=error_deg,
        noise_deg=noise_deg,
        speed_mm_per_s=speed_mm_per_s,
        minutes=minutes,
    )
    return calibration(as_rig(rig), demands)


@checked
def plot(what: object, *, view: View = "solid", joint_angles_deg: ArrayLike | None = None) -> Figure:
    """Draw a record, a list of records, a rig, or a result.

    Parameters
    ----------
    what
        A record or records (loops), a fit (record, model and residual), a trace (residual before and after), a
        separation (shares), a compensation (drive), a study, a load program, or a rig (in three dimensions). Where a
        loop is thin against its angle, a second chart shows it less its backbone.
    view
        Of a rig: ``"solid"`` draws the bent tube and its tendons, coloured by bending strain; ``"side"`` the straight
        tube with its notches in the bending plane, to scale. A rig in space is drawn straight and bent, side by side,
        whatever the view. Records and rigs may be given by the path of their file, records also as DataFrames, and rigs
        by the name of a preset.
    joint_angles_deg
        Of a rig in three dimensions: shape (joints,), base to tip, such as a sample of ``record.notches_deg``. By
        default all joints bend equally, the tip to 60 deg or to where the notches almost close. In deg.

    Returns
    -------
    Figure
        It shows itself in a notebook; ``savefig`` writes it to a file.

    Raises
    ------
    TypeError
        Something else.
    ValueError
        An unknown view.
    SceneError
        Joint angles that do not fit the rig. Where this machine has no OpenGL, a warning says so, and the side view is
        drawn; with joint angles this is an error.
    MissingError
        A rig in three dimensions without the extra ``view``; ``view="side"`` needs none.

    Examples
    --------
    >>> nb.plot("du2018", view="side").savefig("tube.png")
    """
    from studies.notebook.figures import figure_of

    if is_rig_name(what):
        what = as_any_rig(cast(RigLike, what))
    elif isinstance(what, str | Path) or is_frame(what):
        what = as_record(cast(RecordLike, what))
    elif isinstance(what, list | tuple) and any(isinstance(one, str | Path) or is_frame(one) for one in what):
        what = as_records(what)
    return figure_of(what, view, joint_angles_deg)


@checked
def write_record(record: RecordLike, path: Path | str) -> None:
    """Write a record as CSV, with its sidecar and, if it has one, its theory ``<stem>.kinematics.csv``.

    Parameters
    ----------
    record
        A record, the path of its CSV, or a DataFrame.
    path
        The CSV to write; see :func:`hysteresis.records.record_file.write_record`.

    Raises
    ------
    RecordError
        A record that cannot be read, or a file that cannot be written or is not the sidecar of a record.

    Examples
    --------
    >>> nb.write_record(nb.simulate("du2018", nb.triangle(1.0), engine="chain"), "loop.csv")
    """
    record_file.write_record(as_record(record), path)
