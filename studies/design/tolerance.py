"""``[tolerance]``: how far a tube that is made differs from its drawing, and the metal from its data sheet."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.special import ndtr

from fem_models.rig import Rig
from fem_models.rig.joints import OfEach
from fem_models.rig.rig import notched_tube
from hysteresis.arrays import Floats
from hysteresis.messages import listed, quoted
from studies.sweep.errors import StudyError
from studies.sweep.file_table import FileTable

Shape = Literal["normal", "uniform", "lognormal"]
MOST_NORMAL = 5.0
"""Standard deviations beyond which nothing is drawn: a tail that no workshop has would cut tubes in two."""


@dataclass(frozen=True)
class Tolerance:
    """Spread of a number about its nominal value.

    Parameters
    ----------
    name
        One of :data:`CHANGES`.
    shape
        ``normal``, ``uniform`` or ``lognormal`` (of a number above 0, its median nominal).
    size
        Standard deviation, or half the width of a uniform range; of ``lognormal`` that of the logarithm.
    percent
        Whether ``size`` is in percent of the nominal number; else it is in its unit.
    """

    name: str
    shape: Shape
    size: float
    percent: bool

    def value(self, nominal: float, z: float) -> float:
        """Give the number where a standard normal variable has the value z."""
        z = min(max(z, -MOST_NORMAL), MOST_NORMAL)
        if self.shape == "lognormal":
            return nominal * math.exp(self.size / 100 * z)
        off = z if self.shape == "normal" else 2 * float(ndtr(z)) - 1
        return nominal + off * self.size * (nominal / 100 if self.percent else 1)

    def halved(self) -> Tolerance:
        """Give the same, half as wide."""
        return replace(self, size=0.5 * self.size)

    @property
    def words(self) -> str:
        """Say it in words, for tables."""
        unit = " %" if self.percent or self.shape == "lognormal" else f" {self.name.rpartition('_')[2]}"
        kind = {"normal": "normal, sd", "uniform": "uniform, +-", "lognormal": "lognormal, sd"}[self.shape]
        return f"{kind} {self.size:g}{unit}"


def _each(values: OfEach, change: Callable[[float], float]) -> OfEach:
    return tuple(map(change, values)) if isinstance(values, tuple) else change(values)


def _notch(rig: Rig, **fields: OfEach) -> Rig:
    joint = notched_tube(rig)
    changed: Mapping[str, object] = fields
    return replace(rig, joint=replace(joint, notch=replace(joint.notch, **changed)))  # type: ignore[arg-type]


def _depth(rig: Rig, change: Callable[[float], float]) -> Rig:
    return _notch(rig, depth_mm=_each(notched_tube(rig).notch.depth_mm, change))


def _width(rig: Rig, change: Callable[[float], float]) -> Rig:
    """Widen the notches; their pitch stays, so that rings become as much shorter."""
    notch = notched_tube(rig).notch
    if isinstance(notch.width_mm, tuple) or isinstance(notch.spacing_mm, tuple):
        return _notch(rig, width_mm=_each(notch.width_mm, change))
    width = change(notch.width_mm)
    return _notch(rig, width_mm=width, spacing_mm=notch.spacing_mm + notch.width_mm - width)


def _wall(rig: Rig, change: Callable[[float], float]) -> Rig:
    """Change the wall from inside: the outer diameter stays, the tendon stays at its place on the inner wall."""
    joint = notched_tube(rig)
    outer, inner = joint.tube.outer_diameter_mm, joint.tube.inner_diameter_mm
    bore = outer - 2 * change((outer - inner) / 2)
    moved = 0.5 * (bore - inner)
    tendons = {
        name: replace(tendon, moment_arm_mm=tendon.moment_arm_mm + moved)
        for name, tendon in (("tendon_a", rig.tendon_a), ("tendon_b", rig.tendon_b))
        if tendon is not None
    }
    tube = replace(joint.tube, inner_diameter_mm=bore)
    return replace(rig, joint=replace(joint, tube=tube), **tendons)  # type: ignore[arg-type]


def _modulus(rig: Rig, change: Callable[[float], float]) -> Rig:
    return replace(rig, material=replace(rig.material, youngs_modulus_GPa=change(rig.material.youngs_modulus_GPa)))


def _plateau(rig: Rig, change: Callable[[float], float]) -> Rig:
    """Move both plateaus by the same stress."""
    law = rig.superelastic
    if law is None:
        return rig
    loading = change(law.plateau_MPa)
    back = law.unloading_plateau_MPa + loading - law.plateau_MPa
    return replace(rig, superelastic=replace(law, plateau_MPa=loading, unloading_plateau_MPa=max(back, 1.0)))


def _friction(rig: Rig, change: Callable[[float], float]) -> Rig:
    mu = max(change(rig.friction.capstan_coefficient), 0.0)
    return replace(rig, friction=replace(rig.friction, capstan_coefficient=mu))


def _preload(rig: Rig, change: Callable[[float], float]) -> Rig:
    return replace(rig, preload_N=max(change(rig.preload_N), 0.0))


CHANGES: Mapping[str, Callable[[Rig, Callable[[float], float]], Rig]] = {
    "depth_mm": _depth,
    "width_mm": _width,
    "wall_mm": _wall,
    "youngs_modulus_GPa": _modulus,
    "plateau_MPa": _plateau,
    "capstan_coefficient": _friction,
    "preload_N": _preload,
}
"""How each tolerance changes a rig; depth and width of all notches alike: a cutting program is off everywhere."""


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of a tube, independent of each other."""

    each: tuple[Tolerance, ...]

    def drawn(self, rig: Rig, z: Floats) -> Rig:
        """Make the tube of one row of standard normal variables, shape (tolerances,).

        Raises
        ------
        RigError
            A tube that cannot be made.
        """
        for one, at in zip(self.each, z.tolist(), strict=True):
            rig = CHANGES[one.name](rig, lambda nominal, one=one, at=at: one.value(nominal, at))  # type: ignore[misc]
        return rig

    def with_halved(self, number: int) -> Tolerances:
        """Give the same tolerances with one half as wide."""
        return Tolerances(tuple(one.halved() if k == number else one for k, one in enumerate(self.each)))


