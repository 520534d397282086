"""Contributions of friction, tendon elasticity and material to the hysteresis loop of a rig.

The mechanical model runs all eight combinations of the three sources through the same closed loop. A source that is off
means: no dry friction; a tendon so stiff that its loop is negligible (:data:`RIGID`), without a toe region; a linear
material of the same modulus. Inextensible tendons are approached: EA grows tenfold at a time until the shares stop
moving, the tendon is that stiff, or the engine no longer balances its energy. Where shares still move then, tendons of
that rig would jam: both are wound on one wheel, and their paths along the bent tube do not add up to the same length.
:attr:`Contributions.moved` says by how much.

A notch may close with a source switched off that is open with all of them. Its edges then pass each other: such a
combination is a number in the division, not a rig.

Let v(S) be the width or the energy of the loop with the combination S on. A source i gets what it makes alone,
v({i}) - v({}), and half of what it makes together with elasticity, v({i, e}) - v({i}) - v({e}) + v({}). Elasticity gets
the other half. This is the Shapley value (1953, doi 10.1515/9781400881970-018) of a rig whose only loss is friction, or
only the material. The interaction is what the two losses change in each other,
v(all) - v({f, e}) - v({m, e}) + v({e}). The four parts add up to v(all) - v({}). The full Shapley values, which divide
the interaction too, are computed as well.

Play between drive and wheel dissipates nothing and stays on in all combinations. v({}) is then its loop: a part of its
own, ``play``, and what the others add to it is divided as above.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fem_models.chain import solve_chain
from fem_models.joint import joint_row
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import ClosedNotchError, SolverError
from fem_models.rig.effects import Closure
from fem_models.rig.rig import Friction, Tendon
from hysteresis import Record
from hysteresis.records.metrics import dissipated_area, loop_width

SOURCES = ("friction", "tendon_elasticity", "material")
PARTS = (*SOURCES, "interaction")
PLAY = "play"
"""Part of a rig with backlash, beside :data:`PARTS`."""
SETS = tuple(frozenset(s) for k in range(4) for s in combinations(SOURCES, k))
"""All combinations of sources, from none to all."""

RIGID = 5e4
"""Bending stiffness of all joints in series that a switched-off tendon enforces, over that of the joints themselves."""
STIFFENED = 3e3
"""Factor on the tendon's own EA, used where it gives more than :data:`RIGID`, up to 10 times :data:`RIGID`.

