"""Practice cases of rigs in series: records for scores, on which nothing is tuned and from which nothing is learnt.

    python -m validation.practice.series.cases --seed 7 --kind known --count 2 --out DIR

Four records of a rig (:mod:`validation.practice.series.rig`) at three preloads, two rates and two amplitudes. The
sidecar tells measured joints with 3 % error, or the preload alone; it never tells the friction at the base. Sizes of
effects are those of the other generators, beyond what the constants of the rig take.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from rich.progress import track

from hysteresis.arrays import Floats, Ints
from hysteresis.records.record import Record
from validation.practice.beyond import beyond, size_for
from validation.practice.cases import write_case
from validation.practice.draw import CLEAN, Case, Noiseless, Truth, with_white_noise
from validation.practice.protocols import KINDS
from validation.practice.series.effects import (
    DOMINANT,
    DOMINANT_SIZES,
    SIZES,
    Change,
    Rng,
    effects,
    effects_of,
    labels_of,
    numbers_of,
)
from validation.practice.series.rig import Flexures, SeriesRig, simulate_series

ENGINE = "series"
ATTEMPTS = 40
UNITS = 3
"""Units of a flexure."""
DECLARED_ERROR = 0.03
"""Standard deviation of what the sidecar tells, relative."""
SINGLE = 0.25
"""Share of the rigs of unknown geometry that have one tendon: measured joints declare two."""
NO_PAIR = frozenset({"unequal_tendons"})
_STEP = 0.02  # relative, for the derivatives by the rig's own constants


@dataclass(frozen=True)
class Made:
    """How one record is made: preload, amplitude, rate and shape of its drive."""

    preload_N: float
    amplitude_mm: float
    rate_Hz: float
    cycles: int
    samples_per_cycle: int
    triangle: bool
    single: bool

    def drive(self) -> tuple[Floats, Floats, Ints]:
        """Drive (mm), time (s) and cycle, shapes (m,), logged to 0.1 um and 1 us. One tendon is only pulled."""
        k = np.arange(1, self.cycles * self.samples_per_cycle + 1)
        phase = 2 * np.pi * k / self.samples_per_cycle
        wave = np.sin(phase - np.pi / 2) if self.single else np.sin(phase)
        if self.triangle:
            wave = 2 / np.pi * np.arcsin(np.clip(wave, -1.0, 1.0))
        wave = 0.5 * (1.0 + wave) if self.single else wave
        time = np.round(k / self.samples_per_cycle / self.rate_Hz, 6)
        return np.round(self.amplitude_mm * wave, 4), time, 1 + (k - 1) // self.samples_per_cycle


@dataclass(frozen=True)
class SeriesProtocol:
    """Records of one rig, the noise of its sensor and the zero of each record."""

    records: tuple[Made, ...]
    noise_deg: float
    zeros_deg: tuple[float, ...]


def draw_series_case(seed: int, kind: str, label: str, number: int) -> Case:
    """Draw a case; the same arguments give the same records. See :func:`draw_series_noiseless`."""
    noiseless, rng = draw_series_noiseless(seed, kind, label, number)
    return with_white_noise(noiseless, rng)


def draw_series_noiseless(
    seed: int, kind: str, label: str, number: int, *, twin: bool = False
) -> tuple[Noiseless, Rng]:
    """Draw a case without noise, and the generator of random numbers that its noise comes from.

    Parameters
    ----------
    seed
        Of the whole set.
    kind
        ``known``: the sidecar tells measured joints; ``unknown``: it tells the preload alone.
    label
        One of :func:`validation.practice.series.effects.labels_of`.
    number
        From 0.
    twin
        The same rig, sidecar and noise without the effect: what a baseline leaves of it is no share of the effect.

    Raises
    ------
    ValueError
        A label that is not drawn, or no draw with an effect of the size that is asked for.
    """
    if label not in labels_of(kind):
        raise ValueError(f"{label}: expected one of {', '.join(labels_of(kind))}")
    rng = np.random.default_rng((seed, zlib.crc32(f"series {kind} {label}".encode()), number))
    sizes = DOMINANT_SIZES if label == DOMINANT else SIZES
    for _ in range(ATTEMPTS):
        single = bool(rng.random() < SINGLE) and kind == "unknown" and label not in NO_PAIR
        rig = draw_rig(rng, single=single)
        protocol = draw_protocol(rig, rng)
        plain, reach = _records(rig, protocol)
        changed, ratio = rig, 0.0
        effect, target = effects(rng, reach).get(label), float(rng.uniform(*sizes))
        if effect is not None:
            try:
                found = _sized(rig, protocol, plain, effect, target, kind)
            except ValueError:  # a force at the tip that the chain does not hold
                continue
            if found is None:
                continue
            size, ratio = found
            changed = effect(rig, size)
        if twin:
            changed, ratio, label = rig, 0.0, CLEAN
        angles, _ = _records(changed, protocol)
        return _case(angles, (rig, changed), protocol, (label, number, kind), ratio, rng), rng
    raise ValueError(f"{label}: no draw has a size between {sizes[0]:g} and {sizes[1]:g} times the noise")


def draw_rig(rng: Rng, *, single: bool = False) -> SeriesRig:
    """Draw a rig without an effect.

    Joints differ by 15 %, units by a half. Sliders yield at 2 to 12 % of the moment of the full bend, after a tenth to
    four fifths of the turn that a unit then has.
    """
    joints, arm = int(rng.integers(6, 17)), round(float(rng.uniform(2.0, 3.2)), 3)
    whole, bend = float(rng.uniform(30.0, 80.0)), 0.6  # Nmm/rad of the chain, rad
    each = joints * whole * rng.uniform(0.85, 1.15, (joints, 1))
    share = rng.uniform(0.5, 1.5, (joints, UNITS))
    spring = each * np.sum(share, axis=1, keepdims=True) / share  # compliances in proportion to the shares
    yields = whole * bend * rng.uniform(0.02, 0.12, UNITS) * np.ones((joints, 1))
    turns = bend / joints / UNITS * rng.uniform(0.1, 0.8, UNITS)
    stiff, soft = float(rng.uniform(120.0, 300.0)), float(rng.uniform(60.0, 120.0))
    return SeriesRig(
        flexures=Flexures(spring, yields / turns, yields),
        pitch_mm=round(float(rng.uniform(2.0, 3.5)), 1),
        arm_mm=(arm, arm),
        stiff_N_per_mm=(stiff, stiff),
        soft_N_per_mm=(soft, soft),
        base_friction=float(np.exp(rng.uniform(*np.log((0.02, 0.15))))),
        wheel_radius_mm=float(rng.uniform(1.5, 8.0)),
        preload_N=round(float(rng.uniform(4.0, 8.0) if single else rng.uniform(16.0, 26.0)), 1),
        pair=not single,
    )


def draw_protocol(rig: SeriesRig, rng: Rng) -> SeriesProtocol:
    """Draw four records of a rig: the first is slow, at its preload and at full amplitude."""
    slow = round(float(np.exp(rng.uniform(*np.log((0.04, 0.2))))), 3)
    fast = round(slow * float(rng.uniform(4.0, 12.0)), 3)
    full = round(float(np.radians(rng.uniform(27.0, 48.0))) * rig.arm_mm[0], 2)
    high = rig.preload_N
    middle, low = round(0.7 * high, 1), round(0.45 * high, 1)
    cycles, samples = int(rng.integers(3, 6)), int(rng.integers(60, 141))
    triangle = bool(rng.random() < 0.3)
    rows = [(high, full, slow), (low, full, slow), (middle, full, fast), (high, round(0.55 * full, 2), fast)]
    records = tuple(Made(*row, cycles, samples, triangle, not rig.pair) for row in rows)
    zeros = tuple(float(zero) for zero in rng.normal(0.0, 0.1, len(records)))
    return SeriesProtocol(records, round(float(rng.uniform(0.03, 0.07)), 4), zeros)


def _records(rig: SeriesRig, protocol: SeriesProtocol) -> tuple[list[Floats], float]:
    """Angles of all records without noise, deg, and the largest deflection of the tip, mm."""
    angles, reach = [], 0.0
    for made in protocol.records:
        drive, time, _ = made.drive()
        run = simulate_series(replace(rig, preload_N=made.preload_N), drive, time)
        angles.append(run.angle_deg)
        reach = max(reach, float(run.tip_mm.max()))
    return angles, reach


def _sized(
    rig: SeriesRig, protocol: SeriesProtocol, plain: Sequence[Floats], change: Change, target: float, kind: str
) -> tuple[float, float] | None:
    """Size of an effect that is ``target`` times the noise, and the ratio that it has; None out of reach."""
    tangent, most = own_tangent(rig, protocol, plain, kind)

    def ratio(size: float) -> float:
        return beyond(tangent, plain, _records(change(rig, size), protocol)[0], most) / protocol.noise_deg

    return size_for(ratio, ratio(1.0), target)


def own_tangent(rig: SeriesRig, protocol: SeriesProtocol, plain: Sequence[Floats], kind: str) -> tuple[Floats, Floats]:
    """Differentiate the angles by the rig's own constants and by a zero of each record.

    The constants are those that whoever has such a rig must identify: springs, Jenkins elements, yields, both segments
    of the tendons, the friction at the base; where the geometry is unknown, the arm and a gain of the drive, too. What
    the sidecar tells of a known rig is off by three standard deviations of its error at most.

    Returns
    -------
    tuple
        Columns, shape (samples, k), and the largest multiple of each, shape (k,).
    """
    up, flexures = 1 + _STEP, rig.flexures
    told = 3 * DECLARED_ERROR / _STEP if kind == "known" else np.inf
    changed = [
        (replace(rig, flexures=replace(flexures, spring_Nmm_per_rad=up * flexures.spring_Nmm_per_rad)), told),
        (replace(rig, flexures=replace(flexures, jenkins_Nmm_per_rad=up * flexures.jenkins_Nmm_per_rad)), np.inf),
        (replace(rig, flexures=replace(flexures, yield_Nmm=up * flexures.yield_Nmm)), np.inf),
        (replace(rig, stiff_N_per_mm=_both(up, rig.stiff_N_per_mm)), told),
        (replace(rig, soft_N_per_mm=_both(up, rig.soft_N_per_mm)), told),
        (replace(rig, base_friction=up * rig.base_friction), np.inf),
    ]
    if kind == "unknown":
        changed += [(replace(rig, arm_mm=_both(up, rig.arm_mm)), np.inf), (replace(rig, drive_gain=_STEP), np.inf)]
    angle = np.concatenate(plain)
    columns = [np.concatenate(_records(one, protocol)[0]) - angle for one, _ in changed]
    zeros = np.repeat(np.eye(len(plain)), [one.size for one in plain], axis=0)
    most = np.append([largest for _, largest in changed], np.full(len(plain), np.inf))
    return np.column_stack([*columns, zeros]), most


def _both(factor: float, pair: tuple[float, float]) -> tuple[float, float]:
    return factor * pair[0], factor * pair[1]


def _case(
    angles: Sequence[Floats],
    rigs: tuple[SeriesRig, SeriesRig],
    protocol: SeriesProtocol,
    name: tuple[str, int, str],
    ratio: float,
    rng: Rng,
) -> Noiseless:
    (label, number, kind), (declared, true) = name, rigs
    told = _told(declared, rng) if kind == "known" else {}
    records = []
    for index, (made, angle) in enumerate(zip(protocol.records, angles, strict=True), start=1):
        drive, time, cycle = made.drive()
        records.append(
            Record(
                drive=drive,
                angle_deg=angle,
                drive_unit="mm",
                time_s=time,
                cycle=cycle,
                rig={**told, "preload_N": made.preload_N},
                title=f"Practice record {index} of {len(angles)} of a rig in series, no measurement",
                kind="simulated",
            )
        )
    hidden = effects_of(label)
    truth = Truth(
        effects=hidden,
        numbers={one: numbers_of(one, true) for one in hidden},
        ratios=(round(ratio, 3),) if hidden else (),
        beyond_curve=(),
        engine=ENGINE,
        noise_deg=protocol.noise_deg,
        rig=ENGINE,
    )
    return Noiseless(f"{label}-{number:02d}", tuple(records), protocol.zeros_deg, truth)


def _told(rig: SeriesRig, rng: Rng) -> dict[str, float]:
    """Measured joints, with errors of stiffness: of the flexures while they slide, of both segments together."""
    off = 1 + rng.normal(0.0, DECLARED_ERROR, 2)
    joints, free = rig.flexures.joints, round(float(rng.uniform(100.0, 220.0)))
    tendon = 1.0 / (1.0 / rig.stiff_N_per_mm[0] + 1.0 / rig.soft_N_per_mm[0])
    flexure = 1.0 / float(np.mean(1.0 / rig.flexures.slid_Nmm_per_rad))
    return {
        "joints": joints,
        "moment_arm_mm": rig.arm_mm[0],
        "flexure_stiffness_Nmm_per_rad": round(flexure * float(off[0]), 2),
        "tendon_EA_N": round(tendon * (free + joints * rig.pitch_mm) * float(off[1]), 1),
        "tendon_free_length_mm": free,
        "pitch_mm": rig.pitch_mm,
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Write cases into ``DIR/LABEL-NUMBER``; what is hidden is not written."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.series.cases", description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of the set")
    parser.add_argument("--kind", choices=KINDS, default="known", help="whether the sidecar tells the rig")
    parser.add_argument("--count", type=int, default=2, help="cases of each label")
    parser.add_argument("--effects", help="labels by commas; also clean; else all")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    options = parser.parse_args(arguments)
    chosen = options.effects.split(",") if options.effects else [*labels_of(options.kind)]
    for label, number in track([*product(chosen, range(options.count))], description="cases"):
        write_case(draw_series_case(options.seed, options.kind, label, number), options.out)


if __name__ == "__main__":
    main()
