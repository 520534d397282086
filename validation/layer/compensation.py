"""Compensation judged by the mechanics: the drive from an identified layer, run in the multibody model.

``python -m validation.layer.compensation`` writes the table of docs/guide/compensation.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from fem_models.chain.solve import simulate_chain
from fem_models.load.program import LoadProgram
from fem_models.rig.presets import preset
from fem_models.rig.rig import Rig
from hysteresis import identify
from hysteresis.arrays import Floats
from hysteresis.files import write_files
from hysteresis.fit import Fit
from hysteresis.inverse import compensating_drive, uncompensated_drive
from hysteresis.record import Record
from hysteresis.settings import IdentifySettings

Engine = Callable[[Rig, LoadProgram], Record]

AMPLITUDES_MM = (1.8, 1.4, 1.0)
"""Of the loops that the layer is identified on: they hold the references, and say how h goes with the amplitude."""
STEP_MM = 0.05
PAGE = Path(__file__).parents[2] / "docs" / "guide" / "compensation.md"
MARK = "<!-- table of `python -m validation.layer.compensation` -->"


@dataclass(frozen=True)
class Tracking:
    """Root mean square errors of an angle that follows a reference, deg."""

    with_deg: float
    without_deg: float

    @property
    def ratio(self) -> float:
        """How many times smaller the error is with compensation."""
        return self.without_deg / self.with_deg


def shrinking_loops(amplitudes_mm: tuple[float, ...] = AMPLITUDES_MM) -> LoadProgram:
    """Go from rest to +A, then -A and +A, for one amplitude after the other."""
    turns = [0.0, *(x for a in amplitudes_mm for x in (a, -a, a))]
    pieces = [np.zeros(1)]
    for start, end in pairwise(turns):
        pieces.append(np.linspace(start, end, int(np.ceil(abs(end - start) / STEP_MM - 1e-9)) + 1)[1:])
    return LoadProgram(np.concatenate(pieces))


def references() -> dict[str, Floats]:
    """Angles to follow, from rest: two cycles of a triangle of +-30 deg, and a sine that decays from 30 deg."""
    k = np.arange(241)
    triangle = 30 * (1 - np.abs((k / 30 + 1) % 4 - 2))
    time = np.linspace(0, 6, 361)
    return {"triangle of +-30 deg": triangle, "decaying sine": 30 * np.exp(-time / 3) * np.sin(2 * np.pi * time)}


def layer(rig: Rig, engine: Engine, elements: int | None = None) -> Fit:
    """Identify f + h on shrinking loops of a rig, f fitted: all that a bench would know."""
    return identify(engine(rig, shrinking_loops()), settings=IdentifySettings(elements=elements))


def track(fit: Fit, rig: Rig, reference_deg: Floats, engine: Engine) -> Tracking:
    """Run the drives with and without compensation from rest, and compare the angles with the reference."""

    def error(drive: Floats) -> float:
        angle = engine(rig, LoadProgram(np.append(0.0, drive))).angle_deg[1:]
        return float(np.sqrt(np.mean((angle - reference_deg) ** 2)))

    drive, plain = compensating_drive(fit, reference_deg, 0.0), uncompensated_drive(fit, reference_deg)
    return Tracking(error(drive), error(plain))


def table() -> list[str]:
    """One row a layer and reference, as Markdown."""
    from fem_models.multibody.quasi_static import simulate_multibody

    rig = preset("du2018", preload_N=20.0)
    lines = [
        "| loops of | elements of h | reference | without, deg | with, deg | ratio |",
        "|---|---|---|---|---|---|",
    ]
    for name, engine in (("multibody model", simulate_multibody), ("chain", simulate_chain)):
        for elements in (1, 2):
            fit = layer(rig, engine, elements)
            for what, reference in references().items():
                found = track(fit, rig, reference, simulate_multibody)
                errors = f"{found.without_deg:.3f} | {found.with_deg:.3f} | {found.ratio:.1f}"
                lines.append(f"| {name} | {elements} | {what} | {errors} |")
    return lines


def main() -> None:
    """Write the table into its page, between the two marks."""
    before, _, after = PAGE.read_text(encoding="utf-8").split(MARK)
    write_files({PAGE: MARK.join([before, "\n" + "\n".join(table()) + "\n", after])})


if __name__ == "__main__":
    main()
