"""Studies: the same numbers however they are run, kept when the run dies, and a file that is refused in one line."""

import dataclasses
import gc
import json
import math
import os
import signal
import sqlite3
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from dask._task_spec import Task
from distributed import Client, LocalCluster
from distributed.protocol import Serialize, Serialized, ToPickle
from hypothesis import given
from hypothesis import strategies as st

from fem_models.chain.solve import solve_chain
from fem_models.load.program import triangle
from fem_models.rig.checks import RigError
from fem_models.rig.presets import preset
from fem_models.rig.rig import with_notch
from hysteresis.metrics import loop_width
from studies.commands.cli import call
from studies.sweep import dataset, workers
from studies.sweep import run as sweep
from studies.sweep.cases import Outcome, StudyError, evaluate, program_of_table, quantity_names
from studies.sweep.dataset import open_study
from studies.sweep.inputs import FIELDS, key_of, with_values
from studies.sweep.plan import Case, Grid, cases, plan_of, unit_points
from studies.sweep.run import run_study
from studies.sweep.store import open_store
from studies.sweep.study_file import Sample, read_study, ready_studies
from studies.sweep.workers import Team

ROOT = Path(__file__).parents[3]
HEAD = 'schema = 1\ntitle = "t"\nengine = "chain"\n[rig]\npreset = "du2018"\n'
PROGRAM = "[program]\namplitude_mm = 2.2\ncycles = 2\n"
GRID = HEAD + PROGRAM + '[vary]\npreload_N = [10, 15, 20, 30]\n"notch.depth_mm" = [2.8, 2.825, 3.2]\n'
"""Twelve cases; the last depth is beyond the tube's radius of 3.1 mm, so that four of them fail."""


