"""Superelastic solid: exact where the flag is, free of stress under rotation, consistent, and in energy balance."""

import math
import shutil
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from calculix import calculix_forces
from scipy.optimize import brentq
from skfem import MeshTet1, MeshTet2

from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import beam, flexure
from fem_models.joint.superelastic import FlagFibres, flag_moment, in_series
from fem_models.joint.superelastic_section import section_path
from fem_models.rig import preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Superelastic
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.rig import Material
from fem_models.solid.large_bending import MomentAngle, bend, measured, moment_angle, quarter_joint, whole
from fem_models.solid.linear import cells, chain_stiffness, solid_snr
from fem_models.solid.superelastic import (
    HARDENING_SHARE,
    dissipated,
    flag_law,
    flag_solid,
    newton,
    nodal_strain,
    straight,
    unknowns,
)
from fem_models.solid.superelastic_elements import fibres_of_curve, flag_path
from fem_models.solid.superelastic_kernel import Elements, Law, Numbering, Step, assemble, stress
from fem_models.view.solid import bent_mesh

LAW = Superelastic(450.0, 200.0, 0.04)
RIG = replace(preset("du2018"), superelastic=LAW)
ELASTIC = preset("du2018")
YOUNG, POISSON = 60e3, 0.33
TENDON = replace(RIG.tendon_a, moment_arm_mm=0.6)
WRIST = replace(
    RIG,
    joint=NotchedTube(Tube(1.62, 1.40), Notch("rectangular", 5, depth_mm=1.40, width_mm=0.8, spacing_mm=1.2)),
    tendon_a=TENDON,
    tendon_b=TENDON,
)


def box(n: int, law: Law, *, distorted: bool = False):
    """Unit cube; distorted: inner corners moved. Edges stay straight: four points are exact for such elements."""
    side = np.linspace(0, 1, n + 1)
    flat = MeshTet1.init_tensor(side, side, side)
    if distorted:
        corners = flat.p.copy()
        inner = np.all((corners > 0.01) & (corners < 0.99), axis=0)
        corners[:, inner] += np.random.default_rng(3).uniform(-0.2, 0.2, (3, inner.sum())) / n
        flat = MeshTet1(corners, flat.t)
    mesh = MeshTet2.from_mesh(flat)
    return flag_solid(np.ascontiguousarray(mesh.doflocs.T), cells(mesh), law)


def tangent_and_force(solid, displacement, rest):
    """Dense stiffness and forces with nothing prescribed."""
    n = len(solid.points_mm)
    sought = unknowns(solid, np.arange(3 * n).reshape(n, 3))
    frames, none = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
    data, load, _, _ = assemble(
        Elements(solid.gradients, solid.volumes, solid.cells),
        solid.law,
        Step(displacement, rest, none),
        Numbering(frames, sought.numbers, sought.places, len(sought.indices), sought.count),
    )
    dense = np.zeros((3 * n, 3 * n))
    rows = np.repeat(np.arange(3 * n), np.diff(sought.pointers))
    dense[rows, sought.indices] = data
    return dense, -load


@pytest.fixture(scope="module")
def joint():
    return quarter_joint(RIG, refinement=0.4, fillet_mm=0.125)


@pytest.fixture(scope="module")
def loop(joint):
    """The default ring bent to 8 deg and back, in steps of 0.5 deg."""
    degrees = np.append(np.arange(0.5, 8.1, 0.5), np.arange(7.5, -0.1, -0.5))
    path = list(bend(joint, np.radians(degrees)))
    return path, measured(joint, path)


