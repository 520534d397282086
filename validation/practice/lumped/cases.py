"""Practice cases of the lumped rig: records that no engine of the package made.

    python -m validation.practice.lumped.cases --seed 7 --kind known --count 2 --out DIR

The rig (:mod:`validation.practice.lumped.rig`) has other laws than any model of the tracer, so that no baseline meets
its records exactly. Sizes of effects are those of :mod:`validation.practice.draw`: 3 to 8 times the noise, beyond
what the constants of the rig take that whoever has such a rig must identify: friction, stiffness, toe region, loop.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from rich.progress import track

from hysteresis.arrays import Floats, Ints
from hysteresis.records.record import Record
from validation.practice.beyond import beyond, size_for
from validation.practice.cases import write_case
from validation.practice.draw import Case, Noiseless, Truth, with_white_noise
from validation.practice.lumped.rig import LumpedRig, simulate_lumped
from validation.practice.planned import PlanChange, Planned, program_of
from validation.practice.rig_effects import RUN_OUT

Rng = np.random.Generator
Change = Callable[[LumpedRig, float], LumpedRig]

SIZES = (3.0, 8.0)
"""Times the noise, root mean square over all records."""
CLEAN = "clean"
SAMPLES_PER_CYCLE = (60, 160)
_STEP = 0.02  # relative, for the derivatives by the rig's own constants


@dataclass(frozen=True)
class LumpedProtocol:
    """How the records of one rig were made: preload, amplitude, rate and cycles of each."""

    preloads_N: tuple[float, ...]
    amplitudes_mm: tuple[float, ...]
    rates_Hz: tuple[float, ...]
    cycles: int
    samples_per_cycle: int
    noise_deg: float
    zeros_deg: tuple[float, ...]
    plans: tuple[Planned, ...] = ()  # in place of the sines that the fields above describe


def effects(rng: Rng) -> Mapping[str, Change]:
    """Give all effects of the catalogue that the rig has, with their character drawn; a size of 1 is large.

    A plateau is not among them: beside flexures whose curve is unknown, one made at most twice the noise in eight rigs.
    """
    side = float(rng.choice([-1.0, 1.0]))
    phase = float(rng.uniform(0.0, 2 * np.pi))
    part = float(rng.uniform(0.0, 1.0))
    late = float(rng.uniform(0.35, 0.65))

    def unequal(rig: LumpedRig, size: float) -> LumpedRig:
        arm, stiff = (0.2 * side * size, 0.0) if part < 0.5 else (0.1 * side * size, 0.4 * size)
        return replace(
            rig,
            arm_mm=(rig.arm_mm[0], rig.arm_mm[1] * (1 + arm)),
            tendon_N_per_mm=(rig.tendon_N_per_mm[0], rig.tendon_N_per_mm[1] * (1 + stiff)),
        )

    return {
        "backlash": lambda rig, size: replace(rig, play_mm=0.6 * size),
        "tendon_slack": lambda rig, size: replace(rig, slack_mm=2.0 * _rest(rig) * size),
        "unequal_tendons": unequal,
        "tendon_stiffening": lambda rig, size: replace(rig, toe_mm=rig.toe_mm + 1.5 * size),
        "tendon_creep": lambda rig, size: replace(rig, creep_mm_per_N=0.02 * size),
        "preload_loss": lambda rig, size: replace(rig, preload_loss=0.95 * size),
        "guide_friction": lambda rig, size: replace(rig, capstan=rig.capstan + 0.8 * size),
        "viscous_drag": lambda rig, size: replace(
            rig, viscous_N_s_per_mm=4.0 * part * size, joint_drag_Nmm_s_per_rad=80.0 * (1 - part) * size
        ),
        "time_delay": lambda rig, size: replace(rig, delay_s=1.0 * size),
        "functional_fatigue": lambda rig, size: replace(
            rig, loop_loss=0.9 * size, residual_rad=0.5 * side * size, cycles=1.5
        ),
        "notch_closure": lambda rig, size: replace(rig, closure_rad=0.8 - 0.6 * size),
        "gravity": lambda rig, size: replace(rig, weight_Nmm=40.0 * size, weight_rad=phase),
        "tip_contact": lambda rig, size: replace(rig, contact_rad=0.8 - 0.7 * size),
        "wheel_eccentricity": lambda rig, size: replace(
            rig, run_out_mm=RUN_OUT * rig.wheel_radius_mm * size, run_out_rad=phase
        ),
        "camera_misalignment": lambda rig, size: replace(rig, camera=(0.1 * side * part * size, 0.3 * side * size)),
        "thermal_drift": lambda rig, size: replace(rig, drift_rad=0.1 * side * size, drift_s=150.0 * late),
    }


LABELS = (*effects(np.random.default_rng(0)), CLEAN)
"""Effects that the rig has, and ``clean``."""


def _rest(rig: LumpedRig) -> float:
    """Stretch at rest of the softer tendon, mm: more slack than this leaves it loose at the centre."""
    return 20.0 / min(rig.tendon_N_per_mm)


def draw_lumped_case(seed: int, kind: str, label: str, number: int) -> Case:
    """Draw a case; the same arguments give the same records.

    The arguments, and what is raised, are those of :func:`draw_lumped_noiseless`.
    """
    noiseless, rng = draw_lumped_noiseless(seed, kind, label, number)
    return with_white_noise(noiseless, rng)


def draw_lumped_noiseless(
    seed: int, kind: str, label: str, number: int, change: PlanChange | None = None
) -> tuple[Noiseless, Rng]:
    """Draw a case without noise, and the generator of random numbers that its noise comes from.

    Parameters
    ----------
    seed
        Of the whole set.
    kind
        ``known``: the sidecar tells measured joints, with 3 % error; ``unknown``: it tells the preload alone.
    label
        An effect, or ``clean``.
    number
        From 0.
    change
        Other records than the usual four.

    Raises
    ------
    ValueError
        An effect that the rig does not have, or no draw with a size within :data:`SIZES`.
    """
    if label not in LABELS:
        raise ValueError(f"{label}: the lumped rig does not have it: expected one of {', '.join(LABELS)}")
    rng = np.random.default_rng((seed, zlib.crc32(f"{kind} {label}".encode()), number))
    for _ in range(40):
        rig, protocol = drawn_rig(rng), _draw_protocol(rng)
        if change is not None:
            protocol = _changed(protocol, change, rng)
        effect = effects(rng).get(label)
        plain = _records(rig, protocol)
        if effect is None:
            return _case(plain, rig, protocol, (label, number, kind), 0.0, rng), rng
        target = float(rng.uniform(*SIZES))
        if (found := _sized(rig, protocol, plain, effect, target, kind)) is not None:
            size, ratio = found
            with_effect = effect(rig, size)
            angles = _records(with_effect, protocol)
            return _case(angles, with_effect, protocol, (label, number, kind), ratio, rng), rng
    raise ValueError(f"{label}: no draw has a size between {SIZES[0]:g} and {SIZES[1]:g} times the noise")


def _changed(protocol: LumpedProtocol, change: PlanChange, rng: Rng) -> LumpedProtocol:
    """Protocol with other plans; those that stay get their preload and zero from the plan."""
    rows = zip(protocol.preloads_N, protocol.amplitudes_mm, protocol.rates_Hz, strict=True)
    usual = [Planned(*row, protocol.cycles, protocol.samples_per_cycle) for row in rows]
    plans = tuple(change(usual, rng))
    return replace(
        protocol,
        plans=plans,
        preloads_N=tuple(plan.preload_N for plan in plans),
        zeros_deg=tuple(float(zero) for zero in rng.normal(0.0, 0.1, len(plans))),
    )


def drawn_rig(rng: Rng) -> LumpedRig:
    """Draw a rig without effects."""
    arm, stiffness = float(rng.uniform(2.0, 3.2)), float(rng.uniform(40.0, 90.0))
    bend = np.cumsum(rng.uniform(0.8, 1.2, 4))
    return LumpedRig(
        arm_mm=(arm, arm),
        tendon_N_per_mm=(stiffness, stiffness),
        toe_mm=float(rng.uniform(0.01, 0.05)),
        bending_Nmm_per_rad=float(rng.uniform(30.0, 80.0)),
        curve=(0.0, *(float(value) for value in bend / bend[-1])),
        loop_Nmm=float(rng.uniform(2.0, 8.0)),
        loop_rad=float(rng.uniform(0.03, 0.1)),
        coulomb_N=float(rng.uniform(0.4, 1.8)),
        capstan=float(rng.uniform(0.01, 0.06)),
        wheel_radius_mm=float(rng.uniform(1.5, 6.0)),
        bristle_N_per_mm=float(rng.uniform(50.0, 150.0)),
    )


def _draw_protocol(rng: Rng) -> LumpedProtocol:
    slow = round(float(np.exp(rng.uniform(*np.log((0.04, 0.2))))), 3)
    fast = round(slow * float(rng.uniform(4.0, 12.0)), 3)
    full = round(float(rng.uniform(1.2, 2.4)), 2)
    high, low = 20.0, 10.0
    rows = [(high, full, slow), (low, full, slow), (high, full, fast), (low, round(0.55 * full, 2), fast)]
    return LumpedProtocol(
        preloads_N=tuple(row[0] for row in rows),
        amplitudes_mm=tuple(row[1] for row in rows),
        rates_Hz=tuple(row[2] for row in rows),
        cycles=int(rng.integers(3, 6)),
        samples_per_cycle=int(rng.integers(*SAMPLES_PER_CYCLE)),
        noise_deg=round(float(rng.uniform(0.03, 0.08)), 4),
        zeros_deg=tuple(float(zero) for zero in rng.normal(0.0, 0.1, len(rows))),
    )


def _program(protocol: LumpedProtocol, index: int) -> tuple[Floats, Floats, Ints]:
    """Drive, time and cycle of a record: a sine, logged to 0.1 um and 1 us."""
    if protocol.plans:
        program = program_of(protocol.plans[index])
        assert program.time_s is not None
        assert program.cycle is not None
        return program.drive_mm, program.time_s, program.cycle
    rate, samples = protocol.rates_Hz[index], protocol.samples_per_cycle
    k = np.arange(1, protocol.cycles * samples + 1)
    time = np.round(k / samples / rate, 6)
    drive = np.round(protocol.amplitudes_mm[index] * np.sin(2 * np.pi * k / samples), 4)
    return drive, time, 1 + (k - 1) // samples


def _records(rig: LumpedRig, protocol: LumpedProtocol) -> list[Floats]:
    """Angles of all records without noise, deg."""
    out = []
    for index, preload in enumerate(protocol.preloads_N):
        drive, time, cycle = _program(protocol, index)
        out.append(simulate_lumped(replace(rig, preload_N=preload), drive, time, cycle)[0])
    return out


def _sized(
    rig: LumpedRig, protocol: LumpedProtocol, plain: Sequence[Floats], change: Change, target: float, kind: str
) -> tuple[float, float] | None:
    """Size of an effect that is ``target`` times the noise, and the ratio that it has; None out of reach.

    A change that is too small as a whole is not differentiated.
    """
    largest = _records(change(rig, 1.0), protocol)
    whole = np.concatenate(largest) - np.concatenate(plain)
    if np.sqrt(np.mean(whole**2)) < target * protocol.noise_deg:
        return None
    tangent = _own_tangent(rig, protocol, plain, kind)

    def ratio(size: float) -> float:
        return beyond(tangent, plain, _records(change(rig, size), protocol)) / protocol.noise_deg

    return size_for(ratio, beyond(tangent, plain, largest) / protocol.noise_deg, target)


def _own_constants(rig: LumpedRig, kind: str) -> list[LumpedRig]:
    """Rigs with one constant a little larger each: those that records of the rig without an effect must tell.

    The arms are declared for a known rig; for an unknown one they are among the constants.
    """
    up = 1 + _STEP
    names = ("toe_mm", "bending_Nmm_per_rad", "loop_Nmm", "loop_rad", "coulomb_N", "capstan", "bristle_N_per_mm")
    changed = [replace(rig, **{name: up * getattr(rig, name)}) for name in names]
    changed.append(replace(rig, tendon_N_per_mm=(up * rig.tendon_N_per_mm[0], up * rig.tendon_N_per_mm[1])))
    for k in range(1, len(rig.curve) - 1):
        changed.append(replace(rig, curve=(*rig.curve[:k], up * rig.curve[k], *rig.curve[k + 1 :])))
    if kind == "unknown":
        changed.append(replace(rig, arm_mm=(up * rig.arm_mm[0], up * rig.arm_mm[1])))
    return changed


def _own_tangent(rig: LumpedRig, protocol: LumpedProtocol, plain: Sequence[Floats], kind: str) -> Floats:
    """Differentiate the angles by the rig's own constants, and by a zero of each record: shape (samples, k)."""
    angle = np.concatenate(plain)
    columns = [np.concatenate(_records(one, protocol)) - angle for one in _own_constants(rig, kind)]
    zeros = np.repeat(np.eye(len(plain)), [one.size for one in plain], axis=0)
    return np.column_stack([*columns, zeros])


