"""Where a study runs: processes, a cluster, workers that die, and what is held in memory meanwhile."""

import gc
import os
import re
import signal
import stat
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from dask._task_spec import Task
from distributed import Client, LocalCluster, Nanny
from distributed.protocol import Serialize, Serialized, ToPickle
from small_study import GRID, HEAD, PROGRAM, same, study_file

from studies.commands import call
from studies.sweep import StudyError, forks, open_study, read_study, run_study, workers
from studies.sweep import run as sweep
from studies.sweep.cases import Outcome, evaluate
from studies.sweep.plan import Case, cases, plan_of
from studies.sweep.quantities import quantity_names
from studies.sweep.store import open_store
from studies.sweep.workers import WorkerPool


def test_a_dask_cluster_gives_the_same_to_the_last_bit(finished, tmp_path):
    folder, _ = finished
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        run_study(read_study(folder / "s.toml"), tmp_path / "out", scheduler=cluster.scheduler_address)
        with Client(cluster) as client:
            assert client.run(os.getpid)  # the cluster of another is left running
    same(open_study(tmp_path / "out"), open_study(folder / "out"))


def test_workers_that_run_other_code_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "code_version", lambda _: "another")
    with pytest.raises(StudyError, match="other code"):
        run_study(read_study(study_file(tmp_path)), tmp_path / "out", workers=1)


def test_a_worker_of_other_code_that_joins_later_ends_a_study(tmp_path, monkeypatch):
    """Each batch asks for the code of this process: one line, and what others have computed is kept."""
    asked = read_study(study_file(tmp_path))
    run_study(asked, tmp_path / "out", workers=1)
    wider = GRID.replace("[10, 15, 20, 30]", "[10, 15, 20, 25, 30]")
    monkeypatch.setattr(sweep, "code_version", lambda _: "another")
    with pytest.raises(StudyError, match=r"workers: one on \S+ runs other code: expected the same versions") as error:
        run_study(read_study(study_file(tmp_path, wider)), tmp_path / "out", workers=1)
    assert error.value.__notes__[0].startswith("12 of 15 cases are stored")


def test_a_cluster_that_grows_gets_more_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "KNOWN_S", 0.0)
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster,
        WorkerPool("chain", scheduler=cluster.scheduler_address) as pool,
    ):
        assert pool.size == 1
        cluster.scale(2)
        pool.client().wait_for_workers(2)
        assert pool.size == 2


JOBQUEUE = {
    "queue", "account", "walltime", "cores", "processes", "memory", "interface", "job_script_prologue", "security",
}  # fmt: skip
"""Parameters of ``SLURMCluster`` of dask-jobqueue 0.9.0, of those that the page uses."""


