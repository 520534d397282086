"""The head of the C files: what the compensator was identified from, how good it is, and where it is valid."""

from __future__ import annotations

import re
from importlib.metadata import version

import numpy as np

from hysteresis.records.record import Record
from studies.firmware.read import Compensator

_WIDTH = 116


def package_version() -> str:
    """Give the version of this package."""
    return version("notchbend")


def about(compensator: Compensator) -> str:
    """Give the lines of the comment: records, law, errors, validity and the sum of the file; no date."""
    layer, fit, unit = compensator.layer, compensator.fit, compensator.unit
    low, high = layer.drive_range
    ends = sorted((float(compensator.angle_deg[0]), float(compensator.angle_deg[-1])))
    lines = [
        f"Records: {', '.join(fit.records) or 'not named'}.",
        f"Law: {_law(compensator)}; largest hysteresis {compensator.saturation_deg:.4g} deg.",
        f"Held-out error: {layer.heldout_rmse_deg:.4g} deg rms; without hysteresis "
        f"{layer.without_hysteresis_rmse_deg:.4g} deg. Held out: {fit.heldout_by}. Noise: "
        f"{fit.noise_floor_deg:.3g} deg.",
        f"Valid for drives of {low:.6g} to {high:.6g} {unit} (f of {ends[0]:.4g} to {ends[1]:.4g} deg), "
        f"{_preload(compensator)}, {_rate(compensator)}, and from the start and history of the first record: "
        f"drive {layer.first_drive:.6g} {unit}.",
        *_delay(compensator),
        *(f"Warning: {words}." for words in layer.warnings),
        f"SHA-256 of identify.json: {compensator.checksum}.",
    ]
    return "\n".join(wrapped for line in lines for wrapped in _wrapped(in_comment(line)))


def in_comment(text: str) -> str:
    """Give a text that cannot end or open a comment of C: printable ASCII without asterisks, ? and backslashes."""
    return re.sub(r"[^ -~]|[*?\\$]", "_", " ".join(text.split()))


def _wrapped(line: str) -> list[str]:
    lines, now = list[str](), "  "
    for word in line.split():
        if len(now) + 1 + len(word) > _WIDTH and now.strip():
            lines.append(now)
            now = "    "
        now += f" {word}"
    return [*lines, now]


def _law(compensator: Compensator) -> str:
    kinds = [type(one).__name__ for one in compensator.layer.elements if one.saturation_deg > 0]
    if not kinds:
        return "none, the fit found no hysteresis above the noise"
    titles = {
        "BoucWen": "Bouc-Wen",
        "AsymmetricElement": "asymmetric Bouc-Wen",
        "StopsElement": "Prandtl-Ishlinskii",
    }
    return f"{titles[kinds[0]]}, {len(kinds)} element{'s' if len(kinds) > 1 else ''}"


def _delay(compensator: Compensator) -> list[str]:
    delay = compensator.layer.delay_s
    return [f"Delay: the angle is {delay:.3g} s behind the drive."] if delay > 0 else []


def _preload(compensator: Compensator) -> str:
    known = sorted({float(one.rig["preload_N"]) for one in compensator.seen if "preload_N" in one.rig})
    if len(known) == 0 or len(compensator.seen) < len(compensator.fit.records):
        return "a preload as in the records"
    return f"preload {' and '.join(f'{one:g}' for one in known)} N"


def _rate(compensator: Compensator) -> str:
    rates = [_largest_rate(one) for one in compensator.seen]
    known = [one for one in rates if one is not None]
    if not known:
        return "rates as in the records"
    return f"rates of up to {max(known):.3g} {compensator.unit}/s"


def _largest_rate(record: Record) -> float | None:
    """Largest rate of the drive between two samples, per second; None for a record point by point."""
    if record.time_s is None or record.time_s.size < 2:
        return None
    return float(np.abs(np.diff(record.drive) / np.diff(record.time_s)).max())
