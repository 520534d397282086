"""What the file of a rig states, beside what its records say: a parameter that has moved may hide an effect."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path

from fem_models.rig.of_record import bends_in_space, declared_rig_of
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.record import Record

WIDER = 2.0
"""Least difference that is told, over half an interval: of six parameters one is often beyond it by chance."""
KEYS = {
    "sheath_N": ("friction", "sheath_N"),
    "capstan_coefficient": ("friction", "capstan_coefficient"),
    "stick_compliance_mm_per_N": ("friction", "stick_compliance_mm_per_N"),
    "loop_share": ("material", "loop_share"),
    "loop_angle_deg": ("material", "loop_angle_deg"),
    "youngs_modulus_GPa": ("material", "youngs_modulus_GPa"),
    "EA_N": ("tendon", "EA_N"),
}
"""Parameters of the baseline, with their tables and keys in a rig file."""
LIKE = {
    "sheath_N": "a play of the drive (backlash) or the friction of the guides",
    "capstan_coefficient": "friction of the sheath or a play of the drive (backlash)",
    "loop_share": "a plateau of the metal (superelastic_plateau) or a play of the drive (backlash)",
    "loop_angle_deg": "a plateau of the metal (superelastic_plateau)",
    "youngs_modulus_GPa": "another notch depth, or a plateau of the metal (superelastic_plateau)",
    "EA_N": "a toe region (tendon_stiffening), slack tendons or another free length",
}
"""What else a parameter that differs from its file looks like."""


def stated_values(record: Record, fitted: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """Values that the rig file, the preset or the sidecar of a record states for fitted parameters."""
    if record.drive_unit not in ("mm", "N") or bends_in_space(record):
        return {}
    rig = declared_rig_of(record)
    if rig is None:
        return {}
    stated = _stated_keys(record)
    parts = {"friction": rig.friction, "material": rig.material, "tendon": rig.tendon_a}
    return {
        name: Parameter(float(getattr(parts[table], key)), None, None, fitted[name].unit)
        for name, (table, key) in KEYS.items()
        if name in fitted and (stated is None or key in stated.get(table, {}))
    }


def _stated_keys(record: Record) -> Mapping[str, Mapping[str, object]] | None:
    """Tables of the rig file; None for a preset, which states all."""
    if "preset" in record.rig:
        return None
    if "file" not in record.rig:
        return {"tendon": {"EA_N": 0.0}}  # quantities measured on the bench
    path = Path(record.source).parent / str(record.rig["file"])
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    return {name: table for name, table in tables.items() if isinstance(table, dict)}


def differing_words(fitted: Mapping[str, Parameter], stated: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Say which fitted parameters differ from the file by far more than their interval, and what that looks like.

    Where the fit ended at its bound, which cuts the interval off, any value outside of it is told.
    """
    words = []
    for name, file in stated.items():
        one = fitted[name]
        if one.low is None or one.high is None:
            continue
        bounded = _at_a_bound(one.value, one.low, one.high)
        further = 0.0 if bounded else 0.5 * (WIDER - 1.0) * (one.high - one.low)
        if one.low - further <= file.value <= one.high + further:
            continue
        where = "at the bound of the fit in these records" if bounded else "in these records"
        else_ = f"; {LIKE[name]} would look alike" if name in LIKE else ""
        words.append(f"{name} is {one} {where}, {file} in the file of the rig{else_}")
    return tuple(words)


def _at_a_bound(value: float, low: float, high: float) -> bool:
    """Whether a value is an end of its interval, but for 0, where an amount ends by itself."""
    return math.isclose(value, high, rel_tol=1e-4) or (low > 0.0 and math.isclose(value, low, rel_tol=1e-4))
