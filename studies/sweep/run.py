"""Running a study: cases go to Dask workers in small batches, and each answer is stored before the next batch goes."""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path

from distributed import Client, Future, KilledWorker, as_completed

from hysteresis.records.record import RecordError
from studies.engines import require_exudyn, require_gmsh
from studies.progress import bar
from studies.results import write_result
from studies.results.made import Made
from studies.results.study import AxisRange, Failures, StudySummary
from studies.sweep.cases import Outcome, evaluate_all
from studies.sweep.code import code_version, versions, with_code
from studies.sweep.dataset import PENDING, ZARR, Overview, write_dataset
from studies.sweep.errors import DiskFullError, LostError
from studies.sweep.plan import Case, Plan, cases, plan_of
from studies.sweep.quantities import OPTIONAL_GROUPS, quantity_names
from studies.sweep.store import Store, open_store
from studies.sweep.study_file import Pareto, Study
from studies.sweep.workers import LOST, WorkerPool, answers_expected, interrupts_wait

SUMMARY = "study.json"
SENSITIVITY, PARETO = "sensitivity.json", "pareto.json"
IN_FLIGHT = 2  # batches a worker: one that runs and one that waits, so that no worker is idle
_BATCH = {"chain": 16, "analytic": 32}
"""Number of cases in a batch until it is known how long one takes; slower cases go one at a time."""
BATCH_S, MOST_IN_BATCH = 0.5, 512
"""Time of a batch, and its most cases: handing one out takes Dask some hundredths of a second."""


@dataclass
class Tally:
    """Number of cases computed so far, and taken from the store; ``seconds`` is what one of the last batch took."""

    computed: int = 0
    stored: int = 0
    seconds: float = 0.0

    def add(self, outcomes: Sequence[Outcome]) -> None:
        """Count cases that were computed."""
        self.computed += len(outcomes)
        if outcomes:
            self.seconds = sum(outcome.wall_s for outcome in outcomes) / len(outcomes)


@dataclass(frozen=True)
class Session:
    """A study with the store of its folder and the workers that run its cases."""

    study: Study
    store: Store
    workers: WorkerPool


Report = Callable[[int], None]
"""Called with a number of cases that are done."""


def run_cases(session: Session, todo: Iterable[Case], total: int, tally: Tally, *, retry: bool = False,
              report: Report = lambda _: None) -> None:  # fmt: skip
    """Run the cases that the store does not have, ``total`` at most; with ``retry`` also those that failed.

    At most :data:`IN_FLIGHT` batches a worker are out at a time, whatever the number of cases. A batch whose worker
    died is run again after all others, one case at a time and each alone, to find the case that ends a worker.

    Raises
    ------
    StudyError
        A full disk, or a scheduler that is lost; what was stored before is kept.
    """
    in_flight, suspects = set[str](), list[Case]()
    missing = _missing(session.store, todo, in_flight, tally, retry=retry, report=report)
    first = next(missing, None)
    if first is None:
        return

    def width() -> int:
        return IN_FLIGHT * session.workers.size

    def size() -> int:
        return min(_batch_size(session.study, tally), max(1, math.ceil(total / (2 * width()))))

    for batch, outcomes in _flow(session, _batches(missing, size, first), width, tally):
        in_flight.difference_update(o.key for o in outcomes)
        report(len(outcomes))
        if not outcomes:
            suspects += batch
    for (case,), outcomes in _flow(session, ([case] for case in suspects), lambda: 1, tally):
        if not outcomes:
            with session.store.transaction():
                session.store.keep([_died(case)])
            tally.computed += 1
        report(1)


