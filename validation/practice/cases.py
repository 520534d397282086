"""Practice cases: four records of one rig with effects hidden in them, drawn from a seed.

``python -m validation.practice.cases --set work --kind known --out DIR`` writes them as record files.

The size of an effect counts as moderate: what it adds to the angle, after the constants that the declared model fits
have taken what they can (to first order), is 3 to 8 times the noise, root mean square over the four records. Sizes are
solved for with the chain; one case in five is then made by the multibody model.
"""

from __future__ import annotations

import argparse
import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np
from rich.progress import track

from fem_models.chain.solve import simulate_chain
from fem_models.load import LoadProgram
from fem_models.multibody.quasi_static import simulate_multibody
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from hysteresis.record import Record
from hysteresis.record_file import write_record
from validation.practice.hidden import CATALOGUE, DISTINCT, Family, Hidden
from validation.practice.outside import OUTSIDE
from validation.practice.protocols import KINDS, Ground, Kind, Protocol, draw_ground

Engine = Callable[[Rig, LoadProgram], Record]
SetName = Literal[
    "work", "score", "score-2", "score-3", "score-4", "score-5", "score-6", "score-7", "score-8", "score-9"
]
SETS: dict[SetName, int] = {
    "work": 20_180_001,
    "score": 20_261_121,
    "score-2": 20_261_122,
    "score-3": 20_261_123,
    "score-4": 20_261_125,
    "score-5": 20_261_126,
    "score-6": 20_261_127,
    "score-7": 20_261_128,
    "score-8": 20_261_129,
    "score-9": 20_261_130,
}
"""Entropy of the set that a search may be tuned on, and of those that it is scored on: a new one after a look at it."""

CLEAN, PAIR = "clean", "pair"
LABELS = (*CATALOGUE, CLEAN, PAIR, *OUTSIDE)
MODERATE = (3.0, 8.0)  # times the noise
CLOSE = 0.1  # of the size that was asked for
MEASURED_JOINTS = 0.25  # part of the cases whose rig is of measured joints in place of the preset
ATTEMPTS = 40
_STEP = 0.02  # of a constant, for the declared model's tangent
_CURVE_DEGREE = 7  # of the polynomial that stands for f(x) where the geometry is unknown


@dataclass(frozen=True)
class Truth:
    """What was hidden, and how large.

    ``ratios`` are the sizes over the noise, one an effect; ``beyond_curve`` the same where f(x) is free besides, as
    with an unknown geometry.
    """

    effects: tuple[str, ...]
    numbers: dict[str, dict[str, float]]
    ratios: tuple[float, ...]
    beyond_curve: tuple[float, ...]
    engine: str
    noise_deg: float
    rig: str


@dataclass(frozen=True)
class Case:
    """Records with a secret; the name is that of its folder."""

    name: str
    records: tuple[Record, ...]
    truth: Truth


def draw_case(set_name: SetName, kind: Kind, label: str, number: int) -> Case:
    """Draw a case; the same arguments give the same bytes.

    Parameters
    ----------
    label
        An effect of the catalogue or outside of it, ``clean``, or ``pair`` for two of the catalogue.
    number
        From 0; every fifth case (4, 9, ...) is made by the multibody model, the others by the chain.

    Raises
    ------
    SolverError
        No draw of :data:`ATTEMPTS` had a moderate size within its bounds.
    """
    seed = (SETS[set_name], KINDS.index(kind), zlib.crc32(label.encode()), number)
    effects = _effects_of(label, np.random.default_rng(seed))
    engine: Engine = simulate_multibody if number % 5 == 4 else simulate_chain
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng((*seed, attempt))
        try:
            return _draw(f"{label}-{number:02d}", effects, kind, engine, rng)
        except (SolverError, RigError, _OutOfReach):
            continue
    raise SolverError(f"practice case {label} {number}: no moderate size in {ATTEMPTS} draws")


class _OutOfReach(Exception):
    """An effect that cannot have the size that was asked for."""


def _effects_of(label: str, rng: np.random.Generator) -> tuple[str, ...]:
    if label == PAIR:
        kinds = rng.permutation(len(DISTINCT))[:2]
        return tuple(str(rng.choice(DISTINCT[k])) for k in kinds)
    return () if label == CLEAN else (label,)


