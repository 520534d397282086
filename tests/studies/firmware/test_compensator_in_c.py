"""The compensator in C against the laws in Python, and what compilers and sanitizers say of it."""

import ctypes
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from closed_branch import branch_closed_form
from firmware_fits import CASES, COMPILER, STRICT, compiled, needs_compiler, replayed, stored_fit

from hysteresis.files import write_files
from studies.firmware import compensator_files, read_compensator
from studies.firmware.vector import predicted, random_path, required_drive

pytestmark = needs_compiler
FLOAT = "-DCMP_FLOAT"
STEPS = 10_000
WITHIN_DEG = {"double": 1e-9, "float": 1e-3}
AT_LOWEST, AT_HIGHEST, AT_RATE, NOT_FINITE = 1, 2, 4, 8


class Exported:
    """A fit with its files in C, its programs in double and float, and a random path of drives with its angles."""

    def __init__(self, case, folder, **changed):
        self.folder, self.source = folder, folder / "cmp.c"
        self.compensator = read_compensator(stored_fit(folder / "identify.json", case, **changed), "cmp")
        self.layer = self.compensator.layer
        write_files(compensator_files(self.compensator, folder))
        self.programs = {
            kind: compiled(self.source, "-DCMP_MAIN", *options, out=folder / kind)
            for kind, options in {"double": (), "float": (FLOAT,)}.items()
        }
        self.drive = random_path(STEPS, (-1.6, 1.6), self.layer.first_drive, seed=11)
        self.angle_deg = predicted(self.layer, self.drive)

    def library(self):
        """Load the functions in double, and make their state."""
        made = compiled(self.source, "-shared", "-fPIC", out=self.folder / "cmp.so")
        calls, size = ctypes.CDLL(str(made)), int(re.search(r"memory\[(\d+)\]", self.header)[1])

        class State(ctypes.Structure):
            _fields_ = (
                ("f_deg", ctypes.c_double),
                ("h_deg", ctypes.c_double),
                ("drive", ctypes.c_double),
                ("largest_step", ctypes.c_double),
                ("zero_deg", ctypes.c_double),
                ("gain", ctypes.c_double),
                ("width", ctypes.c_double),
                ("memory", ctypes.c_double * size),
                ("limited", ctypes.c_uint),
            )

        for call in (calls.cmp_step, calls.cmp_observe):
            call.argtypes, call.restype = (ctypes.POINTER(State), ctypes.c_double), ctypes.c_double
        state = State()
        calls.cmp_init(ctypes.byref(state))
        return calls, state

    @property
    def header(self):
        return (self.folder / "cmp.h").read_text()


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    made = {}

    def get(case):
        if case not in made:
            made[case] = Exported(case, tmp_path_factory.mktemp("firmware"))
        return made[case]

    return get


@pytest.mark.parametrize("kind", ["double", "float"])
@pytest.mark.parametrize("case", CASES)
def test_model_is_that_of_python(exported, case, kind):
    one = exported(case)
    found = replayed(one.programs[kind], one.drive, "observe")
    np.testing.assert_allclose(found, one.angle_deg, rtol=0, atol=WITHIN_DEG[kind])


@pytest.mark.parametrize("kind", ["double", "float"])
@pytest.mark.parametrize("case", CASES)
def test_drive_is_that_of_python_and_gives_the_reference(exported, case, kind):
    """By the inverse in Python, and by a second way: the drives of C, put into the model in Python."""
    one, few = exported(case), 2000
    found = replayed(one.programs[kind], one.angle_deg)
    expected = required_drive(one.layer, one.angle_deg[:few])
    np.testing.assert_allclose(one.layer.f(found[:few]), one.layer.f(expected), rtol=0, atol=WITHIN_DEG[kind])
    np.testing.assert_allclose(predicted(one.layer, found), one.angle_deg, rtol=0, atol=WITHIN_DEG[kind])


@pytest.mark.parametrize("kind", ["double", "float"])
def test_a_limit_that_drops_at_the_centre_overflows_nothing(exported, monkeypatch, kind):
    """h comes from the wide side with 20 times the limit of the narrow one, to the power of n = 10."""
    monkeypatch.setitem(CASES, "asymmetric-bouc-wen", (-1.0, [[1.5, 0.5, np.log(10.0), 1.0, 0.0, 1.5, 0.0]], 20.0))
    one = Exported("asymmetric-bouc-wen", exported("no hysteresis").folder / "steep")
    found = replayed(one.programs[kind], one.drive, "observe")
    np.testing.assert_allclose(found, one.angle_deg, rtol=0, atol=WITHIN_DEG[kind])