def _flow(
    session: Session, batches: Iterator[list[Case]], width: Callable[[], int], tally: Tally
) -> Iterator[tuple[list[Case], list[Outcome]]]:
    """Keep ``width()`` batches out; give each when it is back, with its stored outcomes, none if its worker died."""
    client, store = session.workers.client(), session.store
    answers, held, engine = as_completed(), dict[Future, list[Case]](), session.study.engine
    code = code_version(engine)

    def hand_out(new: Sequence[list[Case]]) -> Sequence[list[Case]]:
        store.hand_out((c.key, c.values) for batch in new for c in batch)
        return new

    def submit(new: Sequence[list[Case]]) -> None:
        for batch in new:
            with answers_expected():
                given = [(c.key, c.inputs) for c in batch]
                future = client.submit(with_code, code, engine, evaluate_all, given, pure=False)
            held[future] = batch
            answers.add(future)

    with store.transaction():
        new = hand_out(list(islice(batches, width())))
    submit(new)
    while held:
        more = max(0, width() + 1 - len(held))  # asked before an answer is there, which a lost scheduler would lose
        future = next(answers)
        batch, outcomes = held.pop(future), _answer(future)
        with interrupts_wait():
            with store.transaction():
                store.keep(outcomes)
                new = hand_out(list(islice(batches, more)))
            tally.add(outcomes)
        future.release()  # the scheduler deletes it
        submit(new)
        yield batch, outcomes


def _missing(
    store: Store, todo: Iterable[Case], in_flight: set[str], tally: Tally, *, retry: bool, report: Report
) -> Iterator[Case]:
    """Give the cases that have to run, and add them to ``in_flight``."""
    again = set[str]()  # cases that failed before; each is tried once more in a run
    for case in todo:
        found = store.find(case.key)
        if found is not None and not (retry and found.status == "failed" and case.key not in again):
            tally.stored += 1
            report(1)
        elif case.key in in_flight:  # the same point twice, as can happen with whole numbers in a sample
            report(1)
        else:
            if found is not None:
                again.add(case.key)
            in_flight.add(case.key)
            yield case


def _batch_size(study: Study, tally: Tally) -> int:
    """Give the cases that take :data:`BATCH_S` at the pace of the last batch; no number of a case depends on it."""
    if set(study.groups) & set(OPTIONAL_GROUPS) or study.engine not in _BATCH:
        return 1
    if tally.seconds <= 0.0:
        return _BATCH[study.engine]
    return max(1, int(min(MOST_IN_BATCH, BATCH_S / tally.seconds)))


def _batches(rest: Iterator[Case], size: Callable[[], int], first: Case) -> Iterator[list[Case]]:
    batch = [first, *islice(rest, size() - 1)]
    while batch:
        yield batch
        batch = list(islice(rest, size()))


def _answer(future: Future) -> list[Outcome]:
    """Give the outcomes of a batch; none if it ended its worker process, as compiled code can."""
    with answers_expected():
        if future.status == "finished":
            return list(future.result())
        error = future.exception()
    if isinstance(error, KilledWorker):
        return []
    if isinstance(error, LostError):
        raise error
    raise LostError(f"workers: {error or LOST}: expected answers")


def _died(case: Case) -> Outcome:
    nothing = dict.fromkeys(quantity_names(case.inputs.engine, case.inputs.groups), math.nan)
    return Outcome(case.key, "failed", "the worker process died", math.nan, nothing)


def run_study(study: Study, out: Path, *, workers: int | None = None, scheduler: str | Client | None = None,
              retry: bool = False, progress: bool = False, made: Made | None = None) -> StudySummary:  # fmt: skip
    """Run a study and write its folder: store, dataset, summary, and its sensitivities and Pareto front.

    On Ctrl-C, a full disk or lost workers, the dataset and the summary of what is there are written first.
    ``scheduler`` is the address of one of Dask, or a client of it. ``made`` says how the summary came about.

    Raises
    ------
    StudyError, MissingError
        One line: a full disk, a scheduler that does not answer, an engine that is not installed.
    """
    start, plan, tally = time.perf_counter(), plan_of(study), Tally()
    {"multibody": require_exudyn, "solid": require_gmsh}.get(study.engine, lambda: None)()
    with open_store(out) as store, WorkerPool(study.engine, workers, scheduler) as pool:
        session = Session(study, store, pool)

        def write() -> StudySummary:
            """Write dataset and summary; the state is "interrupted" until everything of the study is there."""
            overview = write_dataset(study, plan, store, out)
            return _write_summary(out, replace(_summary(study, tally, overview), made=made), start)

        try:
            _keep_inputs(study, out)
            _run_plan(session, plan, "cases", tally, retry=retry, progress=progress)
            summary = write()
        except (KeyboardInterrupt, DiskFullError, LostError) as stop:
            with suppress(DiskFullError, RecordError):  # the error to report is the one that stopped the study
                stop.add_note(stored_so_far(write(), out))
            raise
        try:
            if study.sensitivity is not None:
                _write_sensitivity(session, out, progress=progress)
                summary = replace(summary, sensitivity=SENSITIVITY)
            if study.pareto is not None:
                _write_front(session, study.pareto, out, progress=progress)
                summary = replace(summary, pareto=PARETO)
        except (KeyboardInterrupt, LostError) as stop:
            stop.add_note(stored_so_far(summary, out))
            raise
        return _write_summary(out, replace(summary, state="finished"), start)


