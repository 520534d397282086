"""``notchbend follow`` and ``nb.follow``: numbers of made devices, the files, and what is refused."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import notchbend as nb
from hysteresis import identify
from hysteresis.drift.explained import left_by
from hysteresis.drift.states import BOW, GAIN, LAG, PLAY, WIDTH, ZERO, states_of
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.own import is_own
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import write_record
from studies.commands.cli import call
from studies.follow import FollowSettings, follow_loaded
from studies.follow.cause import Shift, cause_of, explanations
from studies.follow.command import limits_of
from studies.follow.times import in_order, read_times

QUICK = IdentifySettings(population=8, generations=3)
NOISE_DEG = 0.02


def device(*, gain=1.0, width=1.0, lag_s=0.0, zero_deg=0.0, seed=0) -> Record:
    """A line with a Bouc-Wen loop, strokes of three sizes in 30 s."""
    turns = [0.0, 2.0, -2.0, 1.2, -1.2, 2.0, -2.0, 0.0]
    drive = np.concatenate([[0.0], *(np.linspace(a, b, 25)[1:] for a, b in pairwise(turns))])
    time = np.linspace(0.0, 30.0, drive.size)
    f = 10.0 * np.interp(time - lag_s, time, drive)
    law = BoucWen(A=-0.8, beta=0.8 / width / 2, gamma=0.8 / width / 2, n=1.0, h0_deg=0.0)
    angle = zero_deg + gain * f + law.along(f)
    noise = np.random.default_rng(seed).normal(0, NOISE_DEG, angle.size)
    return Record(drive=drive, angle_deg=angle + noise, time_s=time, kind="simulated")


@pytest.fixture(scope="module")
def fit():
    return identify(device(), settings=QUICK)


def test_numbers_are_those_of_the_device(fit):
    changed = device(gain=1.03, width=1.4, lag_s=0.05, zero_deg=0.4, seed=3)
    (state,) = states_of(fit, [changed])
    for name, value in (("gain", 1.03), ("width", 1.4), ("lag_s", 0.05), ("zero_deg", 0.4), ("bow_deg", 0.0)):
        found = state.parameters[name]
        assert found.low - 0.02 <= value <= found.high + 0.02, name
    assert state.parameters["left_deg"].value == pytest.approx(NOISE_DEG, rel=0.25)


def test_tension_and_lag_are_followed_where_they_were_recorded(fit):
    bare = replace(device(), time_s=None)
    assert "lag_s" not in states_of(fit, [bare])[0].parameters
    taut = replace(device(), tension_a_N=np.full(169, 21.0), tension_b_N=np.full(169, 19.0))
    assert states_of(fit, [taut])[0].parameters["tension_N"].value == pytest.approx(20.0)


def test_one_number_tells_causes_apart(fit):
    steady = [device(seed=k) for k in range(5)]
    for changed, number in ((device(width=1.5, seed=9), WIDTH), (device(lag_s=0.2, seed=9), LAG)):
        found = left_by(fit, steady, [changed], [GAIN, LAG, PLAY, BOW, WIDTH])
        assert min(found, key=lambda name: found[name].left) == number.name
        assert found[number.name].left <= found[number.name].limit < found["gain"].left


def pulled(record: Record, half_N=6.0, gain=1.0) -> Record:
    """Add tensions that follow the drive with friction; ``gain`` is that of the drive before the wheel."""
    law = BoucWen(A=0.5, beta=0.2, gamma=0.2, n=1.0, h0_deg=0.0)
    half = half_N * gain * record.drive + law.along(2 * gain * record.drive)
    noise = np.random.default_rng(5).normal(0, 0.02, (2, half.size))
    return replace(record, tension_a_N=20 + half + noise[0], tension_b_N=20 - half + noise[1])


def test_tensions_tell_a_camera_from_a_load(fit):
    """A bow of the angle without a change of tension is in the sensor."""
    steady = [pulled(device(seed=k)) for k in range(5)]
    turned = [replace(one, angle_deg=one.angle_deg + 0.002 * one.angle_deg**2) for one in steady]
    told = explanations(fit, steady, turned[:2])
    assert told[0].effect == "camera_misalignment"
    assert told[0].share > 0.9


def test_slack_is_a_preload_that_is_gone(fit):
    loose = replace(device(), tension_a_N=np.zeros(169), tension_b_N=np.zeros(169))
    fallen = [Shift("tension_N", -50.0, True)]
    assert cause_of(fit, fallen, [], [loose]).effects == ("tendon_slack",)
    assert cause_of(fit, fallen, [], [pulled(device())]).effects == ("preload_loss",)


@pytest.mark.parametrize(
    ("record", "said"),
    [
        (replace(device(), drive_unit="deg"), "drive in deg: expected mm"),
        (replace(device(), drive=3 * device().drive), "drive to 6 mm: expected up to 3"),
    ],
)
def test_records_of_another_drive_are_refused(fit, record, said):
    with pytest.raises(RecordError, match=said):
        states_of(fit, [record])


def test_a_zero_that_moved_alone_is_named_without_a_trace(fit):
    shifts = [Shift(ZERO.name, 9.0, True), Shift(WIDTH.name, 0.4, False)]
    cause = cause_of(fit, shifts, [], [])
    assert cause.effects == ("zero",)
    assert cause.how == "parameters"
    assert cause_of(fit, [Shift("tension_N", -5.0, True), *shifts[1:]], [], []).effects == ("preload_loss",)


@pytest.fixture(scope="module")
def followed():
    records = [device(zero_deg=0.02 * np.sin(7 * k) + 0.1 * max(0, k - 5), seed=k) for k in range(12)]
    settings = FollowSettings(reference=5, limits={"zero_deg": 1.0}, identify=QUICK)
    return follow_loaded(records, in_order(12), settings)


def test_a_drifting_zero_is_found_named_and_extrapolated(followed):
    assert followed.verdict == "changed"
    assert abs(followed.changes[0].first - 7) <= 1
    assert followed.changes[0].shape == "ramp"
    assert followed.cause.effects == ("zero",)
    (limit,) = followed.limits
    assert limit.low <= 16 <= limit.high
    assert limit.at == pytest.approx(16, abs=0.5)
    assert "record 7" in followed.words[0] or "record 6" in followed.words[0] or "record 8" in followed.words[0]


def test_page_has_a_chart_for_each_number(followed):
    from studies.follow.page import follow_page, plate_of

    assert len(plate_of(followed).charts) == len(followed.parameters) == 8
    page = follow_page(followed)
    for one in followed.parameters:
        assert f"<code>{one.name}</code>" in page
    assert followed.words[0] in page


def test_a_steady_device_is_steady():
    records = [device(zero_deg=0.05 * np.sin(11 * k), seed=20 + k) for k in range(8)]
    found = follow_loaded(records, in_order(8), FollowSettings(identify=QUICK))
    assert found.verdict == "steady"
    assert found.cause is None
    assert "has not changed over 8 records" in found.words[0]


def test_command_writes_json_and_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("studies.follow.command.IdentifySettings", lambda **given: QUICK)
    names = [f"use-{k}.csv" for k in range(6)]
    for k, name in enumerate(names):
        write_record(device(seed=k), tmp_path / name)
    rows = "".join(f"{name},{10 * k}\n" for k, name in enumerate(names))
    (tmp_path / "uses.csv").write_text("record,uses\n" + rows)
    words = ["follow", *names, "--times", "uses.csv", "--out", "out", "--no-trace", "--json"]
    assert call(words) == 0
    shown = json.loads(capsys.readouterr().out)
    stored = json.loads((tmp_path / "out/follow.json").read_text())
    assert stored["axis"] == {"name": "uses", "values": [0.0, 10.0, 20.0, 30.0, 40.0, 50.0]}
    assert shown["records"] == stored["records"] == names
    assert all(is_own(tmp_path / "out" / name) for name in ("follow.json", "report.html"))
    assert call(["report", "out"]) == 0
    page = (tmp_path / "out/report.html").read_text()
    assert '<h2 id="device">' in page
    assert stored["words"][0] in page
    for name, values in (("axis", stored["axis"] | {"values": [1.0]}), ("words", [])):
        (tmp_path / "out/follow.json").write_text(json.dumps(stored | {name: values}))
        assert call(["report", "out"]) == 2
    capsys.readouterr()
    assert call([*words, "--limit", "bend=1"]) == 2
    assert "--limit bend: not followed in these records: expected one of zero_deg" in capsys.readouterr().err


def test_front_door_checks_places():
    with pytest.raises(ValueError, match="expected 6 numbers that increase"):
        nb.follow([device()] * 6, at=[1, 2, 3, 3, 4, 5])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["a.csv", "b.csv"], "2 records: expected at least 6"),
        ([f"{k}.csv" for k in range(6)] + ["--reference-count", "5"], "--reference-count 5: expected 3 to 4"),
        ([f"{k}.csv" for k in range(6)], "0.csv: No such file"),
        ([f"{k}.csv" for k in range(6)] + ["--limit", "width"], "--limit 'width': expected NAME=VALUE"),
        ([f"{k}.csv" for k in range(6)] + ["--false-alarm", "0.5"], "--false-alarm"),
    ],
)
def test_bad_input_is_one_line(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert call(["follow", *words, "--out", "out"]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_limits_given_twice_are_refused():
    assert limits_of(["width=1.5", "zero_deg=-1"]) == {"width": 1.5, "zero_deg": -1.0}
    with pytest.raises(RecordError, match="given twice"):
        limits_of(["width=1", "width=2"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ":1: header '': expected a column record"),
        ("name,day\n", ":1: header 'name,day': expected a column record"),
        ("record,day\na.csv,one\n", ":2: column 'day' = 'one': expected a number"),
        ("record,day\na.csv\n", ":2: 1 cells: expected 2"),
        ("record,day\na.csv,1\n", "b.csv: missing: expected a row for each record"),
        ("record,day\na.csv,2\nb.csv,2\n", "b.csv: day = 2 after 2: expected records in order"),
    ],
)
def test_times_are_checked(text, said, tmp_path):
    file = tmp_path / "times.csv"
    file.write_text(text)
    with pytest.raises(RecordError) as error:
        read_times(file, [tmp_path / "a.csv", tmp_path / "b.csv"])
    assert said in str(error.value)