@pytest.mark.parametrize("kind", ["double", "float"])
def test_a_curve_that_is_almost_flat_in_places_is_inverted(exported, kind):
    """Stairs: Newton's method leaves its bracket where the cubic of an interval bends from flat to steep."""
    drive = np.linspace(-2.0, 2.0, 9)
    stairs = {"drive": drive.tolist(), "angle_deg": [-40.0, -39.999, -39.998, -10.0, 0.0, 0.001, 0.002, 30.0, 50.0]}
    one = Exported("no hysteresis", exported("no hysteresis").folder / "stairs", f=stairs)
    wanted = np.random.default_rng(2).uniform(-40.0, 50.0, 2000)
    found = replayed(one.programs[kind], wanted)
    np.testing.assert_allclose(one.layer.f(found), wanted, rtol=0, atol=WITHIN_DEG[kind])


@pytest.mark.parametrize("kind", ["double", "float"])
@pytest.mark.parametrize("case", CASES)
def test_a_reference_that_moves_within_rounding_is_followed(exported, case, kind):
    """The excess at the start is then 0 or of either sign by rounding."""
    one = exported(case)
    real = {"double": np.float64, "float": np.float32}[kind]
    drive = replayed(one.programs[kind], one.angle_deg[:300])
    angle = replayed(one.programs[kind], drive, "observe").astype(real)
    near = np.array([[value, *(value + k * np.spacing(value) for k in (-3, -1, 1, 2))] for value in angle]).ravel()
    found = replayed(one.programs[kind], near)
    np.testing.assert_allclose(predicted(one.layer, found), near, rtol=0, atol=WITHIN_DEG[kind])


@pytest.mark.parametrize("case", ["bouc-wen", "leading"])
def test_branch_is_the_hypergeometric_one(exported, case):
    one = exported(case)
    law, f = one.layer.elements[0], one.layer.f(np.array([one.layer.first_drive, 0.6, -1.4, 1.1]))
    h, angles = law.h0_deg, []
    for a, b in pairwise(f):
        h = branch_closed_form(h, a, b, law)
        angles.append(b + h)
    np.testing.assert_allclose(replayed(one.programs["double"], [0.6, -1.4, 1.1], "observe"), angles, atol=1e-9)


@pytest.mark.parametrize("case", CASES)
def test_vector_is_replayed(exported, case):
    one = exported(case)
    text = (one.folder / "cmp_test.csv").read_text()
    assert text.startswith("reference_deg,drive_mm\n")
    done = subprocess.run([str(one.programs["double"])], input=text, capture_output=True, text=True, check=True)
    said = re.fullmatch(r"largest difference in 1000 rows: (\S+) mm\n", done.stderr)
    assert float(said[1]) < 1e-10
    assert {line.split(",")[2] for line in done.stdout.splitlines()[1:]} == {"0"}


@pytest.mark.parametrize("options", [(), (FLOAT,)])
@pytest.mark.parametrize("case", CASES)
def test_sanitizers_find_nothing(exported, case, options):
    one = exported(case)
    checks = ("-fsanitize=undefined,address", "-fno-sanitize-recover=all")
    probe = one.folder / "probe.c"
    probe.write_text("int main(void) { return 0; }\n")
    probed = subprocess.run(
        [COMPILER, *STRICT, *checks, str(probe), "-o", str(one.folder / "probe")], capture_output=True
    )
    if probed.returncode:
        pytest.skip("this compiler has no sanitizers")
    program = compiled(one.source, "-DCMP_MAIN", *checks, *options, out=one.folder / "sanitized")
    hard = [1e9, -1e9, 1e308, float("nan"), float("inf"), 5e-324, 0.0, -90.0, 90.0]
    assert np.isfinite(replayed(program, [*one.angle_deg[:1000], *hard])).all()
    assert np.isfinite(replayed(program, [*one.drive[:1000], *hard], "observe")).all()


