"""What one tube gives: the chain bends it to the required angle, and its quantities are taken there."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fem_models.chain.follow import Run
from fem_models.chain.solve import ChainCase, chain_case, followed, tip_angle_deg, tip_mm
from fem_models.joint import JointRow, joint_row
from fem_models.joint.strain import peak_strain
from fem_models.joint.strain_life import Life, StrainLife, nitinol_life
from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.rig.effects import TipLoad
from fem_models.rig.rig import notched_tube
from hysteresis.arrays import Floats
from studies.design.quantities import Measured

SAMPLES = 33
"""Of a loading branch: a tension between two of them is off by less than 0.2 %."""
SPARE = 1.06
"""Drive of the first try over the path that the tendon takes at the required bend."""
BEYOND = 1.5
"""Bend over the required one to which a tube is pulled where no limit of tension or drive ends it before."""
TRIES = 6
PROBE = 0.05
"""Tip load that stiffness and tip force are taken from, over the tension times the arm over the length."""


@dataclass(frozen=True)
class Wire:
    """The tendon: its diameter, and its breaking load, NaN where that is not known."""

    diameter_mm: float
    breaking_N: float = math.nan


@dataclass(frozen=True)
class Use:
    """How a tube is used, and what of it is wanted.

    Parameters
    ----------
    bend_deg
        The bend at which it is judged.
    tension_N, drive_mm
        Limits; inf without.
    wanted
        Names of the quantities: some take a run of their own.
    life
        Strain-life curve of one's own metal; None takes Nitinol's for a superelastic rig.
    """

    bend_deg: float
    tension_N: float
    drive_mm: float
    wanted: frozenset[str]
    life: StrainLife | None = None


@dataclass(frozen=True)
class _Branch:
    """A loading branch: arrays (m,), but ``strain`` (m, N), ``tip`` (m, 2) and ``joints`` (m, N), rad."""

    drive: Floats
    bend: Floats
    tension: Floats
    joints: Floats
    tip: Floats
    strain: Floats

    def at(self, bend: float, values: Floats) -> float:
        """Interpolate a column at a bend."""
        return float(np.interp(bend, self.bend, values))


def measure(rig: Rig, wire: Wire, use: Use) -> Measured:
    """Bend a tube by the chain, and take its quantities.

    Drives and tensions are those of tendon a. Tip load, stiffness and loop take a run each, where they are wanted.

    Raises
    ------
    RigError, SolverError
        A rig that cannot be made or bent.
    """
    case = chain_case(rig, _ramp(_path_mm(rig, use.bend_deg)))
    branch = _loaded(rig, case, use)
    tube, bend = notched_tube(rig).tube, use.bend_deg
    reached = branch.bend[-1] >= bend
    allowed = _allowed(branch, use)
    found = {
        "bend_deg": allowed,
        "bending_radius_mm": rig.length_mm / math.radians(bend),
        "closing_bend_deg": _closing(branch, case.joints),
        "length_mm": rig.length_mm,
        "outer_diameter_mm": tube.outer_diameter_mm,
        "free_lumen_mm": tube.inner_diameter_mm - len(rig.tendons) * wire.diameter_mm,
    }
    if reached:
        tension = branch.at(bend, branch.tension)
        found |= {
            "reach_mm": abs(branch.at(bend, branch.tip[:, 1])),
            "tension_N": tension,
            "tendon_margin": wire.breaking_N / tension if tension > 0 else math.inf,
            "drive_mm": branch.at(bend, branch.drive),
        }
        below = branch.bend <= bend
        found["peak_strain_percent"] = 100 * max(
            float(np.abs(branch.strain[below]).max(initial=0.0)),
            max(abs(branch.at(bend, column)) for column in branch.strain.T),
        )
        found |= _cycle(rig, case, found["drive_mm"], use)
        found |= _tip(rig, branch, found["drive_mm"], use)
    return Measured(**found)


def _path_mm(rig: Rig, bend_deg: float) -> float:
    """Path that tendon a takes at a bend, its stretch left out, and some to spare."""
    return SPARE * joint_row(rig).first.arms_mm.a * math.radians(bend_deg)


def _ramp(drive_mm: float) -> LoadProgram:
    return LoadProgram(np.linspace(0.0, drive_mm, SAMPLES))


def _loaded(rig: Rig, case: ChainCase, use: Use) -> _Branch:
    """Pull until a limit is passed, or far beyond the required bend."""
    drive, limited = float(case.path.drive[-1]), math.isfinite(min(use.tension_N, use.drive_mm))
    enough = use.bend_deg * (BEYOND if limited else 1.0)
    for _ in range(TRIES):
        branch = _branch(rig, case)
        if branch.bend[-1] >= enough or branch.tension[-1] > use.tension_N or branch.drive[-1] > use.drive_mm:
            return branch
        missing = math.radians(max(enough - branch.bend[-1], 0.05 * enough))
        drive = min(drive + 1.2 * case.joints.first.arms_mm.a * missing, 1.4 * drive)
        case = chain_case(rig, _ramp(drive), like=case)
    return branch


def _branch(rig: Rig, case: ChainCase) -> _Branch:
    run, _ = followed(rig, case)
    bend = tip_angle_deg(run)
    # a bend that falls back, as of a tube that folds, ends the branch
    m = int(np.argmax(np.append(np.diff(bend) <= 0, True))) + 1
    return _Branch(
        drive=case.path.drive[:m],
        bend=bend[:m],
        tension=run.tensions[:m, 0, 0],
        joints=run.angles[:m],
        tip=tip_mm(rig, case.joints, run)[:m],
        strain=_strain(case.joints, run)[:m],
    )


def _strain(joints: JointRow, run: Run) -> Floats:
    return peak_strain(joints, run.angles, run.longer if joints.first.section else None)


def _allowed(branch: _Branch, use: Use) -> float:
    """Largest bend of the branch within the limits of tension and drive."""
    return min(
        float(np.interp(use.tension_N, np.maximum.accumulate(branch.tension), branch.bend)),
        float(np.interp(use.drive_mm, branch.drive, branch.bend)),
    )


def _closing(branch: _Branch, joints: JointRow) -> float:
    """Bend at which the first notch closes; extrapolated in proportion where none does in the branch."""
    part = (branch.joints / joints.of("closure_angle_rad")).max(axis=1)
    if part[-1] >= 1:
        return float(np.interp(1.0, np.maximum.accumulate(part), branch.bend))
    return float(branch.bend[-1] / part[-1]) if part[-1] > 0 else math.inf


def _cycle(rig: Rig, case: ChainCase, drive: float, use: Use) -> dict[str, float]:
    """Run a cycle to the required bend and back: to the other side, too, with two tendons."""
    if not {"loop_width_deg", "alternating_strain_percent", "cycles"} & use.wanted:
        return {}
    up = np.linspace(0.0, drive, SAMPLES)
    back = np.linspace(drive, 0.0 if rig.tendon_b is None else -drive, SAMPLES)
    again = back[::-1]
    whole = np.concatenate([up, back[1:], again[1:]])
    run, _ = followed(rig, chain_case(rig, LoadProgram(whole), like=case))
    bend, strain = tip_angle_deg(run), _strain(case.joints, run)
    low, high = SAMPLES - 1, 2 * SAMPLES - 2
    fibres = strain[low:]
    ranges = 0.5 * np.ptp(fibres, axis=0)
    worst = int(ranges.argmax())
    amplitude, mean = float(ranges[worst]), float(0.5 * (fibres[:, worst].max() + fibres[:, worst].min()))
    return {
        "loop_width_deg": float((bend[low : high + 1] - bend[high:][::-1]).max()),
        "alternating_strain_percent": 100 * amplitude,
        "cycles": life_of(rig, amplitude, mean, use.life).low,
    }


def life_of(rig: Rig, amplitude: float, mean: float, own: StrainLife | None) -> Life:
    """Cycles to failure at a strain; NaN for a metal that is neither superelastic nor has a curve of its own."""
    if own is not None:
        return own.life(amplitude)
    if rig.superelastic is None:
        return Life(math.nan, math.nan, math.nan)
    return nitinol_life(amplitude, mean, rig.superelastic.start_MPa / (1e3 * rig.material.youngs_modulus_GPa))


def _tip(rig: Rig, branch: _Branch, drive: float, use: Use) -> dict[str, float]:
    """Take force and stiffness across the tip from a run with a small load against the bend there.

    The load is there from the start, so that the guides slide. Its influence on tension and tip is taken as linear.
    """
    if not {"tip_force_N", "tip_stiffness_N_per_mm"} & use.wanted:
        return {}
    bend, arm = use.bend_deg, joint_row(rig).first.arms_mm.a
    tension = branch.at(bend, branch.tension)
    load = PROBE * tension * arm / rig.length_mm
    pushed = replace(rig, tip_load=TipLoad(load, bend - 90.0))
    loaded = _loaded(pushed, chain_case(pushed, _ramp(float(branch.drive[-1]))), use)
    heading = math.radians(bend)
    across = np.array([-math.sin(heading), math.cos(heading)])
    moved = sum(
        a * (float(np.interp(drive, branch.drive, before)) - float(np.interp(drive, loaded.drive, after)))
        for a, before, after in zip(across, branch.tip.T, loaded.tip.T, strict=True)
    )
    more = loaded.at(bend, loaded.tension) - tension if loaded.bend[-1] >= bend else math.nan
    room = use.tension_N - tension
    return {
        "tip_stiffness_N_per_mm": float(load / moved) if moved > 0 else math.inf,
        "tip_force_N": load * room / more if more > 0 and math.isfinite(room) else math.nan,
    }
