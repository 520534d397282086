"""Images of results for the page, and the tube in three dimensions."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from pathlib import Path

from hysteresis.files import MB, inside, read_bytes
from hysteresis.records.record import RecordError
from studies.report.tube import read_tube
from studies.results.run import Picture

PNG = b"\x89PNG\r\n\x1a\n"
MOST_IMAGE_BYTES = 64 * MB


@dataclass(frozen=True)
class PictureSection:
    """The tube: a still image as base64 text, or the reason why there is none, and a view in three dimensions."""

    caption: str
    missing: str | None
    data: str | None
    view: str | None


def read_picture(folder: Path, file: str, picture: Picture) -> PictureSection:
    """Read the picture that a summary names, ``file`` of a folder.

    Raises
    ------
    RecordError
        One line with the file that is missing, leads out of the folder or cannot be read.
    """
    summary = folder / file
    return PictureSection(
        caption=picture.caption,
        missing=picture.missing,
        data=None if picture.file is None else image_text(inside(summary, "picture.file", picture.file, [".png"])),
        view=None if picture.tube is None else read_tube(inside(summary, "picture.tube", picture.tube, [".json"])),
    )


def image_text(path: Path) -> str:
    """Read a PNG as base64 text.

    Raises
    ------
    RecordError
        No such file, another kind of file, or a larger one than :data:`MOST_IMAGE_BYTES`.
    """
    png = read_bytes(path, "an image beside the results", most=MOST_IMAGE_BYTES)
    if not png.startswith(PNG):
        raise RecordError(f"{path}: no PNG: expected an image beside the results")
    return base64.b64encode(png).decode()