def normal_draws(tolerances: Tolerances, count: int, seed: int) -> Floats:
    """Draw standard normal variables, shape (count, tolerances)."""
    return np.random.default_rng([seed, 59]).standard_normal((count, len(tolerances.each)))


_KEYS = {"sd": "normal", "plus_minus": "uniform", "sd_percent": "normal", "plus_minus_percent": "uniform"}


def tolerances_of_table(table: FileTable) -> Tolerances:
    """Read ``[tolerance]``: each number with ``sd``, ``plus_minus``, ``sd_percent`` or ``plus_minus_percent``.

    ``distribution`` may be ``normal``, ``uniform`` or ``lognormal``, which goes with ``sd_percent``.

    Raises
    ------
    StudyError
        One line with the field, the value and what was expected.
    """
    found = []
    for name, given in table.data.items():
        if name not in CHANGES:
            raise StudyError(f"{table.at(name)} = {quoted(given)}: expected one of {listed(list(CHANGES))}")
        if not isinstance(given, Mapping):
            raise table.complain(name, "{ sd = } or { plus_minus = }, or either with _percent")
        row = table.table(name, *_KEYS, "distribution")
        keys = [key for key in _KEYS if key in row.data]
        if len(keys) != 1:
            raise StudyError(f"{row.name} = {quoted(dict(given))}: expected one of {listed(list(_KEYS))}")
        size = row.number(keys[0])
        if size <= 0:
            raise row.complain(keys[0], "above 0")
        shape = row.text("distribution", _KEYS[keys[0]], ("normal", "uniform", "lognormal"))
        if shape == "lognormal" and keys[0] != "sd_percent":
            raise row.complain("distribution", "with sd_percent where it is lognormal")
        if (shape == "uniform") != keys[0].startswith("plus_minus"):
            raise row.complain("distribution", "normal or lognormal with sd, uniform with plus_minus")
        found.append(Tolerance(name, shape, size, keys[0].endswith("percent")))  # type: ignore[arg-type]
    return Tolerances(tuple(found))
