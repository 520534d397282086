"""Compensation on measured records, held out: how much smaller the error of the angle is than by the best curve.

    NOTCHBEND_MEASURED=FOLDER python benchmarks/measured_compensation.py

The law is identified on a record, or on its first half. Another record of the same device, or the second half, is held
out. The inverse of a law is exact (1e-9 deg), so a compensated device misses its reference by what the law misses along
the drive: measured less modelled angle, root mean square. Along the first third of what is held out the model follows
the logged drive, so that its history is known, and in the second half of it learns: the zero alone, or zero, gain and
width (re-identified). The other two thirds are judged, and nothing is learnt there. "Outside" says that the estimator
found the device to have left the region of the fit. Each law is identified without and with a delay, and the smaller
error on held-out parts of what it is identified on chooses. "Without" is the best curve without hysteresis, with its
zero from the first third. The noise is what the law cannot go below.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from hysteresis import Fit, identify
from hysteresis.arrays import Floats
from hysteresis.fitting.recursive import (
    OUTSIDE_FIT,
    Recursion,
    RecursionSettings,
    settings_for,
    start_recursion,
    updated,
)
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record
from validation.measured.folder import measured_folder

HALF = "its second half"
PAIRS = (
    ("surgical-manipulator-0-80", HALF),
    ("surgical-manipulator-feedforward", HALF),
    ("catheter-taut-0.1hz", HALF),
    ("catheter-taut-0.1hz", "catheter-taut-0.2hz"),
    ("catheter-slack-0.1hz", HALF),
    ("catheter-slack-0.1hz", "catheter-slack-0.3hz"),
    ("davinci-tool-load050-0.1hz", HALF),
    ("davinci-tool-load050-0.1hz", "davinci-tool-load050-0.3hz"),
    ("davinci-tool-load050-0.1hz", "davinci-tool-load100-0.1hz"),
    ("tendon-robot-zero-0.10hz", HALF),
    ("tendon-robot-zero-0.10hz", "tendon-robot-zero-0.15hz"),
)
MOST = 1500
"""Samples of a record that are used, evenly."""
KNOWN = 1 / 3


@dataclass(frozen=True)
class Pair:
    """Errors of a pair, deg, root mean square."""

    identified_on: str
    held_out: str
    law: str
    delay_s: float
    noise_deg: float
    without_deg: float
    fixed_deg: float
    reidentified_deg: float
    outside: bool


def taken(record: Record, part: slice) -> Record:
    """Give a part of a record."""
    rows = {one.name: getattr(record, one.name) for one in fields(record)}
    size = record.drive.size
    return replace(
        record, **{name: row[part] for name, row in rows.items() if isinstance(row, np.ndarray) and row.size == size}
    )


def thinned(record: Record) -> Record:
    """Give a record with at most :data:`MOST` samples."""
    return taken(record, slice(None, None, max(1, -(-record.drive.size // MOST))))


def delayed(record: Record, delay_s: float) -> Record:
    """Give the record with the drives of so much earlier."""
    if delay_s == 0.0:
        return record
    assert record.time_s is not None  # a delay was fitted
    return replace(record, drive=np.interp(record.time_s - delay_s, record.time_s, record.drive))


def read_pair(names: tuple[str, str]) -> tuple[Record, Record]:
    """Read what is identified on and what is held out."""
    first, second = names
    old = read_record(measured_folder() / f"{first}.csv")
    if second == HALF:
        middle = old.drive.size // 2
        return taken(old, slice(0, middle)), taken(old, slice(middle, None))
    return old, read_record(measured_folder() / f"{second}.csv")


def one_pair(names: tuple[str, str], law: str) -> Pair:
    """Identify, and judge what is held out."""
    old, whole = read_pair(names)
    best_curve, late = (
        identify(thinned(old), settings=IdentifySettings(law=law, delay=delay))  # type: ignore[arg-type]
        for delay in (False, True)
    )
    fit = min(best_curve, late, key=lambda one: one.heldout.rmse_deg)
    new = thinned(delayed(whole, fit.delay_s))
    low, high = fit.drive_range
    drive, angle = np.clip(new.drive, low, high), new.angle_deg
    known = round(KNOWN * drive.size)
    settings = settings_for(float(np.ptp(fit.f(np.array([low, high])))), fit.heldout.rmse_deg)
    zero_alone = replace(settings, scale=(settings.scale[0], 1e-6, 1e-6))
    f = fit.f(drive)
    errors, outside = [], False
    for one in (zero_alone, settings):
        state = learnt(fit, f[:known], angle[:known], one)
        drift = state.drift
        path = np.append(state.f_deg, f[known:])
        h = sum((element.along(path)[1:] for element in state.elements), np.zeros(path.size - 1))
        outside = bool(state.flags & OUTSIDE_FIT)
        errors.append(rms(angle[known:] - drift.zero_deg - drift.gain * f[known:] - h))
    plain = angle - best_curve.plain(np.clip(thinned(whole).drive, low, high))
    return Pair(
        *names,
        fit.law_title,
        fit.delay_s,
        fit.noise_floor_deg,
        rms(plain[known:] - plain[:known].mean()),
        *errors,
        outside,
    )


def learnt(fit: Fit, f: Floats, angle: Floats, settings: RecursionSettings) -> Recursion:
    """Follow logged drives, and learn from the angles."""
    state = start_recursion(fit.elements, float(fit.f(np.array([fit.first_drive]))[0]), settings)
    for k, (at, seen) in enumerate(zip(f.tolist(), angle.tolist(), strict=True)):
        state = updated(state, at, seen if k >= f.size // 2 else math.nan)
    return state


def rms(values: Floats) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a row for each pair."""
    parser = argparse.ArgumentParser(prog="python benchmarks/measured_compensation.py", description=__doc__)
    parser.add_argument("--law", default="auto", help="of the fits")
    options = parser.parse_args(arguments)
    heads = (
        "identified on",
        "held out",
        "law",
        "delay, s",
        "noise, deg",
        "without, deg",
        "fixed, deg",
        "re-identified, deg",
        "factors",
    )
    sys.stdout.write(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}\n")
    for names in PAIRS:
        one = one_pair(names, options.law)
        errors = f"{one.without_deg:.3f} | {one.fixed_deg:.3f} | {one.reidentified_deg:.3f}"
        factors = f"{one.without_deg / one.fixed_deg:.1f}, {one.without_deg / one.reidentified_deg:.1f}"
        law = f"{one.law} | {one.delay_s:.3f} | {one.noise_deg:.3f}"
        row = f"| {one.identified_on} | {one.held_out} | {law} | {errors} | {factors}"
        sys.stdout.write(f"{row} | {'yes' if one.outside else 'no'} |\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
