"""Compensation: the inverse is exact for its own layer, and accurate in the multibody model."""

import json

import numpy as np
import pytest
from how_made import printed
from hypothesis import given, settings
from hypothesis import strategies as st

from fem_models.chain import simulate_chain
from fem_models.load import LoadProgram
from fem_models.rig import preset
from hysteresis import identify, read_record
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.laws.inverse import compensating_drive, inverse_curve, inverse_hysteresis, uncompensated_drive
from hysteresis.records.record_file import read_columns, write_record
from studies.commands.cli import call
from studies.commands.identification import write_fit
from studies.report import write_report
from validation.layer import track
from validation.layer.compensation import Disturbance, identify_layer, noisy, references, shrinking_loops

RIG = preset("du2018-full-widths", preload_N=20.0)


@pytest.fixture(scope="module")
def fit():
    return identify_layer(RIG, simulate_chain, elements=2)


@settings(max_examples=60)
@given(
    st.lists(st.floats(-40, 40), min_size=1, max_size=25),
    st.floats(0.01, 1.5).flatmap(lambda size: st.sampled_from([size, -size])),
    st.floats(0.05, 3.0),
    st.floats(1.0, 8.0),
    st.floats(-0.9, 1.0),
)
def test_inverse_inserted_into_the_law_gives_the_angle(angles, A, saturation, n, rho):
    total = abs(A) / saturation**n
    model = BoucWen(A=A, beta=total / (1 + rho), gamma=total * rho / (1 + rho), n=n)
    path = inverse_hysteresis(angles, [model], 0.0)
    f = np.append(0.0, path)
    assert (f + hysteresis(f, model))[1:] == pytest.approx(np.array(angles), abs=1e-8)


def test_inverse_of_a_curve_and_its_errors():
    drives = np.linspace(-2, 2, 37)
    assert inverse_curve(lambda x: -np.sinh(x), -np.sinh(drives), (-2.0, 2.0)) == pytest.approx(drives, abs=1e-10)
    with pytest.raises(ValueError, match="sample 1: f = 5 deg"):
        inverse_curve(np.sinh, [0.0, 5.0], (-2.0, 2.0))
    with pytest.raises(ValueError, match="flat or reverses"):
        inverse_curve(lambda x: np.maximum(x, 0.0), [0.5], (-1.0, 1.0))
    for flat_from in (lambda x: np.minimum(x, 0.5), lambda x: -np.minimum(x, 0.5)):
        with pytest.raises(ValueError, match=r"at a drive of 0\.(5|49)"):
            inverse_curve(flat_from, [0.2], (-1.0, 1.0))


