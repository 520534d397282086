"""Speed of the engines: ``pytest benchmarks/test_speed.py`` prints one table at the end.

No time is asserted: the table shows medians with the limits of the project. The results are asserted, so that a fast
wrong answer fails.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from exudyn_cost import counted
from growth import JOINTS, SIZES, batch, cycle_of, rig_of, step_of

from fem_models.chain import solve as chain
from fem_models.chain.solve import ChainSettings, solve_chain
from fem_models.load import LoadProgram
from fem_models.multibody.quasi_static import MultibodySettings, solve_multibody
from fem_models.rig import Rig

LIMIT_CHAIN_S = 6e-4
LIMIT_BATCH_S = 0.6
LIMIT_MULTIBODY_S = 0.25
EXPONENT_CHAIN = 1.2
EXPONENT_MULTIBODY = 1.4


def fixed_cost_s(rig: Rig) -> float:
    """Time of a solve without steps: preparing the rig and the record; median of 9."""
    still, times = LoadProgram(np.array([0.0, 0.0])), []
    for _ in range(9):
        start = time.perf_counter()
        solve_chain(rig, still)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def test_chain_cycle(table: Any, median_s: Callable[..., float]) -> None:
    """One cycle of the default rig."""
    rig, program = rig_of(JOINTS), cycle_of(JOINTS)
    seconds = median_s(lambda: solve_chain(rig, program), rounds=30)
    notes = f"{1e3 * fixed_cost_s(rig):.3g} ms of it before the first step"
    table.add("chain, N = 14, one cycle of 88 steps", seconds, LIMIT_CHAIN_S, notes=notes)


@pytest.mark.parametrize("scaled_tendon", [False, True], ids=["tendon", "scaled-tendon"])
@pytest.mark.parametrize("joints", SIZES)
def test_chain_exponent(joints: int, scaled_tendon: bool, table: Any, median_s: Callable[..., float]) -> None:
    """Growth of the cost of the steps with N, without the fixed cost of a solve."""
    rig, program = rig_of(joints, scaled_tendon=scaled_tendon), cycle_of(joints)
    settings = ChainSettings(max_step_mm=step_of(joints))
    series = "chain, steps alone, free length scaled with N" if scaled_tendon else "chain, steps alone"
    table.exponent_limits[series] = EXPONENT_CHAIN
    top = solve_chain(rig, program, settings).record.angle_deg.max()
    assert top == pytest.approx(45.2 * joints / JOINTS, rel=0.06)  # 45.2 deg at 14: the paper's full scale, 45 deg
    seconds = median_s(lambda: solve_chain(rig, program, settings), rounds=15) - fixed_cost_s(rig)
    table.add(f"{series}, N = {joints}", seconds, series=series, size=joints, notes=f"{top:.1f} deg")


def test_chain_batch(table: Any, median_s: Callable[..., float]) -> None:
    """One call for a thousand rigs."""
    solve_batch = getattr(chain, "solve_batch", None)
    if solve_batch is None:
        pytest.skip("fem_models.chain.solve has no solve_batch yet")
    rigs, program = batch(1_000), cycle_of(JOINTS)
    seconds = median_s(lambda: solve_batch(rigs, program), rounds=3)
    angle = solve_batch(rigs, program).angle_deg
    assert angle.shape == (1_000, program.drive_mm.size)
    assert np.isfinite(angle).all()
    alone = solve_chain(rigs[-1], program).record.angle_deg
    np.testing.assert_allclose(angle[-1], alone, atol=1e-6)  # the single solve
    table.add("chain, batch of 1,000 rigs", seconds, LIMIT_BATCH_S)


@pytest.mark.parametrize("joints", SIZES[:4])
def test_multibody(joints: int, table: Any, median_s: Callable[..., float]) -> None:
    """One cycle, its growth with N, and where the time goes according to Exudyn's counters."""
    rig, program = rig_of(joints), cycle_of(joints)
    settings = MultibodySettings(max_step_mm=step_of(joints))
    table.exponent_limits["multibody"] = EXPONENT_MULTIBODY
    with counted() as cost:
        top = solve_multibody(rig, program, settings).record.angle_deg.max()
    assert top == pytest.approx(45.2 * joints / JOINTS, rel=0.06)  # as in the chain
    seconds = median_s(lambda: solve_multibody(rig, program, settings), rounds=3 if joints <= 14 else 1)
    share = {k: f"{v / cost.total_s:.0%}" for k, v in asdict(cost).items() if k.endswith("_s") and k != "total_s"}
    notes = (
        f"{cost.solved} solves, {cost.failed} failed, {cost.newton} Newton iterations of "
        f"{1e3 * cost.total_s / cost.newton:.2f} ms: Jacobian {share['jacobian_s']}, "
        f"factorization {share['factorization_s']}, residual {share['residual_s']}"
    )
    limit = LIMIT_MULTIBODY_S if joints == JOINTS else None
    table.add(f"multibody, N = {joints}", seconds, limit, series="multibody", size=joints, notes=notes)
