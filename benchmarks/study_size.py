"""Time and memory of a study over its size: ``python -m benchmarks.study_size [--workers N] SIZE...``.

Each size is a separate run of ``notchbend study`` with the chain, on a Sobol sample of preload and notch depth. Memory
is the largest sum of the resident sets of the command and all its processes, and of the command alone, sampled ten
times a second; shared pages are counted in each process.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

STUDY = """schema = 1
title = "Preload and notch depth"
engine = "{engine}"
[rig]
preset = "du2018"
[program]
amplitude_mm = 2.2
cycles = 2
[vary]
preload_N = {{ from = 5, to = 40 }}
"notch.depth_mm" = {{ from = 2.70, to = 2.90 }}
[sample]
method = "sobol"
count = {count}
"""
RUN = "from studies.commands import main; main()"


def measured(count: int, engine: str, workers: int, folder: Path) -> tuple[float, float, float]:
    """Run a study; give seconds, and MB of the command alone and of all its processes."""
    file = folder / f"{count}.toml"
    file.write_text(STUDY.format(engine=engine, count=count))
    command = [sys.executable, "-c", RUN, "study", str(file), "--out", str(folder / str(count)), "--quiet"]
    start = time.perf_counter()
    process = subprocess.Popen([*command, "--workers", str(workers)])
    family, alone, together = psutil.Process(process.pid), 0, 0
    while process.poll() is None:
        try:
            sizes = [p.memory_info().rss for p in (family, *family.children(recursive=True))]
            alone, together = max(alone, sizes[0]), max(together, sum(sizes))
        except psutil.Error:  # a process has just ended
            pass
        time.sleep(0.1)
    if process.returncode:
        sys.exit(process.returncode)
    return time.perf_counter() - start, alone / 1e6, together / 1e6


def main() -> None:
    """Print a row for each size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", type=int, nargs="+")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--engine", default="chain")
    given = parser.parse_args()
    sys.stdout.write("  cases  workers  seconds  command MB  all MB\n")
    with tempfile.TemporaryDirectory() as folder:
        for count in given.sizes:
            seconds, alone, together = measured(count, given.engine, given.workers, Path(folder))
            sys.stdout.write(f"{count:7d}  {given.workers:7d}  {seconds:7.1f}  {alone:10.0f}  {together:6.0f}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
