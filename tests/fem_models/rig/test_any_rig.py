"""A rig that passes the checks simulates, or an engine says in one line why not, in bounded time."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fem_models.chain.solve import solve_chain
from fem_models.load import sine
from fem_models.rig import RigError, preset
from fem_models.rig.checks import MOST_JOINTS, RANGES, SolverError
from fem_models.rig.effects import Superelastic
from fem_models.rig.rig_file import numbers_of_a_rig, rig_of_tables
from hysteresis.records.record import Record

PROGRAM = sine(1.0, 0.1, samples_per_cycle=8)
BASE = preset("du2018").to_dict()
EFFECTS = {
    "backlash": {"width_mm": 0.1}, "eccentricity": {"amplitude_mm": 0.1}, "superelastic": {}, "slack": {},
    "closure": {"stiffness_Nmm_per_rad": 1e3}, "gravity": {"ring_mass_g": 1.0}, "drag": {}, "friction": {},
    "tip_stop": {"y_mm": 10.0, "stiffness_N_per_mm": 1.0}, "creep": {"fraction": 0.1, "time_s": 1.0},
    "preload_loss": {"fraction": 0.1, "cycles": 2.0}, "fatigue": {"loop_loss": 0.1, "residual_deg": 0.1, "cycles": 1.0},
    "tip_load": {"force_N": 0.1}, "drive_gain": {"error": 0.1}, "stribeck": {"rise": 0.1, "speed_mm_per_s": 1.0},
    "position_friction": {"growth_per_mm": 0.1}, "run_in": {"excess": 0.1, "cycles": 1.0}, "tip_mass": {"mass_g": 1.0},
}  # fmt: skip
"""What a table needs beside the number that is tried."""
NAMES = [name for name in numbers_of_a_rig() if not name.startswith("bench.")]  # a law of its own, slow to compile
SIZES = (0.0, 1e-300, 1e-6, 1.0, 1e2, 1e4, 1e6, 1e9, 1e12, 1e15, 1e308, float("inf"), float("nan"))
MOST_S = 5.0


def with_values(values: dict[str, float]) -> dict:
    tables = {key: dict(part) if isinstance(part, dict) else part for key, part in BASE.items()}
    for name, value in values.items():
        table, _, field = name.rpartition(".")
        number = int(value) if numbers_of_a_rig()[name] and np.isfinite(value) else value
        if table == "tendon":
            tables["tendon_a"][field] = tables["tendon_b"][field] = number
        elif table:
            tables.setdefault(table, dict(EFFECTS.get(table, {})))[field] = number
        else:
            tables[field] = number
    return tables


def simulated(values: dict[str, float]) -> Record | None:
    """The record; None where the rig or the engine refuses in one line."""
    start, words = time.process_time(), ""
    try:
        record = solve_chain(rig_of_tables(with_values(values), "mine.toml"), PROGRAM).record
    except (RigError, SolverError) as error:
        record, words = None, str(error)
    assert time.process_time() - start < MOST_S, values
    assert "\n" not in words
    assert len(words) < 300
    return record


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Kernels of each kind of section, so that no test below takes the time of a compiler."""
    for law in (None, Superelastic(), Superelastic(compression_factor=1.2)):
        run = solve_chain(replace(preset("du2018"), superelastic=law), PROGRAM)
        assert np.isfinite(run.record.angle_deg).all()


@pytest.mark.parametrize("name", NAMES)
def test_every_number_at_its_ends(name):
    unit = next(unit for unit in RANGES if name.replace("tendon.", "tendon_a.").endswith(unit))
    for value in (*RANGES[unit], 1e-300, 1e308, -1e308, float("nan")):
        record = simulated({name: value})
        assert record is None or np.isfinite(record.angle_deg).all()
        assert record is None or abs(value) < 1e308


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(st.dictionaries(st.sampled_from(NAMES), st.sampled_from(SIZES) | st.floats(1e-6, 1e6), min_size=2, max_size=5))
def test_several_numbers_at_once(values):
    record = simulated(values)
    assert record is None or np.isfinite(record.angle_deg).all()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"slack.tendon_a_mm": 1e308}, r"slack.tendon_a_mm = 1e\+308: expected from -1000 to 1000"),
        ({"slack.tendon_b_mm": -1e308}, r"slack.tendon_b_mm = -1e\+308: expected from"),
        ({"eccentricity.amplitude_mm": 1e308}, r"eccentricity.amplitude_mm = 1e\+308: expected from"),
        ({"notch.count": 1e9}, "notch.count = 1000000000: expected a whole number of at least 1, at most 1,000"),
        ({"tube.outer_diameter_mm": 1e308}, r"tube.outer_diameter_mm = 1e\+308: expected from"),
        ({"notch.width_mm": 1e-300}, "notch.width_mm = 1e-300: expected from 1e-09 to 10000"),
        ({"tendon.free_length_mm": 1e308}, r"tendon.free_length_mm = 1e\+308: expected from"),
        ({"preload_N": 1e308}, r"preload_N = 1e\+308: expected from"),
    ],
)
def test_numbers_beyond_physics_are_refused_with_the_range(values, said):
    with pytest.raises(RigError, match=said):
        rig_of_tables(with_values(values), "mine.toml")


def test_the_most_notches_that_are_allowed_are_simulated_or_refused():
    simulated({"notch.count": MOST_JOINTS, "slack.tendon_a_mm": 1e3})
    simulated({"notch.count": MOST_JOINTS, "eccentricity.amplitude_mm": 1e3})
    assert simulated({"notch.count": 1}) is not None
