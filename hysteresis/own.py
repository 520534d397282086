"""The mark of their maker that results carry, by which a command replaces its own files and no others."""

from __future__ import annotations

import os
import re
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from hysteresis.files import RecordError, present, read_toml

MAKER = "notchbend"
"""The mark: key ``maker`` of JSON files and sidecars, generator of pages, software of pictures."""
_HEAD = 4096
_JSON = re.compile(rf'\s*\{{\s*"maker":\s*"{MAKER}'.encode())
_GENERATOR = f'<meta name="generator" content="{MAKER}">'
_PNG_START = b"\x89PNG\r\n\x1a\n"
_PNG_TEXT = b"tEXtSoftware\0" + MAKER.encode()
_PDF_END = f"\n% {MAKER}\n".encode()
_UNIT_END = f"made by {MAKER}".encode()
"""Comment at the end of the archive of a unit of co-simulation."""
_HEADERS = re.compile(
    rb"(?:drive,angle_deg,f_alone_deg,predicted_deg,|drive_mm,branch,angle_deg,tendon,guide,|(?:[\w.]+,)*[\w.]+_low(?:_deg)?,[\w.]+_median(?:_deg)?,[\w.]+_high|reference_deg,drive_\w+\s|angle_deg,rising_\w+,falling_\w+,angle_mdeg,|design,tube\.|record,law,parameter,value,low,high,unit,)"
)
"""Headers of tables of a fit, guides, ranges over an ensemble, a compensator, designs, many devices: of no test."""
_MODEL = re.compile(rf"<mujoco[^>]*>\s*<!-- [^>]*made by {MAKER}".encode())
"""Head of a model for another simulator."""
_DRAWINGS = {
    ".dxf": f"999\nmade by {MAKER}\n".encode(),
    ".step": f"ISO-10303-21;\n/* made by {MAKER} */".encode(),
    ".stp": f"ISO-10303-21;\n/* made by {MAKER} */".encode(),
    ".stl": f"{MAKER}: ".encode(),
}
"""Heads of drawings of a rig."""
_SVG = f"<dc:title>made by {MAKER}</dc:title>".encode()
_RIG = f"# made by {MAKER}\n".encode()
"""Head of a rig file that was imported or designed."""
_SOURCE = re.compile(rf"/\* [\w.]+: made by {MAKER} ".encode())
"""Head of a compensator in C."""


def marked_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a JSON file with the mark, which comes first."""
    return {"maker": MAKER, **values}


def marked_page(html: str) -> str:
    """Return a page with the mark in its head."""
    return html.replace("<head>", f"<head>\n{_GENERATOR}", 1)


def marked_png(png: bytes) -> bytes:
    """Return a PNG with the mark as its first text, after the header of 25 bytes; other bytes stay as they are."""
    if not png.startswith(_PNG_START) or _PNG_TEXT in png[:_HEAD]:
        return png
    length = (len(_PNG_TEXT) - 4).to_bytes(4, "big")
    at = len(_PNG_START) + 25
    return png[:at] + length + _PNG_TEXT + zlib.crc32(_PNG_TEXT).to_bytes(4, "big") + png[at:]


def marked_pdf(pdf: bytes) -> bytes:
    """Return a PDF with the mark as a comment at its end."""
    return pdf if pdf.endswith(_PDF_END) else pdf + _PDF_END


def is_own(path: Path) -> bool:
    """Tell whether a file carries the mark; a CSV has it in its sidecar, and a sidecar only if it is simulated."""
    suffix = path.suffix.lower()
    if suffix == ".zarr":
        path = path / "zarr.json"
    if not path.is_file():
        return False
    if suffix == ".toml":
        return _is_own_rig(path) or _is_own_sidecar(path)
    if suffix == ".csv" and present(path.with_suffix(".toml")):
        return _is_own_sidecar(path.with_suffix(".toml"))
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
            longest = max(len(_PDF_END), len(_UNIT_END))
            file.seek(max(0, path.stat().st_size - longest), os.SEEK_SET)
            end = file.read(longest)
    except OSError:
        return False
    marks = {
        ".json": _JSON.match(head) is not None,
        ".html": _GENERATOR.encode() in head,
        ".png": _PNG_TEXT in head,
        ".pdf": end.endswith(_PDF_END),
        ".zarr": f'"maker": "{MAKER}"'.encode() in head,
        ".csv": _HEADERS.match(head) is not None,
        ".c": _SOURCE.match(head) is not None,
        ".h": _SOURCE.match(head) is not None,
        ".fmu": end.endswith(_UNIT_END),
        ".xml": _MODEL.search(head) is not None,
        ".svg": _SVG in head,
        **{ending: head.startswith(mark) for ending, mark in _DRAWINGS.items()},
    }
    return marks.get(suffix, False)


def foreign(paths: Iterable[Path]) -> list[Path]:
    """Give those of the files that are there and do not carry the mark, in their order.

    A file without a place for a mark is own where one of the others has the mark and names it, as ``trace.json`` names
    the next program, and the sidecar of a record its theory and its rig.
    """
    there = [path for path in paths if present(path)]
    own = {path for path in there if is_own(path)}
    words = [path.read_bytes() for path in own if path.suffix.lower() in (".json", ".toml")]
    return [path for path in there if path not in own and not any(f'"{path.name}"'.encode() in one for one in words)]


def _is_own_rig(path: Path) -> bool:
    """Tell whether a rig file was imported by notchbend."""
    try:
        with path.open("rb") as file:
            return file.read(len(_RIG)) == _RIG
    except OSError:
        return False


def _is_own_sidecar(path: Path) -> bool:
    try:
        tables = read_toml(path, "a sidecar")
    except RecordError:
        return False
    return str(tables.get("maker", "")).startswith(MAKER) and tables.get("kind") == "simulated"
