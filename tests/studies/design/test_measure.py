"""Quantities of a tube, against closed forms and against the loads themselves."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fem_models.analytic.frictionless_chain import tendon_for_angle_N
from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_row
from fem_models.joint.strain_life import StrainLife
from fem_models.load import LoadProgram
from fem_models.multibody import solve_multibody
from fem_models.rig.effects import Closure, Superelastic, TipLoad
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.rig import Friction, Material, Rig, Tendon, Wheel
from studies.design.measure import SolverBender, Use, Wire, measure
from studies.design.quantities import QUANTITIES

ELASTIC = Rig(
    name="slots",
    joint=NotchedTube(Tube(1.16, 0.86), Notch("rectangular", 5, 0.9, 0.508, 0.51)),
    material=Material(60.0, 0.33),
    tendon_a=Tendon(1600.0, 0.38, 100.0),
    tendon_b=None,
    wheel=Wheel(10.0),
    preload_N=0.0,
    closure=Closure(1000.0),
)
NITINOL = replace(
    ELASTIC, superelastic=Superelastic(plateau_modulus_GPa=0.87), friction=Friction(capstan_coefficient=0.2)
)
WIRE = Wire(0.1, 20.0)
ALL = frozenset(QUANTITIES)


def use(bend, tension=math.inf, drive=math.inf, wanted=frozenset(), life=None):
    return Use(bend, tension, drive, frozenset(wanted), life)


def test_tension_of_an_elastic_tube_is_that_of_the_closed_form():
    """Without friction every joint balances the tendon by itself; superposed shear and shortening matter little."""
    found = measure(ELASTIC, WIRE, use(30.0))
    expected = tendon_for_angle_N(ELASTIC, joint_row(ELASTIC).first.flexure, math.radians(30.0))
    assert found.tension_N == pytest.approx(expected, rel=0.02)


def test_dimensions_follow_from_the_drawing():
    found = measure(ELASTIC, WIRE, use(60.0))
    assert found.length_mm == pytest.approx(5 * (0.508 + 0.51))
    assert found.bending_radius_mm == pytest.approx(5 * 1.018 / math.radians(60.0))
    assert found.outer_diameter_mm == 1.16
    assert found.free_lumen_mm == pytest.approx(0.86 - 0.1)


def test_first_notch_closes_where_all_do_without_friction():
    """Equal joints bend equally: N w/(R + offset)."""
    joint = joint_row(ELASTIC).first
    found = measure(ELASTIC, WIRE, use(60.0))
    assert found.closing_bend_deg == pytest.approx(math.degrees(5 * joint.closure_angle_rad), rel=5e-3)


def test_tip_stays_where_a_circle_ends():
    """Short notches in a row: the tip of an arc of this length, within the polygon's error of 1/N^2."""
    bend, found = math.radians(60.0), measure(ELASTIC, WIRE, use(60.0))
    assert found.reach_mm == pytest.approx(found.length_mm * (1 - math.cos(bend)) / bend, rel=0.05)


def test_limits_of_tension_and_drive_end_the_bend():
    free = measure(NITINOL, WIRE, use(60.0))
    assert measure(NITINOL, WIRE, use(60.0, tension=free.tension_N)).bend_deg == pytest.approx(60.0, abs=0.2)
    assert measure(NITINOL, WIRE, use(60.0, drive=free.drive_mm)).bend_deg == pytest.approx(60.0, abs=0.2)
    short = measure(NITINOL, WIRE, use(60.0, tension=0.5 * free.tension_N))
    assert short.bend_deg < 60
    assert math.isnan(short.tension_N)


def test_strain_and_loop_are_those_of_the_chain():
    found = measure(NITINOL, WIRE, use(60.0, wanted=ALL))
    run = solve_chain(NITINOL, LoadProgram(np.linspace(0, found.drive_mm, 100)))
    assert run.record.angle_deg[-1] == pytest.approx(60.0, abs=0.05)
    assert found.peak_strain_percent == pytest.approx(100 * np.abs(run.peak_strain).max(), rel=1e-3)
    assert found.alternating_strain_percent == pytest.approx(found.peak_strain_percent / 2, rel=0.01)
    assert found.loop_width_deg > 0.5
    assert measure(ELASTIC, WIRE, use(30.0, wanted=ALL)).loop_width_deg == pytest.approx(0.0, abs=1e-6)