def _draw(name: str, effects: tuple[str, ...], kind: Kind, engine: Engine, rng: np.random.Generator) -> Case:
    needs_section = "superelastic_plateau" in effects  # which measured joints do not have
    measured_joints = rng.random() < MEASURED_JOINTS and not needs_section
    ground = draw_ground(rng, measured_joints=measured_joints)
    protocol = ground.protocol
    taken = declared_tangent(ground) if effects else np.empty((0, 0))
    sized = []
    for effect in effects:
        family = {**CATALOGUE, **OUTSIDE}[effect](rng, ground)
        target = float(rng.uniform(MODERATE[0] * 1.1, MODERATE[1] * 0.9))
        sized.append(_solve_size(ground, family, taken, target))
    hidden = [one for one, _ in sized]
    with_curve = np.column_stack([taken, _curve(ground)]) if effects else taken
    truth = Truth(
        effects=effects,
        numbers={effect: dict(one.numbers) for effect, one in zip(effects, hidden, strict=True)},
        ratios=tuple(round(ratio, 3) for _, ratio in sized),
        beyond_curve=tuple(round(size_over_noise(ground, one, with_curve), 3) for one in hidden),
        engine="multibody" if engine is simulate_multibody else "chain",
        noise_deg=protocol.noise_deg,
        rig=str(protocol.table.get("preset", "measured joints")),
    )
    angles = observed(protocol, hidden, engine)
    records = tuple(_record(protocol, i, angle, kind, rng) for i, angle in enumerate(angles))
    return Case(name, records, truth)


def observed(protocol: Protocol, hidden: Sequence[Hidden], engine: Engine = simulate_chain) -> list[Floats]:
    """Angles without noise and zero, deg, one array a record, with effects in the given order."""
    angles = []
    for index, loading in enumerate(protocol.loadings):
        rig, program = protocol.rig_at(loading.preload_N), loading.program
        for one in hidden:
            rig, program = one.rig(rig), one.drive(index, program)
        run = engine(rig, program)
        angle = run.angle_deg
        for one in hidden:
            angle = one.seen(index, run, angle)
        angles.append(angle)
    return angles


def _record(protocol: Protocol, index: int, angle_deg: Floats, kind: Kind, rng: np.random.Generator) -> Record:
    loading = protocol.loadings[index]
    read = angle_deg + protocol.zeros_deg[index] + rng.normal(0.0, protocol.noise_deg, angle_deg.size)
    return Record(
        drive=loading.program.drive_mm,
        angle_deg=np.round(read, 4),
        time_s=loading.program.time_s,
        cycle=loading.program.cycle if protocol.counted else None,
        title=f"Practice record {index + 1} of {len(protocol.loadings)}, no measurement",
        kind="simulated",
        rig={**(protocol.table if kind == "known" else {}), "preload_N": loading.preload_N},
    )


# --- size --------------------------------------------------------------------------------------------------------


def declared_tangent(ground: Ground) -> Floats:
    """Give what the constants of the declared model change, to first order: shape (samples of all records, k).

    Free are sheath and capstan friction, share and slip angle of the material loop, the stiffness of both ropes, and
    one zero a record.
    """
    rig, protocol = ground.protocol.rig, ground.protocol
    base = np.concatenate([run.record.angle_deg for run in ground.runs])
    columns = [
        (np.concatenate(observed(replace(protocol, rig=changed), ())) - base) / _STEP for changed in _neighbours(rig)
    ]
    zeros = np.repeat(np.eye(len(ground.runs)), [run.record.angle_deg.size for run in ground.runs], axis=0)
    return np.column_stack([*columns, zeros])


def _neighbours(rig: Rig) -> list[Rig]:
    """Give the rig with each of its declared constants a little larger."""
    up = 1 + _STEP
    dry, nitinol, (a, b) = rig.friction, rig.material, rig.tendons
    return [
        replace(rig, friction=replace(dry, sheath_N=up * dry.sheath_N)),
        replace(rig, friction=replace(dry, capstan_coefficient=up * dry.capstan_coefficient)),
        replace(rig, material=replace(nitinol, loop_share=up * nitinol.loop_share)),
        replace(rig, material=replace(nitinol, loop_angle_deg=up * nitinol.loop_angle_deg)),
        replace(rig, tendon_a=replace(a, EA_N=up * a.EA_N), tendon_b=replace(b, EA_N=up * b.EA_N)),
    ]


