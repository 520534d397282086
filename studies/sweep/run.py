"""Running a study: cases go to Dask workers in small batches, and each answer is stored before the next goes out."""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from distributed import Client, Future, KilledWorker, as_completed

from hysteresis.record import RecordError
from studies.engines import require_exudyn, require_gmsh
from studies.progress import bar
from studies.results import write_json
from studies.sweep.cases import OPTIONAL_GROUPS, Outcome, StudyError, evaluate_all, quantity_names
from studies.sweep.dataset import ZARR, Overview, write_dataset
from studies.sweep.inputs import code_version, versions
from studies.sweep.plan import Case, Plan, cases, plan_of
from studies.sweep.store import DiskFullError, Store, open_store
from studies.sweep.study_file import Study
from studies.sweep.workers import Team, interrupts_wait

SUMMARY = "study.json"
FURTHER = {"sensitivity": "sensitivity.json", "pareto": "pareto.json"}
IN_FLIGHT = 2  # batches a worker: one that runs, one that waits for it, so that no worker waits for us
_BATCH = {"chain": 16, "analytic": 32}
"""Cases a batch, about a tenth of a second; slower cases go one by one."""


@dataclass
class Tally:
    """What was done in a run till now: cases computed, and taken from the store."""

    computed: int = 0
    stored: int = 0


Done = Callable[[int], None]


def run_cases(todo: Iterable[Case], total: int, study: Study, store: Store, team: Team, tally: Tally, *,
              retry: bool = False, done: Done = lambda _: None) -> None:  # fmt: skip
    """Run what the store does not have yet; ``retry`` also what failed. ``done`` hears how many cases are through.

    At most :data:`IN_FLIGHT` batches a worker are out at a time, whatever the number of cases. A batch whose worker
    died is run again when all others are through, case by case and each alone, so that none is blamed for another.

    Raises
    ------
    StudyError
        A full disk, a scheduler that is lost; what was stored before stays.
    """
    flying, suspects = set[str](), list[Case]()
    missing = _missing(todo, store, flying, tally, retry=retry, done=done)
    first = next(missing, None)
    if first is None:
        return
    client = team.client()
    size = min(_batch_size(study), max(1, math.ceil(total / (2 * IN_FLIGHT * team.size))))
    for batch, outcomes in _flow(_batches(missing, size, first), IN_FLIGHT * team.size, client, store, tally):
        flying.difference_update(o.key for o in outcomes)
        done(len(outcomes))
        if not outcomes:
            suspects += batch
    for (case,), outcomes in _flow(([case] for case in suspects), 1, client, store, tally):
        if not outcomes:
            with store.transaction():
                store.keep([_died(case)])
            tally.computed += 1
        done(1)


def _flow(
    batches: Iterator[list[Case]], width: int, client: Client, store: Store, tally: Tally
) -> Iterator[tuple[list[Case], list[Outcome]]]:
    """Keep ``width`` batches out and give each as it comes back, its outcomes stored; none where its worker died."""
    answers, held = as_completed(), dict[Future, list[Case]]()

    def hand_out(new: Sequence[list[Case]]) -> Sequence[list[Case]]:
        store.hand_out((c.key, c.values) for batch in new for c in batch)
        return new

    def submit(new: Sequence[list[Case]]) -> None:
        for batch in new:
            future = client.submit(evaluate_all, [(c.key, c.inputs) for c in batch], pure=False)
            held[future] = batch
            answers.add(future)

    with store.transaction():
        new = hand_out(list(islice(batches, width)))
    submit(new)
    while held:
        future = next(answers)
        batch, outcomes = held.pop(future), _answer(future)
        with interrupts_wait():
            with store.transaction():
                store.keep(outcomes)
                new = hand_out(list(islice(batches, 1)))
            tally.computed += len(outcomes)
        future.release()  # the scheduler forgets it
        submit(new)
        yield batch, outcomes


def _missing(
    todo: Iterable[Case], store: Store, flying: set[str], tally: Tally, *, retry: bool, done: Done
) -> Iterator[Case]:
    again = set[str]()  # failed before; each is tried once more in a run
    for case in todo:
        found = store.find(case.key)
        if found is not None and not (retry and found.status == "failed" and case.key not in again):
            tally.stored += 1
            done(1)
        elif case.key in flying:  # the same point twice, as whole numbers may come up in a sample
            done(1)
        else:
            if found is not None:
                again.add(case.key)
            flying.add(case.key)
            yield case


def _batch_size(study: Study) -> int:
    return 1 if set(study.groups) & set(OPTIONAL_GROUPS) else _BATCH.get(study.engine, 1)


def _batches(rest: Iterator[Case], size: int, first: Case) -> Iterator[list[Case]]:
    batch = [first, *islice(rest, size - 1)]
    while batch:
        yield batch
        batch = list(islice(rest, size))


def _answer(future: Future) -> list[Outcome]:
    """Give what a batch came to; nothing where it took its worker down with it, as compiled code can."""
    if future.status == "finished":
        return list(future.result())
    error = future.exception() if future.status == "error" else None
    if isinstance(error, KilledWorker):
        return []
    raise StudyError(f"workers: {error or future.status}: expected answers; what is stored stays, run the study again")


