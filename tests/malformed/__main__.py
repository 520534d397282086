"""``python -m tests.malformed COUNT SEED``: print what became of COUNT spoiled files, and those that broke a promise."""

import sys
import tempfile
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

from malformed.run import table, try_all, try_good
from malformed.samples import readers

if __name__ == "__main__":
    count, seed = int(sys.argv[1]), int(sys.argv[2])
    with tempfile.TemporaryDirectory() as made:
        good = readers(Path(made) / "good")
        before = try_good(good, Path(made))
        print("\n".join(f"{one.outcome} in {one.seconds:.1f} s: {one.reader} {one.words}" for one in before), flush=True)
        tried = list(try_all(good, count, seed, Path(made)))
    for one in tried:
        if not one.good:
            print(f"{one.outcome}: {one.reader}, {one.file}, {one.way}: {one.words[-1500:]}\n")
    print(table(tried))
    sys.exit(any(not one.good for one in tried))
