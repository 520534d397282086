"""One-sided wrists predicted from geometry and published constants, with a band from tolerances: nothing is fitted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from fem_models.load_control import run_load_control
from fem_models.rig import Rig, RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Superelastic
from fem_models.rig.rig import Friction, Material, notched_tube
from hysteresis.arrays import Floats
from validation.measured.wrists import Trials


@dataclass(frozen=True)
class Range:
    """A constant that is not exactly known: its range, and where the range is from."""

    low: float
    high: float
    unit: str
    source: str

    @property
    def middle(self) -> float:
        """Value of the prediction without tolerances."""
        return 0.5 * (self.low + self.high)


RANGES: Mapping[str, Range] = {
    "depth": Range(-0.02, 0.02, "mm", "tolerance of a cut, about the stated depth"),
    "E": Range(60.0, 75.0, "GPa", "60: usual for such tubes; 75: York et al. 2015"),
    "plateau": Range(
        500.0, 600.0, "MPa", "500: 460 to 500 at 37 C, confluentmedical/nitinol-design-concepts; 600: York et al."
    ),
    "mu": Range(0.2, 0.4, "", "steel on NiTi, York et al.: 0.2, and 0.4 by their fit"),
    "tendon": Range(0.0, 0.2, "mm", "diameter of the wire, which lies along the inner wall; not stated"),
}
"""Uniform in each range."""
AUTHORS: Mapping[str, float] = {"depth": 0.009, "E": 75.0, "plateau": 600.0, "mu": 0.2, "tendon": 0.0}
"""Constants of York et al. within the ranges: a depth of 0.988 mm, and the tendon at the inner radius."""
SPAN, CLIMB_GPA, BACK = 0.046, 0.87, 0.457
"""Transformation strain, slope of the plateau (460 to 500 MPa over that strain), and the unloading plateau over the
loading one (210 over 460 MPa): confluentmedical/nitinol-design-concepts, 115-open-frame-shape-set."""
SHARE = 0.9
"""Of the samples that a band holds at each force."""


@dataclass(frozen=True)
class Band:
    """Tip angles at forces (m,), deg: of the middle of all ranges, and quantiles over samples; shapes (m,)."""

    force_N: Floats
    middle_deg: Floats
    low_deg: Floats
    median_deg: Floats
    high_deg: Floats
    samples: int


@dataclass(frozen=True)
class Score:
    """A band beside measured samples: RMSE of the middle's tip, and how many samples lie inside."""

    tube: str
    rmse_deg: float
    inside: int
    count: int


def predicted(rig: Rig, values: Mapping[str, float]) -> Rig:
    """Rig of the tube with constants of :data:`RANGES`: elastic roots, closure as in the rig.

    Geometry and precurvature are those of the rig. ``depth`` adds to its depth.
    """
    joint = notched_tube(rig)
    notch = replace(joint.notch, depth_mm=joint.cut.depth_mm + values["depth"], rigid_roots=False)
    arm = 0.5 * (joint.tube.inner_diameter_mm - values["tendon"])
    law = Superelastic(values["plateau"], BACK * values["plateau"], SPAN, CLIMB_GPA)
    return replace(
        rig,
        joint=replace(joint, notch=notch),
        material=Material(values["E"], rig.material.poissons_ratio),
        friction=Friction(capstan_coefficient=values["mu"]),
        superelastic=law,
        tendon_a=replace(rig.tendon_a, moment_arm_mm=arm),
    )


def middle(rig: Rig) -> Rig:
    """Rig with the middle of all ranges."""
    return predicted(rig, {name: one.middle for name, one in RANGES.items()})


def band(rig: Rig, force_N: Floats, *, samples: int = 512, seed: int = 0, ranges: Mapping[str, Range] = RANGES) -> Band:
    """Predict the tip at ascending forces (m,) for a Sobol sequence of the ranges, in their order.

    Raises
    ------
    SolverError
        A sample that finds no equilibrium: a band may not leave out the softest wrists.
    """
    unit = qmc.Sobol(len(ranges), seed=seed).random(samples)
    low, high = np.array([(one.low, one.high) for one in ranges.values()]).T
    tips = []
    for row in (low + unit * (high - low)).tolist():
        values = dict(zip(ranges, row, strict=True))
        try:
            tips.append(run_load_control(predicted(rig, values), force_N).angle_deg)
        except (SolverError, RigError) as error:
            raise SolverError(f"{values}: {error}") from None
    outside = 50 * (1 - SHARE)
    least, median, most = np.percentile(tips, [outside, 50.0, 100 - outside], axis=0)
    return Band(force_N, run_load_control(middle(rig), force_N).angle_deg, least, median, most, samples)


def known(ranges: Mapping[str, Range], names: Iterable[str], share: float = 0.0) -> dict[str, Range]:
    """Ranges of which some are only a share as wide, about the same middle."""
    narrow = set(names)
    return {
        name: replace(
            one, low=one.middle + share * (one.low - one.middle), high=one.middle + share * (one.high - one.middle)
        )
        if name in narrow
        else one
        for name, one in ranges.items()
    }


def influence_deg(rig: Rig, force_N: float) -> dict[str, float]:
    """Tip at the end of each range less that at its start, the others in the middle, at a force reached by loading."""
    centre, force = {name: one.middle for name, one in RANGES.items()}, np.linspace(0.0, force_N, 22)

    def tip(values: Mapping[str, float]) -> float:
        return float(run_load_control(predicted(rig, values), force).angle_deg[-1])

    return {name: tip({**centre, name: one.high}) - tip({**centre, name: one.low}) for name, one in RANGES.items()}


def score(trials: Trials, samples: int = 512) -> Score:
    """Predict a measured wrist with the same settings, and compare every sample of its loading."""
    levels, which = np.unique(trials.force_N, return_inverse=True)
    found = band(preset(f"notched-wrist-{trials.tube}"), levels, samples=samples)
    tip = trials.tip_deg
    inside = (found.low_deg[which] <= tip) & (tip <= found.high_deg[which])
    rmse = float(np.sqrt(np.mean((found.middle_deg[which] - tip) ** 2)))
    return Score(trials.tube, rmse, int(inside.sum()), tip.size)
