"""What one tube gives: the chain bends it to the required angle, and its quantities are taken there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Protocol

import numpy as np
from scipy.optimize import brentq

from fem_models.chain.solve import (
    ChainCase,
    ChainSolution,
    chain_case,
    followed,
    strain_of_run,
    tip_angle_deg,
    tip_mm,
)
from fem_models.joint import JointRow, joint_row
from fem_models.joint.strain_life import Life, StrainLife, nitinol_life
from fem_models.load import LoadProgram
from fem_models.multibody.quasi_static import MultibodySolution
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
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
FINE = np.array([0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2])
"""Shares of the drive, beyond it, at which a load of the tip is balanced again."""
PROBE = 0.05
"""Tip load that stiffness and tip force are taken from, over the tension times the arm over the length."""
MORE_DRIVE = 1.5
"""Drive under a tip force at most, over that without."""
HELD = 0.02
"""Accuracy of a tip force that is searched for, and of the tension under it, relative."""


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
class Followed:
    """What a tube did along a drive: arrays (m,), but ``joints_rad`` and ``strain`` (m, N) and ``tip_mm`` (m, 2)."""

    drive_mm: Floats
    bend_deg: Floats
    tension_N: Floats
    joints_rad: Floats
    tip_mm: Floats
    strain: Floats

    def at(self, bend: float, values: Floats) -> float:
        """Interpolate a column at a bend, along a loading branch."""
        return float(np.interp(bend, self.bend_deg, values))

    def rising(self) -> Followed:
        """Give the part along which the bend grows: a bend that falls back, as of a tube that folds, ends it."""
        m = int(np.argmax(np.append(np.diff(self.bend_deg) <= 0, True))) + 1
        return Followed(*(column[:m] for column in vars(self).values()))


class Bender(Protocol):
    """A model of one tube that follows drives from rest."""

    joints: JointRow

    def follow(self, drive_mm: Floats) -> Followed:
        """Follow a drive, shape (m,)."""
        ...


class ChainBender:
    """The chain; what it derives of the tube is derived once."""

    def __init__(self, rig: Rig) -> None:
        self.rig, self.joints = rig, joint_row(rig)
        self._like: ChainCase | None = None

    def follow(self, drive_mm: Floats) -> Followed:
        """Follow a drive, shape (m,)."""
        self._like = case = chain_case(self.rig, LoadProgram(drive_mm), like=self._like)
        self.joints = case.joints
        run, _ = followed(self.rig, case)
        return Followed(
            drive_mm=drive_mm,
            bend_deg=tip_angle_deg(run),
            tension_N=run.tensions[:, 0, 0],
            joints_rad=run.angles,
            tip_mm=tip_mm(self.rig, case.joints, run),
            strain=strain_of_run(case.joints, run),
        )


class SolverBender:
    """Any engine, such as :func:`fem_models.multibody.solve_multibody`: slower, for checks."""

    def __init__(self, rig: Rig, solve: Callable[[Rig, LoadProgram], ChainSolution | MultibodySolution]) -> None:
        self.rig, self.joints, self._solve = rig, joint_row(rig), solve

    def follow(self, drive_mm: Floats) -> Followed:
        """Follow a drive, shape (m,)."""
        solution = self._solve(self.rig, LoadProgram(drive_mm))
        record = solution.record
        assert record.notches_deg is not None
        assert record.tip_mm is not None
        assert record.tension_a_N is not None
        return Followed(
            drive_mm=drive_mm,
            bend_deg=record.angle_deg,
            tension_N=record.tension_a_N,
            joints_rad=np.radians(record.notches_deg),
            tip_mm=record.tip_mm,
            strain=solution.peak_strain,
        )


def measure(rig: Rig, wire: Wire, use: Use, model: Callable[[Rig], Bender] = ChainBender) -> Measured:
    """Bend a tube, by the chain unless another model is given, and take its quantities.

    Drives and tensions are those of tendon a. Tip load, stiffness and loop take a run each, where they are wanted.

    Raises
    ------
    RigError, SolverError
        A rig that cannot be made or bent.
    """
    bender = model(rig)
    branch = _loaded(bender, use)
    tube, bend = notched_tube(rig).tube, use.bend_deg
    found = {
        "bend_deg": _allowed(branch, use),
        "bending_radius_mm": rig.length_mm / math.radians(bend),
        "closing_bend_deg": _closing(branch, bender.joints),
        "length_mm": rig.length_mm,
        "outer_diameter_mm": tube.outer_diameter_mm,
        "free_lumen_mm": tube.inner_diameter_mm - len(rig.tendons) * wire.diameter_mm,
    }
    if branch.bend_deg[-1] >= bend:
        tension = branch.at(bend, branch.tension_N)
        found |= {
            "notch_angle_deg": max(abs(branch.at(bend, column)) for column in np.degrees(branch.joints_rad).T),
            "reach_mm": abs(branch.at(bend, branch.tip_mm[:, 1])),
            "tension_N": tension,
            "tendon_margin": wire.breaking_N / tension if tension > 0 else math.inf,
            "drive_mm": branch.at(bend, branch.drive_mm),
        }
        path = (rig.length_mm - found["drive_mm"]) / math.radians(bend)
        found["tendon_strain_percent"] = 100 * 0.5 * wire.diameter_mm / path if path > 0 else math.inf
        found |= _cycle(rig, bender, found["drive_mm"], use)
        found |= _tip(rig, bender, found["drive_mm"], use, model)
    return Measured(**found)


def _loaded(bender: Bender, use: Use) -> Followed:
    """Pull until a limit is passed, or far beyond the required bend."""
    limited = math.isfinite(min(use.tension_N, use.drive_mm))
    enough, arm = use.bend_deg * (BEYOND if limited else 1.0), bender.joints.first.arms_mm.a
    drive = SPARE * arm * math.radians(use.bend_deg)
    for _ in range(TRIES):
        branch = bender.follow(np.linspace(0.0, drive, SAMPLES)).rising()
        passed = branch.tension_N[-1] > use.tension_N or branch.drive_mm[-1] > use.drive_mm
        if branch.bend_deg[-1] >= enough or passed:
            return branch
        missing = math.radians(max(enough - branch.bend_deg[-1], 0.05 * enough))
        drive = min(drive + 1.2 * arm * missing, 1.4 * drive)
    return branch


def _allowed(branch: Followed, use: Use) -> float:
    """Largest bend of the branch within the limits of tension and drive."""
    return min(
        float(np.interp(use.tension_N, np.maximum.accumulate(branch.tension_N), branch.bend_deg)),
        float(np.interp(use.drive_mm, branch.drive_mm, branch.bend_deg)),
    )


def _closing(branch: Followed, joints: JointRow) -> float:
    """Bend at which the first notch closes; extrapolated in proportion where none does in the branch."""
    part = (branch.joints_rad / joints.of("closure_angle_rad")).max(axis=1)
    if part[-1] >= 1:
        return float(np.interp(1.0, np.maximum.accumulate(part), branch.bend_deg))
    return float(branch.bend_deg[-1] / part[-1]) if part[-1] > 0 else math.inf


def _cycle(rig: Rig, bender: Bender, drive: float, use: Use) -> dict[str, float]:
    """Run a cycle to the required bend and back: to the other side, too, with two tendons.

    Beyond that bend another fibre may be the most strained one, so that the strain is of this run alone.
    """
    if not {"loop_width_deg", "peak_strain_percent", "alternating_strain_percent", "cycles"} & use.wanted:
        return {}
    up = np.linspace(0.0, drive, SAMPLES)
    back = np.linspace(drive, 0.0 if rig.tendon_b is None else -drive, SAMPLES)
    run = bender.follow(np.concatenate([up, back[1:], back[::-1][1:]]))
    low, high = SAMPLES - 1, 2 * SAMPLES - 2
    fibres = run.strain[low:]
    ranges = 0.5 * np.ptp(fibres, axis=0)
    worst = int(ranges.argmax())
    amplitude, mean = float(ranges[worst]), float(0.5 * (fibres[:, worst].max() + fibres[:, worst].min()))
    return {
        "loop_width_deg": float((run.bend_deg[low : high + 1] - run.bend_deg[high:][::-1]).max()),
        "peak_strain_percent": 100 * float(np.abs(run.strain).max()),
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


def _tip(rig: Rig, bender: Bender, drive: float, use: Use, model: Callable[[Rig], Bender]) -> dict[str, float]:
    """Take force and stiffness across the tip from a run with a small load against the bend there.

    The load is there from the start, so that the guides slide. Its influence on the tip is taken as linear. So is that
    on the tension, where the tube with that load still comes to the bend; else the force is searched for, because a
    closed notch holds a small load without more tension, and opens under a large one.
    Both runs have the same samples, close to each other beyond the drive: what is compared is small.
    """
    if not {"tip_force_N", "tip_stiffness_N_per_mm"} & use.wanted:
        return {}
    path = np.concatenate([np.linspace(0.0, drive, SAMPLES), drive * (1 + FINE)])
    free = bender.follow(path)
    tension = free.at(use.bend_deg, free.tension_N)
    load = PROBE * tension * bender.joints.first.arms_mm.a / rig.length_mm
    loaded = model(replace(rig, tip_load=TipLoad(load, use.bend_deg - 90.0))).follow(path)
    heading = math.radians(use.bend_deg)
    away = free.tip_mm[SAMPLES - 1] - loaded.tip_mm[SAMPLES - 1]
    moved = float(away[1] * math.cos(heading) - away[0] * math.sin(heading))
    more = loaded.at(use.bend_deg, loaded.tension_N) - tension if loaded.bend_deg[-1] >= use.bend_deg else math.nan
    room = use.tension_N - tension
    return {
        "tip_stiffness_N_per_mm": load / moved if moved > 0 else math.inf,
        "tip_force_N": _held_N(rig, load * room / more, drive, use, model)
        if more > 0 and math.isfinite(room)
        else math.nan,
    }


def _held_N(rig: Rig, most_N: float, drive: float, use: Use, model: Callable[[Rig], Bender]) -> float:
    """Largest force across the tip, up to ``most_N``, against which a tube comes to the required bend."""
    path = np.concatenate([np.linspace(0.0, drive, SAMPLES)[::2][:-1], drive * np.linspace(1.0, MORE_DRIVE, SAMPLES)])

    @cache
    def spare_N(force_N: float) -> float:
        """Tension that is left at the bend; none where the tube does not come there."""
        try:
            run = model(replace(rig, tip_load=TipLoad(force_N, use.bend_deg - 90.0))).follow(path).rising()
        except (RigError, SolverError):
            return -use.tension_N
        reached = run.bend_deg[-1] >= use.bend_deg and run.at(use.bend_deg, run.drive_mm) <= use.drive_mm
        return use.tension_N - run.at(use.bend_deg, run.tension_N) if reached else -use.tension_N

    if most_N <= 0 or spare_N(most_N) >= -HELD * use.tension_N or spare_N(0.0) <= 0:
        return most_N
    return float(brentq(spare_N, 0.0, most_N, rtol=HELD, xtol=HELD * most_N))