def study_file(folder: Path, text: str = GRID, name: str = "s.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def same(a: xr.Dataset, b: xr.Dataset) -> None:
    """Bit for bit, but for the time that the cases took."""
    xr.testing.assert_identical(a.drop_vars("wall_s").load(), b.drop_vars("wall_s").load())
    for name in a.data_vars:
        if a[name].dtype == np.float64 and name != "wall_s":
            assert a[name].values.tobytes() == b[name].values.tobytes()


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The grid, run by two workers."""
    folder = tmp_path_factory.mktemp("study")
    summary = run_study(read_study(study_file(folder)), folder / "out", workers=2)
    return folder, summary


# --- the dataset -------------------------------------------------------------------------------------------------


def test_quantities_are_those_of_the_engine(finished):
    """A case of the dataset, beside the chain called by hand and measured by the loop metrics."""
    data = open_study(finished[0] / "out").sel({"preload_N": 15.0, "notch.depth_mm": 2.8})
    rig = preset("du2018", preload_N=15.0)
    rig = with_notch(rig, dataclasses.replace(rig.joint.notch, depth_mm=2.8))
    solution = solve_chain(rig, triangle(2.2, cycles=2))
    record = solution.record
    width = loop_width(record.drive, record.angle_deg, record.cycle)
    assert data.full_scale_angle_deg == np.abs(record.angle_deg).max()
    assert data.loop_width_max_deg == width.max_deg
    assert data.loop_width_at_zero_deg == width.at_zero_deg
    assert data.tension_max_N == solution.segment_tensions_N.max()
    assert data.peak_strain_percent == 100 * np.abs(solution.peak_strain).max()
    assert data.superelastic_margin == pytest.approx(6 / data.peak_strain_percent)  # ASTM F2516: 6 %
    # a closed loop gives back what it stores: the wheel's work is what friction and material have lost
    last = record.cycle == 2
    lost = sum(np.ptp(loss[last]) for loss in (solution.friction_loss_mJ, solution.material_loss_mJ))
    assert data.dissipated_mJ == pytest.approx(lost, rel=0.03)  # the work is summed in steps of 0.1 mm


def test_more_preload_less_hysteresis(finished):
    """The paper's trend (Mech. Sci. 9, 2018): 3.52 deg at 10 N, 2.21 deg at 20 N."""
    width = open_study(finished[0] / "out").loop_width_max_deg.sel({"notch.depth_mm": 2.825})
    assert (np.diff(width) < 0).all()
    assert width.sel(preload_N=10.0) == pytest.approx(3.52, rel=0.05)
    assert width.sel(preload_N=20.0) == pytest.approx(2.21, rel=0.05)


def test_failed_cases_are_kept_and_the_rest_goes_on(finished):
    folder, summary = finished
    data = open_study(folder / "out")
    bad = data.sel({"notch.depth_mm": 3.2})
    assert (bad.status == "failed").all()
    assert all("notch.depth_mm = 3.2" in m and "below 3.1" in m for m in bad.message.values)
    assert np.isnan(bad.loop_width_max_deg).all()
    assert (bad.wall_s > 0).all()
    assert (data.sel({"notch.depth_mm": [2.8, 2.825]}).status == "ok").all()
    assert summary["failures"]["count"] == 4


def test_dataset_says_what_it_is(finished):
    folder, _ = finished
    data = open_study(folder / "out")
    assert dict(data.sizes) == {"preload_N": 4, "notch.depth_mm": 3}
    assert data.preload_N.attrs["units"] == "N"
    assert data["notch.depth_mm"].attrs["units"] == "mm"
    assert all({"units", "long_name"} <= set(data[n].attrs) for n in data.data_vars if n not in ("status", "message"))
    assert data.attrs["study"] == GRID
    assert data.attrs["schema"] == 1
    assert json.loads(data.attrs["versions"])["numpy"] == np.__version__
    assert (folder / "out" / "inputs" / "s.toml").read_text() == GRID
    assert set(json.loads(data.attrs["inputs_sha256"])) == {"s.toml"}
    assert json.loads((folder / "out" / "study.json").read_text())["cases"] == 12


def test_numbers_read_back_to_the_last_bit(finished):
    """The case run here against what went through worker, store and Zarr."""
    folder, _ = finished
    asked = read_study(folder / "s.toml")
    data = open_study(folder / "out")
    for case in list(cases(asked, plan_of(asked).points()))[:2]:
        mine = evaluate(case.key, case.inputs)
        for name, value in mine.quantities.items():
            assert data[name].sel(case.values).item() == value


# --- going on ----------------------------------------------------------------------------------------------------


def test_a_widened_study_computes_the_new_points_only(finished, tmp_path):
    text = GRID.replace("[10, 15, 20, 30]", "[10, 15, 20, 25, 30]")
    first = run_study(read_study(finished[0] / "s.toml"), tmp_path / "out", workers=1)
    wider = run_study(read_study(study_file(tmp_path, text)), tmp_path / "out", workers=1)
    again = run_study(read_study(tmp_path / "s.toml"), tmp_path / "out", workers=1)
    assert (first["computed"], first["from_store"]) == (12, 0)
    assert (wider["computed"], wider["from_store"]) == (3, 12)
    assert (again["computed"], again["from_store"]) == (0, 15)
    # and one worker has given what two had
    same(open_study(tmp_path / "out").sel(preload_N=[10.0, 15.0, 20.0, 30.0]).assign_attrs(
        open_study(finished[0] / "out").attrs), open_study(finished[0] / "out"))  # fmt: skip


def test_more_sobol_points_begin_with_the_same():
    few, many = (unit_points(Sample("sobol", n, 7), 3) for n in (16, 64))
    assert np.array_equal(few, many[:16])
    assert np.array_equal(
        unit_points(Sample("latin-hypercube", 9, 7), 3), unit_points(Sample("latin-hypercube", 9, 7), 3)
    )


def test_latin_hypercube_has_one_point_a_row():
    """Its definition: cut each range into n, and each piece holds one point."""
    points = unit_points(Sample("latin-hypercube", 20, 1), 2)
    assert all(sorted(np.floor(20 * column)) == list(range(20)) for column in points.T)


KILLED = GRID.replace("[10, 15, 20, 30]", "{ from = 10, to = 40, count = 80 }")
RUN = "import sys; from studies.commands.cli import main; sys.argv[0] = 'notchbend'; main()"
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


def stored(out: Path) -> int:
    try:
        with sqlite3.connect(f"file:{out / 'cases.sqlite'}?mode=ro&immutable=1", uri=True) as db:
            return db.execute("SELECT COUNT(*) FROM cases WHERE status != 'running'").fetchone()[0]
    except sqlite3.Error:  # not there yet, or just being written
        return 0


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The 240 cases of KILLED, run in one go."""
    folder = tmp_path_factory.mktemp("undisturbed")
    run_study(read_study(study_file(folder, KILLED)), folder / "out", workers=2)
    return open_study(folder / "out")


def begun(file: Path, out: Path) -> subprocess.Popen:
    command = [sys.executable, "-c", RUN, "study", str(file), "--out", str(out), "--workers", "2", "--quiet"]
    # a shell that runs the tests in its background has Ctrl-C ignored, and children inherit that
    heard = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        return subprocess.Popen(command, env=ENVIRONMENT, stderr=subprocess.PIPE, start_new_session=True)
    finally:
        signal.signal(signal.SIGINT, heard)


def test_killed_three_times_then_finished(tmp_path, undisturbed):
    """240 cases; the process gets SIGKILL as soon as some of them are stored, three times over."""
    file, out = study_file(tmp_path, KILLED), tmp_path / "out"
    at_kill = []
    for _ in range(3):
        before, process = stored(out), begun(file, out)
        while process.poll() is None and stored(out) < before + 32:  # more than a batch, so that one is there for good
            time.sleep(0.002)
        process.kill()
        process.communicate()
        with open_store(out) as store:  # takes back what was half written
            at_kill.append(store.counts()["by_status"].get("ok", 0) + store.counts()["by_status"].get("failed", 0))
    assert 0 < at_kill[0] < at_kill[1] < at_kill[2] < 240  # each run was killed in its middle
    finished = run_study(read_study(file), out, workers=2)
    assert (finished["state"], finished["from_store"]) == ("finished", at_kill[2])
    same(open_study(out), undisturbed)
    with open_store(out) as store:
        in_flight = sweep.IN_FLIGHT * 2 * 16  # batches a worker, workers, cases a batch of the chain
        assert store.counts()["attempts"] - 240 <= 3 * in_flight
        assert store.counts()["by_status"] == {"ok": 160, "failed": 80}


@pytest.mark.parametrize("when", ["while the workers start", "in the middle"])
def test_interrupted_study_says_how_far_it_came(when, tmp_path, undisturbed):
    """Ctrl-C goes to all processes of the command: one line, exit 130, dataset and summary of what was there."""
    file, out = study_file(tmp_path, KILLED), tmp_path / "out"
    process = begun(file, out)
    while process.poll() is None and not (stored(out) if when == "in the middle" else (out / "inputs").exists()):
        time.sleep(0.002)
    os.killpg(process.pid, signal.SIGINT)
    assert process.communicate()[1] == b"notchbend: interrupted\n"
    assert process.returncode == 130
    status = open_study(out).status.values.ravel().tolist()
    summary = json.loads((out / "study.json").read_text())
    assert summary["state"] == "interrupted"
    assert summary["status"] == {name: status.count(name) for name in ("ok", "failed", "pending")}
    done = 240 - status.count("pending")
    assert (done == 0) if when != "in the middle" else (0 < done < 240)
    assert summary["computed"] == done
    if done:
        again = run_study(read_study(file), out, workers=2)
        assert (again["state"], again["from_store"]) == ("finished", done)
        same(open_study(out), undisturbed)


def test_results_of_another_study_do_not_stay(tmp_path, monkeypatch):
    """A study that is stopped before its sensitivities leaves none of an earlier run, whose ranges may be others."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "sensitivity.json").write_text("{}")
    text = HEAD + PROGRAM + "[vary]\npreload_N = [10, 20]\n[sensitivity]\ncount = 4\n"

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("studies.sweep.sensitivity.sensitivity", stopped)
    with pytest.raises(KeyboardInterrupt):
        run_study(read_study(study_file(tmp_path, text)), out, workers=1)
    summary = json.loads((out / "study.json").read_text())
    assert (summary["state"], summary["status"]["ok"]) == ("interrupted", 2)
    assert not (out / "sensitivity.json").exists()


def test_two_studies_in_one_folder_are_refused(tmp_path):
    with open_store(tmp_path), pytest.raises(StudyError, match="in use"), open_store(tmp_path):
        pass


def test_full_disk(tmp_path, capfd, undisturbed):
    """A disk of 96 KB takes the store for a while, then one line and exit 2; what was stored is read, and goes on."""
    disk, file = tmp_path / "disk", study_file(tmp_path, KILLED)
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=96k", "tmpfs", disk], check=False, capture_output=True
    )
    if mounted.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {mounted.stderr.decode().strip()}")
    try:
        assert call(["study", str(file), "--out", str(disk / "out"), "--workers", "1", "--quiet"]) == 2
        error = capfd.readouterr().err
        assert error.count("\n") == 1
        assert "full" in error
        with open_store(disk / "out") as store:
            done = store.counts()["by_status"]
            asked = read_study(file)
            found = [store.find(c.key) for c in cases(asked, plan_of(asked).points())]
        assert sum(f is not None for f in found) == done.get("ok", 0) + done.get("failed", 0) > 0
        subprocess.run(["mount", "-o", "remount,size=8m", disk], check=True)
        run_study(asked, disk / "out", workers=2)
        same(open_study(disk / "out"), undisturbed)
    finally:
        subprocess.run(["umount", disk], check=True)


