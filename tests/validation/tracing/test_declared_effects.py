"""Effects on a rig that declares them already: what they bring comes on top, and nothing declared is lost.

Expected are the sums by hand: widths, forces and dampers in series or side by side, vectors of weight and of run-out,
losses that compound, springs beyond the angles of both, the limit and the first rate of two exponentials.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.joint import joint_mechanics
from fem_models.load import sine
from fem_models.rig import RigError, preset
from fem_models.rig.effects import (
    Backlash,
    Closure,
    Creep,
    Drag,
    DriveGain,
    Fatigue,
    PositionFriction,
    PreloadLoss,
    RunIn,
    Slack,
    Stribeck,
    Superelastic,
    TipStop,
)
from fem_models.rig.rig import Friction
from validation.tracing.baseline.curve_kernels import play
from validation.tracing.effect import OPEN_NOTCHES, Scale, catalogue

SCALE = Scale(
    drive=2.0, angle_deg=45.0, joint_deg=4.0, tip_mm=15.0, stress_MPa=600.0, duration_s=20.0, longest_s=40.0,
    speed=1.0, cycles=5.0,
)  # fmt: skip


def bare():
    """A rig that declares no effect."""
    rig = preset("du2018")
    straight = [replace(tendon, toe_N=0.0) for tendon in rig.tendons]
    dry = Friction(capstan_coefficient=0.05, sheath_N=1.0)
    return replace(rig, friction=dry, tendon_a=straight[0], tendon_b=straight[1])


BARE = bare()
BARE_WITH_PLATEAU = replace(BARE, superelastic=Superelastic(450.0, 250.0))


def start_rig(name):
    """Rig that an effect is added to: a change of temperature needs a plateau."""
    return BARE_WITH_PLATEAU if name == "temperature" else BARE


def forms_of(effect):
    return [form for form in effect.rig_forms if form.rig is not None]


def values_of(form, which):
    """Values of a form's parameters: a start, or another one of other sizes and the same side."""
    start = form.starts(SCALE, BARE)[0]
    values = {p.name: start.get(p.name, 0.5 * (max(p.low, 0.0) + min(p.high, 1.0))) for p in form.parameters}
    return values if which == 0 else {name: 0.7 * value for name, value in values.items()}


CASES = [
    pytest.param(effect.name, declared, added, id=f"{effect.name}-{i}-{j}")
    for effect in catalogue()
    for i, declared in enumerate(forms_of(effect))
    for j, added in enumerate(forms_of(effect))
]
"""Every form of the catalogue on a rig that declares the effect in every form."""


def refused(name, declared, added):
    """What cannot add: a metal has one plateau, a rig one obstacle, a wheel one period."""
    if name == "tip_contact":
        return declared is not added
    return name == "superelastic_plateau" or (name == "wheel_eccentricity" and "radius_mm" in values_of(added, 1))


def same_exponential(amounts, times, amount, time):
    """Of two amounts a (1 - exp(-t / time)): the limit of the sum and its rate at the start."""
    assert amount == pytest.approx(sum(amounts))
    assert amount / time == pytest.approx(sum(a / t for a, t in zip(amounts, times, strict=True)))


def of_backlash(a, b, both):
    assert both.backlash.width_mm == pytest.approx(a.backlash.width_mm + b.backlash.width_mm)
    drive = 3.0 * np.sin(np.linspace(0.0, 12.0, 400))
    series = play(play(drive, a.backlash.width_mm, 0.0), b.backlash.width_mm, 0.0)
    np.testing.assert_allclose(play(drive, both.backlash.width_mm, 0.0), series, atol=1e-12)


def of_fatigue(a, b, both):
    one, two, sum_ = a.fatigue, b.fatigue, both.fatigue
    assert 1 - sum_.loop_loss == pytest.approx((1 - one.loop_loss) * (1 - two.loop_loss))
    assert sum_.residual_deg == pytest.approx(one.residual_deg + two.residual_deg)
    # either amount has its own weight here; both kinds are in one proportion, so that either gives the rate
    part = abs(two.residual_deg) / abs(one.residual_deg + two.residual_deg)
    assert 1 / sum_.cycles == pytest.approx((1 - part) / one.cycles + part / two.cycles)


def of_gravity(a, b, both):
    def pull(rig):
        direction = math.radians(rig.gravity.direction_deg)
        return rig.gravity.ring_mass_g * np.array([math.cos(direction), math.sin(direction)])

    np.testing.assert_allclose(pull(both), pull(a) + pull(b), atol=1e-12)


def of_guide_friction(a, b, both):
    for name in ("guide_N", "rest_wrap_deg"):
        one, two, sum_ = (getattr(rig.friction, name) for rig in (a, b, both))
        assert sum_ == pytest.approx(one + two)
    assert both.friction.capstan_coefficient == BARE.friction.capstan_coefficient


