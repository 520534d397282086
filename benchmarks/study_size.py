"""Time and memory of a study over its size: ``python -m benchmarks.study_size [--workers N] [--parts] [SIZE...]``.

Each size is a separate run of ``notchbend study`` with the chain, on a Sobol sample of preload and notch depth, with
the groups loop and strain. Processor time is that of the command and of its workers, start included. Memory is the
largest sum of the resident sets of the command and all its processes, and of the command alone; shared pages are
counted in each process. All are sampled ten times a second.

``--parts`` prints what a case costs part by part, in one process and without Dask, and each part over the kernel that
follows the chain.
"""

from __future__ import annotations

import argparse
import gc
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import psutil

from fem_models.chain.follow import follow, tape_of
from fem_models.chain.parameters import memory_at_rest
from fem_models.chain.solve import chain_case, followed, run_space
from fem_models.rig.rig_file import rig_of_tables
from studies.sweep import read_study
from studies.sweep.cases import evaluate, evaluate_all, program_of_table
from studies.sweep.dataset import write_dataset
from studies.sweep.plan import cases, plan_of
from studies.sweep.store import open_store

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
OF_A_PART = 512
KERNEL = "kernel"
IN_WORKER = ("rig from its tables", "joints, parameters, path", KERNEL, "memory and checks of the run", "quantities")


@dataclass(frozen=True)
class Cost:
    """Seconds, processor seconds and MB: of the command alone, and of all its processes; MB of the store."""

    seconds: float
    alone_s: float
    workers_s: float
    alone_MB: float
    all_MB: float
    store_MB: float


def measured(count: int, engine: str, workers: int, folder: Path) -> Cost:
    """Run a study."""
    file, out = folder / f"{count}.toml", folder / str(count)
    file.write_text(STUDY.format(engine=engine, count=count))
    command = [sys.executable, "-c", RUN, "study", str(file), "--out", str(out), "--quiet"]
    start = time.perf_counter()
    process = subprocess.Popen([*command, "--workers", str(workers)])
    family, alone, together, spent = psutil.Process(process.pid), 0, 0, dict[int, float]()
    while process.poll() is None:
        try:
            members = (family, *family.children(recursive=True))
            sizes = [one.memory_info().rss for one in members]
            spent |= {one.pid: sum(one.cpu_times()[:2]) for one in members}
            alone, together = max(alone, sizes[0]), max(together, sum(sizes))
        except psutil.Error:  # a process has just ended
            pass
        time.sleep(0.1)
    if process.returncode:
        sys.exit(process.returncode)
    own, store = spent.pop(process.pid), (out / "cases.sqlite").stat().st_size
    seconds = time.perf_counter() - start
    return Cost(seconds, own, sum(spent.values()), alone / 1e6, together / 1e6, store / 1e6)


class Clock:
    """Processor time of the parts of a case, µs."""

    def __init__(self) -> None:
        self.us = dict[str, float]()

    @contextmanager
    def part(self, name: str, count: int) -> Iterator[None]:
        """Add what a block takes, over a number of cases."""
        start = time.process_time()
        yield
        self.us[name] = self.us.get(name, 0.0) + 1e6 * (time.process_time() - start) / count


def parts_of_a_case(folder: Path) -> dict[str, float]:
    """Processor time of the parts of a case, µs.

    Some cases are made and run part by part, others as a worker does: what they take more are the quantities.
    """
    file, clock, n = folder / "parts.toml", Clock(), OF_A_PART
    file.write_text(STUDY.format(engine="chain", count=2 * n))
    study = read_study(file)
    program, plan = program_of_table(study.tables.program), plan_of(study)
    list(islice(cases(study, plan.points()), n))
    with clock.part("point and key, twice", n):  # the second time when the dataset is written
        points = list(cases(study, plan.points()))
    evaluate(points[0].key, points[0].inputs)  # which reads the kernels from their cache
    gc.freeze()  # as in a worker
    tables = [one.inputs.rig for one in points[:n]]
    with clock.part("rig from its tables", n):
        rigs = [rig_of_tables(one, "") for one in tables]
    with clock.part("joints, parameters, path", n):
        made = [chain_case(rig, program) for rig in rigs]
    for rig, case in zip(rigs, made, strict=True):
        with clock.part("run", n):
            followed(rig, case)
        run, memory, tape = run_space(case, rig.joints), memory_at_rest(rig, case.joints), tape_of(0, rig.joints)
        with clock.part(KERNEL, n):
            follow(case.path, case.parameters, memory, run, tape)
    del tables, rigs, made, rig, case, run, memory, tape  # a worker holds its own cases alone
    own = clock.us
    own["memory and checks of the run"] = own.pop("run") - own[KERNEL]
    before = own["rig from its tables"] + own["joints, parameters, path"] + own["memory and checks of the run"]
    with clock.part("to the worker and back", n):
        asked = [(one.key, one.inputs) for one in points[n:]]
        asked = pickle.loads(pickle.dumps(asked))
    with clock.part("whole", n):
        answers = evaluate_all(asked)
    own["quantities"] = own.pop("whole") - before - own[KERNEL]
    with clock.part("to the worker and back", n):
        pickle.loads(pickle.dumps(answers))
    with open_store(folder / "parts") as store:
        with clock.part("store", n), store.transaction():
            for one in points[n:]:
                store.find(one.key)
            store.hand_out((one.key, one.values) for one in points[n:])
            store.keep(answers)
        with store.transaction():  # the others, so that the dataset is whole
            rest = evaluate_all([(one.key, one.inputs) for one in points[:n]])
            store.hand_out((one.key, one.values) for one in points[:n])
            store.keep(rest)
        write_dataset(study, plan, store, folder / "parts")
        with clock.part("dataset, without keys", 2 * n):
            write_dataset(study, plan, store, folder / "parts")
    own["dataset, without keys"] -= 0.5 * own["point and key, twice"]
    return own


def print_parts(folder: Path) -> None:
    """Print the parts of a case, and each over the kernel."""
    us = parts_of_a_case(folder)
    kernel, in_worker = us[KERNEL], sum(us[name] for name in IN_WORKER)
    for name, part in (us | {"case in its worker": in_worker, "case in all": sum(us.values())}).items():
        sys.stdout.write(f"{name:30s}  {part:7.0f} us  {part / kernel:6.2f}\n")


def main() -> None:
    """Print a row for each size, or the parts of a case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", type=int, nargs="*")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--engine", default="chain")
    parser.add_argument("--parts", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if given.parts:
            print_parts(Path(folder))
        if given.sizes:
            sys.stdout.write("  cases  workers  seconds  command s  workers s  command MB  all MB  store MB\n")
        for count in given.sizes:
            cost = measured(count, given.engine, given.workers, Path(folder))
            sys.stdout.write(
                f"{count:7d}  {given.workers:7d}  {cost.seconds:7.1f}  {cost.alone_s:9.1f}  {cost.workers_s:9.1f}  "
                f"{cost.alone_MB:10.0f}  {cost.all_MB:6.0f}  {cost.store_MB:8.1f}\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
