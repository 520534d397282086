"""Superelastic section under thrust against fibres that are integrated and balanced in another way, in both engines."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_models.chain.solve import solve_chain, solve_chain_by_force
from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import beam
from fem_models.joint.section import cut_height_mm
from fem_models.joint.superelastic_section import elongation_under_mm, section_path
from fem_models.load import LoadProgram
from fem_models.multibody.quasi_static import solve_multibody, solve_multibody_by_force
from fem_models.rig import Rig, preset
from fem_models.rig.effects import Superelastic
from fem_models.rig.rig import Friction, Material, with_notch

FLAT = Superelastic(450.0, 220.0, transformation_strain=0.05)
SLOPED = Superelastic(450.0, 200.0, transformation_strain=0.03, plateau_modulus_GPa=1.5)
PRESSED = replace(SLOPED, compression_factor=1.44, temperature_C=32.0)
HEATED = replace(PRESSED, heating_time_s=2.0)
PAIR = replace(preset("du2018"), material=Material(60.0, 0.33), superelastic=FLAT)
WRIST = replace(
    preset("notched-wrist-150"), precurvature_deg=0.0, superelastic=SLOPED, closure=None, friction=Friction()
)


def strips(rig: Rig, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Heights above the neutral axis, away from tendon a, and areas of strips of the tube below its cut."""
    outer, inner = rig.joint.tube.outer_diameter_mm / 2, rig.joint.tube.inner_diameter_mm / 2
    cut = float(cut_height_mm(rig.joint, 0.0))
    edges = np.linspace(-outer if rig.joint.one_sided else -cut, cut, 50 * count + 1)
    y = 0.5 * (edges[1:] + edges[:-1])
    width = 2 * np.sqrt(outer**2 - y**2) - 2 * np.sqrt(np.maximum(inner**2 - y**2, 0.0))
    area, first = (width * np.diff(edges) * y**k for k in (0, 1))
    area, first = (part.reshape(count, 50).sum(axis=1) for part in (area, first))
    return first.sum() / area.sum() - first / area, area


class Fibres:
    """Strips with a transformation strain each: the axial strain is found between bounds, for each curvature.

    So is the temperature, around that.
    """

    def __init__(self, rig: Rig, count: int = 2000) -> None:
        self.height, self.area = strips(rig, count)
        self.young, self.law = 1e3 * rig.material.youngs_modulus_GPa, rig.superelastic
        self.length = self.young * (self.area @ self.height**2) / beam(rig).bending_Nmm_per_rad
        self.grown, self.stress, self.loss = np.zeros(count), np.zeros(count), 0.0
        self.warmer = 0.0

    def transformed(self, strain: np.ndarray, warmer: float) -> np.ndarray:
        """Transformation strains that agree with strains: what yields grows, what is released shrinks."""
        law = self.law
        share = 1 - 1e3 * law.plateau_modulus_GPa / self.young
        side = np.where(strain < 0, law.compression_factor, 1.0)
        by_heat = law.clausius_clapeyron_MPa_per_K * (law.temperature_C + warmer - law.reference_C)
        at_least, at_most = (
            share * np.maximum(np.abs(strain) - (side * stress + by_heat) / self.young, 0.0)
            for stress in (law.plateau_MPa, law.unloading_plateau_MPa)
        )
        kept = np.where(self.grown * strain > 0, np.abs(self.grown), 0.0)
        grown = np.minimum(np.minimum(np.maximum(kept, at_least), at_most), self.law.transformation_strain)
        return np.sign(strain) * grown

    def bend(self, phi: float, thrust: float, time_s: float = 0.0) -> float:
        """Moment at a bending of the section, Nmm, after a step of a length in time."""
        warmer = 0.0
        if self.law.heating_time_s is not None and time_s > 0:
            part = time_s / self.law.heating_time_s  # the heat comes evenly over the step
            left, gained = self.warmer * np.exp(-part), (1 - np.exp(-part)) / part

            def too_warm(warmer: float) -> float:
                _, grown = self.balanced(phi, thrust, warmer)
                share = self.area @ (np.abs(grown) - np.abs(self.grown)) / self.law.transformation_strain
                return warmer - left - gained * share / self.area.sum() * self.law.complete_heating_K

            warmer = brentq(too_warm, -60.0, 60.0, xtol=1e-9)
        found, grown = self.balanced(phi, thrust, warmer)
        self.loss += self.length * (self.area * 0.5 * (self.stress + found)) @ (grown - self.grown)
        self.grown, self.stress, self.warmer = grown, found, warmer
        return float(self.area * found @ self.height)

    def balanced(self, phi: float, thrust: float, warmer: float) -> tuple[np.ndarray, np.ndarray]:
        """Stresses and transformation strains under a thrust at a temperature."""

        def stress(mean: float) -> np.ndarray:
            strain = mean + self.height * phi / self.length
            return self.young * (strain - self.transformed(strain, warmer))

        mean = brentq(lambda mean: self.area @ stress(mean) + thrust, -0.2, 0.2, xtol=1e-15)
        return stress(mean), self.transformed(mean + self.height * phi / self.length, warmer)


