"""The record to take next stays within what the rig stands, and asks for what the records do not tell."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fem_models.joint.strain import SUPERELASTIC
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.baseline.play_operators import play_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Model, fit
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.next_experiment import Trial, _absent, _altered, _limits, _new, _run_of_rig, next_experiment
from validation.tracing.settings import TENSION_FACTOR
from validation.tracing.trace import trace_records

from .test_channels import driven, wrist


def bare(record):
    return replace(record, notches_deg=None, tension_a_N=None, tension_b_N=None)


@pytest.mark.parametrize("unit", ["N", "mm"])
def test_limits_are_what_the_records_reached_or_nitinol_stands(unit):
    problem = known_rig_problem([bare(wrist() if unit == "N" else driven())])
    model = Model(problem)
    found = fit(model, divide_records(problem.records), model.coordinates(problem.start, []), threads=1, most_steps=2)
    limits, (run, *_) = _limits(problem, found), problem.runs[0]
    assert limits.strain >= SUPERELASTIC.strain
    drive, time, cycle = (getattr(problem.inputs[0], name) for name in ("drive", "time_s", "cycle"))
    first = cycle <= 1

    def program(factor, preload_N=np.nan):
        return Trial("", factor * drive[first], time[first], cycle[first], preload_N)

    measured = _run_of_rig(problem, run, program(1.0), found)
    assert limits.allow(measured)
    assert limits.tension_N == pytest.approx(TENSION_FACTOR * measured.segment_tensions_N.max(), rel=1e-6)
    too_far = program(1.6) if unit == "N" else program(1.0, preload_N=40.0)
    assert not limits.allow(_run_of_rig(problem, run, too_far, found))


def test_trials_that_only_load_are_to_be_unloaded():
    tried = ("camera_misalignment", "notch_closure", "superelastic_plateau")
    trace = trace_records([wrist()], threads=1, effects=[e for e in catalogue() if e.name in tried])
    experiment = next_experiment(trace)
    if experiment.trial is None:
        assert experiment.words.startswith("the same trials with unloading")
    else:
        assert experiment.trial.drive.max() <= wrist().drive.max() * TENSION_FACTOR


def test_who_may_have_given_two_preloads_is_asked_to_write_them_down():
    """Preloads that the sidecars do not state say nothing about whether they differ."""
    one = bare(driven())
    records = [
        replace(one, rig={"preset": "du2018"}),
        replace(one, angle_deg=one.angle_deg + 1, rig={"preset": "du2018"}),
    ]
    trace = trace_records(records, threads=1, effects=[])
    measure, why = _absent(trace)["preload"]
    assert measure == "the preload of every record, written into its sidecar (preload_N in [rig])"
    assert "not known" in why
    assert "another preload" not in next_experiment(trace).words
    known = trace_records([one, one], threads=1, effects=[])
    assert _absent(known)["preload"][0] == "a record at another preload, such as 10 N"


def test_what_the_reference_shows_is_still_lacking_in_the_new_records():
    """A change does not act on it: half the amplitude and another rate of the reference say nothing about it."""
    new = bare(driven())
    old = replace(new, drive=0.5 * new.drive, angle_deg=0.5 * new.angle_deg, time_s=0.1 * new.time_s)
    problem = play_problem([new, old], powers=0, curve=6)
    fields = {"baseline": SimpleNamespace(model=SimpleNamespace(problem=problem)), "records": [new, old]}
    assert {"amplitude", "rate"} <= set(_absent(SimpleNamespace(**fields, reference=1)))
    assert not {"amplitude", "rate"} & set(_absent(SimpleNamespace(**fields, reference=0)))
    amplitudes = [trial.words for trial in _altered(_new(SimpleNamespace(**fields, reference=1)), 0)]
    assert any("1.1 mm amplitude, 0.1 Hz" in words for words in amplitudes)
