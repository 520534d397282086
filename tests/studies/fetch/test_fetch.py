import functools
import hashlib
import http.server
import io
import os
import re
import threading
import time
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from hysteresis.records.record_file import read_record
from studies.fetch import CATALOGUE, SOURCES_ONLY, FetchError, download, fetch_record


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *args):
        pass


@pytest.fixture
def upstream(tmp_path, monkeypatch):
    """A server on this machine in place of the public one: write(name, bytes) publishes the file of an entry."""
    root = tmp_path / "upstream"
    root.mkdir()
    handler = functools.partial(QuietHandler, directory=str(root))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    monkeypatch.setattr(download, "RAW", f"http://127.0.0.1:{server.server_address[1]}")
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")

    def publish(name: str, content: bytes, sha256: str | None = None) -> None:
        entry = CATALOGUE[name]
        place = root / entry.repository.owner_name / entry.repository.commit / entry.path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
        digest = sha256 or hashlib.sha256(content).hexdigest()
        monkeypatch.setitem(CATALOGUE, name, replace(entry, sha256=digest))

    yield publish
    server.shutdown()
    server.server_close()
    thread.join()


def text(rows: list[list[float]], head: str = "") -> bytes:
    return (head + "".join(", ".join(f"{v:f}" for v in row) + "\n" for row in rows)).encode()


def mat(**variables: object) -> bytes:
    stream = io.BytesIO()
    savemat(stream, variables)
    return stream.getvalue()


def fetched(name, tmp_path):
    path = fetch_record(name, tmp_path / "records", cache=tmp_path / "cache")
    assert path == tmp_path / "records" / f"{name}.csv"
    assert path.with_suffix(".toml").exists()
    return read_record(path)


def test_catalogue_is_complete_and_well_formed():
    assert len(CATALOGUE) == 29
    for name, entry in CATALOGUE.items():
        assert name == entry.name
        assert re.fullmatch(r"[0-9a-f]{64}", entry.sha256), name
        assert re.fullmatch(r"[0-9a-f]{40}", entry.repository.commit), name
        assert entry.repository.commit[:7] in entry.citation
        assert entry.licence
        assert download.address(entry).startswith(f"https://raw.githubusercontent.com/{entry.repository.owner_name}/")
    assert not set(CATALOGUE) & set(SOURCES_ONLY)


def test_every_measured_record_is_fetchable_and_described_alike(measured):
    sidecars = {p.stem for p in measured.glob("*.toml")}
    lacks = {name for name in CATALOGUE if re.fullmatch(r"surgical-manipulator-conf\d+-\d+deg(-b)?", name)}
    assert len(lacks) == 7
    assert set(CATALOGUE) - lacks <= sidecars <= set(CATALOGUE)
    for name in sorted(sidecars):
        ours, entry = read_record(measured / f"{name}.csv"), CATALOGUE[name]
        assert (entry.title, entry.drive_unit) == (ours.title, ours.drive_unit)
        assert (entry.tube, entry.notch) == (ours.tube, ours.notch)


def test_manipulator_takes_its_columns_and_keeps_the_first_of_samples_at_one_time(upstream, tmp_path):
    rows = [[0.1 * i, 10 + i, 0, 0, 0, 20 + i, 30 + i, 0, 0] for i in range(5)]
    rows.insert(3, rows[2])
    upstream("surgical-manipulator-feedforward", text(rows))
    upstream("surgical-manipulator-0-80", text([row[:7] for row in rows]))
    compensated = fetched("surgical-manipulator-feedforward", tmp_path)
    np.testing.assert_array_equal(compensated.drive, 30.0 + np.arange(5))
    np.testing.assert_array_equal(compensated.angle_deg, 20.0 + np.arange(5))
    np.testing.assert_allclose(compensated.time_s, 0.1 * np.arange(5))
    assert compensated.drive_unit == "deg"
    np.testing.assert_array_equal(fetched("surgical-manipulator-0-80", tmp_path).drive, 10.0 + np.arange(5))


def test_manipulator_ends_where_the_clock_begins_anew(upstream, tmp_path):
    rows = [[0.1 * i, 10 + i, 0, 0, 0, 20 + i, 1.0 * i] for i in range(6)]
    rows.insert(3, [*rows[2][:6], 7.0])  # at the same time, another force
    upstream("surgical-manipulator-conf0-50deg", text([*rows, [0.0, 15, 0, 0, 0, 25, 0], [0.1, 15, 0, 0, 0, 25, 0]]))
    record = fetched("surgical-manipulator-conf0-50deg", tmp_path)
    np.testing.assert_array_equal(record.drive, 10.0 + np.arange(6))
    np.testing.assert_allclose(record.time_s, 0.1 * np.arange(6))