def cycle(largest: float, steps: int) -> np.ndarray:
    up = largest * np.arange(steps + 1) / steps
    return np.concatenate([up, up[-2::-1], -up[1:], -up[-2::-1], up[1:]])


@pytest.mark.parametrize("thrust", [0.0, 10.0, 20.0, 40.0])
def test_pair_under_thrust_is_that_of_dense_fibres_over_one_cycle(thrust):
    check_cycle(PAIR, np.radians(2.3) * cycle(1.0, 120), thrust)


@pytest.mark.parametrize("thrust", [0.0, 40.0])
def test_pair_that_is_not_alike_on_both_sides_is_that_of_dense_fibres(thrust):
    check_cycle(replace(PAIR, superelastic=PRESSED), np.radians(2.6) * cycle(1.0, 120), thrust)


@pytest.mark.parametrize("thrust", [0.0, 1.0, 4.0])
def test_one_sided_section_under_thrust_is_that_of_dense_fibres_over_one_cycle(thrust):
    elastic = with_notch(WRIST, replace(WRIST.joint.notch, rigid_roots=False))
    check_cycle(elastic, np.radians(15.0) * cycle(1.0, 120), thrust)


MANY = 256
"""Fibres on a side, for checks of the equations: of the usual ones each makes a corner in the slope."""


def finely_cut(rig: Rig) -> Rig:
    return replace(rig, superelastic=replace(rig.superelastic, fibres_per_side=MANY))


def check_cycle(rig: Rig, phi: np.ndarray, thrust: float) -> None:
    usual, dense = joint_mechanics(rig).section, Fibres(rig)
    many = joint_mechanics(finely_cut(rig)).section
    assert many.area_mm2.size == 2 * MANY
    moment, loss = np.array([(dense.bend(at, thrust), dense.loss) for at in phi]).T
    angle = phi + usual.root_compliance * moment  # so that both have the same bending of the section
    for section, of_moment, of_loss, of_slope in ((many, 1e-4, 1e-3, 1e-3), (usual, 1e-3, 5e-3, 0.02)):
        found = section_path(section, angle, thrust)
        assert np.abs(found.moment_Nmm - moment).max() < of_moment * np.abs(moment).max()
        assert lost(found.loss_mJ) == pytest.approx(lost(loss), rel=of_loss)
        slope, expected = (np.diff(m) / np.diff(angle) for m in (found.moment_Nmm, moment))
        assert np.sqrt(np.mean((slope - expected) ** 2)) < of_slope * found.tangent[0]


