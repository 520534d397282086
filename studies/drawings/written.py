"""Files of a rig for a workshop: flat pattern (DXF), solid (STEP, STL), dimensioned drawing (SVG, PDF)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from fem_models.drawings.beam import BEAMS, Beam
from fem_models.rig import Rig, RigError
from hysteresis.files import RecordError, write_files
from hysteresis.messages import quoted
from hysteresis.own import marked_pdf

Drawing = Literal["dxf", "step", "stl", "svg", "pdf"]
DRAWINGS: tuple[Drawing, ...] = ("dxf", "step", "stl", "svg", "pdf")
_ENDINGS = {"step": (".step", ".stp")}


@dataclass(frozen=True)
class DrawingChoice:
    """How a flat pattern is cut: width of the beam, where it points, and the angle of the seam; of DXF alone.

    None is the default: no kerf, planes, the seam where the fewest notches are cut.
    """

    kerf_mm: float | None = None
    beam: str | None = None
    seam_deg: float | None = None

    def read_beam(self) -> Beam:
        """Give the beam.

        Raises
        ------
        RigError
            A word that is none.
        """
        if self.beam is not None and self.beam not in BEAMS:
            raise RigError(f"beam = {quoted(self.beam)}: expected one of {', '.join(BEAMS)}")
        return next((one for one in BEAMS if one == self.beam), "plane")


def drawing_files(rig: Rig, out: Path, to: Drawing, choice: DrawingChoice | None = None) -> dict[Path, str | bytes]:
    """Give the files of a drawing, by their paths.

    Raises
    ------
    RigError
        Measured joints; a kerf that does not fit the notches; a choice that is of DXF alone.
    RecordError
        A name with another ending.
    MissingError
        Without the extra: ``drawing`` for DXF, ``solid`` for STEP and STL.
    """
    choice = choice or DrawingChoice()
    require_ending(out, to)
    if to != "dxf":
        for name, value in vars(choice).items():
            if value is not None:
                raise RigError(f"{name} = {value}: of a flat pattern: expected with dxf alone")
    return {out: _content(rig, to, choice)}


def require_ending(out: Path, to: Drawing) -> None:
    """Refuse a name with another ending.

    Raises
    ------
    RecordError
        If it is so.
    """
    endings = _ENDINGS.get(to, (f".{to}",))
    if out.suffix.lower() not in endings:
        raise RecordError(f"{out}: expected a name that ends in {' or '.join(endings)}")


def _content(rig: Rig, to: Drawing, choice: DrawingChoice) -> str | bytes:
    match to:
        case "dxf":
            from fem_models.drawings.dxf import pattern_dxf
            from fem_models.drawings.pattern import flat_pattern

            if choice.seam_deg is not None and not math.isfinite(choice.seam_deg):
                raise RigError(f"seam_deg = {choice.seam_deg}: expected a finite number")
            kerf = 0.0 if choice.kerf_mm is None else choice.kerf_mm
            pattern = flat_pattern(rig, kerf_mm=kerf, beam=choice.read_beam(), seam_deg=choice.seam_deg)
            return pattern_dxf(rig, pattern)
        case "step" | "stl":
            from fem_models.solid.tube import tube_step, tube_stl

            return tube_step(rig) if to == "step" else tube_stl(rig)
        case "svg":
            from fem_models.drawings import side_view_svg

            return side_view_svg(rig)
        case "pdf":
            from fem_models.drawings import side_view_pdf

            return marked_pdf(side_view_pdf(rig))


def write_drawing(rig: Rig, out: Path, *, to: Drawing, choice: DrawingChoice | None = None) -> Path:
    """Write a drawing, and give its path; errors as :func:`drawing_files`."""
    write_files(drawing_files(rig, out, to, choice))
    return out
