"""Nitinol's own law: closed forms of tension against compression, temperature and self-heating."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.compiled import chain_njit
from fem_models.chain.fibres import heated_sums, sums_of
from fem_models.chain.parameters import ChainSettings, NitinolParameters, chain_parameters, memory_at_rest
from fem_models.chain.solve import solve_chain, solve_chain_by_force
from fem_models.joint import joint_mechanics, joint_row
from fem_models.joint.strain import strain_limits
from fem_models.joint.superelastic_section import SuperelasticSection, fibre_stress, heat_exchange, section_path
from fem_models.load import LoadProgram, sine
from fem_models.multibody.quasi_static import solve_multibody, solve_multibody_by_force
from fem_models.rig import Rig, RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Superelastic
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material, with_notch
from fem_models.solid.strain import superelastic_limit
from fem_models.solid.superelastic import flag_law

YOUNG, PULLED, PRESSED, SPAN, CLIMB = 60e3, 450.0, 1.4 * 450.0, 0.05, 1.5e3
BACK = 200.0
PAIR = replace(preset("du2018"), material=Material(60.0, 0.33))


def strip(count: int = 4000, *, climb: float = 0.0, span: float = 0.5) -> SuperelasticSection:
    """Fibres of a strip, 1 mm wide, 0.6 mm high and 0.8 mm long, stronger in compression; rigid roots."""
    edges = np.linspace(-0.3, 0.3, count + 1)
    return SuperelasticSection(
        height_mm=0.5 * (edges[1:] + edges[:-1]), area_mm2=np.diff(edges), length_mm=0.8, root_compliance=0.0,
        axial_compliance=0.0, elastic_N_per_mm=0.0, young=YOUNG, upper=PULLED, lower=BACK, upper_pressed=PRESSED,
        lower_pressed=1.4 * BACK, climb=climb, span=span, heating=None,
    )  # fmt: skip


@pytest.mark.parametrize(("side", "start", "back"), [(1, PULLED, BACK), (-1, PRESSED, 1.4 * BACK)])
def test_a_bar_follows_the_plateaus_of_its_side(side, start, back):
    bar, share = strip(2, climb=CLIMB, span=SPAN), 1 - CLIMB / YOUNG
    area, length = float(bar.area_mm2.sum()), bar.length_mm
    # up the plateau to 2 % of transformed strain, down its other side, and beyond the complete transformation
    at = 0.02
    rising = start + CLIMB / share * at
    falling = back + CLIMB / share * at
    full = start + CLIMB / share * SPAN + 50.0
    forces = np.array([0.9 * start, rising, falling + 1.0, 1e-3, full])
    strains = np.array([0.9 * start / YOUNG, rising / YOUNG + at, (falling + 1) / YOUNG + at, 0.0, full / YOUNG + SPAN])
    found = section_path(bar, 0.0, -side * forces * area).elongation_mm / length
    assert found == pytest.approx(side * strains, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("curvature", [0.05, 0.1, 0.2])
def test_neutral_fibre_of_a_strip_in_bending_moves_towards_the_side_that_is_stronger(curvature):
    section, half = strip(), 0.3
    found = section_path(section, curvature * section.length_mm, 0.0)
    core = YOUNG * curvature
    # balance of plateaus and elastic core, both sides yielding
    neutral = 0.5 * (PULLED - PRESSED) * (2 * half / (PULLED + PRESSED) - 1 / core)
    assert found.elongation_mm[0] == pytest.approx(-neutral * curvature * section.length_mm, rel=1e-4)
    up, down = neutral + PULLED / core, neutral - PRESSED / core  # edges of the core
    plateaus = PULLED * (half**2 - up**2) / 2 + PRESSED * (half**2 - down**2) / 2
    elastic = core * ((up**3 - down**3) / 3 - neutral * (up**2 - down**2) / 2)
    assert found.moment_Nmm[0] == pytest.approx(plateaus + elastic, rel=1e-5)
    # fully plastic: areas in the ratio of the plateaus
    limit = 2 * half**2 * PULLED * PRESSED / (PULLED + PRESSED)
    assert found.moment_Nmm[0] < limit
    assert section_path(strip(span=50.0), 5.0, 0.0).moment_Nmm[0] == pytest.approx(limit, rel=1e-3)


@pytest.mark.parametrize("factor", [1.0, 1.44])
def test_ten_kelvin_move_all_plateaus_by_65_MPa(factor):
    law = Superelastic(compression_factor=factor)
    cold, warm = (
        joint_mechanics(replace(PAIR, superelastic=replace(law, temperature_C=at))).section for at in (37.0, 47.0)
    )
    strain, never, full = np.array([0.03, -0.03]), np.zeros(2), np.array([0.04, -0.04])
    for rest in (never, full):
        moved = fibre_stress(warm, strain, rest) - fibre_stress(cold, strain, rest)
        assert moved == pytest.approx([65.2, -65.2])
    rigs = [replace(PAIR, superelastic=replace(law, temperature_C=at)) for at in (37.0, 47.0)]
    assert np.diff([superelastic_limit(rig) for rig in rigs]) == pytest.approx(65.2 / 60e3)
    assert np.diff([strain_limits(rig)[1].strain for rig in rigs]) == pytest.approx(65.2 / 60e3)


def test_a_measured_joint_is_warmed_too():
    warm = Superelastic(480.0, 225.0, temperature_C=47.0)
    bench = replace(PAIR, joint=MeasuredJoint(14, 2.6, 520.0))
    shifted, plain = (
        joint_mechanics(replace(bench, superelastic=law)).fibres for law in (warm, Superelastic(545.2, 290.2))
    )
    assert shifted.upper_Nmm == pytest.approx(plain.upper_Nmm)
    assert shifted.lower_Nmm == pytest.approx(plain.lower_Nmm)


def bar_parameters(law: Superelastic) -> NitinolParameters:
    """A bar of 1 mm^2 and 1 mm of a law."""
    return NitinolParameters(
        length=1.0, root=0.0, elastic=0.0, rest=0.0, young=YOUNG, upper=law.plateau_MPa,
        lower=law.unloading_plateau_MPa, span=law.transformation_strain, climb=1e3 * law.plateau_modulus_GPa,
        upper_pressed=law.plateau_MPa, lower_pressed=law.unloading_plateau_MPa,
        heat=law.complete_heating_K / law.transformation_strain, rise=law.clausius_clapeyron_MPa_per_K,
        heating_time=float(law.heating_time_s),
    )  # fmt: skip


def pull(law: Superelastic, strain: np.ndarray, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Stress and temperature of a bar along strains, one step of a length in time each."""
    bar, rests = bar_parameters(law), np.zeros(2)  # transformed strain, temperature
    out = []
    for at in strain:
        sums, warm = heated_sums(0.0, float(at), bar, np.zeros(1), np.ones(1), rests, 1 / step_s)
        rests[:] = at - sums.pull / YOUNG, warm
        out.append((sums.pull, warm))
    stress, warm = np.array(out).T
    return stress, warm


