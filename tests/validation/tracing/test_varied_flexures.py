"""Measured joints whose stiffness varies along the bend: no effect is named for it, and effects are found beside it."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import solve_chain
from fem_models.load import sine
from fem_models.rig.of_record import rig_of
from fem_models.rig.presets import preset
from hysteresis.records.record import Record
from validation.practice.draw import SETS
from validation.practice.lumped.cases import draw_lumped_case
from validation.tracing import trace_records
from validation.tracing.baseline.known_rig import known_rig_problem, with_varied_flexures
from validation.tracing.effect import catalogue
from validation.tracing.settings import FAR_ABOVE
from validation.tracing.verdict import doubted_on_heldout, named_in_part, with_remaining_error

NOISE_DEG = 0.05
DECLARED = {
    "joints": 6,
    "pitch_mm": 2.6,
    "moment_arm_mm": 2.6,
    "flexure_stiffness_Nmm_per_rad": 600.0,
    "tendon_EA_N": 9_000.0,
    "tendon_free_length_mm": 150.0,
}


def records(*, delay_s=0.0, slope=0.6, limit=0.6):
    """Two records of a rig whose flexures are up to 60 % stiffer along the bend than declared at rest."""
    rng, out = np.random.default_rng(3), []
    for preload_N in (20.0, 12.0):
        program = sine(1.5, 0.2, cycles=2, samples_per_cycle=72)
        empty = Record(
            program.drive_mm, np.zeros(program.drive_mm.size), "mm", time_s=program.time_s, cycle=program.cycle,
            rig={**DECLARED, "preload_N": preload_N},
        )  # fmt: skip
        rig = rig_of(empty)
        joint = replace(rig.joint, hardening_slope=slope, hardening_limit=limit, hardening_angle_deg=4.0)
        material = replace(rig.material, loop_share=0.2, loop_angle_deg=1.5)
        rig = replace(rig, joint=joint, material=material, friction=replace(rig.friction, sheath_N=0.8))
        angle = solve_chain(rig, program).record.angle_deg
        angle = np.interp(program.time_s - delay_s, program.time_s, angle) + rng.normal(0.0, NOISE_DEG, angle.size)
        out.append(replace(empty, angle_deg=angle))
    return out


@pytest.fixture(scope="module")
def delayed():
    near = {"time_delay", "viscous_drag", "tendon_creep", "notch_closure", "tendon_stiffening", "stribeck_friction"}
    return trace_records(records(delay_s=0.1), effects=[effect for effect in catalogue() if effect.name in near])


@pytest.mark.slow
def test_a_rig_of_another_make_is_not_given_an_effect_for_its_flexures():
    """With linear flexures closed notches are named for these, which leave 1.2 times the noise."""
    trace = trace_records(draw_lumped_case(SETS["score-13"], "known", "clean", 1).records)
    assert trace.verdict == "none"
    assert "hardening_limit" in trace.baseline.model.problem.start


@pytest.mark.slow
def test_an_effect_is_found_beside_flexures_that_vary(delayed):
    assert delayed.augmented.names == ("time_delay",)
    assert delayed.augmented.rmse_deg < 1.2 * NOISE_DEG


def test_flexures_stay_linear_where_they_are():
    trace = trace_records(records(slope=0.0, limit=0.0))
    assert trace.verdict == "none"
    assert "hardening_limit" not in trace.baseline.model.problem.start


def test_only_measured_joints_may_vary():
    empty = records()[0]
    assert with_varied_flexures(known_rig_problem([replace(empty, rig={"preset": "du2018"})])) is None
    varied = with_varied_flexures(known_rig_problem([empty]))
    run = varied.runs[0][0]
    rig = varied.baseline_rig(run.rig, varied.start)
    # the flexure itself starts as it was measured
    elastic = rig.joint.flexure_stiffness_Nmm_per_rad * (1 - rig.material.loop_share)
    assert elastic == pytest.approx(DECLARED["flexure_stiffness_Nmm_per_rad"])
    assert preset("du2018").joint == rig_of(replace(empty, rig={"preset": "du2018"})).joint


@pytest.mark.slow
def test_one_effect_is_named_in_part_where_it_takes_most_of_the_error(delayed):
    unexplained = replace(delayed, verdict="unexplained", augmented=delayed.baseline, confusable=())
    part = named_in_part(unexplained)
    assert part.augmented.names == ("time_delay",)
    assert part.verdict != "partial"
    quiet = replace(delayed.floor, local_deg=0.4 * NOISE_DEG, repeats_deg=None, by_repeats=False)
    assert named_in_part(replace(unexplained, floor=quiet)).verdict == "partial"
    # a baseline that leaves little, and candidates that take little, name nothing
    loud = replace(delayed.floor, local_deg=0.6 * delayed.baseline.train_rmse_deg, repeats_deg=None)
    assert named_in_part(replace(unexplained, floor=loud)).verdict == "unexplained"
    weak = tuple(c for c in delayed.candidates if c.fitted.rmse_deg > 0.8 * delayed.baseline.rmse_deg)
    assert weak
    assert named_in_part(replace(unexplained, candidates=weak)).verdict == "unexplained"


def with_spoiled_heldout(fitted, factor):
    """Give a fit whose held-out errors are larger; those of the training samples are as they were."""
    errors = tuple(np.where(train, e, factor * e) for e, train in zip(fitted.errors, fitted.holdout.train, strict=True))
    return replace(fitted, errors=errors)


@pytest.mark.slow
def test_heldout_samples_neither_choose_nor_confirm_a_name_in_part(delayed):
    unexplained = replace(delayed, verdict="unexplained", augmented=delayed.baseline, confusable=())
    spoiled = tuple(
        replace(c, fitted=with_spoiled_heldout(c.fitted, 30.0)) if c.names == ("time_delay",) else c
        for c in delayed.candidates
    )
    found = named_in_part(replace(unexplained, candidates=spoiled))
    assert found.augmented.names == ("time_delay",)
    assert found.verdict == "partial"  # the words follow the held-out error, the name does not
    flattered = tuple(
        c if c.names == ("time_delay",) else replace(c, fitted=with_spoiled_heldout(c.fitted, 0.0))
        for c in delayed.candidates
    )
    assert named_in_part(replace(unexplained, candidates=flattered)).augmented.names == ("time_delay",)


@pytest.mark.slow
def test_an_unknown_rig_is_doubted_where_samples_held_out_are_far_off(delayed):
    """A baseline of an unknown rig may take an effect over the programs that it has seen."""
    good = replace(delayed, model="equivalent rig", verdict="none", baseline=delayed.augmented)
    assert doubted_on_heldout(good) is good
    spoiled = replace(good, baseline=with_spoiled_heldout(good.baseline, 2.5))
    doubted = doubted_on_heldout(spoiled)
    assert doubted.verdict == "unexplained"
    assert doubted.words[0].startswith("the held-out error of the baseline model is ")
    assert doubted.words[1:] == spoiled.words
    # as large as the fitted error, known geometry, or with a name: nothing is taken back
    both = replace(good, baseline=replace(good.baseline, errors=tuple(2.5 * e for e in good.baseline.errors)))
    assert both.baseline.heldout_rmse_deg > FAR_ABOVE * both.floor.deg
    assert doubted_on_heldout(both).verdict == "none"
    assert doubted_on_heldout(replace(spoiled, model="rig")).verdict == "none"
    assert doubted_on_heldout(replace(spoiled, verdict="effect")).verdict == "effect"


@pytest.mark.slow
def test_the_remaining_error_is_that_of_the_fit_that_is_reported(delayed):
    """It is said once all fits are final: a search may have ended with another one."""
    quiet = replace(delayed.floor, local_deg=0.4 * NOISE_DEG, repeats_deg=None, by_repeats=False)
    said = with_remaining_error(replace(delayed, floor=quiet)).words
    assert said[-1].startswith(f"the remaining error is {delayed.augmented.rmse_deg:.2g} deg rms, ")
    coarser = replace(delayed.augmented, errors=tuple(2 * e for e in delayed.augmented.errors))
    said = with_remaining_error(replace(delayed, augmented=coarser, floor=quiet)).words
    assert said[-1].startswith(f"the remaining error is {2 * delayed.augmented.rmse_deg:.2g} deg rms, ")
    assert with_remaining_error(delayed).words == delayed.words
