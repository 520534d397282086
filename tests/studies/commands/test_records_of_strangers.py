"""Records as others make them: what they get wrong is said in one line, and what they have much of costs no more."""

import re
import time
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import triangle
from fem_models.rig import preset
from hysteresis.records.metrics import repeatability_deg
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_record, write_record
from studies.commands.cli import call
from studies.commands.compensation import write_columns
from studies.commands.separation import separate_records
from studies.commands.tracing import trace_files
from validation.separation import calibrate_rig
from validation.tracing import trace_records
from validation.tracing.baseline.samples import fastest
from validation.tracing.fitting.channel_errors import _errors
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.prepared import prepare


def loop(cycles=3, samples=80, noise=0.01, seed=0, **known):
    turns = np.linspace(0.0, cycles, cycles * samples + 1)
    drive = 2.0 * np.sin(2 * np.pi * turns)
    angle = 10.0 * drive + 2.0 * np.cos(2 * np.pi * turns)
    angle += np.random.default_rng(seed).normal(0.0, noise, drive.size)
    return Record(drive, angle, cycle=np.maximum(np.ceil(turns), 1).astype(int), **known)


def refused(arguments, capsys):
    assert call(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


def written(folder, csv, toml):
    (folder / "bench.csv").write_text(csv)
    (folder / "bench.toml").write_text("schema = 1\n" + toml)
    return folder / "bench.csv"


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        (
            'drive = "wheel_um"\nangle = "a"',
            "columns.drive = 'wheel_um': expected mm, deg, steps or N: convert the column, or declare drive.unit",
        ),
        ('drive = "d"\nangle = "theta_rad"', "columns.angle = 'theta_rad': expected degrees"),
        ('drive = "d"\nangle = "a"\ntime = "t_ms"', "columns.time = 't_ms': expected seconds"),
        ('drive = "d"\nangle = "a"\ntension_a = "load_gf"', "columns.tension_a = 'load_gf': expected newtons"),
        ('force = "weight_g"\nangle = "a"', "columns.force = 'weight_g': expected newtons"),
        ('drive = "d"\nangle = "a"\nnotches = ["n_deg", "n2_rad"]', "columns.notches = 'n2_rad': expected degrees"),
    ],
)
def test_a_column_of_another_unit_is_refused(columns, expected, tmp_path):
    """A factor of a thousand in time, or of 57 in the angle, went through every command without a word."""
    path = written(tmp_path, "a\n", f"[columns]\n{columns}\n")
    with pytest.raises(RecordError, match=re.escape(expected)):
        read_record(path)


@pytest.mark.parametrize("name", ["winkel_grad", "angle_grad", "from_rad_deg", "radius_angle"])
def test_names_that_only_look_like_another_unit_are_read(name, tmp_path):
    path = written(tmp_path, f"d,{name}\n0,0\n1,2\n0,1\n", f'[columns]\ndrive = "d"\nangle = "{name}"\n')
    assert read_record(path).angle_deg[1] == 2


def test_a_unit_that_the_sidecar_declares_is_believed(tmp_path):
    path = written(
        tmp_path, "load_g,a\n0,0\n1,2\n0,1\n",
        '[columns]\nforce = "load_g"\nangle = "a"\n[drive]\nunit = "N"\n',
    )  # fmt: skip
    assert read_record(path).drive_unit == "N"
    path = written(
        tmp_path, "motor_counts,a\n0,0\n1,2\n0,1\n",
        '[columns]\ndrive = "motor_counts"\nangle = "a"\n[drive]\nunit = "step"\n',
    )  # fmt: skip
    assert read_record(path).drive_unit == "step"


def test_a_counter_of_rows_is_no_cycle(tmp_path):
    rows = "\n".join(f"{np.sin(i / 9):.6f},{np.cos(i / 9):.6f},{i}" for i in range(200))
    (tmp_path / "scan.csv").write_text(f"drive_mm,angle_deg,cycle\n{rows}\n")
    with pytest.raises(RecordError, match=r"column 'cycle': 200 numbers in 200 rows: expected several samples"):
        read_record(tmp_path / "scan.csv")


def test_many_cycles_need_memory_and_time_in_proportion():
    """All pairs of 3,000 cycles took 430 MB and 10 s; which are compared makes no difference to the noise."""
    record = loop(cycles=3000, samples=12)
    began = time.process_time()
    assert repeatability_deg(record) is not None
    assert time.process_time() - began < 5.0
    tracemalloc.start()
    noise = repeatability_deg(record)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert noise == pytest.approx(0.01, rel=0.05)
    assert peak < 100e6


