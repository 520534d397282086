"""Priors of the constants of du2018 that the paper's facts do not fix, with their sources, and the laws they belong to.

Each prior is uniform between its bounds, in the value or in its logarithm. Six models are combinations of a law of the
material (Jenkins loop, or the flag of Nitinol) and of what makes the loop narrower as the preload grows: a toe region
of the tendons, a play that the preload takes up (the cause that the paper names), or both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hysteresis.arrays import Floats


@dataclass(frozen=True)
class Prior:
    """Uniform density between two bounds, of the value or of its logarithm."""

    low: float
    high: float
    log: bool
    source: str

    def at(self, quantile: Floats) -> Floats:
        """Values at quantiles from 0 to 1, any shape."""
        if self.log:
            return np.asarray(self.low * (self.high / self.low) ** quantile)
        return np.asarray(self.low + (self.high - self.low) * quantile)


_NITINOL = "plateaus at 37 C and 6.52 MPa/K, confluentmedical/nitinol-design-concepts 115; 10 to 37 C"
COMMON: Mapping[str, Prior] = {
    "tendon.moment_arm_mm": Prior(
        2.4, 2.8, False, "2.80 mm is the paper's bound, 2.2 mm over 45 deg; a thick tendon along the inner wall, 2.4 mm"
    ),
    "tendon.EA_N": Prior(
        3e3, 6e4, True, "steel, 200 GPa: a strand of 0.2 mm, half metal, up to a wire of 0.6 mm; assumed"
    ),
    "tendon.free_length_mm": Prior(75.0, 300.0, True, "a bench; the paper's Fig. 8 has no dimension; assumed"),
    "friction.sheath_N": Prior(0.05, 10.0, True, "below the preload of 10 N; assumed"),
    "friction.guide_N": Prior(0.001, 0.1, True, "14 guides together below the preload; assumed"),
    "friction.capstan_coefficient": Prior(
        0.005, 0.4, True, "steel on NiTi 0.2, up to 0.4 by fit (York et al., ICRA 2015); lubricated far less; assumed"
    ),
    "notch.depth_mm": Prior(2.7, 2.95, False, "leaves arcs of 0.3 to 0.8 mm, which wire cutting leaves; assumed"),
    "material.youngs_modulus_GPa": Prior(40.0, 80.0, False, "range of E_A, doi 10.1016/j.commatsci.2021.110357"),
}
JENKINS: Mapping[str, Prior] = {
    "material.loop_share": Prior(0.02, 0.8, False, "no source: a law of the loop, not of the metal"),
    "material.loop_angle_deg": Prior(0.3, 8.0, True, "a joint bends by 3.2 deg; a tenth up to 2.5 times; assumed"),
}
FLAG: Mapping[str, Prior] = {
    "superelastic.plateau_MPa": Prior(280.0, 520.0, False, _NITINOL),
    "superelastic.unloading_plateau_MPa": Prior(30.0, 260.0, False, _NITINOL),
    "superelastic.transformation_strain": Prior(0.03, 0.06, False, "0.046 there; +-0.015 assumed"),
    "superelastic.plateau_modulus_GPa": Prior(0.0, 5.0, False, "flat, up to what wrists were fitted with, wrists.md"),
}
TOE: Mapping[str, Prior] = {
    "tendon.toe_N": Prior(0.5, 200.0, True, "no source: a strand or a splice that settles; assumed"),
}
PLAY: Mapping[str, Prior] = {
    "backlash.width_mm": Prior(0.005, 2.0, True, "named by the paper, no number; below the stroke"),
    "backlash.takes_up_N": Prior(0.5, 30.0, True, "named by the paper, no number; about the preloads"),
}


@dataclass(frozen=True)
class MechanismSet:
    """Laws of a rig: their constants with priors by dotted name, and constants that are fixed."""

    priors: Mapping[str, Prior]
    fixed: Mapping[str, float] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free constants."""
        return tuple(self.priors)

    def chosen(self, quantiles: Floats) -> dict[str, float]:
        """Constants at quantiles of their priors, shape (p,), and the fixed ones."""
        pairs = zip(self.priors.items(), quantiles, strict=True)
        return {name: float(prior.at(q)) for (name, prior), q in pairs} | dict(self.fixed)


_LINEAR, _NO_TOE = {"material.loop_share": 0.0}, {"tendon.toe_N": 0.0}
MODELS: Mapping[str, MechanismSet] = {
    "Jenkins loop, toe": MechanismSet({**COMMON, **JENKINS, **TOE}),
    "Jenkins loop, toe and play": MechanismSet({**COMMON, **JENKINS, **TOE, **PLAY}),
    "Jenkins loop, play": MechanismSet({**COMMON, **JENKINS, **PLAY}, _NO_TOE),
    "flag, toe": MechanismSet({**COMMON, **FLAG, **TOE}, _LINEAR),
    "flag, toe and play": MechanismSet({**COMMON, **FLAG, **TOE, **PLAY}, _LINEAR),
    "flag, play": MechanismSet({**COMMON, **FLAG, **PLAY}, {**_LINEAR, **_NO_TOE}),
}
"""A law of the material times what makes the loop narrower with preload."""
