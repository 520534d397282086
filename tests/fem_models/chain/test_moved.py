"""Runs of moved rigs along the steps of a rig: closed form, full runs, what makes a rig differ in kind."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import along
from fem_models.chain.along import line_along, moved_along, moved_run, moved_series, taped_run
from fem_models.chain.solve import chain_angle_deg, solve_chain
from fem_models.load import LoadProgram, sine
from fem_models.rig import Rig, RigError, preset
from fem_models.rig.effects import Creep, Drag, Gravity, Superelastic, TipStop
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material, Tendon, Wheel

HEATED = Superelastic(450.0, 220.0, 0.05, 1.0, compression_factor=1.2, temperature_C=30.0, heating_time_s=1.0)
FORCE = np.linspace(0.0, 4.0, 9)
STEP = 1e-4


def frictionless(stiffness: float) -> Rig:
    return Rig(
        name="frictionless", material=Material(60.0, 0.33), tendon_a=Tendon(1e4, 2.5, 150.0), tendon_b=None,
        wheel=Wheel(10.0), preload_N=0.0, friction=Friction(), joint=MeasuredJoint(6, 6.0, stiffness),
    )  # fmt: skip


def series_of(base, line, rig, load):
    moved = moved_run(base, rig, load)
    return moved_series(base, moved, moved_along(line, moved))


def test_derivatives_by_stiffness_and_load_have_their_closed_form():
    """Joints in balance, k theta = T r cos(theta/2), without friction."""
    k, r = 100.0, 2.5
    base = taped_run(frictionless(k), FORCE)
    line, theta = line_along(base), base.series.joint_angles_rad[:, 0]
    assert np.abs(k * theta - FORCE * r * np.cos(theta / 2)).max() < 1e-3 * k * theta.max()
    slope = k + FORCE * r / 2 * np.sin(theta / 2)
    softer = series_of(base, line, frictionless(k * (1 + STEP)), FORCE).angle_deg - base.series.angle_deg
    more = series_of(base, line, frictionless(k), FORCE * (1 + STEP)).angle_deg - base.series.angle_deg
    by_stiffness, by_load = -k * theta / slope, FORCE * r * np.cos(theta / 2) / slope
    for found, expected in ((softer, by_stiffness), (more, by_load)):
        assert found / STEP == pytest.approx(6 * np.degrees(expected), rel=1e-3, abs=1e-6)


@pytest.mark.parametrize(
    "parts",
    [
        {},
        {"drag": Drag(0.5, 2.0)},
        {"creep": Creep(0.3, 5.0)},
        {"gravity": Gravity(2.0, 90.0), "tip_stop": TipStop(6.0, 2.0)},
        {"joint": MeasuredJoint(14, 2.6, 520.0, hardening_slope=0.8, hardening_limit=1.5, hardening_angle_deg=2.0)},
        {"superelastic": Superelastic(450.0, 220.0, 0.05, 1.0)},
        {"superelastic": HEATED},
    ],
    ids=["plain", "drag", "creep", "gravity and tip stop", "flexures that harden", "superelastic", "heated"],
)
def test_moved_rigs_follow_their_own_runs(parts):
    rig, program = replace(preset("du2018", preload_N=10.0), **parts), sine(2.0, 0.1, cycles=1, samples_per_cycle=60)
    base = taped_run(rig, program)
    line, run = line_along(base), solve_chain(rig, program)
    assert base.series.angle_deg == pytest.approx(run.record.angle_deg, abs=1e-12)
    for share in ("sheath_N", "capstan_coefficient"):
        step = STEP * getattr(rig.friction, share)
        ahead, behind = (
            replace(rig, friction=replace(rig.friction, **{share: getattr(rig.friction, share) + way * step}))
            for way in (1, -1)
        )
        central = (chain_angle_deg(ahead, program) - chain_angle_deg(behind, program)) / 2
        found = series_of(base, line, ahead, program)
        assert np.linalg.norm(found.angle_deg - base.series.angle_deg - central) < 0.02 * np.linalg.norm(central)
        tension = solve_chain(ahead, program).record.tension_a_N - solve_chain(behind, program).record.tension_a_N
        of_tension = found.tension_a_N - base.series.tension_a_N
        assert np.linalg.norm(of_tension - tension / 2) < 0.02 * np.linalg.norm(tension / 2)


SYMMETRIC = Superelastic(450.0, 220.0, 0.05, 1.0)


@pytest.mark.parametrize(
    ("law", "name"),
    [
        *((SYMMETRIC, name) for name in ("plateau_MPa", "unloading_plateau_MPa", "plateau_modulus_GPa")),
        *(
            (HEATED, name)
            for name in ("compression_factor", "temperature_C", "heating_time_s", "latent_heat_J_per_g", "plateau_MPa")
        ),
    ],
)
def test_a_moved_law_of_the_section_is_followed(law, name):
    """Derivatives by the law of the section itself, and of the tip that it shortens."""
    program = sine(2.0, 0.1, cycles=1, samples_per_cycle=60)
    rig = replace(preset("du2018", preload_N=20.0), material=Material(60.0, 0.33), superelastic=law)
    base = taped_run(rig, program)
    step = 0.02 * STEP * getattr(law, name)  # small: fibres reach plateaus one by one
    ahead, behind = (
        replace(rig, superelastic=replace(law, **{name: getattr(law, name) + way * step})) for way in (1, -1)
    )
    found = series_of(base, line_along(base), ahead, program)
    runs = [taped_run(other, program).series for other in (ahead, behind)]
    for quantity in ("angle_deg", "tip_mm"):
        central = (getattr(runs[0], quantity) - getattr(runs[1], quantity)) / 2
        moved = getattr(found, quantity) - getattr(base.series, quantity)
        assert np.linalg.norm(moved - central) < 0.03 * np.linalg.norm(central)


def test_a_rig_of_another_kind_is_run_by_itself(monkeypatch):
    rig, program = preset("du2018"), sine(1.0, 0.1, cycles=1, samples_per_cycle=20)
    base = taped_run(rig, program)
    line, calls = line_along(base), []
    monkeypatch.setattr(along, "followed", lambda *a: calls.append(a) or (_ for _ in ()).throw(RigError("by itself")))
    assert series_of(base, line, rig, program) is base.series
    others = [
        replace(rig, material=replace(rig.material, loop_share=0.0)),
        replace(rig, friction=Friction()),
        replace(rig, tip_stop=TipStop(30.0, 1.0)),
    ]
    for other in others:
        with pytest.raises(RigError, match="by itself"):
            series_of(base, line, other, program)
    for drive in (program.drive_mm[:-1], 3 * program.drive_mm):  # of another length, and far off
        with pytest.raises(RigError, match="by itself"):
            series_of(base, line, rig, LoadProgram(drive))
    assert len(calls) == 5
