"""A load program on all rigs of an ensemble: what ``notchbend simulate --ensemble`` adds to a record."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from fem_models.chain import solve_chain
from fem_models.chain.solve import ChainSolution
from fem_models.load import LoadProgram
from fem_models.rig import Rig
from hysteresis.arrays import Floats
from studies.results.ensemble import EnsembleRanges, NumberRange
from studies.results.run import LoopSummary, loop_summary
from validation.separation.ensemble import LEVEL, range_of

_ENDS = (0.5 - LEVEL / 2, 0.5, 0.5 + LEVEL / 2)


@dataclass(frozen=True)
class EnsembleRun:
    """Drive, shape (m,), the angle's range at every sample, deg, shape (m, 3): low, median, high; and the summary."""

    drive_mm: Floats
    angle_deg: Floats
    summary: EnsembleRanges

    def csv(self) -> str:
        """Give the ranges of the angle as a table."""
        lines = ["drive_mm,angle_low_deg,angle_median_deg,angle_high_deg"]
        rows = np.column_stack([self.drive_mm, self.angle_deg]).tolist()
        return "\n".join([*lines, *(",".join(f"{value:.6g}" for value in row) for row in rows)]) + "\n"


def run_ensemble(members: Sequence[Rig], program: LoadProgram, *, threads: int | None = None) -> EnsembleRun:
    """Run a program on all members by the chain, in threads; ranges of 90 %.

    Raises
    ------
    SolverError, RigError
        From the chain: a member that cannot follow the drive.
    """
    with ThreadPoolExecutor(threads) as pool:
        solutions = list(pool.map(lambda rig: solve_chain(rig, program), members))
    numbers = [_numbers(one) for one in solutions]
    names = [name for name in numbers[0] if all(name in one for one in numbers)]
    ranges = {name: NumberRange(**vars(range_of([one[name] for one in numbers]))) for name in names}
    angles = np.quantile([one.record.angle_deg for one in solutions], _ENDS, axis=0)
    return EnsembleRun(program.drive_mm, angles.T, EnsembleRanges(len(members), LEVEL, ranges))


def _numbers(solution: ChainSolution) -> dict[str, float]:
    """Numbers of one run; those of a loop only if the program closes one."""
    found = loop_summary(solution.record)
    out = {"full_scale_deg": found.full_scale_deg}
    if isinstance(found, LoopSummary):
        out |= {
            "loop_width_deg": found.loop_width_deg,
            "widest_at_drive_mm": found.widest_at_drive_mm,
            "loop_area_deg_mm": found.loop_area_deg_mm,
        }
    tensions = solution.segment_tensions_N
    out |= {"tension_max_N": float(tensions.max()), "tension_min_N": float(tensions.min())}
    strain = float(solution.peak_strain.max())
    return out | ({"peak_strain_percent": 100 * strain} if np.isfinite(strain) else {})
