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
from studies.commands.tracing import limits_of
from validation.tracing import trace_records
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.cross_validated import _without_change
from validation.tracing.fitting.noise import NoiseFloor
from validation.tracing.next_experiment import next_experiment
from validation.tracing.outcome import Trace
from validation.tracing.result import in_words, trace_report
from validation.tracing.sensors.protocol import (
    OTHER_AMPLITUDE,
    OTHER_RATE,
    amplitude_words,
    cycle_amplitudes,
    cycle_rates,
    rate_words,
)
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


def test_amplitudes_beyond_those_of_the_reference_are_told():
    other, *words = amplitude_words([loop(1.0), loop(1.7)], [loop(2.0), loop(2.1)])
    assert other == OTHER_AMPLITUDE
    assert words[0].startswith("a record: the reference has no amplitude of 1 mm (its own: 2): what differs may be")
    assert len(words) == 2
    (words,) = amplitude_words([loop(1.0, source="x/new.csv"), loop(2.0)], [loop(2.0), loop(3.0)])
    assert words.startswith("new.csv: the reference has no amplitude of 1 mm (its own: 2 to 3)")
    assert amplitude_words([loop(1.5)], [loop(1.0), loop(2.1)]) == []


def test_amplitudes_are_those_of_the_cycles():
    """One record of growing cycles is a reference at all of them; one of decaying cycles is not at the largest."""
    t = np.linspace(0.0, 8 * np.pi, 400)
    growing = Record((0.5 + t / (4 * np.pi)) * np.sin(t), t)
    assert len(cycle_amplitudes(growing)) > 2
    assert amplitude_words([loop(1.0)], [growing]) == []
    assert OTHER_AMPLITUDE in amplitude_words([growing], [loop(2.5)])
    rising = Record(np.linspace(0.0, 3.0, 20), np.arange(20.0))
    assert cycle_amplitudes(rising) == [1.5]


def du2018_record(amplitude, seed, rate_Hz=0.1):
    """Three cycles of a rig that does not change, with 0.05 deg of noise."""
    time = np.linspace(0.0, 3 / rate_Hz, 361)
    drive = amplitude * np.sin(2 * np.pi * rate_Hz * time)
    angle = simulate_chain(replace(preset("du2018"), preload_N=20.0), LoadProgram(drive, time)).angle_deg
    return Record(drive, angle + 0.05 * np.random.default_rng(seed).standard_normal(drive.size), time_s=time)


@pytest.mark.slow
def test_no_change_is_named_at_an_amplitude_that_the_reference_lacks():
    """A delay was named, as `effect`, of a rig that had not changed."""
    reference = [du2018_record(2.0, 0), du2018_record(2.0, 1, 0.3)]
    trace = trace_records([du2018_record(1.0, 10)], reference=reference)
    assert trace.verdict == "unexplained"
    assert trace.names == ()
    assert trace.confusable == ()
    assert trace.words[0].startswith("time_delay takes ")
    assert OTHER_AMPLITUDE in trace.words
    assert not any("remaining" in words for words in trace.words)
    assert trace.candidates
    assert limits_of(trace) == []
    experiment = next_experiment(trace)
    assert experiment.words.startswith("the reference at the amplitude of the new records")
    report = trace_report(trace, experiment=experiment, opinion=None, limits=[], seconds=1.0, seed=0)
    assert in_words(report)[0].startswith("Whether the rig has changed cannot be said.")


def test_beside_a_record_of_an_amplitude_of_the_reference_a_change_stays_named():
    named = SimpleNamespace(effects=("time_delay",))
    assert _without_change(named, amplitude_words([loop(1.0), loop(2.0)], [loop(2.0)])) is named
    nothing = SimpleNamespace(effects=())
    assert _without_change(nothing, amplitude_words([loop(1.0)], [loop(2.0)])) is nothing


def timed(rate_Hz, cycles=3.3, amplitude=2.0, **about):
    """A motor that takes hold by a small motion to and fro, then whole cycles, and a part of one."""
    time = np.arange(int(120 * cycles) + 1) / (120 * rate_Hz)
    drive = amplitude * np.sin(2 * np.pi * rate_Hz * time) + 0.1 * np.exp(-((20 * rate_Hz * time - 1) ** 2))
    return Record(drive, 10 * drive, time_s=time, **about)


def test_rates_are_those_of_whole_cycles():
    assert cycle_rates(timed(0.3)) == pytest.approx([0.3] * len(cycle_rates(timed(0.3))), rel=0.06)
    assert len(cycle_rates(timed(0.3))) > 3
    assert cycle_rates(timed(0.3, cycles=1.05)) == pytest.approx([0.3], rel=0.06)  # two turning points
    assert cycle_rates(replace(timed(0.3), time_s=None)) == []
    t = np.linspace(0.0, 6 * np.pi, 400)
    dying = Record(np.exp(-0.3 * t) * np.sin(t), t, time_s=t)
    assert cycle_rates(dying) == pytest.approx([1 / (2 * np.pi)] * len(cycle_rates(dying)), rel=0.06)


