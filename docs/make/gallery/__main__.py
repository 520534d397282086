"""Run the gallery scripts and write their pages: ``python -m docs.make.gallery``, or with the names of some."""

import sys
import tempfile
import time
from pathlib import Path

from docs.make.gallery.cells import page_of, run_script
from docs.make.pages import DOCS
from hysteresis.files import write_files

GALLERY = DOCS / "gallery"


def main(names: list[str]) -> None:
    """Write the page and the pictures of each script."""
    for script in sorted(GALLERY.glob("*.py")):
        if names and script.stem not in names:
            continue
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            page, pictures = page_of(script, run_script(script, Path(folder)))
        write_files({script.with_suffix(".md"): page, **{GALLERY / name: data for name, data in pictures.items()}})
        sys.stderr.write(f"{script.stem}: {time.perf_counter() - start:.1f} s, {len(pictures)} pictures\n")


if __name__ == "__main__":  # a study's workers import this module
    main(sys.argv[1:])