def test_bar_follows_the_flag_exactly():
    """A cube loaded in tension and unloaded: plateaus, strain of the transformation, and dissipation in closed form."""
    law = flag_law(RIG, hardening=0.002)
    solid = box(1, law)
    points = solid.points_mm
    fixed = points < 1e-9  # three faces of symmetry
    top = points[:, 2] > 1 - 1e-9
    fixed[top, 2] = True
    numbers = np.full(fixed.shape, -1)
    numbers[~fixed] = np.arange((~fixed).sum())
    sought, frames = unknowns(solid, numbers), np.tile(np.eye(3), (len(points), 1, 1))
    state, loss, length = straight(solid), 0.0, 1.0
    seen = []
    strains = np.append(np.linspace(0, 0.06, 25)[1:], np.linspace(0.06, 0, 25)[1:])
    for strain in strains:  # of Bazant: sinh(2 e)/2
        stretch = math.exp(math.asinh(2 * strain) / 2)
        lift = np.zeros_like(points)
        lift[top, 2] = stretch - length
        new = newton(solid, sought, state, lift, frames)
        loss += dissipated(solid, state, new)
        state, length = new, stretch
        force = state.force_N[top, 2].sum()
        seen.append(force * stretch / math.cosh(math.asinh(2 * strain)))  # the stress that is conjugate to the strain
    slope = 0.002 * YOUNG / 0.998
    stresses, rest = [], 0.0
    for strain in strains:
        up, down = ((YOUNG * strain - s) / (YOUNG + slope) for s in (law.upper, law.lower))
        rest = min(max(rest, up, 0.0), max(down, 0.0), 0.04)
        stresses.append(YOUNG * (strain - rest))
    assert seen == pytest.approx(stresses, abs=1e-6)
    assert law.upper + 0.02 * slope == pytest.approx(450)  # the plateau of the rig is that of its middle
    assert max(state.transformation.ravel()) == 0
    assert loss == pytest.approx(0.04 * (450 - 200), rel=1e-9)


def test_law_is_symmetric_and_has_its_derivative():
    law = flag_law(RIG)
    rng = np.random.default_rng(1)
    for rest in (0.0, 0.01, 0.04):
        for size in (0.003, 0.02, 0.06):
            strain = rng.normal(size=6) * size
            out, tangent, other = np.empty(6), np.empty((6, 6)), np.empty((6, 6))
            stress(strain, rest, law, out, tangent)
            ends = []
            for step in 1e-7 * np.vstack([np.eye(6), -np.eye(6)]):
                ends.append(np.empty(6))
                stress(strain + step, rest, law, ends[-1], other)
            numeric = (np.array(ends[:6]) - np.array(ends[6:])).T / 2e-7
            assert numeric == pytest.approx(tangent, abs=2e-5 * law.shear)
            back = np.empty(6)
            stress(-strain, rest, law, back, other)
            assert back == pytest.approx(-out)


def test_rotated_metal_has_no_stress_and_keeps_its_stiffness():
    """A finite rotation gives forces of rounding; the tangent rotates with the metal."""
    solid = box(1, flag_law(RIG), distorted=True)
    rotation = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    rotated = solid.points_mm @ (rotation - np.eye(3)).T
    still, _ = tangent_and_force(solid, np.zeros_like(rotated), np.zeros_like(solid.volumes))
    moved, force = tangent_and_force(solid, rotated, np.zeros_like(solid.volumes))
    assert np.abs(force).max() < 1e-9 * YOUNG
    big = np.kron(np.eye(len(rotated)), rotation)
    assert moved == pytest.approx(big @ still @ big.T, abs=1e-9 * YOUNG)


def test_patch_under_large_rotation_and_strain_is_uniform():
    """Boundary moved by rotation times stretch of 6 %, beyond the plateau: inner nodes follow exactly."""
    solid = box(2, flag_law(RIG), distorted=True)
    points = solid.points_mm
    angle, stretch = 0.9, np.diag([1.06, 0.975, 0.968]) + 0.01 * np.eye(3)[[1, 0, 2]] * (1 - np.eye(3))
    rotation = np.array([[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]])
    exact = points @ (rotation @ stretch - np.eye(3)).T
    outer = np.any((points < 1e-9) | (points > 1 - 1e-9), axis=1)
    numbers = np.full(points.shape, -1)
    numbers[~outer] = np.arange(3 * (~outer).sum()).reshape(-1, 3)
    start = replace(straight(solid), displacement_mm=np.where(outer[:, None], exact, 0.98 * exact))
    found = newton(
        solid, unknowns(solid, numbers), start, np.zeros_like(points), np.tile(np.eye(3), (len(points), 1, 1))
    )
    assert found.displacement_mm == pytest.approx(exact, abs=1e-10)
    principal, equivalent = nodal_strain(solid, found)
    logarithmic = np.log(np.linalg.eigvalsh(stretch))
    assert principal == pytest.approx(logarithmic[np.abs(logarithmic).argmax()], rel=1e-6)
    assert np.ptp(equivalent) < 1e-9
    assert found.transformation.max() == 0.04


