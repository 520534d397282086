"""Write practice cases as record files.

``python -m validation.practice.cases --set work --kind known --out DIR`` writes four records per case.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import product
from pathlib import Path

from rich.progress import track

from hysteresis.records.record_file import write_record
from validation.practice.draw import LABELS, SETS, Case, draw_case, drawn_labels
from validation.practice.protocols import KINDS


def write_case(case: Case, folder: Path) -> list[Path]:
    """Write the records of a case into a folder with its name; the injected effects are not written."""
    paths = [folder / case.name / f"record-{i + 1}.csv" for i in range(len(case.records))]
    for record, path in zip(case.records, paths, strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_record(record, path)
    return paths


def labels(text: str) -> list[str]:
    """Read labels separated by commas, from a command line."""
    given = text.split(",")
    if unknown := [label for label in given if label not in LABELS]:
        raise argparse.ArgumentTypeError(f"{unknown[0]}: expected some of {', '.join(LABELS)}")
    return given


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.cases", description="Write practice cases.")
    parser.add_argument("--set", choices=[*SETS], default="work", help="set of seeds")
    parser.add_argument("--kind", choices=KINDS, default="known", help="whether the sidecar describes the rig")
    parser.add_argument("--count", type=int, default=10, help="cases of each effect")
    parser.add_argument("--effects", type=labels, help="by commas; also clean, pair; all by default")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write cases into ``DIR/SET-KIND/LABEL-NUMBER``."""
    options = parse(arguments)
    folder = options.out / f"{options.set}-{options.kind}"
    chosen = options.effects or drawn_labels(options.kind)
    for label, number in track([*product(chosen, range(options.count))], description="cases"):
        write_case(draw_case(options.set, options.kind, label, number), folder)


if __name__ == "__main__":
    main()