Beyond that, rounding errors slow the chain's solver down.
"""
FIRST_STIFFENED = 30.0
"""Factor on EA, or a little less, with which the approach to inextensible tendons begins."""
SETTLED = 2e-3
"""Largest change of a share from a tenfold EA at which shares have stopped moving, over 1 or the largest share."""
UNBALANCED = 0.02
"""Work of the wheel less all losses of a cycle, over the losses: beyond it stiffened tendons are too stiff."""
OPEN_ENDED = Closure(stiffness_Nmm_per_rad=1e-6)
"""Edges of notches that give way."""
STEPS = 88
"""Steps from one end of the drive to the other: twice the paper's number. The wheel's work is summed over them."""
NO_LOSS = 1e-4
"""Dissipated energy over the energy exchanged within a cycle; a loop below this is rounding error."""
NO_WIDTH = 1e-4
"""Loop width over the range of the angle; a loop below this is rounding error."""

_OTHER_LOOPS = ("creep", "drag", "preload_loss", "fatigue")  # effects with a loop of none of the sources

Value = Mapping[frozenset[str], float]


class Solution(Protocol):
    """Result of a mechanical engine, chain or multibody."""

    @property
    def record(self) -> Record:
        """The run."""

    @property
    def wheel_work_mJ(self) -> NDArray[np.float64]:
        """Shape (m,), cumulative like the losses."""

    @property
    def friction_loss_mJ(self) -> NDArray[np.float64]:
        """Shape (m,)."""

    @property
    def material_loss_mJ(self) -> NDArray[np.float64]:
        """Shape (m,)."""

    @property
    def jump_loss_mJ(self) -> NDArray[np.float64]:
        """Shape (m,)."""


class Solver(Protocol):
    """A mechanical engine that records its energy balance."""

    def __call__(self, rig: Rig, program: LoadProgram, /) -> Solution:
        """Run a program on a rig."""


@dataclass(frozen=True)
class Loop:
    """Closed loop of one combination; energies are those of its last cycle, from the engine's energy balance."""

    record: Record
    width_deg: float
    area: float  # deg mm
    dissipated_mJ: float  # work of the wheel
    friction_mJ: float
    material_mJ: float
    jump_mJ: float  # of a tube that jumps
    swing_mJ: float  # range of the work within the cycle

    @property
    def lost_mJ(self) -> float:
        """All losses that the engine has booked."""
        return self.friction_mJ + self.material_mJ + self.jump_mJ

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
    """Loops of all combinations of sources; their width or energy divides into :data:`PARTS`, and play if there is.

    Parameters
    ----------
    softer
        How many times softer the stiffened tendons are than :data:`RIGID` says.
    stiffened
        EA of a tendon whose elasticity is off, over its own.
    moved
        Largest change of a share of width or energy from the last tenfold EA, over 1 or the largest share; infinite
        where there was one step only.
    """

    loops: Mapping[frozenset[str], Loop]
    has_play: bool = False
    softer: float = 1.0
    moved: float = 0.0
    stiffened: float = math.inf

    @property
    def whole(self) -> Loop:
        """Loop of the rig with all sources on."""
        return self.loops[SETS[-1]]

    @property
    def is_balanced(self) -> bool:
        """Whether in every loop with stiffened tendons the work is what was lost; of a rig without losses always."""
        return self.whole.is_lossless or all(
            abs(loop.dissipated_mJ - loop.lost_mJ) <= UNBALANCED * (self.whole.lost_mJ + loop.lost_mJ)
            for on, loop in self.loops.items()
            if "tendon_elasticity" not in on
        )

    def values(self, name: str) -> dict[frozenset[str], float]:
        """``width_deg``, ``area`` or ``dissipated_mJ`` of all combinations."""
        return {on: float(getattr(loop, name)) for on, loop in self.loops.items()}

    def parts(self, name: str) -> dict[str, float]:
        """Parts of ``width_deg``, ``area`` or ``dissipated_mJ``: :data:`PARTS`, and :data:`PLAY` of a rig with play."""
        values = self.values(name)
        return divide(values) | ({PLAY: values[SETS[0]]} if self.has_play else {})

    def shares(self, name: str) -> dict[str, float] | None:
        """Parts over their sum, which add up to 1; None if the rig has no such loop."""
        if self.whole.is_lossless if name == "dissipated_mJ" else self.whole.is_flat:
            return None
        return _over_sum(self.parts(name))

    @property
    def closure_percent(self) -> float:
        """Sum of the four energy parts against the losses in the engine's energy balance: relative error, percent."""
        lost = self.whole.lost_mJ
        if self.whole.is_lossless or lost == 0:
            return 0.0
        return 100 * (sum(divide(self.values("dissipated_mJ")).values()) / lost - 1)

    @property
    def residual_percent(self) -> float | None:
        """Loop width with tendon elasticity off, over the full width: what a stiffened tendon still contributes.

        Without the loop of the play, which remains.
        """
        if self.whole.is_flat:
            return None
        values = self.values("width_deg")
        play = values[SETS[0]] if self.has_play else 0.0
        return 100 * max(0.0, values[frozenset({"friction", "material"})] - play) / self.whole.width_deg


def divide(v: Value) -> dict[str, float]:
    """Divide v(all) - v({}) into friction, elasticity, material and interaction, as the module's docstring defines."""
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
    """Compute the Shapley value of each source: its added value, averaged over all orders of switching on."""
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
    """Shapley values over their sum; None if the rig has no such loop."""
    return None if found.shares(name) is None else _over_sum(shapley(found.values(name)))


def switched(rig: Rig, on: frozenset[str], softer: float = 1.0) -> Rig:
    """Keep the sources ``on`` of a rig and switch the others off; ``softer`` as of :class:`Contributions`.

    Raises
    ------
    RigError
        The rig has an effect with a loop of its own.
    """
    for name in _OTHER_LOOPS:
        if getattr(rig, name) is not None:
            found = f"rig {rig.name}: {name}: has a loop of its own"
            raise RigError(f"{found}: expected a rig with friction, tendon elasticity and material loop only")
    if "friction" not in on:
        rig = replace(rig, friction=Friction())
    if "tendon_elasticity" not in on:
        b = None if rig.tendon_b is None else _rigid(rig, rig.tendon_b, softer)
        rig = replace(rig, tendon_a=_rigid(rig, rig.tendon_a, softer), tendon_b=b)
    if "material" not in on:
        rig = replace(rig, material=replace(rig.material, loop_share=0.0), superelastic=None)
    return rig


