"""``python -m tests.malformed COUNT SEED``: what became of COUNT spoiled files, and those that broke a promise.

``python -m tests.malformed COUNT SEED tables`` spoils tables of all kinds that ``record new`` reads.
"""

import sys
import tempfile
from importlib import import_module
from pathlib import Path

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[1])]
    run, samples = import_module("malformed.run"), import_module("malformed.samples")
    count, seed = int(sys.argv[1]), int(sys.argv[2])
    with tempfile.TemporaryDirectory() as made:
        if sys.argv[3:] == ["tables"]:
            good = import_module("malformed.tables").tables(Path(made) / "good")
        else:
            good = samples.readers(Path(made) / "good")
        tried = [*run.try_good(good, Path(made)), *run.try_all(good, count, seed, Path(made))]
    for one in tried:
        if not one.good:
            print(f"{one.outcome}: {one.reader}, {one.file}, {one.way}: {one.words[-1500:]}\n")
    print(run.table([one for one in tried if one.file]))
    sys.exit(any(not one.good for one in tried))