def test_tangent_is_the_derivative_of_the_forces():
    """Central differences, with metal in every branch of the flag and a large rotation."""
    solid = box(1, flag_law(RIG), distorted=True)
    rng = np.random.default_rng(5)
    angle = 0.7
    rotation = np.array([[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]])
    place = solid.points_mm @ (rotation @ np.diag([1.03, 0.99, 0.98]) - np.eye(3)).T
    place += 0.01 * rng.normal(size=place.shape)
    rest = rng.uniform(0, 0.04, solid.volumes.shape)
    tangent, _ = tangent_and_force(solid, place, rest)
    assert tangent == pytest.approx(tangent.T, abs=1e-9 * np.abs(tangent).max())
    for _ in range(3):
        direction = rng.normal(size=place.shape)
        ends = [tangent_and_force(solid, place + sign * 1e-7 * direction, rest)[1] for sign in (1, -1)]
        numeric = (ends[0] - ends[1]) / 2e-7
        assert numeric == pytest.approx(tangent @ direction.ravel(), abs=1e-5 * np.abs(numeric).max())


def test_newton_converges_quadratically(loop):
    """Below 1e-4 no point changes its branch: a residual is below 100 times the square of the last, to rounding."""
    path, _ = loop
    for bent in path:
        near = [r for r in bent.state.residuals if r < 1e-4]
        for one, two in pairwise(near):
            assert two < max(100 * one**2, 1e-9)
    assert max(len(bent.state.residuals) for bent in path) <= 8


@pytest.mark.parametrize("rig", [RIG, WRIST], ids=["v pair", "one-sided"])
def test_slope_at_rest_is_the_linear_chain(rig):
    """Same mesh; four points instead of eleven on curved elements are the difference."""
    linear = np.linalg.inv(chain_stiffness(solid_snr(rig, refinement=0.5)).stiffness)
    bent = next(bend(quarter_joint(rig, refinement=0.5), [1e-5]))
    assert bent.moment_Nmm / 1e-5 == pytest.approx(1 / linear[2, 2], rel=5e-4)
    assert bent.neutral_offset_mm == pytest.approx(-linear[0, 2] / linear[2, 2], abs=1e-3)


def test_closed_loop_dissipates_its_work(loop, joint):
    """Work of the moment over the loop against int (upper - lower) dg in the metal; the trapezium rule is the error."""
    path, curve = loop
    angle, moment = (np.append(0.0, a) for a in (curve.angle_rad, curve.moment_Nmm))
    work = float(np.trapezoid(moment, angle))
    states = [straight(joint.solid), *(bent.state for bent in path)]
    loss = 4 * sum(dissipated(joint.solid, a, b) for a, b in pairwise(states))
    assert loss == pytest.approx(work, rel=0.01)
    assert curve.moment_Nmm[-1] == pytest.approx(0, abs=1e-6)
    assert curve.transformed[-1] == 0


def test_curve_is_a_flag(loop):
    _, curve = loop
    up, down = curve.moment_Nmm[:15], curve.moment_Nmm[16:31][::-1]
    assert (np.diff(up) > 0).all()
    assert (up > down - 1e-6).all()
    assert up[7] > 1.9 * down[7]  # 4 deg: 450 over 200 MPa, elastic metal near the neutral axis
    assert (np.diff(curve.principal_strain[:16]) > 0).all()
    assert 0.03 < curve.equivalent_strain[15] < 0.08
    assert 0 < curve.transformed[15] < 0.2


@pytest.mark.parametrize("thrust", [20.0, 40.0])
def test_section_under_thrust_is_that_of_the_solid_in_the_working_range(thrust):
    """du2018 at 10 and 20 N of preload, beyond the 3.2 deg of a joint that 45 deg of the tip take."""
    law = replace(LAW, plateau_modulus_GPa=1e-3 * HARDENING_SHARE * YOUNG)
    rig = replace(RIG, superelastic=law, material=Material(60.0, POISSON))
    pressed = quarter_joint(rig, refinement=0.4, fillet_mm=0.125, thrust_N=thrust)
    angles = np.radians([1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0, 2.0, 1.0])
    path = list(bend(pressed, angles, step_rad=np.radians(1.0)))
    solid = np.array([bent.moment_Nmm for bent in path])
    section = section_path(joint_mechanics(rig).section, angles, thrust).moment_Nmm
    assert np.abs(section - solid).max() < 0.06 * solid.max()  # of the elastic slope on this coarse mesh
    free = section_path(joint_mechanics(rig).section, angles, 0.0).moment_Nmm
    back = slice(5, None)  # the thrust shows most on the way back
    assert np.linalg.norm((section - solid)[back]) < 0.5 * np.linalg.norm((free - solid)[back])
    ends = pressed.end
    assert path[4].state.force_N[ends, 2].sum() == pytest.approx(-thrust / 2, rel=1e-6)


