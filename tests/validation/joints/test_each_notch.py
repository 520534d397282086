"""Notches that differ, one by one: the solid of each, closed forms, engines, contributions, and the command's table."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fem_models.analytic.frictionless_chain import bend_by_tendon, bend_each_by_tendon, tendon_for_sum_N
from fem_models.joint.flexure import flexure
from fem_models.rig import preset
from fem_models.rig.joints import Notch
from fem_models.rig.rig import with_joint, with_notch
from fem_models.solid import snr_stiffness, solid_snr
from fem_models.solid.linear import as_flexure
from hysteresis.plain import from_plain, to_plain
from studies.commands import comparison
from studies.commands.comparison import Models, Validation
from studies.commands.tables import models_table, notches_table
from studies.report.page import write_report
from validation.engines import compare_engines
from validation.joints import compare_models
from validation.joints.models import REFERENCE
from validation.separation import loop_program, separate

RIG = preset("du2018", preload_N=12.0)
DEEPER = with_notch(RIG, Notch("rectangular_pair", 3, depth_mm=(2.6, 2.6, 2.7), width_mm=1.5, spacing_mm=1.0))


@pytest.fixture(scope="module")
def found():
    return compare_models(DEEPER, refinement=0.35)


def test_notches_that_hardly_differ_bend_as_equal_ones_do():
    notch = RIG.joint.notch
    nearly = with_notch(RIG, replace(notch, depth_mm=tuple(notch.depth_mm + 1e-13 * k for k in range(notch.count))))
    joint = flexure(RIG)
    angle, x, y = bend_by_tendon(RIG, joint, 3.0)
    angles, tip_x, tip_y = bend_each_by_tendon(nearly, [joint] * notch.count, 3.0)
    assert (angles.sum(), tip_x, tip_y) == pytest.approx((angle, x, y), rel=1e-12)
    assert tendon_for_sum_N(nearly, [joint] * notch.count, angle) == pytest.approx(3.0, rel=1e-10)


def test_every_notch_is_compared_with_its_own_solid(found):
    solid = found.model(REFERENCE)
    assert [notch.depth_mm for notch in solid.notches] == [2.6, 2.6, 2.7]
    for notch, number in zip(solid.notches, range(3), strict=True):
        alone = as_flexure(snr_stiffness(solid_snr(with_joint(DEEPER, number), refinement=0.35)).stiffness)
        assert notch.bending_Nmm_per_rad == pytest.approx(alone.bending_Nmm_per_rad, rel=1e-9)
    stiffness = np.array([notch.bending_Nmm_per_rad for notch in solid.notches])
    assert solid.bending_Nmm_per_rad == pytest.approx(3 / (1 / stiffness).sum())
    for model in found.models:  # the joints are in series: their angles add up
        for number, bent in enumerate(model.bent):
            assert sum(notch.angles_deg[number] for notch in model.notches) == pytest.approx(bent.angle_deg, abs=1e-5)


def test_engines_bend_every_notch_as_their_flexure_does(found):
    """The engines count the ends of a slot with the rings, which is 1 % more angle at these angles."""
    closed = found.model("beam with roots")
    for name in ("chain", "multibody"):
        engine = found.model(name)
        for own, other in zip(engine.notches, closed.notches, strict=True):
            assert own.bending_Nmm_per_rad == pytest.approx(other.bending_Nmm_per_rad, rel=0.01)
            assert own.angles_deg == pytest.approx(other.angles_deg, rel=0.02)
        tips = [(bent.tip_x_mm, bent.tip_y_mm) for bent in engine.bent]
        np.testing.assert_allclose(tips, [(bent.tip_x_mm, bent.tip_y_mm) for bent in closed.bent], atol=0.06)


def test_the_page_and_the_terminal_have_every_notch(found, tmp_path):
    models = Models(found.rig, REFERENCE, found.nodes, found.free_frequencies_Hz, found.rows())
    table = notches_table(models)
    assert table is not None
    assert table.row_count == 3
    assert models_table(models).row_count == 5
    (tmp_path / "validate.json").write_text(json.dumps(to_plain(Validation(1, (), models))))
    text = write_report(tmp_path).read_text()
    assert "Notch by notch" in text
    assert from_plain(comparison.Models, to_plain(models)) == models


def test_engines_and_contributions_take_notches_that_differ():
    agreement = compare_engines(DEEPER, amplitude_mm=0.4)
    assert agreement.bending_stiffness_Nmm_per_rad == flexure(with_joint(DEEPER, 2)).bending_Nmm_per_rad  # the softest
    assert agreement.frictionless_max_deg < 0.05
    assert agreement.chain_max_deg < 0.01
    shares = separate(DEEPER, loop_program(-0.3, 0.3)).shares("dissipated_mJ")
    assert shares is not None
    assert sum(shares.values()) == pytest.approx(1.0)