# --- memory ------------------------------------------------------------------------------------------------------


def at_once(batch):
    """Cases without mechanics."""
    return [
        Outcome(key, "ok", "", 0.0, dict.fromkeys(quantity_names(inputs["engine"], inputs["groups"]), 1.0))
        for key, inputs in batch
    ]


def living(*kinds: type) -> int:
    gc.collect()
    return sum(type(thing) in kinds for thing in gc.get_objects())


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
    with open_store(tmp_path / "out") as store, Team("chain", 1) as team:
        sweep.run_cases(cases(asked, plan_of(asked).points()), 315, asked, store, team, sweep.Tally(), done=look)
    assert through == 315
    batches = sweep.IN_FLIGHT + 1  # and the one that has just come back
    assert max(cases for cases, _ in held) <= batches * 16 + 1  # and the first of all
    assert max(tasks for _, tasks in held) <= 10 * batches


def test_the_dataset_is_written_block_by_block(finished, tmp_path, monkeypatch):
    """Of any block size the same, and memory goes with the block, not with the cases."""
    folder, _ = finished
    asked = read_study(folder / "s.toml")
    monkeypatch.setattr(dataset, "BLOCK", 5)
    (tmp_path / "out").mkdir()
    with open_store(folder / "out") as store:
        overview = dataset.write_dataset(asked, plan_of(asked), store, tmp_path / "out")
    same(open_study(tmp_path / "out"), open_study(folder / "out"))
    assert overview.status == {"ok": 8, "failed": 4, "pending": 0}
    angle = open_study(tmp_path / "out").full_scale_angle_deg
    assert overview.ends["full_scale_angle_deg"]["max"]["value"] == angle.max()
    assert angle.sel(overview.ends["full_scale_angle_deg"]["min"]["at"]) == angle.min()

    monkeypatch.setattr(dataset, "BLOCK", 100)
    peaks = []
    for count in (300, 1500):
        text = HEAD + PROGRAM + f"[vary]\npreload_N = {{ from = 5, to = 40, count = {count} }}\n"
        wide = read_study(study_file(tmp_path, text))
        with open_store(tmp_path / "empty") as store:
            tracemalloc.start()
            dataset.write_dataset(wide, plan_of(wide), store, tmp_path / "empty")
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
    assert peaks[1] < peaks[0] + 1200 * 40  # the values of the axis; whole it would be 13 numbers and 2 texts a case


