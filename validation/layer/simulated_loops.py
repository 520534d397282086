"""Fits of simulated loops of the default rig: the quantities of the paper's Table 1, and minor loops."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fem_models.analytic import theory_curve
from fem_models.chain import simulate_chain
from fem_models.load import LoadProgram, triangle
from fem_models.rig import preset
from hysteresis import Record, identify
from hysteresis.arrays import Floats, Mask
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.records.holdout import Split
from hysteresis.records.metrics import Errors, errors

PRELOADS_N = (10.0, 20.0)
AMPLITUDES_MM = (2.2, 1.1, 0.55)


@dataclass(frozen=True)
class LoopFit:
    """A fit of a simulated loop: what it was fitted with, and its errors.

    ``kinematics`` says whether f is the analytic model or fitted to the loop. ``errors`` are those of the held-out
    cycle, or of each amplitude of a minor-loop program, the largest first.
    """

    preload_N: float
    kinematics: str
    elements: int
    amplitude_deg: float
    errors: tuple[Errors, ...]


def paper_table() -> list[LoopFit]:
    """Fit simulated loops of three cycles, the last one held out: the quantities of the paper's Table 1."""
    found = []
    for preload in PRELOADS_N:
        record = simulate_chain(preset("du2018-full-widths", preload_N=preload), triangle(2.2, cycles=3))
        for kinematics, base, elements in _variants(preload):
            fit = identify(record, base, settings=IdentifySettings(elements=elements))
            found.append(LoopFit(preload, kinematics, elements, _amplitude_deg(record), (fit.heldout,)))
    return found


def minor_loops() -> list[LoopFit]:
    """Predict loops of half and quarter amplitude from the large loop."""
    program, parts = nested(AMPLITUDES_MM)
    split = Split(parts[0], ~parts[0], "loops of half and quarter amplitude")
    found = []
    for preload in PRELOADS_N:
        record = simulate_chain(preset("du2018-full-widths", preload_N=preload), program)
        for kinematics, base, elements in _variants(preload):
            fit = identify(record, base, settings=IdentifySettings(elements=elements), splits=[split])
            angle = fit.predict(record.drive)
            each = tuple(errors(record.angle_deg[part], angle[part]) for part in parts)
            found.append(LoopFit(preload, kinematics, elements, _amplitude_deg(record), each))
    return found


def nested(amplitudes_mm: Sequence[float]) -> tuple[LoadProgram, list[Mask]]:
    """Two cycles of each amplitude, one after the other, and the samples of each, shapes (m,)."""
    parts = [triangle(amplitude, cycles=2).drive_mm for amplitude in amplitudes_mm]
    # from +A of one amplitude down to +A of the next in steps of 0.1 mm
    drive, sizes = [parts[0]], [len(parts[0])]
    for previous, part, amplitude in zip(amplitudes_mm[:-1], parts[1:], amplitudes_mm[1:], strict=True):
        transition = np.arange(previous, amplitude, -0.1)[1:]
        loop = part[np.argmax(part) :]
        drive += [transition, loop]
        sizes.append(len(transition) + len(loop))
    part_of = np.repeat(np.arange(len(sizes)), sizes)
    return LoadProgram(np.concatenate(drive)), [part_of == i for i in range(len(sizes))]


def _variants(preload_N: float) -> Iterator[tuple[str, Callable[[Floats], Floats] | None, int]]:
    rig = preset("du2018-full-widths", preload_N=preload_N)

    def analytic(drive: Floats) -> Floats:
        return theory_curve(rig, drive).angle_deg

    for kinematics, base in (("analytic", analytic), ("fitted", None)):
        for elements in (1, 2):
            yield kinematics, base, elements


def _amplitude_deg(record: Record) -> float:
    return float(np.abs(record.angle_deg).max())
