"""Branches between reversals, and cycles."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hysteresis.records.path import branches, cycle_index, cycle_slices, find_cycles, first_stroke, require_reversal
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_record


def ends(drive: np.ndarray, **options: float) -> list[int]:
    return [s.stop - 1 for s in branches(np.asarray(drive, dtype=float), **options)]


def test_branches_of_a_triangle() -> None:
    assert branches(np.array([0.0, 1, 2, 1, 0, -1, 0])) == [slice(0, 3), slice(2, 6), slice(5, 7)]
    assert ends([0, 1, 2]) == [2]
    assert ends([1, 1, 1]) == [2]
    assert ends([5]) == [0]


def test_branches_ignore_dwell_noise_and_quantisation() -> None:
    rng = np.random.default_rng(3)
    phase = np.linspace(0, 6 * np.pi, 3001)
    clean = 2.2 * np.sin(phase)
    turning = 500 * np.array([0.5, 1.5, 2.5, 3.5, 4.5, 5.5])  # samples where the sine has its extremes
    noisy = clean + rng.uniform(-0.02, 0.02, clean.size)  # 0.9 % of the range, below the 2 % of the default
    for drive in (clean, noisy, np.round(clean / 0.04) * 0.04, np.clip(clean, -2.0, 2.0)):
        found = np.array(ends(drive)[:-1])
        assert len(found) == 6
        assert np.all(np.abs(found - turning) < 80)  # |sin| > 0.89 within 80 samples of its extreme


def test_branches_tolerance() -> None:
    drive = [0, 10, 9.9, 10.5, 0]  # the dip of 0.1 is 1 % of the range
    assert ends(drive) == [3, 4]
    assert ends(drive, tolerance=0.05) == [1, 2, 3, 4]


@settings(max_examples=200)
@given(drive=arrays(float, st.integers(1, 60), elements=st.floats(-1e6, 1e6)), tolerance=st.floats(0, 1e6))
def test_branches_cover_the_path_and_are_monotonic(drive: np.ndarray, tolerance: float) -> None:
    runs = branches(drive, tolerance=tolerance)
    assert runs[0].start == 0
    assert runs[-1].stop == len(drive)
    assert all(a.stop - 1 == b.start for a, b in pairwise(runs))
    directions = [np.sign(drive[s.stop - 1] - drive[s.start]) for s in runs[1:-1]]
    assert all(a == -b != 0 for a, b in pairwise(directions))
    for s, direction in zip(runs[1:-1], directions, strict=True):  # backwards by at most the tolerance
        x = direction * drive[s]
        assert np.all(np.maximum.accumulate(x) - x <= tolerance)


def cycles(drive: list[float], angle: list[float] | None = None) -> list[int]:
    return find_cycles(np.array(drive, dtype=float), np.array(angle or drive, dtype=float)).tolist()


def test_cycles_after_an_approach() -> None:
    # 0 to +2 (approach), two loops +2 -> -2 -> +2, and a last one that stays incomplete.
    drive = [0, 2, 0, -2, 0, 2, 0, -2, 0, 2, 0]
    assert cycles(drive) == [0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3]


def test_cycles_from_an_extreme() -> None:
    assert cycles([-2, 0, 2, 0, -2, 0, 2, 0, -2]) == [1, 1, 1, 1, 1, 2, 2, 2, 2]
    assert cycles([-2, 0, 2, 0, -2, 0]) == [1, 1, 1, 1, 1, 2]


def test_virgin_branch_from_an_extreme_is_an_approach() -> None:
    drive = [0, 1, 2, 1, 0, 1, 2, 1, 0]
    angle = [0, 5, 20, 15, 4, 6, 20, 15, 4]  # returns to 4, not to the initial 0
    assert cycles(drive, angle) == [0, 0, 0, 1, 1, 1, 1, 2, 2]
    # A single cycle has nothing to compare with.
    assert cycles(drive[:5], angle[:5]) == [1] * 5


def test_one_loop_from_the_middle() -> None:
    assert cycles([0, 1, 2, 1, 0, -1, -2, -1, 0]) == [1] * 9
    assert cycles([0, 1, 2, 1, 0, -1, -2]) == [0, 0, 0, 1, 1, 1, 1]
    assert cycles([0, 1, 2]) == [0, 0, 0]


def test_cycle_column_replaces_the_cycles_that_are_found() -> None:
    record = Record([0, 1, 0, 1], [0, 1, 0, 1], cycle=[3, 3, 4, 4])
    assert cycle_index(record).tolist() == [3, 3, 4, 4]
    assert cycle_slices(record.drive, record.cycle) == [(3, slice(0, 2)), (4, slice(2, 4))]  # 1 -> 0 is a reset
    small = Record([0, 1, 2, 1, 0], [0, 1, 2, 1, 0], cycle=[0, 0, 0, 1, 1])
    assert cycle_slices(small.drive, small.cycle) == [(0, slice(0, 3)), (1, slice(2, 5))]
    assert cycle_slices(np.array([0.0, 1.0, 2.0, 1.0]), np.array([0, 1, 1, 1])) == [(0, slice(0, 1)), (1, slice(0, 4))]


def test_reset_between_trials_is_not_a_reversal() -> None:
    loading = Record([0, 1, 2, 0, 1, 2], [0, 5, 9, 0, 5, 9], drive_unit="N", cycle=[1, 1, 1, 2, 2, 2])
    with pytest.raises(RecordError, match="record: drive 'drive' never reverses: expected a loop"):
        require_reversal(loading)
    require_reversal(replace(loading, cycle=None))  # without numbers it is a reversal
    require_reversal(Record([0, 1, 2, 1, 0], [0, 1, 2, 1, 0], cycle=[0, 0, 0, 1, 1]))


# --- measured records ------------------------------------------------------------------------------------------

# Branches, cycle numbers: from the README of the records ("3 cycles and the virgin branch", "one closed loop",
# "sine of seven decaying amplitudes", "5 and 3 trials") and, for the da Vinci tool, from rate times duration.
COUNTS = {
    "surgical-manipulator-0-80": (7, {0, 1, 2, 3}),
    "surgical-manipulator-feedforward": (8, {0, 1, 2, 3, 4}),
    "tee-probe-antero-posterior": (3, {1}),
    "catheter-taut-0.1hz": (14, set(range(8))),
    "catheter-taut-0.5hz": (14, set(range(8))),
    "catheter-slack-0.1hz": (14, set(range(8))),
    "catheter-slack-0.3hz": (14, set(range(8))),
    "tendon-robot-zero-0.10hz": (14, set(range(1, 8))),
    "tendon-robot-zero-0.30hz": (14, set(range(8))),
    "tendon-robot-mean-0.02hz": (6, {0, 1, 2, 3}),
    "davinci-tool-load050-0.1hz": (4, {1, 2}),
    "davinci-tool-load050-0.3hz": (12, set(range(1, 7))),
    "davinci-tool-load010-0.1hz": (4, {0, 1, 2}),
    "notched-wrist-90": (9, {1, 2, 3, 4, 5}),
    "notched-wrist-150": (5, {1, 2, 3}),
}


@pytest.mark.parametrize("stem", COUNTS)
def test_cycles_of_measured_records(measured: Path, stem: str) -> None:
    record = read_record(measured / f"{stem}.csv")
    runs, numbers = COUNTS[stem]
    assert len(branches(record.drive)) == runs
    assert set(cycle_index(record).tolist()) == numbers


def test_virgin_branch_of_the_surgical_manipulator(measured: Path) -> None:
    record = read_record(measured / "surgical-manipulator-0-80.csv")
    virgin = record.drive[cycle_index(record) == 0]
    assert virgin[0] == pytest.approx(0, abs=1e-3)  # the README: sine 0..80 deg
    assert virgin[-1] == 80
    assert len(record.drive) == 8085 - 11  # rows of the file less the samples it logs twice


def test_the_first_stroke_is_not_that_of_a_motor_that_takes_hold() -> None:
    """A small motion to and fro leaves the state as unknown as it was; a tenth of the range is a stroke."""
    sine = np.sin(2 * np.pi * np.arange(240) / 120)
    assert first_stroke(np.r_[0.0, -0.09, sine]) == slice(1, 33)
    assert first_stroke(np.r_[0.0, -0.25, sine]) == slice(0, 2)
    assert first_stroke(np.r_[0.0, -0.09, 0.0, -0.09, 0.0, -0.09, sine]) == slice(0, 2)  # a program
    assert first_stroke(np.linspace(0.0, 1.0, 5)) == slice(0, 5)
    assert first_stroke(np.zeros(5)) == slice(0, 5)
