"""A trace of a wrist whose sidecar says how its notches differ."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import notchbend as nb
from fem_models.chain.solve import solve_chain_by_force
from fem_models.rig import preset
from fem_models.rig.rig import notched_tube, with_notch
from hysteresis.records.record import Record
from hysteresis.records.record_file import write_record
from validation.tracing import trace_records
from validation.tracing.effect import catalogue
from validation.tracing.result import trace_report

DEPTHS = (1.36, 1.39, 1.42, 1.45)


@pytest.mark.slow
def test_the_plateau_of_a_tip_first_wrist_is_found(tmp_path: Path):
    """Simulated with its plateau, traced from geometry alone: the elastic baseline lacks it."""
    wrist = preset("notched-wrist-90")
    wrist = with_notch(wrist, replace(notched_tube(wrist).notch, count=4, depth_mm=DEPTHS))
    up = np.linspace(0.0, 0.8, 25)
    force = np.concatenate([up, up[-2::-1], up[1:], up[-2::-1]])
    pulled, noise = solve_chain_by_force(wrist, force).record, np.random.default_rng(1)
    assert pulled.notches_deg is not None
    record = Record(
        drive=force,
        drive_unit="N",
        angle_deg=pulled.angle_deg + 0.1 * noise.standard_normal(force.size),
        notches_deg=pulled.notches_deg + 0.1 * noise.standard_normal((force.size, 4)),
        tube={"outer_diameter_mm": 1.62, "inner_diameter_mm": 1.40},
        notch={"shape": "rectangular", "count": 4, "depth_mm": list(DEPTHS), "width_mm": 0.5, "spacing_mm": 1.5},
    )
    write_record(record, tmp_path / "wrist.csv")
    near = {"superelastic_plateau", "notch_closure", "gravity", "tip_load", "guide_friction", "functional_fatigue"}
    tried = [effect for effect in catalogue() if effect.name in near]
    found = trace_report(trace_records([nb.read_record(tmp_path / "wrist.csv")], effects=tried))
    assert [effect.name for effect in found.effects] == ["superelastic_plateau"]
    assert found.after.heldout.rmse_deg < 1.5 * found.noise_floor_deg  # that of the readings, 0.1 deg
