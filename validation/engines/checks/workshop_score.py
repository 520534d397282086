"""Score of the engines on rigs of a workshop: ``python -m validation.engines.checks.workshop_score 2000 SEED``.

The first number is how many rigs the chain runs; a tenth of them goes through ``separate``, a tenth through the
multibody model, and a twentieth as many wrists through both engines in space. Each row says how many gave an answer,
how many were refused in words that name what is impossible, and how many failed.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from fem_models.chain import solve_chain
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import ImpossibleError, SolverError
from fem_models.spatial import WheelProgram, of_rig_in_space, solve_spatial
from fem_models.spatial.solve import SpatialSolution
from hysteresis.arrays import Floats
from validation.engines.checks.workshop_rigs import QUARTER_SAMPLES, workshop_rig, workshop_wrist
from validation.separation import loop_program, separate

PROCESSES = 2
ALIKE = 0.02
"""Largest difference of the engines, over the full scale of the chain."""


@dataclass(frozen=True)
class Outcome:
    """What became of one rig: ``answer``, ``refused`` or ``failed``, with words, and a number where there is one."""

    kind: str
    words: str = ""
    number: float = 0.0


def outcome_of(run: Callable[[], float]) -> Outcome:
    """Run one case; its number must be finite."""
    try:
        number = run()
    except (ImpossibleError, RigError) as error:
        return Outcome("refused", str(error))
    except SolverError as error:
        return Outcome("failed", str(error))
    return Outcome("answer" if np.isfinite(number) else "failed", "", number)


def energy_gap(rig: Rig, program: LoadProgram) -> float:
    """Work of the wheel less all losses over the closed loop of the chain, over the energy exchanged.

    NaN where an angle or a tension is not a number.
    """
    found = solve_chain(rig, program)
    if not (np.isfinite(found.record.angle_deg).all() and np.isfinite(found.segment_tensions_N).all()):
        return float("nan")
    work = found.wheel_work_mJ[QUARTER_SAMPLES:]
    lost = found.friction_loss_mJ + found.material_loss_mJ + found.viscous_loss_mJ + found.jump_loss_mJ
    return float(abs(work[-1] - work[0] - lost[-1] + lost[QUARTER_SAMPLES]) / np.ptp(work))


def _chain(seed: int, number: int) -> Outcome:
    return outcome_of(partial(energy_gap, *workshop_rig((seed, number))))


def _separated(seed: int, number: int) -> Outcome:
    rig, program = workshop_rig((seed, number))
    high = float(program.drive_mm.max())

    def largest_share() -> float:
        found = separate(rig, loop_program(0.0 if rig.tendon_b is None else -high, high))
        shares = [found.shares(name) or {} for name in ("width_deg", "area", "dissipated_mJ")]
        return float(np.max([0.0, *(abs(value) for each in shares for value in each.values())]))

    return outcome_of(largest_share)


def _multibody(seed: int, number: int) -> Outcome:
    from fem_models.multibody.quasi_static import solve_multibody

    rig, program = workshop_rig((seed, number))

    def difference() -> float:
        chain, bodies = solve_chain(rig, program).record.angle_deg, solve_multibody(rig, program).record.angle_deg
        return float(np.abs(bodies - chain).max() / np.abs(chain).max())

    return outcome_of(difference)


def _wrist(seed: int, number: int) -> Outcome:
    return outcome_of(lambda: float(np.ptp(_wrist_bending(seed, number, solve_spatial))))


def _wrist_multibody(seed: int, number: int) -> Outcome:
    from fem_models.multibody.spatial import solve_spatial_multibody

    def difference() -> float:
        chain = _wrist_bending(seed, number, solve_spatial)
        bodies = _wrist_bending(seed, number, solve_spatial_multibody)
        return float(np.abs(bodies - chain).max() / np.abs(chain).max())

    return outcome_of(difference)


def _wrist_bending(seed: int, number: int, solve: Callable[..., SpatialSolution]) -> Floats:
    """Bending of a wrist in both planes, shape (samples, 2)."""
    wrist, drives = workshop_wrist((seed, number))
    return solve(of_rig_in_space(wrist), WheelProgram(np.array(drives)).of_tendons(wrist)).bending_deg


def score(name: str, case: Callable[[int, int], Outcome], seed: int, count: int) -> list[Outcome]:
    """Run cases and print what became of them."""
    with ProcessPoolExecutor(PROCESSES) as pool:
        found = list(pool.map(partial(case, seed), range(count), chunksize=max(1, min(20, count // 20))))
    kinds = Counter(outcome.kind for outcome in found)
    sys.stdout.write(f"{name}: {kinds['answer']} of {count} answer, {kinds['refused']} refused in words, ")
    sys.stdout.write(f"{kinds['failed']} failed\n")
    for number, outcome in enumerate(found):
        if outcome.kind != "answer":
            sys.stdout.write(f"  {number} {outcome.kind}: {outcome.words[-160:]}\n")
    return found


def numbers(found: Sequence[Outcome]) -> Floats:
    """Numbers of the answers, sorted."""
    return np.sort([outcome.number for outcome in found if outcome.kind == "answer"])


def _say_alike(found: Sequence[Outcome]) -> None:
    off = numbers(found)
    sys.stdout.write(
        f"  within {100 * ALIKE:g} % of the full scale of the chain: {(off <= ALIKE).sum()} of {off.size}; "
    )
    sys.stdout.write(f"largest {', '.join(f'{100 * value:.2g} %' for value in off[-5:])}\n")


def main() -> None:
    """Score so many rigs of a seed."""
    count, seed = (int(text) for text in sys.argv[1:3])
    gaps = numbers(score("chain", _chain, seed, count))
    sys.stdout.write(f"  energy gap: median {np.median(gaps):.1e}, 99 % below {np.quantile(gaps, 0.99):.1e}\n")
    score("separate", _separated, seed, count // 10)
    _say_alike(score("multibody", _multibody, seed, count // 10))
    score("wrists, chain", _wrist, seed, count // 20)
    _say_alike(score("wrists, multibody", _wrist_multibody, seed, count // 20))


if __name__ == "__main__":
    main()