def _died(case: Case) -> Outcome:
    nothing = dict.fromkeys(quantity_names(case.inputs["engine"], case.inputs["groups"]), math.nan)
    return Outcome(case.key, "failed", "the worker process died", math.nan, nothing)


def run_study(study: Study, out: Path, *, workers: int | None = None, scheduler: str | None = None,
              retry: bool = False, progress: bool = False) -> dict[str, Any]:  # fmt: skip
    """Run a study and write its folder: the store, the dataset, the summary that is returned, and what it asks besides.

    Ctrl-C and a full disk write the dataset and the summary of what is there before they go on their way.

    Raises
    ------
    StudyError, MissingError
        One line: a disk without room, a scheduler that does not answer, an engine that is not installed.
    """
    start, plan, tally = time.perf_counter(), plan_of(study), Tally()
    {"multibody": require_exudyn, "solid": require_gmsh}.get(study.engine, lambda: None)()

    def write() -> dict[str, Any]:
        """Write the dataset and its summary: interrupted, till all that the study asks for is there."""
        summary = _summary(study, tally, write_dataset(study, plan, store, out))
        return _write_summary(out, summary, "interrupted", start)

    with open_store(out) as store, Team(study.engine, workers, scheduler) as team:
        try:
            _keep_inputs(study, out)
            _run_plan(study, plan, store, team, "cases", tally, retry=retry, progress=progress)
            summary = write()
        except (KeyboardInterrupt, DiskFullError):
            with suppress(DiskFullError, RecordError):  # what stops the study is said, and not this
                write()
            raise
        further = _further(study, out, store, team, progress=progress)
        return _write_summary(out, summary | further, "finished", start)


def _run_plan(
    study: Study, plan: Plan, store: Store, team: Team, words: str, tally: Tally, *, retry: bool, progress: bool
) -> None:
    with bar(progress) as shown:
        task = shown.add_task(words, total=len(plan))
        run_cases(
            cases(study, plan.points()), len(plan), study, store, team, tally, retry=retry,
            done=lambda n: shown.update(task, advance=n),
        )  # fmt: skip


def _further(study: Study, out: Path, store: Store, team: Team, *, progress: bool) -> dict[str, str]:
    """Sensitivity and Pareto search, where the study asks for them, through the same store and workers."""
    written = {}
    if study.sensitivity is not None:
        from studies.sweep.sensitivity import saltelli_plan, sensitivity

        plan, tally = saltelli_plan(study.axes, study.sensitivity), Tally()
        _run_plan(study, plan, store, team, "sensitivity", tally, retry=False, progress=progress)
        result = sensitivity(study, plan, store) | {"computed": tally.computed, "from_store": tally.stored}
        write_json(out / FURTHER["sensitivity"], result)
        written["sensitivity"] = FURTHER["sensitivity"]
    if study.pareto is not None:
        from studies.sweep.pareto import pareto

        asked = study.pareto
        with bar(progress) as shown:
            task = shown.add_task("Pareto search", total=asked.population * asked.generations)

            def outcomes(points: list[Mapping[str, float]]) -> list[Outcome | None]:
                wanted, done = list(cases(study, points)), partial(shown.advance, task)
                run_cases(wanted, len(wanted), study, store, team, Tally(), done=done)
                return [store.find(case.key) for case in wanted]

            write_json(out / FURTHER["pareto"], pareto(study, outcomes))
        written["pareto"] = FURTHER["pareto"]
    return written


def _keep_inputs(study: Study, out: Path) -> None:
    """Copy what was read into ``inputs``, the study file under its own name."""
    folder = out / "inputs"
    try:
        folder.mkdir(exist_ok=True)
        for path in study.inputs:
            if path.resolve() != (folder / path.name).resolve():
                shutil.copyfile(path, folder / path.name)
    except OSError as error:
        raise DiskFullError(f"{folder}: {error.strerror}: expected a folder that can be written to") from None


def _summary(study: Study, tally: Tally, overview: Overview) -> dict[str, Any]:
    """Say what was asked, and what is in the dataset."""
    names = quantity_names(study.engine, study.groups)
    return {
        "schema": 1,
        "title": study.title,
        "engine": study.engine,
        "cases": sum(overview.status.values()),
        "status": overview.status,
        "computed": tally.computed,
        "from_store": tally.stored,
        "axes": {a.name: {"from": a.low, "to": a.high, "values": len(a.values) or None} for a in study.axes},
        "sample": None if study.sample is None else asdict(study.sample),
        "seed": study.seed,
        "versions": versions(study.engine),
        "code_sha256": code_version(study.engine),
        "inputs_sha256": {path.name: digest for path, digest in study.inputs.items()},
        "dataset": ZARR,
        "failures": {"count": overview.status["failed"], "messages": overview.messages},
        "quantities": {name: overview.ends[name] for name in names if name in overview.ends},
    }


def _write_summary(out: Path, summary: dict[str, Any], state: str, start: float) -> dict[str, Any]:
    """Write ``study.json``; results of an earlier run that it does not name would be taken for its own: they go."""
    for kind, name in FURTHER.items():
        if kind not in summary:
            (out / name).unlink(missing_ok=True)
    whole = summary | {"state": state, "seconds": time.perf_counter() - start}
    write_json(out / SUMMARY, whole)
    return whole