def test_tool_averages_ten_counts_and_turns_them_into_degrees(upstream, tmp_path):
    """8192 and 4000 counts a turn; the last, incomplete ten is left out."""
    rows = [[0.001 * i, 8192 * (i // 10), 0, 0, 1000 * (i // 10) + i % 10 - 4.5, 0, 0, 0, 0, 0] for i in range(37)]
    upstream("davinci-tool-load010-0.1hz", text(rows, "%header\n%idxPulse_0=0\n"))
    record = fetched("davinci-tool-load010-0.1hz", tmp_path)
    np.testing.assert_allclose(record.time_s, [0.0, 0.01, 0.02])
    np.testing.assert_allclose(record.drive, [0.0, 360.0, 720.0])
    np.testing.assert_allclose(record.angle_deg, [0.0, 90.0, 180.0], atol=1e-12)


def test_catheter_is_taken_to_an_even_time(upstream, tmp_path):
    moments = [0.0, 0.004, 0.013, 0.019, 0.0312]
    rows = [[t, 2 * t, 0, 0, 0, 0, 100 * t, 0, 0] for t in moments]
    upstream("catheter-taut-0.1hz", text(rows, "Time,Tendon Disp.,...\n"))
    record = fetched("catheter-taut-0.1hz", tmp_path)
    np.testing.assert_allclose(record.time_s, [0, 0.01, 0.02, 0.03])
    np.testing.assert_allclose(record.drive, [0, 0.02, 0.04, 0.06])
    np.testing.assert_allclose(record.angle_deg, [0, 1, 2, 3])


def test_tendon_robot_bends_by_the_turn_of_its_last_markers(upstream, tmp_path):
    turn = np.radians([0.0, 10.0, 35.0])
    markers = np.zeros((3, 3, 12))
    markers[:, 0, 11], markers[:, 2, 11] = 40 * np.sin(turn), -40 * np.cos(turn)
    column = np.array([[5.0], [6.0], [7.5]])
    content = mat(Time=column, Stroke=2 * column, Tension=3 * column, MarkerDataSynced=markers)
    upstream("tendon-robot-zero-0.10hz", content)
    record = fetched("tendon-robot-zero-0.10hz", tmp_path)
    np.testing.assert_allclose(record.time_s, [0, 1, 2.5])
    np.testing.assert_allclose(record.drive, [10, 12, 15])
    np.testing.assert_allclose(record.tension_a_N, [15, 18, 22.5])
    np.testing.assert_allclose(record.angle_deg, [0, 10, 35], atol=1e-9)


def test_wrist_has_its_notches_trials_and_geometry(upstream, tmp_path):
    force = np.array([0.0, 0.9, 1.8, 0.01, 1.0, 1.7])
    angles = np.arange(36.0).reshape(6, 6)
    cell = np.array([force, angles, np.zeros(6), "trial", 1.0], dtype=object)
    upstream("notched-wrist-150", mat(experimentData150=cell))
    record = fetched("notched-wrist-150", tmp_path)
    assert record.drive_unit == "N"
    np.testing.assert_array_equal(record.drive, force)
    np.testing.assert_array_equal(record.angle_deg, angles[:, 5])
    np.testing.assert_array_equal(record.notches_deg, angles[:, :5])
    np.testing.assert_array_equal(record.cycle, [1, 1, 1, 2, 2, 2])
    assert (record.tube["outer_diameter_mm"], record.notch["width_mm"]) == (1.62, 0.8)


def test_probe_angle_is_the_turn_of_the_tip_against_a_base_that_moves(upstream, tmp_path):
    """Turn about one axis of a tip that stands askew on a base that is itself turned about: only the turn is left."""
    steps = np.array([100.0, 110.0, 120.0, 110.0, 90.0])
    turn = 0.3 * (steps - 100)
    base = Rotation.random(5, random_state=1)
    axis = np.array([1.0, 2.0, 2.0]) / 3
    tip = base * Rotation.from_rotvec([0.4, -0.1, 0.2]) * Rotation.from_rotvec(np.radians(turn)[:, None] * axis)
    table = np.column_stack([np.arange(5), steps, np.zeros((5, 4)), tip.as_quat(), np.zeros((5, 3)), base.as_quat()])
    header = "<row><c t='s'><v>0</v></c></row>"
    rows = "".join("<row>" + "".join(f"<c><v>{v!r}</v></c>" for v in row) + "</row>" for row in table.tolist())
    space = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as book:
        book.writestr("xl/worksheets/sheet1.xml", f"<worksheet xmlns='{space}'>{header}{rows}</worksheet>")
    upstream("tee-probe-antero-posterior", stream.getvalue())
    record = fetched("tee-probe-antero-posterior", tmp_path)
    assert record.drive_unit == "step"
    np.testing.assert_array_equal(record.drive, steps)
    np.testing.assert_allclose(record.angle_deg, turn - turn.mean(), atol=1e-9)


def test_file_in_the_cache_is_not_fetched_again(upstream, tmp_path, monkeypatch):
    rows = [[0.1 * i, i, 0, 0, 0, i, 0] for i in range(4)]
    upstream("surgical-manipulator-0-80", text(rows))
    first = fetched("surgical-manipulator-0-80", tmp_path)
    monkeypatch.setattr(download, "RAW", "http://127.0.0.1:9")
    assert fetched("surgical-manipulator-0-80", tmp_path) == first


def one_line(name, tmp_path, **options):
    """The error of a fetch that fails, after which nothing has been written."""
    with pytest.raises(FetchError) as caught:
        fetch_record(name, tmp_path / "records", cache=tmp_path / "cache", **options)
    assert not (tmp_path / "records").exists()
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(name)
    return message


def test_another_file_is_refused(upstream, tmp_path):
    upstream("surgical-manipulator-0-80", b"0, 0\n", sha256="0" * 64)
    message = one_line("surgical-manipulator-0-80", tmp_path)
    assert "not the file of the catalogue, expected sha256 000000000000..." in message
    assert not [p for p in (tmp_path / "cache").iterdir() if p.is_file()]


def test_file_that_has_gone_is_named(upstream, tmp_path):
    upstream("surgical-manipulator-0-80", b"")
    message = one_line("surgical-manipulator-feedforward", tmp_path)
    assert "answered 404" in message
    assert (
        "operation/optimizer_input/aurora_ff.txt of github.com/nhoyh/hysteresis_compensation_ROS at 7c00843" in message
    )


def test_no_connection_says_so_at_once_with_source_and_licence(tmp_path, monkeypatch):
    monkeypatch.setattr(download, "RAW", "http://127.0.0.1:9")  # discard port: nobody listens
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    started = time.monotonic()
    message = one_line("davinci-tool-load010-0.1hz", tmp_path)
    assert time.monotonic() - started < 5
    assert "no connection to 127.0.0.1:9" in message
    assert "10.1109/LRA.2018.2849862" in message
    assert "Open Database License" in message


def test_server_that_hangs_is_given_up(tmp_path, monkeypatch):
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), QuietHandler) as server:  # accepts, never answers
        monkeypatch.setattr(download, "RAW", f"http://127.0.0.1:{server.server_address[1]}")
        monkeypatch.setenv("NO_PROXY", "127.0.0.1")
        monkeypatch.setattr(download, "TIMEOUT_S", 0.2)
        assert "no answer from 127.0.0.1" in one_line("davinci-tool-load010-0.1hz", tmp_path)


def test_cache_that_cannot_be_made_is_named(upstream, tmp_path):
    upstream("surgical-manipulator-0-80", b"")
    (tmp_path / "cache").write_text("a file")
    assert f"{tmp_path / 'cache'}" in one_line("surgical-manipulator-0-80", tmp_path)


def test_unknown_name_gets_its_neighbours(tmp_path):
    assert "expected one of catheter-taut-0.5hz" in one_line("catheter-tau-0.5", tmp_path)
    assert "tee-probe-antero-posterior" in one_line("zzz", tmp_path)


def test_source_without_a_record_is_cited(tmp_path):
    assert "10.1016/j.commatsci.2021.110357" in one_line("niti-diamond", tmp_path)


@pytest.mark.skipif(
    "NOTCHBEND_UPSTREAM" not in os.environ, reason="set NOTCHBEND_UPSTREAM to the address to fetch from"
)
@pytest.mark.parametrize("name", CATALOGUE)
def test_fetched_record_is_the_measured_one(name, measured, tmp_path, monkeypatch):
    """Measured records are rounded to six digits."""
    monkeypatch.setattr(download, "RAW", os.environ["NOTCHBEND_UPSTREAM"])
    ours, theirs = read_record(measured / f"{name}.csv"), fetched(name, tmp_path)
    for field in ("drive", "angle_deg", "time_s", "tension_a_N", "notches_deg", "cycle"):
        expected, found = getattr(ours, field), getattr(theirs, field)
        if expected is None or found is None:
            assert expected is found, field
        else:
            np.testing.assert_allclose(found, expected, rtol=5.1e-6, atol=6e-6, err_msg=field)