def stored_so_far(summary: StudySummary, out: Path) -> str:
    """Say how much of a study is stored, and how to go on."""
    done = summary.cases - summary.status[PENDING]
    return f"{done} of {summary.cases} cases are stored in {out}, the same command goes on"


def _run_plan(session: Session, plan: Plan, words: str, tally: Tally, *, retry: bool, progress: bool) -> None:
    with bar(progress) as shown:
        task = shown.add_task(words, total=len(plan), left=True)
        todo = cases(session.study, plan.points())
        run_cases(session, todo, len(plan), tally, retry=retry, report=lambda n: shown.update(task, advance=n))


def _write_sensitivity(session: Session, out: Path, *, progress: bool) -> None:
    """Run the cases of the sensitivity analysis in the same session, and write its result."""
    from studies.sweep.sensitivity import saltelli_plan, sensitivity

    assert session.study.sensitivity is not None
    plan, tally = saltelli_plan(session.study.axes, session.study.sensitivity), Tally()
    _run_plan(session, plan, "sensitivity", tally, retry=False, progress=progress)
    result = sensitivity(session.study, plan, session.store)
    write_result(out / SENSITIVITY, replace(result, computed=tally.computed, from_store=tally.stored))


def _write_front(session: Session, settings: Pareto, out: Path, *, progress: bool) -> None:
    """Run the Pareto search in the same session, and write its result."""
    from studies.sweep.pareto import pareto

    with bar(progress) as shown:
        task = shown.add_task("Pareto search", total=settings.population * settings.generations)

        def outcomes(points: list[Mapping[str, float]]) -> list[Outcome | None]:
            wanted = list(cases(session.study, points))
            run_cases(session, wanted, len(wanted), Tally(), report=partial(shown.advance, task))
            return [session.store.find(case.key) for case in wanted]

        write_result(out / PARETO, pareto(session.study, outcomes))


def _keep_inputs(study: Study, out: Path) -> None:
    """Copy the files that were read into ``inputs``."""
    folder = out / "inputs"
    try:
        folder.mkdir(exist_ok=True)
        for path in study.inputs:
            if path.resolve() != (folder / path.name).resolve():
                shutil.copyfile(path, folder / path.name)
    except OSError as error:
        raise DiskFullError(f"{folder}: {error.strerror}: expected a folder that can be written to") from None


def _summary(study: Study, tally: Tally, overview: Overview) -> StudySummary:
    """Summarise what was computed, and what is in the dataset."""
    names = quantity_names(study.engine, study.groups)
    return StudySummary(
        title=study.title,
        engine=study.engine,
        cases=sum(overview.status.values()),
        status=overview.status,
        computed=tally.computed,
        from_store=tally.stored,
        axes={a.name: AxisRange(low=a.low, high=a.high, values=len(a.values) or None) for a in study.axes},
        sample=study.sample,
        seed=study.seed,
        versions=versions(study.engine),
        code_sha256=code_version(study.engine),
        inputs_sha256={path.name: digest for path, digest in study.inputs.items()},
        dataset=ZARR,
        failures=Failures(overview.status["failed"], overview.messages),
        quantities={name: overview.extremes[name] for name in names if name in overview.extremes},
        state="interrupted",
        seconds=0.0,
    )


def _write_summary(out: Path, summary: StudySummary, start: float) -> StudySummary:
    """Write ``study.json``, and remove results of an earlier run that it does not name: they are of another study."""
    for name, written in ((SENSITIVITY, summary.sensitivity), (PARETO, summary.pareto)):
        if written is None:
            (out / name).unlink(missing_ok=True)
    timed = replace(summary, seconds=time.perf_counter() - start)
    write_result(out / SUMMARY, timed)
    return timed
