"""What makes the loop, for a rig or for measured records: gathered for ``notchbend separate``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fem_models.load.program import LoadProgram
from fem_models.rig.of_record import rig_of
from fem_models.rig.rig import Rig
from hysteresis import identify
from hysteresis.arrays import Floats
from hysteresis.metrics import dissipated_area, loop_width
from hysteresis.record import Record
from hysteresis.settings import IdentifySettings
from studies.engines import mechanics
from validation.separation import Contributions, calibrate_rig, loop_program, separate
from validation.separation.contributions import PARTS, SETS, Loop, divide, shapley_shares
from validation.separation.rig_calibration import PARAMETERS, RigCalibration, parameters_of, with_parameters

MEASURES = {"width_deg": "width_share", "area": "area_share", "dissipated_mJ": "share"}
"""What is divided, and the name of its shares: ``share`` is that of the energy, which every loop has."""
CLOSES_PERCENT, RIGID_PERCENT = 1.0, 0.1
_STEP = 1e-3  # of a constant's natural size

SEEN_WITH_ROPES = {
    "all": SETS[-1],
    "friction": frozenset({"friction", "tendon_elasticity"}),
    "tendon_elasticity": frozenset({"tendon_elasticity"}),
    "material": frozenset({"material", "tendon_elasticity"}),
}
"""Loops that Bouc-Wen parameters are given for: each source on the rig's own ropes, which let it be seen."""


def separate_rig(rig: Rig, amplitude_mm: float, *, engine: str = "chain", seed: int = 0) -> dict[str, Any]:
    """Divide the loop of a rig: the contents of separate.json. A rig of one tendon goes from 0 to the amplitude.

    Raises
    ------
    RigError, SolverError, MissingError
        A rig that cannot be divided or cannot follow.
    """
    program = loop_program(0.0 if rig.tendon_b is None else -amplitude_mm, amplitude_mm)
    found = separate(rig, program, mechanics(engine))
    return _result(rig, program, found, engine, seed)


def separate_records(records: Sequence[Record], *, seed: int = 0) -> dict[str, Any]:
    """Divide the loop of the first record, by its rig calibrated on all of them; with 95 % intervals.

    Raises
    ------
    RecordError, RigError, SolverError
        A record without a known rig, or without a loop; a rig that cannot be divided or cannot follow.
    """
    for record in records:
        rig_of(record)
    calibrated = calibrate_rig(records)
    drive = records[0].drive
    program = loop_program(min(0.0, float(drive.min())), float(drive.max()))
    found = separate(calibrated.rig, program)
    result = _result(calibrated.rig, program, found, "chain", seed)
    for measure, half in _half_intervals(calibrated, program, found).items():
        for part in PARTS:
            value = result["contributions"][part][measure]
            limits = (
                None if value is None or not math.isfinite(half[part]) else [value - half[part], value + half[part]]
            )
            result["contributions"][part].setdefault("intervals", {})[measure] = limits
    result["calibration"] = _calibration(calibrated)
    result["measured"] = _measured(records[0])
    result["warnings"] += [f"not separated by these records: {words}" for words in calibrated.inseparable]
    return result


def _result(rig: Rig, program: LoadProgram, found: Contributions, engine: str, seed: int) -> dict[str, Any]:
    whole = found.whole
    return {
        "schema": 1,
        "rig": rig.to_dict(),
        "engine": engine,
        "drive_mm": [float(program.drive_mm.min()), float(program.drive_mm.max())],
        "total": {"width_deg": whole.width_deg, "area": whole.area, "dissipated_mJ": whole.dissipated_mJ},
        "contributions": _rows(found),
        "shapley": {share: shapley_shares(found, measure) for measure, share in MEASURES.items()},
        "energy": {
            "wheel_work_mJ": whole.dissipated_mJ,
            "friction_loss_mJ": whole.friction_mJ,
            "material_loss_mJ": whole.material_mJ,
            "closure_percent": found.closure_percent,
        },
        "rigid_rope_residual_percent": found.residual_percent,
        "combinations": [{"on": sorted(on), **_loop(loop)} for on, loop in found.loops.items()],
        "bouc_wen": {name: _law(found, on, seed) for name, on in SEEN_WITH_ROPES.items()},
        "calibration": None,
        "measured": None,
        "warnings": _warnings(found),
    }


def _rows(found: Contributions) -> dict[str, dict[str, Any]]:
    """Give C of the contract for each part, with the shares of width and area beside that of the energy."""
    rows: dict[str, dict[str, Any]] = {part: {} for part in PARTS}
    for measure, name in MEASURES.items():
        parts, shares = divide(found.values(measure)), found.shares(measure)
        for part in PARTS:
            rows[part] |= {measure: parts[part], name: None if shares is None else shares[part]}
    return rows


