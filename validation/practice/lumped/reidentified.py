"""Compensation of a lumped rig that has drifted since it was identified, without and with on-line re-identification.

The layer is identified on loops of the rig as it was, at 20 N, and then drives a rig with another preload, more
friction, or a preload that is lost over the cycles. The rig shares no code with the laws: ``python -m
validation.practice.lumped.reidentified --seed 5 --rigs 4``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hysteresis import Fit, Record, identify
from hysteresis.arrays import Floats, Ints
from hysteresis.fitting.recursive import (
    OUTSIDE_FIT,
    Recursion,
    RecursionSettings,
    settings_for,
    start_recursion,
    updated,
)
from hysteresis.laws.inverse import inverse_curve, inverse_hysteresis, uncompensated_drive
from validation.practice.lumped.cases import drawn_rig
from validation.practice.lumped.rig import LumpedRig, simulate_lumped

AMPLITUDES_MM = (1.8, 1.4, 1.0)
SAMPLE_S = 0.1
_LOOP = 160  # samples of a loop
_PART = 0.7  # of the angle at the largest amplitude that references reach


@dataclass(frozen=True)
class Change:
    """What differs from the rig that was identified; ``noise_deg`` is that of all angles that are measured."""

    name: str
    noise_deg: float
    changed: Callable[[LumpedRig], LumpedRig]
    cycles: int = 4


def _more_friction(rig: LumpedRig) -> LumpedRig:
    return replace(rig, coulomb_N=1.3 * rig.coulomb_N, capstan=1.3 * rig.capstan)


def _at(preload_N: float) -> Change:
    return Change(f"preload of {preload_N:g} N", 0.05, lambda rig: replace(rig, preload_N=preload_N))


CHANGES = (
    *(Change(f"noise of {noise:g} deg", noise, lambda rig: rig) for noise in (0.05, 0.2, 0.5)),
    *map(_at, (18.0, 15.0, 10.0)),
    Change("30 % more friction", 0.05, _more_friction),
    # the loss of the rig is hyperbolic: 25 % after 200 cycles
    Change(
        "25 % loss of preload over 200 cycles",
        0.05,
        lambda rig: replace(rig, preload_loss=0.25 * (1 + 60 / 200), cycles=60.0),
        cycles=200,
    ),
)


@dataclass(frozen=True)
class Outcome:
    """Root mean square errors over the last cycles, deg, and the state of the re-identification after them."""

    change: str
    without_deg: float
    fixed_deg: float
    reidentified_deg: float
    recursion: Recursion

    @property
    def factors(self) -> tuple[float, float]:
        """Error without compensation over that of the fixed compensator, and over that of the re-identified one."""
        return self.without_deg / self.fixed_deg, self.without_deg / self.reidentified_deg


def run(rig: LumpedRig, drive_mm: Floats, cycle: Ints) -> Floats:
    """Angles of a rig along drives from rest, shape (m,) -> (m,), deg."""
    time = SAMPLE_S * np.arange(1.0, drive_mm.size + 1.0)
    return simulate_lumped(rig, drive_mm, time, cycle)[0]


def identified(rig: LumpedRig, noise_deg: float, seed: int) -> Fit:
    """Identify a layer on shrinking loops of a rig."""
    reversals = [0.0, *(x for a in AMPLITUDES_MM for x in (a, -a, a))]
    parts = [np.linspace(a, b, 1 + int(np.ceil(abs(b - a) / 0.04)))[1:] for a, b in pairwise(reversals)]
    drive = np.concatenate([np.zeros(1), *parts])
    angle = run(rig, drive, np.zeros(drive.size, dtype=np.int64))
    noise = np.random.default_rng(seed).normal(0.0, noise_deg, angle.size)
    return identify(Record(drive=drive, angle_deg=angle + noise, drive_unit="mm", kind="simulated"))


def reference_cycle(size_deg: float, number: int) -> Floats:
    """Give one cycle of a reference from 0 to 0: triangles and sines by turns, every third one of half the size."""
    phase = np.arange(1, _LOOP + 1) / _LOOP
    size = size_deg * (0.5 if number % 3 == 2 else 1.0)
    if number % 2 == 0:
        return size * (1 - np.abs((4 * phase + 1) % 4 - 2))
    return size * np.sin(2 * np.pi * phase)


def _settings(fit: Fit) -> RecursionSettings:
    return settings_for(float(np.ptp(fit.f(np.array(fit.drive_range)))), fit.heldout.rmse_deg)


def _drives(fit: Fit, state: Recursion, reference: Floats) -> Floats:
    drift = state.drift
    path = inverse_hysteresis(reference - drift.zero_deg, state.elements, state.f_deg, drift.gain)
    low, high = np.sort(fit.f(np.array(fit.drive_range)))
    return inverse_curve(fit.f, np.clip(path, low, high), fit.drive_range)


def outcome(rig: LumpedRig, fit: Fit, change: Change, seed: int) -> Outcome:
    """Follow references on a rig that has changed: by the inverse of f, by the compensator, and re-identified.

    The compensator takes over what was learnt after every cycle, after every fifth of more than 20 cycles. Errors are
    those of the second half of the cycles, at most 6 of them, without the noise of the sensor.
    """
    driven, rng = change.changed(rig), np.random.default_rng(seed)
    size = _PART * float(np.abs(fit.f(np.array(fit.drive_range))).min())
    cycles = [reference_cycle(size, number) for number in range(change.cycles)]
    whole = np.concatenate(cycles)
    number = np.repeat(np.arange(change.cycles), _LOOP)
    last = slice(-_LOOP * min(6, change.cycles // 2), None)
    f0 = float(fit.f(np.array([fit.first_drive]))[0])
    start = start_recursion(fit.elements, f0, _settings(fit))

    def error(angle: Floats) -> float:
        return float(np.sqrt(np.mean((angle - whole)[last] ** 2)))

    plain = error(run(driven, uncompensated_drive(fit, whole), number))
    fixed = error(run(driven, _drives(fit, start, whole), number))
    state, drive, angle = start, np.zeros(0), np.zeros(0)
    block = 5 if change.cycles > 20 else 1
    for first in range(0, change.cycles, block):
        drive = np.append(drive, _drives(fit, state, np.concatenate(cycles[first : first + block])))
        angle = run(driven, drive, number[: drive.size])
        for f, seen in zip(fit.f(drive[first * _LOOP :]), angle[first * _LOOP :], strict=True):
            state = updated(state, float(f), float(seen + rng.normal(0.0, change.noise_deg)))
    return Outcome(change.name, plain, fixed, error(angle), state)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a row for every rig and change."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.lumped.reidentified", description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of the rigs and the noise")
    parser.add_argument("--rigs", type=int, default=4, help="how many are drawn")
    options = parser.parse_args(arguments)
    for k in range(options.rigs):
        rig = drawn_rig(np.random.default_rng((options.seed, k)))
        fits = {noise: identified(rig, noise, options.seed) for noise in {one.noise_deg for one in CHANGES}}
        for change in CHANGES:
            one = outcome(rig, fits[change.noise_deg], change, options.seed + k)
            drift = one.recursion.drift
            sys.stdout.write(
                f"rig {k}  {change.name:38s} {one.without_deg:.3f} {one.fixed_deg:.3f} {one.reidentified_deg:.3f} deg  "
                f"factor {one.factors[0]:5.1f} {one.factors[1]:5.1f}  zero {drift.zero_deg:+.3f} deg "
                f"gain {drift.gain:.4f} width {drift.width:.3f}"
                f"{'  outside the fit' if one.recursion.flags & OUTSIDE_FIT else ''}\n"
            )


if __name__ == "__main__":
    main()