def test_the_file_for_slurm_runs_a_study(tmp_path, monkeypatch, capsys):
    """The file of the page, with processes of this machine in place of jobs."""
    page = (Path(__file__).parents[3] / "docs" / "guide" / "studies.md").read_text()
    (code,) = re.findall(r"^`on_slurm.py`\n```py\n(.*?)```", page, re.S | re.M)

    class Jobs(LocalCluster):
        def __init__(self, **given):
            assert set(given) <= JOBQUEUE
            super().__init__(n_workers=0, threads_per_worker=1, security=True, dashboard_address=None, silence_logs=50)

        def scale(self, n=0, jobs=0):
            super().scale(n or jobs // 4)

    monkeypatch.setitem(sys.modules, "dask_jobqueue", SimpleNamespace(SLURMCluster=Jobs))
    monkeypatch.setattr(sys, "argv", ["on_slurm.py", str(study_file(tmp_path)), str(tmp_path / "out")])
    exec(compile(code, "on_slurm.py", "exec"), {"__name__": "__main__"})
    assert "'ok': 8" in capsys.readouterr().out
    assert int((open_study(tmp_path / "out").status == "ok").sum()) == 8


def test_workers_that_do_not_start_are_not_waited_for(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(workers, "START_S", 0.01)
    assert call(["study", str(study_file(tmp_path)), "--out", str(tmp_path / "o"), "--workers", "1", "--quiet"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("notchbend: workers: ")
    assert error.endswith(": expected 1 that start in 0.01 s\n")
    assert error.count("\n") == 1


@pytest.mark.slow
def test_a_worker_that_is_not_replaced_ends_a_study(tmp_path, monkeypatch):
    """Where a worker died and no other takes its place, Dask kept its cases waiting without end."""

    async def never(self, *given, **named):
        return None

    monkeypatch.setattr(Nanny, "_on_worker_exit", never)
    monkeypatch.setattr(workers, "START_S", 20)
    monkeypatch.setattr(sweep, "evaluate_all", dies_at_15)
    asked = read_study(study_file(tmp_path, HEAD + PROGRAM + "[vary]\npreload_N = [15, 20]\n"))
    with pytest.raises(StudyError, match=r"workers: .*: expected answers") as error:
        run_study(asked, tmp_path / "out", workers=1)
    assert re.search(r"\d of 2 cases are stored in .*, the same command goes on", error.value.__notes__[0])


CLUSTER = """
import time
from distributed import LocalCluster
with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None) as one:
    print(one.scheduler_address, flush=True)
    time.sleep(600)
"""


def test_a_scheduler_that_dies_is_one_line(tmp_path, capfd, monkeypatch):
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    answer, ends = sweep._answer, {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, "-c", CLUSTER], env=environment, text=True, **ends) as other:

        def last_answer(future):
            other.kill()
            return answer(future)

        monkeypatch.setattr(sweep, "_answer", last_answer)
        monkeypatch.setattr(sweep, "_BATCH", {})  # one case each, so that more are out
        given = ["study", str(study_file(tmp_path)), "--out", str(tmp_path / "o"), "--quiet", "--scheduler"]
        assert call([*given, other.stdout.readline().strip()]) == 2
    said = capfd.readouterr().err
    line = "notchbend: workers: no connection .*: expected answers; \\d+ of 12 cases are stored in .*, the same .*\n"
    assert re.fullmatch(line, said), said


def test_no_scheduler_there(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(workers, "CONNECT_S", 0.2)
    arguments = ["study", str(study_file(tmp_path)), "--out", str(tmp_path / "o"), "--scheduler", "tcp://127.0.0.1:9"]
    assert call(arguments) == 2
    error = capsys.readouterr().err
    assert "tcp://127.0.0.1:9" in error
    assert error.count("\n") == 1


def test_a_case_that_takes_its_worker_down_is_alone_in_failing(tmp_path, monkeypatch):
    """A worker that dies under one case: that case fails, and none of those that were out with it."""
    asked = read_study(study_file(tmp_path, HEAD + PROGRAM + "[vary]\npreload_N = [10, 15, 20]\n"))
    monkeypatch.setattr(sweep, "evaluate_all", dies_at_15)
    run_study(asked, tmp_path / "out", workers=1)
    data = open_study(tmp_path / "out")
    assert data.status.values.tolist() == ["ok", "failed", "ok"]
    assert "worker process died" in data.message.sel(preload_N=15.0).item()
    monkeypatch.undo()
    summary = run_study(asked, tmp_path / "out", workers=1, retry=True)
    assert (summary.computed, summary.failures.count) == (1, 0)


def dies_at_15(batch):
    if any(inputs.rig["preload_N"] == 15.0 for _, inputs in batch):
        os._exit(1)
    return [evaluate(key, inputs) for key, inputs in batch]


def at_once(batch):
    """Cases without mechanics."""
    return [
        Outcome(key, "ok", "", 0.0, dict.fromkeys(quantity_names(inputs.engine, inputs.groups), 1.0))
        for key, inputs in batch
    ]


def living(*kinds: type) -> int:
    gc.collect()
    return sum(type(thing) in kinds for thing in gc.get_objects())


@pytest.mark.slow
def test_what_is_held_does_not_grow_with_the_cases(tmp_path, monkeypatch):
    """Cases, and the tasks that Dask makes of them: at the end of 20 batches no more than are out at a time."""
    text = GRID.replace("[10, 15, 20, 30]", "{ from = 10, to = 40, count = 105 }")
    asked = read_study(study_file(tmp_path, text))
    held, through = [], 0

    def look(count: int) -> None:
        nonlocal through
        through += count
        if through >= 280:
            held.append((living(Case), living(Task, Serialize, Serialized, ToPickle)))

    monkeypatch.setattr(sweep, "evaluate_all", at_once)
    with open_store(tmp_path / "out") as store, WorkerPool("chain", 1) as pool:
        session = sweep.Session(asked, store, pool)
        sweep.run_cases(session, cases(asked, plan_of(asked).points()), 315, sweep.Tally(), report=look)
    assert through == 315
    batches = sweep.IN_FLIGHT + 1  # and the one that has just come back
    assert max(cases for cases, _ in held) <= batches * 16 + 1  # and the first of all
    assert max(tasks for _, tasks in held) <= 10 * batches


def test_an_interrupt_while_the_fork_server_starts_is_not_lost(monkeypatch):
    """The server, and the workers that it forks, do not hear it; this process does when they have started."""
    in_child = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"
    said = []

    def started():
        os.kill(os.getpid(), signal.SIGINT)
        said.append(subprocess.run([sys.executable, "-c", in_child], capture_output=True, text=True, check=True).stdout)

    monkeypatch.setattr(forks.forkserver, "ensure_running", started)
    monkeypatch.setattr(workers, "LocalCluster", lambda **_: SimpleNamespace(close=lambda timeout: None))
    monkeypatch.setattr(workers, "Client", lambda cluster: nullcontext())
    monkeypatch.setattr(WorkerPool, "_checked", lambda pool, client: client)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with WorkerPool("chain", 1) as pool, pytest.raises(KeyboardInterrupt):
            pool.client()
    finally:
        signal.signal(signal.SIGINT, before)
    assert said == ["True\n"]
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


HANGS = """
import asyncio
from distributed import LocalCluster
from studies.sweep import workers

async def never(self):
    await asyncio.sleep(1000)

if __name__ == "__main__":
    workers.CLOSE_S = 1
    LocalCluster._close = never
    with workers.WorkerPool("chain", 1) as pool:
        print(len(pool.client().nthreads()))
    print("left")
"""


@pytest.mark.slow
def test_a_cluster_that_does_not_close_does_not_keep_a_study(tmp_path):
    """One that was interrupted amid its cases waited for its workers for a quarter of an hour, until it was killed."""
    script = tmp_path / "hangs.py"
    script.write_text(HANGS)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    done = subprocess.run([sys.executable, script], env=environment, capture_output=True, text=True, timeout=120)
    assert done.stdout.split() == ["1", "left"]


STRANGER = """
import asyncio, os, sys
from distributed.core import connect
from distributed.protocol.pickle import dumps
from distributed.security import Security

RUNS = {"function": dumps(os.getpid), "args": dumps(()), "kwargs": dumps({}), "wait": True}

async def ask(address, arguments):
    try:
        comm = await connect(address, timeout=5, **arguments)
        await comm.write({"op": "run" if address == sys.argv[-1] else "identity", "reply": True} | RUNS)
        return f"answered: {await asyncio.wait_for(comm.read(), 5)}"
    except Exception as error:
        return f"refused: {type(error).__name__}"

async def main():
    own = Security.temporary().get_connection_args("client")
    for address in sys.argv[1:]:
        place = address.partition("://")[2]
        print(await ask(f"tcp://{place}", {}), await ask(f"tls://{place}", own), sep="\\n")

asyncio.run(main())
"""


def test_workers_of_this_machine_answer_nobody_else(tmp_path):
    """Any user of the machine reaches the ports of 127.0.0.1, and who is answered there runs code as this user."""
    with WorkerPool("chain", 1) as pool:
        client = pool.client()
        known = client.scheduler_info()
        (worker,) = known["workers"].values()
        addresses = [known["address"], worker["nanny"], *known["workers"]]
        script = tmp_path / "stranger.py"
        script.write_text(STRANGER)
        done = subprocess.run([sys.executable, script, *addresses], capture_output=True, text=True, check=True)
        assert re.fullmatch(r"(refused: \w+\n){6}", done.stdout)
        for place in (f"127.0.0.1:{known['services']['dashboard']}", f"127.0.0.1:{worker['services']['dashboard']}"):
            for page in ("info/main/workers.html", "json/identity.json", "metrics", "health", "status"):
                with pytest.raises(HTTPError, match="404"):
                    urlopen(f"http://{place}/{page}", timeout=10)
        folder = Path(worker["local_directory"]).parent
        assert stat.S_IMODE(folder.parent.stat().st_mode) == 0o700
    assert not folder.parent.exists()