def _loop(loop: Loop) -> dict[str, float]:
    names = ("width_deg", "area", "dissipated_mJ", "friction_mJ", "material_mJ")
    return {name: getattr(loop, name) for name in names}


def _law(found: Contributions, on: frozenset[str], seed: int) -> dict[str, Any] | None:
    """Bouc-Wen parameters of a combination's loop, f fitted to it; None where there is no loop."""
    loop = found.loops[on]
    if loop.is_lossless or loop.is_flat:
        return None
    fit = identify(loop.record, settings=IdentifySettings(seed=seed))
    laws = {name: parameter.to_dict() for name, parameter in fit.parameters.items()}
    return {"parameters": laws, "saturation_deg": fit.saturation_deg.to_dict(), "heldout": fit.heldout.to_dict()}


def _warnings(found: Contributions) -> list[str]:
    words = []
    if found.whole.is_lossless:
        words.append("no loop: the rig dissipates nothing, so there is nothing to share")
    elif found.whole.is_flat:
        words.append("no loop of the angle: shares are those of the energy")
    if abs(found.closure_percent) > CLOSES_PERCENT:
        words.append(f"energy: parts miss the losses by {found.closure_percent:+.2f} %: expected at most 1 %")
    residual = found.residual_percent
    if residual is not None and residual > RIGID_PERCENT:
        words.append(
            f"{residual:.2g} % of the width is left with ropes that do not stretch: joints bend unevenly, "
            "such a rope goes slack at this preload, or the rig's own ropes are nearly as stiff"
        )
    return words


def _half_intervals(
    calibrated: RigCalibration, program: LoadProgram, found: Contributions
) -> dict[str, dict[str, float]]:
    """Half widths of the intervals of all measures and shares: the covariance carried on by finite differences."""
    names = [name for pair in MEASURES.items() for name in pair]

    def table(rows: Mapping[str, Mapping[str, Any]]) -> Floats:
        return np.array([[math.nan if (v := rows[p][n]) is None else v for p in PARTS] for n in names])

    here = np.array(list(parameters_of(calibrated.rig).values()))
    at, gradient = table(_rows(found)), []
    for i, constant in enumerate(PARAMETERS.values()):
        step = _STEP * constant.scale * (1 if here[i] + constant.scale < constant.high else -1)
        moved = with_parameters(calibrated.rig, here + step * np.eye(here.size)[i])
        gradient.append((table(_rows(separate(moved, program))) - at) / step)
    half = calibrated.quantile * np.sqrt(np.einsum("inp,ij,jnp->np", gradient, calibrated.covariance, gradient))
    return {name: dict(zip(PARTS, row, strict=True)) for name, row in zip(names, half.tolist(), strict=True)}


def _calibration(found: RigCalibration) -> dict[str, Any]:
    return {
        "constants": {name: c.to_dict() for name, c in found.parameters.items()},
        "rmse_deg": found.rmse_deg,
        "condition": found.condition,
        "correlations": found.correlations,
        "not_separated": list(found.inseparable),
        "next_experiments": [e.to_dict() for e in found.experiments],
    }


def _measured(record: Record) -> dict[str, float] | None:
    """Width and area of the record's own loop, beside those of the calibrated rig."""
    try:
        width = loop_width(record.drive, record.angle_deg, record.cycle).max_deg
        return {"width_deg": width, "area": dissipated_area(record.drive, record.angle_deg, record.cycle)}
    except ValueError:  # loops of decaying amplitude do not close
        return None


def summary(result: Mapping[str, Any]) -> list[str]:
    """Say in lines, for a terminal, what stands beside the table of parts."""
    total, energy = result["total"], result["energy"]
    lines = [
        f"whole: {total['width_deg']:.4g} deg wide, {total['area']:.4g} deg mm, "
        f"{total['dissipated_mJ']:.4g} mJ a cycle",
        f"book-keeping: wheel {energy['wheel_work_mJ']:.4g} mJ = friction {energy['friction_loss_mJ']:.4g} "
        f"+ material {energy['material_loss_mJ']:.4g} mJ, to {energy['closure_percent']:+.2g} %",
    ]
    if result["calibration"] is not None:
        found = result["calibration"]
        lines.append(f"calibrated rig: {found['rmse_deg']:.3g} deg rmse, condition {found['condition']:.3g}")
        for name, c in found["constants"].items():
            lines.append(f"  {name} {c['value']:.4g} ({c['low']:.4g} to {c['high']:.4g}) {c['unit']}")
        for e in found["next_experiments"][:2]:
            lines.append(
                f"next: {e['what']} ({e['preload_N']:.3g} N, {e['amplitude_mm']:.3g} mm): gains {e['gain']:.2f}, "
                f"{e['constant']} {e['narrower']:.2g} times narrower"
            )
    return [*lines, *(f"warning: {words}" for words in result["warnings"])]
