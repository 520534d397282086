"""Notches that differ along the tube: values, rig files, sidecars, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem_models.rig import RigError, preset, read_rig
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.of_record import notched_tube_of
from fem_models.rig.rig import numeric_fields, with_number
from fem_models.rig.rig_file import rig_of_tables
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_record, write_record
from hysteresis.records.sidecar import toml

DEPTHS = (1.36, 1.39, 1.42, 1.45)
TUBE = Tube(1.62, 1.40)
BASE = preset("notched-wrist-90").to_dict()
CSV = "drive_mm,angle_deg\n0,0\n1,2\n2,5\n"


def notch(**changes) -> Notch:
    values = {"shape": "rectangular", "count": 4, "depth_mm": DEPTHS, "width_mm": 0.5, "spacing_mm": 0.5}
    return Notch(**values | changes)


def with_tables(notch_table: object) -> dict:
    return BASE | {"notch": notch_table}


def test_a_tuple_of_equal_numbers_is_one_number():
    same = notch(depth_mm=[1.4, 1.4, 1.4, 1.4], width_mm=(0.5,) * 4)
    assert same == notch(depth_mm=1.4)
    assert same.alike
    assert not notch().alike


def test_places_by_hand():
    # ring, notch, ring, ...: half a ring of 0.4 before the first notch, as beyond it
    joint = NotchedTube(TUBE, notch(width_mm=(0.5, 0.7, 0.5, 0.5), spacing_mm=(0.4, 0.6, 0.4, 0.8)))
    places = joint.places()
    np.testing.assert_allclose(places.middles, [0.45, 1.45, 2.65, 3.55], atol=1e-12)
    np.testing.assert_allclose(places.centres, [0.9, 2.1, 3.1, 4.2], atol=1e-12)
    assert joint.length_mm == places.centres[-1]
    one = joint.of_joint(1)
    assert one.cut.depth_mm == 1.39
    assert one.pitch_mm == pytest.approx(places.centres[1] - places.centres[0])  # tendon from ring to ring


def test_equal_places_are_those_of_the_pitch():
    joint = NotchedTube(TUBE, notch())
    assert joint.places().middles == tuple((k + 0.5) * 1.0 for k in range(4))
    assert joint.length_mm == 4 * joint.pitch_mm


def test_what_needs_equal_notches_says_so():
    joint = NotchedTube(TUBE, notch(width_mm=(0.5, 0.5, 0.5, 0.6)))
    with pytest.raises(RigError, match=r"notch\.depth_mm: differs from notch to notch: expected one number"):
        _ = joint.cut
    with pytest.raises(RigError, match=r"notch\.width_mm: differs from notch to notch: expected one pitch"):
        _ = joint.pitch_mm
    rig = rig_of_tables(with_tables(BASE["notch"] | {"depth_mm": [1.3, 1.35, 1.4, 1.4, 1.4]}), "x")
    assert "notch.depth_mm" not in numeric_fields(rig)
    with pytest.raises(RigError, match=r"notch\.depth_mm = 1\.3: expected a number of rig"):
        with_number(rig, "notch.depth_mm", 1.3)


def test_a_file_of_lists_and_one_of_rows_give_the_same_rig(tmp_path: Path):
    depths = [1.36, 1.39, 1.42, 1.45, 1.45]
    tables = with_tables(BASE["notch"] | {"depth_mm": depths})
    rig = rig_of_tables(tables, "x")
    assert rig.joint.notch.depth_mm == tuple(depths)
    (tmp_path / "lists.toml").write_text(toml(rig.to_dict()))
    assert read_rig(tmp_path / "lists.toml") == rig
    alike = {key: value for key, value in BASE["notch"].items() if key != "count"}
    rows = [alike | {"depth_mm": d} for d in depths[:3]] + [alike | {"depth_mm": 1.45, "count": 2}]
    text = toml({key: value for key, value in tables.items() if key != "notch"})
    text += "".join("\n[[notch]]\n" + toml(row) for row in rows)
    (tmp_path / "rows.toml").write_text(text)
    assert read_rig(tmp_path / "rows.toml") == rig


def test_a_rig_of_equal_notches_is_written_as_before():
    assert BASE["notch"] == {
        "shape": "rectangular", "count": 5, "depth_mm": 1.4, "width_mm": 0.5, "spacing_mm": 1.5, "rigid_roots": True,
    }  # fmt: skip


@pytest.mark.parametrize(
    "table",
    [
        "[notch]\nshape = 'rectangular'\ncount = 4\ndepth_mm = [1.36, 1.39, 1.42, 1.45]\nwidth_mm = 0.5\n"
        "spacing_mm = 0.5\n",
        "".join(
            f"[[notch]]\nshape = 'rectangular'\ndepth_mm = {d}\nwidth_mm = 0.5\nspacing_mm = 0.5\n" for d in DEPTHS
        ),
    ],
)
def test_a_sidecar_has_lists_or_rows(tmp_path: Path, table: str):
    (tmp_path / "a.csv").write_text(CSV)
    tube = "schema = 1\n[tube]\nouter_diameter_mm = 1.62\ninner_diameter_mm = 1.40\n"
    (tmp_path / "a.toml").write_text(tube + table)
    record = read_record(tmp_path / "a.csv")
    assert notched_tube_of(record) == NotchedTube(TUBE, notch())
    write_record(record, tmp_path / "b.csv")
    assert notched_tube_of(read_record(tmp_path / "b.csv")) == NotchedTube(TUBE, notch())


@pytest.mark.parametrize(
    ("field", "value", "expected"),
    [
        ("depth_mm", [1.3, 1.4], "notch.depth_mm = 2 numbers: expected one number, or 5, one a notch"),
        ("depth_mm", [], "notch.depth_mm = 0 numbers: expected one number, or 5, one a notch"),
        ("depth_mm", [1.3, 1.4, 1.4, 1.4, 1.7], "notch.depth_mm of notch 5 = 1.7: expected below 1.62 mm"),
        ("depth_mm", [1.3, "deep", 1.4, 1.4, 1.4], "notch.depth_mm of notch 2 = 'deep': expected a number"),
        ("depth_mm", [1.3, [1.4], 1.4, 1.4, 1.4], "notch.depth_mm of notch 2 = [1.4]: expected a number"),
        ("width_mm", [0.5, 0.5, -0.5, 0.5, 0.5], "notch.width_mm of notch 3 = -0.5: expected above 0"),
        ("width_mm", [0.5, True, 0.5, 0.5, 0.5], "notch.width_mm of notch 2 = True: expected a number"),
        ("spacing_mm", [float("nan")] * 5, "notch.spacing_mm of notch 1 = nan: expected a finite number"),
        ("spacing_mm", [1e308] * 5, "notch.spacing_mm of notch 1 = 1e+308: expected from"),
        ("spacing_mm", [10**400] * 5, "expected an integer of 64 bits"),
        ("depth_mm", [1.3] * 100_000, "notch.depth_mm = 100,000 numbers: expected at most 1,000"),
        ("count", [5], "notch.count = [5]: expected a number"),
        ("turn", [0, 90, 0, 90, 0], "notch.turn = [0, 90, 0, 90, 0]: expected one of shape"),
    ],
)
def test_a_list_that_cannot_be_is_refused_in_one_line(field: str, value: object, expected: str):
    with pytest.raises(RigError) as caught:
        rig_of_tables(with_tables(BASE["notch"] | {field: value}), "mine.toml")
    assert expected in str(caught.value)
    assert str(caught.value).startswith("mine.toml: ")
    assert "\n" not in str(caught.value)


def test_a_root_broader_than_one_of_the_notches():
    with pytest.raises(RigError, match=r"root_width_mm of notch 2 = 0\.4: expected .* below notch\.width_mm = 0\.3"):
        Notch("v_pair", 3, 0.5, (0.5, 0.3, 0.5), 0.5, root_width_mm=0.4)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"turn": 1.0}, "[[notch]] row 2: turn = 1.0: expected the keys of row 1"),
        ({"shape": "v_pair"}, "[[notch]] row 2: shape = 'v_pair': expected 'rectangular', as of row 1"),
        ({"count": 10**12}, "[[notch]] row 2: count = 1000000000000: expected at least 1, at most 1,000 in all rows"),
        ({"count": 0}, "[[notch]] row 2: count = 0: expected at least 1"),
        ({"depth_mm": [1.4]}, "[[notch]] row 2: depth_mm = [1.4]: expected a number"),
        ({"depth_mm": float("nan")}, "[[notch]] row 2: depth_mm = nan: expected a number"),
    ],
)
def test_rows_that_cannot_be_are_refused_in_one_line(change: dict, expected: str):
    first = {"shape": "rectangular", "depth_mm": 1.3, "width_mm": 0.5, "spacing_mm": 0.5}
    with pytest.raises(RigError) as caught:
        rig_of_tables(with_tables([first, first | change]), "mine.toml")
    assert expected in str(caught.value)
    for rows in ([], [1], [first] * 1001):
        with pytest.raises(RigError, match=r"^mine\.toml: \[\[notch\]\]"):
            rig_of_tables(with_tables(rows), "mine.toml")


def test_a_sidecar_with_a_list_that_cannot_be(tmp_path: Path):
    (tmp_path / "a.csv").write_text(CSV)
    head = "schema = 1\n[tube]\nouter_diameter_mm = 1.62\ninner_diameter_mm = 1.40\n[notch]\n"
    for line, expected in (
        ("depth_mm = [1.3, 'x']", "notch.depth_mm of notch 2 = 'x': expected a number"),
        ("depth_mm = []", "notch.depth_mm = 0 numbers: expected one a notch, at most 1,000"),
        ("depth_mm = [1.3, nan]", "notch.depth_mm of notch 2 = nan: expected a number"),
    ):
        (tmp_path / "a.toml").write_text(head + line + "\n")
        with pytest.raises(RecordError) as caught:
            read_record(tmp_path / "a.csv")
        assert expected in str(caught.value)


ANY = st.one_of(st.floats(), st.integers(), st.booleans(), st.text(max_size=4), st.sampled_from([1e308, 10**400, 1.4]))


@given(
    st.sampled_from(["depth_mm", "width_mm", "spacing_mm", "root_width_mm", "count", "shape", "rigid_roots"]),
    st.one_of(st.lists(ANY, max_size=7), st.lists(st.floats(0.1, 1.6), min_size=5, max_size=5), ANY),
)
def test_any_list_makes_a_rig_or_one_line(field: str, value: object):
    table = BASE["notch"] | {field: value}
    for tables in (table, [table | {"count": 2}, {**BASE["notch"], "count": 3}]):
        message = ""
        try:
            rig = rig_of_tables(with_tables(tables), "mine.toml")
            assert rig.joints == rig.joint.notch.count
            assert rig_of_tables(rig.to_dict(), "again") == rig
        except RigError as error:
            message = str(error)
        assert "\n" not in message
        assert len(message) < 400
