"""Every function and class of the front door with values of a wrong kind for each of its parameters."""

import dataclasses
import inspect
import re
import warnings

import numpy as np
import pytest
from small_study import HEAD, PROGRAM, study_file

import notchbend as nb

QUICK = nb.IdentifySettings(method="least-squares", population=8, generations=3)
ERRORS = (nb.RecordError, nb.RigError, nb.SolverError, nb.StudyError, nb.MissingError, TypeError, ValueError)
WRONG = {
    "None": None, "number": 3, "below": -1.5, "text": "x", "bytes": b"x", "list": [], "texts": ["a", 1], "table": {},
    "array": np.arange(3.0), "array of a text": np.array("x"), "ragged": [[1], [1, 2]], "object": object(),
    "settings": QUICK, "complex": 1 + 2j, "NaN": float("nan"), "huge": 10**400,
}  # fmt: skip
RESULTS = ("Fit",)
"""Classes that functions give, and nobody makes."""


def fields_of(value):
    return {one.name: getattr(value, one.name) for one in dataclasses.fields(value)}


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Arguments that are right, by function or class."""
    folder = tmp_path_factory.mktemp("good")
    rig, program = nb.preset("du2018"), nb.triangle(0.3)
    record = nb.simulate(rig, nb.triangle(1.0, step_mm=0.1, cycles=2), engine="chain")
    nb.write_record(record, folder / "loop.csv")
    study = study_file(folder, HEAD + PROGRAM + "[vary]\npreload_N = [10, 20]\n")
    return {
        "simulate": {"rig": rig, "program": program, "engine": "chain"},
        "identify": {"records": record, "settings": QUICK, "use_rig": True, "progress": False},
        "identify_each": {"records": [record], "settings": QUICK, "use_rig": True, "workers": 1, "progress": False},
        "trace": {"records": record, "reference": (), "threads": 1},
        "separate": {"what": rig, "amplitude_mm": 0.5, "engine": "chain", "seed": 0, "members": ()},
        "compensate": {"model": nb.identify(record, settings=QUICK), "reference_deg": [0.0, 3.0, 1.0],
                       "time_s": [0.0, 1.0, 2.0], "settings": QUICK},
        "study": {"file": study, "out": folder / "out", "workers": 1, "retry": False, "progress": False},
        "export": {"what": rig, "out": folder / "m.xml", "to": "mujoco", "amplitude_mm": 0.2, "name": "compensator",
                   "seed": 0, "cutting": None},
        "follow": {"records": [record] * 6, "at": [0, 1, 2, 3, 4, 5], "axis": "day", "reference_count": 3,
                   "limits": {"width": 1.5}, "trace": False},
        "calibrate": {"rig": rig, "amplitude_mm": 1.0, "noise_deg": 0.05, "error_deg": None, "speed_mm_per_s": 0.5,
                      "minutes": 5.0},
        "plot": {"what": rig, "view": "side", "joint_angles_deg": None},
        "write_record": {"record": record, "path": folder / "w.csv"},
        "read_record": {"path": folder / "loop.csv"},
        "read_rig": {"path": "no.toml"},
        "preset": {"name": "du2018", "preload_N": 10.0},
        "ensemble": {"name": "du2018", "preload_N": 10.0},
        "triangle": {"amplitude_mm": 1.0, "step_mm": 0.1, "cycles": 1},
        "sine": {"amplitude_mm": 1.0, "rate_Hz": 0.5, "cycles": 1, "samples_per_cycle": 100},
        "LoadProgram": fields_of(program) | {"time_s": np.arange(program.drive_mm.size)},
        "IdentifySettings": fields_of(QUICK),
        "Record": fields_of(record),
        "Rig": fields_of(rig),
    }  # fmt: skip


def public():
    """Names of the functions and classes, and of each of their parameters."""
    for name in nb.__all__:
        item = getattr(nb, name)
        if callable(item) and name not in RESULTS and not (isinstance(item, type) and issubclass(item, Exception)):
            yield from ((name, parameter) for parameter in inspect.signature(item).parameters)


@pytest.fixture
def short(monkeypatch):
    """What takes seconds is not run: the types are checked before."""
    monkeypatch.setattr("validation.tracing.trace_records", lambda *_, **__: None)
    monkeypatch.setattr("studies.commands.separation.separate_rig", lambda *_, **__: None)
    monkeypatch.setattr("studies.commands.separation.separate_records", lambda *_, **__: None)
    monkeypatch.setattr("studies.sweep.run.run_study", lambda *_, **__: None)
    monkeypatch.setattr("studies.follow.work.follow_loaded", lambda *_, **__: None)
    monkeypatch.setattr("studies.calibrate.calibration", lambda *_, **__: None)


@pytest.mark.parametrize(("name", "parameter"), list(public()))
def test_a_wrong_value_is_taken_or_refused_in_one_line(name, parameter, good, short, tmp_path, monkeypatch):
    """Wrong calls gave errors of what they met inside, such as ``'str' object has no attribute 'rig'``."""
    monkeypatch.chdir(tmp_path)  # a text is a path
    assert set(good[name]) == set(inspect.signature(getattr(nb, name)).parameters)
    for kind, wrong in WRONG.items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                getattr(nb, name)(**(good[name] | {parameter: wrong}))
        except ERRORS as error:
            refused = error
        else:
            continue
        said = str(refused)
        assert "\n" not in said, kind
        assert "expected" in said or isinstance(refused, nb.SolverError) or "No such file" in said, (kind, said)
        if type(refused) in (TypeError, ValueError):
            assert re.match(rf"{parameter}( = |\[|: )", said), (kind, said)


@pytest.mark.parametrize(("call", "words"), [
    (lambda: nb.sine(1.0, "fast"), "rate_Hz = 'fast': expected a number"),
    (lambda: nb.triangle(1.0, cycles=2.0), "cycles = 2.0: expected a whole number"),
    (lambda: nb.read_record(3), "path = 3: expected a path"),
    (lambda: nb.simulate("du2018", [0, 1, 0]), "program = [0, 1, 0]: expected a LoadProgram"),
    (lambda: nb.preset("du2018", preload_N="x"), "preload_N = 'x': expected a number or None"),
    (lambda: nb.IdentifySettings(method=3), "method = 3: expected one of genetic, "),
    (lambda: dataclasses.replace(nb.preset("du2018"), joint=3), "joint = 3: expected a NotchedTube or a MeasuredJoint"),
])  # fmt: skip
def test_a_wrong_type_is_named_with_what_is_expected(call, words):
    with pytest.raises((TypeError, nb.RigError)) as error:
        call()
    assert str(error.value).startswith(words)


@pytest.mark.parametrize("call", [
    lambda: nb.IdentifySettings(seed=-1), lambda: nb.separate("du2018", seed=-1),
])  # fmt: skip
def test_a_seed_below_zero_is_named(call):
    with pytest.raises(ValueError, match=r"^seed = -1: expected at least 0$"):
        call()


def test_a_record_is_not_its_own_reference(good):
    record = good["trace"]["records"]
    with pytest.raises(nb.RecordError, match="own reference: expected different records"):
        nb.trace(record, reference=[record])


def test_numbers_of_numpy_are_numbers():
    assert nb.triangle(np.float32(0.5), cycles=np.int64(2)) is not None
    assert nb.triangle(np.array(0.5), cycles=np.array(2)).drive_mm.size == 46
    assert nb.preset("du2018", preload_N=10).preload_N == 10
