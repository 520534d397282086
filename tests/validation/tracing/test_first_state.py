"""Records that do not begin at rest: where the drive of a run came from, and that no effect is named for it."""

import numpy as np
import pytest

from fem_models.chain import simulate_chain
from fem_models.load import LoadProgram
from fem_models.rig import preset
from hysteresis.records.record import Record
from validation.tracing import trace_records
from validation.tracing.baseline.first_state import coming_from
from validation.tracing.baseline.runs import drive_runs
from validation.tracing.effect import SampleInputs

RIG = preset("du2018-full-widths")  # its guides shake down to 1e-6 deg within a cycle
CYCLE = np.concatenate([np.linspace(0, 1, 21)[:-1], np.linspace(1, -1, 41)[:-1], np.linspace(-1, 0, 21)[:-1]])
DRIVE = np.append(np.tile(CYCLE, 3), 0.0)


def inputs_of(drive):
    samples = np.arange(drive.size, dtype=float)
    return SampleInputs(drive, samples, np.zeros(drive.size, dtype=np.int64), timed=True)


@pytest.mark.parametrize("away_mm", [0.5, -0.5, 0.05])
def test_a_run_that_comes_from_elsewhere_has_that_history(away_mm):
    (run,) = drive_runs(RIG, inputs_of(DRIVE))
    assert run.short is not None  # its cycles repeat each other
    moved = coming_from(run, away_mm)
    stroke = np.linspace(0, away_mm, 31)
    whole = simulate_chain(RIG, LoadProgram(np.concatenate([stroke, stroke[::-1][1:], DRIVE[1:]]))).angle_deg
    found = moved.angle_deg(RIG)
    assert found.size == DRIVE.size
    np.testing.assert_allclose(found, whole[-DRIVE.size :], atol=1e-6)
    assert np.abs(found - run.angle_deg(RIG))[:20].max() > 0.01  # another way out of the first sample
    assert moved.program.time_s.size == moved.program.drive_mm.size
    assert np.all(np.diff(moved.program.time_s) > 0)


def played(drive, width, first):
    angle, out = first, np.empty_like(drive)
    for i, x in enumerate(drive):
        angle = min(max(angle, x - width / 2), x + width / 2)
        out[i] = angle
    return out


@pytest.mark.slow
@pytest.mark.parametrize("taken_up", [-1.0, 0.0, 1.0])
def test_a_log_that_starts_in_motion_names_no_effect(taken_up):
    """Three triangles about a place, the angle a play: its state at the first sample is no effect."""
    drive = -103.0 + 34.0 * np.append(np.tile(np.concatenate([CYCLE]), 3), 0.0)
    angle = played(drive, 4.58, drive[0] - taken_up * 2.29) + np.random.default_rng(0).normal(0, 0.03, drive.size)
    assert trace_records([Record(drive, angle)]).verdict == "none"
