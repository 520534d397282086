"""Tangent of the chain's equations against differences of its residual, and what it is for."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.equations import BAND, BAND_OF_JOINTS, Pace, assemble, work_space
from fem_models.chain.fibres import transform
from fem_models.chain.newton import Attempt, newton
from fem_models.chain.parameters import ChainSettings, chain_parameters, memory_at_rest
from fem_models.chain.solve import simulate_chain, solve_chain
from fem_models.joint import joint_row
from fem_models.load import triangle
from fem_models.load.stepping import Load
from fem_models.rig import preset
from fem_models.rig.effects import Gravity, Superelastic, TipLoad, TipStop

RATE = 0.5  # 1/s
SHORT = triangle(2.2, step_mm=0.1)
OUTSIDE = {
    "nothing": {},
    "weight": {"gravity": Gravity(ring_mass_g=40.0, direction_deg=140.0)},
    "stop": {"tip_stop": TipStop(y_mm=1.0, stiffness_N_per_mm=3.0)},  # which the tip stands in
    "load": {"tip_load": TipLoad(force_N=0.5, direction_deg=130.0)},
    "both": {"gravity": Gravity(40.0, 20.0), "tip_stop": TipStop(y_mm=1.0, stiffness_N_per_mm=3.0)},
}


LAWS = {
    "linear": None,
    "superelastic": Superelastic(400.0, 200.0, 0.02, 1.0),
    "heated": Superelastic(400.0, 200.0, 0.02, 1.0, compression_factor=1.2, heating_time_s=2.0),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("name", OUTSIDE)
def test_tangent_is_the_residuals_derivative(name, law):
    rig = replace(preset("du2018", preload_N=20.0 if law is None else 40.0), superelastic=law, **OUTSIDE[name])
    n, rng = rig.joints, np.random.default_rng(5)
    joint = joint_row(rig)
    parameters, memory = chain_parameters(rig, joint, ChainSettings()), memory_at_rest(rig, joint)
    work = work_space(parameters, n)
    load = Load(drive=0.4, slack=(0.0, 0.0), loop_scale=1.0, friction_scale=1.3, rest_angle=0.0, time=0.0, dead=1.0)
    x = np.zeros(3 * (n + 1))
    x[3::3] = rng.uniform(0.005, 0.04, n)  # one sign: a wrap has a corner at zero
    for side, arm in enumerate(parameters.arm):  # the tendons slide along, so that none is slack
        paths = 2 * (parameters.half_gap * (1 - np.cos(x[3::3] / 2)) + arm * np.sin(x[3::3] / 2))
        x[1 + side : -2 : 3] = np.cumsum(paths[::-1])[::-1] + rng.uniform(-1e-4, 1e-4, n)
    headed = name != "nothing"
    unknowns = np.eye(x.size)  # by x
    if headed:
        for i in range(3, x.size - 3, 3):
            unknowns[i + 3, i] = -1.0  # a heading bends its own joint, and the next one back

    def residual(x):
        balance = assemble(x, parameters, memory, load, work, RATE, False)
        stop = balance.stop_stiffness
        assert balance.outside == headed
        assert (stop > 0) == (name in ("stop", "both"))
        assert (work.tension > 0).all()
        return work.residual.copy(), work.tangent.copy(), stop * np.outer(work.lever, work.lever) if stop > 0 else 0.0

    step = 1e-6 if law is None else 1e-8  # between the corners that fibres make
    if law is not None:
        residual(x)
        for i in range(n):  # some history: fibres of every joint have transformed
            transform(i, *work.sections[i, :2], parameters, memory, RATE)
        assert (memory.fibres != 0).any(axis=1).sum() > n / 2
        x[3::3] += 0.002
    slopes = [(residual(x + step * u)[0] - residual(x - step * u)[0]) / (2 * step) for u in unknowns.T]
    _, band, of_stop = residual(x)
    reach = BAND if headed else BAND_OF_JOINTS
    tangent = sum(np.diag(band[max(0, -k) : x.size - max(0, k), k + BAND], k) for k in range(-reach, reach + 1))
    inner = np.r_[1 : x.size - 2]  # the base's and the tip's rows only hold what is fixed
    left = (tangent + of_stop - np.array(slopes).T)[np.ix_(inner, inner)]
    assert np.abs(left).max() < (1e-6 if law is None else 1e-5) * np.abs(tangent).max()


@pytest.mark.parametrize("preload", [10.0, 20.0])
@pytest.mark.parametrize(("direction", "heaviest"), [(0.0, 1000.0), (90.0, 80.0), (180.0, 40.0)])
def test_heavy_rings_converge(preload, direction, heaviest):
    # upside down there is less: the tube tips over beyond. Without weight in the tangent, 60 g was the most at 0 deg
    rig = replace(preset("du2018"), preload_N=preload)
    largest = [
        float(np.abs(simulate_chain(replace(rig, gravity=Gravity(mass, direction)), SHORT).angle_deg).max())
        for mass in np.linspace(0.05, 1.0, 8) * heaviest
    ]
    assert (np.diff(largest) < 0).all() if direction == 0 else (np.diff(largest) > 0).all()


def test_energy_with_weight_and_stop():
    # gravity and a stop give back what they took: of a closed cycle the wheel's work is what is lost
    rig = replace(preset("du2018"), **OUTSIDE["both"])
    solution = solve_chain(rig, triangle(2.2, cycles=2, step_mm=0.05))
    ends = [int(k) for k in np.flatnonzero(solution.record.drive == solution.record.drive.max())]
    assert len(ends) > 1
    lost = np.ptp((solution.friction_loss_mJ + solution.material_loss_mJ)[ends])
    assert np.ptp(solution.wheel_work_mJ[ends]) == pytest.approx(lost, rel=0.01)


def test_a_residual_without_a_number_has_not_converged():
    """A maximum passes over NaN: the largest residual of such a state is a number."""
    rig = preset("du2018")
    n, joint = rig.joints, joint_row(rig)
    parameters, memory = chain_parameters(rig, joint, ChainSettings()), memory_at_rest(rig, joint)
    work = work_space(parameters, n)
    load = Load(drive=0.1, slack=(0.0, 0.0), loop_scale=1.0, friction_scale=1.0, rest_angle=0.0, time=0.0, dead=1.0)
    attempt = Attempt(load, Pace(0.0, 0.0, 0.0), 30, True)
    x = np.zeros(3 * (n + 1))
    assert newton(x.copy(), parameters, memory, work, np.zeros((2, n)), attempt) >= 0
    assert newton(np.full_like(x, np.nan), parameters, memory, work, np.zeros((2, n)), attempt) == -1


def test_a_run_near_an_instability_does_not_depend_on_which_attempts_are_given_up():
    """A load on the tip that nearly buckles the tube: most attempts of a long step diverge, and are given up early."""
    rig = replace(preset("du2018"), preload_N=8.0, tip_load=TipLoad(6.0, 116.0))
    coarse, fine = (solve_chain(rig, triangle(1.5, cycles=1, step_mm=step)).record for step in (0.1, 0.05))
    np.testing.assert_allclose(coarse.angle_deg, fine.angle_deg[::2], atol=2e-3)