def of_closure(a, b, both):
    """Beyond both angles the moment is that of both springs."""
    angle_deg = 90.0
    moments = [
        c.stiffness_Nmm_per_rad * math.radians(angle_deg - c.angle_deg) for c in (a.closure, b.closure, both.closure)
    ]
    assert moments[2] == pytest.approx(moments[0] + moments[1])
    assert min(a.closure.angle_deg, b.closure.angle_deg) < both.closure.angle_deg
    assert both.closure.angle_deg < max(a.closure.angle_deg, b.closure.angle_deg)


def of_preload_loss(a, b, both):
    one, two, sum_ = a.preload_loss, b.preload_loss, both.preload_loss
    assert 1 - sum_.fraction == pytest.approx((1 - one.fraction) * (1 - two.fraction))
    rate = (one.fraction / one.cycles + two.fraction / two.cycles) / (one.fraction + two.fraction)
    assert 1 / sum_.cycles == pytest.approx(rate)


def of_creep(a, b, both):
    one, two, sum_ = a.creep, b.creep, both.creep
    same_exponential((one.fraction, two.fraction), (one.time_s, two.time_s), sum_.fraction, sum_.time_s)


def of_slack(a, b, both):
    for name in ("tendon_a_mm", "tendon_b_mm"):
        one, two, sum_ = (getattr(rig.slack, name) for rig in (a, b, both))
        assert sum_ == pytest.approx(one + two)


def of_stiffening(a, b, both):
    for one, two, sum_ in zip(a.tendons, b.tendons, both.tendons, strict=True):
        assert sum_.toe_N == pytest.approx(one.toe_N + two.toe_N)


def of_tip_contact(a, b, both):
    """Beyond both places the force is that of both obstacles."""
    forces = [stop.stiffness_N_per_mm * (100.0 - stop.y_mm) for stop in (a.tip_stop, b.tip_stop, both.tip_stop)]
    assert forces[2] == pytest.approx(forces[0] + forces[1])


def of_unequal_tendons(a, b, both):
    """Ratios to the other tendon multiply; rest lengths add."""
    for name in ("moment_arm_mm", "EA_N", "free_length_mm"):
        one, two, sum_ = (getattr(rig.tendon_b, name) / getattr(rig.tendon_a, name) for rig in (a, b, both))
        assert sum_ == pytest.approx(one * two)
    one, two, sum_ = (rig.slack.tendon_b_mm if rig.slack else 0.0 for rig in (a, b, both))
    assert sum_ == pytest.approx(one + two)
    assert both.tendon_a == BARE.tendon_a


def of_drag(a, b, both):
    for name in ("sheath_N_s_per_mm", "joint_Nmm_s_per_rad"):
        one, two, sum_ = (getattr(rig.drag, name) for rig in (a, b, both))
        assert sum_ == pytest.approx(one + two)


def of_eccentricity(a, b, both):
    """The wave of both at every angle of the wheel."""
    turn = np.linspace(0.0, 2 * np.pi, 50)

    def wave(rig):
        return rig.eccentricity.amplitude_mm * np.sin(turn + math.radians(rig.eccentricity.phase_deg))

    np.testing.assert_allclose(wave(both), wave(a) + wave(b), atol=1e-12)
    assert both.wheel == a.wheel


def of_tip_load(a, b, both):
    def pull(rig):
        direction = math.radians(rig.tip_load.direction_deg)
        return rig.tip_load.force_N * np.array([math.cos(direction), math.sin(direction)])

    np.testing.assert_allclose(pull(both), pull(a) + pull(b), atol=1e-12)


def of_drive_gain(a, b, both):
    assert 1 + both.drive_gain.error == pytest.approx((1 + a.drive_gain.error) * (1 + b.drive_gain.error))


def of_stribeck(a, b, both):
    assert both.stribeck.rise == pytest.approx(a.stribeck.rise + b.stribeck.rise)
    weighted = sum(one.stribeck.rise * one.stribeck.speed_mm_per_s for one in (a, b))
    assert both.stribeck.rise * both.stribeck.speed_mm_per_s == pytest.approx(weighted)


def of_position_friction(a, b, both):
    """At any place the factors multiply."""
    growth = [rig.position_friction.growth_per_mm for rig in (a, b, both)]
    assert math.exp(0.7 * growth[2]) == pytest.approx(math.exp(0.7 * growth[0]) * math.exp(0.7 * growth[1]))


def of_run_in(a, b, both):
    one, two, sum_ = a.run_in, b.run_in, both.run_in
    same_exponential((one.excess, two.excess), (one.cycles, two.cycles), sum_.excess, sum_.cycles)


def of_engagement(a, b, both):
    assert both.slack.tendon_a_mm == pytest.approx(a.slack.tendon_a_mm + b.slack.tendon_a_mm)
    assert both.slack.tendon_b_mm == 0.0


def of_temperature(a, b, both):
    """Both plateaus shift, the hysteresis between them stays."""
    one, two, sum_ = (rig.superelastic.shift_MPa for rig in (a, b, both))
    assert sum_ == pytest.approx(one + two)
    assert both.superelastic.plateau_MPa == BARE_WITH_PLATEAU.superelastic.plateau_MPa


