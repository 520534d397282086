"""A fit whose angle lags the drive: what the C files say of it, and learning on line beside a delay."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from firmware_fits import compiled, needs_compiler, stored_fit

from hysteresis.files import write_files
from studies.firmware import compensator_files, read_compensator

TICKS = 10
PAGE = Path(__file__).parents[3] / "docs/guide/firmware.md"
BENCH = """
#include <stdio.h>
#include <math.h>
%s
static double now;
static int learns;
static compensator_state device;
static double late[LATE + 1];
static double wanted(double tick) { return 20 * sin(tick / 40) + 8 * sin(tick / 171); }
static double wanted_angle_deg(int later) { return wanted(now + later); }
static double measured_angle_deg(void)
{
    const double angle = compensator_observe(&device, late[((int)now + 1) %% (LATE + 1)]);
    return learns ? angle : NAN;
}
static void motor_move_to_mm(double drive) { late[(int)now %% (LATE + 1)] = drive; }
%s
int main(int count, char **words)
{
    int k;
    (void)words;
    learns = count > 1;
    compensator_init(&device);
    device.zero_deg = 0.8;
    device.gain = 1.1;
    device.width = 1.4;
    for (k = 0; k <= LATE; k++)
        late[k] = device.drive;
    at_start();
    for (now = LATE; now < 6000; now++) {
        at_every_tick();
        printf("%%.9g,%%.9g\\n", wanted(now), compensator_observe(&device, device.drive));
    }
    printf("%%.9g,%%.9g\\n", seen.gain, seen.zero_deg);
    return 0;
}
"""


@pytest.fixture
def folder(tmp_path):
    made = read_compensator(stored_fit(tmp_path / "identify.json", delay_s=0.05), "compensator")
    write_files(compensator_files(made, tmp_path))
    return tmp_path


def test_the_header_says_the_delay_and_the_drives_are_those_of_a_fit_without(folder, tmp_path):
    header = (folder / "compensator.h").read_text()
    assert "#define COMPENSATOR_DELAY_S 0.05\n" in header
    assert "Delay: the angle is 0.05 s behind the drive." in header
    other = tmp_path / "other"
    made = read_compensator(stored_fit(other / "identify.json"), "compensator")
    write_files(compensator_files(made, other))
    assert "#define COMPENSATOR_DELAY_S 0\n" in (other / "compensator.h").read_text()
    assert "Delay:" not in (other / "compensator.h").read_text()
    assert (folder / "compensator_test.csv").read_bytes() == (other / "compensator_test.csv").read_bytes()


@needs_compiler
def test_the_program_of_the_page_learns_beside_a_delay(folder):
    """The device has drifted and its angle is ten ticks late; learnt, its error falls to a twentieth or less."""
    (example,) = re.findall(r"```c\n(#define LATE .*?)```", PAGE.read_text(), re.DOTALL)
    first, rest = example.split("\n", 1)
    assert first.startswith(f"#define LATE {TICKS} ")
    source = folder / "bench.c"
    include = (folder / "compensator.c").read_text() + "\n" + first
    source.write_text(BENCH % (include, rest.replace('#include "compensator.h"\n', "")))
    program = compiled(source, "-Wno-unused-function")
    after, learnt = last_errors(program, "learn")
    assert learnt == pytest.approx([1.1, 0.8], abs=0.05)
    assert 20 * after < last_errors(program)[0]


def last_errors(program, *words):
    """Root mean square of the error of the last 2,000 ticks, deg, and what was learnt."""
    done = subprocess.run([str(program), *words], capture_output=True, text=True, check=True, timeout=60)
    rows = np.array([line.split(",") for line in done.stdout.splitlines()], dtype=float)
    error = rows[-2001:-1, 1] - rows[-2001:-1, 0]
    return float(np.sqrt(np.mean(error**2))), rows[-1]
