"""Folder of the measured records, which are not part of the project; ``notchbend data fetch`` gets them."""

from __future__ import annotations

import os
from pathlib import Path


def measured_folder() -> Path:
    """Folder that the variable NOTCHBEND_MEASURED names; by default ``shared/measured`` beside the project."""
    return Path(os.environ.get("NOTCHBEND_MEASURED", Path(__file__).parents[3] / "shared" / "measured"))
