"""Workspace and circles of rigs with one wheel, three or four."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import LoadProgram
from fem_models.rig import RigError, preset
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import rig_in_space
from fem_models.spatial.drives import circle, round_axes
from fem_models.spatial.motion.workspace import workspace

ZHANG = any_preset("zhang2026")


def with_tendons(angles_deg, wheels, EA_N=5500.0):
    """The wrist with other tendons, taut up to 0.8 mm."""
    layout = replace(ZHANG.layout, angles_deg=angles_deg, wheels=wheels)
    return replace(ZHANG, tendon_a=replace(ZHANG.tendon_a, EA_N=EA_N), preload_N=4.0, layout=layout)


def test_one_wheel_reaches_a_curve():
    """Up and down are the branches of the loop of the planar chain."""
    rig = preset("du2018")
    found = workspace(rig_in_space(rig), 2.0, directions=41)
    assert found.wheels_mm.shape == (1, 41, 1)
    drive = found.wheels_mm[0, :, 0]
    assert (drive[0], drive[-1]) == (-2.0, 2.0)
    record = simulate_chain(rig, LoadProgram(np.concatenate([[0], drive[::-1], drive, drive[::-1]])))
    np.testing.assert_allclose(found.forth_deg[0, :, 0], record.angle_deg[42:83], atol=1e-9)
    np.testing.assert_allclose(found.back_deg[0, ::-1, 0], record.angle_deg[83:], atol=1e-9)
    assert found.is_curve
    # an arc bent by as much at both ends is longer than its chord and shorter than the way round its corners
    ends = np.linalg.norm(found.forth_mm[0, -1] - found.forth_mm[0, 0])
    assert ends < found.length_mm(found.forth_mm) < 1.2 * ends


def test_a_wheel_with_one_tendon_starts_from_rest():
    found = workspace(with_tendons((0.0,), (1,)), 0.5, directions=8)
    np.testing.assert_allclose(found.wheels_mm[0, :, 0], np.linspace(0, 0.5, 8))


def test_four_wheels_reach_what_two_with_pairs_reach():
    """Wheel k of opposite tendons is wound by cos(a) and cos(a + 180), as one wheel does."""
    pairs, alone = (with_tendons((0.0, 180.0, 90.0, 270.0), wheels) for wheels in ((1, 1, 2, 2), (1, 2, 3, 4)))
    two, four = (workspace(rig, 0.8, circles=1, directions=12) for rig in (pairs, alone))
    assert four.wheels_mm.shape == (1, 12, 4)
    for name in ("smooth_mm", "forth_mm", "back_mm"):
        np.testing.assert_allclose(getattr(four, name), getattr(two, name), atol=1e-9)


@pytest.mark.slow
def test_three_tendons_that_do_not_stretch_reach_what_four_reach():
    """Without friction a tube bent by inextensible tendons has one shape for each drive, r cos(a) for tendon a."""
    three = workspace(with_tendons((0.0, 120.0, 240.0), (1, 2, 3), EA_N=1e6), 0.8, circles=1, directions=12)
    four = workspace(with_tendons((0.0, 180.0, 90.0, 270.0), (1, 1, 2, 2), EA_N=1e6), 0.8, circles=1, directions=12)
    np.testing.assert_allclose(three.smooth_mm, four.smooth_mm, atol=2e-3)  # mm; seen: 8e-4, of 0.12 at EA = 5.5 kN
    assert three.least_tension_N > 0


def test_a_circle_of_two_wheels_is_as_before_and_of_three_by_their_angles():
    np.testing.assert_array_equal(round_axes(ZHANG), np.eye(2))
    rig = with_tendons((0.0, 120.0, 240.0), (1, 2, 3))
    drives = circle(1.0, axes=round_axes(rig)).wheels
    np.testing.assert_allclose(drives.sum(axis=1), 0, atol=1e-12)  # no tendon pulls against the others
    assert np.abs(drives).max() == pytest.approx(1.0)
    with pytest.raises(RigError, match="wheels = 1: expected 2 to 4 of rig zhang2026"):
        round_axes(with_tendons((0.0, 180.0), (1, 1)))