ADIABATIC, ISOTHERMAL = 1e9, 1e-9
BAR = Superelastic(PULLED, 300.0, SPAN, CLIMB / 1e3, heating_time_s=ADIABATIC)
UP = np.linspace(0.0, 0.07, 141)
LOOP = np.concatenate([UP, UP[-2::-1]])


def flag(start: float, slope: float, strain: np.ndarray) -> np.ndarray:
    """Plateau of a slope over the transformed strain, up to the complete transformation."""
    on_plateau = (slope * strain + start) / (1 + slope / YOUNG)
    return np.maximum(np.minimum(YOUNG * strain, on_plateau), YOUNG * (strain - SPAN))


def test_a_bar_that_keeps_its_heat_has_a_plateau_steeper_by_its_closed_form():
    plain = CLIMB / (1 - CLIMB / YOUNG)
    # latent heat x dM/strain / (rho c) x Clausius-Clapeyron slope
    steeper = plain + 14.4 / SPAN / 0.47 * 6.52
    stress, warm = pull(BAR, LOOP, 1.0)
    assert stress[: UP.size] == pytest.approx(flag(PULLED, steeper, UP), rel=1e-6, abs=1e-6)
    assert warm.max() == pytest.approx(14.4 / 0.47, rel=1e-6)
    # without exchange the temperature follows the strain both ways: back at the start, with the loss of a slow bar
    assert stress[UP.size :] == pytest.approx(flag(300.0, steeper, UP[-2::-1]), rel=1e-6, abs=1e-6)
    assert abs(warm[-1]) < 1e-4
    slow, cold = pull(replace(BAR, heating_time_s=ISOTHERMAL), LOOP, 1.0)
    assert slow[: UP.size] == pytest.approx(flag(PULLED, plain, UP), rel=1e-6, abs=1e-6)
    assert np.abs(cold).max() < 1e-6
    for loop in (stress, slow):  # within what 140 steps leave out at the corners
        assert np.trapezoid(loop, LOOP) == pytest.approx((PULLED - 300.0) * SPAN, rel=2e-3)


