"""Writing records: exact round trip, and all files or none."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hysteresis.files import write_files
from hysteresis.records.path import require_reversal
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_record, write_record

finite = st.floats(-1e9, 1e9)
times = st.floats(-(2.0**53), 2.0**53)
positive = st.floats(min_value=1e-300, allow_nan=False, allow_infinity=False)
words = st.text(max_size=20)


@st.composite
def records(draw: st.DrawFn) -> Record:
    m = draw(st.integers(3, 12))

    def row(*shape: int):
        return arrays(float, (m, *shape), elements=finite)

    def increasing(n: int, values=finite):
        return st.lists(values, min_size=n, max_size=n, unique=True).map(sorted)

    def maybe(strategy):
        return draw(st.none() | strategy)

    theory = maybe(increasing(4))
    rig = st.fixed_dictionaries(
        {}, optional={"preset": words, "preload_N": positive, "joints": st.integers(1, 99), "pitch_mm": positive}
    )
    table = st.dictionaries(words, words | finite | st.integers(), max_size=3)
    return Record(
        draw(row()),
        draw(row()),
        drive_unit=draw(st.sampled_from(["mm", "deg", "step", "N"])),
        title=draw(words),
        kind=draw(st.sampled_from(["measured", "simulated"])),
        time_s=maybe(increasing(m, times)),
        cycle=maybe(st.lists(st.integers(-5, 2**40), min_size=m, max_size=m).map(sorted)),
        tension_a_N=maybe(row()),
        tension_b_N=maybe(row()),
        notches_deg=maybe(row(draw(st.integers(1, 3)))),
        tip_mm=maybe(row(2)),
        rig=draw(rig),
        tube=draw(table),
        notch=draw(table),
        kinematics=None if theory is None else np.column_stack([theory, draw(arrays(float, 4, elements=finite))]),
    )


@settings(max_examples=150)
@given(record=records())
def test_round_trip_is_exact(tmp_path_factory: pytest.TempPathFactory, record: Record) -> None:
    path = tmp_path_factory.mktemp("records") / "run-0.3hz.csv"
    write_record(record, path)
    again = read_record(path)
    assert again == record
    assert again.source == str(path)


@pytest.mark.parametrize(
    ("record", "expected"),
    [
        (Record([0, 1], [0, 1]), "loop.csv: 2 samples"),
        (Record([0, 1, 0], [0, 1, 0], rig={"name": "x"}), "loop.toml: rig.name: unknown key"),
        (Record([0, 1, 0], [0, 1, 0], tube={"outer_diameter_mm": None}), "loop.toml: tube.outer_diameter_mm = None"),
    ],
)
def test_write_refuses_the_errors_of_read(tmp_path: Path, record: Record, expected: str) -> None:
    with pytest.raises(RecordError) as caught:
        write_record(record, tmp_path / "loop.csv")
    assert str(caught.value).removeprefix(f"{tmp_path}/").startswith(expected)
    assert list(tmp_path.iterdir()) == []


def test_write_to_no_folder_or_wrong_name(tmp_path: Path) -> None:
    record = Record([0, 1, 0], [0, 1, 0])
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match="expected a folder that can be written to"):
        write_record(record, tmp_path / "file" / "loop.csv")
    with pytest.raises(RecordError, match=r"expected a name that ends in \.csv"):
        write_record(record, tmp_path / "loop.toml")


def test_failed_write_leaves_the_old_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old = Record([0, 1, 0], [0, 1, 0], title="old")
    write_record(old, tmp_path / "loop.csv")
    write_text = Path.write_text

    def full_disk(self: Path, text: str, **options: object) -> int:
        if "loop.csv" in self.name:
            write_text(self, text[:10], **options)
            raise OSError(28, "No space left on device")
        return write_text(self, text, **options)

    monkeypatch.setattr(Path, "write_text", full_disk)
    with pytest.raises(RecordError, match="No space left on device"):
        write_record(replace(old, title="new", drive=[0, 2, 0]), tmp_path / "loop.csv")
    assert read_record(tmp_path / "loop.csv") == old
    assert sorted(p.name for p in tmp_path.iterdir()) == ["loop.csv", "loop.toml"]


def test_a_folder_in_the_place_of_either_file_leaves_nothing(tmp_path: Path) -> None:
    for name in ("loop.csv", "loop.toml"):
        (tmp_path / name).mkdir()
        with pytest.raises(RecordError, match=rf"{name}: is a folder: expected the name of a file"):
            write_record(Record([0, 1, 0], [0, 1, 0]), tmp_path / "loop.csv")
        assert [path.name for path in tmp_path.iterdir()] == [name]
        (tmp_path / name).rmdir()


@pytest.mark.parametrize("failure", [PermissionError(13, "Permission denied"), KeyboardInterrupt()])
def test_a_replacement_that_fails_after_the_first_is_undone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: BaseException
) -> None:
    (tmp_path / "old.txt").write_text("old")
    replace_file = Path.replace

    def second_fails(self: Path, target: Path) -> Path:
        if target.name == "last.txt":
            raise failure
        return replace_file(self, target)

    monkeypatch.setattr(Path, "replace", second_fails)
    with pytest.raises((RecordError, KeyboardInterrupt)):
        write_files({tmp_path / name: "new" for name in ("old.txt", "new.txt", "last.txt")})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"old.txt": "old"}


def test_only_a_sidecar_is_replaced(tmp_path: Path) -> None:
    record = Record([0, 1, 0], [0, 1, 0])
    for text in ("preload_N = 15.0\n", "schema = 1\n", "not = = toml"):
        (tmp_path / "loop.toml").write_text(text)
        with pytest.raises(RecordError, match=r"loop\.toml: not the sidecar of a record"):
            write_record(record, tmp_path / "loop.csv")
        assert [path.read_text() for path in tmp_path.iterdir()] == [text]
    (tmp_path / "loop.toml").unlink()
    write_record(record, tmp_path / "loop.csv")
    write_record(replace(record, title="again"), tmp_path / "loop.csv")
    assert read_record(tmp_path / "loop.csv").title == "again"


def test_every_measured_record_reads_and_round_trips(measured: Path, tmp_path: Path) -> None:
    for sidecar in sorted(measured.glob("*.toml")):
        record = read_record(sidecar.with_suffix(".csv"))
        write_record(record, tmp_path / f"{sidecar.stem}.csv")
        assert read_record(tmp_path / f"{sidecar.stem}.csv") == record
        if record.drive_unit == "N":
            with pytest.raises(RecordError, match="'tendon_force_N' never reverses"):
                require_reversal(record)
        else:
            require_reversal(record)
