"""Records that no effect explains: rows in no order, another unit, a late angle, exchanged preloads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem_models.analytic.of_record import require_the_rigs_unit
from fem_models.chain import simulate_chain
from fem_models.load import triangle
from fem_models.rig import preset
from hysteresis import Record
from hysteresis.records.record import RecordError
from hysteresis.sensors.lateness import lateness
from hysteresis.sensors.readings import reading_words, readings_of, require_rows
from validation.tracing import trace_records
from validation.tracing.result import in_words, trace_report
from validation.tracing.sensors.protocol import NOT_AS_RECORDED

PRELOADS = (20.0, 8.0)


def _loop(preload_N: float, seed: int) -> Record:
    found = simulate_chain(replace(preset("du2018"), preload_N=preload_N), triangle(1.5, step_mm=0.1, cycles=2))
    noise = np.random.default_rng(seed).normal(0.0, 0.05, found.drive.size)
    rig = {"preset": "du2018", "preload_N": preload_N}
    return Record(found.drive, found.angle_deg + noise, rig=rig, source=f"{preload_N:g}N.csv")


@pytest.fixture(scope="module")
def records() -> tuple[Record, Record]:
    first, second = (_loop(preload, seed) for seed, preload in enumerate(PRELOADS))
    return first, second


def _late(record: Record, samples: int) -> Record:
    angle = np.concatenate([np.full(samples, record.angle_deg[0]), record.angle_deg[:-samples]])
    return replace(record, angle_deg=angle)


def test_rows_in_no_order_are_refused(records: tuple[Record, Record]) -> None:
    order = np.random.default_rng(5).permutation(records[0].drive.size)
    shuffled = replace(records[0], drive=records[0].drive[order], angle_deg=records[0].angle_deg[order])
    with pytest.raises(RecordError, match=r"^20N.csv: the drive jumps across its range .* order of time"):
        trace_records([shuffled, records[1]])


def test_a_wrapped_angle_is_refused(records: tuple[Record, Record]) -> None:
    with pytest.raises(RecordError, match=r"^20N.csv: angle_deg = .*: wrapped at a turn"):
        trace_records([replace(records[0], angle_deg=records[0].angle_deg % 360.0), records[1]])


def test_an_angle_in_radians_is_refused_and_one_lost_reading_is_not(records: tuple[Record, Record]) -> None:
    with pytest.raises(RecordError, match=r"^20N.csv: the angle covers .* deg by its rig: expected degrees and mm"):
        trace_records([replace(records[0], angle_deg=np.radians(records[0].angle_deg)), records[1]])
    spike = records[0].angle_deg.copy()
    spike[40] = 1e4
    assert trace_records([replace(records[0], angle_deg=spike), records[1]]).verdict == "none"


@pytest.mark.parametrize("samples", [2, 5])
def test_a_late_angle_is_said_and_no_effect_is_named(records: tuple[Record, Record], samples: int) -> None:
    trace = trace_records([_late(records[0], samples), records[1]])
    assert trace.verdict == "unexplained"
    assert trace.names == ()
    assert trace.words[0] == NOT_AS_RECORDED
    assert trace.words[1].startswith(f"20N.csv: the angle goes on for {samples} samples after the drive reverses")


def test_the_angle_of_a_rig_turns_back_with_the_drive(records: tuple[Record, Record]) -> None:
    for record in records:
        assert lateness(record) is None
        late = lateness(_late(record, 3))
        assert late is not None
        assert late.samples == 3
        every = np.arange(record.drive.size)
        assert lateness(replace(_late(record, 3), time_s=0.1 * every)) is None  # a delay can be traced
        held = replace(record, angle_deg=record.angle_deg[every // 4 * 4])  # only samples where it changes are used
        assert lateness(held) is None


def test_a_play_and_a_sensor_that_drifts_are_not_late() -> None:
    drive = triangle(1.5, step_mm=0.05, cycles=3).drive_mm
    angle, rest = np.empty(drive.size), 0.0
    for k, x in enumerate(20.0 * drive):
        rest = min(max(rest, x - 4.0), x + 4.0)
        angle[k] = rest
    rng = np.random.default_rng(3)
    for slope in (0.0, 3.0):
        drift = slope * np.linspace(0.0, 1.0, drive.size)
        assert lateness(Record(drive, angle + drift + rng.normal(0.0, 0.05, drive.size))) is None


def test_exchanged_preloads_are_said_and_no_effect_is_named(records: tuple[Record, Record]) -> None:
    exchanged = [
        replace(one, rig={**one.rig, "preload_N": preload})
        for one, preload in zip(records, PRELOADS[::-1], strict=True)
    ]
    trace = trace_records(exchanged)
    assert trace.verdict == "unexplained"
    assert trace.names == ()
    said = in_words(trace_report(trace))
    assert said[0].startswith("The residual has structure. The baseline model")
    assert said[1] == f"N{NOT_AS_RECORDED[1:]}."
    assert trace.words[1].startswith("with the preloads of 20N.csv and 8N.csv exchanged (8 and 20 N)")


def test_readings_lost_about_a_reversal_are_no_leap(records: tuple[Record, Record]) -> None:
    angle = records[0].angle_deg.copy()
    top = int(np.argmax(records[0].drive))
    angle[top - 2 : top + 2] = 0.0
    lost = replace(records[0], angle_deg=angle)
    words = reading_words([lost])
    assert words == (f"4 of {angle.size} angles are isolated spikes, which are left out",)
    assert readings_of(lost).leap_deg is None


def _wave(amplitude: float, samples: int = 50, cycles: int = 2) -> np.ndarray:
    up = np.linspace(-amplitude, amplitude, samples)
    return np.tile(np.r_[up[:-1], up[:0:-1]], cycles)


def test_stairs_force_trials_and_one_lost_reading_are_rows_in_order() -> None:
    stairs = np.tile(np.r_[np.linspace(-1.5, 1.5, 6)[:-1], np.linspace(1.5, -1.5, 6)[:-1]], 5)
    force = np.tile(np.arange(6.0), 8)
    drive = _wave(1.5)
    lost = 25.0 * drive
    lost[37] = 360.0
    for record in (
        Record(stairs, 20.0 * stairs),
        Record(force, 10.0 * force, "N", cycle=np.repeat(np.arange(1, 9), 6)),
        Record(drive, lost),
    ):
        require_rows(record)


def test_a_rig_within_its_slack_is_in_no_other_unit() -> None:
    rig = {"preset": "du2018", "preload_N": 20.0}
    drive = _wave(0.3)
    noise = np.random.default_rng(0).normal(0.0, 0.02, drive.size)
    slack = Record(drive, 21.0 * np.sign(drive) * np.maximum(np.abs(drive) - 0.29, 0.0) + noise, rig=rig)
    require_the_rigs_unit(slack)
    with pytest.raises(RecordError, match="expected degrees and mm"):
        require_the_rigs_unit(Record(drive, np.radians(21.0 * drive), rig=rig))
    with pytest.raises(RecordError, match="expected degrees and mm"):  # the drive in m
        require_the_rigs_unit(Record(1e-3 * drive, 21.0 * drive, rig=rig))


def test_coarse_and_held_steps_of_the_drive_are_no_late_angle() -> None:
    drive = _wave(1.5, 100)
    coarse = 0.12 * np.round(drive / 0.12)
    assert lateness(Record(coarse, 21.0 * drive)) is None
    stairs = np.tile(np.r_[np.arange(-1.5, 1.5, 0.15), np.arange(1.5, -1.5, -0.15)], 2)
    goal, settled, angle = np.repeat(21.0 * stairs, 10), -31.5, list[float]()
    for one in goal:
        settled += (one - settled) * (1.0 - np.exp(-1.0 / 1.5))
        angle.append(settled)
    assert lateness(Record(np.repeat(stairs, 10), np.array(angle))) is None


def test_preloads_exchanged_between_groups_of_records_are_said() -> None:
    first = [_loop(PRELOADS[0], seed) for seed in (0, 1)]
    second = [_loop(PRELOADS[1], seed) for seed in (2, 3)]
    records = [
        replace(one, rig={**one.rig, "preload_N": preload}, source=f"{k}.csv")
        for k, (one, preload) in enumerate([*((r, PRELOADS[1]) for r in first), *((r, PRELOADS[0]) for r in second)])
    ]
    trace = trace_records(records)
    assert trace.names == ()
    assert trace.words[1].startswith("with the preloads of 0.csv and 1.csv and 2.csv and 3.csv exchanged (8 and 20 N)")
