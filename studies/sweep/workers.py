"""Where a study runs: Dask workers that are processes of this machine, or those of a running cluster."""

from __future__ import annotations

import gc
import logging
import math
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager, suppress
from tempfile import TemporaryDirectory

import dask
from dask.system import CPU_COUNT
from distributed import Client, LocalCluster
from distributed.client import ClosedClientError
from distributed.security import Security

from studies.sweep.code import SAME, code_of_worker, code_version
from studies.sweep.errors import LostError, StudyError
from studies.sweep.forks import begin_forking

KNOWN_S = 5.0
"""For how long the number of workers of a cluster is taken for known."""
CONNECT_S = 10
CLOSE_S = 20
START_S = 120
"""Longest times to connect to a scheduler, to close the workers of this machine, and to start one of them.

By default Dask waits for a worker without end, at the start of a study and where a new one replaces one that died.
"""
LOST = "no connection to their scheduler any more"
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), 1)

_SHORT_LOGS = {
    "distributed.admin.low-level-log-length": 1,
    "distributed.admin.system-monitor.log-length": 60,
    "distributed.diagnostics.computations.max-history": 1,
}
"""By default Dask keeps its last 1000 messages and 100 graphs, with the inputs of all their cases."""


class WorkerPool:
    """Workers of a study: processes of this machine, or those of a Dask cluster. They start when first needed."""

    def __init__(self, engine: str, workers: int | None = None, scheduler: str | Client | None = None) -> None:
        if scheduler is not None and workers is not None:
            raise StudyError(f"--workers {workers}: expected absent beside --scheduler, which has its own")
        if workers is not None and workers < 1:
            raise StudyError(f"--workers {workers}: expected at least 1")
        self._engine, self._scheduler = engine, scheduler
        self._count, self._counted = workers or CPU_COUNT, -math.inf
        self._open = ExitStack()
        self._client: Client | None = None

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def client(self) -> Client:
        """Give the connected client."""
        if self._client is None:
            _silence()
            self._open.enter_context(dask.config.set(_SHORT_LOGS))
            with interrupts_wait():
                self._client = self._checked(self._connected())
        return self._client

    @property
    def size(self) -> int:
        """Number of threads that run cases.

        Workers of a cluster come and go: it is counted again after :data:`KNOWN_S`.
        """
        if self._scheduler is not None and time.monotonic() > self._counted + KNOWN_S:
            with answers_expected():
                self._count = max(1, sum(self.client().nthreads().values()))
            self._counted = time.monotonic()
        return self._count

    def _connected(self) -> Client:
        match self._scheduler:
            case None:
                return self._local()
            case str(address):
                return self._remote(address)
            case client:  # of the caller, who closes it
                return client

    def _local(self) -> Client:
        # one thread runs a case: threads that a library starts besides would only compete
        settings = {
            "nanny.pre-spawn-environ": _ONE_THREAD,
            "worker.multiprocessing-method": "forkserver",
            "scheduler.allowed-failures": 0,  # run_cases finds the case that ended a worker
            "scheduler.no-workers-timeout": START_S,
            # each process serves pages of its state, which know no password
            "scheduler.http.routes": [],
            "worker.http.routes": [],
            "worker.profile.enabled": False,  # which looks at a worker a hundred times a second
        }
        self._open.enter_context(dask.config.set({f"distributed.{name}": value for name, value in settings.items()}))
        begin_forking()
        folder = self._open.enter_context(TemporaryDirectory(prefix="notchbend-", ignore_cleanup_errors=True))
        try:
            cluster = LocalCluster(
                n_workers=self._count, threads_per_worker=1, processes=True, memory_limit=0, death_timeout=START_S,
                silence_logs=logging.CRITICAL, dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": False},
                # any user of this machine reaches its ports: who is answered has the key, which only memory holds
                security=Security.temporary(), local_directory=folder,
            )  # fmt: skip
        except Exception as error:  # Dask raises a plain one, or fails an assertion where it ends a worker that starts
            raise StudyError(f"workers: {_words(error)}: expected {self._count} that start in {START_S:g} s") from error
        self._open.callback(_close, cluster)
        client = self._open.enter_context(Client(cluster))
        client.run(gc.freeze)  # modules stay: to look through them for garbage took a tenth of a case
        return client

    def _remote(self, address: str) -> Client:
        try:
            client = self._open.enter_context(Client(address, timeout=CONNECT_S))
            client.wait_for_workers(1, timeout=CONNECT_S)
        except (OSError, ValueError) as error:
            raise StudyError(
                f"--scheduler {address}: {_words(error)}: expected a Dask scheduler with workers"
            ) from None
        return client

    def _checked(self, client: Client) -> Client:
        """Refuse workers that run other code: their numbers would be stored under the key of this code."""
        where = f"--scheduler {self._scheduler}" if isinstance(self._scheduler, str) else "workers"
        try:
            found = client.run(code_of_worker, self._engine)
        except Exception as error:  # Dask wraps an import error of a worker in a plain exception
            raise StudyError(f"{where}: {_words(error)}: {SAME}") from None
        for worker, code in found.items():
            if code != code_version(self._engine):
                raise StudyError(f"{where}: {worker} runs other code: {SAME}")
        return client


@contextmanager
def answers_expected() -> Iterator[None]:
    """Turn what Dask raises where a scheduler or a worker is gone into :class:`LostError`."""
    try:
        yield
    except (OSError, CancelledError, ClosedClientError):
        raise LostError(f"workers: {LOST}: expected answers") from None


def _silence() -> None:
    """Keep messages of Dask off standard error: what ends a study is raised. Its loggers have levels of their own."""
    for name in logging.root.manager.loggerDict:
        if name.startswith("distributed"):
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _words(error: Exception) -> str:
    return " ".join(str(error).split()) or "no answer"


def _close(cluster: LocalCluster) -> None:
    """Close a cluster, or leave it to the end of this process, with which its workers end.

    After an interrupt amid its cases it has waited for its workers without end.
    """
    with suppress(TimeoutError):
        cluster.close(timeout=CLOSE_S)


@contextmanager
def interrupts_wait() -> Iterator[None]:
    """Delay Ctrl-C and SIGTERM until the block ends.

    Processes of Dask print long errors if they are interrupted while they start.
    """
    if threading.current_thread() is not threading.main_thread():  # only the main thread receives signals
        yield
        return
    received = list[int]()
    before = {
        number: signal.signal(number, lambda n, _: received.append(n)) for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)
        if received:
            signal.raise_signal(received[0])
