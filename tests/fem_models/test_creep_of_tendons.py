"""Creep of the tendons while a drive is held, against its closed form in both engines."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import solve_chain
from fem_models.load import LoadProgram
from fem_models.multibody.quasi_static import solve_multibody
from fem_models.rig import preset
from fem_models.rig.effects import Creep
from fem_models.rig.rig import Friction

FRACTION, TIME_S, DRIVE_MM = 0.3, 20.0, 0.2
PRESET = preset("du2018")
TENDON = replace(PRESET.tendon_a, toe_N=0.0)
RIG = replace(
    PRESET,
    friction=Friction(),
    material=replace(PRESET.material, loop_share=0.0),
    tendon_a=TENDON,
    tendon_b=TENDON,
    creep=Creep(FRACTION, TIME_S),
)
ENGINES = {"chain": solve_chain, "multibody": solve_multibody}


def angle_deg(solve, step_s, count):
    """Angle after a drive that comes on at once, every ``step_s`` seconds; without creep at the first of them."""
    time = np.concatenate([[0.0], 1e-6 + step_s * np.arange(count + 1)])
    drive = np.concatenate([[0.0], np.full(count + 1, DRIVE_MM)])
    return solve(RIG, LoadProgram(drive, time_s=time)).record.angle_deg[1:]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_held_drive_creeps_from_the_first_sample_on(engine):
    """Kelvin and Voigt's element in series with a linear rig: both tendons lose tension in proportion to their creep.

    The difference T of both tensions obeys T = T_0 - K c, and their creep c' = (f T/k - c)/tau: it goes on with the
    time constant tau/(1 + f K/k) towards c = f T_0/k over that. K/k is less than 1, and follows from the end.
    """
    angle = angle_deg(ENGINES[engine], 1.0, 12)
    fallen = angle[0] - angle
    late = angle_deg(ENGINES[engine], 40 * TIME_S, 12)
    whole = late[0] - late[-1]  # of the end
    ratio = whole / late[0]  # f K/k over 1 + f K/k, of a rig whose angle is proportional to T
    seconds = np.arange(angle.size)
    exact = whole * -np.expm1(-seconds / (TIME_S * (1 - ratio)))
    assert fallen[1] > 0  # a sample late it was 0 here
    np.testing.assert_allclose(fallen, exact, atol=0.02 * whole)
