"""Dynamic run against the static loop: the sine of the paper's dynamic test, with and without viscous drag."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from fem_models.load import sine
from fem_models.multibody import solve_dynamic, solve_multibody
from fem_models.multibody.dynamic import DynamicSettings, DynamicSolution
from fem_models.rig import Rig, preset
from fem_models.rig.effects import Drag
from hysteresis import Record
from hysteresis.arrays import Floats
from hysteresis.records.metrics import loop_width

AMPLITUDE_MM = 2.2
RATES_HZ = (0.1, 1.0, 5.0)
DRAG = Drag(sheath_N_s_per_mm=0.05)
"""Assumed: at 1 Hz its force is at most 0.7 N, half of the dry friction of the sheath."""


@dataclass(frozen=True)
class Delay:
    """Delay of an angle against another over a cycle, seconds: from the best shift, and from the fundamental."""

    shift_s: float
    fundamental_s: float


@dataclass(frozen=True)
class DynamicComparison:
    """Dynamic against static run over the last cycle of a sine."""

    preload_N: float
    rate_Hz: float
    drag: bool
    width_static_deg: float
    width_dynamic_deg: float
    width_halved_step_deg: float
    delay: Delay
    largest_difference_deg: float
    energy_gap_percent: float
    step_s: float

    @property
    def halved_step_percent(self) -> float:
        """Relative change of the loop width when the step is halved, percent."""
        return 100 * abs(self.width_halved_step_deg / self.width_dynamic_deg - 1)


def delay(time_s: Floats, angle_deg: Floats, reference_deg: Floats) -> Delay:
    """Find the delay of an angle against a reference over one cycle.

    Parameters
    ----------
    time_s, angle_deg, reference_deg
        Shape (m,), one whole period at equal steps; the end of the period is included, its start is not.

    Returns
    -------
    The time shift of the reference with the least squares; and the phase difference of the two fundamentals over their
    angular frequency. A dry loop shifts both curves alike and does not count.
    """
    period = time_s.size * (time_s[-1] - time_s[-2])
    closed = np.concatenate([[time_s[-1] - period], time_s]), np.concatenate([reference_deg[-1:], reference_deg])
    reference = CubicSpline(*closed, bc_type="periodic")

    def misfit(shift_s: float) -> float:
        return float(((angle_deg - reference(time_s - shift_s)) ** 2).sum())

    shift = minimize_scalar(misfit, bounds=(-period / 8, period / 8), method="bounded", options={"xatol": 1e-9})
    fundamental = np.exp(-2j * np.pi * time_s / period)
    lag = np.angle((reference_deg @ fundamental) / (angle_deg @ fundamental))
    return Delay(float(shift.x), float(lag * period / (2 * np.pi)))


def compare_dynamic(
    rig: Rig, rate_Hz: float, settings: DynamicSettings | None = None, *, cycles: int = 2
) -> DynamicComparison:
    """Run the paper's sine with inertia, at the step and at half of it, and without inertia and drag.

    Raises
    ------
    SolverError, RigError
        From the engines.
    """
    settings = settings or DynamicSettings()
    program = sine(AMPLITUDE_MM, rate_Hz, cycles=cycles)
    static = solve_multibody(replace(rig, drag=None), program).record
    run = solve_dynamic(rig, program, settings)
    halved = solve_dynamic(rig, program, replace(settings, max_step_mm=0.5 * run.step_mm))
    assert static.time_s is not None
    last = static.cycle == cycles
    record = run.record
    return DynamicComparison(
        preload_N=rig.preload_N,
        rate_Hz=rate_Hz,
        drag=rig.drag is not None,
        width_static_deg=_width(static),
        width_dynamic_deg=_width(record),
        width_halved_step_deg=_width(halved.record),
        delay=delay(static.time_s[last], record.angle_deg[last], static.angle_deg[last]),
        largest_difference_deg=float(np.abs(record.angle_deg - static.angle_deg)[last].max()),
        energy_gap_percent=100 * energy_gap(run, cycles),
        step_s=run.step_s,
    )


def energy_gap(run: DynamicSolution, cycle: int) -> float:
    """Part of the wheel's work in a closed cycle that losses and kinetic energy do not account for."""
    ends = np.flatnonzero(run.record.cycle == cycle)[[0, -1]] - [1, 0]
    work, *rest = (
        float(np.diff(energy[ends])[0])
        for energy in (
            run.wheel_work_mJ,
            run.friction_loss_mJ,
            run.material_loss_mJ,
            run.viscous_loss_mJ,
            run.kinetic_mJ,
        )
    )
    return (work - sum(rest)) / work


def _width(record: Record) -> float:
    return float(loop_width(record.drive, record.angle_deg, record.cycle).max_deg)


def comparisons() -> list[DynamicComparison]:
    """Compare at both preloads of the paper and three rates, without and with drag."""
    rigs = [
        replace(preset("du2018-full-widths", preload_N=p), drag=drag) for p in (10.0, 20.0) for drag in (None, DRAG)
    ]
    return [compare_dynamic(rig, rate) for rig in rigs for rate in RATES_HZ]
