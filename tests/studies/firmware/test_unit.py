"""``export --to fmu``: the units by another program, fmpy, and what they hold."""

import json
import re
import subprocess
import zipfile

import numpy as np
import pytest
from firmware_fits import COMPILER, STRICT, compiled, needs_compiler, replayed, stored_fit

from hysteresis.files import write_files
from hysteresis.own import is_own
from studies.commands.cli import call
from studies.firmware import compensator_files, read_compensator, unit, unit_files
from studies.firmware.vector import made_vector

NAMES = {"3.0": "cmp.fmu", "2.0": "cmp_fmi2.fmu"}
LAWS = ["bouc-wen", "asymmetric-bouc-wen", "generalised-prandtl-ishlinskii"]


@pytest.fixture
def fmpy():
    return pytest.importorskip("fmpy", reason="fmpy is not installed")


def made(folder, case="bouc-wen"):
    compensator = read_compensator(stored_fit(folder / "identify.json", case), "cmp")
    write_files(unit_files(compensator, folder) | compensator_files(compensator, folder))
    return compensator


def simulated(fmpy, path, reference, measured=None, start=None):
    """Feed references, one a step of 1 s; the rows after each step."""
    rows = [np.arange(reference.size), reference, reference if measured is None else measured]
    names = [("time", "f8"), ("reference_deg", "f8"), ("measured_deg", "f8")]
    signals = np.array(list(zip(*rows, strict=True)), dtype=names)
    output = ["drive_mm", "angle_deg", "limited", "zero_deg", "gain", "width", "flags"]
    found = fmpy.simulate_fmu(
        str(path),
        stop_time=reference.size,
        output_interval=1,
        step_size=1,
        input=signals,
        output=output,
        start_values=start or {},
    )
    return found[1:]


@needs_compiler
@pytest.mark.parametrize("version", NAMES)
@pytest.mark.parametrize("case", LAWS)
def test_the_unit_is_valid_and_gives_the_drives_of_python(fmpy, tmp_path, case, version):
    from fmpy.validation import validate_fmu

    compensator = made(tmp_path, case)
    path = tmp_path / NAMES[version]
    assert validate_fmu(str(path)) == []
    reference, drive = made_vector(compensator.layer, count=300)
    found = simulated(fmpy, path, reference)
    np.testing.assert_allclose(found["drive_mm"], drive, rtol=0, atol=1e-10)
    np.testing.assert_allclose(found["angle_deg"], reference, rtol=0, atol=1e-9)
    program = compiled(tmp_path / "cmp.c", "-DCMP_MAIN", out=tmp_path / "program")
    np.testing.assert_array_equal(found["drive_mm"], replayed(program, reference))
    assert not found["limited"].any()


@needs_compiler
@pytest.mark.parametrize("version", NAMES)
def test_the_unit_learns_and_is_limited(fmpy, tmp_path, version):
    """The angle that is measured is 0.7 deg above the reference; the zero that is learnt is 0.7 deg."""
    compensator = made(tmp_path)
    reference, _ = made_vector(compensator.layer, count=600)
    reference *= 0.9
    measured = np.append(reference[0], reference[:-1] + 0.7)  # at the drive of the step before
    path = tmp_path / NAMES[version]
    found = simulated(fmpy, path, reference, measured, {"reidentify": True})
    assert np.ptp(found["zero_deg"]) > 0.5
    assert set(simulated(fmpy, path, reference, measured)["zero_deg"]) == {0.0}
    held = simulated(fmpy, path, reference, start={"largest_step_mm": 0.001})
    assert np.abs(np.diff(held["drive_mm"])).max() < 0.001 + 1e-12
    assert (held["limited"] == 4).any()


@pytest.mark.parametrize("version", NAMES)
def test_the_unit_holds_its_source(tmp_path, version, monkeypatch):
    monkeypatch.setattr(unit.shutil, "which", lambda name: None)
    made(tmp_path)
    path = tmp_path / NAMES[version]
    assert is_own(path)
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        archive.extractall(tmp_path / "unit")
    assert not any(name.startswith("binaries/") for name in names)
    wrapper = f"sources/cmp_fmi{version[0]}.c"
    assert {"modelDescription.xml", "sources/cmp.c", "sources/cmp.h", wrapper} <= set(names)
    assert (tmp_path / "unit/sources/cmp.c").read_text() == (tmp_path / "cmp.c").read_text()
    if COMPILER:
        command = [COMPILER, *STRICT, "-c", wrapper, "-o", "unit.o"]
        done = subprocess.run(command, cwd=tmp_path / "unit", capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_the_command_writes_both_units_and_the_same_again(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    stored_fit(tmp_path / "fit/identify.json")
    command = ["export", "fit", "--to", "fmu", "--out", "made", "--json", "--quiet"]
    assert call(command) == 0
    assert json.loads(capsys.readouterr().out)["files"] == ["made/compensator.fmu", "made/compensator_fmi2.fmu"]
    first = [path.read_bytes() for path in sorted((tmp_path / "made").iterdir())]
    assert call(command) == 0
    assert [path.read_bytes() for path in sorted((tmp_path / "made").iterdir())] == first
    (tmp_path / "made/compensator.fmu").write_bytes(b"of another hand")
    capsys.readouterr()
    assert call(command) == 2
    assert re.search(r"compensator\.fmu: not written by notchbend", capsys.readouterr().err)


def test_the_command_says_that_no_compiler_was_found(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    stored_fit(tmp_path / "fit/identify.json")
    monkeypatch.setattr(unit.shutil, "which", lambda name: None)
    assert call(["export", "fit", "--to", "fmu", "--out", "made", "--quiet"]) == 0
    said = capsys.readouterr().err
    assert said == "notchbend: no C compiler found (cc, gcc, clang): the units hold their source, without a binary\n"


@needs_compiler
def test_a_unit_that_does_not_compile_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    stored_fit(tmp_path / "fit/identify.json")
    monkeypatch.setattr(unit, "OPTIONS", ("--no-such-option",))
    assert call(["export", "fit", "--to", "fmu", "--out", "made", "--quiet"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "the C compiler could not make the unit" in error
    assert not (tmp_path / "made").exists()
