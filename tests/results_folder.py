"""A folder of results for the tests of the report: small, made in seconds, with everything a page can show."""

import shutil
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from how_made import MADE
from once import made_once

from fem_models.analytic import simulate_analytic
from fem_models.chain.solve import solve_chain
from fem_models.load import triangle
from fem_models.rig import preset
from fem_models.rig.presets import PRESETS
from fem_models.view import SceneError, render
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.metrics import Errors
from hysteresis.records.record_file import write_record
from studies.commands.separation import separate_rig
from studies.report.study import StudyFacts
from studies.report.tube import write_tube
from studies.results import write_result
from studies.results.fit import Baseline, StoredFit
from studies.results.run import (
    CrossCheckRow,
    FitEntry,
    Picture,
    RigNumber,
    RunLoop,
    RunSummary,
    SeparationEntry,
    StrainLimit,
    checksums,
    loop_summary,
)
from studies.results.study import (
    AxisIndices,
    Index,
    Objective,
    ParetoFront,
    QuantityIndices,
    Sensitivities,
)
from studies.results.trace import FigureFile, FoldErrors, NamedEffect, StoredTrace, TriedModel

ERRORS = Errors(rmse_deg=0.3, max_abs_deg=0.9, max_rel_percent=1.0, normalised=0.01)


def copy_results(factory: pytest.TempPathFactory, folder: Path) -> dict[str, Path]:
    """Fill a folder with those of a run, a trace and a study, by name; each was made once for all tests."""
    made = made_once(factory, "results-of-commands", _write_results)
    return {name: Path(shutil.copytree(made / name, folder / name)) for name in ("run", "trace", "study")}


def _write_results(folder: Path) -> None:
    for name, write in (("run", write_run), ("trace", write_trace), ("study", write_study)):
        (folder / name).mkdir(parents=True)
        write(folder / name)


def write_run(folder: Path) -> None:
    """What `notchbend run` leaves, by the chain in place of the multibody model, the fit made up."""
    loops, checks = [], []
    for preload in (10.0, 20.0):
        rig, name = preset("du2018", preload_N=preload), f"du2018-{preload:g}N"
        solution = solve_chain(rig, triangle(2.2, cycles=2))
        write_record(solution.record, folder / "records" / f"{name}.csv")
        write_record(simulate_analytic(rig, triangle(2.2)), folder / "records" / f"{name}-analytic.csv")
        limit = StrainLimit("fatigue", "alternating", 0.4, 1.9, 0.9, 1, "a <source> & more")
        energy = {f"{part}_mJ": 1.0 for part in ("wheel_work", "friction_loss", "material_loss", "viscous_loss")}
        energy |= {"energy_gap_percent": 0.07, "peak_strain_percent": 2.0}
        measured = vars(loop_summary(solution.record))
        theory = {"record": name, "theory": f"{name}-analytic", "preload_N": preload}
        loops.append(RunLoop(**theory, **measured, **energy, strain_limits=(limit,)))
        numbers = {field.name: 0.001 for field in fields(CrossCheckRow)}
        checks.append(CrossCheckRow(**numbers | {"rig": "du2018", "preload_N": preload, "amplitude_mm": 2.2}))
    record = solution.record
    _write_fit(folder, record)
    write_result(folder / "separate-du2018-20N.json", separate_rig(rig, 2.2))
    joints = record.notches_deg[int(np.argmax(record.angle_deg))]
    write_tube(rig, joints, folder / "tube.json")
    picture = Picture(tube="tube.json", caption="du2018 at 2.2 mm")
    try:
        render(rig, joints, folder / "tube.png", window=(700, 450))
        picture = replace(picture, file="tube.png")
    except SceneError as error:
        picture = replace(picture, missing=str(error))
    run = RunSummary(
        seed=0,
        versions={"notchbend": "0.1.0"},
        rig=tuple(RigNumber(n, 1.0, s.kind, s.note) for n, s in PRESETS["du2018"].sources.items()),
        peak_strain_percent=2.0,
        loops=tuple(loops),
        crosscheck=tuple(checks),
        fits=(FitEntry("du2018-20N", "du2018-20N", record.title),),
        separations=(SeparationEntry("separate-du2018-20N.json", "du2018, 20 N", "notchbend separate"),),
        picture=picture,
        sha256=checksums(folder, [name for loop in loops for name in (loop.record, loop.theory)]),
    )
    write_result(folder / "run.json", run)