def test_heat_that_comes_evenly_has_its_exponential():
    """On a plateau at a constant rate: T' (1 + k b/E) = k v - T/time with k = latent heat/capacity over the strain."""
    law, rate, start = replace(BAR, plateau_modulus_GPa=0.0, heating_time_s=3.0), 0.01, PULLED / YOUNG
    k = law.complete_heating_K / SPAN
    for steps, within in ((40, 0.02), (400, 0.002)):
        time = 4.0 * np.arange(1, steps + 1) / steps
        _, warm = pull(law, np.append(start, start + rate * time), 4.0 / steps)
        slower = 1 + k * 6.52 / YOUNG
        expected = k * rate * 3.0 * (1 - np.exp(-time / (3.0 * slower)))
        assert np.abs(warm[1:] - expected).max() < within * expected.max()


def test_heat_is_exchanged_exactly():
    assert heat_exchange(0.0, 2.0) == (0.0, 0.0)  # slow
    left, gained = heat_exchange(3.0, 2.0)
    assert (left, gained) == pytest.approx((np.exp(-1.5), (1 - np.exp(-1.5)) / 1.5))
    assert heat_exchange(1e-12, 2.0) == pytest.approx((1.0, 1.0))


def test_the_loss_over_the_rate_is_a_bell():
    """Greatest where the metal transforms in about the time in which it cools: He and Sun 2011."""
    phase = 2 * np.pi * np.arange(1, 3 * 200 + 1) / 200
    strain = 0.035 * (1 - np.cos(phase))  # transformed completely, and back
    ratios = np.array([1e-4, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0, 1e4])
    losses = []
    for ratio in ratios:  # omega times time constant
        stress, _ = pull(replace(BAR, heating_time_s=float(ratio)), strain, 2 * np.pi / 200)
        losses.append(np.trapezoid(stress[-201:], strain[-201:]))
    slow = (PULLED - 300.0) * SPAN
    assert losses[0] == pytest.approx(slow, rel=0.01)
    assert losses[-1] == pytest.approx(slow, rel=0.01)
    peak = int(np.argmax(losses))
    assert 0.1 <= ratios[peak] <= 3.0
    assert losses[peak] > 1.3 * slow
    assert (np.diff(losses[: peak + 1]) > 0).all()
    assert (np.diff(losses[peak:]) < 0).all()


def one_joint(law: Superelastic) -> Rig:
    """One notch of the default tube without friction, bent far: most of its fibres transform."""
    tendon = replace(PAIR.tendon_a, toe_N=0.0)
    one = with_notch(replace(PAIR, superelastic=law), replace(PAIR.joint.notch, count=1))
    return replace(one, friction=Friction(), tendon_a=tendon, tendon_b=tendon, preload_N=10.0)


def last_cycle(energy: np.ndarray, samples: int) -> float:
    return energy[-1] - energy[-1 - samples]


def test_a_joint_slow_or_fast_has_its_limits_and_most_loss_between():
    program, slow = sine(0.4, 1.0, cycles=3, samples_per_cycle=400), Superelastic(450.0, 300.0)
    isothermal = solve_chain(one_joint(slow), program)
    assert isothermal.warming_K is None
    losses = []
    for time_s in (1e-7, 1e-3, 1e-2, 0.03, 0.1, 0.3, 1.0, 1e2, 1e7):
        run = solve_chain(one_joint(replace(slow, heating_time_s=time_s)), program)
        losses.append(last_cycle(run.material_loss_mJ, 400))
        work, lost = (last_cycle(e, 400) for e in (run.wheel_work_mJ, run.material_loss_mJ))
        if not 0.3 < time_s < 1e6:  # where the temperature has settled within three cycles
            assert lost == pytest.approx(work, rel=1e-3)
        if time_s == 1e-7:
            assert run.record.angle_deg == pytest.approx(isothermal.record.angle_deg, abs=1e-5)
    assert losses[0] == pytest.approx(last_cycle(isothermal.material_loss_mJ, 400), rel=1e-5)
    peak = int(np.argmax(losses))
    assert 1 < peak < len(losses) - 2
    assert losses[peak] > 1.05 * max(losses[0], losses[-1])
    assert losses[-1] == pytest.approx(losses[-2], rel=0.02)


@pytest.mark.slow
def test_engines_agree_with_everything_on():
    law = Superelastic(
        430.0, 220.0, 0.046, 0.75, compression_factor=1.44, temperature_C=25.0, heating_time_s=1.0
    )  # cold
    program = sine(2.2, 0.2, cycles=2, samples_per_cycle=100)
    for preload in (10.0, 20.0):
        rig = replace(PAIR, preload_N=preload, superelastic=law)
        chain, multibody = solve_chain(rig, program), solve_multibody(rig, program)
        assert np.abs(chain.record.angle_deg - multibody.record.angle_deg).max() < 0.1
        for name in ("wheel_work_mJ", "material_loss_mJ", "friction_loss_mJ"):
            one, other = (last_cycle(getattr(run, name), 100) for run in (chain, multibody))
            assert one == pytest.approx(other, rel=0.03)
        assert np.abs(chain.warming_K - multibody.warming_K).max() < 0.02 * np.ptp(chain.warming_K)
        assert chain.warming_K.shape == (program.drive_mm.size, rig.joints)
        for run in (chain, multibody):
            lost = last_cycle(run.friction_loss_mJ + run.material_loss_mJ, 100)
            assert lost == pytest.approx(last_cycle(run.wheel_work_mJ, 100), rel=1e-3)