@given(st.lists(st.integers(1, 9), min_size=1, max_size=4), st.integers(1, 40))
def test_blocks_make_up_the_grid_in_the_order_of_its_cases(shape, most):
    numbers = np.arange(math.prod(shape)).reshape(shape)
    found = [numbers[block].ravel() for block in dataset.blocks(tuple(shape), most)]
    assert np.array_equal(np.concatenate(found), numbers.ravel())
    assert max(map(len, found)) <= most


# --- where it runs -----------------------------------------------------------------------------------------------


def test_a_dask_cluster_gives_the_same_to_the_last_bit(finished, tmp_path):
    folder, _ = finished
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        run_study(read_study(folder / "s.toml"), tmp_path / "out", scheduler=cluster.scheduler_address)
        assert Client(cluster).run(os.getpid)  # the cluster of another is left running
    same(open_study(tmp_path / "out"), open_study(folder / "out"))


def test_workers_that_run_other_code_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "code_version", lambda _: "another")
    with pytest.raises(StudyError, match="other code"):
        run_study(read_study(study_file(tmp_path)), tmp_path / "out", workers=1)


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
    assert (summary["computed"], summary["failures"]["count"]) == (1, 0)


def dies_at_15(batch):
    if any(inputs["rig"]["preload_N"] == 15.0 for _, inputs in batch):
        os._exit(1)
    return [evaluate(key, inputs) for key, inputs in batch]


# --- cases -------------------------------------------------------------------------------------------------------


def test_key_is_of_values_not_of_their_writing():
    base = {"engine": "chain", "rig": preset("du2018").to_dict(), "program": {"amplitude_mm": 2}}
    same_numbers = with_values(base, {"preload_N": 20, "program.amplitude_mm": 2.0}) | {"engine": "chain"}
    assert key_of(same_numbers) == key_of(base)
    other = with_values(base, {"preload_N": math.nextafter(20.0, 21.0)}) | {"engine": "chain"}
    assert key_of(other) != key_of(base)