def _curve(ground: Ground) -> Floats:
    """Columns of a smooth f(x) that all records share."""
    drive = np.concatenate([loading.program.drive_mm for loading in ground.protocol.loadings])
    return np.asarray(np.polynomial.chebyshev.chebvander(drive / ground.full_mm, _CURVE_DEGREE)[:, 1:])


def size_over_noise(ground: Ground, hidden: Hidden, taken: Floats) -> float:
    """RMS of what an effect adds to the angle beyond the columns that are taken, over the noise."""
    added = np.concatenate(observed(ground.protocol, [hidden]))
    added -= np.concatenate([run.record.angle_deg for run in ground.runs])
    fit, *_ = np.linalg.lstsq(taken, added, rcond=None)
    return float(np.sqrt(np.mean((added - taken @ fit) ** 2)) / ground.protocol.noise_deg)


def _solve_size(ground: Ground, family: Family, taken: Floats, target: float) -> tuple[Hidden, float]:
    """Effect of a size near the target, and its size over the noise: secants of the logarithms in a bracket.

    Where the bounds of the effect do not reach the target, its largest or least size will do if that is moderate.

    Raises
    ------
    _OutOfReach
        No moderate size between the bounds of the effect.
    """
    low, high = family.least, 1.0
    at_low = at_high = math.nan
    size = max(0.1, 2 * family.least)
    for _ in range(14):
        hidden = family.at(size)
        try:
            ratio = size_over_noise(ground, hidden, taken)
        except SolverError:
            ratio = math.inf
        at_bound = (ratio > target and size <= family.least) or (ratio < target and size >= 1.0)
        if abs(ratio / target - 1) < CLOSE or (at_bound and MODERATE[0] <= ratio <= MODERATE[1]):
            return hidden, ratio
        if at_bound:
            break
        if ratio > target:
            high, at_high = size, ratio
        else:
            low, at_low = size, ratio
        size = _next_size(low, high, at_low, at_high, size, ratio / target, target)
    raise _OutOfReach


def _next_size(
    low: float, high: float, at_low: float, at_high: float, size: float, over: float, target: float
) -> float:
    if math.isfinite(at_low) and math.isfinite(at_high) and 0 < at_low < at_high:
        part = math.log(target / at_low) / math.log(at_high / at_low)
        return float(low * (high / low) ** min(max(part, 0.1), 0.9))
    if 0 < over < math.inf:  # one side only: effects grow about in proportion
        return min(max(size / over, low), high)
    return math.sqrt(low * high)


# --- files -------------------------------------------------------------------------------------------------------


def write_case(case: Case, folder: Path) -> list[Path]:
    """Write the records of a case into a folder of its name; what is hidden is not written."""
    paths = [folder / case.name / f"record-{i + 1}.csv" for i in range(len(case.records))]
    for record, path in zip(case.records, paths, strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_record(record, path)
    return paths


def labels(text: str) -> list[str]:
    """Read labels with commas between, of a command line."""
    given = text.split(",")
    if unknown := [label for label in given if label not in LABELS]:
        raise argparse.ArgumentTypeError(f"{unknown[0]}: expected some of {', '.join(LABELS)}")
    return given


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.cases", description="Write practice cases.")
    parser.add_argument("--set", choices=[*SETS], default="work", help="drawn from its own seeds")
    parser.add_argument("--kind", choices=KINDS, default="known", help="whether the sidecar tells the rig")
    parser.add_argument("--count", type=int, default=10, help="cases of each effect")
    parser.add_argument("--effects", type=labels, default=[*LABELS], help="comma between; also clean, pair")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write cases into ``DIR/SET-KIND/LABEL-NUMBER``."""
    options = parse(arguments)
    folder = options.out / f"{options.set}-{options.kind}"
    for label, number in track([*product(options.effects, range(options.count))], description="cases"):
        write_case(draw_case(options.set, options.kind, label, number), folder)


if __name__ == "__main__":
    main()
