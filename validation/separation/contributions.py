"""What makes the loop: friction, elasticity of the tendons, material, switched in the mechanical model.

All eight combinations of the three sources run through the same closed loop. Off means: no dry friction; a rope so
stiff that it makes no loop worth the name (:data:`RIGID`), without toe region; a linear material of the same modulus.

A width or an energy v(S) of each combination S is divided so: a source has what it makes alone, v({i}) - v({}), and
half of what it makes together with elasticity, v({i, e}) - v({i}) - v({e}) + v({}); elasticity has the other half. That
is the Shapley value (1953, doi 10.1515/9781400881970-018) of a rig with friction, or with the material, as the only
loss. What the two losses make of each other is the interaction, v(all) - v({f, e}) - v({m, e}) + v({e}). The four add
up to v(all) - v({}). The full Shapley values, in which the interaction is divided too, stand beside.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fem_models.chain.solve import solve_chain
from fem_models.joint.flexure import flexure
from fem_models.load.program import LoadProgram
from fem_models.rig.checks import RigError, SolverError
from fem_models.rig.rig import Friction, Rig, Tendon
from hysteresis.metrics import dissipated_area, loop_width
from hysteresis.record import Record

SOURCES = ("friction", "tendon_elasticity", "material")
PARTS = (*SOURCES, "interaction")
SETS = tuple(frozenset(s) for k in range(4) for s in combinations(SOURCES, k))
"""All combinations of sources, from none to all."""

RIGID = 5e4
"""Stiffness of a rope that is off, seen as bending of the whole row of joints, over that of the joints themselves."""
STIFFENED = 3e3
"""Times its own EA, where that is more, up to 10 times :data:`RIGID`: beyond, rounding makes the chain slow."""
STEPS = 88  # from one end of the drive to the other: twice the paper's; the wheel's work is summed over them
NO_LOSS = 1e-4  # of the work that goes to and fro: a loop of less is rounding
NO_WIDTH = 1e-4  # of the range of the angle

_MEMORY = ("backlash", "creep", "drag", "preload_loss", "fatigue")  # loops that none of the three sources makes

Value = Mapping[frozenset[str], float]


class Solution(Protocol):
    """What a mechanical engine gives, chain or multibody."""

    @property
    def record(self) -> Record:
        """The run."""

    @property
    def wheel_work_mJ(self) -> NDArray[np.float64]:
        """Shape (m,), cumulative, as the losses."""

    @property
    def friction_loss_mJ(self) -> NDArray[np.float64]:
        """Shape (m,)."""

    @property
    def material_loss_mJ(self) -> NDArray[np.float64]:
        """Shape (m,)."""


class Solver(Protocol):
    """An engine with its book-keeping of energy."""

    def __call__(self, rig: Rig, program: LoadProgram, /) -> Solution:
        """Run a program on a rig."""


@dataclass(frozen=True)
class Loop:
    """Closed loop of one combination; energies are those of its last cycle, by the engine's book-keeping."""

    record: Record
    width_deg: float
    area: float  # deg mm
    dissipated_mJ: float  # work of the wheel
    friction_mJ: float
    material_mJ: float
    swing_mJ: float  # range of the work within the cycle

    @property
    def is_lossless(self) -> bool:
        """Whether the loop dissipates nothing beyond rounding."""
        return self.dissipated_mJ <= NO_LOSS * self.swing_mJ

    @property
    def is_flat(self) -> bool:
        """Whether the angle shows no loop."""
        return self.width_deg <= NO_WIDTH * float(np.ptp(self.record.angle_deg))


@dataclass(frozen=True)
class Contributions:
    """Loops of all combinations, and their division among :data:`PARTS`."""

    loops: Mapping[frozenset[str], Loop]

    @property
    def whole(self) -> Loop:
        """Loop of the rig as it is."""
        return self.loops[SETS[-1]]

    def values(self, name: str) -> dict[frozenset[str], float]:
        """``width_deg``, ``area`` or ``dissipated_mJ`` of all combinations."""
        return {on: float(getattr(loop, name)) for on, loop in self.loops.items()}

    def shares(self, name: str) -> dict[str, float] | None:
        """Parts over their sum; None where the rig has no such loop. They add up to 1."""
        if self.whole.is_lossless or (name != "dissipated_mJ" and self.whole.is_flat):
            return None
        return _over_sum(divide(self.values(name)))

    @property
    def closure_percent(self) -> float:
        """How far the four parts of the energy are from the losses that the engine kept books of."""
        lost = self.whole.friction_mJ + self.whole.material_mJ
        if self.whole.is_lossless or lost == 0:
            return 0.0
        return 100 * (sum(divide(self.values("dissipated_mJ")).values()) / lost - 1)

    @property
    def residual_percent(self) -> float | None:
        """Width left with all but the ropes on, over the whole: what a rope that is off still gives."""
        if self.whole.is_flat:
            return None
        return 100 * self.loops[frozenset({"friction", "material"})].width_deg / self.whole.width_deg