def _write_fit(folder: Path, record) -> None:
    fit = StoredFit(
        kinematics="analytic",
        parameters={"A": Parameter(1.0, 0.9, None, "deg")},
        heldout=replace(ERRORS, rmse_deg=0.1),
        warnings=("a <warning>",),
        baseline=Baseline(ERRORS),
        heldout_by="the last cycle",
        noise_floor_deg=0.05,
    )
    write_result(folder / "identify-du2018-20N.json", fit)
    rows = zip(record.drive, record.angle_deg, record.angle_deg - 1, record.angle_deg - 0.1, strict=True)
    lines = ["drive,angle_deg,f_alone_deg,predicted_deg,heldout", *(",".join(map(str, [*row, 1])) for row in rows)]
    (folder / "identify-du2018-20N.csv").write_text("\n".join(lines) + "\n")


def write_trace(folder: Path) -> None:
    """What `notchbend trace` leaves, with a figure beside it."""
    after = replace(ERRORS, rmse_deg=0.06)
    trace = StoredTrace(
        verdict="effect",
        records=("bench.csv",),
        noise_floor_deg=0.05,
        before=FoldErrors(ERRORS, ERRORS),
        after=FoldErrors(after, after),
        effects=(NamedEffect("backlash", {"width_mm": Parameter(0.1, 0.08, 0.12, "mm")}, ("tendon_slack",)),),
        candidates=(TriedModel("backlash", 0.06, 512.0),),
        next_experiment="a second preload",
        figures=(FigureFile("trace-residual.csv", "Residual over the drive"),),
        made=MADE,
    )
    (folder / "trace-residual.csv").write_text("drive_mm,before_deg,after_deg\n-1,0.3,0.05\n0,0.1,0.02\n1,0.2,0.01\n")
    write_result(folder / "trace.json", trace)


def write_study(folder: Path) -> None:
    """What `notchbend study` leaves: a grid of preload and depth with one failed case, sensitivities, a front."""
    preload, depth = np.linspace(5, 40, 6), np.linspace(2.7, 2.9, 4)
    angle = 40 + preload[:, None] / 10 + 8 * depth
    angle[0, 0] = np.nan
    dims = ("preload_N", "notch.depth_mm")
    status = np.full(angle.shape, "ok", dtype=object)
    message = np.full(angle.shape, "", dtype=object)
    status[0, 0], message[0, 0] = "failed", "no equilibrium <here>"
    quantity = {"units": "deg", "long_name": "largest bending angle"}
    data = xr.Dataset(
        {
            "full_scale_angle_deg": (dims, angle, quantity),
            "peak_strain_percent": (dims, angle / 20, {"units": "%", "long_name": "peak strain"}),
            "status": (dims, status.astype(np.dtypes.StringDType())),
            "message": (dims, message.astype(np.dtypes.StringDType())),
        },
        {"preload_N": preload, "notch.depth_mm": depth},
        {"title": "Preload and depth", "engine": "chain"},
    )
    data.to_zarr(folder / "study.zarr", mode="w", zarr_format=3, consolidated=False)
    write_result(folder / "study.json", StudyFacts({"numpy": "2"}, {"mine.toml": "0" * 64}))
    index = Index(0.5, 0.4, 0.6)
    rows = dict.fromkeys(dims, AxisIndices(index, index))
    sensitivities = Sensitivities(
        engine="chain",
        count=8,
        cases=32,
        seed=0,
        confidence=0.95,
        resamples=200,
        ranges={"preload_N": (5, 40), "notch.depth_mm": (2.7, 2.9)},
        quantities={"full_scale_angle_deg": QuantityIndices("deg", rows, 8, 1.0)},
        without_indices=(),
        computed=32,
        from_store=0,
    )
    write_result(folder / "sensitivity.json", sensitivities)
    write_result(folder / "pareto.json", _front())


def _front() -> ParetoFront:
    return ParetoFront(
        engine="chain",
        objectives={"full_scale_angle_deg": Objective("max", "deg"), "peak_strain_percent": Objective("min", "%")},
        limits={},
        variables={"preload_N": (5, 40)},
        fixed={},
        population=9,
        generations=10,
        seed=0,
        designs_tried=90,
        designs_feasible=90,
        front=tuple(
            {"preload_N": 5.0 + i, "full_scale_angle_deg": 40.0 + i, "peak_strain_percent": 1 + i**2} for i in range(9)
        ),
    )