TIDY = "-*,clang-analyzer-*,bugprone-*,cert-*,misc-*,performance-*,portability-*"
"""Checks of clang-tidy. Left out: which arguments look alike, which header a name comes from, and -1 and 1 as reals."""
NO_TIDY = "-bugprone-easily-swappable-parameters,-misc-include-cleaner,-bugprone-narrowing-conversions"


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), (FLOAT,)])
@pytest.mark.parametrize("case", CASES)
def test_clang_tidy_finds_nothing(exported, case, options):
    tidy = Path(sys.executable).with_name("clang-tidy")
    command = [str(tidy), "--quiet", f"--checks={TIDY},{NO_TIDY}", "--warnings-as-errors=*", str(exported(case).source)]
    done = subprocess.run([*command, "--", "-std=c99", "-DCMP_MAIN", *options], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.parametrize("case", CASES)
def test_functions_and_bytes_are_those_of_the_header(exported, case):
    """Undefined symbols by nm, the stack by -fstack-usage, the state by sizeof."""
    one = exported(case)
    options = ("-c", "-Wshadow", "-Wdouble-promotion")
    made = compiled(one.source, *options, FLOAT, out=one.folder / "single.o")
    needed = {"float": _undefined(made)}
    needed["double"] = _undefined(compiled(one.source, *options, out=one.folder / "double.o"))
    named = set(re.findall(r"\b(exp|pow|sqrt)\b", re.search(r"no static state,(.*?)\n", one.header)[1]))
    assert needed["double"] == named
    assert needed["float"] == {f"{name}f" for name in named}
    sizes = re.search(r"(\d+) bytes in double and (\d+) in float", one.header)
    for size, flags in zip(sizes.groups(), ((), (FLOAT,)), strict=True):
        probe = one.folder / "size.c"
        probe.write_text(
            f'#include "cmp.h"\ntypedef char exact[sizeof(cmp_state) == {size} ? 1 : -1];\nexact unused;\n'
        )
        compiled(probe, "-c", *flags, out=one.folder / "size.o")


@pytest.mark.parametrize("case", CASES)
def test_stack_is_within_what_the_header_says(exported, case):
    one = exported(case)
    most = int(re.search(r"at most (\d+) bytes", one.header)[1])
    try:
        compiled(one.source, "-c", "-fstack-usage", out=one.folder / "stack.o")
    except AssertionError:
        pytest.skip("this compiler has no -fstack-usage")
    rows = (one.folder / "stack.su").read_text().splitlines()
    assert all(row.split("\t")[2] == "static" for row in rows)
    assert 0 < sum(int(row.split("\t")[1]) for row in rows) <= most


@pytest.mark.parametrize("case", ["bouc-wen", "leading", "generalised-prandtl-ishlinskii"])
def test_drive_is_held_and_the_model_stays_with_the_motor(exported, case):
    one = exported(case)
    calls, state = one.library()
    at_ends = [(2.0, AT_HIGHEST), (-2.0, AT_LOWEST)]
    if one.compensator.angle_deg[-1] < one.compensator.angle_deg[0]:
        at_ends.reverse()
    for reference, (drive, bit) in zip((1e9, -1e9), at_ends, strict=True):
        assert calls.cmp_step(ctypes.byref(state), reference) == drive
        assert state.limited == bit
    path = np.array([drive for drive, _ in at_ends])
    angle = calls.cmp_observe(ctypes.byref(state), path[-1])  # it stands there: nothing moves
    assert state.limited == 0
    assert angle == pytest.approx(predicted(one.layer, path)[-1], abs=1e-9)
    assert calls.cmp_observe(ctypes.byref(state), 7.0) == pytest.approx(
        predicted(one.layer, np.append(path, 2.0))[-1], abs=1e-9
    )
    assert state.limited == AT_HIGHEST


def test_numbers_that_are_not_finite_move_nothing(exported):
    calls, state = exported("two elements").library()
    calls.cmp_step(ctypes.byref(state), 11.0)
    before = bytes(state)[: type(state).limited.offset]
    for given in (float("nan"), float("inf"), -float("inf")):
        for call in (calls.cmp_step, calls.cmp_observe):
            assert np.isfinite(call(ctypes.byref(state), given))
            assert state.limited == NOT_FINITE
    assert bytes(state)[: type(state).limited.offset] == before


def test_rate_is_limited_and_the_reference_is_reached_in_time(exported):
    one = exported("asymmetric-bouc-wen")
    calls, state = one.library()
    state.largest_step = 0.02
    drives, limited = [one.layer.first_drive], []
    for _ in range(60):
        drives.append(calls.cmp_step(ctypes.byref(state), 21.0))
        limited.append(state.limited)
    assert np.abs(np.diff(drives)).max() <= 0.02 * (1 + 1e-12)
    assert limited[0] == AT_RATE
    assert limited[-1] == 0
    assert predicted(one.layer, np.array(drives[1:]))[-1] == pytest.approx(21.0, abs=1e-9)


@pytest.mark.parametrize("case", ["two elements", "prandtl-ishlinskii"])
def test_state_is_saved_by_its_bytes_and_reset(exported, case):
    one = exported(case)
    calls, state = one.library()
    references = one.angle_deg[:400].tolist()
    first = [calls.cmp_step(ctypes.byref(state), reference) for reference in references]
    saved = bytes(state)
    onward = [calls.cmp_step(ctypes.byref(state), reference) for reference in references]
    again = type(state).from_buffer_copy(saved)
    assert [calls.cmp_step(ctypes.byref(again), reference) for reference in references] == onward
    again.largest_step = 9.0
    calls.cmp_reset(ctypes.byref(again))
    assert again.largest_step == 9.0
    assert [calls.cmp_step(ctypes.byref(again), reference) for reference in references] == first


def _undefined(made):
    found = subprocess.run(["nm", str(made)], capture_output=True, text=True, check=True).stdout
    return set(re.findall(r" U (\w+)", found))