SUMS = {
    "backlash": of_backlash,
    "drive_gain": of_drive_gain,
    "functional_fatigue": of_fatigue,
    "gravity": of_gravity,
    "guide_friction": of_guide_friction,
    "notch_closure": of_closure,
    "position_friction": of_position_friction,
    "preload_loss": of_preload_loss,
    "preloaded_play": of_backlash,
    "run_in": of_run_in,
    "stribeck_friction": of_stribeck,
    "superelastic_plateau": None,
    "temperature": of_temperature,
    "tendon_creep": of_creep,
    "tendon_engagement": of_engagement,
    "tendon_slack": of_slack,
    "tendon_stiffening": of_stiffening,
    "tip_contact": of_tip_contact,
    "tip_load": of_tip_load,
    "unequal_tendons": of_unequal_tendons,
    "viscous_drag": of_drag,
    "wheel_eccentricity": of_eccentricity,
}


def test_every_effect_that_acts_on_a_rig_is_looked_at():
    assert set(SUMS) == {effect.name for effect in catalogue() if forms_of(effect)}


@pytest.mark.parametrize(("name", "declared", "added"), CASES)
def test_an_effect_comes_on_top_of_what_is_declared(name, declared, added):
    first, second = values_of(declared, 0), values_of(added, 1)
    start = start_rig(name)
    rig = declared.rig(start, first)
    assert rig != start
    if refused(name, declared, added):
        with pytest.raises(RigError, match="expected"):
            added.rig(rig, second)
        return
    SUMS[name](rig, added.rig(start, second), added.rig(rig, second))


@pytest.mark.parametrize(("name", "declared", "added"), CASES)
def test_an_effect_without_size_leaves_what_is_declared(name, declared, added):
    """Amounts of nothing; stiffnesses, which have a lower bound, of next to nothing."""
    if refused(name, declared, added):
        return
    amounts = {p.name for p in added.parameters if p.linear or p.name.startswith(("stiffness_N", "toe"))}
    nothing = {p.name: 1e-9 if p.log else 0.0 for p in added.parameters if p.name in amounts}
    ratios = {p.name: 1.0 for p in added.parameters if p.name.endswith("_ratio")}
    rig = declared.rig(start_rig(name), values_of(declared, 0))
    kept = added.rig(rig, {**values_of(added, 1), **nothing, **ratios})
    program = sine(1.5, 0.2, cycles=2, samples_per_cycle=48)
    before, after = (simulate_chain(one, program).angle_deg for one in (rig, kept))
    np.testing.assert_allclose(after, before, atol=1e-6)


ALONE = {
    "backlash": ("backlash", lambda v: Backlash(v["width_mm"])),
    "drive_gain": ("drive_gain", lambda v: DriveGain(v["error"])),
    "functional_fatigue": ("fatigue", lambda v: Fatigue(v["loop_loss"], v["residual_deg"], v["cycles"])),
    "notch_closure": ("closure", lambda v: Closure(v["stiffness_Nmm_per_rad"], v["angle_deg"])),
    "position_friction": ("position_friction", lambda v: PositionFriction(v["growth_per_mm"])),
    "preload_loss": ("preload_loss", lambda v: PreloadLoss(v["fraction"], v["cycles"])),
    "run_in": ("run_in", lambda v: RunIn(v["excess"], v["cycles"])),
    "stribeck_friction": ("stribeck", lambda v: Stribeck(v["rise"], v["speed_mm_per_s"])),
    "tendon_creep": ("creep", lambda v: Creep(v["fraction"], v["time_s"])),
    "tendon_slack": ("slack", lambda v: Slack(v["slack_mm"], v["slack_mm"])),
    "tip_contact": ("tip_stop", lambda v: TipStop(v["y_mm"], v["stiffness_N_per_mm"])),
    "viscous_drag": ("drag", lambda v: Drag(sheath_N_s_per_mm=v["sheath_N_s_per_mm"])),
}


@pytest.mark.parametrize("name", ALONE)
@pytest.mark.parametrize("open_notches", [False, True])
def test_on_a_rig_that_declares_nothing_an_effect_is_alone(name, open_notches):
    """To the last digit; notches that are left open declare no closure."""
    form = next(forms_of(effect)[0] for effect in catalogue() if effect.name == name)
    values, (field, expected) = values_of(form, 0), ALONE[name]
    rig = replace(BARE, closure=OPEN_NOTCHES if open_notches else None)
    assert getattr(form.rig(rig, values), field) == expected(values)


def test_a_declared_closure_without_an_angle_has_that_of_the_notch():
    (form,) = next(effect.rig_forms for effect in catalogue() if effect.name == "notch_closure")
    wrist = preset("notched-wrist-90")
    assert wrist.closure.angle_deg is None
    both = form.rig(wrist, {"angle_deg": 3.0, "stiffness_Nmm_per_rad": 1e-9}).closure  # of next to no weight
    assert both.stiffness_Nmm_per_rad == pytest.approx(wrist.closure.stiffness_Nmm_per_rad)
    assert both.angle_deg == pytest.approx(math.degrees(joint_mechanics(wrist).contact_angle_rad))
