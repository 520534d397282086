"""The second plane of a record, and what one plane does to the other."""

from dataclasses import replace

import numpy as np
import pytest

from hysteresis.records.planes import coupling, not_used, require_one_wheel, second_plane
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_record, read_records, write_record

DRIVE = np.array([0.0, 1.0, 2.0, 1.0, 0.0])
STILL = np.zeros(5)
SECOND = Record(
    STILL, 0.1 * DRIVE, drive_2=DRIVE, angle_2_deg=5 * DRIVE, tension_c_N=20 + DRIVE, tension_d_N=20 - DRIVE,
    torsion_deg=-0.2 * DRIVE, tip_mm=np.ones((5, 3)), source="two.csv",
)  # fmt: skip


def test_the_second_plane_is_a_record_of_its_wheel_and_angle():
    own = second_plane(SECOND)
    np.testing.assert_array_equal(own.drive, DRIVE)
    np.testing.assert_array_equal(own.angle_deg, 5 * DRIVE)
    np.testing.assert_array_equal(own.tension_a_N, 20 + DRIVE)
    assert own.tip_mm is None
    require_one_wheel(own)
    with pytest.raises(RecordError, match=r"two.csv: columns.drive_2: this wheel moves"):
        require_one_wheel(SECOND)
    with pytest.raises(RecordError, match=r"columns.drive: this wheel moves"):
        second_plane(own)
    with pytest.raises(RecordError, match=r"columns.drive_2: missing"):
        second_plane(Record(DRIVE, DRIVE))


def test_tendons_of_the_other_plane_are_held_where_a_force_drives():
    pulled = Record(DRIVE, DRIVE, drive_unit="N", tension_b_N=2 - DRIVE, tension_c_N=3 + 0.05 * DRIVE)
    require_one_wheel(pulled)
    with pytest.raises(RecordError, match=r"columns.tension_d: this tendon is pulled: expected .* c and d are held"):
        require_one_wheel(replace(pulled, tension_d_N=3 + DRIVE))


def test_coupling_is_the_slope_of_the_other_angle():
    found = coupling(second_plane(SECOND))
    assert found.share == pytest.approx(0.1 / 5)
    assert found.largest_deg == pytest.approx(0.2)
    assert found.torsion_deg == pytest.approx(0.4)
    assert coupling(Record(DRIVE, DRIVE)) is None
    assert coupling(Record(DRIVE, STILL, angle_2_deg=DRIVE)) is None


def test_columns_of_space_are_written_and_read(tmp_path):
    path = tmp_path / "two.csv"
    write_record(SECOND, path)
    again = read_record(path)
    assert again == SECOND
    assert path.read_text().startswith("drive_mm,angle_deg,tension_c_N,tension_d_N,angle_2_deg,torsion_deg,drive_2_mm,")
    np.testing.assert_array_equal(read_records([path], plane=2)[0].angle_deg, 5 * DRIVE)
    assert "not used" in not_used(again)
    assert not_used(Record(DRIVE, DRIVE)) == ""


def test_a_second_plane_alone_is_not_written(tmp_path):
    """Its rig counts the wheels of the whole record: read again it would be taken for the first plane."""
    with pytest.raises(RecordError, match="the second plane of a record alone"):
        write_record(second_plane(SECOND), tmp_path / "second.csv")
    assert list(tmp_path.iterdir()) == []