def fit_error(curve: MomentAngle, fibres: FlagFibres) -> float:
    """Largest difference of the moment of fibres to a curve, of the largest moment of the curve."""
    moment = flag_path(fibres, curve.angle_rad).sum(axis=1)
    return float(np.abs(moment - curve.moment_Nmm).max() / np.abs(curve.moment_Nmm).max())


def test_fit_gives_the_engines_the_curve(loop):
    _, curve = loop
    fibres = fibres_of_curve(curve)
    assert fit_error(curve, fibres) < 0.03
    assert len(fibres.stiffness) < 25
    assert (fibres.stiffness > 0).all()
    assert (fibres.lower_Nmm <= fibres.upper_Nmm).all()
    slope = curve.moment_Nmm[0] / curve.angle_rad[0]
    assert fibres.stiffness.sum() == pytest.approx(slope, rel=0.05)


def fibres_between_rigid_rings(rig) -> FlagFibres:
    """Fibres of a pair of notches without thrust, as elements in the angle."""
    section, law = joint_mechanics(rig).section, rig.superelastic
    y, area, length = np.abs(section.height_mm), section.area_mm2, section.length_mm
    area = area / (1 - rig.material.loop_share)  # all of the metal
    k = YOUNG * y**2 * area / length
    upper, lower = (k * stress / YOUNG * length / y for stress in (law.plateau_MPa, law.unloading_plateau_MPa))
    slope = k * law.plateau_modulus_GPa * 1e3 / YOUNG
    return FlagFibres(k, upper, lower, law.transformation_strain * length / y, slope)


def test_fit_finds_elements_that_made_the_curve():
    """Fibres of the section itself, elements of the family that is fitted: 1.5 % of the largest moment everywhere."""
    degrees = np.append(np.linspace(0, 20, 41)[1:], np.linspace(20, 0, 41)[1:])
    fibres = fibres_between_rigid_rings(RIG)
    moment = flag_path(fibres, np.radians(degrees)).sum(axis=1)
    none = np.zeros_like(moment)
    curve = MomentAngle(RIG, np.radians(degrees), moment, none, none, none, none)
    assert fit_error(curve, fibres_of_curve(curve)) < 0.015
    with pytest.raises(ValueError, match="8 that bend"):
        fibres_of_curve(replace(curve, angle_rad=none[:3], moment_Nmm=none[:3]))


def in_series_with(fibres, root_Nmm_per_rad, angles_rad):
    """Moments of fibres and a spring, in series: their equilibrium, solved at every angle of both."""
    rest, out = np.zeros_like(fibres.stiffness), []
    for angle in angles_rad:

        def beyond(bend, angle=angle, rest=rest):
            return bend + flag_moment(np.full_like(rest, bend), rest, fibres).sum() / root_Nmm_per_rad - angle

        bend = brentq(beyond, -1.0, 1.0, xtol=1e-14, rtol=1e-14)
        moment = flag_moment(np.full_like(rest, bend), rest, fibres)
        rest = bend - moment / fibres.stiffness
        out.append(moment.sum())
    return np.array(out)


