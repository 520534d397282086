"""Coverage of the intervals of ``separate``: ``python -m benchmarks.covered_shares COUNT SEED OUT.jsonl [members]``.

Each rig is drawn from the prior about ``du2018-full-widths``: friction, play, tendons, loop of the material, arm,
depth, modulus, free length, and the law of the metal. The chain makes two records of it, at about 20 and 10 N, with
each noise. The records name it, and ``separate`` divides the loop of the first one. With ``members`` the rigs are those
of the ensemble of ``du2018-full-widths`` instead: free lengths, EA and depths differ from the declared ones by far more
than priors say, and most have play. A line a rig is kept in the file, so that a score that was ended goes on where it
stood.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import beta

from fem_models.chain import simulate_chain
from fem_models.load import triangle
from fem_models.rig import Rig, RigError, ensemble, preset
from fem_models.rig.checks import SolverError
from hysteresis import Record
from hysteresis.arrays import Floats
from validation.practice.kept_lines import whole_lines
from validation.separation import calibrate_rig, loop_program, separate
from validation.separation.contributions import SOURCES
from validation.separation.priors import drawn, laws_of

NOISES_DEG = (0.05, 0.2)
NUMBERS = {"share": "dissipated_mJ", "width_share": "width_deg"}
"""Shares of energy and of width, and what they are shares of."""
PRESET, STEP_MM = "du2018-full-widths", 0.1
ENSEMBLE = "du2018-full-widths"
REACHES_MM, HIGH_N, LOW_N = (1.6, 2.2), (18.0, 22.0), (9.0, 11.0)


@dataclass(frozen=True)
class Case:
    """A rig at the preload of the first record, the law of its metal, and what the chain makes of its two loops."""

    rig: Rig
    law: str
    preloads_N: tuple[float, float]
    drive_mm: Floats
    angles_deg: tuple[Floats, Floats]
    shares: dict[str, dict[str, float]]
    redrawn: int


@dataclass(frozen=True)
class Covered:
    """What ``separate`` said of a case: for each number and source the true share, the given one and its interval."""

    seed: int
    number: int
    noise_deg: float
    law: str
    found: dict[str, dict[str, tuple[float, float, float, float]]]
    laws: dict[str, float]
    misfit: float
    effective_draws: float
    seconds: float
    redrawn: int
    refused: str = ""
    members: bool = False

    def holds(self, number: str, source: str) -> bool:
        """Whether the interval holds the true share."""
        true, _, low, high = self.found[number][source]
        return low <= true <= high


def case_of(seed: int, number: int) -> Case:
    """Draw a rig that follows its drive; those that do not are drawn again."""
    rng, laws = np.random.default_rng([seed, number]), laws_of(preset(PRESET))
    preloads = float(rng.uniform(*HIGH_N)), float(rng.uniform(*LOW_N))
    reach = float(rng.uniform(*REACHES_MM))
    for redrawn in range(100):
        law, z = drawn(laws, rng)
        try:
            rigs = [law.rig_at(z, replace(preset(PRESET), preload_N=preload)) for preload in preloads]
            case = _case(rigs, law.name, reach)
        except (RigError, SolverError):
            continue
        if case is not None:
            return replace(case, redrawn=redrawn)
    raise RuntimeError(f"case {number} of seed {seed}: no rig of 100 follows its drive")


def member_case(seed: int, number: int) -> Case:
    """Take a member of the ensemble of the preset, at 20 and 10 N and over the paper's drive; each one once a seed.

    Raises
    ------
    RigError, SolverError
        A member that cannot be divided.
    """
    members = ensemble(ENSEMBLE)
    rig = members[int(np.random.default_rng(seed).permutation(len(members))[number])]
    case = _case([replace(rig, preload_N=preload) for preload in (20.0, 10.0)], "linear", REACHES_MM[1])
    if case is None:
        raise RigError(f"member {number}: no loop")
    return case


def _case(rigs: Sequence[Rig], law: str, reach_mm: float) -> Case | None:
    """Run both rigs, and divide the loop of the first; None where it has no loop."""
    runs = [simulate_chain(rig, triangle(reach_mm, step_mm=STEP_MM, cycles=2)) for rig in rigs]
    drive = runs[0].drive
    parts = separate(rigs[0], loop_program(float(drive.min()), float(drive.max())))
    shares = {name: parts.shares(quantity) for name, quantity in NUMBERS.items()}
    true = {name: one for name, one in shares.items() if one is not None}
    if len(true) < len(NUMBERS):
        return None
    preloads = rigs[0].preload_N, rigs[1].preload_N
    return Case(rigs[0], law, preloads, drive, (runs[0].angle_deg, runs[1].angle_deg), true, 0)


def records_of(case: Case, noise_deg: float, rng: np.random.Generator) -> list[Record]:
    """Add noise to both loops, and name the preset in place of the rig."""
    return [
        Record(
            case.drive_mm,
            angle + rng.normal(0.0, noise_deg, angle.size),
            rig={"preset": PRESET, "preload_N": preload},
            source=f"{name}.csv",
        )
        for name, angle, preload in zip("ab", case.angles_deg, case.preloads_N, strict=True)
    ]


def covered(case: Case, seed: int, number: int, noise_deg: float) -> Covered:
    """Divide the records of a case, and compare with the rig that made them."""
    from studies.commands.separation import divided_draws, parts_with_intervals

    rng = np.random.default_rng([seed, number, round(1000 * noise_deg)])
    records, began = records_of(case, noise_deg, rng), time.process_time()
    row = Covered(seed, number, noise_deg, case.law, {}, {}, 0.0, 0.0, 0.0, case.redrawn)
    try:
        calibrated = calibrate_rig(records, seed=seed)
        program = loop_program(float(case.drive_mm.min()), float(case.drive_mm.max()))
        best = replace(separate(calibrated.rig, program), has_play=calibrated.has_play)
        parts = parts_with_intervals(best, divided_draws(calibrated, program, best))
    except (RigError, SolverError, ValueError) as error:
        return replace(row, refused=str(error), seconds=round(time.process_time() - began, 2))
    found: dict[str, dict[str, tuple[float, float, float, float]]] = {name: {} for name in NUMBERS}
    for name in NUMBERS:
        for source in SOURCES:
            part = parts[source]
            value, interval = part.share_of(name), part.interval(name)
            low, high = interval or (-np.inf, np.inf)
            found[name][source] = (case.shares[name][source], np.nan if value is None else value, low, high)
    return replace(
        row,
        found=found,
        laws=calibrated.laws,
        misfit=round(calibrated.misfit, 4),
        effective_draws=round(calibrated.effective_draws, 1),
        seconds=round(time.process_time() - began, 2),
    )


def kept(path: Path) -> list[Covered]:
    """Read the rigs of an earlier score; none where there is no file."""
    return [Covered(**json.loads(line)) for line in whole_lines(path)]


def interval_of(held: int, count: int) -> tuple[float, float]:
    """Exact 95 % interval of a proportion (Clopper and Pearson 1934)."""
    low = float(beta.ppf(0.025, held, count - held + 1)) if held else 0.0
    high = float(beta.ppf(0.975, held + 1, count - held)) if held < count else 1.0
    return low, high


def counts(rows: Sequence[Covered], number: str, sources: Sequence[str] = SOURCES) -> tuple[int, int]:
    """Count the intervals that hold the true share, and all of them."""
    held = [one.holds(number, source) for one in rows if not one.refused for source in sources]
    return sum(held), len(held)


def _print(rows: Sequence[Covered]) -> None:
    for noise_deg in NOISES_DEG:
        own = [one for one in rows if one.noise_deg == noise_deg]
        refused = sum(bool(one.refused) for one in own)
        if not own:
            continue
        seconds = np.median([one.seconds for one in own])
        sys.stdout.write(f"noise {noise_deg:g} deg: {len(own)} divisions, {refused} refused, {seconds:.1f} s each\n")
        for number in NUMBERS:
            for name, sources in {"all": SOURCES, **{source: (source,) for source in SOURCES}}.items():
                held, count = counts(own, number, sources)
                low, high = interval_of(held, count)
                width = np.median([v[3] - v[2] for one in own if not one.refused for s in sources
                                   for v in [one.found[number][s]]])  # fmt: skip
                words = f"{held} of {count}, {100 * held / max(count, 1):.1f} %"
                sys.stdout.write(f"  {number}, {name}: {words} ({100 * low:.1f} to {100 * high:.1f}), ")
                sys.stdout.write(f"median width {width:.3f}\n")


def main() -> None:
    """Divide so many rigs of a seed, those that the file does not hold yet, and print the table."""
    count, seed, path, members = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]), "members" in sys.argv[4:]
    known = {(one.members, one.seed, one.number, one.noise_deg) for one in kept(path)}
    with path.open("a", encoding="utf-8") as out:
        for number in range(count):
            missing = [noise for noise in NOISES_DEG if (members, seed, number, noise) not in known]
            case = (member_case if members else case_of)(seed, number) if missing else None
            for noise_deg in missing:
                assert case is not None
                row = replace(covered(case, seed, number, noise_deg), members=members)
                out.write(json.dumps(asdict(row)) + "\n")
                out.flush()
    _print([one for one in kept(path) if (one.members, one.seed) == (members, seed) and one.number < count])


if __name__ == "__main__":
    main()
