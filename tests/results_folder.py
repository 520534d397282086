"""A folder of results for the tests of the report: small, made in seconds, with everything a page can show."""

import json
from pathlib import Path

import numpy as np
import xarray as xr

from fem_models.analytic.kinematics import simulate_analytic
from fem_models.chain.solve import solve_chain
from fem_models.load.program import triangle
from fem_models.rig.presets import PRESETS, preset
from fem_models.view.manipulator import SceneError, render
from hysteresis.record_file import write_record
from studies.commands.separation import separate_rig
from studies.report.tube import write_tube
from studies.results import checksums, loop_summary, write_json

ERRORS = {"rmse_deg": 0.3, "max_abs_deg": 0.9, "max_rel_percent": 1.0, "normalised": 0.01}


def write_run(folder: Path) -> None:
    """What `notchbend run` leaves, by the chain in place of the multibody model, the fit made up."""
    loops, checks = [], []
    for preload in (10.0, 20.0):
        rig, name = preset("du2018", preload_N=preload), f"du2018-{preload:g}N"
        solution = solve_chain(rig, triangle(2.2, cycles=2))
        write_record(solution.record, folder / "records" / f"{name}.csv")
        write_record(simulate_analytic(rig, triangle(2.2)), folder / "records" / f"{name}-analytic.csv")
        limit = {"name": "fatigue", "kind": "alternating", "limit_percent": 0.4, "largest_percent": 1.9}
        energy = {f"{part}_mJ": 1.0 for part in ("wheel_work", "friction_loss", "material_loss", "viscous_loss")}
        loops.append(
            {"record": name, "theory": f"{name}-analytic", **loop_summary(solution.record), **energy}
            | {"energy_gap_percent": 0.07, "peak_strain_percent": 2.0}
            | {"strain_limits": [limit | {"passed_at_mm": 0.9, "joint": 1, "source": "a <source> & more"}]}
        )
        keys = "bending_stiffness_Nmm_per_rad element_error_percent full_scale_analytic_deg tip_pose_max_mm "
        keys += "full_scale_frictionless_deg frictionless_max_deg frictionless_tension_max_N full_scale_deg "
        keys += "chain_max_deg friction_shift_rmse_deg"
        checks.append({"rig": "du2018", "preload_N": preload, "amplitude_mm": 2.2} | dict.fromkeys(keys.split(), 0.001))
    record = solution.record
    _write_fit(folder, record)
    write_json(folder / "separate-du2018-20N.json", separate_rig(rig, 2.2))
    joints = record.notches_deg[int(np.argmax(record.angle_deg))]
    write_tube(rig, joints, folder / "tube.json")
    picture = {"tube": "tube.json", "caption": "du2018 at 2.2 mm"}
    try:
        render(rig, joints, folder / "tube.png", window=(700, 450))
        picture["file"] = "tube.png"
    except SceneError as error:
        picture["missing"] = str(error)
    sources = PRESETS["du2018"].sources
    run = {
        "schema": 1,
        "seed": 0,
        "versions": {"notchbend": "0.1.0"},
        "rig": [{"name": n, "value": 1.0, "source": s.kind, "note": s.note} for n, s in sources.items()],
        "peak_strain_percent": 2.0,
        "loops": loops,
        "crosscheck": checks,
        "fits": [{"name": "du2018-20N", "record": "du2018-20N", "title": record.title}],
        "separations": [{"file": "separate-du2018-20N.json", "label": "du2018, 20 N", "command": "notchbend separate"}],
        "picture": picture,
    }
    names = [loop[key] for loop in loops for key in ("record", "theory")]
    write_json(folder / "run.json", run | {"sha256": checksums(folder, names)})


def _write_fit(folder: Path, record) -> None:
    parameter = {"value": 1.0, "low": 0.9, "high": None, "unit": "deg"}
    fit = {
        "kinematics": "analytic",
        "parameters": {"A": parameter},
        "baseline": {"heldout": ERRORS},
        "heldout": ERRORS | {"rmse_deg": 0.1},
        "heldout_by": "the last cycle",
        "noise_floor_deg": 0.05,
        "warnings": ["a <warning>"],
    }
    write_json(folder / "identify-du2018-20N.json", fit)
    rows = zip(record.drive, record.angle_deg, record.angle_deg - 1, record.angle_deg - 0.1, strict=True)
    lines = ["drive,angle_deg,f_alone_deg,predicted_deg,heldout", *(",".join(map(str, [*row, 1])) for row in rows)]
    (folder / "identify-du2018-20N.csv").write_text("\n".join(lines) + "\n")


def write_trace(folder: Path) -> None:
    """What `notchbend trace` leaves, with a figure beside it."""
    parameter = {"value": 0.1, "low": 0.08, "high": 0.12, "unit": "mm"}
    effect = {"name": "backlash", "parameters": {"width_mm": parameter}, "confusable_with": ["tendon_slack"]}
    before, after = ({"train": e, "heldout": e} for e in (ERRORS, ERRORS | {"rmse_deg": 0.06}))
    result = {
        "schema": 1,
        "records": ["bench.csv"],
        "noise_floor_deg": 0.05,
        "before": before,
        "after": after,
        "verdict": "effect",
        "effects": [effect | {"delta_bic": 512.0, "heldout_rmse_deg": 0.06}],
        "multibody": None,
        "candidates": [{"name": "backlash", "heldout_rmse_deg": 0.06, "delta_bic": 512.0}],
        "next_experiment": "a second preload",
        "figures": [{"file": "trace-residual.csv", "caption": "Residual over the drive"}],
    }
    (folder / "trace-residual.csv").write_text("drive_mm,before_deg,after_deg\n-1,0.3,0.05\n0,0.1,0.02\n1,0.2,0.01\n")
    (folder / "trace.json").write_text(json.dumps(result))


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
    write_json(
        folder / "study.json", {"schema": 1, "inputs_sha256": {"mine.toml": "0" * 64}, "versions": {"numpy": "2"}}
    )
    index = {"value": 0.5, "low": 0.4, "high": 0.6}
    rows = {name: {"first": index, "total": index} for name in dims}
    write_json(
        folder / "sensitivity.json", {"confidence": 0.95, "quantities": {"full_scale_angle_deg": {"indices": rows}}}
    )
    front = [
        {"preload_N": 5.0 + i, "full_scale_angle_deg": 40.0 + i, "peak_strain_percent": 1 + i**2} for i in range(9)
    ]
    goals = {"full_scale_angle_deg": {"goal": "max"}, "peak_strain_percent": {"goal": "min"}}
    pareto = {"objectives": goals, "variables": {"preload_N": [5, 40]}, "designs_tried": 90, "front": front}
    write_json(folder / "pareto.json", pareto)
