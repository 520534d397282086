"""``six-stiffnesses.json`` for the page: section and solid of the notches of a rig in space, and the bent wrist."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, fields
from itertools import groupby
from pathlib import Path

import numpy as np

from hysteresis.files import present
from hysteresis.records.record import RecordError
from studies.report.charts import Chart, Line, Plate, Tone
from studies.report.plots import Drawn, draw
from studies.report.summary import Verdict
from studies.results import read_result
from studies.results.validation import FILE_IN_SPACE, WHAT_IN_SPACE, SixNumbers, StoredNotch, StoredSix

NAMES = {one.name: one.name.replace("_", " ") for one in fields(SixNumbers)}
"""Stiffnesses by their words."""
_TURNING = ("weak", "strong", "torsion")
_TONES: tuple[Tone, ...] = ("blue", "orange", "green")


@dataclass(frozen=True)
class AlikeNotches:
    """Neighbouring notches with the same numbers; ``numbers`` is the first and the last one."""

    numbers: str
    notch: StoredNotch


@dataclass(frozen=True)
class SixSection:
    """Section and solid of the notches, with a chart where there are several."""

    result: StoredSix
    alike: tuple[AlikeNotches, ...]
    plate: Drawn | None
    command: str


def read_six(folder: Path) -> SixSection | None:
    """Read ``six-stiffnesses.json``; None if there is no such file.

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    path = folder / FILE_IN_SPACE
    if not present(path):
        return None
    found = read_result(StoredSix, path, WHAT_IN_SPACE)
    if not found.notches:
        raise RecordError(f"{path}: notches: empty: expected {WHAT_IN_SPACE}")
    if len(found.drives_mm) != len(found.bent):
        raise RecordError(f"{path}: drives_mm, bent: {len(found.drives_mm)}, {len(found.bent)}: expected as many")
    alike = _alike(found.notches)
    options = f"--preset {shlex.quote(found.rig)}"
    command = f"notchbend validate {options} --out DIR" if found.made is None else found.made.command
    return SixSection(found, alike, draw(_plate(found.notches)) if len(alike) > 1 else None, command)


def _alike(notches: tuple[StoredNotch, ...]) -> tuple[AlikeNotches, ...]:
    out = []
    for _, group in groupby(notches, key=lambda one: (one.depth_mm, one.width_mm, one.section, one.solid)):
        first, *others = group
        last = others[-1] if others else first
        numbers = f"{first.number}" if last is first else f"{first.number} to {last.number}"
        out.append(AlikeNotches(numbers, first))
    return tuple(out)


def _plate(notches: tuple[StoredNotch, ...]) -> Plate:
    """Chart the stiffnesses of the section over those of the solid along the wrist: rotations, then displacements."""
    number, charts = np.array([one.number for one in notches], dtype=float), []
    moving = tuple(name for name in NAMES if name not in _TURNING)
    for title, names in (("Bending and torsion", _TURNING), ("Axial force and shear", moving)):
        lines = tuple(
            Line(number, np.array([getattr(one.ratio, name) for one in notches]), NAMES[name], tone)
            for name, tone in zip(names, _TONES, strict=True)
        )
        alt = f"Stiffness of the section over that of the solid, notch by notch: {', '.join(NAMES[n] for n in names)}."
        charts.append(Chart(title, "notch", "section over solid", lines, alt))
    return Plate(tuple(charts), "Stiffness of the section over that of the solid, from the base on.")


def six_verdict(section: SixSection) -> Verdict:
    """Give the difference of the section from the solid in weak bending, and how far it moves the angles."""
    result = section.result
    weak = max((one.ratio.weak for one in result.notches), key=lambda ratio: abs(ratio - 1))
    words = "of the weak bending of a notch from the section, from that of the solid, at most"
    angles = [
        np.hypot(*(np.subtract(one.bending_deg, models[0].bending_deg))) for models in result.bent for one in models
    ]
    if angles:
        words += f"; the bent wrist differs by {max(angles):.2g} deg between the models"
    return Verdict("note", "Section and solid", f"{100 * (weak - 1):+.2g} %", words, "six-stiffnesses", section.command)