def test_derived_numbers():
    """Wall: (outer - inner)/2. Angle of a V: each flank leans half of it; a sharp V of 90 deg: width 2 depth."""
    base = {"rig": preset("du2018").to_dict(), "program": {}}
    rig = with_values(base, {"tube.wall_mm": 0.3, "tube.outer_diameter_mm": 6.0})["rig"]
    assert rig["tube"]["inner_diameter_mm"] == pytest.approx(5.4)
    rig = with_values(base, {"notch.angle_deg": 90.0, "notch.depth_mm": 1.0, "notch.root_width_mm": 0.0})["rig"]
    assert rig["notch"]["width_mm"] == pytest.approx(2.0)
    with pytest.raises(RigError, match="v_pair"):
        with_values({"rig": preset("notched-wrist-90").to_dict(), "program": {}}, {"notch.angle_deg": 20.0})


def test_tendon_stands_for_both():
    rig = with_values({"rig": preset("du2018").to_dict(), "program": {}}, {"tendon.EA_N": 1e4})["rig"]
    assert rig["tendon_a"]["EA_N"] == rig["tendon_b"]["EA_N"] == 1e4
    assert FIELDS["notch.count"]


@pytest.mark.parametrize("rate", [None, 2.0])
def test_program_of_one_tendon_pulls_only(rate):
    table = {"amplitude_mm": 1.0, "cycles": 2, **({"step_mm": 0.1} if rate is None else {"rate_Hz": rate})}
    program = program_of_table(table, one_way=True)
    drive = program.drive_mm
    assert drive.min() == pytest.approx(0, abs=1e-12)
    assert drive.max() == 1.0
    assert [drive[program.cycle == k][-1] for k in (0, 1, 2)] == pytest.approx([1.0, 1.0, 1.0])
    if rate is not None:  # the way out is half a period
        assert program.time_s[-1] == pytest.approx(2.5 / rate)


def outcome(engine: str, values: dict[str, float], groups: tuple[str, ...], name: str = "du2018", **program):
    table = {"amplitude_mm": 2.2, "cycles": 1, "step_mm": 0.2, **program}
    base = with_values({"rig": preset(name).to_dict(), "program": table}, values)
    return evaluate("k", {**base, "engine": engine, "groups": list(groups), "seed": 0})


def test_analytic_engine_has_no_loop():
    found = outcome("analytic", {}, ("loop", "strain"))
    assert found.status == "ok"
    assert math.isnan(found.quantities["loop_width_max_deg"])
    assert math.isnan(found.quantities["dissipated_mJ"])
    chain = outcome("chain", {}, ("loop",))
    # friction alone is between them
    assert found.quantities["full_scale_angle_deg"] == pytest.approx(chain.quantities["full_scale_angle_deg"], rel=0.05)


def test_slack_is_reached_at_little_preload():
    assert outcome("chain", {"preload_N": 2.0}, ("loop",)).quantities["slack_reached"] == 1
    assert outcome("chain", {"preload_N": 20.0}, ("loop",)).quantities["slack_reached"] == 0


def test_one_tendon():
    found = outcome("chain", {}, ("loop", "strain"), "notched-wrist-90", amplitude_mm=0.5, step_mm=0.05)
    assert found.status == "ok"
    assert found.quantities["tension_max_N"] > 0


def test_optional_groups():
    """Shares add up to 1; the law saturates at (A/(beta + gamma))^(1/n), Mech. Sci. 9, 2018, section 3."""
    q = outcome("chain", {"preload_N": 10.0}, ("loop", "contributions", "bouc-wen"), step_mm=0.1).quantities
    assert sum(
        q[f"{part}_share"] for part in ("friction", "tendon_elasticity", "material", "interaction")
    ) == pytest.approx(1)
    level = abs(q["bouc_wen_A"]) / (q["bouc_wen_beta"] + q["bouc_wen_gamma"])
    assert q["saturation_deg"] == pytest.approx(level ** (1 / q["bouc_wen_n"]), rel=1e-6)


