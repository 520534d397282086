"""What a reference must have in common with new records, and rigs that are declared under a tendon force."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fem_models.chain import simulate_chain
from fem_models.load import LoadProgram
from fem_models.load_control import run_load_control
from fem_models.rig import preset
from hysteresis.records.record import Record, RecordError
from validation.tracing import trace_records
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.cross_validated import _amplitude_words, _doubted_by_amplitude
from validation.tracing.trace import _require_one_sense, _rigs_not_used


def loop(amplitude=2.0, sign=1.0, source=""):
    drive = amplitude * np.sin(np.linspace(0.0, 6 * np.pi, 200))
    return Record(drive, sign * (10 * drive + np.cos(np.linspace(0.0, 6 * np.pi, 200))), source=source)


def test_an_angle_of_the_other_sign_is_no_change_of_the_rig():
    """It was traced to tendons that stiffen, as `effect`."""
    said = r"new.csv: angle_deg: falls as the drive rises: expected the sign of the reference, old.csv, where it rises"
    with pytest.raises(RecordError, match=said):
        trace_records([loop(sign=-1.0, source="new.csv")], reference=[loop(source="x/old.csv")])
    _require_one_sense([loop(sign=-1.0)], [loop(sign=-1.0)])
    turns = replace(loop(), angle_deg=np.cos(np.linspace(0.0, 6 * np.pi, 200)))  # follows the drive in neither sense
    _require_one_sense([turns], [loop()])


def test_an_amplitude_that_the_reference_lacks_is_told():
    (words,) = _amplitude_words([loop(1.0), loop(2.0)], [loop(2.0), loop(2.1)])
    assert words.startswith("the reference has no record of an amplitude of 1 mm (its own are 2, 2.1)")
    assert _amplitude_words([loop(2.0)], [loop(1.0), loop(2.1)]) == []


def du2018_record(amplitude, seed, rate_Hz=0.1):
    """Three cycles of a rig that does not change, with 0.05 deg of noise."""
    time = np.linspace(0.0, 3 / rate_Hz, 361)
    drive = amplitude * np.sin(2 * np.pi * rate_Hz * time)
    angle = simulate_chain(replace(preset("du2018"), preload_N=20.0), LoadProgram(drive, time)).angle_deg
    return Record(drive, angle + 0.05 * np.random.default_rng(seed).standard_normal(drive.size), time_s=time)


def test_no_change_is_named_at_an_amplitude_that_the_reference_lacks():
    """A delay was named, as `effect`, of a rig that had not changed."""
    reference = [du2018_record(2.0, 0), du2018_record(2.0, 1, 0.3)]
    trace = trace_records([du2018_record(1.0, 10)], reference=reference)
    assert trace.verdict == "unexplained"
    assert trace.names == ()
    assert trace.confusable == ()
    assert "of the error above the noise, at an amplitude of its own" in trace.words[0]
    assert any(words.startswith("the reference has no record of an amplitude of 1 mm") for words in trace.words)
    assert trace.candidates


def test_between_amplitudes_of_the_reference_a_change_stays_named():
    named = SimpleNamespace(effects=("time_delay",))
    assert _doubted_by_amplitude(named, [loop(1.5)], [loop(1.0), loop(2.0)]) is named
    assert _doubted_by_amplitude(named, [loop(2.0)], [loop(2.1)]) is named
    nothing = SimpleNamespace(effects=())
    assert _doubted_by_amplitude(nothing, [loop(1.0)], [loop(2.0)]) is nothing


def under_force(name):
    rig = preset(name)
    force = np.r_[np.linspace(0.0, 3.0, 30), np.linspace(3.0, 0.0, 30)[1:]]
    angle = run_load_control(rig, force).angle_deg if rig.tendon_b is None else force
    return Record(force, angle, drive_unit="N", rig={"preset": name})


def test_a_declared_rig_of_one_tendon_is_known_under_a_force():
    """It was left out without a word, and the record was that of an unknown rig."""
    record = under_force("notched-wrist-90")
    problem = known_rig_problem([record])
    assert problem.runs[0][0].rig.joint.notch.count == preset("notched-wrist-90").joint.notch.count
    two = under_force("du2018")
    assert known_rig_problem([two]) is None
    assert "its rig has two tendons and is not used under a tendon force" in _rigs_not_used([two])[0]
    assert _rigs_not_used([Record(two.drive, two.angle_deg, drive_unit="N")]) == ()
