"""Draw practice cases: four records of one rig with injected effects, from a seed.

The size of an effect is moderate (:mod:`validation.practice.size`). It is found with the chain. One case in five is
then simulated with the multibody model.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fem_models.chain import simulate_chain
from fem_models.multibody import simulate_multibody
from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis import Record
from hysteresis.arrays import Floats
from validation.practice.catalogue import ABSORBED, CATALOGUE, DISTINCT
from validation.practice.injected import Engine, observed
from validation.practice.outside_catalogue import OUTSIDE_CATALOGUE
from validation.practice.planned import PlanChange
from validation.practice.protocols import KINDS, BaselineRuns, Kind, Protocol, draw_baseline
from validation.practice.size import (
    MODERATE,
    OutOfReachError,
    baseline_tangent,
    curve_columns,
    size_over_noise,
    solve_size,
)

SetName = Literal[
    "work",
    "score",
    "score-2",
    "score-3",
    "score-4",
    "score-5",
    "score-6",
    "score-7",
    "score-8",
    "score-9",
    "score-10",
    "score-11",
    "score-12",
    "score-13",
    "score-14",
    "score-15",
    "score-16",
    "score-17",
    "score-18",
    "score-19",
    "score-20",
    "score-21",
    "score-22",
    "score-23",
    "score-24",
    "score-25",
    "score-26",
    "score-27",
    "score-28",
    "score-29",
    "score-30",
    "score-31",
    "score-32",
    "score-33",
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
    "score-10": 20_261_131,
    "score-11": 20_261_132,
    "score-12": 20_261_133,
    "score-13": 20_261_134,
    "score-14": 20_261_135,
    "score-15": 20_261_136,
    "score-16": 20_261_137,
    "score-17": 20_261_138,
    "score-18": 20_261_139,
    "score-19": 20_261_140,
    "score-20": 20_261_141,
    "score-21": 20_261_142,
    "score-22": 20_261_143,
    "score-23": 20_261_144,
    "score-24": 20_261_145,
    "score-25": 20_261_146,
    "score-26": 20_261_147,
    "score-27": 20_261_148,
    "score-28": 20_261_149,
    "score-29": 20_261_150,
    "score-30": 20_261_151,
    "score-31": 20_261_152,
    "score-32": 20_261_163,
    "score-33": 20_261_171,
}
"""Seeds: ``work`` is the set for development; each score uses a set that has not been inspected before."""

CLEAN, PAIR = "clean", "pair"
LABELS = (*CATALOGUE, CLEAN, PAIR, *OUTSIDE_CATALOGUE)
MEASURED_JOINTS = 0.25
"""Share of the cases whose rig has measured joints instead of the preset's tube."""
OF_THE_TUBE = {"superelastic_plateau", "backlash"}
"""Effects that are not drawn for measured joints. Their tendons have no toe region: friction F at the base then keeps
the manipulator still over 2 F / k of the drive, as play does, at every preload."""
ATTEMPTS = 40


@dataclass(frozen=True)
class Truth:
    """What was injected into a case.

    Parameters
    ----------
    effects
        Names.
    numbers
        Parameters of each effect.
    ratios
        Size of each effect over the noise.
    beyond_curve
        The same with a free f(x) in addition, as for unknown geometry.
    engine
        ``chain`` or ``multibody``.
    noise_deg
        Standard deviation of the noise.
    rig
        Name of the preset, or ``measured joints``.
    """

    effects: tuple[str, ...]
    numbers: Mapping[str, Mapping[str, float]]
    ratios: tuple[float, ...]
    beyond_curve: tuple[float, ...]
    engine: str
    noise_deg: float
    rig: str


@dataclass(frozen=True)
class Case:
    """Records with injected effects; the name is that of their folder."""

    name: str
    records: tuple[Record, ...]
    truth: Truth


@dataclass(frozen=True)
class Noiseless:
    """A case before a sensor reads it: records whose angle has no noise, no zero and is not rounded.

    ``zeros_deg`` has the zero of the angle, one per record; the standard deviation of the noise is in the truth.
    """

    name: str
    records: tuple[Record, ...]
    zeros_deg: tuple[float, ...]
    truth: Truth


def draw_case(set_name: SetName, kind: Kind, label: str, number: int) -> Case:
    """Draw a case of a set; the same arguments give the same records.

    The arguments, and what is raised, are those of :func:`draw_noiseless`.
    """
    noiseless, rng = draw_noiseless(SETS[set_name], kind, label, number)
    return with_white_noise(noiseless, rng)


