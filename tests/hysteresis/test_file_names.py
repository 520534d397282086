"""Names of files that are not UTF-8: refused before anything is computed, since no result can hold them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hysteresis.files import RecordError, require_place, write_files
from hysteresis.records.record_file import read_record
from studies.commands.cli import call

ROOT = Path(__file__).parents[2]
LATIN = os.fsdecode(b"b\xe9nch.csv")
PLAIN = "drive_mm,angle_deg\n0,0\n1,2\n0,1\n"


@pytest.fixture
def latin(tmp_path):
    path = tmp_path / LATIN
    try:
        path.write_text(PLAIN)
    except OSError:
        pytest.skip("a file system without such names")
    return path


def test_a_record_of_such_a_name_is_refused(latin):
    with pytest.raises(RecordError, match="a name that is not UTF-8, which no result can hold: expected it renamed"):
        read_record(latin)


@pytest.mark.parametrize("command", [["record", "new"], ["identify"], ["trace"]])
def test_a_command_ends_in_one_line_and_keeps_the_folder(command, latin, tmp_path, capsys):
    out = [] if command[0] == "record" else ["--out", str(tmp_path / "out")]
    assert call([*command, str(latin), *out]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "a name that is not UTF-8" in error
    assert list(tmp_path.iterdir()) == [latin]


def test_results_of_such_a_name_are_refused_before(tmp_path):
    with pytest.raises(RecordError, match="a name that is not UTF-8"):
        require_place(tmp_path / LATIN)
    with pytest.raises(RecordError, match="which is not UTF-8: expected names in UTF-8"):
        write_files({tmp_path / "a.json": f'"{LATIN}"'})
    assert list(tmp_path.iterdir()) == []


def test_a_locale_without_the_characters_is_said(tmp_path):
    """ASCII alone: a name in UTF-8 is refused in one line that says so, and what is printed has escapes."""
    (tmp_path / "bénch.csv").write_text(PLAIN)
    ascii_only = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONPATH": str(ROOT)}
    code = "from studies.commands.cli import main; main()"
    command = [sys.executable, "-c", code, "record", "new", "bénch.csv"]
    done = subprocess.run(command, cwd=tmp_path, env=ascii_only, capture_output=True, check=False)
    assert done.returncode == 2
    assert b"a name that this locale cannot read: expected LANG=C.UTF-8, or another name\n" in done.stderr
    (tmp_path / "a.csv").write_bytes("Weg [µm];Winkel [°]\n0;0\n1000;2\n0;1\n".encode())
    done = subprocess.run([*command[:-1], "a.csv"], cwd=tmp_path, env=ascii_only, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"Weg [\xb5m]" in done.stdout