@pytest.mark.parametrize(
    "law",
    [
        LAW,
        Superelastic(180.0, 76.0, 0.04, 0.0),
        Superelastic(450.0, 100.0, 0.03, 1.0),
        Superelastic(400.0, 200.0, 0.06),
    ],
)
def test_fibres_and_roots_as_one_are_the_two_in_series(law):
    rig = replace(RIG, superelastic=law)
    root = 1 / (1 / flexure(rig).bending_Nmm_per_rad - 1 / beam(rig).bending_Nmm_per_rad)
    fibres, section = fibres_between_rigid_rings(rig), joint_mechanics(rig).section
    as_one = in_series(fibres, root)
    k, slope = as_one.stiffness, as_one.slope
    through = np.degrees(((1 - slope / k) * as_one.upper_Nmm + k * as_one.span_rad) / (k - slope)).min()
    assert through < 14
    up = np.linspace(0, 14, 141)
    for back in (np.linspace(14, -14, 281), np.concatenate([np.linspace(14, 5, 91), np.linspace(5, 11, 61)])):
        path = np.radians(np.concatenate([up, back]))
        expected = in_series_with(fibres, root, path)
        share = section_path(section, path, 0.0).moment_Nmm / (1 - rig.material.loop_share)
        np.testing.assert_allclose(share, expected, atol=1e-9 * expected.max())  # the section of the engines is exact
        error = np.abs(flag_path(as_one, path).sum(axis=1) - expected) / expected.max()
        assert error[: up.size].max() < 1e-9
        assert error.max() < 0.02
    shallow = np.radians(np.concatenate([np.linspace(0, 0.8 * through, 81), np.linspace(0.8 * through, 0, 81)]))
    exact = in_series_with(fibres, root, shallow)  # and back: none was through
    np.testing.assert_allclose(flag_path(as_one, shallow).sum(axis=1), exact, atol=1e-9 * exact.max())


def test_moment_angle_of_an_elastic_rig_and_of_no_convergence(monkeypatch):
    curve = moment_angle(ELASTIC, np.radians([1.0, 2.0]), refinement=0.4)
    assert curve.moment_Nmm[1] == pytest.approx(2 * curve.moment_Nmm[0], rel=2e-3)
    assert (curve.transformed == 0).all()
    monkeypatch.setattr("fem_models.solid.superelastic._ITERATIONS", 2)
    with pytest.raises(SolverError, match=r"joint at 0.00 deg: Newton"):
        moment_angle(ELASTIC, [0.2], refinement=0.4)


def test_whole_ring_is_the_quarter_mirrored(joint):
    mesh = solid_snr(RIG, refinement=0.4, fillet_mm=0.125).mesh
    bent = next(bend(joint, [0.02]))
    field, principal, _ = whole(joint, bent.state, mesh.doflocs.T)
    top = mesh.doflocs[2] > mesh.doflocs[2].max() - 1e-9
    normal = np.array([math.sin(0.01), 0, math.cos(0.01)])
    assert np.ptp((mesh.doflocs.T + field)[top] @ normal) < 1e-9
    assert field.sum(axis=0)[1] == pytest.approx(0, abs=1e-9)
    assert np.abs(principal).max() == pytest.approx(measured(joint, [bent]).principal_strain[0])
    shown = bent_mesh(joint, bent, mesh)
    assert shown.point_data["displacement_mm"] == pytest.approx(field)
    assert shown.point_data["principal_strain_percent"] == pytest.approx(100 * principal)
    with pytest.raises(ValueError, match="expected those of its whole mesh"):
        whole(joint, bent.state, mesh.doflocs.T + 0.1)


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed: apt-get install calculix-ccx")
@pytest.mark.parametrize(("rig", "degrees"), [(ELASTIC, 8.0), (RIG, 8.0)], ids=["elastic", "plateau"])
def test_moment_is_that_of_calculix(rig, degrees):
    """Same quarter, nodes of its planes of symmetry moved alike; on loading the plateau is von Mises plasticity."""
    joint = quarter_joint(rig, refinement=0.5, fillet_mm=0.125)
    bent = list(bend(joint, np.radians(np.linspace(0, degrees, 5)[1:])))[-1]
    solid, law = joint.solid, joint.solid.law
    prescribed = np.where(joint.unknowns.numbers < 0, 0.0, math.nan)
    prescribed[joint.end] = bent.state.displacement_mm[joint.end]
    rows = ()
    if rig.superelastic is not None:
        ends = [(law.upper + law.hardening * strain, strain) for strain in (0.0, 0.04)]
        rows = (*ends, (6000.0, 0.049))  # then hardly any more: ten times as stiff as the metal
    forces = calculix_forces(solid.points_mm, solid.cells, YOUNG, POISSON, prescribed, plateau_MPa=rows)
    nodes = np.flatnonzero(np.isfinite(prescribed).any(axis=1))
    place, theirs = np.zeros_like(solid.points_mm), np.zeros_like(solid.points_mm)
    theirs[nodes] = forces
    place[joint.end] = (solid.points_mm + bent.state.displacement_mm)[joint.end]
    moment = 2 * (place[:, 2] * theirs[:, 0] - place[:, 0] * theirs[:, 2]).sum()
    assert moment == pytest.approx(bent.moment_Nmm, rel=0.005)
