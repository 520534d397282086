"""Running a study: cases go to Dask workers in small batches, and each answer is stored before the next goes out."""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from distributed import Client, Future, KilledWorker, as_completed

from studies.cases import OPTIONAL_GROUPS, Outcome, StudyError, evaluate_all, quantity_names
from studies.dataset import assemble, ranges, write_dataset
from studies.engines import require_exudyn, require_gmsh
from studies.inputs import code_version, versions
from studies.plan import Case, Plan, cases, plan_of
from studies.progress import bar
from studies.results import write_json
from studies.store import DiskFullError, Store, open_store
from studies.study_file import Study
from studies.workers import Team

IN_FLIGHT = 2  # batches a worker: one that runs, one that waits for it, so that no worker waits for us
_BATCH = {"chain": 16, "analytic": 32}
"""Cases a batch, about a tenth of a second; slower cases go one by one."""


@dataclass
class Tally:
    """What was done in a run: cases computed, and taken from the store."""

    computed: int = 0
    stored: int = 0


Done = Callable[[int], None]


def run_cases(todo: Iterable[Case], total: int, study: Study, store: Store, team: Team, *,
              retry: bool = False, done: Done = lambda _: None) -> Tally:  # fmt: skip
    """Run what the store does not have yet; ``retry`` also what failed. ``done`` hears how many cases are through.

    At most :data:`IN_FLIGHT` batches a worker are out at a time, whatever the number of cases. A batch whose worker
    died is run again when all others are through, case by case and each alone, so that none is blamed for another.

    Raises
    ------
    StudyError
        A full disk, a scheduler that is lost; what was stored before stays.
    """
    tally, flying, suspects = Tally(), set[str](), list[Case]()
    missing = _missing(todo, store, flying, tally, retry=retry, done=done)
    first = next(missing, None)
    if first is None:
        return tally
    client = team.client()
    size = min(_batch_size(study), max(1, math.ceil(total / (2 * IN_FLIGHT * team.size))))
    for batch, outcomes in _flow(_batches(missing, size, first), IN_FLIGHT * team.size, client, store):
        flying.difference_update(o.key for o in outcomes)
        tally.computed += len(outcomes)
        done(len(outcomes))
        if not outcomes:
            suspects += batch
    for (case,), outcomes in _flow(([case] for case in suspects), 1, client, store):
        if not outcomes:
            with store.transaction():
                store.keep([_died(case)])
        tally.computed += 1
        done(1)
    return tally


def _flow(
    batches: Iterator[list[Case]], width: int, client: Client, store: Store
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
        with store.transaction():
            store.keep(outcomes)
            new = hand_out(list(islice(batches, 1)))
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

    Ctrl-C writes the dataset of what is there before it goes on its way.

    Raises
    ------
    StudyError, MissingError
        One line: a disk without room, a scheduler that does not answer, an engine that is not installed.
    """
    start, plan = time.perf_counter(), plan_of(study)
    {"multibody": require_exudyn, "solid": require_gmsh}.get(study.engine, lambda: None)()
    with open_store(out) as store, Team(study.engine, workers, scheduler) as team:
        _keep_inputs(study, out)
        try:
            tally = _run_plan(study, plan, store, team, "cases", retry=retry, progress=progress)
        except (KeyboardInterrupt, DiskFullError):
            with suppress(DiskFullError):
                write_dataset(assemble(study, plan, store), out)
            raise
        dataset = assemble(study, plan, store)
        path = write_dataset(dataset, out)
        summary = _summary(study, plan, tally) | {"dataset": path.name}
        summary["failures"] = _failures(dataset)
        summary["quantities"] = ranges(dataset, quantity_names(study.engine, study.groups))
        _further(study, out, store, team, summary, progress=progress)
        summary["seconds"] = time.perf_counter() - start
        write_json(out / "study.json", summary)
    return summary


def _run_plan(study: Study, plan: Plan, store: Store, team: Team, words: str, *, retry: bool, progress: bool) -> Tally:
    with bar(progress) as shown:
        task = shown.add_task(words, total=len(plan))
        return run_cases(
            cases(study, plan.points()), len(plan), study, store, team, retry=retry,
            done=lambda n: shown.update(task, advance=n),
        )  # fmt: skip


def _further(study: Study, out: Path, store: Store, team: Team, summary: dict[str, Any], *, progress: bool) -> None:
    """Sensitivity and Pareto search, where the study asks for them, through the same store and workers."""
    if study.sensitivity is not None:
        from studies.sensitivity import saltelli_plan, sensitivity

        plan = saltelli_plan(study.axes, study.sensitivity)
        tally = _run_plan(study, plan, store, team, "sensitivity", retry=False, progress=progress)
        result = sensitivity(study, plan, store) | {"computed": tally.computed, "from_store": tally.stored}
        write_json(out / "sensitivity.json", result)
        summary["sensitivity"] = "sensitivity.json"
    if study.pareto is not None:
        from studies.pareto import pareto

        asked = study.pareto
        with bar(progress) as shown:
            task = shown.add_task("Pareto search", total=asked.population * asked.generations)

            def outcomes(points: list[Mapping[str, float]]) -> list[Outcome | None]:
                wanted = list(cases(study, points))
                run_cases(wanted, len(wanted), study, store, team, done=lambda n: shown.update(task, advance=n))
                return [store.find(case.key) for case in wanted]

            write_json(out / "pareto.json", pareto(study, outcomes))
        summary["pareto"] = "pareto.json"


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


def _summary(study: Study, plan: Plan, tally: Tally) -> dict[str, Any]:
    return {
        "schema": 1,
        "title": study.title,
        "engine": study.engine,
        "cases": len(plan),
        "computed": tally.computed,
        "from_store": tally.stored,
        "axes": {a.name: {"from": a.low, "to": a.high, "values": len(a.values) or None} for a in study.axes},
        "sample": None if study.sample is None else asdict(study.sample),
        "seed": study.seed,
        "versions": versions(study.engine),
        "code_sha256": code_version(study.engine),
        "inputs_sha256": {path.name: digest for path, digest in study.inputs.items()},
    }


def _failures(dataset: Any) -> dict[str, Any]:
    """Count the failed cases, by message."""
    messages = dataset.message.values[dataset.status.values == "failed"].tolist()
    return {"count": len(messages), "messages": {m: messages.count(m) for m in sorted(set(messages))[:20]}}