def draw_noiseless(
    seed: int, kind: Kind, label: str, number: int, change: PlanChange | None = None, ratio: float | None = None
) -> tuple[Noiseless, np.random.Generator]:
    """Draw a case without noise, and the generator of random numbers that its noise comes from.

    Parameters
    ----------
    seed
        Of the whole set.
    label
        An effect of the catalogue or outside the catalogue; ``clean``; or ``pair`` for two effects of the catalogue.
    number
        From 0; every fifth case (4, 9, ...) is simulated with the multibody model, the others with the chain.
    change
        Other records than the usual four, see :func:`validation.practice.protocols.draw_baseline`.
    ratio
        Size of the effect over the noise, which is met; drawn within :data:`MODERATE` by default.

    Raises
    ------
    SolverError
        None of :data:`ATTEMPTS` draws had a moderate size within its bounds.
    """
    key = (seed, KINDS.index(kind), zlib.crc32(label.encode()), number)
    effects = _effects_of(label, kind, np.random.default_rng(key))
    engine: Engine = simulate_multibody if number % 5 == 4 else simulate_chain
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng((*key, attempt))
        try:
            measured_joints = rng.random() < MEASURED_JOINTS and not {*effects} & OF_THE_TUBE
            baseline = draw_baseline(rng, measured_joints=measured_joints, change=change)
            return _draw(f"{label}-{number:02d}", effects, kind, engine, (baseline, rng), ratio), rng
        except (SolverError, RigError, OutOfReachError):
            continue
    raise SolverError(f"practice case {label} {number}: no moderate size in {ATTEMPTS} draws")


def with_white_noise(noiseless: Noiseless, rng: np.random.Generator) -> Case:
    """Add the zero and white noise to every angle, rounded to 0.1 mdeg."""
    read = [
        record.angle_deg + zero + rng.normal(0.0, noiseless.truth.noise_deg, record.angle_deg.size)
        for record, zero in zip(noiseless.records, noiseless.zeros_deg, strict=True)
    ]
    records = tuple(
        replace(record, angle_deg=np.round(angle, 4)) for record, angle in zip(noiseless.records, read, strict=True)
    )
    return Case(noiseless.name, records, noiseless.truth)


def drawn_labels(kind: Kind) -> tuple[str, ...]:
    """Give the labels of cases that can be drawn."""
    return tuple(label for label in LABELS if kind == "known" or label not in ABSORBED)


def _effects_of(label: str, kind: Kind, rng: np.random.Generator) -> tuple[str, ...]:
    if label == PAIR:
        kinds = rng.permutation(len(DISTINCT))[:2]
        drawn = drawn_labels(kind)
        return tuple(str(rng.choice([name for name in DISTINCT[k] if name in drawn])) for k in kinds)
    return () if label == CLEAN else (label,)


def _draw(
    name: str,
    effects: Sequence[str],
    kind: Kind,
    engine: Engine,
    drawn: tuple[BaselineRuns, np.random.Generator],
    ratio: float | None,
) -> Noiseless:
    baseline, rng = drawn
    protocol = baseline.protocol
    absorbed = baseline_tangent(baseline, kind) if effects else np.empty((0, 0))
    sized = []
    for effect in effects:
        family = {**CATALOGUE, **OUTSIDE_CATALOGUE}[effect](rng, baseline)
        drawn_ratio = float(rng.uniform(MODERATE[0] * 1.1, MODERATE[1] * 0.9))
        target = drawn_ratio if ratio is None else ratio
        sized.append(solve_size(baseline, family, absorbed, target, exact=ratio is not None))
    injected = [one for one, _ in sized]
    with_curve = np.column_stack([absorbed, curve_columns(baseline)]) if effects else absorbed
    truth = Truth(
        effects=tuple(effects),
        numbers={effect: dict(one.numbers) for effect, one in zip(effects, injected, strict=True)},
        ratios=tuple(round(ratio, 3) for _, ratio in sized),
        beyond_curve=tuple(round(size_over_noise(baseline, one, with_curve), 3) for one in injected),
        engine="multibody" if engine is simulate_multibody else "chain",
        noise_deg=protocol.noise_deg,
        rig=str(protocol.table.get("preset", "measured joints")),
    )
    angles = observed(protocol, injected, engine)
    records = tuple(_record(protocol, i, angle, kind) for i, angle in enumerate(angles))
    return Noiseless(name, records, protocol.zeros_deg, truth)


def _record(protocol: Protocol, index: int, angle_deg: Floats, kind: Kind) -> Record:
    loading = protocol.loadings[index]
    return Record(
        drive=loading.program.drive_mm,
        angle_deg=angle_deg,
        time_s=loading.program.time_s,
        cycle=loading.program.cycle if protocol.counted else None,
        title=f"Practice record {index + 1} of {len(protocol.loadings)}, no measurement",
        kind="simulated",
        rig={**(protocol.table if kind == "known" else {}), "preload_N": loading.preload_N},
    )
