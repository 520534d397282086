"""Draws the dimensions of the default rig into ``docs/images/dimensions.svg``: ``python -m docs.make.drawing``."""

from __future__ import annotations

from docs.make.pages import IMAGES
from fem_models.drawings import side_view_svg
from fem_models.rig import preset
from hysteresis.files import write_files

PICTURE = IMAGES / "dimensions.svg"

if __name__ == "__main__":
    write_files({PICTURE: side_view_svg(preset("du2018"))})
