"""The law of the metal of a rig that passes the plateau of Nitinol: the flag where none is stated, and what each gives.

Below its plateau Nitinol is linear, and the law does not matter. Beyond it a linear metal is too stiff and has no loop,
and Jenkins elements have one of another kind (:class:`fem_models.rig.rig.Material`). A rig file that states neither
``[superelastic]`` nor ``material.loop_share`` is run with the flag of the metal's table
(:mod:`fem_models.rig.metal`) if its drive takes it there; ``loop_share = 0`` states a linear metal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fem_models.chain.solve import solve_chain
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Superelastic
from fem_models.rig.joints import NotchedTube
from fem_models.rig.metal import METAL_RANGES
from fem_models.rig.rig_file import given_in_file

_SAMPLES = 23


@dataclass(frozen=True)
class LawOfMetal:
    """A rig with the law that it is run with, and a line on what each law gives; None below the plateau."""

    rig: Rig
    words: str | None = None
    by_default: bool = False

    @property
    def notes(self) -> list[str]:
        """The line as a note of a terminal."""
        return [f"note: {self.words}"] if self.words else []


def law_of_metal(rig: Rig, low_mm: float, high_mm: float, file: Path | None = None) -> LawOfMetal:
    """Choose the law of the metal of a rig that is driven from the lower end to the upper one.

    Parameters
    ----------
    file
        The rig file, which says whether the law is stated; a preset states its own.

    Raises
    ------
    RigError
        A file that cannot be read.
    """
    if not isinstance(rig.joint, NotchedTube) or rig.superelastic is not None or not low_mm < high_mm:
        return LawOfMetal(rig)
    flag = replace(rig, material=replace(rig.material, loop_share=0.0), superelastic=Superelastic())
    linear = replace(flag, superelastic=None)
    peak = _peak_strain(linear, low_mm, high_mm)
    law = Superelastic()
    plateau = law.start_MPa / (1e3 * rig.material.youngs_modulus_GPa)
    if peak is None or peak <= plateau:
        return LawOfMetal(rig)
    stated = file is None or "material.loop_share" in given_in_file(file)
    laws = {"the flag law of the metal's table": flag, "a linear metal": linear}
    if rig.material.loop_share > 0:
        laws = {"the rig's Jenkins loop": rig, **laws}
    widths = "; ".join(f"{name} {_width(one, low_mm, high_mm)}" for name, one in laws.items())
    used = "the law that the rig states" if stated else f"the flag law by default, {_table(law)}"
    words = (
        f"a linear metal is strained by {100 * peak:.3g} %, beyond the plateau of Nitinol at {100 * plateau:.2g} %: "
        f"run with {used}; loop width of each law: {widths}"
    )
    return LawOfMetal(rig if stated else flag, words, not stated)


def _table(law: Superelastic) -> str:
    low, high, _ = METAL_RANGES["superelastic.plateau_MPa"]
    back = METAL_RANGES["superelastic.unloading_plateau_MPa"]
    return f"{law.plateau_MPa:g}/{law.unloading_plateau_MPa:g} MPa ({low:g} to {high:g} and {back[0]:g} to {back[1]:g})"


def _peak_strain(rig: Rig, low_mm: float, high_mm: float) -> float | None:
    """Give the largest strain at both ends; None of a rig that does not get there."""
    drive = np.concatenate([np.linspace(0.0, high_mm, _SAMPLES), np.linspace(high_mm, low_mm, 2 * _SAMPLES)[1:]])
    try:
        return float(np.abs(solve_chain(rig, LoadProgram(drive)).peak_strain).max())
    except (RigError, SolverError):
        return None


def _width(rig: Rig, low_mm: float, high_mm: float) -> str:
    from validation.separation.contributions import closed_loop, loop_program  # most runs stay below the plateau

    try:
        return f"{closed_loop(rig, loop_program(low_mm, high_mm, cycles=1, steps=2 * _SAMPLES)).width_deg:.3g} deg"
    except (RigError, SolverError):
        return "cannot follow the drive"
