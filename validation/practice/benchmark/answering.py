"""Answer all cases of a benchmark, in worker processes; cases that have an answer are not answered again."""

from __future__ import annotations

import json
import multiprocessing
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import TYPE_CHECKING

from hysteresis.files import write_files
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record
from validation.practice.benchmark.answers import CaseAnswer, answer_file, read_answer
from validation.practice.benchmark.sealed import read_list, records_of

if TYPE_CHECKING:
    from validation.tracing.result import TraceReport

Answerer = Callable[[Sequence[Record]], "CaseAnswer | TraceReport"]
"""From the records of a case to its answer."""
Count = Callable[[int, int], None]
"""Called with how many cases are done, and of how many."""


def by_tracer(records: Sequence[Record]) -> TraceReport:
    """Answer with the tracer of the package: a whole trace.json."""
    from validation.tracing import trace_records  # late: other ways do not need it
    from validation.tracing.result import trace_report

    return trace_report(trace_records(records, threads=1))


def answer_case(folder: Path, case: str, into: Path, answerer: Answerer) -> None:
    """Answer one case; an error of the answerer is the verdict ``error`` and does not end the others."""
    records = [read_record(path) for path in records_of(folder, case)]
    try:
        answer = answerer(records).to_dict()
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        answer = {"schema": 1, "verdict": "error", "message": f"{type(error).__name__} at {where.name}: {error}"}
    write_files({into / f"{case}.json": json.dumps(answer, indent=1, allow_nan=False) + "\n"})


def answer_all(
    folder: Path, into: Path, answerer: Answerer, workers: int, *, progress: Count = lambda done, of: None
) -> int:
    """Answer the cases without an answer, or with an error, and return their number.

    ``progress`` is called with the number of cases that have an answer, and of all.

    Raises
    ------
    RecordError
        A folder without cases, or an answer that is there and malformed.
    """
    cases = read_list(folder).cases
    todo = [case for case in cases if answer_file(into, case) is None or read_answer(into, case).verdict == "error"]
    done = len(cases) - len(todo)
    progress(done, len(cases))
    if workers == 1:
        for number, case in enumerate(todo, done + 1):
            answer_case(folder, case, into, answerer)
            progress(number, len(cases))
        return len(todo)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        futures = [pool.submit(answer_case, folder, case, into, answerer) for case in todo]
        try:
            for number, future in enumerate(as_completed(futures), done + 1):
                future.result()
                progress(number, len(cases))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return len(todo)