def test_tip_force_takes_the_tension_to_its_limit():
    """Load the tip with it: the tension at the bend is then the largest allowed, but for what is not linear."""
    limit = 1.1 * measure(NITINOL, WIRE, use(60.0)).tension_N
    found = measure(NITINOL, WIRE, use(60.0, tension=limit, wanted=["tip_force_N"]))
    loaded = replace(NITINOL, tip_load=TipLoad(found.tip_force_N, 60.0 - 90.0))
    assert measure(loaded, WIRE, use(60.0)).tension_N == pytest.approx(limit, rel=0.02)


def test_own_metal_and_no_metal():
    life = StrainLife(0.01, 1e4, 0.5, 0.0)
    found = measure(ELASTIC, WIRE, use(30.0, wanted=["cycles"], life=life))
    assert found.cycles == pytest.approx(1e4 * (1.0 / found.alternating_strain_percent) ** 2)
    assert math.isnan(measure(ELASTIC, WIRE, use(30.0, wanted=["cycles"])).cycles)


@pytest.mark.slow
def test_multibody_model_gives_the_same_quantities():
    chain = measure(NITINOL, WIRE, use(60.0, tension=8.0, wanted=ALL))
    bodies = measure(NITINOL, WIRE, use(60.0, tension=8.0, wanted=ALL), lambda rig: SolverBender(rig, solve_multibody))
    for name in QUANTITIES:
        assert bodies.of(name) == pytest.approx(chain.of(name), rel=0.02), name


CLOSED = replace(
    NITINOL,
    joint=NotchedTube(Tube(1.26, 1.1), Notch("rectangular", 5, 1.16, 0.39, 0.155)),
    material=Material(62.9, 0.33),
    tendon_a=Tendon(14000.0, 0.4, 100.0),
    friction=Friction(capstan_coefficient=0.3),
)
"""A tube whose notches close at the bend of 90 deg."""


def test_a_tip_force_is_held_where_notches_are_closed():
    """By the moment about the first notch: the tension allowed at the largest lever over the reach of the tip."""
    found = measure(CLOSED, WIRE, use(90.0, tension=4.0, wanted=ALL))
    lever = 0.4 + 1.26 / 2
    assert 0.3 < found.tip_force_N < 4.0 * lever / found.reach_mm

    def bend_deg(force_N):
        loaded = replace(CLOSED, tip_load=TipLoad(force_N, 0.0))
        run = solve_chain(loaded, LoadProgram(np.linspace(0.0, 1.6 * found.drive_mm, 240)))
        return np.interp(4.0, np.maximum.accumulate(run.record.tension_a_N), run.record.angle_deg)

    assert bend_deg(0.95 * found.tip_force_N) > 90.0 > bend_deg(1.05 * found.tip_force_N)


def test_the_largest_strain_is_that_of_the_worst_fibre_at_the_required_bend():
    """Half the range of a cycle from rest is half of it; further pulling strains the other side of the flexure more."""
    found = measure(CLOSED, WIRE, use(90.0, tension=4.0, wanted=ALL))
    joint = joint_row(CLOSED).first
    expected = max(joint.outer_fibres_per_rad) * math.radians(found.notch_angle_deg)
    assert found.peak_strain_percent == pytest.approx(100 * expected, rel=0.03)  # but for the thrust
    assert found.peak_strain_percent == pytest.approx(2 * found.alternating_strain_percent, rel=0.02)


def test_a_solid_wire_is_strained_by_its_radius_over_that_of_its_path():
    found = measure(ELASTIC, WIRE, use(60.0))
    path = (found.length_mm - found.drive_mm) / math.radians(60.0)
    assert found.tendon_strain_percent == pytest.approx(100 * 0.05 / path)