def test_an_angle_that_stands_still_is_refused_whatever_a_second_one_does(tmp_path, capsys):
    (tmp_path / "swapped.csv").write_text("drive_mm,angle_deg,angle_2_deg\n0,0,0\n1,0,10\n2,0,20\n1,0,11\n0,0,1\n")
    line = refused(["trace", str(tmp_path / "swapped.csv"), "--out", str(tmp_path / "out")], capsys)
    assert "angle = 0 deg in all 5 samples: expected an angle that changes" in line


def test_a_force_that_does_not_change_is_refused(tmp_path, capsys):
    rows = "\n".join(f"{i},0.98,{10 - np.exp(-i / 9):.4f}" for i in range(60))
    path = written(
        tmp_path, f"t,F,a\n{rows}\n", '[columns]\ntime = "t"\nforce = "F"\nangle = "a"\n'
    )  # fmt: skip
    line = refused(["trace", str(path), "--out", str(tmp_path / "out")], capsys)
    assert "tendon force = 0.98 N in all 60 samples: expected a force that changes" in line


def test_a_record_is_not_its_own_reference(tmp_path):
    write_record(loop(), tmp_path / "after.csv")
    with pytest.raises(RecordError, match=r"after.csv: given as a record and as --reference: expected different"):
        trace_files([tmp_path / "after.csv"], reference=[tmp_path / "after.csv"])


def test_a_few_samples_do_not_decide_on_a_change():
    few = Record([0.0, 1.0, 2.0, 1.0, 0.0], [0.0, 10.0, 20.0, 12.0, 1.0], source="new.csv")
    with pytest.raises(RecordError, match=r"new.csv: \d+ samples behind the first stroke: expected at least 30"):
        trace_records([few], reference=[loop()])


def test_a_drive_in_newtons_is_read_again(tmp_path):
    write_columns({"drive_N": np.array([0.0, 1.0, 0.5]), "angle_deg": np.array([0.0, 9.0, 6.0])}, tmp_path / "d.csv")
    again = read_record(tmp_path / "d.csv")
    assert (again.drive_unit, again.drive.tolist()) == ("N", [0.0, 1.0, 0.5])


def declared(scale):
    run = simulate_chain(preset("du2018"), triangle(1.5, cycles=2))
    return replace(run, angle_deg=scale * run.angle_deg, rig={"preset": "du2018", "preload_N": 20.0}, source="b.csv")


def test_separate_refuses_an_angle_of_the_other_sign():
    with pytest.raises(RecordError, match=r"b.csv: angle_deg: falls as drive_mm rises: expected the signs of the rig"):
        calibrate_rig([declared(-1.0)])


@pytest.mark.slow
def test_separate_refuses_an_angle_in_rad():
    with pytest.raises(RecordError, match=r"b\.csv: the angle covers .* by its rig: expected degrees and mm"):
        separate_records([declared(np.pi / 180)])
    assert not [w for w in separate_records([declared(1.0)]).warnings if "not those of this record" in w]


def test_a_time_written_too_close_is_no_speed():
    time = np.arange(500) / 100
    drive = 2.0 * np.sin(time)
    assert fastest(drive, time) == np.max(np.abs(np.diff(drive) / np.diff(time)))
    time[201] = time[200] + 1e-6
    assert fastest(drive, time) < 4.1 * 2.0


def test_a_channel_that_stands_still_has_no_relative_error():
    error = _errors("N", [np.zeros(5)], [np.full(5, 0.1)], [slice(None)])
    assert error == {"rmse_N": pytest.approx(0.1), "max_abs_N": 0.1, "max_rel_percent": None, "normalised": None}


def all_samples(records):
    return prepare(records, [np.arange(record.drive.size) for record in records])


def test_a_repeat_is_not_said_to_differ_in_protocol():
    records = [loop(seed=i, time_s=0.1 * np.arange(241), source=f"{i}.csv") for i in range(3)]
    assert "whose protocol others have, too" in divide_records(all_samples(records)).by
    other = replace(records[2], drive=0.5 * records[2].drive)
    assert "2.csv, whose protocol differs from those fitted" in divide_records(all_samples([*records[:2], other])).by
    sizes = [(20.0, 1.0), (20.0, 0.5), (10.0, 1.0), (10.0, 0.5)]  # each number occurs twice, each protocol once
    design = [replace(records[0], drive=size * records[0].drive, rig={"preload_N": N}) for N, size in sizes]
    assert "whose protocol differs from those fitted" in divide_records(all_samples(design)).by