@pytest.mark.parametrize("engine", [solve_chain, solve_multibody])
def test_self_heating_needs_times(engine):
    with pytest.raises(RigError, match=r"superelastic.heating_time_s: expected a load program with time_s"):
        engine(replace(PAIR, superelastic=Superelastic(heating_time_s=1.0)), LoadProgram(np.linspace(0, 1, 5)))


@pytest.mark.parametrize("engine", [solve_chain_by_force, solve_multibody_by_force])
def test_forces_have_no_times(engine):
    wrist = preset("notched-wrist-90")
    heated = replace(wrist, superelastic=replace(wrist.superelastic, heating_time_s=1.0))
    with pytest.raises(RigError, match=r"superelastic.heating_time_s: expected a rig without it"):
        engine(heated, np.linspace(0, 1, 5))


@pytest.mark.parametrize("change", [{"compression_factor": 1.44}, {"heating_time_s": 1.0}])
def test_measured_joints_refuse_what_needs_a_section(change):
    bench = replace(PAIR, joint=MeasuredJoint(14, 2.6, 520.0), superelastic=Superelastic(**change))
    with pytest.raises(RigError, match=f"superelastic.{next(iter(change))} = 1.*measured joints have no section"):
        joint_mechanics(bench)


def test_the_solid_refuses_sides_that_differ():
    with pytest.raises(RigError, match=r"superelastic.compression_factor = 1.44: expected 1"):
        flag_law(replace(PAIR, superelastic=Superelastic(compression_factor=1.44)))
    warm = flag_law(replace(PAIR, superelastic=Superelastic(temperature_C=47.0)))
    assert warm.upper - flag_law(replace(PAIR, superelastic=Superelastic())).upper == pytest.approx(65.2)


def test_metal_that_would_stay_martensite_is_refused():
    with pytest.raises(RigError, match=r"superelastic.temperature_C = 2.0: expected warmer: .* falls to -3.2 MPa"):
        Superelastic(temperature_C=2.0)
    chilled = Superelastic(450.0, 30.0, heating_time_s=0.1, latent_heat_J_per_g=80.0)
    for engine in (solve_chain, solve_multibody):
        with pytest.raises(SolverError, match=r"joint 1 cools by .* K, and its unloading plateau falls to 0"):
            engine(one_joint(chilled), sine(0.5, 1.0, cycles=1, samples_per_cycle=80))
        there_and_far_back = LoadProgram(np.array([0.0, 0.5, -0.5]), time_s=np.array([0.0, 1e4, 1e4 + 0.2]))
        with pytest.raises(SolverError, match="its unloading plateau falls to 0"):  # between two samples
            engine(one_joint(chilled), there_and_far_back)


def test_the_spring_that_leads_the_search_for_heat_carries_nothing():
    """Elastic after a reversal, nearly adiabatic: no heat is set free, and the first search ends the step."""
    law = Superelastic(450.0, 220.0, 0.05, 1.0, heating_time_s=1e7, latent_heat_J_per_g=24.0)
    program = sine(0.4, 1.0, cycles=1, samples_per_cycle=40)
    chain, multibody = (engine(one_joint(law), program).record for engine in (solve_chain, solve_multibody))
    assert np.abs(chain.angle_deg - multibody.angle_deg).max() < 1.5e-3


@chain_njit()
def compiled_sums(bent, longer, section, heights, areas, rests):
    return sums_of(bent, longer, section, heights, areas, rests, 0.0)


@pytest.mark.parametrize("factor", [1.0, 1.4])
def test_a_kernel_takes_the_section_that_python_takes(factor):
    """Sections that are not alike on both sides have a kernel of their own, chosen when a caller is compiled."""
    rig = replace(PAIR, superelastic=Superelastic(450.0, 220.0, 0.05, 1.0, compression_factor=factor))
    joints = joint_row(rig)
    section, memory = chain_parameters(rig, joints, ChainSettings()).section, memory_at_rest(rig, joints)
    assert isinstance(section, NitinolParameters) == (factor != 1.0)
    at = 0.12, -0.004, section, memory.fibre_height[0], memory.fibre_area[0], memory.fibres[0]
    assert compiled_sums(*at) == pytest.approx(sums_of(*at, 0.0), rel=1e-12)
