"""Compensation, feedback, and both: a rig that is stepped in time, with a late and quantised sensor.

    python benchmarks/with_feedback.py --seed 3 --rigs 3 --plot docs/images/feedback.png

The rig is lumped and shares no code with the law, which is identified on loops of it as it was. At every tick the motor
gets a drive from one of six controllers:

- curve: the inverse of the best curve without hysteresis;
- compensator: the inverse of the law, as the exported C file computes it;
- PI: the curve, and a PI controller on the difference of reference and measured angle;
- PI, in time: the same without a compensator, but with the delays compensated as in the last one: what the compensator
  adds is the difference to that one;
- both: the compensator and the same PI controller;
- both, in time: the compensator looks ahead by the lag of the motor, and the controller compares the angle with the
  reference of the time at which it was measured, behind the motor's lag.

The PI controller is tuned by the rule of Skogestad (2003, doi 10.1016/S0959-1524(02)00062-8) for the slope of the
curve, the lag of the motor and the dead time of sensor and tick, for all the same.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hysteresis import Fit
from hysteresis.arrays import Floats
from hysteresis.laws.inverse import compensating_drive, uncompensated_drive
from validation.practice.lumped import rig as lumped
from validation.practice.lumped.cases import drawn_rig
from validation.practice.lumped.reidentified import identified
from validation.practice.lumped.rig import LumpedRig

TICK_S, DURATION_S = 0.01, 40.0
SENSOR_DELAY_S, MOTOR_LAG_S = 0.03, 0.02
STEP_DEG, NOISE_DEG, COUNTS = 360 / 2**12, 0.05, 4096
PART = 0.7  # of the angle at the largest amplitude
RATES_HZ = (0.05, 0.5)
CONTROLLERS = ("curve", "compensator", "PI", "PI, in time", "both", "both, in time")
CHANGES = {
    "as identified": lambda rig: rig,
    "preload of 10 N": lambda rig: replace(rig, preload_N=10.0),
    "30 % more friction": lambda rig: replace(rig, coulomb_N=1.3 * rig.coulomb_N, capstan=1.3 * rig.capstan),
}


class Plant:
    """The rig, one tick at a time; :func:`validation.practice.lumped.rig.simulate_lumped` takes a whole drive."""

    def __init__(self, rig: LumpedRig) -> None:
        self.rig, self.laws = rig, lumped._laws(rig)
        self.state = lumped._State(np.zeros(2), np.zeros(1), np.zeros((2, lumped.DECADES.size)))
        rest = [lumped._stretch_mm(rig.preload_N, k, rig.toe_mm) for k in rig.tendon_N_per_mm]
        self.rest, self.angle = np.array(rest) - rig.slack_mm, 0.0

    def step(self, drive: float) -> float:
        """Move the wheel, mm, and give the angle, deg."""
        rig, laws, state = self.rig, self.laws, self.state
        stretch = self.rest + np.array([drive, -drive])
        now = lumped._solve(self.angle, stretch, TICK_S, rig.loop_Nmm, state, laws)
        turn = now - self.angle
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            tension = lumped._tension(stretch[side] - sign * laws.arm[side] * now, laws.stiffness[side], laws.toe)
            moved = laws.arm[side] * turn
            whole = lumped._friction(side, tension, now, moved, TICK_S, state, laws)
            state.bristle[side] = whole - laws.viscous * moved / TICK_S
        state.loop[0] = lumped._dahl(state.loop[0], turn, rig.loop_Nmm / laws.loop_angle, rig.loop_Nmm)
        self.angle = now
        return float(np.degrees(now))


def reference(size_deg: float, rate_Hz: float) -> Floats:
    """Give a sine whose size changes between whole and half, shape (m,), deg."""
    time = TICK_S * np.arange(1, round(DURATION_S / TICK_S) + 1)
    return size_deg * (0.75 + 0.25 * np.cos(2 * np.pi * time / 20.0)) * np.sin(2 * np.pi * rate_Hz * time)


def led(values: Floats, lead_s: float) -> Floats:
    """Give values ahead of their time; those of before, where the lead is negative."""
    ticks = np.arange(values.size)
    return np.interp(ticks + lead_s / TICK_S, ticks, values)


def followed(rig: LumpedRig, fit: Fit, wanted: Floats, controller: str, seed: int) -> Floats:
    """Angles of the rig, shape (m,), deg."""
    in_time = controller.endswith("in time")
    ahead = led(wanted, MOTOR_LAG_S) if in_time else wanted
    compensates = controller in ("compensator", "both", "both, in time")
    forward = compensating_drive(fit, ahead, fit.first_drive) if compensates else uncompensated_drive(fit, ahead)
    compared = led(wanted, -SENSOR_DELAY_S) if in_time else wanted
    low, high = fit.drive_range
    slope = float(np.diff(fit.f(np.array([low, high])))[0]) / (high - low)  # deg/mm
    dead = SENSOR_DELAY_S + TICK_S
    gain = MOTOR_LAG_S / (slope * 2 * dead)
    integral_s = min(MOTOR_LAG_S, 8 * dead)
    feeds_back = controller not in ("curve", "compensator")
    plant, rng = Plant(rig), np.random.default_rng(seed)
    late = round(SENSOR_DELAY_S / TICK_S)
    angles, summed, motor = np.zeros(wanted.size), 0.0, 0.0
    step_mm = 2 * np.pi * rig.wheel_radius_mm / COUNTS
    for k in range(wanted.size):
        drive = float(forward[k])
        if feeds_back:
            seen = angles[k - late - 1] if k > late else 0.0
            seen = STEP_DEG * round((seen + rng.normal(0.0, NOISE_DEG)) / STEP_DEG)
            error = float(compared[k]) - seen
            summed += error * TICK_S / integral_s
            drive += gain * (error + summed)
        drive = step_mm * round(min(max(drive, low), high) / step_mm)
        motor += (drive - motor) * (1.0 - np.exp(-TICK_S / MOTOR_LAG_S))
        angles[k] = plant.step(motor)
    return angles


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table of errors, and draw the last rig."""
    parser = argparse.ArgumentParser(prog="python benchmarks/with_feedback.py", description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of the rigs and the noise")
    parser.add_argument("--rigs", type=int, default=3, help="how many")
    parser.add_argument("--plot", type=Path, help="picture of the first rig, PNG")
    options = parser.parse_args(arguments)
    found: dict[tuple[str, float, str], list[float]] = {}
    drawn: dict[str, Floats] = {}
    for number in range(options.rigs):
        rig = drawn_rig(np.random.default_rng((options.seed, number)))
        fit = identified(rig, NOISE_DEG, options.seed)
        size = PART * float(np.abs(fit.f(np.array(fit.drive_range))).min())
        for change, changed in CHANGES.items():
            for rate in RATES_HZ:
                wanted = reference(size, rate)
                for controller in CONTROLLERS:
                    angle = followed(changed(rig), fit, wanted, controller, options.seed)
                    error = angle - wanted
                    settled = slice(round(5.0 / TICK_S), None)
                    rms = float(np.sqrt(np.mean(error[settled] ** 2)))
                    found.setdefault((change, rate, controller), []).append(rms)
                    if number == 0 and change == "preload of 10 N" and rate == RATES_HZ[0]:
                        drawn[controller] = error
    sys.stdout.write(f"| rig | rate, Hz | {' | '.join(CONTROLLERS)} |\n|{'---|' * (2 + len(CONTROLLERS))}\n")
    for change in CHANGES:
        for rate in RATES_HZ:
            cells = [f"{np.mean(found[change, rate, one]):.3f}" for one in CONTROLLERS]
            sys.stdout.write(f"| {change} | {rate:g} | {' | '.join(cells)} |\n")
    if options.plot is not None:
        draw(drawn, options.plot)


def draw(errors: dict[str, Floats], path: Path) -> None:
    """Draw the errors over time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    axes = figure.subplots()
    tones = dict(zip(CONTROLLERS, ("#8a8f98", "#1f5fa8", "#d9a441", "#c8641e", "#7a4fa3", "#1b8070"), strict=True))
    for name in ("curve", "compensator", "PI, in time", "both, in time"):
        error = errors[name]
        axes.plot(TICK_S * np.arange(error.size), error, color=tones[name], lw=1.0, label=name)
    axes.set_xlabel("time, s")
    axes.set_ylabel("error of the angle, deg")
    axes.legend(ncols=4, fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0, 1))
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