def _rigid(rig: Rig, tendon: Tendon, softer: float = 1.0) -> Tendon:
    """Stiffen a tendon relative to the joints and to its own EA; a stiffer one than can be solved keeps its EA."""
    each = joint_row(rig)
    if each.alike:
        joints = each.first.flexure.bending_Nmm_per_rad / rig.joints
    else:
        joints = float(1 / (1 / each.of("flexure.bending_Nmm_per_rad")).sum())
    length = tendon.free_length_mm + rig.length_mm
    rigid = RIGID * joints * length / tendon.moment_arm_mm**2
    stiffest = max(rigid, min(STIFFENED * tendon.EA_N, 10 * rigid))
    return replace(tendon, EA_N=max(tendon.EA_N, stiffest / softer), toe_N=0.0)


def loop_program(low_mm: float, high_mm: float, *, cycles: int = 2, steps: int | None = None) -> LoadProgram:
    """Drive from rest to the upper end, then down and up again ``cycles`` times, quasi-static.

    ``steps`` from one end to the other are :data:`STEPS` by default.

    Raises
    ------
    RigError
        The lower end is not below the upper one.
    """
    if not low_mm < high_mm:
        raise RigError(f"drive from {low_mm:g} to {high_mm:g} mm: expected the lower end below the upper end")
    steps = steps or STEPS
    step = (high_mm - low_mm) / steps
    approach = np.linspace(0.0, high_mm, max(1, math.ceil(abs(high_mm) / step - 1e-9)) + 1)
    down = np.linspace(high_mm, low_mm, steps + 1)[1:]
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
        jump_mJ=float(np.diff(solution.jump_loss_mJ[last]).sum()),
        swing_mJ=float(np.ptp(work)),
    )


def separate(
    rig: Rig, program: LoadProgram, solve: Solver = solve_chain, *, softer: float | None = None
) -> Contributions:
    """Run all combinations of sources through one program of :func:`loop_program`.

    ``softer`` is that of :class:`Contributions` where it is known, for rigs that differ by little; else EA grows until
    the shares settle.

    Raises
    ------
    SolverError, RigError
        From the engine, with the combination that failed; or from :func:`switched`.
    """
    with_own = {on: _loop_with(rig, on, 1.0, program, solve) for on in SETS if "tendon_elasticity" in on}

    def at(level: float) -> Contributions:
        stiffened = {on: _loop_with(rig, on, level, program, solve) for on in SETS if on not in with_own}
        loops = {on: with_own[on] if on in with_own else stiffened[on] for on in SETS}
        return Contributions(loops, rig.backlash is not None, level, math.inf, _stiffened(rig, level))

    if softer is not None:
        return at(softer)
    levels = _levels(rig)
    found = _followed(at, levels[0])
    if found is None:  # these tendons jam, or fold the tube, at once
        return at(10.0 * levels[0])
    for level in levels[1:]:
        now = _followed(at, level)
        if now is None:
            break
        found = replace(now, moved=_moved(found, now))
        if found.moved <= SETTLED:
            break
    return found


def _followed(at: Callable[[float], Contributions], level: float) -> Contributions | None:
    """Divide the loop with tendons of a stiffness; None where they are too stiff to be followed."""
    try:
        found = at(level)
    except SolverError:
        return None
    return found if found.is_balanced else None


def _levels(rig: Rig) -> list[float]:
    """Values of ``softer`` on the way to inextensible tendons, the first one largest."""
    grows = _stiffened(rig, 1.0)
    return [10.0**k for k in range(max(1, round(math.log10(grows / FIRST_STIFFENED))), -1, -1)]


def _stiffened(rig: Rig, softer: float) -> float:
    """EA of a tendon whose elasticity is off, over its own."""
    return max(_rigid(rig, tendon, softer).EA_N / tendon.EA_N for tendon in rig.tendons)


def _moved(one: Contributions, other: Contributions) -> float:
    """Largest difference of a share of width or energy, over 1 or the largest share."""
    largest = 0.0
    for name in ("width_deg", "dissipated_mJ"):
        a, b = one.shares(name), other.shares(name)
        if a is not None and b is not None:
            scale = max(1.0, *map(abs, b.values()))
            largest = max(largest, *(abs(a[part] - b[part]) / scale for part in b))
    return largest


def _loop_with(rig: Rig, on: frozenset[str], softer: float, program: LoadProgram, solve: Solver) -> Loop:
    """Run one combination; the edges of its notches may pass each other where that of the whole rig do not."""
    one = switched(rig, on, softer)
    try:
        try:
            return closed_loop(one, program, solve)
        except (ClosedNotchError, RigError):  # before the run, or in it
            if on == SETS[-1] or one.closure is not None:
                raise
            return closed_loop(replace(one, closure=OPEN_ENDED), program, solve)
    except SolverError as error:
        without = ", ".join(name.replace("_", " ") for name in SOURCES if name not in on) or "nothing"
        raise SolverError(f"{error} (with {without} switched off)") from None