def test_layer_follows_its_own_inverse(fit):
    for wanted in references().values():
        drive = np.append(0.0, compensating_drive(fit, wanted, 0.0))
        assert fit.predict(drive)[1:] == pytest.approx(wanted, abs=1e-8)
        plain = uncompensated_drive(fit, wanted)
        assert fit.plain(plain) == pytest.approx(wanted, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("what", list(references()))
def test_compensation_reduces_the_error_of_the_multibody_model_five_times(fit, what):
    pytest.importorskip("exudyn", reason="Exudyn cannot be imported here: its library libGL.so.1 is missing?")
    from fem_models.multibody import simulate_multibody

    assert track(fit, RIG, references()[what], simulate_multibody).ratio >= 5  # required


@pytest.fixture(scope="module")
def loops(tmp_path_factory):
    path = tmp_path_factory.mktemp("loops") / "loops.csv"
    write_record(simulate_chain(RIG, shrinking_loops()), path)
    return path


def test_command_writes_the_drive(loops, tmp_path, capsys):
    wanted = 25 * np.sin(np.linspace(0, 9, 60))
    reference, out = tmp_path / "wanted.csv", tmp_path / "drive.csv"
    rows = (f"{t},{a}" for t, a in zip(np.arange(60.0).tolist(), wanted.tolist(), strict=True))
    reference.write_text("time_s,angle_deg\n" + "\n".join(rows) + "\n")
    assert call(["compensate", str(loops), "--reference", str(reference), "--out", str(out), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["samples"] == 60
    stored = tmp_path / "drive-compensate.json"
    assert shown == json.loads(stored.read_text())
    printed(stored, write_report(tmp_path).read_text(), ["compensate", loops, "--reference", reference, "--out", out])
    columns = read_columns(out, ["drive_mm", "angle_deg", "time_s"])
    assert columns["angle_deg"] == pytest.approx(wanted)
    angle = simulate_chain(RIG, shrinking_loops()).angle_deg  # the drive must stay within the record's range
    assert np.abs(columns["drive_mm"]).max() < 1.8
    assert np.abs(angle).max() > 25


def test_an_identify_json_gives_the_drive_of_its_record(loops, tmp_path):
    """The layer from the file has f as a table: the same drive, except for the interpolation."""
    reference = tmp_path / "wanted.csv"
    reference.write_text("angle_deg\n" + "\n".join(map(repr, (20 * np.sin(np.linspace(0, 9, 60))).tolist())) + "\n")
    fit = identify(read_record(loops))
    write_fit(fit, [read_record(loops)], tmp_path, "identify")
    drives = []
    for source in (loops, tmp_path / "identify.json"):
        out = tmp_path / f"drive-{source.suffix[1:]}.csv"
        given = ["compensate", str(source), "--reference", str(reference), "--out", str(out), "--elements", "1"]
        assert call([*given, "--quiet"]) == 0
        drives.append(read_columns(out, ["drive_mm"])["drive_mm"])
    assert np.abs(drives[0] - drives[1]).max() < 1e-4 * np.ptp(drives[0])


def test_a_drive_is_due_before_the_angle_by_the_delay(tmp_path, capsys):
    """The rig's angle is read 0.2 s late: along the drive, read as late, it is the reference at its times."""
    time = np.arange(0.0, 24.0, 0.05)  # at three rates: at one, a delay is a play
    turn = np.interp(time, [0.0, 4.0, 12.0, 24.0], 2 * np.pi * np.array([0.0, 2.0, 3.0, 9.0]))
    run = simulate_chain(RIG, LoadProgram(1.7 * np.sin(turn)))
    late = np.interp(time - 0.2, time, run.angle_deg)
    loops, reference, out = (tmp_path / name for name in ("late.csv", "wanted.csv", "drive.csv"))
    rows = zip(time.tolist(), run.drive.tolist(), late.tolist(), strict=True)
    loops.write_text("time_s,drive_mm,angle_deg\n" + "".join(f"{t!r},{d!r},{a!r}\n" for t, d, a in rows))
    loops.with_suffix(".toml").write_text('schema = 1\ntitle = "late"\nkind = "measured"\n')
    given = ["compensate", str(loops), "--delay", "--reference", str(reference), "--out", str(out)]
    reference.write_text("angle_deg\n0\n1\n0\n")
    assert call([*given, "--quiet"]) == 2
    assert "missing: the angle is 0." in capsys.readouterr().err
    times = np.arange(0.0, 20.0, 0.05)
    wanted = 25 * np.sin(0.9 * times)
    reference.write_text(
        "time_s,angle_deg\n" + "".join(f"{t!r},{a!r}\n" for t, a in zip(times.tolist(), wanted.tolist(), strict=True))
    )
    assert call([*given, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["delay_s"] == pytest.approx(0.2, abs=0.01)
    columns = read_columns(out, ["drive_mm", "angle_deg", "time_s"])
    assert columns["time_s"] == pytest.approx(times - shown["delay_s"])
    drive = LoadProgram(np.append(0.0, columns["drive_mm"]))
    read = np.interp(times - 0.2, columns["time_s"], simulate_chain(RIG, drive).angle_deg[1:])
    error = (read - wanted)[10:]
    assert np.sqrt(np.mean(error**2)) < 0.25
    assert columns["angle_deg"][10:] == pytest.approx(np.interp(columns["time_s"], times, wanted)[10:])


@pytest.mark.parametrize(
    ("text", "words"), [("{", ["layer.json", "expected"]), ('{"schema": 1}', ["layer.json", "parameters", "missing"])]
)
def test_other_json_is_refused_in_one_line(text, words, tmp_path, capsys):
    layer, reference, out = (tmp_path / name for name in ("layer.json", "wanted.csv", "drive.csv"))
    layer.write_text(text)
    reference.write_text("angle_deg\n0\n1\n0\n")
    assert call(["compensate", str(layer), "--reference", str(reference), "--out", str(out), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(word in error for word in words), error
    assert not out.exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("angle_deg\n0\n70\n0\n", ["wanted.csv:3", "angle_deg", "70", "within"]),
        ("angle\n0\n1\n0\n", ["wanted.csv", "angle_deg"]),
        ("angle_deg\n", ["wanted.csv", "no row below the header"]),
        ("angle_deg\n0\none\n0\n", ["wanted.csv:3", "one"]),
        ("time_s,angle_deg\n0,0\n1,1\n1,0\n", ["wanted.csv:4", "time_s"]),
    ],
)
def test_bad_references_are_named_and_nothing_is_written(text, words, loops, tmp_path, capsys):
    reference, out = tmp_path / "wanted.csv", tmp_path / "drive.csv"
    reference.write_text(text)
    assert call(["compensate", str(loops), "--reference", str(reference), "--out", str(out), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(word in error for word in words), error
    assert not out.exists()


@pytest.mark.slow
def test_compensation_suffers_from_another_preload_more_than_from_noise(fit):
    """Noise of 0.2 deg leaves a ratio far above 5; a preload of 10 N in place of 20 N does not."""
    wanted = references()["triangle of +-30 deg"]
    loops = lambda rig, program: noisy(simulate_chain(rig, program), 0.2)  # noqa: E731
    with_noise = track(identify_layer(RIG, loops, elements=2), RIG, wanted, simulate_chain)
    other_preload = track(fit, Disturbance("", preload_N=10.0).rig(), wanted, simulate_chain)
    more_friction = track(fit, Disturbance("", friction=1.3).rig(), wanted, simulate_chain)
    assert with_noise.ratio > 10
    assert other_preload.ratio < 3
    assert other_preload.without_deg > track(fit, RIG, wanted, simulate_chain).without_deg
    assert 3 < more_friction.ratio < 8
