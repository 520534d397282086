"""Starts of effects: one run of the model finds magnitudes and signs, however small the start is."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.rig import preset
from fem_models.rig.effects import Drag
from hysteresis.records.record import Record
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Fitted, Holdout, Model, fit
from validation.tracing.problem import AddedEffect
from validation.tracing.search.starts import joint_linearised_gain, joint_starts, linearised_gain

EFFECTS = {effect.name: effect for effect in catalogue()}


def baseline(change=lambda rig: rig, observe=lambda angle: angle) -> Fitted:
    records = []
    for preload in (20.0, 10.0):
        run = simulate_chain(
            change(preset("du2018", preload_N=preload)), sine(2.2, 0.5, cycles=2, samples_per_cycle=44)
        )
        known = {"preset": "du2018", "preload_N": preload}
        records.append(
            Record(drive=run.drive, angle_deg=observe(run.angle_deg), time_s=run.time_s, cycle=run.cycle, rig=known)
        )
    problem = known_rig_problem(records)
    holdout = Holdout(tuple(np.ones(s.drive.size, bool) for s in problem.inputs), "all")
    model = Model(problem)
    return fit(model, holdout, model.coordinates(problem.start, []))


@pytest.mark.parametrize(("gain", "perspective"), [(-0.03, 6e-4), (0.04, 3e-4), (0.02, -8e-4)])
def test_magnitudes_and_signs_of_two_parameters_are_found_together(gain, perspective):
    fitted = baseline(observe=lambda angle: angle * (1 + gain + perspective * angle))
    camera = EFFECTS["camera_misalignment"]
    both = next(AddedEffect(camera, form) for form in camera.rig_forms if len(form.parameters) == 2)
    starts = both.form.starts(fitted.model.problem.scale, preset("du2018"))
    (magnitudes,) = joint_starts(both, starts)
    start = joint_linearised_gain(fitted, both, magnitudes)
    alone = [
        linearised_gain(fitted, AddedEffect(camera, form), values)
        for form in camera.rig_forms if len(form.parameters) == 1
        for values in form.starts(fitted.model.problem.scale, preset("du2018"))
    ]  # fmt: skip
    assert start.gain > 0.95
    assert start.gain > max(one.gain for one in alone)
    found = Model(fitted.model.problem, (both,)).values(start.x)[1][0]
    assert found["perspective_per_deg"] == pytest.approx(perspective, rel=0.2)


def test_a_single_parameter_has_no_joint_start():
    camera = EFFECTS["camera_misalignment"]
    form = camera.rig_forms[0]
    assert joint_starts(AddedEffect(camera, form), [{"gain": 0.02}]) == []


def test_drag_is_found_from_a_start_that_is_too_small():
    fitted = baseline(lambda rig: replace(rig, drag=Drag(sheath_N_s_per_mm=0.5)))
    drag = EFFECTS["viscous_drag"]
    start = linearised_gain(fitted, AddedEffect(drag, drag.rig_forms[0]), {"sheath_N_s_per_mm": 0.02})
    found = Model(fitted.model.problem, (start.added,)).values(start.x)[1][0]
    assert found["sheath_N_s_per_mm"] > 0.2