def lost(loss: np.ndarray) -> float:
    """What one cycle loses, after the first quarter."""
    return loss[-1] - loss[len(loss) // 5]


@pytest.mark.parametrize(
    ("rig", "thrust"), [(PAIR, 0.0), (PAIR, 40.0), (WRIST, 3.0)], ids=["free", "pair", "one-sided"]
)
def test_tangent_of_the_section_is_the_slope_of_its_moment(rig, thrust):
    section, step = joint_mechanics(rig).section, 1e-7
    angle = np.radians(3.0 if rig is PAIR else 20.0) * cycle(1.0, 7)
    for k in (3, 7, 9, 12, 17, 20, 25):
        path = np.append(angle[: k + 1], angle[k] + np.sign(angle[k] - angle[k - 1]) * step)
        found = section_path(section, path, thrust)
        slope = (found.moment_Nmm[-1] - found.moment_Nmm[-2]) / (path[-1] - path[-2])
        assert found.tangent[-1] == pytest.approx(slope, rel=1e-3, abs=1e-3 * found.tangent[0])


def test_a_squeezed_section_follows_its_flag():
    section = joint_mechanics(with_notch(PAIR, replace(PAIR.joint.notch, rigid_roots=True))).section
    area = float(section.area_mm2.sum())
    for stress, strain in ((300.0, 300 / 60e3), (449.0, 449 / 60e3), (700.0, 700 / 60e3 + 0.05)):
        assert elongation_under_mm(section, stress * area) == pytest.approx(-strain * section.length_mm, rel=1e-6)


@pytest.mark.parametrize("engine", [solve_chain, solve_multibody])
@pytest.mark.parametrize("preload", [5.0, 10.0, 20.0])
def test_engines_have_moment_loss_and_slope_of_dense_fibres_at_their_thrust(engine, preload):
    tendon = replace(PAIR.tendon_a, toe_N=0.0)
    one = finely_cut(with_notch(PAIR, replace(PAIR.joint.notch, count=1)))
    one = replace(one, friction=Friction(), preload_N=preload, tendon_a=tendon, tendon_b=tendon)
    steps = LoadProgram(0.15 * cycle(1.0, 100))
    thrust = check_engine(one, engine(one, steps))
    assert 2 * preload - 0.3 < thrust.min() < thrust.max() < 2 * preload + 5


@pytest.mark.parametrize("engine", [solve_chain, solve_multibody])
@pytest.mark.parametrize("law", [PRESSED, pytest.param(HEATED, marks=pytest.mark.slow)], ids=["not alike", "heated"])
def test_engines_have_moment_loss_slope_and_temperature_of_dense_fibres(engine, law):
    tendon = replace(PAIR.tendon_a, toe_N=0.0)
    one = finely_cut(with_notch(replace(PAIR, superelastic=law), replace(PAIR.joint.notch, count=1)))
    one = replace(one, friction=Friction(), tendon_a=tendon, tendon_b=tendon)
    drive = 0.2 * cycle(1.0, 60)
    steps = LoadProgram(drive, time_s=np.arange(drive.size) / 60)  # a cycle of 4 s
    check_engine(one, engine(one, steps))


@pytest.mark.parametrize("engine", [solve_chain_by_force, solve_multibody_by_force])
def test_engines_have_moment_loss_and_slope_of_dense_fibres_of_a_wrist(engine):
    one = finely_cut(with_notch(WRIST, replace(WRIST.joint.notch, count=1)))
    up = 1.7 * np.arange(201) / 200  # as a cycle, back to zero twice
    check_engine(one, engine(one, np.concatenate([up, up[-2::-1], up[1:], up[-2::-1], up[1:]])))


def check_engine(rig: Rig, run) -> np.ndarray:
    """Compare a run of one joint with dense fibres along its angles and tensions; return the thrust."""
    joint = joint_mechanics(rig)
    theta, tension = np.radians(run.record.notches_deg[:, 0]), run.segment_tensions_N[:, :, 1]
    gap, half = 0.5 * joint.rigid_gap_mm, 0.5 * theta
    levers = [gap * np.sin(half) + sign * arm * np.cos(half) for sign, arm in zip((1, -1), joint.arms_mm, strict=True)]
    moment, thrust = (tension * np.column_stack(levers)).sum(axis=1), tension.sum(axis=1)
    dense, expected, loss, warmer = Fibres(rig), [], [], []
    heats = rig.superelastic.heating_time_s is not None
    steps_s = np.diff(run.record.time_s, prepend=0.0) if heats else 0.0 * theta
    for m, push, at, step_s in zip(moment, thrust, theta, steps_s, strict=True):
        expected.append(dense.bend(at - joint.section.root_compliance * m, push, step_s))
        loss.append(dense.loss)
        warmer.append(dense.warmer)
    assert dense.grown.any()
    if heats:
        assert np.ptp(warmer) > 1.0
        assert np.abs(run.warming_K[:, 0] - warmer).max() < 2e-3 * np.ptp(warmer)
    assert np.abs(moment - expected).max() < 1e-3 * np.abs(moment).max()
    assert lost(run.material_loss_mJ) == pytest.approx(lost(np.array(loss)), rel=1e-3)
    moved = np.abs(np.diff(theta)) > 1e-3 * np.ptp(theta)
    slope, wanted = (np.diff(m)[moved] / np.diff(theta)[moved] for m in (moment, expected))
    assert np.sqrt(np.mean((slope - wanted) ** 2)) < 1e-3 * wanted.max()
    return thrust


@pytest.mark.parametrize("preload", [10.0, 20.0])
def test_energy_closes_with_thrust(preload):
    run = solve_chain(replace(PAIR, preload_N=preload), LoadProgram(2.2 * cycle(1.0, 400)))
    work = lost(run.wheel_work_mJ)
    assert lost(run.friction_loss_mJ + run.material_loss_mJ) == pytest.approx(work, rel=1e-3)


def test_thrust_opens_the_loop_of_the_material():
    # more preload, more loss: one side goes further along its plateau, and transforms at the middle of the cycle, too
    section, bend = joint_mechanics(PAIR).section, np.radians(3.2) * cycle(1.0, 40)
    losses = [lost(section_path(section, bend, thrust).loss_mJ) for thrust in (0.0, 10.0, 40.0, 80.0)]
    assert np.all(np.diff(losses) > 0)
    assert losses[2] > 1.3 * losses[0]
    runs = [solve_chain(replace(PAIR, preload_N=force), LoadProgram(2.2 * cycle(1.0, 40))) for force in (10.0, 20.0)]
    assert lost(runs[1].material_loss_mJ) > 1.3 * lost(runs[0].material_loss_mJ)


def test_losses_of_a_joint_are_those_that_a_review_worked_out_apart():
    # thrust of two tendons at 0, 5, 20 and 40 N of preload: 0.213, 0.220, 0.292, 0.520 mJ a joint and cycle, with the
    # plateaus of a common alloy and the bending of the section given
    rigid = with_notch(PAIR, replace(PAIR.joint.notch, rigid_roots=True))
    section = joint_mechanics(replace(rigid, superelastic=Superelastic(450.0, 200.0))).section
    bend = np.radians(2.49) * cycle(1.0, 60)
    found = [lost(section_path(section, bend, thrust).loss_mJ) for thrust in (0.0, 10.0, 40.0, 80.0)]
    assert found == pytest.approx([0.213, 0.220, 0.292, 0.520], rel=0.025)
