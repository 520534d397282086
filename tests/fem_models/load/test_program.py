"""Load programs: samples, amplitudes, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem_models.load import sine, triangle


def test_paper_program_has_the_stated_samples():
    # section 4.2: -2.2..2.2 mm and back in steps of 0.1 mm, 88 steps a cycle, entered from zero drive
    program = triangle(2.2, step_mm=0.1, cycles=10)
    assert program.drive_mm.size == 22 + 10 * 88 + 1
    assert program.drive_mm[[0, 22, 66, 110]] == pytest.approx([0, 2.2, -2.2, 2.2])
    np.testing.assert_allclose(np.abs(np.diff(program.drive_mm)), 0.1)
    assert np.bincount(program.cycle).tolist() == [23] + [88] * 10


@given(amplitude=st.floats(0.1, 10), step=st.floats(0.01, 1.0), cycles=st.integers(1, 3), rate=st.floats(0.01, 10))
def test_programs_reach_their_amplitude(amplitude, step, cycles, rate):
    for program in (
        triangle(amplitude, step_mm=min(step, amplitude), cycles=cycles),
        sine(amplitude, rate, cycles=cycles),
    ):
        assert program.drive_mm.max() == pytest.approx(amplitude)
        assert program.drive_mm.min() == pytest.approx(-amplitude)
        assert program.cycle.max() == cycles
    assert np.abs(np.diff(triangle(amplitude, step_mm=min(step, amplitude)).drive_mm)).max() <= step * (1 + 1e-9)