@pytest.mark.parametrize("at", [1 / 4, 3 / 4, 5 / 4])
def test_a_dwell_at_full_drive_does_not_count_in_the_rate(at):
    """With it, a dwell of ten periods made a tenth of the rate, and a pause in a reference let every rate pass."""
    one = timed(0.3)
    turn = int(np.argmin(np.abs(one.time_s - at / 0.3)))
    drive = np.r_[one.drive[:turn], np.full(40, one.drive[turn]), one.drive[turn:]]
    time = np.r_[one.time_s[:turn], one.time_s[turn] + np.arange(40.0), one.time_s[turn:] + 40.0]
    rests = Record(drive, 10 * drive, time_s=time)
    assert cycle_rates(rests) == pytest.approx([0.3] * len(cycle_rates(rests)), rel=0.06)
    assert rate_words([rests], [one]) == []
    assert OTHER_RATE in rate_words([timed(0.1)], [rests])


def test_rates_beyond_those_of_the_reference_are_told():
    other, *words = rate_words([timed(0.3, source="x/new.csv")], [timed(0.1), timed(0.1)])
    assert other == OTHER_RATE
    assert words == [
        "new.csv: the reference has no rate of 0.3 Hz (its own: 0.1): what differs may be of the rate and no change; "
        "record the reference at this one, too"
    ]
    assert rate_words([timed(0.3)], [timed(0.1), timed(0.5)]) == []  # in between
    assert rate_words([timed(0.3)], [timed(0.31)]) == []
    assert OTHER_RATE not in rate_words([timed(0.3), timed(0.1)], [timed(0.1)])
    assert rate_words([loop()], [timed(0.1)]) == []  # no times
    assert rate_words([timed(0.3)], [timed(0.1), loop()]) == []
    assert OTHER_RATE in rate_words([timed(0.3), loop()], [timed(0.1)])


@pytest.mark.parametrize(
    ("after", "confusable", "verdict", "reason"),
    [
        (0.2, ("backlash",), "ambiguous", "84 % of the squared error, more than a rate has made of rigs without a"),
        (0.27, ("backlash",), "ambiguous", "71 % of the squared error: a rate may make as much"),
        (0.24, (), "partial", "77 % of the squared error and leaves 1.6 times the floor: a rate may make as much"),
        (0.2, ("a", "b", "c"), "ambiguous", "84 % of the squared error, and 3 others do as well: a rate may make as"),
    ],
)
def test_at_another_rate_a_change_must_explain_more_than_the_rate(after, confusable, verdict, reason):
    baseline, best = (
        SimpleNamespace(
            names=(), heldout_rmse_deg=left, heldout_errors=[np.full(50, left)], model=SimpleNamespace(added=added)
        )
        for left, added in ((0.5, []), (after, [SimpleNamespace(effect=SimpleNamespace(name="gravity"))]))
    )
    trace = Trace(
        model="play operators",
        verdict=verdict,
        baseline=baseline,
        augmented=best,
        candidates=(),
        confusable=(confusable,),
        floor=NoiseFloor(0.15, None),
        smooth=SimpleNamespace(names=()),
        words=(),
        alike=10.0,
    )
    words = rate_words([timed(0.3)], [timed(0.1)])
    judged = _without_change(trace, words)
    assert any(one.startswith(f"gravity takes {reason}") for one in judged.words)
    if "more than" in reason:
        assert (judged.verdict, judged.names, judged.confusable) == (verdict, ("gravity",), (confusable,))
    else:
        assert (judged.verdict, judged.names, judged.confusable) == ("unexplained", (), ())
        assert [*judged.words[-len(words) :]] == words
    assert _without_change(trace, rate_words([timed(0.1)], [timed(0.1)])) is trace


@pytest.mark.slow
def test_of_another_rate_than_the_reference_nothing_is_promised():
    """Neither limits nor a program at a third rate: both would be compared with the same reference."""
    trace = trace_records([du2018_record(2.0, 10, 0.3)], reference=[du2018_record(2.0, 0), du2018_record(2.0, 1)])
    assert OTHER_RATE in trace.words
    assert trace.names == ()
    assert limits_of(trace) == []
    experiment = next_experiment(trace)
    assert experiment.words.startswith("the reference at the rate of the new records")
    first = in_words(trace_report(trace, experiment=experiment, opinion=None, limits=[], seconds=1.0, seed=0))[0]
    cannot = "Whether the rig has changed cannot be said."
    assert first.startswith(cannot if trace.verdict == "unexplained" else "Nothing has changed")
    unexplained = replace(trace, verdict="unexplained")
    report = trace_report(unexplained, experiment=experiment, opinion=None, limits=[], seconds=1.0, seed=0)
    assert in_words(report)[0].startswith(cannot)


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
