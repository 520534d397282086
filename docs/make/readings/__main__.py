"""Writes ``docs/validation/readings.md`` from ``readings.json``: ``python -m docs.make.readings [PART ...]``.

Parts named are worked out and stored first: ``table`` (at once), ``sets`` (four minutes), ``layer``.
"""

from __future__ import annotations

import argparse

from docs.make.readings.page import PAGE, page
from docs.make.readings.stored import PARTS, read
from hysteresis.files import write_files


def _tell(text: str) -> None:
    print(text, flush=True)  # noqa: T201


def main() -> None:
    """Work out the parts, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []])
    for part in parser.parse_args().parts:
        PARTS[part](_tell)
    write_files({PAGE: page(read())})


if __name__ == "__main__":
    main()