def divide(v: Value) -> dict[str, float]:
    """Divide v(all) - v({}) among friction, elasticity, material and their interaction, as the module says."""
    f, e, m = ({name} for name in SOURCES)

    def of(*sets: set[str]) -> float:
        return v[frozenset().union(*sets)]

    with_friction = of(f, e) - of(f) - of(e) + of()
    with_material = of(m, e) - of(m) - of(e) + of()
    return {
        "friction": of(f) - of() + 0.5 * with_friction,
        "tendon_elasticity": of(e) - of() + 0.5 * (with_friction + with_material),
        "material": of(m) - of() + 0.5 * with_material,
        "interaction": of(f, e, m) - of(f, e) - of(m, e) + of(e),
    }


def shapley(v: Value) -> dict[str, float]:
    """Give the Shapley value of each source: what it adds, mean over all orders of switching on."""
    n, out = len(SOURCES), dict.fromkeys(SOURCES, 0.0)
    for name in SOURCES:
        for before in SETS:
            if name not in before:
                k = len(before)
                weight = math.factorial(k) * math.factorial(n - k - 1) / math.factorial(n)
                out[name] += weight * (v[before | {name}] - v[before])
    return out


def _over_sum(parts: dict[str, float]) -> dict[str, float]:
    total = sum(parts.values())
    return {name: value / total for name, value in parts.items()}


def shapley_shares(found: Contributions, name: str) -> dict[str, float] | None:
    """Shapley values over their sum; None where the rig has no such loop."""
    return None if found.shares(name) is None else _over_sum(shapley(found.values(name)))


def switched(rig: Rig, on: frozenset[str]) -> Rig:
    """Leave the sources ``on`` of a rig as they are, and switch the others off.

    Raises
    ------
    RigError
        A rig with a loop that is none of the three sources'.
    """
    for name in _MEMORY:
        if getattr(rig, name) is not None:
            found = f"rig {rig.name}: {name}: makes a loop of its own"
            raise RigError(f"{found}: expected a rig with friction, tendons and material alone")
    if "friction" not in on:
        rig = replace(rig, friction=Friction())
    if "tendon_elasticity" not in on:
        b = None if rig.tendon_b is None else _rigid(rig, rig.tendon_b)
        rig = replace(rig, tendon_a=_rigid(rig, rig.tendon_a), tendon_b=b)
    if "material" not in on:
        rig = replace(rig, material=replace(rig.material, loop_share=0.0), superelastic=None)
    return rig


def _rigid(rig: Rig, rope: Tendon) -> Tendon:
    """Make a rope stiff against the joints and against what it was; one beyond what can be solved keeps its EA."""
    joints = flexure(rig).bending_Nmm_per_rad / rig.joints
    length = rope.free_length_mm + rig.joints * rig.pitch_mm
    rigid = RIGID * joints * length / rope.moment_arm_mm**2
    return replace(rope, EA_N=max(rope.EA_N, rigid, min(STIFFENED * rope.EA_N, 10 * rigid)), toe_N=0.0)


def loop_program(low_mm: float, high_mm: float, *, cycles: int = 2) -> LoadProgram:
    """Go from rest to the upper end, then down and up again ``cycles`` times, point by point.

    Raises
    ------
    RigError
        A lower end that is not below the upper one.
    """
    if not low_mm < high_mm:
        raise RigError(f"drive from {low_mm:g} to {high_mm:g} mm: expected the first below the second")
    step = (high_mm - low_mm) / STEPS
    approach = np.linspace(0.0, high_mm, max(1, math.ceil(abs(high_mm) / step - 1e-9)) + 1)
    down = np.linspace(high_mm, low_mm, STEPS + 1)[1:]
    cycle = np.concatenate([down, np.append(down[::-1][1:], high_mm)])
    numbers = np.repeat(np.arange(cycles + 1), [approach.size, *[cycle.size] * cycles])
    return LoadProgram(np.concatenate([approach, *[cycle] * cycles]), cycle=numbers)


def closed_loop(rig: Rig, program: LoadProgram, solve: Solver = solve_chain) -> Loop:
    """Run a program of :func:`loop_program` and measure its last cycle, which is closed.

    Raises
    ------
    SolverError, RigError
        From the engine.
    """
    assert program.cycle is not None
    solution = solve(rig, program)
    record, numbers = solution.record, program.cycle
    last = slice(int(np.flatnonzero(numbers == numbers[-1])[0]) - 1, None)
    drive, angle, once = record.drive[last], record.angle_deg[last], np.ones(record.drive[last].size, dtype=int)
    work = solution.wheel_work_mJ[last]
    return Loop(
        record=record,
        width_deg=loop_width(drive, angle, once).max_deg,
        area=dissipated_area(drive, angle, once),
        dissipated_mJ=float(work[-1] - work[0]),
        friction_mJ=float(np.diff(solution.friction_loss_mJ[last]).sum()),
        material_mJ=float(np.diff(solution.material_loss_mJ[last]).sum()),
        swing_mJ=float(np.ptp(work)),
    )


def contributions(rig: Rig, program: LoadProgram, solve: Solver = solve_chain) -> Contributions:
    """Run all combinations of sources through one program of :func:`loop_program`.

    Raises
    ------
    SolverError, RigError
        From the engine, with the combination that failed, or from :func:`switched`.
    """
    loops = {}
    for on in SETS:
        try:
            loops[on] = closed_loop(switched(rig, on), program, solve)
        except SolverError as error:
            without = ", ".join(name.replace("_", " ") for name in SOURCES if name not in on) or "nothing"
            raise SolverError(f"{error} (with {without} switched off)") from None
    return Contributions(loops)
