"""Records that no effect explains: rows in no order, another unit, a late angle, exchanged preloads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import simulate_chain
from fem_models.load import triangle
from fem_models.rig import preset
from hysteresis import Record
from hysteresis.records.record import RecordError
from hysteresis.sensors.lateness import lateness
from hysteresis.sensors.readings import reading_words, readings_of
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
