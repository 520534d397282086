"""Logarithmic derivatives of a loop with respect to the constants of a rig, and which of them are not distinguished."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.ensemble import with_constants
from fem_models.rig.rig import numeric_fields
from hysteresis.arrays import Floats
from validation.separation.contributions import Loop, closed_loop

STEP = 0.01
"""Of ln(constant), to either side."""
ALIKE = 0.99
"""Magnitude of the cosine of two derivatives above which two constants are not distinguished by a loop."""
DISTINCT = 0.01
"""Singular value of the derivatives, of unit length each, over the largest one, above which it counts as a way of its
own in which constants move the loop."""
_NO_INFLUENCE = 1e-6  # of the range of the angle, per unit of ln(constant)
_LEFT_OUT = ("wheel.", "notch.count", "bench.joints", "precurvature_deg")


@dataclass(frozen=True)
class Sensitivity:
    """d ln(width)/d ln(constant), and the same of area, energy and the whole range of the angle."""

    width: float
    area: float
    energy: float
    range: float


@dataclass(frozen=True)
class Sensitivities:
    """Sensitivities by the name of the constant in a rig file, and groups of constants that are not distinguished.

    ``tendon.`` stands for both tendons where they are equal. ``ways`` is in how many independent ways all constants
    move the loop: if they are more, one loop cannot separate them, even where any two of them are distinguished.
    """

    of: Mapping[str, Sensitivity]
    alike: tuple[tuple[str, ...], ...]
    ways: int

    def sentence(self) -> str:
        """One line on what one loop cannot separate."""
        if not self.of:
            return "no constant moves the loop"
        count = f"one loop cannot separate {len(self.of)} constants: they move it in {self.ways} independent ways"
        if self.ways == len(self.of):
            count = f"the {len(self.of)} constants move the loop in as many independent ways"
        groups = "; ".join(" / ".join(group) for group in self.alike)
        return f"{count}; nearly alike are {groups}" if groups else count


def constants_of(rig: Rig) -> dict[str, float]:
    """Positive constants of a rig, which have a logarithm; equal tendons give ``tendon.`` once."""
    found = {name: value for name, value in numeric_fields(rig).items() if value > 0 and not name.startswith(_LEFT_OUT)}
    if rig.material.loop_share == 0:
        found.pop("material.loop_angle_deg", None)
    if rig.tendon_b != rig.tendon_a:
        return found
    both = {name.replace("tendon_a.", "tendon."): value for name, value in found.items()}
    return {name: value for name, value in both.items() if not name.startswith("tendon_b.")}


def sensitivities(rig: Rig, program: LoadProgram) -> Sensitivities:
    """Differentiate the closed loop of a rig by central differences on the chain.

    Constants that cannot be moved to both sides, or without influence on the loop, are left out. Without a loop there
    is no derivative of its width, area and energy: NaN.

    Raises
    ------
    SolverError, RigError
        From the chain, for the rig itself.
    """
    middle = closed_loop(rig, program)
    span = float(np.ptp(middle.record.angle_deg))
    of, effects = {}, {}
    for name, value in constants_of(rig).items():
        try:
            low, high = (
                closed_loop(with_constants(rig, {name: value * np.exp(sign * STEP)}), program) for sign in (-1, 1)
            )
        except (RigError, SolverError):
            continue
        effect = (high.record.angle_deg - low.record.angle_deg) / (2 * STEP)
        if np.abs(effect).max() <= _NO_INFLUENCE * span:
            continue
        of[name] = _of(low, high, lossless=middle.is_lossless, flat=middle.is_flat)
        effects[name] = effect
    return Sensitivities(of, _alike(effects), _ways(effects))


def _of(low: Loop, high: Loop, *, lossless: bool, flat: bool) -> Sensitivity:
    def slope(a: float, b: float, *, nothing: bool = False) -> float:
        return float(np.log(b / a) / (2 * STEP)) if a > 0 and b > 0 and not nothing else float("nan")

    return Sensitivity(
        width=slope(low.width_deg, high.width_deg, nothing=lossless or flat),
        area=slope(low.area, high.area, nothing=lossless or flat),
        energy=slope(low.dissipated_mJ, high.dissipated_mJ, nothing=lossless),
        range=slope(float(np.ptp(low.record.angle_deg)), float(np.ptp(high.record.angle_deg))),
    )


def _ways(effects: Mapping[str, Floats]) -> int:
    """Count the independent ways in which constants move the loop, by singular values beyond :data:`DISTINCT`."""
    if not effects:
        return 0
    values = np.linalg.svd(np.array([effect / np.linalg.norm(effect) for effect in effects.values()]), compute_uv=False)
    return int((values > DISTINCT * values[0]).sum())


def _alike(effects: Mapping[str, Floats]) -> tuple[tuple[str, ...], ...]:
    """Group constants, each linked to another of its group by a cosine beyond :data:`ALIKE`."""
    names = list(effects)
    if not names:
        return ()
    unit = np.array([effect / np.linalg.norm(effect) for effect in effects.values()])
    _, label = connected_components(np.abs(unit @ unit.T) > ALIKE)
    groups = [tuple(name for name, k in zip(names, label, strict=True) if k == one) for one in range(label.max() + 1)]
    return tuple(group for group in groups if len(group) > 1)