def _case(
    angles: Sequence[Floats],
    rig: LumpedRig,
    protocol: LumpedProtocol,
    name: tuple[str, int, str],
    ratio: float,
    rng: Rng,
) -> Noiseless:
    label, number, kind = name
    records = []
    told = _told_rig(rig, rng) if kind == "known" else {}
    for index, angle in enumerate(angles):
        drive, time, cycle = _program(protocol, index)
        records.append(
            Record(
                drive=drive,
                angle_deg=angle,
                drive_unit="mm",
                time_s=time,
                cycle=cycle,
                rig={**told, "preload_N": protocol.preloads_N[index]},
                title=f"Practice record {index + 1} of {len(angles)} of the lumped rig, no measurement",
                kind="simulated",
            )
        )
    hidden = () if label == CLEAN else (label,)
    truth = Truth(
        effects=hidden,
        numbers={label: _numbers(label, rig)} if hidden else {},
        ratios=(ratio,) if hidden else (),
        beyond_curve=(),
        engine="lumped",
        noise_deg=protocol.noise_deg,
        rig="lumped",
    )
    return Noiseless(f"{label}-{number:02d}", tuple(records), protocol.zeros_deg, truth)


def _numbers(label: str, rig: LumpedRig) -> dict[str, float]:
    """Constants of an effect that mean the same in every model: the others are those of the rig's own laws."""
    same = {
        "backlash": {"width_mm": rig.play_mm},
        "time_delay": {"delay_s": rig.delay_s},
        "wheel_eccentricity": {"amplitude_mm": rig.run_out_mm, "radius_mm": rig.wheel_radius_mm},
    }
    return same.get(label, {})


