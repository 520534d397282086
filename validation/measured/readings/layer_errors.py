"""Equation 7, fitted by the genetic search to loops of rigs: the quantities of the paper's Table 1, in both tests.

As in the paper, f is the analytic model, the law is identified in the static test, and the same constants predict the
test at 1 Hz. Relative errors refer to the largest angle, which is what the paper's own percentages imply.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fem_models.analytic import theory_curve
from fem_models.chain import simulate_chain
from fem_models.load import triangle
from fem_models.rig import Rig
from hysteresis import Fit, Record, identify
from hysteresis.arrays import Floats
from hysteresis.fitting.settings import IdentifySettings
from validation.measured.preset_du2018 import AMPLITUDE_MM
from validation.measured.readings.loops import SAMPLES, fast_angle_deg, fast_program, loops_of
from validation.measured.readings.mechanisms import CAMERA, DRAG, HEATING, rig_of
from validation.measured.readings.paper_table import LARGEST_DEG, NORMALISED, PERCENT
from validation.measured.readings.statements import APART, PEAK, judge

PRELOADS_N = (20.0, 10.0)
_TRIES = 300


@dataclass(frozen=True)
class LoopErrors:
    """Errors of a law on one loop: the largest, that over the largest angle, and the root mean square over it."""

    largest_deg: float
    percent: float
    normalised: float

    def within(self, test: int) -> tuple[bool, bool, bool]:
        """Whether each is at most that of Table 1, of the static test (0) or that at 1 Hz (1)."""
        limits = (LARGEST_DEG[test], PERCENT[test], NORMALISED[test])
        found = (self.largest_deg, self.percent, self.normalised)
        return tuple(one <= limit for one, limit in zip(found, limits, strict=True))  # type: ignore[return-value]


@dataclass(frozen=True)
class FastTest:
    """One rig with drawn rate constants at 1 Hz: errors of the static law, peak, and how far the loop is late.

    ``late_ms`` is the mean delay of the crossings of zero behind those of the static loop. ``peak_met`` says whether
    the peak is that of the paper.
    """

    constants: Mapping[str, float]
    errors: LoopErrors
    peak_ratio: float
    peak_met: bool
    apart_deg: float
    late_ms: float


@dataclass(frozen=True)
class MemberErrors:
    """Equation 7 on one rig: static errors by preload in N, and the test at 1 Hz, None where no rate fits."""

    static: Mapping[str, LoopErrors]
    fast: FastTest | None


def loop_errors(measured_deg: Floats, predicted_deg: Floats) -> LoopErrors:
    """Compare two closed loops, shapes (m,)."""
    off, scale = predicted_deg - measured_deg, float(np.abs(measured_deg).max())
    largest = float(np.abs(off).max())
    return LoopErrors(largest, 100 * largest / scale, float(np.sqrt(np.mean(off**2))) / scale)


def fit_equation_7(rig: Rig) -> tuple[Fit, Record]:
    """Identify equation 7 by the genetic search on three static cycles of a rig."""
    record = simulate_chain(rig, triangle(AMPLITUDE_MM, cycles=3))

    def analytic(drive: Floats) -> Floats:
        return theory_curve(rig, drive).angle_deg

    return identify(record, analytic, settings=IdentifySettings(method="genetic")), record


def _static_errors(rig: Rig) -> tuple[Fit, LoopErrors]:
    fit, record = fit_equation_7(rig)
    cycle = 4 * round(AMPLITUDE_MM / 0.1) + 1
    return fit, loop_errors(record.angle_deg[-cycle:], fit.predict(record.drive)[-cycle:])


def member_errors(constants: Mapping[str, float], reading: str, seed: int) -> MemberErrors:
    """Fit equation 7 to the loops of one rig, and predict its test at 1 Hz with drawn rate constants."""
    rig = rig_of(constants).rig
    static, fits = {}, {}
    for preload in PRELOADS_N:
        fits[preload], static[f"{preload:g}"] = _static_errors(replace(rig, preload_N=preload))
    return MemberErrors(static, _fast_test(constants, reading, fits[20.0], np.random.default_rng(seed)))


def _fast_test(constants: Mapping[str, float], reading: str, fit: Fit, random: np.random.Generator) -> FastTest | None:
    """Draw rate constants from their priors until the two tests are as near as Table 1 says; None if none are."""
    flag = "superelastic.plateau_MPa" in constants
    priors = {**DRAG, **CAMERA, **(HEATING if flag else {})}
    for _ in range(_TRIES):
        drawn = {name: float(prior.at(random.random(1))[0]) for name, prior in priors.items()}
        chosen = rig_of({**constants, **drawn})
        loops = loops_of(chosen.rig, chosen.camera)
        judged = judge(loops, reading)
        if not judged.met[APART]:
            continue
        rig = replace(chosen.rig, preload_N=20.0)
        angle = fast_angle_deg(rig, chosen.camera["delay_ms"])
        predicted = fit.predict(fast_program().drive_mm)
        errors = loop_errors(angle[-SAMPLES - 1 :], predicted[-SAMPLES - 1 :])
        still = _zeros(loops.high.drive_mm, loops.high.up_deg), _zeros(loops.high.drive_mm, loops.high.down_deg)
        return FastTest(drawn, errors, loops.peak_ratio, judged.met[PEAK], loops.apart_deg, _late_ms(angle, still))
    return None


def _zeros(drive_mm: Floats, angle_deg: Floats) -> float:
    """Drive at which a branch crosses zero."""
    return float(np.interp(0.0, angle_deg, drive_mm))


def _late_ms(fast_deg: Floats, still_mm: tuple[float, float]) -> float:
    """Mean delay of the crossings of zero in the last cycle, falling and rising, behind the static drives of these."""
    time = np.asarray(fast_program().time_s)[-SAMPLES - 1 :]
    drive, angle = fast_program().drive_mm[-SAMPLES - 1 :], fast_deg[-SAMPLES - 1 :]
    half = SAMPLES // 2
    late = []
    for part, sign, at in ((slice(0, half + 1), -1, still_mm[1]), (slice(half, None), 1, still_mm[0])):
        crossed = np.interp(0.0, sign * angle[part], time[part])
        late.append(crossed - np.interp(sign * at, sign * drive[part], time[part]))
    return 1e3 * float(np.mean(late))