@pytest.mark.slow
def test_solid_engine():
    """The solid against the joint of the analytic model, some per cent from it (docs/validation/notches.md)."""
    pytest.importorskip("gmsh")
    found = outcome("solid", {}, ("joint", "strain"))
    assert found.status == "ok", found.message
    from fem_models.joint.flexure import flexure

    assert found.quantities["bending_Nmm_per_rad"] == pytest.approx(
        flexure(preset("du2018")).bending_Nmm_per_rad, rel=0.15
    )
    assert found.quantities["peak_strain_percent"] > outcome("chain", {}, ("strain",)).quantities["peak_strain_percent"]


# --- the file ----------------------------------------------------------------------------------------------------

VALUES = "[10, 15, 20, 30]"
BAD_FILES = {
    "schema": (GRID.replace("schema = 1", "schema = 2"), ["schema = 2", "expected 1"]),
    "unknown table": (GRID + "[varry]\nx = 1\n", ["varry", "expected one of"]),
    "unknown engine": (GRID.replace('"chain"', '"chian"'), ["engine = 'chian'", "chain"]),
    "unknown field": (GRID.replace("notch.depth_mm", "notch.deep_mm"), ["vary.notch.deep_mm", "notch.depth_mm"]),
    "no axis": (HEAD + PROGRAM, ["[vary]", "missing"]),
    "text for a number": (GRID.replace("[10, 15", "['ten', 15"), ["vary.preload_N = 'ten'", "a finite number"]),
    "half a notch": (GRID.replace('"notch.depth_mm" = [2.8', '"notch.count" = [2.5'), ["notch.count = 2.5", "whole"]),
    "twice the same": (GRID.replace("[10, 15", "[10, 10"), ["preload_N", "different"]),
    "range without count": (GRID.replace(VALUES, "{from = 1, to = 2}"), ["vary.preload_N.count", "missing"]),
    "range upside down": (GRID.replace(VALUES, "{from = 2, to = 1, count = 3}"), ["preload_N.to = 1", "above"]),
    "list beside a sample": (GRID + '[sample]\nmethod = "sobol"\ncount = 8\n', ["vary.preload_N", "[sample]"]),
    "unknown method": (GRID + '[sample]\nmethod = "random"\ncount = 8\n', ["sample.method = 'random'", "sobol"]),
    "unknown preset": (GRID.replace("du2018", "du2019"), ["du2019", "du2018"]),
    "no rig": (GRID.replace('preset = "du2018"', ""), ["[rig]", "preset or file"]),
    "no amplitude": (GRID.replace("amplitude_mm = 2.2", ""), ["program.amplitude_mm", "missing"]),
    "group of another engine": (
        GRID.replace('"chain"', '"analytic"') + '[quantities]\ngroups = ["bouc-wen"]\n', ["bouc-wen", "analytic"]),
    "no power of two": (GRID + "[sensitivity]\ncount = 100\n", ["sensitivity.count = 100", "power of two"]),
    "one objective": (GRID + "[pareto.objectives]\nfull_scale_angle_deg = 'max'\n", ["objectives", "two"]),
    "unknown objective": (GRID + "[pareto.objectives]\nx = 'max'\ny = 'min'\n", ["pareto.objectives.x", "full_scale"]),
    "wall and inner diameter": (
        GRID.replace("preload_N", '"tube.wall_mm"').replace("notch.depth_mm", "tube.inner_diameter_mm"),
        ["vary.tube.wall_mm", "tube.inner_diameter_mm"]),
    "not TOML": ("schema = = 1", ["not TOML"]),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_file_is_one_line_with_file_field_and_value(name, tmp_path, capsys):
    text, words = BAD_FILES[name]
    assert call(["study", str(study_file(tmp_path, text)), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"notchbend: {tmp_path / 's.toml'}: ")
    assert error.count("\n") == 1
    assert all(word in error for word in words), error
    assert not (tmp_path / "out").exists()


def test_missing_file_names_the_ready_studies(tmp_path, capsys):
    assert call(["study", str(tmp_path / "none.toml"), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert all(name in error for name in ("none.toml", "preload", "notch-geometry"))


@pytest.mark.parametrize("name", ["preload", "notch-geometry"])
def test_ready_studies_are_read_by_name(name):
    asked = read_study(Path(name))
    assert isinstance(plan_of(asked), Grid)
    assert asked.path == ready_studies()[name]
    assert evaluate("k", next(cases(asked, plan_of(asked).points())).inputs).status == "ok"


def test_nested_and_quoted_fields_are_the_same(tmp_path):
    plain = read_study(study_file(tmp_path, GRID.replace('"notch.depth_mm"', "notch.depth_mm")))
    assert plain.axes == read_study(study_file(tmp_path, GRID)).axes