def _told_rig(rig: LumpedRig, rng: Rng) -> dict[str, float]:
    """Measured joints with errors of 3 %: twelve joints that bend as much together as the rig."""
    off = 1 + rng.normal(0.0, 0.03, 3)
    free = 150.0
    return {
        "joints": 12,
        "moment_arm_mm": round(rig.arm_mm[0], 3),
        "flexure_stiffness_Nmm_per_rad": round(12 * rig.bending_Nmm_per_rad * float(off[0]), 2),
        "tendon_EA_N": round(rig.tendon_N_per_mm[0] * free * float(off[1]), 1),
        "tendon_free_length_mm": free,
        "pitch_mm": 2.5,
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Write cases into ``DIR/LABEL-NUMBER``; what is hidden is not written."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.lumped.cases", description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of the set")
    parser.add_argument(
        "--kind", choices=("known", "unknown"), default="known", help="whether the sidecar tells the rig"
    )
    parser.add_argument("--count", type=int, default=2, help="cases of each effect")
    parser.add_argument("--effects", help="comma between; also clean; else all")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    options = parser.parse_args(arguments)
    labels = options.effects.split(",") if options.effects else [*LABELS]
    for label, number in track([*product(labels, range(options.count))], description="cases"):
        write_case(draw_lumped_case(options.seed, options.kind, label, number), options.out)


if __name__ == "__main__":
    main()
